"""Paths of linear and rotary axes: lengths, stops, and the way from a plan to a check that holds."""

from __future__ import annotations

import dataclasses
import math

import numba
import numpy as np
import pytest

import splinefeed as sf
from splinefeed.analysis.following import ContourMeter
from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.metric import RADIUS
from splinefeed.errors import LimitsError
from splinefeed.paths.path import Path
from splinefeed.runs.long_path import parts_of

HALF = 0.5 * np.pi
LINE = NurbsCurve.bezier


def paths() -> dict[str, Path]:
    circle = [[3, 1, 0], [3, 1, 1], [3, 0, 1]]
    mixed = [
        LINE([[0, 0, 0, 0], [10, 0, 0, 1], [10, 10, 2, 3], [0, 10, 5, 4]]),
        LINE([[0, 10, 5, 4], [0, 10, 5, 2]]),
        LINE([[0, 10, 5, 2], [-5, 10, 5, 2]]),
    ]
    return {
        "a alone": Path([LINE([[0.0], [HALF]])], axes=("a",)),
        "x, a, x": Path.polyline([[0, 0], [10, 0], [10, HALF], [30, HALF]], axes=("x", "a")),
        "helix, a, x": Path(mixed, axes=("x", "y", "z", "a")),
        "an arc of b and c": Path([LINE(circle, [1.0, math.sqrt(0.5), 1.0])], axes=("x", "b", "c")),
    }


PATHS = paths()


def limits(path: Path) -> sf.Limits:
    def of(linear: float, rotary: float) -> dict[str, float]:
        return {axis: linear if k < path.linear else rotary for k, axis in enumerate(path.axes)}

    return sf.Limits(feed=60, axis_velocity=of(50, 1.0), axis_acceleration=of(500, 5.0), axis_jerk=of(2e4, 100.0))


@pytest.mark.nojit
def test_the_tip_counts_degrees_where_only_rotary_axes_move():
    lengths = {name: float(path.tip_length(path.length)) for name, path in PATHS.items()}
    assert lengths["a alone"] == PATHS["a alone"].length == pytest.approx(90.0, rel=1e-15)
    assert lengths["x, a, x"] == pytest.approx(120.0, rel=1e-15)
    assert lengths["an arc of b and c"] == pytest.approx(90.0, rel=1e-13)  # a quarter of a circle of 1 rad
    helix = PATHS["helix, a, x"]
    starts = helix.tip_length(helix.curve_starts)
    assert np.diff(starts)[1:] == pytest.approx([math.degrees(2.0), 5.0], rel=1e-14)
    plain = LINE(helix.curves[0].control_points[:, :3])
    assert starts[1] == pytest.approx(plain.length, rel=1e-12)


@pytest.mark.nojit
def test_the_length_counts_all_axes_a_rad_as_50_mm():
    path = PATHS["x, a, x"]
    turn = RADIUS * HALF
    assert path.length == pytest.approx(30.0 + turn, rel=1e-15)
    s = np.array([5.0, 10.0, 10.0 + turn / 2, 10.0 + turn, 20.0 + turn])
    assert np.allclose(path(s), [[5, 0], [10, 0], [10, HALF / 2], [10, HALF], [20, HALF]], rtol=1e-15)
    index, u = path.locate(s)
    assert index.tolist() == [0, 1, 1, 2, 2]
    assert path.arc_length(index, u) == pytest.approx(s, rel=1e-15)
    assert (path.linear, path.mixed, PATHS["a alone"].mixed) == (1, True, False)
    helix = PATHS["helix, a, x"]
    scaled = LINE(helix.curves[0].control_points * [1, 1, 1, RADIUS])
    assert helix.curve_starts[1] == pytest.approx(scaled.length, rel=1e-13)


