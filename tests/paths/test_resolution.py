"""What is smaller than 1 nm is decided where a path is built: finite derivatives within 1 nm of what was given."""

from __future__ import annotations

import time

import numpy as np
import pytest

import splinefeed as sf
from sample_curves import KNOWN, TIPS, bent, butterfly, random_curve
from splinefeed.curves.differential import by_arc_length
from splinefeed.curves.packed import Flat
from splinefeed.paths.each_curve import Marker
from splinefeed.paths.path import Path
from splinefeed.paths.resolution import RESOLUTION, Seen, _together
from splinefeed.records import Array

bezier = sf.NurbsCurve.bezier


@pytest.mark.parametrize("name", TIPS)
def test_next_to_tips_derivatives_are_finite_and_the_curve_stays_within_a_nanometre(name: str) -> None:
    curve = TIPS[name]
    path = Path([curve])
    (new,) = path.joined
    assert path.curves[0] is curve and new is not curve
    assert new.domain == curve.domain and np.array_equal(new.ends, curve.ends)
    tips = np.array([0.0, *path.stops, path.length])
    away = np.logspace(-13.0, 0.0, 400)
    s = np.concatenate([(tips[:, None] + side * away).ravel() for side in (-1.0, 1.0)])
    s = s[(s > 0.0) & (s < path.length)]
    places, u = path.locate(s)
    d = by_arc_length(path.evaluate(places, u, 3), path.linear)
    assert np.isfinite(d).all()
    assert np.linalg.norm(d[:, 1], axis=1) == pytest.approx(np.ones(len(s)), abs=1e-12)
    assert np.max(np.linalg.norm(d[:, 2], axis=1)) <= 2.0 / RESOLUTION
    # both ways: the new one near the old one, and the old one near the new one
    assert np.max(curve.nearest(new(np.linspace(*curve.domain, 4001)))[1]) <= RESOLUTION
    assert np.max(curve.nearest(d[:, 0])[1]) <= RESOLUTION
    assert np.max(new.nearest(curve(np.linspace(*curve.domain, 4001)))[1]) <= RESOLUTION
    # tangent and curvature go on where it joins
    jumps = [c.curvature_jump for c in path.corners if not c.stop and c.angle < 1e-9]
    assert max(jumps, default=0.0) <= 1e-4


@pytest.mark.parametrize("radius", [0.0, 1e-8, 1e-7, 5e-7, 2e-6, 1e-5, 1e-4, 1e-3])
def test_a_bend_is_a_corner_below_the_resolution_and_a_bend_above(radius: float) -> None:
    path = Path([bent(radius)])
    if radius < RESOLUTION:
        (corner,) = path.corners
        assert corner.stop and corner.u == pytest.approx(0.5, abs=1e-4)
        assert corner.angle > (3.0 if radius < 5e-8 else 1.5)
    else:
        assert path.joined[0] is path.curves[0] and len(path.corners) == 0


@pytest.mark.parametrize("rational", [False, True])
def test_what_goes_straight_back_turns_by_pi(rational: bool) -> None:
    (corner,) = Path([bezier([[0, 0], [3, 4], [0, 0]], [1, 2, 1] if rational else None)]).corners
    assert corner.angle == pytest.approx(np.pi, abs=1e-12)


@pytest.mark.parametrize("seed", range(0, 72, 2))
def test_slowest_places_of_all_spans_at_once_are_those_of_each(seed: int) -> None:
    """Against the sign of C' . C'' along each span: where it goes from - to + the curve is slowest."""
    curve = random_curve(seed)
    if curve.degree == 1:
        return
    breaks = curve.breaks
    spans = np.column_stack([breaks[:-1], breaks[1:]])
    seen = Seen(Flat.of([curve]), RESOLUTION)

    def slowest(some: Array) -> Array:
        return seen.slowest(np.zeros(len(some), dtype=int), *some.T)[1]

    every = slowest(spans)
    assert np.array_equal(np.sort(every), np.sort(np.concatenate([slowest(span[None]) for span in spans])))
    some = slowest(spans[::2])
    assert np.array_equal(np.sort(some), np.sort(np.concatenate([slowest(span[None]) for span in spans[::2]])))
    for low, high in spans.tolist():
        u = np.linspace(low, high, 2003)[1:-1]
        d = curve.derivatives(u, 2)
        slope = np.sum(d[:, 1] * d[:, 2], axis=1)
        k = np.flatnonzero((slope[:-1] < 0.0) & (slope[1:] > 0.0))
        near = np.abs(u[k, None] - every).min(axis=1, initial=np.inf)
        assert np.all(near <= 1.01 * (u[1] - u[0]))


