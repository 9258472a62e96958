"""The check of joints finds what is wrong with them: made wrong on purpose, it is said."""

from __future__ import annotations

import dataclasses
from functools import cache
from pathlib import Path as File

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import InputError
from splinefeed.kinematics import kinematics
from splinefeed.records import Array
from tool_paths import FLANK, FLANK_PERIOD, flank

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