@pytest.mark.nojit
def test_several_axes_count_by_their_euclidean_norm():
    path = Path.polyline([[1, 0, 0], [1, 0.3, 0.4], [1, 0.3, 0.0]], axes=("x", "b", "c"))
    assert np.diff(path.curve_starts) == pytest.approx([0.5 * RADIUS, 0.4 * RADIUS], rel=1e-14)
    assert np.diff(path.tip_length(path.curve_starts)) == pytest.approx(np.degrees([0.5, 0.4]), rel=1e-14)
    assert path.stops == (path.curve_starts[1],)
    cubic = LINE([[1, 0, 0], [1, 0.2, 0.1], [1, 0.1, 0.5], [1, 1, 1]])
    flat = LINE(np.degrees(cubic.control_points[:, 1:]))
    tip = Path([cubic], axes=("x", "b", "c"))
    assert float(tip.tip_length(tip.length)) == pytest.approx(flat.length, rel=1e-13)


@pytest.mark.nojit
def test_the_tip_by_the_length_is_what_differences_say():
    path = PATHS["helix, a, x"]
    s = np.linspace(0.5, path.curve_starts[1] - 0.5, 40)
    h = 1e-3
    near = path.tip_length(s[:, None] + h * np.arange(-2, 3))
    first, second, third = path.tip(path.derivatives(s))
    assert (near[:, 3] - near[:, 1]) / (2 * h) == pytest.approx(first, rel=1e-6)
    assert (near[:, 3] - 2 * near[:, 2] + near[:, 1]) / h**2 == pytest.approx(second, abs=1e-6)
    assert np.diff(second) / np.diff(s) == pytest.approx(0.5 * (third[1:] + third[:-1]), abs=2e-3)


@pytest.mark.nojit
def test_a_span_of_one_curve_that_only_turns():
    """A polyline in one curve: x, then a, then x again, joined at knots."""
    points = [[0, 0], [10, 0], [10, HALF], [30, HALF]]
    one = Path([NurbsCurve(1, [0, 0, 1, 2, 3, 3], points)], axes=("x", "a"))
    many = PATHS["x, a, x"]
    assert one.length == pytest.approx(many.length, rel=1e-15)
    assert one.stops == pytest.approx(many.stops, rel=1e-15)
    s = np.linspace(0.0, one.length, 97)
    assert np.allclose(one(s), many(s), atol=1e-13)
    assert np.allclose(one.tip_length(s), many.tip_length(s), atol=1e-12)


@pytest.mark.nojit
def test_joints_to_and_from_a_move_of_rotary_axes_alone_are_stops():
    assert PATHS["x, a, x"].stops == tuple(PATHS["x, a, x"].curve_starts[1:-1])
    assert PATHS["x, a, x"].corners.angle == pytest.approx([HALF, HALF], rel=1e-15)
    assert PATHS["helix, a, x"].stops == tuple(PATHS["helix, a, x"].curve_starts[1:-1])
    turns = Path.polyline([[0.0], [1.0], [2.0], [1.5]], axes=("a",))  # on in the same direction, then back
    assert turns.stops == (turns.curve_starts[2],)
    assert turns.corners.angle == pytest.approx([np.pi], rel=1e-15)
    corner = Path.polyline([[0, 0, 0], [0, 1, 0], [0, 1, 1]], axes=("x", "b", "c"))  # b, then c
    assert corner.corners.angle == pytest.approx([HALF], rel=1e-15)


@pytest.mark.nojit
def test_a_rotary_axis_that_sets_off_at_once_is_a_stop():
    """x goes on, a begins to turn by a 50th of a rad a millimetre: the tangent of all axes turns by 45 degrees."""
    step = 10.0 / RADIUS
    path = Path.polyline([[0, 0], [10, 0], [20, step], [30, 2.0 * step], [40, 2.0 * step]], axes=("x", "a"))
    assert float(path.tip_length(path.length)) == pytest.approx(40.0, rel=1e-15)
    assert path.corners.angle == pytest.approx([np.pi / 4, np.pi / 4], rel=1e-12)
    assert path.stops == pytest.approx([10.0, 10.0 + 20.0 * math.sqrt(2.0)], rel=1e-15)


@pytest.mark.nojit
def test_cusps_of_rotary_axes_are_found():
    there = NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[5, 0], [5, 1.0], [5, 0]])
    path = Path([there], axes=("x", "a"))
    assert path.length == pytest.approx(RADIUS, rel=1e-12)
    (corner,) = path.corners
    assert corner.u == pytest.approx(0.5, abs=1e-9) and corner.angle == np.pi


