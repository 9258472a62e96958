"""What a figure of a tuned axis shows: its loop over frequency, and its response to a small step."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from splinefeed.machine.parts import FEED_FORWARD, ServoAxis
from splinefeed.records import Array
from splinefeed.simulation.follow import AxisRun
from splinefeed.simulation.linear import ComplexArray, discrete_plant, loop_responses, margins
from splinefeed.simulation.plant import seen_resolution

#: Points of a curve over frequency, between these shares of half the servo rate.
POINTS = 800
LOWEST_SHARE, HIGHEST_SHARE = 1e-3, 0.98
#: A step makes the linear loop put out this share of its limit at most.
OUTPUT_SHARE = 0.5
#: Ticks before the step; a step is watched for this many over the bandwidth of the slower loop, within these bounds, s.
BEFORE = 5
#: A step of so many counts, the times that it is given to settle and is watched, s, and the counts of hunting that is
#: no rest any more.
REST_STEP = 20.0
REST_SETTLING, REST_WATCHED = 0.5, 0.5
HUNTING = 3.0
SWINGS = 8.0
SHORTEST, LONGEST = 0.25, 1.0
#: Shortest and longest standard move, and how long the axis is watched behind it, s.
MOVE, MOVE_REST = (0.05, 0.5), 0.1


@dataclass(frozen=True, eq=False)
class LoopCurves:
    """Frequency responses of the loop of an axis.

    Attributes
    ----------
    frequency : (n,) array
        Hz.
    loop : (n,) complex array
        L, opened at the controller's output.
    closed : (n,) complex array
        T, from reference to position.
    """

    frequency: Array
    loop: ComplexArray
    closed: ComplexArray


@dataclass(frozen=True, eq=False)
class StepResponse:
    """What an axis does after a step of its reference.

    Attributes
    ----------
    t : (n,) array
        From the step on, s.
    position : (n,) array
        mm or rad.
    size : float
        Of the step, mm or rad.
    stopped : bool
        Whether the axis ran away.
    """

    t: Array
    position: Array
    size: float
    stopped: bool


def loop_curves(axis: ServoAxis, period: float) -> LoopCurves:
    """Compute L and T of an axis up to half the servo rate.

    Parameters
    ----------
    axis : ServoAxis
        The axis.
    period : float
        Of the servo, s.

    Returns
    -------
    LoopCurves
        Over n frequencies, Hz.
    """
    nyquist = 0.5 / period
    frequency = np.geomspace(LOWEST_SHARE * nyquist, HIGHEST_SHARE * nyquist, POINTS)
    omega = 2.0 * np.pi * frequency
    found = loop_responses(axis.controller, period, omega, discrete_plant(axis, period).response(omega))
    return LoopCurves(frequency, *found)


def watched(old: ServoAxis, new: ServoAxis, period: float) -> float:
    """Return how long a step of an axis is watched: long enough for its slower loop, and to see it hunt.

    Parameters
    ----------
    old, new : ServoAxis
        The axis with its old and its new controller.
    period : float
        Of the servo, s.

    Returns
    -------
    float
        s.
    """
    loops = (margins(_without_forward(axis), period) for axis in (old, new))
    bandwidth = min((each.bandwidth for each in loops if each.stable), default=math.inf)
    return min(max(SWINGS / bandwidth, SHORTEST), LONGEST)


def step_responses(
    old: ServoAxis, new: ServoAxis, period: float, duration: float | None = None
) -> tuple[StepResponse, StepResponse]:
    """Simulate the full axis after the same small step with its old and its new controller.

    Parameters
    ----------
    old, new : ServoAxis
        The axis with its old and its new controller.
    period : float
        Of the servo, s.
    duration : float, optional
        s; by default that of `watched`.

    Returns
    -------
    old, new : StepResponse
        Over n ticks.

    Notes
    -----
    Friction, counts and codes are included. Feed-forward is left out: it is for motions and would only add a blow. The
    step is small enough that the linear loop stays within half the output: 1, 2 or 5 times a power of ten, mm or deg.
    """
    old, new = (_without_forward(axis) for axis in (old, new))
    loops = (margins(old, period), margins(new, period))
    ticks = BEFORE + math.ceil((duration or watched(old, new, period)) / period)
    peaks = [float(np.max(np.abs(_stepped(axis, period, ticks, 1.0, linear=True)[1]))) for axis in (old, new)]
    kept = [peak for peak, each in zip(peaks, loops, strict=True) if each.stable] or peaks
    unit = math.radians(1.0) if old.rotary else 1.0
    largest = min(OUTPUT_SHARE * old.controller.output_limit / max(*kept, 1e-300), 0.5 * old.controller.error_limit)
    size = unit * rounded_down(largest / unit)
    found = []
    for axis in (old, new):
        position, _, stopped = _stepped(axis, period, ticks, size)
        t = np.arange(-BEFORE, len(position) - BEFORE, dtype=np.float64) * period
        found.append(StepResponse(t, position, size, stopped))
    return found[0], found[1]


def _without_forward(axis: ServoAxis) -> ServoAxis:
    none: dict[str, Any] = dict.fromkeys(FEED_FORWARD, 0.0)
    return replace(axis, controller=replace(axis.controller, **none))


def rest_swing(axis: ServoAxis, period: float) -> float:
    """Return the amplitude at which the full axis hunts after a small step.

    Parameters
    ----------
    axis : ServoAxis
        The axis.
    period : float
        Of the servo, s.

    Returns
    -------
    float
        Peak to peak, mm or rad; infinite if the axis runs away.

    Notes
    -----
    Integral action against static friction, or too little phase margin, can make it hunt; a good loop
    comes to rest within a count or two.
    """
    resolution = seen_resolution(axis)
    ticks = BEFORE + math.ceil((REST_SETTLING + REST_WATCHED) / period)
    size = min(REST_STEP * resolution, 0.5 * axis.controller.error_limit)
    position, _, stopped = _stepped(axis, period, ticks, size)
    if stopped:
        return math.inf
    watched = position[-math.ceil(REST_WATCHED / period) :]
    moves = np.diff(watched)
    up, down = float(np.sum(moves[moves > 0.0])), float(-np.sum(moves[moves < 0.0]))
    return min(float(np.ptp(watched)), up, down)  # a slow creep to the goal goes one way only, and is not hunting


def hunts(axis: ServoAxis, swing: float) -> bool:
    """Tell whether hunting at rest, by `swing` of `rest_swing`, mm or rad, is more than counts alone make."""
    return swing > HUNTING * seen_resolution(axis)


def _stepped(
    axis: ServoAxis, period: float, ticks: int, size: float, linear: bool = False
) -> tuple[Array, Array, bool]:
    """Position and output (n,) of an axis after a step, and whether it ran away, which a linear one may."""
    run = AxisRun(axis, period, linear=linear, error_limit=math.inf if linear else None)
    position, _, output, _ = run.follow(np.where(np.arange(ticks) < BEFORE, 0.0, size))
    return position, output, run.ran_away is not None


def standard_move(axis: ServoAxis, period: float) -> Array:
    """Return places of a move from rest to rest that an axis is judged by, and of the rest behind it.

    Parameters
    ----------
    axis : ServoAxis
        The axis.
    period : float
        Of the servo, s.

    Returns
    -------
    (n,) array
        mm or rad, one a tick.

    Notes
    -----
    x = D (t / T - sin(2 pi t / T) / (2 pi)), whose velocity is at most 2 D / T and acceleration 2 pi D / T^2: half of
    the axis's limits, or of what its motor can do, within MOVE seconds.
    """
    top = axis.motor.rated_speed * axis.travel_per_motor
    force = axis.motor.peak_force * axis.force_per_motor_force / (axis.motor_inertia + axis.load_inertia)
    velocity = 0.5 * (top if axis.limits.velocity is None else axis.limits.velocity)
    acceleration = 0.5 * (0.5 * force if axis.limits.acceleration is None else axis.limits.acceleration)
    duration = min(max(math.pi * velocity / acceleration, MOVE[0]), MOVE[1])
    distance = min(0.5 * velocity * duration, acceleration * duration**2 / (2.0 * math.pi))
    share = np.minimum(np.arange(math.ceil((duration + MOVE_REST) / period)) * period / duration, 1.0)
    out: Array = distance * (share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi))
    return out


def following_error(axis: ServoAxis, period: float) -> float:
    """Return the largest following error, mm or rad, of the full axis on the standard move; inf if it runs away."""
    command = standard_move(axis, period)
    run = AxisRun(axis, period)
    position = run.follow(command)[0]
    return math.inf if run.ran_away is not None else float(np.max(np.abs(command - position)))


def overshoot(step: StepResponse) -> float:
    """Return how far a step response goes beyond the step, as a share of it; infinite if it ran away."""
    return math.inf if step.stopped else max(float(np.max(step.position)) / step.size - 1.0, 0.0)


def rounded_down(value: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is not above `value`."""
    power = 10.0 ** math.floor(math.log10(value) + 1e-12)
    return power * max(digit for digit in (1.0, 2.0, 5.0) if digit * power <= value * (1.0 + 1e-9))
