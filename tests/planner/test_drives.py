"""Limits of what drives a machine: combinations of axes, and torques by the equations of a two-link arm."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import LimitsError, PlanError
from splinefeed.kinematics import kinematics
from splinefeed.records import Array
from tool_paths import random_tool_path

pytestmark = pytest.mark.nojit

PERIOD = 1e-3
#: A two-link arm in a vertical plane: lengths, m, masses, kg, of uniform rods; gravity, m/s^2.
L1, L2, M1, M2, G = 0.4, 0.3, 3.0, 2.0, 9.81
C1, C2, I1, I2 = L1 / 2.0, L2 / 2.0, M1 * L1**2 / 12.0, M2 * L2**2 / 12.0
MOST = {"a": 26.0, "b": 6.5}


def arm(q: Array, v: Array, a: Array) -> Array:
    """Torques, N m: Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, 2006, chapter 7 (planar elbow)."""
    (q1, q2), (v1, v2), (a1, a2) = q.T, v.T, a.T
    d12 = I2 + M2 * (C2**2 + L1 * C2 * np.cos(q2))
    d11 = I1 + M1 * C1**2 + M2 * L1**2 + M2 * L1 * C2 * np.cos(q2) + d12
    d22 = I2 + M2 * C2**2
    h = -M2 * L1 * C2 * np.sin(q2)
    lower = M2 * C2 * G * np.cos(q1 + q2)
    upper = (M1 * C1 + M2 * L1) * G * np.cos(q1) + lower
    return np.column_stack(
        [d11 * a1 + d12 * a2 + h * (2.0 * v1 * v2 + v2**2) + upper, d12 * a1 + d22 * a2 - h * v1**2 + lower]
    )


ARM = sf.Path([sf.NurbsCurve.bezier([[0.2, 0.1], [0.8, 1.2], [1.5, -0.6], [1.1, 0.9]])], ("a", "b"))


def at_rest(points: sf.Setpoints, rows: int) -> Array:
    """Positions of setpoints with a stand before and behind, (n + 2 rows, axes)."""
    return np.pad(points.position, ((rows, rows), (0, 0)), mode="edge")


def torques(points: sf.Setpoints) -> Array:
    """The arm's torques by inverse dynamics of differences, (n, 2), N m."""
    q = at_rest(points, 2)
    return arm(q[1:-1], (q[2:] - q[:-2]) / (2.0 * PERIOD), np.diff(q, 2, axis=0) / PERIOD**2)


@pytest.mark.parametrize("strategy", ["time-optimal", "look-ahead"])
@pytest.mark.parametrize("jerk", [None, {"a": 400.0, "b": 600.0}])
def test_an_arm_moves_as_fast_as_its_torques_allow(strategy: str, jerk: Any) -> None:
    limits = sf.Limits(axis_velocity={"a": 4.0, "b": 5.0}, torque=sf.records.Torque(arm, MOST), axis_jerk=jerk)
    law = sf.plan(ARM, limits, strategy=strategy, period=PERIOD, bound=True)
    points = sf.interpolate(ARM, law)
    shares = np.max(np.abs(torques(points)), axis=0) / list(MOST.values())
    assert np.all(shares <= 1.0 + 1e-6)
    assert np.max(shares) > 0.99
    verdict = sf.check(points, ARM, limits, law=law)
    assert verdict.ok, verdict.problems
    assert [verdict.limits[f"torque.{axis}"].share for axis in MOST] == pytest.approx(shares, rel=1e-9)
    if strategy == "time-optimal":
        assert law.settings["lower_bound_s"] > 0.95 * law.duration


def test_at_every_instant_of_the_optimum_a_torque_or_a_velocity_is_at_its_limit() -> None:
    """Bang-bang, Bobrow, Dubowsky and Gibson 1985; but where the limit switches within a cell."""
    limits = sf.Limits(axis_velocity={"a": 4.0, "b": 5.0}, torque=sf.records.Torque(arm, MOST))
    points = sf.interpolate(ARM, sf.plan(ARM, limits, strategy="time-optimal", period=PERIOD))
    shares = np.max(np.abs(torques(points)) / list(MOST.values()), axis=1)
    velocity = np.abs(np.gradient(points.position, PERIOD, axis=0)) / [4.0, 5.0]
    least = np.maximum(shares[1:-1], np.max(velocity, axis=1))
    assert np.mean(least > 0.98) > 0.9


