"""Setpoints through whole machines: counts, codes, saturation, delay, run-away, chunks, and input that is refused."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simulation.axes import PERIOD, force_axis, setpoints, table, velocity_axis
from splinefeed.errors import InputError
from splinefeed.kernels import mechanics
from splinefeed.machine import Friction, Machine
from splinefeed.records import Response, Setpoints
from splinefeed.runs.following import follow
from splinefeed.simulation.follow import Follower
from splinefeed.simulation.plant import parameters

TIME = np.arange(600) * PERIOD
WAVE = 5.0 * (1.0 - np.cos(2.0 * np.pi * 3.0 * TIME))


def same(one: Response, other: Response) -> bool:
    names = ("t", "command", "position", "measured", "output", "saturated")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


@pytest.mark.nojit
def test_the_response_says_what_went_in_and_what_came_out() -> None:
    response = follow(setpoints(WAVE[:60]), table(velocity_axis(output_bits=16)))
    assert (response.axes, response.period, response.stopped, len(response)) == (("x",), PERIOD, None, 60)
    np.testing.assert_array_equal(response.command[:, 0], WAVE[:60])
    np.testing.assert_array_equal(response.t, TIME[:60])
    assert response.settings == {"machine": "test", "linear": False}
    assert not response.saturated.any()
    assert response.contour_error is None


@pytest.mark.nojit
def test_counts_and_codes_are_exact() -> None:
    response = follow(setpoints(WAVE[:60]), table(velocity_axis(output_bits=16)))
    step = 20.0 / 65536
    codes = response.output[:, 0] / step
    np.testing.assert_array_equal(codes, np.round(codes))
    counts = np.floor(response.position[:, 0] / 1e-3 + 0.5)
    np.testing.assert_array_equal(response.measured[:, 0], counts * 1e-3)


@pytest.mark.nojit
def test_the_converter_has_one_code_more_below_zero() -> None:
    numbers = parameters(velocity_axis(output_bits=16), PERIOD)
    step = 20.0 / 65536
    assert mechanics.convert(99.0, numbers) == 32767 * step
    assert mechanics.convert(-99.0, numbers) == -10.0
    assert mechanics.convert(0.49 * step, numbers) == 0.0
    assert mechanics.convert(0.51 * step, numbers) == step


@pytest.mark.nojit
def test_the_encoder_counts_four_edges_a_pulse() -> None:
    axis = velocity_axis(feedback="encoder")
    assert axis.encoder_resolution == pytest.approx(5.0 / 20000, rel=1e-15)
    response = follow(setpoints(WAVE[:40]), table(axis))
    counts = response.measured[:, 0] / axis.encoder_resolution
    np.testing.assert_allclose(counts, np.round(counts), rtol=0, atol=1e-9)


def test_the_encoder_does_not_see_play_and_the_scale_does() -> None:
    """On a ramp the load hangs half the play behind the motor; a scale lets the loop make that good."""
    ramp = np.linspace(0.0, 2.0, 400)
    errors = {}
    for feedback in ("encoder", "scale"):
        axis = velocity_axis(backlash=0.1, feedback=feedback, kp=5.0, ki=50.0, kd=0.0, friction=Friction(coulomb=5.0))
        errors[feedback] = follow(setpoints(ramp), table(axis)).tracking_error[-1, 0]
    assert errors["encoder"] == pytest.approx(0.05, abs=2e-3)
    assert abs(errors["scale"]) < 2e-3


def test_a_delay_shifts_what_takes_effect_by_one_period() -> None:
    """With the plant driven open loop by feed-forward alone, a delayed axis does the same one period later."""
    forward = {"kp": 1e-12, "ki": 0.0, "kd": 0.0, "velocity_feed_forward": 0.04}
    prompt, late = (follow(setpoints(WAVE), table(velocity_axis(delay=d, **forward)), linear=True) for d in (0, 1))
    np.testing.assert_allclose(late.position[1:, 0], prompt.position[:-1, 0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(late.output, prompt.output, rtol=0, atol=1e-9)


def test_saturation_is_flagged_and_the_integral_does_not_wind_up() -> None:
    """A step of 5 mm saturates; with clamping the overshoot stays below that of the unlimited linear loop."""
    command = np.concatenate([[0.0], np.full(800, 4.9)])
    axis = velocity_axis(ki=800.0, output_bits=16)
    response = follow(setpoints(command), table(axis))
    assert response.stopped is None
    assert response.saturated[1, 0]
    assert not response.saturated[0, 0]
    assert not response.saturated[-1, 0]
    assert response.output.max() == 32767 * 20.0 / 65536
    linear = follow(setpoints(command), table(axis), linear=True)
    assert not linear.saturated.any()
    wound = np.max(response.position) - 4.9
    assert wound < np.max(linear.position) - 4.9
    assert abs(response.tracking_error[-1, 0]) < 2e-3


@pytest.mark.nojit
def test_the_integral_waits_while_the_output_is_beyond_its_limit() -> None:
    numbers = parameters(velocity_axis(kd=0.0), PERIOD)
    memory = np.zeros(mechanics.MEMORY)
    for _ in range(50):
        mechanics.control(1.0, 0.0, numbers, memory)  # 22 V wanted
    assert memory[mechanics.INTEGRAL] == 0.0
    mechanics.control(-0.01, 0.0, numbers, memory)  # within the limit
    assert memory[mechanics.INTEGRAL] == pytest.approx(-0.01 * 266.8899 * PERIOD)


def test_feed_forward_removes_what_it_is_for() -> None:
    gains = {"kp": 4.0, "ki": 0.0, "kd": 0.0}
    ramp = 40.0 * TIME
    without = follow(setpoints(ramp), table(velocity_axis(**gains)), linear=True).tracking_error[-1, 0]
    assert without == pytest.approx(40.0 / (4.0 * 25.0), rel=1e-2)
    both = follow(setpoints(ramp), table(velocity_axis(velocity_feed_forward=1 / 25.0, **gains)), linear=True)
    assert abs(both.tracking_error[-1, 0]) < 1e-3 * without


def test_a_run_away_stops_and_says_why() -> None:
    axis = velocity_axis(lag=1e-3, error_limit=0.05)
    response = follow(setpoints(WAVE), table(axis))
    assert response.stopped is not None
    message = (
        r"axis x ran away at 0\.\d+ s: an error of 0\.\d+ mm is beyond its limit of 0\.05 mm; "
        r"its loop may be unstable \(splinefeed tune\), or the feed too high"
    )
    assert re.fullmatch(message, response.stopped)
    assert 1 < len(response) < len(WAVE)
    errors = np.abs(response.command - response.measured)[:, 0]
    assert errors[-1] > 0.05
    assert np.all(errors[:-1] <= 0.05)


def test_the_first_axis_to_run_away_stops_all() -> None:
    good = velocity_axis(error_limit=50.0)
    bad = replace(velocity_axis(lag=1e-3, error_limit=0.05), name="y")
    for axes in (("x", "y"), ("y", "x")):
        points = setpoints(np.column_stack([WAVE, WAVE]), axes)
        response = follow(points, table(good, bad))
        assert response.stopped is not None
        assert response.stopped.startswith("axis y ran away at ")
        alone = follow(setpoints(WAVE, ("y",)), table(bad))
        assert len(response) == len(alone)


@pytest.mark.parametrize("sizes", [[1] * 40 + [560], [7, 93, 500], [600]])
def test_chunks_give_the_same_bits(sizes: list[int]) -> None:
    machine = Machine.load("xytheta")
    points = setpoints(np.column_stack([WAVE, -WAVE, 0.1 * WAVE]), ("x", "y", "theta"))
    whole = follow(points, machine)
    stops = np.cumsum(sizes)

    def chunks() -> Any:
        for start, stop in zip(stops - sizes, stops, strict=True):
            part = setpoints(points.position[start:stop], points.axes)
            yield replace(part, t=points.t[start:stop])

    follower = Follower(machine, points.axes, PERIOD)
    parts = [follower.follow(chunk) for chunk in chunks()]
    assert [len(part) for part in parts] == sizes
    for name in ("t", "command", "position", "measured", "output", "saturated"):
        joined = np.concatenate([getattr(part, name) for part in parts])
        np.testing.assert_array_equal(joined, getattr(whole, name))


def test_chunks_end_with_the_run_away() -> None:
    machine = table(velocity_axis(lag=1e-3, error_limit=0.05))
    whole = follow(setpoints(WAVE), machine)
    follower = Follower(machine, ("x",), PERIOD)
    every = [follower.follow(setpoints(WAVE[i : i + 5])) for i in range(0, 600, 5)]
    parts = [part for part in every if len(part)]
    assert sum(len(part) for part in parts) == len(whole)
    assert [part.stopped is not None for part in parts] == [False] * (len(parts) - 1) + [True]
    follower = Follower(machine, ("x",), PERIOD)
    follower.follow(setpoints(WAVE))
    assert len(follower.follow(setpoints(WAVE))) == 0


def test_axes_at_rest_stay_where_they_are() -> None:
    machine = Machine.load("xytheta")
    position = np.column_stack([WAVE, np.full(600, 12.3456), np.full(600, 0.5)])
    response = follow(setpoints(position, ("x", "y", "theta")), machine)
    assert np.max(np.abs(response.tracking_error[:, 1])) <= 1e-3
    assert np.max(np.abs(response.tracking_error[:, 2])) <= machine.axes["theta"].encoder_resolution


def test_no_machine_of_the_package_runs_away_on_a_calm_wave() -> None:
    for machine in map(Machine.load, Machine.names()):
        axes = tuple(machine.axes)
        if not axes or not machine.simulates(axes):  # a control or limits alone, for cycle times
            continue
        calm = np.column_stack([(0.1 if axis in ("theta", "a", "b", "c") else 1.0) * WAVE for axis in axes])
        response = follow(setpoints(calm, axes), machine)
        assert response.stopped is None
        assert np.all(np.max(np.abs(response.tracking_error), axis=0) < 0.5)


# --- refused ---------------------------------------------------------------------------------------------------------


@pytest.mark.nojit
def test_bad_input_is_refused_by_name() -> None:
    machine = Machine.load("xytheta")
    with pytest.raises(InputError) as caught:
        Follower(machine, ("x", "z"), PERIOD)
    assert str(caught.value) == "machine 'xytheta' has no axis z; its axes are x, y, theta"
    bad = np.zeros((4, 2))
    bad[2, 1] = math.nan
    with pytest.raises(InputError) as caught:
        Follower(machine, ("x", "y"), PERIOD).follow(setpoints(bad, ("x", "y")))
    assert str(caught.value) == "at t = 0.002 s axis y is nan; expected a finite number"
    with pytest.raises(InputError) as caught:
        follow(setpoints(np.zeros((0, 1))), machine)
    assert str(caught.value) == "no setpoints; at least one is needed"
    with pytest.raises(InputError) as caught:
        follow(setpoints(np.zeros(3), period=0.0), machine)
    assert str(caught.value) == "period is 0.0 s; it must be greater than 0 and finite"


@pytest.mark.nojit
def test_chunks_must_go_together() -> None:
    follower = Follower(Machine.load("xytheta"), ("x",), PERIOD)
    with pytest.raises(InputError) as caught:
        follower.follow(setpoints(np.zeros(3), ("y",)))
    assert str(caught.value) == "setpoints have axes y; expected x"
    with pytest.raises(InputError) as caught:
        follower.follow(setpoints(np.zeros(3), period=2e-3))
    assert str(caught.value) == "setpoints have a period of 0.002 s; expected 0.001 s"


# --- any machine -----------------------------------------------------------------------------------------------------


def logs(low: float, high: float) -> Any:
    return st.floats(math.log(low), math.log(high)).map(math.exp)


@st.composite
def machines(draw: Any) -> Machine:
    """Any machine that passes its checks, sensible or not."""
    dry = draw(st.sampled_from([0.0, 1.0, 30.0]))
    more = draw(st.sampled_from([0.0, 0.5, 20.0]))
    friction = Friction(
        coulomb=dry,
        static=dry + more,
        stribeck_speed=draw(logs(1e-3, 100.0)),
        viscous=draw(st.sampled_from([0.0, 0.1, 5.0])),
    )
    shared = {
        "friction": friction,
        "backlash": draw(st.sampled_from([0.0, 1e-3, 0.5])),
        "stiffness": draw(st.one_of(st.none(), logs(1.0, 1e6))),
        "lag": draw(logs(1e-5, 0.1)),
        "delay": draw(st.integers(0, 1)),
        "filter": draw(st.sampled_from([0.0, 1e-3])),
        "output_bits": draw(st.sampled_from([0, 8, 16])),
        "error_limit": draw(logs(0.01, 1e6)),
    }
    if draw(st.booleans()):
        gains = {"kp": draw(logs(1e-2, 1e4)), "ki": draw(logs(1e-2, 1e5)), "kd": draw(logs(1e-4, 10.0))}
        return table(velocity_axis(gain=draw(logs(0.1, 1e3)), peak=draw(logs(1e-3, 1e3)), **shared, **gains))
    gains = {
        "position_gain": draw(logs(0.1, 1e4)),
        "velocity_kp": draw(logs(1e-4, 1e2)),
        "velocity_ki": draw(logs(1e-2, 1e4)),
    }
    return table(force_axis(**shared, **gains))


@settings(max_examples=60)
@given(machines(), st.integers(0, 2**32 - 1))
def test_no_machine_makes_a_nan(machine: Machine, seed: int) -> None:
    """Whatever the machine and the motion: finite numbers, output within its limit, and an end that is explained."""
    command = np.cumsum(np.random.default_rng(seed).normal(scale=0.05, size=120))
    points: Setpoints = setpoints(command)
    response = follow(points, machine)
    for name in ("position", "measured", "output"):
        assert np.all(np.isfinite(getattr(response, name)))
    assert np.all(np.abs(response.output) <= 10.0)
    assert (response.stopped is None) == (len(response) == len(points)) or response.stopped is not None
    axis = machine.axes["x"]
    if axis.transmission.stiffness is None:
        assert same(response, follow(points, machine))


@settings(max_examples=25)
@given(machine=machines(), seed=st.integers(0, 2**31))
def test_plain_python_and_the_compiled_loop_give_the_same_bits(machine: Machine, seed: int) -> None:
    points = setpoints(np.cumsum(np.random.default_rng(seed).normal(scale=0.03, size=60)))
    found = []
    for run_axis in (mechanics.run_axis.plainly, mechanics.run_axis.compiled):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(mechanics.run_axis, "for_work", lambda count, run_axis=run_axis: run_axis)
            found.append(follow(points, machine))
    assert same(*found)
    assert found[0].position.tobytes() == found[1].position.tobytes()
