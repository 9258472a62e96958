"""The check: good setpoints pass; planted faults of every kind are found and blamed on the right limit and place."""

from __future__ import annotations

import dataclasses
import json
import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import motions
import splinefeed as sf
from splinefeed.checks import certificate
from splinefeed.checks.check import check
from splinefeed.errors import InputError, LimitsError
from splinefeed.files.atomic import FormatError
from splinefeed.records import LimitResult, unit_of

PERIOD = 1e-3
LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000)
#: Limits that no motion of these tests reaches.
FAR = {"feed": 1e6, "acceleration": 1e9, "jerk": 1e13}


def circle(radius: float = 10.0) -> sf.Path:
    half = np.sqrt(0.5)
    points = radius * np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]])
    curve = sf.NurbsCurve(2, [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4], points, [1, half] * 4 + [1])
    return sf.Path([curve], name="circle")


def line_and_arc() -> sf.Path:
    """20 mm straight, then a quarter of a circle of 10 mm: the curvature jumps at s = 20."""
    line = sf.NurbsCurve.bezier([[0, 0], [20, 0]])
    arc = sf.NurbsCurve.bezier([[20, 0], [30, 0], [30, 10]], [1, math.sqrt(0.5), 1])
    return sf.Path([line, arc], name="line and arc")


def turning() -> sf.Path:
    """A line along x with a rotary axis that swings."""
    curve = sf.NurbsCurve.bezier([[0, 0], [10, 0.4], [20, -0.3], [30, 0.5], [40, 0.1]])
    return sf.Path([curve], axes=("x", "theta"), name="turning")


def eight() -> sf.Path:
    """Crosses itself in its middle."""
    return sf.Path([sf.NurbsCurve.bezier([[0, 0], [40, 30], [40, -30], [0, 0.5]])], name="eight")


def points_at(path: sf.Path, s, period: float = PERIOD) -> sf.Setpoints:
    """Setpoints at arc lengths s (n,), one a period."""
    s = np.clip(np.asarray(s, dtype=float), 0.0, path.length)
    curve, u = path.locate(s)
    return sf.Setpoints(
        t=np.arange(len(s)) * period,
        curve=curve,
        u=u,
        s=s,
        feed=np.zeros(len(s)),
        position=path.evaluate(curve, u)[:, 0],
        axes=path.axes,
        period=period,
        method="test",
    )


def planned(path: sf.Path, limits: sf.Limits = LIMITS) -> tuple[sf.Setpoints, sf.TimeLaw]:
    law = sf.plan(path, limits, period=PERIOD)
    return sf.interpolate(path, law), law


def without_u(points: sf.Setpoints) -> sf.Setpoints:
    nothing = np.full(len(points), np.nan)
    return dataclasses.replace(points, u=nothing, s=nothing, feed=nothing, curve=np.full(len(points), -1))


def moved(points: sf.Setpoints, tick: int, axis: int, by: float) -> sf.Setpoints:
    position = points.position.copy()
    position[tick, axis] += by
    return dataclasses.replace(points, position=position)


def failing(verdict) -> set[str]:
    return {name for name, result in verdict.limits.items() if not result.holds}


PATHS = [motions.smooth(), motions.butterfly(), circle(), line_and_arc(), turning(), eight()]


@pytest.fixture(scope="module")
def good() -> tuple[sf.Path, sf.Setpoints, sf.TimeLaw]:
    path = motions.smooth()
    return path, *planned(path)


# --- good setpoints pass --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", PATHS, ids=lambda p: p.name)
@pytest.mark.parametrize("foreign", [False, True], ids=["own", "foreign"])
def test_good_setpoints_pass(path, foreign):
    points, law = planned(path)
    verdict = check(without_u(points) if foreign else points, path, LIMITS, law=None if foreign else law)
    assert verdict.problems == ()
    assert verdict.ok
    assert verdict.numbers["off_curve_max_mm"] < 1e-12
    assert set(verdict.limits) == {"feed", "acceleration", "deceleration", "jerk"}
    assert all(0.99 < result.share <= 1.0 for result in verdict.limits.values())


def drilling(lift: float = 20.0) -> sf.Path:
    """Down, straight back up, and down again further: most positions are places three times."""
    heights = [0.0, -10.0, lift - 10.0, -15.0]
    return sf.Path([sf.NurbsCurve.bezier([[5, 0, a], [5, 0, b]]) for a, b in pairwise(heights)], name="drilling")


