"""Tuning on a path: less contour error, every loop within its bound, the same gains from the same seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import InputError
from splinefeed.machine import Machine
from splinefeed.paths.path import Path
from splinefeed.records import Limits, Setpoints
from splinefeed.runs.tuning import tune_on_path
from splinefeed.simulation import follow, linear
from splinefeed.simulation.curves import hunts, rest_swing
from splinefeed.simulation.linear import Bound, margins, quick_slacks

LIMITS = Limits(feed=40.0, acceleration=500.0, jerk=20_000.0)


@pytest.fixture(scope="module")
def circle() -> tuple[Path, Setpoints]:
    path = sf.shapes.circle(radius=5.0)
    return path, sf.interpolate(path, sf.plan(path, LIMITS, period=1e-3), period=1e-3)


@pytest.mark.parametrize(("name", "forward"), [("xytheta", False), ("xytheta", True), ("lintable", False)])
def test_the_error_falls_and_the_bound_holds(circle: tuple[Path, Setpoints], name: str, forward: bool) -> None:
    path, points = circle
    machine = Machine.load(name)
    told: list[tuple[int, int]] = []
    found = tune_on_path(
        machine, points, path, evaluations=60, feed_forward=forward, on_progress=lambda *each: told.append(each)
    )
    assert found.evaluations <= 60
    assert told[-1] == (60, 60)
    assert found.before is not None
    assert (
        found.contour.max < (0.5 if name == "xytheta" else 1.5) * found.before.max
    )  # lintable's own gains keep 39 deg alone, and less of it is followed with 45
    again = sf.runs.follow(points, found.machine, path=path).contour_error
    assert np.max(np.abs(again)) == found.contour.max
    for axis in ("x", "y"):
        seen = margins(found.machine.axes[axis], 1e-3)
        assert seen.stable
        assert seen.gain_margin >= 2.0
        assert seen.gain_reduction <= 0.5
        assert seen.phase_margin >= 45.0
        assert seen.sensitivity <= 2.0
        assert not hunts(found.machine.axes[axis], rest_swing(found.machine.axes[axis], 1e-3))
        assert (found.axes[axis].axis.controller.velocity_feed_forward > 0.0) == (forward or name == "lintable")
    assert found.machine.axes.keys() == machine.axes.keys()
    assert name != "xytheta" or found.machine.axes["theta"] == machine.axes["theta"]


def test_the_same_seed_gives_the_same_gains(circle: tuple[Path, Setpoints]) -> None:
    path, points = circle
    machine = Machine.load("xytheta")
    one, two, other = (tune_on_path(machine, points, path, evaluations=25, seed=seed).machine for seed in (1, 1, 2))
    assert one == two
    assert one != other


def test_the_last_bits_of_arithmetic_change_no_gain(
    circle: tuple[Path, Setpoints], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Gains of 53.1, 55.5 and 56.8 by environment were found once: the model here is off by parts in 1e14."""
    path, points = circle
    machine = Machine.load("xytheta")
    first = tune_on_path(machine, points, path, evaluations=60).machine
    rng, hold, table = np.random.default_rng(1), linear.zero_order_hold, follow.step_table

    def off(values):  # type: ignore[no-untyped-def]
        return values * (1.0 + 1e-14 * rng.standard_normal(values.shape))

    monkeypatch.setattr(linear, "zero_order_hold", lambda *given: tuple(map(off, hold(*given))))
    monkeypatch.setattr(follow, "step_table", lambda *given: off(table(*given)))
    for _ in range(3):
        assert tune_on_path(machine, points, path, evaluations=60).machine == first


