"""The check of joints finds what is wrong with them: made wrong on purpose, it is said."""

from __future__ import annotations

import dataclasses
from functools import cache
from itertools import pairwise
from pathlib import Path as File

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.checks.axes import AxesByPlace
from splinefeed.errors import InputError
from splinefeed.kinematics import kinematics
from splinefeed.records import Array
from tool_paths import FLANK, FLANK_PERIOD, MACHINES, flank, random_tool_path

DATA = File(__file__).parents[1] / "data"


@cache
def planned() -> tuple[sf.kinematics.JointPath, sf.TimeLaw, sf.Setpoints]:
    path = sf.kinematics.JointPath(flank(DATA), kinematics("xyzac-trt"))
    law = sf.plan(path, FLANK, period=FLANK_PERIOD, strategy="look-ahead")
    return path, law, sf.interpolate(path, law)


def judged(position: Array | None = None, limits: sf.Limits = FLANK, **changes: Array) -> sf.Verdict:
    path, _, points = planned()
    given = points.position if position is None else position
    return sf.check(dataclasses.replace(points, position=given, **changes), path, limits)


def moved(tick: int, joint: int, by: float) -> Array:
    position = planned()[2].position.copy()
    position[tick, joint] += by
    return position


def test_all_is_well() -> None:
    path, law, points = planned()
    verdict = sf.check(points, path, FLANK, law=law)
    assert verdict.ok
    assert {"feed", "axis_velocity.x"} <= verdict.limits.keys()
    assert verdict.numbers["end_reached"]


@pytest.mark.parametrize(("joint", "said"), [(0, "off the curve by"), (3, "the tool axis is off")])
def test_a_joint_beside_its_place_is_seen(joint: int, said: str) -> None:
    verdict = judged(moved(700, joint, 1e-7))
    assert any(said in each and each.startswith("tick 700 ") for each in verdict.problems), verdict.problems


@pytest.mark.parametrize("name", ["axis_velocity.c", "axis_acceleration.c", "axis_jerk.a"])
def test_a_limit_that_is_exceeded_is_named(name: str) -> None:
    kind, axis = name.split(".")
    lower = {**getattr(FLANK, kind)}
    lower[axis] *= 0.9
    verdict = judged(limits=dataclasses.replace(FLANK, **{kind: lower}))
    assert not verdict.ok
    assert any(each.startswith(f"{name}: ") and "deg" in each for each in verdict.problems)


def test_a_chord_error_at_the_tip_is_measured() -> None:
    verdict = judged(limits=dataclasses.replace(FLANK, chord_error=5e-6))
    assert any(each.startswith("chord_error: ") for each in verdict.problems)


def test_feed_and_travel_are_held() -> None:
    verdict = judged(limits=dataclasses.replace(FLANK, feed=20.0))
    assert any(each.startswith("feed: ") for each in verdict.problems)
    ends = {"axis_minimum": {"z": -100.0}, "axis_maximum": {"z": -5.0}}
    verdict = judged(limits=dataclasses.replace(FLANK, **ends))  # type: ignore[arg-type]
    assert any(each.startswith("travel.z: ") for each in verdict.problems)


def test_a_program_s_own_feeds_are_held_curve_by_curve() -> None:
    path, _, points = planned()
    tool = path.tool
    slow = sf.ToolPath(sf.Path(tool.curves, tool.axes, feeds=[20.0]), tool.tool_axis)
    verdict = sf.check(points, sf.kinematics.JointPath(slow, path.kinematics), FLANK)
    assert verdict.limits["feed"].limit == 20.0
    (said,) = (each for each in verdict.problems if each.startswith("feed: "))
    assert "mm/s " in said