@pytest.mark.parametrize("lift", [4.0, 10.0, 20.0])
@pytest.mark.parametrize("chunk", [None, 7])
def test_positions_alone_are_followed_straight_back_over_the_path(lift, chunk):
    path = drilling(lift)
    points, _ = planned(path)
    bare = without_u(points)
    columns = ("t", "curve", "u", "s", "feed", "position")
    parts = [bare] if chunk is None else [
        dataclasses.replace(bare, **{n: getattr(bare, n)[i : i + chunk] for n in columns})
        for i in range(0, len(bare), chunk)
    ]  # fmt: skip
    verdict = check(iter(parts), path, LIMITS)
    assert verdict.ok, verdict.problems
    for name, own in check(points, path, LIMITS).limits.items():
        assert verdict.limits[name].worst == pytest.approx(own.worst, rel=1e-6)
    tick = int(np.searchsorted(points.s, 10.0)) + 100  # on the way up
    bad = check(moved(bare, tick, 2, -0.5), path, LIMITS)
    assert not bad.ok
    assert abs(bad.limits["jerk"].at_t - points.t[tick]) < 4 * PERIOD


def test_feeds_at_the_ends_and_a_short_last_period():
    path = motions.butterfly()
    limits = sf.Limits(feed=60, acceleration=500, jerk=20000, start_feed=60, end_feed=60)
    points, law = planned(path, limits)
    verdict = check(points, path, limits, law=law)
    assert verdict.ok, verdict.problems
    assert "is short" in verdict.notes[0]
    early = check(points, path, dataclasses.replace(limits, start_feed=50.0))
    assert failing(early) == {"acceleration"}
    assert early.limits["acceleration"].at_t == 0.0
    late = check(points, path, dataclasses.replace(limits, end_feed=50.0))
    assert failing(late) == {"deceleration"}
    assert late.limits["deceleration"].at_t == pytest.approx(law.duration)


def test_chunks_give_the_same_verdict(good):
    path, points, law = good
    chunks = [
        dataclasses.replace(
            points, **{n: getattr(points, n)[i : i + 7] for n in ("t", "curve", "u", "s", "feed", "position")}
        )
        for i in range(0, len(points), 7)
    ]
    for faulty in (points, moved(points, 14, 0, 1e-3), moved(points, 20, 1, np.nan)):
        for made in (lambda each: each, without_u):
            whole = check(made(faulty), path, LIMITS, law=law).as_dict()
            parts = [dataclasses.replace(c, position=faulty.position[i * 7 : i * 7 + 7]) for i, c in enumerate(chunks)]
            assert repr(check(map(made, parts), path, LIMITS, law=law).as_dict()) == repr(whole)


def test_a_circle_at_constant_feed_has_the_values_of_the_circle():
    path, V, R = circle(), 50.0, 10.0
    points = points_at(path, np.arange(0.0, path.length, V * PERIOD))
    law = motions.constant(path, V)
    axes = {f"axis_{name}": 1e9 for name in ("velocity", "acceleration", "jerk")}
    limits = sf.Limits(**FAR, start_feed=V, end_feed=V, chord_error=1, centripetal=1e9, **axes)
    verdict = check(points, path, limits)
    angle = V * PERIOD / R * np.arange(len(points))
    exact = R * np.column_stack([np.cos(angle), np.sin(angle)])
    for order, name in enumerate(axes, start=1):
        expected = np.max(np.abs(np.diff(exact, n=order, axis=0)), axis=0) / PERIOD**order
        for axis in (0, 1):
            result = verdict.limits[f"{name}.{'xy'[axis]}"]
            assert result.worst == pytest.approx(expected[axis], abs=result.floor)
            assert result.axis == "xy"[axis]
    assert verdict.limits["feed"].worst == pytest.approx(V, rel=1e-11)
    assert verdict.limits["centripetal"].worst == pytest.approx(V * V / R, rel=1e-10)
    assert verdict.limits["chord_error"].worst == pytest.approx(R * (1 - math.cos(V * PERIOD / R / 2)), rel=1e-9)
    by_law = check(points, path, limits, law=law).limits
    for order, name in enumerate(axes, start=1):
        assert by_law[f"{name}.x"].worst == pytest.approx(V**order / R ** (order - 1), rel=1e-9)
        assert by_law[f"{name}.x"].by == "law"
    assert by_law["centripetal"].worst == pytest.approx(V * V / R, rel=1e-12)


@pytest.mark.parametrize("path", [motions.smooth(), motions.butterfly(), circle(500.0)], ids=lambda p: p.name)
def test_rounding_alone_stays_below_the_floor(path):
    V = path.length / 5
    limits = sf.Limits(feed=V, acceleration=1e-12, jerk=1e-12, start_feed=V, end_feed=V)
    points = sf.interpolate(path, motions.constant(path, V), period=PERIOD)
    assert check(points, path, limits).ok


