"""What a figure of a tuned axis shows: its loop over frequency, and its response to a small step."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.machine.parts import ServoAxis
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
SHORTEST, LONGEST = 0.02, 1.0


@dataclass(frozen=True, eq=False)
class LoopCurves:
    """frequency (n,) Hz; complex (n,): the loop L opened at the controller's output, T from reference to position."""

    frequency: Array
    loop: ComplexArray
    closed: ComplexArray


@dataclass(frozen=True, eq=False)
class StepResponse:
    """What a step of `size`, mm or rad, does: t (n,) s from the step on, position (n,), and whether it ran away."""

    t: Array
    position: Array
    size: float
    stopped: bool


def loop_curves(axis: ServoAxis, period: float) -> LoopCurves:
    """L and T of an axis at a servo period, s, up to half the servo rate."""
    nyquist = 0.5 / period
    frequency = np.geomspace(LOWEST_SHARE * nyquist, HIGHEST_SHARE * nyquist, POINTS)
    omega = 2.0 * np.pi * frequency
    found = loop_responses(axis.controller, period, omega, discrete_plant(axis, period).response(omega))
    return LoopCurves(frequency, *found)


def step_responses(old: ServoAxis, new: ServoAxis, period: float) -> tuple[StepResponse, StepResponse]:
    """The full axis, friction, counts and codes included, after the same small step with its old and new controller.

    Small enough that the linear loop stays within half the output: of 1, 2 or 5 times a power of ten, mm or deg.
    """
    loops = (margins(old, period), margins(new, period))
    bandwidth = min((each.bandwidth for each in loops if each.stable), default=1.0 / SHORTEST)
    ticks = BEFORE + math.ceil(min(max(SWINGS / bandwidth, SHORTEST), LONGEST) / period)
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


def rest_swing(axis: ServoAxis, period: float) -> float:
    """The amplitude, peak to peak, mm or rad, at which the full axis hunts after a small step.

    Integral action against static friction, or too little phase margin, can make it hunt; a good loop
    comes to rest within a count or two. Infinite if the axis runs away.
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
    """Whether hunting at rest is more than counts alone make."""
    return swing > HUNTING * seen_resolution(axis)


def _stepped(
    axis: ServoAxis, period: float, ticks: int, size: float, linear: bool = False
) -> tuple[Array, Array, bool]:
    """Position and output (n,) of an axis after a step, and whether it ran away, which a linear one may."""
    run = AxisRun(axis, period, linear=linear, error_limit=math.inf if linear else None)
    position, _, output, _ = run.follow(np.where(np.arange(ticks) < BEFORE, 0.0, size))
    return position, output, run.ran_away is not None


def rounded_down(value: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above `value`."""
    power = 10.0 ** math.floor(math.log10(value) + 1e-12)
    return power * max(digit for digit in (1.0, 2.0, 5.0) if digit * power <= value * (1.0 + 1e-9))