def test_a_law_that_is_over_its_limits_between_setpoints_is_found() -> None:
    path, law, points = planned()
    fine = sf.check(points, path, FLANK, law=law).limits["axis_jerk.x"]
    assert fine.by == "law"
    coarse = sf.interpolate(path, law, period=64 * FLANK_PERIOD)
    tighter = dataclasses.replace(FLANK, axis_jerk={**FLANK.axis_jerk, "x": 0.98 * fine.worst})
    assert not any("axis_jerk.x" in each for each in sf.check(coarse, path, tighter).problems)
    found = sf.check(coarse, path, tighter, law=law)
    (said,) = (each for each in found.problems if each.startswith("axis_jerk.x"))
    assert "exact derivative of the law" in said
    assert found.limits["axis_jerk.x"].worst == pytest.approx(fine.worst, rel=1e-3)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_joints_whose_derivatives_are_wrong_are_found(order: int, monkeypatch: pytest.MonkeyPatch) -> None:
    path, law, points = planned()
    own = type(path).derivatives

    def wrong(self: sf.kinematics.JointPath, s: Array, row: None = None) -> Array:
        d = own(self, s, row).copy()
        d[:, order, 4] *= 1.0 + 1e-4
        return d

    monkeypatch.setattr(type(path), "derivatives", wrong)
    problems = sf.check(points, path, FLANK, law=law).problems
    assert any(each.startswith(f"track: its derivative {order} of c by length is off") for each in problems), problems


@pytest.mark.parametrize("seed", [2, 3, 7, 11, 16])
def test_derivatives_of_joints_come_from_positions_alone(seed: int) -> None:
    """Also next to a pole, they agree with those of the jets of the inverse kinematics, to what rounding leaves."""
    path = sf.kinematics.JointPath(random_tool_path(seed), MACHINES[seed % 4])
    axes = AxesByPlace(path)
    ends = axes.ends
    stretch = np.repeat(np.arange(len(ends) - 1), 20)
    s = ends[stretch] + np.diff(ends)[stretch] * np.tile(np.linspace(0.01, 0.99, 20), len(ends) - 1)
    found, floor = axes.at(s, stretch)
    exact = np.moveaxis(path.derivatives(s), 1, 0)[:, :, : len(path.axes)]
    scale = np.max(np.abs(exact), axis=1, keepdims=True)
    assert np.all(np.abs(found - exact) <= 2.0 * floor + 1e-8 * scale)
    assert np.all(floor[:3] <= 1e-4 * scale[:3])


@pytest.mark.parametrize("count", [300, 1000])
def test_joints_along_many_lines_are_told_from_their_rounding(count: int) -> None:
    """Derivatives on short pieces of a long path, where a joint hardly moves: rounding is no fault of the track."""
    t = np.linspace(0.0, 40.0, count + 1)
    tip = np.column_stack([50.0 * np.cos(t), 50.0 * np.sin(t), t])
    axis = np.column_stack([0.3 * np.cos(t), 0.3 * np.sin(t), np.ones_like(t)])
    lines = [[sf.NurbsCurve(1, [0, 0, 1, 1], pair) for pair in pairwise(rows)] for rows in (tip, axis)]
    path = sf.kinematics.JointPath(sf.ToolPath(*lines, kind="vectors", name="many lines"), MACHINES[0])
    found, problems = AxesByPlace(path).apart(path)
    assert not problems
    assert found < 1e-6


def test_a_missing_end_and_an_uneven_tick_are_said() -> None:
    path, _, points = planned()
    verdict = sf.check(points.part(0, 3000), path, FLANK)
    assert any("the last setpoint is" in each for each in verdict.problems)
    t = points.t.copy()
    t[100] += 1e-4
    assert any("the period is not kept" in each for each in judged(t=t).problems)
    position = points.position.copy()
    position[5, 2] = np.nan
    assert any(each.startswith("tick 5 ") and each.endswith("z is nan") for each in judged(position).problems)


def test_a_stop_that_is_not_gentle_is_seen() -> None:
    path, _, points = planned()
    jolt = dataclasses.replace(points.part(200, len(points)), t=points.t[: len(points) - 200])
    verdict = sf.check(jolt, path, FLANK)
    assert any(each.startswith("axis_jerk.c: ") for each in verdict.problems)


def test_setpoints_of_another_machine_are_refused() -> None:
    _, _, points = planned()
    other = sf.kinematics.JointPath(flank(DATA), kinematics("xyzbc-trt"))
    with pytest.raises(InputError, match="the setpoints have axes"):
        sf.check(points, other, FLANK)
    path = planned()[0]
    with pytest.raises(InputError, match="have no u"):
        sf.check(dataclasses.replace(points, u=np.full(len(points), np.nan)), path, FLANK)
    with pytest.raises(InputError, match="there are no setpoints"):
        sf.check(points.part(0, 0), path, FLANK)