@pytest.mark.parametrize(("wrong", "faults"), [(0.0, set()), (1e-9, {"jerk"})])
def test_the_rounding_of_a_late_time_stays_below_the_floor(wrong, faults):
    """Setpoints 77 minutes into a job of 62 m, a plate of 2,205 contours, are as late or early as their times round."""
    path, start, V = motions.smooth(), 4_600_000, 60.0
    ticks = start + np.arange(math.floor(path.length / V / PERIOD))
    s = V * (ticks * PERIOD - start * PERIOD)
    s[300] += wrong  # mm, beside eps t V = 6e-11
    points = dataclasses.replace(points_at(path, s), t=ticks * PERIOD)
    limits = sf.Limits(feed=V * 1.001, acceleration=1e-4, jerk=1e-12, start_feed=V, end_feed=V)
    assert failing(check(points, path, limits)) & {"jerk"} == faults


# --- limits, 1 ppm over ---------------------------------------------------------------------------------------------

EVERY = [
    "feed",
    "acceleration",
    "deceleration",
    "jerk",
    "chord_error",
    "centripetal",
    *(f"axis_{what}.{axis}" for what in ("velocity", "acceleration", "jerk") for axis in "xy"),
]


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("with_law", [False, True], ids=["setpoints", "law"])
def test_two_millionths_over_one_limit_are_blamed_on_it_alone(good, name, with_law):
    path, points, law = good
    wide = {**{n: 1e9 for n in EVERY}, "deceleration_jerk": 1e9}
    found = check(points, path, sf.Limits.from_dict(wide), law=law if with_law else None).limits[name]
    assert found.worst * 2e-6 > 2 * found.floor
    held = {name: found.worst}
    if name == "jerk":
        held["deceleration_jerk"] = found.worst
    assert check(points, path, sf.Limits.from_dict({**wide, **held}), law=law if with_law else None).ok
    over = {n: value / (1 + 2e-6) for n, value in held.items()}
    verdict = check(points, path, sf.Limits.from_dict({**wide, **over}), law=law if with_law else None)
    assert not verdict.ok
    assert failing(verdict) == {name}
    assert len(verdict.problems) == 1
    assert verdict.problems[0].startswith(f"{name}: ")
    assert verdict.limits[name].at_s == found.at_s
    assert verdict.limits[name].share == pytest.approx(1 + 2e-6, abs=1e-9)


def test_jerk_has_a_limit_each_for_speeding_up_and_slowing_down(good):
    path, _, _ = good
    limits = sf.Limits(feed=60, acceleration=500, jerk=20000, deceleration_jerk=5000, deceleration=300)
    points, law = planned(path, limits)
    assert check(points, path, limits, law=law).ok
    assert check(points, path, limits).ok
    for changed, early in (({"jerk": 19000.0}, True), ({"deceleration_jerk": 4900.0}, False)):
        for used in (law, None):
            verdict = check(points, path, dataclasses.replace(limits, **changed), law=used)
            assert failing(verdict) == {"jerk"}
            assert (verdict.limits["jerk"].at_t < 0.5 * law.duration) == early
            assert verdict.limits["jerk"].limit == next(iter(changed.values()))


def test_travel(good):
    path, points, _ = good
    low, high = float(points.position[:, 1].min()), float(points.position[:, 1].max())
    held = dataclasses.replace(LIMITS, axis_minimum={"y": low}, axis_maximum={"y": high})
    assert check(points, path, held).ok
    over = dataclasses.replace(LIMITS, axis_minimum={"x": -1.0, "y": low}, axis_maximum={"x": 71.0, "y": high - 1e-4})
    verdict = check(points, path, over)
    assert failing(verdict) == {"travel.y"}
    assert verdict.limits["travel.y"].at_t == points.t[np.argmax(points.position[:, 1])]


def test_chord_error_over_a_corner_inside_a_curve():
    """Two straight spans of one curve, and a setpoint on either side of the corner at (1, 1)."""
    path = sf.Path([sf.NurbsCurve(1, [0, 0, 0.5, 1, 1], [[0, 0], [1, 1], [2, 0]])])
    s = np.linspace(0.0, path.length, 8)
    limits = sf.Limits(**FAR, chord_error=1e-9)
    result = check(points_at(path, s), path, limits).limits["chord_error"]
    assert result.worst == pytest.approx((s[4] - s[3]) / 2 * math.sin(math.pi / 4), rel=1e-12)
    assert result.at_s == pytest.approx(s[3])


# --- planted faults -------------------------------------------------------------------------------------------------


def only(verdict, start: str, text: str) -> str:
    """The one problem that begins and reads so; limits may be blamed besides."""
    found = [p for p in verdict.problems if p.startswith(start) and text in p]
    assert len(found) == 1, verdict.problems
    return found[0]