def test_what_has_nothing_small_is_what_it_was() -> None:
    curves = [butterfly(), *(KNOWN[name] for name in ("circle", "ellipse", "unequal spans", "figure eight"))]
    curves += [random_curve(seed, axes=2) for seed in (1, 2, 3)]
    for curve in curves:
        path = Path([curve])
        assert path.joined[0] is curve and path.findings == ()
    lines = Path.polyline(np.cumsum(np.ones((9, 2)), axis=0))
    assert lines.joined is lines.curves


def test_many_tips_at_once_are_as_each_alone() -> None:
    kinds = [
        bent(0.0),
        bent(1e-7),
        bezier([[0, 0], [0, 0], [5, 1], [9, 0]]),
        bezier([[0, 0], [3, 4], [0, 0]], [1, 2, 1]),
    ]
    kinds += [TIPS[name] for name in TIPS if TIPS[name].axes == 2]
    moved, at = [], np.zeros(2)
    for curve in kinds * 3:
        moved.append(curve.transformed(1.0, at - curve.ends[0]))
        at = moved[-1].ends[1]
    for curve, one in zip(moved, Path(moved, tolerance=1e-9).joined, strict=True):
        (alone,) = Path([curve]).joined
        assert one.knots == pytest.approx(alone.knots, rel=1e-9, abs=1e-9)
        assert one.control_points == pytest.approx(alone.control_points, rel=0.0, abs=1e-8)


def test_a_tiny_path_has_a_finer_resolution() -> None:
    for size in (1e-6, 1.0, 1e3):
        assert len(Path([bent(0.0, size)]).stops) == 1
    assert Path([bent(1e-8, 1e-3)]).stops == ()  # 1e-5 of its size
    assert len(Path.polyline(1e-8 * np.array([[0, 0], [1, 0], [1, 1]])).curves) == 2


def test_short_curves_are_left_out_with_their_feeds_and_markers_stay_in_place() -> None:
    points = np.array([[0.0, 0.0], [10.0, 0.0], [10.0 + 3e-7, 3e-7], [20.0, 0.0], [20.0, 5.0]])
    said = {"feeds": [10.0, 20.0, 30.0, 40.0], "tolerances": [0.1, 0.2, 0.3, 0.4]}
    markers = [Marker(before, "M0", 0.1) for before in range(5)]
    curves = [bezier(points[k : k + 2]) for k in range(4)]
    for path in (Path.polyline(points, markers=markers, **said), Path(curves, markers=markers, **said)):
        assert path.findings == ("1 curve(s) shorter than 1 nm left out, the first curve 1",)
        assert len(path.curves) == 3 and path.feeds is not None and path.tolerances is not None
        assert path.feeds.tolist() == [10.0, 30.0, 40.0] and path.tolerances.tolist() == [0.1, 0.3, 0.4]
        assert [marker.before for marker in path.markers] == [0, 1, 1, 2, 3]
        assert [s for s, _ in path.dwells] == pytest.approx([0.0, 10.0, 20.0, 25.0], abs=1e-6)
        assert path.dwells[1][1] == pytest.approx(0.2)
        assert path.gaps == pytest.approx([0.0, 0.0], abs=1e-15) or max(path.gaps) <= RESOLUTION
        assert path.stops == pytest.approx([10.0, 20.0], abs=1e-6)