def test_the_check_finds_torques_over_their_limit_by_itself() -> None:
    loose = sf.Limits(axis_velocity={"a": 4.0, "b": 5.0}, torque=sf.records.Torque(arm, MOST))
    points = sf.interpolate(ARM, sf.plan(ARM, loose, period=PERIOD))
    tight = sf.Limits(axis_velocity={"a": 4.0, "b": 5.0}, torque=sf.records.Torque(arm, {"a": 25.0, "b": 6.5}))
    verdict = sf.check(points, ARM, tight)
    assert not verdict.ok
    assert verdict.problems[0].startswith("torque.a: 25.9")
    assert "N m is" in verdict.problems[0]


def test_setpoints_of_a_gantry_keep_both_motors_within_their_limits() -> None:
    """A beam of 800 mm on two motors that also turns: y + 400 c and y - 400 c."""
    beam = {
        name: sf.records.Combination(
            weights={"y": 1.0, "c": side * 400.0}, velocity=150.0, acceleration=900.0, jerk=3e4
        )
        for name, side in (("left", 1.0), ("right", -1.0))
    }
    curve = sf.NurbsCurve.bezier([[0, 0, 0], [60, 80, 0.2], [10, 120, -0.25], [90, 200, 0.1]])
    path = sf.Path([curve], ("x", "y", "c"))
    free = sf.Limits(feed=150, axis_acceleration=1500, axis_jerk=6e4)
    limits = sf.Limits(feed=150, axis_acceleration=1500, axis_jerk=6e4, combinations=beam)
    for strategy in ("time-optimal", "look-ahead"):
        law = sf.plan(path, limits, strategy=strategy, period=PERIOD)
        points = sf.interpolate(path, law)
        verdict = sf.check(points, path, limits, law=law)
        assert verdict.ok, verdict.problems
        seen = sf.check(points, path, limits)
        q = at_rest(points, 3)
        for name, side in (("left", 1.0), ("right", -1.0)):
            motor = q[:, 1] + side * 400.0 * q[:, 2]
            for order, (kind, bound) in enumerate((("velocity", 150), ("acceleration", 900), ("jerk", 3e4)), start=1):
                share = np.max(np.abs(np.diff(motor, order))) / PERIOD**order / bound
                assert share <= 1.0 + 1e-6
                found, exact = (each.limits[f"combinations.{name}.{kind}"].share for each in (seen, verdict))
                assert found == pytest.approx(share, rel=1e-6)
                assert exact >= found * (1.0 - 1e-9)
        assert max(verdict.limits[f"combinations.{name}.jerk"].share for name in beam) > 0.99
        faster = sf.interpolate(path, sf.plan(path, free, strategy=strategy, period=PERIOD))
        found = sf.check(faster, path, limits)
        assert any(problem.startswith("combinations.") for problem in found.problems)
    assert sf.Limits.from_dict(limits.as_dict()) == limits


def test_a_combination_of_one_axis_is_that_axis() -> None:
    path = sf.shapes.butterfly()
    axes = {name: sf.records.Combination(weights={name: -2.0}, acceleration=1000.0, jerk=4e4) for name in path.axes}
    one = sf.plan(path, sf.Limits(feed=60, axis_acceleration=500, axis_jerk=2e4), strategy="look-ahead")
    other = sf.plan(path, sf.Limits(feed=60, combinations=axes), strategy="look-ahead")
    assert other.duration == pytest.approx(one.duration, rel=1e-6)


def test_jerk_along_a_tool_axis_is_held_where_curvature_jumps() -> None:
    """A line that goes over into an arc, and a tool at 30 degrees in their plane."""
    line = sf.NurbsCurve.bezier([[-30, 0], [0, 0]])
    arc = sf.NurbsCurve.bezier([[0, 0], [20, 0], [20, 20]], weights=[1, np.sqrt(0.5), 1])
    path = sf.Path([line, arc])
    tool = sf.records.Combination(weights={"x": np.cos(np.pi / 6), "y": np.sin(np.pi / 6)}, jerk=2e4)
    limits = sf.Limits(feed=80, axis_acceleration=1000, axis_jerk=6e4, combinations={"tool": tool})
    points = sf.interpolate(path, sf.plan(path, limits, strategy="time-optimal", period=PERIOD))
    seen = np.abs(np.diff(at_rest(points, 3) @ [np.cos(np.pi / 6), np.sin(np.pi / 6)], 3)) / PERIOD**3
    assert 0.98 < np.max(seen) / 2e4 <= 1.0 + 1e-6
    assert sf.check(points, path, limits).ok