@pytest.mark.parametrize("foreign", [False, True], ids=["own", "foreign"])
def test_a_point_off_the_curve_by_a_nanometre(good, foreign):
    path, points, _ = good
    tick = 700
    tangent = path.curves[0].tangent(points.u[tick])
    position = points.position.copy()
    position[tick] += 1e-6 * np.array([-tangent[1], tangent[0]])
    bad = dataclasses.replace(points, position=position)
    verdict = check(without_u(bad) if foreign else bad, path, LIMITS)
    only(verdict, "tick 700 (t = 0.7 s", "off the curve by 1e-06 mm")
    assert verdict.numbers["off_curve_max_mm"] == pytest.approx(1e-6, rel=1e-6)
    assert check(bad, path, sf.Limits(**FAR), tolerance=2e-6).ok


def test_a_point_along_the_curve_is_not_where_its_u_says(good):
    path, points, _ = good
    moved_s = points.s.copy()
    moved_s[600] += 1e-3
    position = points.position.copy()
    position[600] = path(moved_s[600])
    verdict = check(dataclasses.replace(points, position=position), path, LIMITS)
    only(verdict, "tick 600 (t = 0.6 s", "0.001 mm from the place of its u")
    assert failing(verdict) == {"acceleration", "deceleration", "jerk", "feed"}


def test_a_skipped_stretch(good):
    path, points, _ = good
    s = points.s.copy()
    s[800:] += 1.0
    verdict = check(points_at(path, s), path, sf.Limits(**FAR))
    only(verdict, "tick 800 (t = 0.799 s", "skipped: one step of 1.")
    assert failing(verdict) == set()
    assert failing(check(points_at(path, s), path, LIMITS)) == {"feed", "acceleration", "deceleration", "jerk"}


def test_a_repeated_point(good):
    path, points, _ = good
    s = points.s.copy()
    s[500] = s[499]
    only(check(points_at(path, s), path, sf.Limits(**FAR)), "tick 500 (t = 0.499 s", "same point twice")


def test_a_tick_more_at_a_stop_is_a_wait_and_elsewhere_a_point_said_twice():
    path = sf.Path.polyline([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]])
    s = sf.interpolate(path, sf.plan(path, LIMITS, period=PERIOD)).s
    corner = int(np.argmin(np.abs(s - path.stops[0])))
    assert check(points_at(path, np.insert(s, corner, s[corner])), path, LIMITS).ok
    verdict = check(points_at(path, np.insert(s, corner + 40, s[corner + 40])), path, sf.Limits(**FAR))
    only(verdict, f"tick {corner + 41} ", "same point twice")


@pytest.mark.parametrize("what", ["whole", "positions"])
def test_a_swapped_pair(good, what):
    path, points, _ = good
    s = points.s.copy()
    s[[400, 401]] = s[[401, 400]]
    swapped = points_at(path, s)
    if what == "positions":
        swapped = dataclasses.replace(points, position=swapped.position)
    only(check(swapped, path, sf.Limits(**FAR)), "tick 401 (t = 0.4 s", "goes back by 0.0")


def test_a_tick_that_comes_late_and_a_wrong_period(good):
    path, points, _ = good
    t = points.t.copy()
    t[300:] += 1e-5
    verdict = check(dataclasses.replace(points, t=t), path, LIMITS)
    only(verdict, "tick 300 (t = 0.30001 s", "is 1e-05 s early or late")
    assert failing(verdict) == set()
    half = check(dataclasses.replace(points, period=PERIOD / 2), path, LIMITS)
    assert f"{len(points) - 1} ticks in all" in only(half, "tick ", "the period is not kept")
    assert failing(half) == {"feed", "acceleration", "deceleration", "jerk"}
    assert half.limits["jerk"].share == pytest.approx(8.0, rel=1e-2)


def test_a_period_that_creeps_away(good):
    path, points, _ = good
    verdict = check(dataclasses.replace(points, t=points.t * (1 + 9e-7)), path, LIMITS)
    assert "1e-06 s" not in only(verdict, f"tick {len(points) - 1} ", "is 1.2")
    assert check(dataclasses.replace(points, t=points.t + 12.5), path, LIMITS).ok


@pytest.mark.parametrize("path", [motions.smooth(), circle()], ids=lambda p: p.name)
@pytest.mark.parametrize("foreign", [False, True], ids=["own", "foreign"])
def test_missing_ends(path, foreign):
    points, _ = planned(path)

    def cut(part):
        columns = {n: getattr(points, n)[part] for n in ("t", "curve", "u", "s", "feed", "position")}
        cut_out = dataclasses.replace(points, **columns)
        return without_u(cut_out) if foreign else cut_out

    end = check(cut(slice(0, -40)), path, sf.Limits(**FAR))
    missing = path.length - points.s[-41]
    only(end, f"tick {len(points) - 41} ", "from the end of the path: it is not reached")
    assert not end.numbers["end_reached"]
    assert end.numbers["end_error_mm"] == pytest.approx(missing, rel=1e-3)
    start = check(cut(slice(40, None)), path, sf.Limits(**FAR))
    only(start, "tick 0 ", "from the start of the motion")
    assert start.numbers["start_error_mm"] == pytest.approx(points.s[40], rel=1e-3)


