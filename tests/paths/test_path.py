"""Path: joints, gaps, corners, stops, places by arc length, and what it refuses."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest

from sample_curves import KNOWN, ROOT_HALF, STILL, butterfly, ellipse, random_curve, with_cusp
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import CurveError, InputError
from splinefeed.paths.each_curve import Marker
from splinefeed.paths.path import Path

EPSILON = np.finfo(float).eps


def line(*points) -> NurbsCurve:
    """One straight line, or a polyline as one curve of degree 1."""
    count = len(points)
    return NurbsCurve(1, [0, *range(count), count - 1], points)


#: A quarter of a circle from (1, 0) to (2, 1) about (1, 1).
ARC = NurbsCurve.bezier([[1, 0], [2, 0], [2, 1]], [1.0, ROOT_HALF, 1.0])


def corners(path: Path) -> list[tuple[float, int, float, float, float]]:
    return [(c.s, c.curve, c.u, c.angle, c.curvature_jump) for c in path.corners]


# --- its length and places --------------------------------------------------------------------------------------------


def mixed() -> Path:
    """Line, rational arc, quintic, cubic spline: degrees 1, 2, 5 and 3 in one path, end to end."""
    quintic = NurbsCurve.bezier([[2, 1], [2, 1.3], [2.2, 1.6], [2.5, 1.9], [2.9, 2.1], [3.3, 2.1]])
    spline = NurbsCurve(3, [5, 5, 5, 5, 6, 8, 8, 8, 8], [[3.3, 2.1], [4, 2.1], [5, 3], [5, 1], [6, 0]])
    return Path([line([0, 0], [1, 0]), ARC, quintic, spline], name="mixed")


@pytest.mark.nojit
def test_places_by_arc_length_are_those_of_the_curves():
    path = mixed()
    lengths = [curve.length for curve in path.curves]
    assert lengths[:2] == [1.0, pytest.approx(np.pi / 2, rel=1e-15)]
    assert path.length == pytest.approx(sum(lengths), rel=1e-15)
    assert np.allclose(path.curve_starts, np.cumsum([0.0, *lengths]), rtol=1e-15)
    s = np.linspace(0.0, path.length, 301)
    index, u = path.locate(s)
    assert index.dtype == np.int64 and np.array_equal(np.unique(index), [0, 1, 2, 3])
    for k, curve in enumerate(path.curves):
        at = index == k
        assert np.abs(path.curve_starts[k] + curve.arc_length(u[at]) - s[at]).max() <= 1e-12 * path.length
        assert np.abs(path(s[at]) - curve(u[at])).max() <= 1e-15 * path.size
        for order in range(4):
            assert np.array_equal(path.evaluate(index[at], u[at], order), curve.derivatives(u[at], order))
    assert np.abs(path.arc_length(index, u) - s).max() <= 1e-12 * path.length


@pytest.mark.nojit
def test_ends_are_exact():
    path = mixed()
    index, u = path.locate([0.0, path.length])
    assert index.tolist() == [0, 3] and u.tolist() == [0.0, 8.0]
    assert np.array_equal(path(path.length), path.curves[-1](8.0))
    index, u = path.locate(path.curve_starts[1:-1])  # a joint is the start of the next curve
    assert index.tolist() == [1, 2, 3] and u.tolist() == [0.0, 0.0, 5.0]


@pytest.mark.nojit
def test_shapes_of_what_comes_back():
    path = mixed()
    s = np.linspace(0.0, path.length, 6).reshape(2, 3)
    assert path(s).shape == (2, 3, 2) and path(0.5).shape == (2,) and path([]).shape == (0, 2)
    index, u = path.locate(s)
    assert path.evaluate(index, u, 2).shape == (2, 3, 3, 2)
    assert path.evaluate(1, [0.1, 0.2], 1).shape == (2, 2, 2)
    assert np.array_equal(path.evaluate([0, 1], 0.5)[:, 0], [[0.5, 0.0], path.curves[1](0.5)])
    assert path.arc_length(index, u).shape == (2, 3)
    kink = Path([line([0, 0], [1, 0], [1, 1]), line([1, 1], [0, 1])])
    assert np.array_equal(kink.evaluate(0, 1.0, 1, side="left")[1], [1.0, 0.0])
    assert np.array_equal(kink.evaluate(0, 1.0, 1)[1], [0.0, 1.0])


@pytest.mark.parametrize("seed", range(0, 36, 5))
def test_split_curves_make_the_same_path(seed):
    curve = random_curve(seed, axes=2)
    cuts = np.random.default_rng(seed).uniform(*curve.domain, 3)
    whole, parts = Path([curve]), Path(curve.split(*cuts))
    assert abs(parts.length - whole.length) <= 1e-12 * whole.length
    s = np.linspace(0.0, min(whole.length, parts.length), 200)
    rounding = 1e-12 + 100.0 * EPSILON * max(map(abs, curve.domain)) / (curve.domain[1] - curve.domain[0])
    assert np.abs(parts(s) - whole(s)).max() <= rounding * whole.length
    assert parts.closed == whole.closed
    back = parts.reversed()
    assert np.abs(back(s) - whole((whole.length - s).clip(0.0))).max() <= rounding * whole.length


@pytest.mark.nojit
def test_rotary_axes_have_no_length_by_the_tip():
    helix = NurbsCurve.bezier([[0, 0, 0], [1, 0, 40], [2, 0, -30], [3, 4, 1]])
    flat = NurbsCurve.bezier([[0, 0], [1, 0], [2, 0], [3, 4]])
    path = Path([helix], axes=("x", "y", "theta"), by_tip=True)
    assert path.linear == 2 and path.length == flat.length
    assert Path([helix], axes=("x", "y", "theta")).length > path.length
    s = np.linspace(0.0, path.length, 40)
    assert np.array_equal(path(s)[:, :2], Path([flat])(s))
    low, high = path.bounding_box()
    assert low.shape == high.shape == (3,) and high[2] - low[2] > 5.0
    turned = Path([helix, line([3, 4, 1], [3, 9, 77])], axes=("x", "y", "theta"), by_tip=True)
    assert turned.length == pytest.approx(path.length + 5.0, rel=1e-15)


@pytest.mark.nojit
def test_closed_paths():
    assert Path([ellipse(3.0, 2.0)]).closed
    assert Path([line([0, 0], [1, 0], [1, 1]), line([1, 1], [0, 0])]).closed
    assert not mixed().closed
    winding = NurbsCurve.bezier([[0, 0, 0], [1, 0, 1], [0, 1, 2], [0, 0, 6.3]])
    assert Path([winding], axes=("x", "y", "c")).closed
    assert not Path([winding]).closed


def test_a_long_path_of_equal_parts_keeps_its_last_digit():
    parts = [line([0.1 * k, 0.0], [0.1 * (k + 1), 0.0]) for k in range(2000)]
    path = Path(parts)
    assert abs(path.length - 200.0) <= 2e-13
    assert np.abs(path.curve_starts - 0.1 * np.arange(2001)).max() <= 2e-13


def test_ten_thousand_short_lines():
    corners = np.cumsum(np.random.default_rng(0).normal(size=(10_001, 2)), axis=0)
    path = Path([NurbsCurve.bezier(pair) for pair in itertools.pairwise(corners)])
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    wanted = np.concatenate([[0.0], np.cumsum(lengths, dtype=np.longdouble).astype(float)])
    assert np.abs(path.curve_starts - wanted).max() <= 4.0 * EPSILON * wanted[-1]
    s = np.linspace(0.0, path.length, 20_001)
    expected = np.column_stack([np.interp(s, wanted, corners[:, axis]) for axis in range(2)])
    assert np.abs(path(s) - expected).max() <= 1e-11
    assert len(path.corners) == len(path.stops) == 9_999
    assert path.minimum_radius() == np.inf


# --- corners ----------------------------------------------------------------------------------------------------------


@pytest.mark.nojit
def test_polyline_turns_at_its_points():
    for path in (
        Path([line([0, 0], [1, 0], [1, 1], [2, 2], [1, 1])]),
        Path([line([0, 0], [1, 0]), line([1, 0], [1, 1], [2, 2]), line([2, 2], [1, 1])]),
    ):
        assert [c.s for c in path.corners] == pytest.approx([1.0, 2.0, 2.0 + np.sqrt(2.0)], rel=1e-15)
        assert [c.angle for c in path.corners] == pytest.approx([np.pi / 2, np.pi / 4, np.pi], rel=1e-14)
        assert [c.curvature_jump for c in path.corners] == [0.0, 0.0, 0.0]
        assert path.stops == tuple(c.s for c in path.corners)


@pytest.mark.nojit
def test_line_into_arc_jumps_in_curvature_and_does_not_stop():
    path = Path([line([0, 0], [1, 0]), ARC, line([2, 1], [2, 3])])
    assert [c.s for c in path.corners] == pytest.approx([1.0, 1.0 + np.pi / 2], rel=1e-15)
    assert [c.angle for c in path.corners] == pytest.approx([0.0, 0.0], abs=1e-15)
    assert [c.curvature_jump for c in path.corners] == pytest.approx([1.0, 1.0], rel=1e-14)
    assert [(c.curve, c.u) for c in path.corners] == [(0, 1.0), (1, 1.0)]
    assert path.stops == () and not any(c.stop for c in path.corners)
    assert path.minimum_radius() == pytest.approx(1.0, rel=1e-14)


@pytest.mark.nojit
def test_smooth_joints_are_no_corners():
    assert not len(Path([ellipse(3.0, 2.0)]).corners)  # its arcs meet with equal curvature
    assert not len(Path(butterfly().split(0.1, 0.25, 0.5, 0.77)).corners)
    assert not len(Path([butterfly()]).corners)
    assert not len(Path(KNOWN["line of many points"].split(0.3, 0.6)).corners)
    for far in (1e3, 1e6):
        pieces = [c.transformed(1.0, [far, -far]) for c in ellipse(3.0, 2.0).split(0.5, 1.7, 3.1)]
        assert not len(Path(pieces).corners)


@pytest.mark.nojit
def test_inner_knots_of_full_multiplicity_turn_the_tangent():
    curve = NurbsCurve(3, [0, 0, 0, 0, 1, 1, 1, 3, 3, 3, 3], [[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [3, 2], [4, 4]])
    path = Path([curve])
    assert len(path.corners) == 1
    corner = path.corners[0]
    assert (corner.curve, corner.u, corner.stop) == (0, 1.0, True)
    assert corner.angle == pytest.approx(np.pi / 2, rel=1e-15)
    assert corner.s == pytest.approx(3.0, rel=1e-15)
    assert path.stops == (corner.s,)


@pytest.mark.nojit
def test_inner_knots_of_one_less_jump_in_curvature():
    # C' is continuous at u = 1, C'' is not
    curve = NurbsCurve(3, [0, 0, 0, 0, 1, 1, 2, 2, 2, 2], [[0, 1], [1, 0], [2, 0.5], [4, -0.5], [5, 3], [6, -2]])
    (corner,) = Path([curve]).corners
    assert corner.angle <= 1e-15 and not corner.stop
    before, after = curve.derivatives(1.0, 2, side="left"), curve.derivatives(1.0, 2)
    bends = [(d[1, 0] * d[2, 1] - d[1, 1] * d[2, 0]) / np.hypot(*d[1]) ** 3 for d in (before, after)]
    assert corner.curvature_jump == pytest.approx(abs(bends[1] - bends[0]), rel=1e-12)
    assert corner.curvature_jump > 0.1


@pytest.mark.nojit
def test_joints_where_the_curve_stands_still_use_the_limit_of_the_tangent():
    slow = NurbsCurve.bezier([[0, 0], [0, 0], [1, 0], [2, 0], [2, 0]])  # straight, from rest to rest
    assert not len(Path([line([-1, 0], [0, 0]), slow, line([2, 0], [3, 0])]).corners)
    (corner,) = Path([slow, line([2, 0], [2, 5])]).corners
    assert corner.angle == pytest.approx(np.pi / 2, rel=1e-15) and corner.stop
    assert corner.curvature_jump == 0.0
    still = NurbsCurve.bezier([[2, 0]] * 8 + [[2, 3]])
    (corner,) = Path([slow, still]).corners
    assert corner.angle == pytest.approx(np.pi / 2, rel=1e-15)
    # a control point three times in a cubic: C' = C'' = 0 at a simple knot, where the polygon turns
    knots = [0, 0, 0, 0, 1, 2, 3, 4, 4, 4, 4]
    (corner,) = Path([NurbsCurve(3, knots, [[0, 0], [1, 1], [2, 2], [2, 2], [2, 2], [3, 0], [4, -2]])]).corners
    assert corner.angle == pytest.approx(np.pi / 4 + np.arctan(2.0), rel=1e-14)
    assert corner.u == 2.0 and corner.s == pytest.approx(np.hypot(2.0, 2.0), rel=1e-14)


@pytest.mark.nojit
def test_a_point_given_twice_is_one_corner_or_none():
    assert len(Path([line([0, 0], [1, 0], [1, 0], [1, 1], [1, 1], [1, 2])]).corners) == 1
    (corner,) = Path([line([0, 0], [1, 0], [1, 0]), line([1, 0], [1, 2])]).corners
    assert corner.angle == pytest.approx(np.pi / 2, rel=1e-15)


@pytest.mark.nojit
@pytest.mark.parametrize("at", [0.5, 1.0 / 3.0, 0.1, 0.9985])
def test_a_cusp_inside_a_span_is_a_stop(at):
    for axes in (1, 2, 3):
        curve = with_cusp(at, degree=3, axes=axes, seed=1)
        path = Path([curve])
        (sharp,) = [c for c in path.corners if c.stop]
        assert np.pi - 0.05 < sharp.angle <= np.pi
        assert sharp.u == pytest.approx(at, abs=1e-9)
        assert sharp.s == pytest.approx(curve.arc_length(at), abs=1e-6)
        assert path.stops == (sharp.s,)


@pytest.mark.nojit
def test_slow_places_that_go_on_are_no_cusps():
    assert len(Path([STILL["cusp in the middle"]]).stops) == 1
    assert len(Path([STILL["near cusp, 1e-9"]]).stops) == 1  # its radius is 1e-18 of its size
    assert len(Path([STILL["near cusp, 1e-4"]]).stops) == 1  # and here 1e-8, below the resolution
    inflection = with_cusp(0.5, degree=4, axes=1)  # and (u - 1/2)^3 stands still without turning
    assert len(Path([inflection]).corners) >= 1
    cube = NurbsCurve.bezier([[-1.0], [1.0], [-1.0], [1.0]])  # (2 u - 1)^3
    assert not len(Path([cube]).corners) and cube.length == pytest.approx(2.0, rel=1e-15)


@pytest.mark.nojit
def test_corners_come_in_order():
    cusp = with_cusp(0.4, degree=4, seed=3)
    tail = cusp.control_points[-1]
    path = Path([line(tail + [0, -2], tail + [1, -1], cusp.control_points[0]), cusp, line(tail, tail + [1, 1], tail)])
    places = [c.s for c in path.corners]
    assert places == sorted(places) and len(places) == 5
    assert [c.curve for c in path.corners] == [0, 0, 1, 1, 2]


@pytest.mark.nojit
def test_a_corner_below_the_rounding_of_files_is_none():
    for angle, count, stops in ((1e-8, 0, 0), (1e-5, 1, 0), (1e-3, 1, 1)):
        path = Path([line([0, 0], [1, 0], [1 + np.cos(angle), np.sin(angle)])])
        assert (len(path.corners), len(path.stops)) == (count, stops)
        if count:
            assert path.corners[0].angle == pytest.approx(angle, rel=1e-9)


# --- what it is, and what it refuses ----------------------------------------------------------------------------------


@pytest.mark.nojit
def test_a_path_cannot_be_changed():
    path = mixed()
    for array in (path.table, path.curve_starts, path.curve_rows):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(AttributeError, match="a Path cannot be changed: tried to set 'name'; make a new one"):
        path.name = "other"
    assert isinstance(path.curves, tuple) and isinstance(path.axes, tuple) and isinstance(path.findings, tuple)


@pytest.mark.nojit
def test_control_points_before_more_knots_than_the_degree_are_no_part_of_it():
    first = NurbsCurve(1, [0, 0, 0, 1, 1], [[9, 9], [0, 0], [1, 1]])
    path = Path([NurbsCurve.bezier([[5, 5], [0, 0]]), first])
    assert path.ends[1].tolist() == [[0, 0], [1, 1]] and path.reversed()(0.0).tolist() == [1, 1]


@pytest.mark.nojit
def test_pickles_are_the_same_path():
    path = Path(mixed().curves, ("u", "v"), name="there", findings=["a gap was closed"], tolerance=0.5)
    length = path.length
    for other in (pickle.loads(pickle.dumps(path)), path.reversed().reversed()):
        assert (other.curves, other.axes, other.name, other.findings, other.tolerance) == (
            path.curves, path.axes, "there", ("a gap was closed",), 0.5,
        )  # fmt: skip
        assert other.length == length
    assert repr(path) == "Path('there', 4 curve(s), axes u v, " + f"{length:.6g} mm)"


@pytest.mark.nojit
def test_images():
    path = mixed()
    bigger = path.transformed(3.0, [1.0, 1.0])
    assert bigger.length == pytest.approx(3.0 * path.length, rel=1e-14)
    low, high = path.bounding_box()
    moved_low, moved_high = bigger.bounding_box()
    assert np.allclose([moved_low, moved_high], 3.0 * np.array([low, high]) + 1.0, rtol=1e-14, atol=1e-14)


@pytest.mark.nojit
def test_gaps():
    first, second = line([0, 0], [1, 0]), line([1, 0.25], [2, 0])
    with pytest.raises(CurveError) as caught:
        Path([first, line([1, 0], [0, 0]), line([0, 0], [1, 0]), second])
    assert str(caught.value) == (
        "gap of 0.25 mm between the end of curve 2 and the start of curve 3; join them, or allow it with tolerance="
    )
    path = Path([first, second], tolerance=0.3)
    assert path.gaps == (0.25,)
    assert Path([first, line([1, 5e-7], [2, 0])]).gaps == (pytest.approx(5e-7),)


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda a, b: Path([]), "a path needs at least one curve"),
        (lambda a, b: Path([a, "b"]), "curve 1 of the path is a str; expected a NurbsCurve"),
        (lambda a, b: Path(a), "curves are a NurbsCurve; expected a list of NurbsCurve"),
        (lambda a, b: Path([a, b]), "curve 1 has 3 axes, curve 0 has 2; all must agree"),
        (lambda a, b: Path([a], axes=("x",)), "axes ('x',) for curves of 2 axes; expected one distinct name each"),
        (lambda a, b: Path([a], axes="xx"), "axes ('x', 'x') for curves of 2 axes; expected one distinct name each"),
        (
            lambda a, b: Path([b], axes=("x", "a", "y")),
            "axes ('x', 'a', 'y'): put the linear axes first and the rotary ones (a, b, c, theta) last",
        ),
        (lambda a, b: Path([a], tolerance=-1.0), "tolerance is -1 mm; it must be 0 or more"),
        (lambda a, b: Path([a], tolerance=np.nan), "tolerance is nan mm; it must be 0 or more"),
        (lambda a, b: Path([a]).locate(1.5), "arc length 1.5 mm is outside the path's [0, 1] mm"),
        (lambda a, b: Path([a]).locate([0.0, -0.1]), "arc length -0.1 mm is outside the path's [0, 1] mm"),
        (lambda a, b: Path([a])(np.nan), "arc length nan mm is outside the path's [0, 1] mm"),
        (lambda a, b: Path([a]).evaluate(0, 2.0), "parameter 2 is outside the curve's domain [0, 1]"),
        (lambda a, b: Path([a]).evaluate(1, 0.5), "curve 1 does not exist; the path has curves 0 to 0"),
        (lambda a, b: Path([a, a.reversed()]).evaluate(-1, 0.5), "curve -1 does not exist; the path has curves 0 to 1"),
        (lambda a, b: Path([a, a.reversed()]).arc_length(2, 0.5), "curve 2 does not exist; the path has curves 0 to 1"),
        (lambda a, b: Path([a]).arc_length(0, 1.5), "parameter 1.5 is outside the curve's domain [0, 1]"),
    ],
)
def test_refused_with_these_words(make, said):
    with pytest.raises(InputError) as caught:
        make(line([0, 0], [1, 0]), line([0, 0, 0], [1, 0, 0]))
    assert str(caught.value) == said


def program():
    """Three lines in one direction, a stop of 2 s and one of 0.5 s at one place, and a word in motion."""
    lines = [NurbsCurve(1, [0, 0, 1, 1], [[x, 0.0], [x + 1.0, 0.0]]) for x in (0.0, 1.0, 2.0)]
    markers = [
        Marker(1, "G4 P2", dwell=2.0),
        Marker(0, "M3 S9000"),
        Marker(1, "M8", dwell=0.5),
        Marker(2, "S8000", stop=False),
    ]
    return Path(lines, feeds=[10.0, np.inf, 20.0], tolerances=[0.0, 0.01, 0.01], markers=markers)


def test_what_a_program_says_is_kept():
    path = program()
    assert path.feeds.tolist() == [10.0, np.inf, 20.0]
    assert [marker.text for marker in path.markers] == ["M3 S9000", "G4 P2", "M8", "S8000"]
    assert path.stops == (1.0,)
    assert path.dwells == ((1.0, 2.5),)
    turned = path.reversed()
    assert turned.feeds.tolist() == [20.0, np.inf, 10.0]
    assert turned.tolerances.tolist() == [0.01, 0.01, 0.0]
    assert [(marker.before, marker.text) for marker in turned.markers] == [
        (1, "S8000"),
        (2, "M8"),
        (2, "G4 P2"),
        (3, "M3 S9000"),
    ]
    again = pickle.loads(pickle.dumps(path.transformed(2.0 * np.eye(2))))
    assert again.feeds.tolist() == path.feeds.tolist()
    assert again.markers == path.markers
    assert again.dwells == ((2.0, 2.5),)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"feeds": [1.0]}, "feeds has 1 numbers for 3 curves"),
        ({"feeds": [1.0, 0.0, 1.0]}, "feeds\\[1\\] is 0; it must be greater than 0"),
        ({"feeds": [1.0, float("nan"), 1.0]}, "feeds\\[1\\] is nan"),
        ({"tolerances": [0.0, 0.0, -1.0]}, "tolerances\\[2\\] is -1; it must be 0 or more"),
        ({"markers": [Marker(4, "M2")]}, "marker 'M2' is before curve 4 of 3"),
    ],
)
def test_what_a_program_says_must_fit(said, message):
    with pytest.raises(InputError, match=message):
        Path(program().curves, **said)
    with pytest.raises(InputError, match="the tool can wait only at rest"):
        Marker(0, "G4", dwell=1.0, stop=False)
    with pytest.raises(InputError, match="it must be 0 or more and finite"):
        Marker(0, "G4", dwell=float("inf"))