@pytest.mark.nojit
@pytest.mark.parametrize("name", PATHS)
def test_derivatives_by_arc_length_have_unit_length(name):
    path = PATHS[name]
    s = np.linspace(0.0, path.length, 200)
    curve, u = path.locate(s)
    first, _, third = np.moveaxis(path.by_length(curve, u)[:, 1:], 1, 0)
    assert np.isfinite(third).all()
    assert np.linalg.norm(first * path.metric, axis=1) == pytest.approx(np.ones(200), rel=1e-12)
    h = 1e-4 * path.length
    middle = s[(s > 2 * h) & (s < path.length - 2 * h)]
    middle = middle[np.all(np.abs(middle[:, None] - np.array([-1.0, *path.stops])) > 2 * h, axis=1)]
    curve, u = path.locate(middle)
    exact = path.by_length(curve, u)
    for order, wanted in ((1, (path(middle + h) - path(middle - h)) / (2.0 * h)),):
        assert np.abs(exact[:, order] - wanted).max() <= 1e-5 * np.abs(exact[:, order]).max()


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("strategy", [] if numba.config.DISABLE_JIT else ["along", "time-optimal"])
def test_a_plan_on_it_holds_every_limit(name, strategy):
    path = PATHS[name]
    along = sf.Limits(feed=60, acceleration=500, jerk=20000)
    wanted = along if strategy == "along" else limits(path)
    period = 4e-3
    law = sf.plan(path, wanted, period=period)
    for method in ("milne-simpson-anchored", "arc-length"):
        points = sf.interpolate(path, law, method=method)
        verdict = sf.check(points, path, wanted, law=law)
        assert verdict.ok, verdict.problems
        assert verdict.limits["feed"].worst <= 60.0 * (1.0 + 1e-9)
        assert sf.analysis.feed_ripple(points, path, law).max <= 1e-10
        # against the definitions: differences of the angle itself, rad
        seen = np.abs(np.diff(points.position[:, path.linear :], axis=0)) / period
        if strategy == "time-optimal":
            assert 0.9 <= seen.max() <= 1.0 + 1e-9  # rad/s: the axis limit, and it binds
    # without curve and u, as from another program, it is found all the same
    bare = dataclasses.replace(
        points, u=np.full(len(points), np.nan), s=np.full(len(points), np.nan), feed=np.full(len(points), np.nan)
    )
    verdict = sf.check(bare, path, wanted)
    assert verdict.ok, verdict.problems


@pytest.mark.nojit
def test_feed_of_an_index_move_is_degrees_a_second():
    path = PATHS["a alone"]
    law = sf.plan(path, sf.Limits(feed=60, acceleration=1e5, jerk=1e8), period=1e-3)
    assert law.duration == pytest.approx(1.5, abs=5e-3)  # 90 degrees at 60 degrees a second
    points = sf.interpolate(path, law)
    speed = np.degrees(np.diff(points.position[:, 0])) / 1e-3
    assert speed.max() == pytest.approx(60.0, rel=1e-3) and points.position[-1, 0] == HALF


@pytest.mark.slow
@pytest.mark.nojit
@pytest.mark.parametrize("method", sf.interpolation.methods())
def test_every_method_goes_where_the_law_says(method):
    path = PATHS["x, a, x"]
    law = sf.plan(path, sf.Limits(feed=60, acceleration=500, jerk=20000), period=4e-3)
    points = sf.interpolate(path, law, method=method)
    apart = np.abs(points.position - path(np.minimum(law(points.t), path.length))) * [1.0, 180.0 / np.pi]
    assert apart.max() <= 60.0 * 4e-3  # one step: what Euler's method may be behind
    assert sf.analysis.feed_ripple(points, path, law).max <= 0.2