@pytest.mark.parametrize("name", ["t", "u", "s", "feed", "x", "y"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf], ids=str)
def test_values_that_are_not_finite(good, name, value):
    path, points, law = good
    for tick in (0, 321, len(points) - 1):
        if name in "xy":
            bad = moved(points, tick, "xy".index(name), value)
        else:
            column = getattr(points, name).copy()
            column[tick] = value
            bad = dataclasses.replace(points, **{name: column})
        verdict = check(bad, path, LIMITS, law=law)
        assert not verdict.ok
        only(verdict, f"tick {tick} ", f"{name} is {value}")
        assert failing(verdict) == set()
        assert name != "x" or tick != 321 or len(verdict.problems) == 1
        json.dumps(certificate.certificate(bad, path, LIMITS, verdict), allow_nan=False)


def test_an_abrupt_start_and_an_abrupt_end():
    """Constant feed from the first tick on: no difference between setpoints shows it, only the stand around them."""
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [50, 0]])])
    points = points_at(path, np.linspace(0.0, 50.0, 1001))
    limits = sf.Limits(feed=51, acceleration=40000, jerk=1e9)
    verdict = check(points, path, limits)
    assert failing(verdict) == {"acceleration", "deceleration"}
    assert verdict.limits["acceleration"].worst == pytest.approx(50 / PERIOD)
    assert verdict.limits["acceleration"].at_t == 0.0
    assert verdict.limits["deceleration"].at_t == pytest.approx(1.0)
    assert check(points, path, dataclasses.replace(limits, start_feed=50.0, end_feed=50.0)).ok


def test_one_axis_over_its_jerk_alone():
    path = turning()
    points, _ = planned(path)
    wide = {"x": 1e9, "theta": 1e9}
    found = check(points, path, sf.Limits(**FAR, axis_jerk=wide)).limits["axis_jerk.theta"]
    limits = sf.Limits(feed=60, acceleration=500, jerk=20000, axis_jerk={"x": 1e9, "theta": found.worst / (1 + 2e-6)})
    verdict = check(points, path, limits)
    assert failing(verdict) == {"axis_jerk.theta"}
    assert verdict.limits["axis_jerk.theta"].axis == "theta"
    assert "deg/s^3" in verdict.problems[0]
    shown = verdict.as_dict()["limits"]["axis_jerk.theta"]
    assert shown["worst"] == pytest.approx(math.degrees(found.worst))
    third = np.abs(np.diff(points.position[:, 1], n=3)) / PERIOD**3
    assert found.worst == pytest.approx(third.max(), rel=1e-9)
    assert abs(round(found.at_t / PERIOD) - int(np.argmax(third))) <= 2


def test_a_rotary_axis_that_is_not_where_the_curve_has_it():
    path = turning()
    points, _ = planned(path)
    for each in (points, without_u(points)):
        verdict = check(moved(each, 200, 1, math.radians(1e-3)), path, sf.Limits(**FAR))
        only(verdict, "tick 200 ", "0.001 deg from where the curve has it")
    assert not check(moved(points, len(points) - 1, 1, 1e-6), path, sf.Limits(**FAR)).ok


def test_a_wrong_curve_index_does_no_harm_where_the_position_is_right():
    path = line_and_arc()
    points, _ = planned(path)
    curve = points.curve.copy()
    curve[100] = 7
    assert check(dataclasses.replace(points, curve=curve), path, LIMITS).ok
    curve[100] = 1
    assert "the place of its u" in check(dataclasses.replace(points, curve=curve), path, LIMITS).problems[0]


@given(
    kind=st.sampled_from(["off", "swap", "twice", "skip", "late", "nan"]),
    tick=st.integers(300, 1200),
    size=st.floats(1e-6, 1.0),
)
@settings(max_examples=60)
def test_random_faults_are_found_where_they_are(kind, tick, size):
    path = motions.smooth()
    points, _ = planned(path)
    assert len(points) > 1300
    s = points.s.copy()
    if kind == "off":
        normal = path.curves[0].tangent(points.u[tick])[::-1] * [-1, 1]
        position = points.position.copy()
        position[tick] += 1e-2 * size * normal
        bad = dataclasses.replace(points, position=position)
    elif kind == "late":
        t = points.t.copy()
        t[tick] += (1e-5 + 0.9 * size) * PERIOD
        bad = dataclasses.replace(points, t=t)
    elif kind == "nan":
        bad = moved(points, tick, 0, np.nan)
    else:
        if kind == "swap":
            s[[tick, tick + 1]] = s[[tick + 1, tick]]
        elif kind == "twice":
            s[tick] = s[tick - 1]
        else:
            s[tick:] += 0.5 + size
        bad = points_at(path, s)
    verdict = check(bad, path, sf.Limits(**FAR))
    assert not verdict.ok
    place = int(verdict.problems[0].split()[1])
    assert abs(place - tick) <= 1


