"""The check on rotary axes: each limit of theirs 1 ppm over, travel, values that are not finite, and moves alone."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import motions as test_motions
import random_motions
import splinefeed as sf
from splinefeed.checks.bounds import Bounds

PERIOD = 1e-3
BY_AXIS = ("axis_velocity", "axis_acceleration", "axis_jerk")


def swinging() -> sf.Path:
    """A line along x while theta and b swing by some rad, b most in another place than theta."""
    points = [[0, 0, 0], [10, 2, 0], [20, -2, 0.5], [30, 3, -3], [40, 1, 1]]
    return sf.Path([sf.NurbsCurve.bezier(points)], axes=("x", "b", "theta"), name="swinging")


def alone() -> sf.Path:
    """A table that turns to and fro by itself, 90 degrees and back to 45."""
    turns = [sf.NurbsCurve.bezier([[0.0], [math.pi / 2]]), sf.NurbsCurve.bezier([[math.pi / 2], [math.pi / 4]])]
    return sf.Path(turns, axes=("a",), name="alone")


def lifted() -> sf.Path:
    """A line, a turn on the spot, and another line."""
    corners = [[0.0, 0.0], [10.0, 0.0], [10.0, 1.0], [15.0, 1.0]]
    return sf.Path([sf.NurbsCurve.bezier(corners[k : k + 2]) for k in range(3)], axes=("x", "c"), name="lifted")


ALL = {
    path.name: (path, limits)
    for path, limits in (
        (swinging(), sf.Limits(feed=60, acceleration=500, jerk=20000)),
        (alone(), sf.Limits(feed=90, acceleration=900, jerk=40000)),  # deg/s, deg/s^2, deg/s^3 there
        (lifted(), sf.Limits(feed=60, acceleration=500, jerk=20000)),
    )
}


@pytest.fixture(scope="module")
def motions() -> dict[str, tuple[sf.Path, sf.Setpoints, sf.TimeLaw]]:
    planned = {}
    for name, (path, limits) in ALL.items():
        law = sf.plan(path, limits, period=PERIOD)
        planned[name] = path, sf.interpolate(path, law), law
    return planned


def failing(verdict: sf.Verdict) -> list[str]:
    return [name for name, result in verdict.limits.items() if not result.holds]


CASES = [
    *((path, f"{what}.{axis}") for path, axes in (("swinging", ("b", "theta")), ("alone", "a"), ("lifted", "c"))
      for what in BY_AXIS for axis in axes),
    *(("alone", name) for name in ("feed", "acceleration", "deceleration")),
]  # fmt: skip


@pytest.mark.parametrize(("which", "name"), CASES)
@pytest.mark.parametrize("by", ["setpoints", "positions", "law"])
def test_a_limit_that_is_two_millionths_over_is_blamed_on_it_alone(motions, which, name, by):
    path, points, law = motions[which]
    if by == "positions":  # as from another program
        nothing = np.full(len(points), np.nan)
        points = dataclasses.replace(points, u=nothing, s=nothing, feed=nothing, curve=np.full(len(points), -1))
    used = law if by == "law" else None
    wide = {"feed": 1e9, "acceleration": 1e9, "deceleration": 1e9, "jerk": 1e12, "deceleration_jerk": 1e12}
    wide |= {f"{what}.{axis}": 1e12 for what in BY_AXIS for axis in path.axes}
    found = sf.check(points, path, sf.Limits.from_dict(wide), law=used).limits[name]
    assert found.worst * 2e-6 > 2 * found.floor
    assert sf.check(points, path, sf.Limits.from_dict(wide | {name: found.worst}), law=used).ok
    over = sf.check(points, path, sf.Limits.from_dict(wide | {name: found.worst / (1 + 2e-6)}), law=used)
    assert failing(over) == [name]
    assert len(over.problems) == 1
    assert over.problems[0].startswith(f"{name}: ")
    assert " deg/s" in over.problems[0] or "." not in name
    assert " 0.0002 % over" in over.problems[0]
    assert (over.limits[name].at_s, over.limits[name].at_t) == (found.at_s, found.at_t)
    if name.startswith(("axis_velocity", "axis_jerk")) and by != "law":
        order = 1 + BY_AXIS.index(name.partition(".")[0])
        column = path.axes.index(name.partition(".")[2])
        position = np.pad(points.position[:, column], 3, mode="edge")
        differences = np.abs(np.diff(position, n=order)) / PERIOD**order
        assert found.worst == pytest.approx(np.max(differences), rel=1e-6)
        where = np.flatnonzero(differences > (1 - 1e-6) * np.max(differences)) - 3
        assert np.min(np.abs(found.at_t / PERIOD - where)) <= order


@pytest.mark.parametrize("axis", ["b", "theta"])
def test_travel_of_a_rotary_axis_a_millionth_too_far(motions, axis):
    path, points, _ = motions["swinging"]
    column = path.axes.index(axis)
    low, high = float(np.min(points.position[:, column])), float(np.max(points.position[:, column]))
    limits = ALL["swinging"][1]
    held = dataclasses.replace(limits, axis_minimum={axis: low}, axis_maximum={axis: high})
    assert sf.check(points, path, held).ok
    over = dataclasses.replace(held, axis_maximum={axis: high - 1e-6 * (high - low)})
    verdict = sf.check(points, path, over)
    assert failing(verdict) == [f"travel.{axis}"]
    assert verdict.limits[f"travel.{axis}"].at_t == points.t[np.argmax(points.position[:, column])]
    assert " deg " in verdict.problems[0]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf], ids=str)
@pytest.mark.parametrize("which", list(ALL))
def test_a_rotary_axis_that_is_not_finite_is_named_with_its_tick(motions, which, value):
    path, points, law = motions[which]
    position = points.position.copy()
    position[123, -1] = value
    verdict = sf.check(dataclasses.replace(points, position=position), path, ALL[which][1], law=law)
    assert any(p.startswith("tick 123 ") and f"{path.axes[-1]} is {value}" in p for p in verdict.problems)
    assert failing(verdict) == []


def test_the_step_of_a_rotary_axis_at_a_corner_in_passing_is_blamed():
    """x goes on evenly while theta starts to turn: only its velocity jumps."""
    path = sf.Path([sf.NurbsCurve(1, [0, 0, 1, 2, 2], [[0, 0], [30, 0], [60, 3]])], axes=("x", "theta"), by_tip=True)
    s = np.arange(601) * path.length / 600
    nothing = np.full(601, np.nan)
    points = sf.Setpoints(
        t=np.arange(601) * PERIOD, curve=np.full(601, -1), u=nothing, s=nothing, feed=nothing, position=path(s),
        axes=path.axes, period=PERIOD, method="other",
    )  # fmt: skip
    law = test_motions.constant(path, 100.0)
    jump = 0.1 * 100.0  # rad/mm times mm/s
    for used in (None, law):
        for share, ok in ((1 - 2e-6, False), (1 + 1e-6, True)):
            limits = sf.Limits(feed=200, axis_velocity_step={"theta": share * jump}, start_feed=100, end_feed=100)
            verdict = sf.check(points, path, limits, law=used)
            result = verdict.limits["axis_velocity_step.theta"]
            assert verdict.ok == ok, verdict.problems
            assert (result.holds, result.axis) == (ok, "theta")
            assert result.at_s == pytest.approx(30)


def test_the_feed_of_one_curve_of_a_turning_table_a_millionth_over(motions):
    path, points, law = motions["alone"]
    back = points.position[np.argmax(points.position[:, 0]) :, 0]
    top = float(np.max(np.abs(np.diff(back)))) / PERIOD * 180 / math.pi
    for used in (None, law):
        wide = sf.Limits(feed=1e6)
        for share, ok in ((1 - 2e-6, False), (1 + 1e-6, True)):
            slower = sf.Path(path.curves, path.axes, feeds=np.array([1e5, share * top]))
            verdict = sf.check(points, slower, wide, law=used)
            assert verdict.ok == ok, verdict.problems
            assert verdict.limits["feed"].at_s > 90 - 1e-6


def test_the_tip_may_turn_back_next_to_the_end_of_a_span_while_another_axis_turns_on() -> None:
    """|x'| has a kink there, behind the last place at which it is sampled: the tip's length is exact all the same."""
    for share in (0.003, 0.008, 0.992, 0.9995):
        back = sf.NurbsCurve.bezier([[0.0, 0.0], [share, 1.0], [2.0 * share - 1.0, 2.0]])  # x' is 0 at this share
        rows = Bounds(sf.Path([back], axes=("x", "a")), sf.Limits(feed=1.0), 1e-6, 0.0).rows
        top = share * share  # x of the curve where it turns back
        assert rows.tip.length == pytest.approx(top + abs(top - (2.0 * share - 1.0)), rel=1e-12)


def test_a_feed_at_an_end_is_that_of_the_tip_though_other_axes_move() -> None:
    """The law counts all axes: at 5 mm/s of the tip it begins at 18."""
    points = np.column_stack(
        [np.random.default_rng(0).uniform(0, 30, (6, 2)), np.random.default_rng(1).uniform(-1, 1, 6)]
    )
    path = sf.Path.through(points, ("x", "y", "a"))
    more = {"axis_acceleration": {"a": 30.0}, "axis_jerk": {"a": 900.0}}
    limits = sf.Limits(feed=50, acceleration=600, jerk=2e4, start_feed=5, end_feed=3, **more)
    law = sf.plan(path, limits, period=PERIOD, strategy="time-optimal")
    setpoints = sf.interpolate(path, law)
    verdict = sf.check(setpoints, path, limits, law=law)
    assert verdict.ok, verdict.problems
    other = sf.Limits(feed=50, acceleration=600, jerk=2e4, start_feed=5.001, end_feed=3, **more)
    assert "its feed at t = 0 s is 5 mm/s; start_feed is 5.001" in " ".join(
        sf.check(setpoints, path, other, law=law).problems
    )


def beside(points: sf.Setpoints, tick: int) -> sf.Setpoints:
    """Setpoints, of which the last axis is 1e-5 rad off at a tick."""
    position = points.position.copy()
    position[tick, -1] += 1e-5
    return dataclasses.replace(points, position=position)


def test_a_rotary_axis_off_the_curve_is_all_that_is_said_of_its_tick(motions):
    path, points, _ = motions["swinging"]
    (problem,) = sf.check(beside(points, 400), path, sf.Limits(feed=1e6)).problems
    assert problem.startswith("tick 400 ")
    assert "a rotary axis is 0.00057" in problem


def test_a_rotary_axis_that_turns_alone_is_where_it_is(motions):
    path, points, _ = motions["lifted"]
    verdict = sf.check(beside(points, 782), path, sf.Limits(feed=1e6))
    assert verdict.ok
    assert verdict.limits["feed"].worst < 62.0  # 1e-5 rad in a period are 0.57 deg/s


def test_positions_alone_are_followed_where_rotary_axes_go_far_beside_short_ways_of_linear_ones():
    motion = random_motions.motion(11)
    law = sf.plan(motion.path, motion.limits, period=motion.period, strategy=motion.strategy)
    points = sf.interpolate(motion.path, law)
    nothing = np.full(len(points), np.nan)
    bare = dataclasses.replace(points, u=nothing, s=nothing, feed=nothing, curve=np.full(len(points), -1))
    verdict = sf.check(bare, motion.path, motion.limits)
    assert verdict.ok, verdict.problems