def test_a_first_short_line_keeps_the_start() -> None:
    path = Path.polyline([[0.0, 0.0], [1e-7, 1e-7], [10.0, 0.0]])
    assert len(path.curves) == 1 and path(0.0).tolist() == [0.0, 0.0] and path(path.length).tolist() == [10.0, 0.0]


def test_rotary_axes_that_turn_at_a_tip_keep_their_course() -> None:
    """x goes there and back while a turns on: the length of all axes is regular there, and nothing is a tip."""
    curve = bezier([[0.0, 0.0], [10.0, 0.5], [0.0, 1.0]])
    path = Path([curve], ("x", "a"))
    assert len(path.stops) == 0
    u = np.linspace(0.0, 1.0, 101)
    assert path.evaluate(np.zeros(101, dtype=int), u)[:, 0] == pytest.approx(curve(u), abs=1e-12)


def test_under_a_tool_axis_a_cusp_is_a_corner_and_the_tip_goes_where_it_did() -> None:
    tip = bezier(np.column_stack([bent(0.0).control_points, np.zeros(4)]))
    path = sf.ToolPath(tip, bezier([[0.0, 0.0, 1.0], [0.0, 0.1, 1.0]]), kind="vectors")
    (corner,) = path.corners
    assert corner.stop and corner.angle == np.pi and corner.u == pytest.approx(0.5, abs=1e-9)
    u = np.linspace(0.0, 1.0, 101)
    assert path.evaluate(np.zeros(101, dtype=int), u)[:, 0] == pytest.approx(tip(u), abs=1e-13)


def test_two_tips_in_a_span_that_meet_but_for_rounding() -> None:
    """Midway between two tips the pieces beside them ended 1e-17 apart, which no curve may have as two knots."""
    knots = [
        -0.5312064205090573,
        -0.5195589098345617,
        -0.38686579420250855,
        -0.3746450876876585,
        -0.29025210127185774,
        -0.053696635817391924,
        -0.015720248939142256,
        0.0,
        0.22193415210967413,
        0.23264338357501532,
        0.4102945861990642,
        0.4266272247950056,
        0.4382747354695012,
        0.5709678511015543,
        0.5831885576164044,
        0.6675815440322052,
        0.904137009486671,
        0.9421133963649206,
        0.9578336453040629,
        1.179767797413737,
        1.1904770288790782,
        1.3681282315031271,
        1.3844608700990686,
        1.3961083807735641,
        1.5288014964056171,
        1.5410222029204674,
    ]
    points = [
        509828.73595086276,
        509826.35731131054,
        509826.80926521716,
        509827.55113335286,
        509826.50005951145,
        509826.9596692561,
        509827.5735110667,
        509826.2619618866,
        509828.0708449068,
        509828.27914551715,
        509826.7769934559,
        509828.73595086276,
        509826.35731131054,
        509826.80926521716,
        509827.55113335286,
        509826.50005951145,
        509826.9596692561,
        509827.5735110667,
    ]
    path = sf.Path([sf.NurbsCurve(7, knots, np.array(points)[:, None])], axes=("x",))
    least = np.abs(path.curves[0].derivatives(np.linspace(*path.curves[0].domain, 2001), 1)[:, 1]).min()
    assert len(path.corners.s) >= 8
    assert least > 0.0


def test_parameters_next_to_knots_and_to_each_other_are_one_in_time_in_proportion_to_their_number() -> None:
    knots = np.r_[np.zeros(3), np.linspace(0.0, 1.0, 6001), np.ones(3)]
    at = _together(sf.NurbsCurve(3, knots, np.zeros((6003, 2)) + np.arange(6003.0)[:, None]))
    given = np.random.default_rng(1).uniform(0.0, 1.0, 6000)
    began = time.process_time()
    assert [at(u) for u in given.tolist()] == given.tolist()
    assert [at(u + 1e-17) for u in given.tolist()] == given.tolist()
    assert [at(u) for u in (knots + 1e-16).tolist()] == knots.tolist()
    assert time.process_time() - began < 1.0  # some 15 s where each looks at all