# --- the law --------------------------------------------------------------------------------------------------------


def test_a_law_over_a_limit_of_a_combination_between_ticks(good):
    path, _, law = good
    both = sf.records.Combination(weights={"x": 1.0, "y": -0.5}, jerk=1e9)
    limits = sf.Limits(**FAR, axis_jerk=1e9, combinations={"both": both})
    coarse = sf.interpolate(path, law, period=law.duration / 20)
    seen, found = (check(coarse, path, limits, law=of).limits["combinations.both.jerk"] for of in (None, law))
    assert found.by == "law"
    assert found.worst > 1.2 * seen.worst
    fine = check(sf.interpolate(path, law, period=law.duration / 20000), path, limits)
    assert fine.limits["combinations.both.jerk"].worst == pytest.approx(found.worst, rel=5e-3)
    lower = sf.records.Combination(weights=both.weights, jerk=found.worst / (1 + 2e-6))
    assert failing(check(coarse, path, sf.Limits(**FAR, combinations={"both": lower}), law=law)) == {
        "combinations.both.jerk"
    }


def test_a_law_over_a_limit_between_ticks(good):
    """A spike of the axis jerk that setpoints a long period apart do not show."""
    path, _, law = good
    coarse = sf.interpolate(path, law, period=law.duration / 20)
    limits = sf.Limits(**FAR, axis_jerk=1e9)
    by_points = check(coarse, path, limits).limits["axis_jerk.y"].worst
    by_law = check(coarse, path, limits, law=law).limits["axis_jerk.y"]
    fine = check(sf.interpolate(path, law, period=law.duration / 20000), path, limits).limits["axis_jerk.y"]
    assert by_law.worst > 1.5 * by_points
    assert by_law.by == "law"
    assert fine.worst == pytest.approx(by_law.worst, rel=5e-3)
    limits = sf.Limits(**FAR, axis_jerk={"y": by_law.worst / (1 + 2e-6)})
    assert check(coarse, path, limits).ok
    assert failing(check(coarse, path, limits, law=law)) == {"axis_jerk.y"}


def test_laws_that_jump_or_go_elsewhere(good):
    path, points, law = good

    def changed(k, by):
        coefficients = np.array(law.coefficients)
        coefficients[3:, k] += by
        return dataclasses.replace(law, coefficients=coefficients)

    at = f"at t = {law.breaks[3]:.9g} s"
    for k, what in ((0, "law: s jumps by 0.001 mm"), (1, "law: its feed jumps by 0.001 mm/s")):
        assert any(p.startswith(what) and at in p for p in check(points, path, LIMITS, law=changed(k, 1e-3)).problems)
    jump = check(points, path, LIMITS, law=changed(2, 1e-3)).problems
    assert any("acceleration jumps by 0.002 mm/s^2" in p and "jerk is infinite" in p and at in p for p in jump)
    short = motions.constant(motions.smooth(), 60.0)
    problems = check(points, path, LIMITS, law=short).problems
    assert any("start_feed is 0" in p for p in problems)
    assert any("is it their law" in p for p in problems)
    longer = dataclasses.replace(law, coefficients=np.array(law.coefficients) * 1.01)
    assert any(p.startswith("law: runs from s = 0 to 75.5") for p in check(points, path, LIMITS, law=longer).problems)


def test_where_the_curvature_jumps_the_third_difference_decides():
    path = line_and_arc()
    points, law = planned(path)
    limits = sf.Limits(feed=60, acceleration=500, jerk=20000, axis_jerk=1e9)
    verdict = check(points, path, limits, law=law)
    assert verdict.ok
    assert any("s = 20 mm" in note and "differences of the setpoints decide" in note for note in verdict.notes)
    result = verdict.limits["axis_jerk.y"]
    assert result.by == "setpoints"
    v = float(law.feed(result.at_t))
    assert result.at_s == pytest.approx(20.0, abs=3 * v * PERIOD)
    # the acceleration of y jumps by v^2 / 10 within a period or two
    assert 0.4 < result.worst / (v * v / 10 / PERIOD) < 1.1