@pytest.mark.nojit
def test_an_axis_that_lags_on_an_index_move_is_no_contour_error():
    path = PATHS["x, a, x"]
    s = np.linspace(0.0, path.length, 61)
    position = path(s)
    position[:, 1] += 0.05
    position[20:, 0] += 0.25
    for hint in (None, s, np.maximum(s - 1.0, 0.0), np.minimum(s + 1.0, path.length)):
        error = ContourMeter(path).measure(position, s_hint=hint).error
        assert np.abs(error - np.maximum(position[:, 0] - 30.0, 0.0)).max() <= 1e-12
    alone = PATHS["a alone"]
    for hint in (None, np.linspace(0.0, alone.length, 5)):
        assert np.array_equal(
            ContourMeter(alone).measure(np.linspace(0, 1, 5)[:, None], s_hint=hint).error, np.zeros(5)
        )


@pytest.mark.nojit
def test_linear_axes_that_move_by_rounding_do_not_matter():
    points = [[0.1, 0], [1.1, 0], [1.1 + 3e-16, HALF], [2, HALF]]
    path = Path.polyline(points, axes=("x", "a"))
    law = sf.plan(path, limits(path), period=1e-3)
    assert sf.check(sf.interpolate(path, law), path, limits(path), law=law).ok


@pytest.mark.nojit
def test_seven_phases_are_for_paths_of_one_kind_of_axes():
    along = sf.Limits(feed=60, acceleration=500, jerk=20000)
    with pytest.raises(LimitsError, match="seven-phase cannot plan linear and rotary axes together"):
        sf.plan(PATHS["x, a, x"], along, strategy="seven-phase", period=1e-3)
    law = sf.plan(PATHS["x, a, x"], along, period=1e-3)
    assert law.strategy == "time-optimal"
    assert any("a has no limit of acceleration or jerk" in note for note in law.notes)


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.nojit
def test_setpoints_and_verdicts_count_the_arc_length_of_the_tip(name):
    path = PATHS[name]
    law = sf.plan(path, limits(path), period=1e-3)
    setpoints = sf.interpolate(path, law)
    assert setpoints.s == pytest.approx(path.tip_length(path.arc_length(setpoints.curve, setpoints.u)), abs=1e-9)
    assert setpoints.s[-1] == path.tip_end
    middle = 0.5 * (setpoints.feed[1:] + setpoints.feed[:-1])  # within j T^2 / 8 of the difference
    apart = np.abs(np.diff(setpoints.s) / np.diff(setpoints.t) - middle)
    assert np.quantile(apart, 0.95) < 0.02 * setpoints.feed.max()
    verdict = sf.check(setpoints, path, limits(path), law=law)
    assert verdict.ok
    assert verdict.numbers["length_mm"] == pytest.approx(path.tip_end, rel=1e-14)
    places = [each.at_s for each in verdict.limits.values()]
    assert all(0.0 <= s <= path.tip_end * (1.0 + 1e-12) for s in places if not math.isnan(s))
    columns = [k for k in range(len(path.axes)) if setpoints.position[:, k].any()]
    for k in columns:  # where the verdict places the largest velocity of an axis, it has that velocity
        worst = verdict.limits[f"axis_velocity.{path.axes[k]}"]
        near = np.abs(setpoints.s[:-1] - worst.at_s) <= 2.0 * np.max(np.diff(setpoints.s))
        rates = np.abs(np.diff(setpoints.position[:, k])) / np.diff(setpoints.t)
        assert np.max(rates[near]) == pytest.approx(worst.worst, rel=0.05)


def test_setpoints_of_parts_count_the_arc_length_and_feed_of_the_tip():
    path = PATHS["helix, a, x"]
    limits = sf.Limits(feed=20.0, axis_acceleration=500.0, axis_jerk=20000.0)
    found = list(sf.runs.stream_setpoints(parts_of(path, 1), limits, period=1e-3))
    s, feed = (np.concatenate([getattr(each, name) for each in found]) for name in ("s", "feed"))
    t = np.concatenate([each.t for each in found])
    assert s[-1] == pytest.approx(path.tip_end, rel=1e-12)
    assert np.max(feed) <= 20.0 * (1.0 + 1e-6)
    steady = np.diff(t) > 0.9e-3
    middle = 0.5 * (feed[1:] + feed[:-1])
    assert (
        np.max(np.abs(np.diff(s) / np.diff(t) - middle)[steady]) < math.degrees(20000.0) * 1e-6 / 12.0 + 1e-6
    )  # J T^2 / 12