def test_a_rotary_axis_is_tuned_for_itself(circle: tuple[Path, Setpoints]) -> None:
    path, points = circle
    theta = 0.2 * (1.0 - np.cos(2.0 * np.pi * points.s / path.length))
    curves = []
    for c in path.curves:
        flat = np.column_stack([c.control_points, np.zeros(len(c.control_points))])
        curves.append(sf.NurbsCurve(c.degree, c.knots, flat, c.weights))
    turned = sf.Path(curves, axes=("x", "y", "theta"))
    position = np.column_stack([points.position, theta])
    moved = replace(points, position=position, axes=("x", "y", "theta"))
    found = tune_on_path(Machine.load("xytheta"), moved, turned, axes=("theta",), evaluations=30)
    assert set(found.axes) == {"theta"}
    assert found.axes["theta"].tracking < 0.2 * found.axes["theta"].tracking_before
    assert found.machine.axes["x"] == Machine.load("xytheta").axes["x"]


def test_gains_that_run_away_are_replaced_and_said(circle: tuple[Path, Setpoints]) -> None:
    path, points = circle
    machine = Machine.load("xytheta")
    x = machine.axes["x"]
    x = replace(x, controller=replace(x.controller, ki=20_000.0, kd=0.0, error_limit=0.5))
    wild = replace(machine, axes={**machine.axes, "x": x})
    found = tune_on_path(wild, points, path, evaluations=20)
    assert found.before is None
    assert "unstable: a closed-loop pole has modulus" in found.axes["x"].before.sentence
    assert found.axes["x"].margins.stable


def test_the_quick_test_of_margins_is_the_exact_one() -> None:
    bound = Bound()
    rng = np.random.default_rng(3)
    axis = Machine.load("xytheta").axes["x"]
    quick = quick_slacks(axis, 1e-3, bound)
    for _ in range(40):
        kp, ki, kd = (
            20.0 * 3.0 ** rng.uniform(-1, 1),
            500.0 * 10.0 ** rng.uniform(-1, 1),
            0.15 * 3.0 ** rng.uniform(-1, 1),
        )
        other = replace(axis, controller=replace(axis.controller, kp=kp, ki=ki, kd=kd))
        assert np.min(quick(other)) == pytest.approx(np.min(bound.slacks(margins(other, 1e-3))), abs=2e-3)


def test_tune_is_one_name_for_both(circle: tuple[Path, Setpoints]) -> None:
    path, points = circle
    machine = Machine.load("xytheta")
    found = sf.runs.tune(machine, "path", setpoints=points, path=path, evaluations=5)
    assert found.contour.max > 0.0
    assert sf.runs.tune(machine.axes["x"]).rule == "margins"
    for call in (
        lambda: sf.runs.tune(machine, "ziegler-nichols"),
        lambda: sf.runs.tune(machine.axes["x"], "path"),
        lambda: sf.runs.tune(machine, "path", setpoints=points),
        lambda: sf.runs.tune("x"),
    ):
        with pytest.raises(InputError, match=r"tune takes an axis, .* or a Machine with setpoints=, path= and rule"):
            call()
    cases = [
        (
            lambda: tune_on_path(machine, points, path, evaluations=0),
            "evaluations is 0; it must be a whole number from 1 to 100000",
        ),
        (
            lambda: tune_on_path(machine, points, path, axes=("theta",)),
            "axis 'theta' does not move on this path; its axes are x, y",
        ),
        (lambda: Bound(gain_margin=1.0), "gain_margin is 1.0; it must lie between 1 and inf"),
        (lambda: Bound(phase_margin=float("nan")), "phase_margin is nan; it must lie between 0 and 90"),
        (lambda: Bound(phase_margin=120.0), "phase_margin is 120.0; it must lie between 0 and 90"),
    ]
    for call, message in cases:
        with pytest.raises(InputError) as caught:
            call()
        assert str(caught.value) == message


def test_where_no_gains_keep_the_bound_it_is_said(circle: tuple[Path, Setpoints]) -> None:
    path, points = circle
    with pytest.raises(InputError, match=r"no gains of axis x, y were found that keep the bound \(gain margin"):
        tune_on_path(Machine.load("xytheta"), points, path, evaluations=5, bound=Bound(1.01, 89.9, 1.0001))