# --- input, and the certificate -------------------------------------------------------------------------------------


def test_what_cannot_be_checked(good):
    path, points, _ = good
    with pytest.raises(InputError, match=r"axes \('x', 'theta'\), the path \('x', 'y'\)"):
        check(planned(turning())[0], path, LIMITS)
    with pytest.raises(InputError, match="there are no setpoints"):
        check(iter([]), path, LIMITS)
    with pytest.raises(InputError, match="expected Setpoints or chunks of them, got int"):
        check([1], path, LIMITS)
    with pytest.raises(InputError, match="must not be negative"):
        check(points, path, LIMITS, tolerance=-1.0)
    with pytest.raises(LimitsError, match=r"travel\.z: the path has no axis"):
        check(points, path, dataclasses.replace(LIMITS, axis_minimum={"z": 0.0}, axis_maximum={"z": 1.0}))
    with pytest.raises(LimitsError, match="no travel is left"):
        dataclasses.replace(LIMITS, axis_minimum={"x": 1.0}, axis_maximum={"x": 0.0})
    with pytest.raises(LimitsError, match="give both ends of its travel"):
        dataclasses.replace(LIMITS, axis_minimum={"x": 1.0})
    with pytest.raises(LimitsError, match=r"axis_jerk\.z"):
        check(points, path, sf.Limits(feed=60, axis_jerk={"z": 1.0}))
    with pytest.raises(InputError, match="a chunk has a period"):
        check([points, dataclasses.replace(points, period=2e-3)], path, LIMITS)


def test_one_setpoint_alone_reaches_no_end(good):
    path, points, _ = good
    columns = {n: getattr(points, n)[:1] for n in ("t", "curve", "u", "s", "feed", "position")}
    verdict = check(dataclasses.replace(points, **columns), path, LIMITS)
    assert not verdict.ok
    assert verdict.numbers["ticks"] == 1


def test_a_certificate_changes_with_every_bit_of_its_inputs(good, tmp_path):
    path, points, law = good
    verdict = check(points, path, LIMITS, law=law)
    page = certificate.certificate(points, path, LIMITS, verdict, law)
    assert page == certificate.certificate(points, path, LIMITS, verdict, law)
    assert page["verdict"]["ok"] is True
    u = points.u.copy()
    u[5] = np.nextafter(u[5], 1.0)
    other = certificate.certificate(dataclasses.replace(points, u=u), path, LIMITS, verdict, law)["sha256"]
    assert {name for name in other if other[name] != page["sha256"][name]} == {"setpoints"}
    control = path.curves[0].control_points.copy()
    control[1, 0] = np.nextafter(control[1, 0], 99.0)
    assert certificate.path_hash(sf.Path([sf.NurbsCurve.bezier(control)])) != page["sha256"]["path"]
    assert certificate.limits_hash(sf.Limits(feed=60, acceleration=500, jerk=20001)) != page["sha256"]["limits"]
    certificate.write_certificate(page, tmp_path / "c.json")
    assert json.loads((tmp_path / "c.json").read_text()) == json.loads(json.dumps(page))
    with pytest.raises(FormatError, match="does not exist"):
        certificate.write_certificate(page, tmp_path / "no" / "c.json")


def test_every_limit_is_told_in_the_unit_that_people_read() -> None:
    units = {
        "feed": "deg/s", "jerk": "deg/s^3", "chord_error": "deg", "axis_jerk.x": "mm/s^3", "axis_velocity.c": "deg/s",
        "axis_velocity_step.c": "deg/s", "travel.x": "mm", "travel.c": "deg", "orientation_error": "deg",
        "combinations.left.acceleration": "mm/s^2", "torque.c": "N m", "torque.x": "N",
    }  # fmt: skip
    assert {name: unit_of(name, "deg") for name in units} == units
    found = {name: LimitResult(limit=2.0, worst=1.0, at_s=0.0, at_t=0.0, axis="c") for name in ("torque.c", "travel.c")}
    page = sf.Verdict(limits=found, problems=()).as_dict()["limits"]
    assert page["torque.c"]["limit"] == 2.0 and page["travel.c"]["limit"] == pytest.approx(np.rad2deg(2.0))
    assert "orientation_error" in sf.Limits(feed=1.0, orientation_error=0.1)._repr_html_()