def test_joints_of_a_machine_have_combinations_and_torques_too() -> None:
    path = sf.kinematics.JointPath(random_tool_path(1), kinematics("xyzac-trt"))
    both = {"both": sf.records.Combination(weights={"x": 1.0, "y": 1.0}, acceleration=1500.0)}
    table = sf.records.Torque(lambda q, v, a: 0.05 * a, {"c": 0.2})
    limits = sf.Limits(feed=50, axis_acceleration=2000, axis_jerk=1e5, combinations=both, torque=table)
    points = sf.interpolate(path, sf.plan(path, limits, period=2e-3))
    verdict = sf.check(points, path, limits)
    assert verdict.ok, verdict.problems
    assert {"combinations.both.acceleration", "torque.c"} <= verdict.limits.keys()
    stricter = sf.Limits(feed=50, torque=sf.records.Torque(lambda q, v, a: 0.05 * a, {"c": 0.001}))
    assert any(problem.startswith("torque.c") for problem in sf.check(points, path, stricter).problems)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sf.records.Combination(weights={}, jerk=1.0), "weights of a combination"),
        (lambda: sf.records.Combination(weights={"x": np.nan}, jerk=1.0), "give finite ones"),
        (lambda: sf.records.Combination(weights={"x": 1.0}), "one at least is needed"),
        (lambda: sf.records.Combination(weights={"x": 1.0}, jerk=-1.0), "must be positive"),
        (lambda: sf.records.Torque(arm, {}), "one at least is needed"),
        (lambda: sf.records.Torque(arm, {"a": np.nan}), "must be positive"),
        (lambda: sf.records.Torque(None, MOST), "a function of positions"),  # type: ignore[arg-type]
        (lambda: sf.Limits(feed=1, combinations={"a.b": None}), "without a dot"),  # type: ignore[dict-item]
        (lambda: sf.Limits(feed=1, torque=arm), "give a Torque"),  # type: ignore[arg-type]
        (lambda: sf.Limits.from_dict({"feed": 1.0, "torque.a": 1.0}), "is not a limit that a file can hold"),
        (lambda: sf.Limits.from_dict({"feed": 1.0, "combinations.left.force": 1.0}), "velocity, acceleration, jerk"),
    ],
)
def test_what_is_no_limit_is_refused(make: Any, message: str) -> None:
    with pytest.raises(LimitsError, match=message):
        make()


def test_what_cannot_be_held_is_refused_by_name() -> None:
    def plan(model: Any, most: dict[str, float], **given: Any) -> Any:
        return sf.plan(ARM, sf.Limits(feed=100, torque=sf.records.Torque(model, most)), period=PERIOD, **given)

    with pytest.raises(
        PlanError, match=r"standing still takes 16\.\d+ N m of a, whose torque is at most 16 N m; only momentum"
    ):
        plan(arm, {"a": 16.0, "b": 6.5})
    with pytest.raises(LimitsError, match="it has friction"):
        plan(lambda q, v, a: arm(q, v, a) + 0.3 * v, MOST)
    with pytest.raises(LimitsError, match="numbers that are not finite"):
        plan(lambda q, v, a: np.nan * a, MOST)
    with pytest.raises(LimitsError, match=r"gives \(\d+,\) for"):
        plan(lambda q, v, a: a[:, 0], MOST)
    with pytest.raises(LimitsError, match="no axis 'c'"):
        plan(arm, {"a": 26.0, "c": 6.5})
    with pytest.raises(LimitsError, match="torque: the seven-phase strategy cannot hold it"):
        plan(arm, MOST, strategy="seven-phase")
    given = sf.Limits(feed=100, combinations={"sum": sf.records.Combination(weights={"a": 1.0, "b": 1.0}, jerk=100.0)})
    with pytest.raises(LimitsError, match="combinations: the seven-phase strategy cannot hold it"):
        sf.plan(ARM, given, strategy="seven-phase", period=PERIOD)