def test_an_axis_that_moves_without_a_limit_is_named() -> None:
    line = sf.NurbsCurve.bezier([[0.0, 0.0, 0.0], [30.0, 10.0, 1.0]])
    path = sf.Path([line], ("x", "y", "a"))
    limits = sf.Limits(feed=60.0, axis_acceleration=500.0, axis_jerk=20000.0)
    setpoints = sf.interpolate(path, sf.plan(path, limits, period=1e-3))
    notes = sf.check(setpoints, path, limits).notes
    assert "a moves without axis_acceleration, which other axes have; give each axis its own" in notes
    assert "a moves without axis_jerk, which other axes have; give each axis its own" in notes
    bounded = sf.Limits(
        feed=60.0,
        axis_acceleration={"x": 500.0, "y": 500.0, "a": 20.0},
        axis_jerk={"x": 20000.0, "y": 20000.0, "a": 800.0},
    )
    again = sf.interpolate(path, sf.plan(path, bounded, period=1e-3))
    assert not any("moves without" in note for note in sf.check(again, path, bounded).notes)


def test_the_verdict_says_in_words_what_it_allows() -> None:
    path = sf.Path([sf.NurbsCurve.bezier([[0.0, 0.0], [40.0, 0.4]])], ("x", "a"))
    fast = sf.Limits(feed=60.0, axis_velocity=[50.0, 1.0], axis_acceleration=[500.0, 5.0], axis_jerk=[2e4, 200.0])
    setpoints = sf.interpolate(path, sf.plan(path, fast, period=1e-3))
    first, *rows = str(sf.check(setpoints, path, fast)).splitlines()
    assert first == "every limit holds, to within a millionth of it and the rounding of a position"
    rows = [" ".join(row.split()) for row in rows]
    assert "axis_velocity.x 50 of 50 mm/s (100.0%)" in rows
    assert any(row.startswith("axis_velocity.a 28.6479 of 57.2958 deg/s") for row in rows)
    slow = dataclasses.replace(fast, axis_velocity=[25.0, 1.0])
    text = str(sf.check(setpoints, path, slow))
    assert text.startswith(
        "NOT KEPT: axis_velocity.x; a limit holds to within a millionth of it and the rounding of a position\n"
    )
    assert "\nproblem: axis_velocity.x" in text


@pytest.mark.parametrize(("share", "holds"), [(1.0 + 0.9e-6, True), (1.0 + 1.1e-6, False)])
def test_a_limit_is_kept_up_to_a_millionth_of_it(share: float, holds: bool) -> None:
    assert sf.records.LimitResult(limit=20000.0, worst=20000.0 * share, at_s=0.0, at_t=0.0).holds is holds


def test_a_motion_that_begins_on_the_way_is_checked_from_there() -> None:
    """From a state of its law: as good as the whole; another place, feed or (by the law) acceleration is found."""
    path, limits = circle(), sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000, acceleration=450)
    law = sf.plan(path, limits, period=PERIOD)
    t = 0.4
    start = sf.planner.State(float(law.feed(t)), float(law.acceleration(t)), float(law(t)))
    again = sf.plan(path, limits, period=PERIOD, start=start)
    setpoints = sf.interpolate(path, again, period=PERIOD)
    assert check(setpoints, path, limits, start=start, law=again).ok
    assert not check(setpoints, path, limits, start=sf.planner.State()).ok  # from rest where the path begins: a jump
    itself = check(setpoints, path, limits)  # they say how they begin, and the verdict that it is taken from them
    assert itself.ok
    assert "as its settings say" in itself.notes[-1]

    elsewhere = dataclasses.replace(start, s=start.s + 1e-3)
    assert "from the start of the motion" in check(setpoints, path, limits, start=elsewhere).problems[0]
    slower = dataclasses.replace(start, feed=start.feed - 1.0)
    found = check(setpoints, path, limits, start=slower)
    assert not found.limits["acceleration"].holds  # 1 mm/s in a period is 1000 mm/s^2
    at_rest = check(setpoints, path, limits, start=sf.planner.State(s=start.s))
    assert not at_rest.limits["axis_jerk.y"].holds
    assert "its feed at t = 0 s" in " ".join(check(setpoints, path, limits, start=slower, law=again).problems)
    harder = dataclasses.replace(start, acceleration=start.acceleration + 1.0)
    (said,) = check(setpoints, path, limits, start=harder, law=again).problems
    assert "its acceleration at t = 0 s" in said and f"that of the start is {harder.acceleration:.9g}" in said


def test_sums_of_many_spans_differ_by_rounding_and_make_no_fault() -> None:
    """Two sums of the lengths of thousands of spans are some roundings apart: no stretch lies between them.

    On it the law's jerk before a knot met the path's third derivative behind it.
    """
    t = np.linspace(0.0, 400.0, 4001)
    path = sf.paths.fit(np.stack([t, 5.0 * np.sin(t)], axis=1), tolerance=1e-3).path()
    limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
    law = sf.plan(path, limits, strategy="look-ahead", period=PERIOD)
    verdict = check(sf.interpolate(path, law), path, limits, law=law)
    assert verdict.ok, verdict
