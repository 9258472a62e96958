"""Block times as a shop's control plans them: speeds at junctions by a backward and a forward pass over all blocks.

Between junctions a block speeds up, cruises and slows down at constant acceleration; where it begins or ends at rest
the change of speed v takes v/a + a/j (or 2 sqrt(v/j)) under jerk, as an S-curve does. At corners the step of the
velocity of each axis is bounded, or the arc that blends the corner within the tolerance is passed at the arc limit; a
row of short lines counts as the arc that it stands for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.formats.gcode.moves import AXES
from splinefeed.machine.control import AxisControl
from splinefeed.machine.machine import Machine
from splinefeed.pipeline.blocks import Blocks, letter
from splinefeed.records import Array, BoolArray, IntArray

#: Directions that differ by less are one: a turn of 0.06 degrees, rounding of the words of a program.
SMOOTH = 1e-3
#: Halvings of the interval of a peak speed: to 1e-12 of the speed.
_HALVINGS = 40


@dataclass(frozen=True, eq=False)
class BlockTimes:
    """Seconds (n,) of each block, its speed at the end, mm/s, and the number (n,) of what binds among `limits`."""

    seconds: Array
    end_speed: Array
    limit: IntArray
    limits: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Bounds:
    """Speed, acceleration and jerk (n,) of each block, mm and s, and the numbers of what sets the first two."""

    speed: Array
    acceleration: Array
    jerk: Array
    arc: Array
    speed_by: IntArray
    acceleration_by: IntArray


#: What binds, by number; with an axis behind them those of AXIS_NAMES.
NAMES = ("programmed feed", "arc acceleration", "block time", "acceleration", "rapid acceleration")
AXIS_NAMES = ("rapid velocity", "axis acceleration")
LIMITS = (*NAMES, *(f"{name} {letter(axis)}" for name in AXIS_NAMES for axis in range(AXES)))


def block_times(blocks: Blocks, machine: Machine) -> BlockTimes:
    """Time each block under `machine.control`; InputError where the machine file has too little."""
    control = machine.control
    assert control is not None
    bounds = _bounds(blocks, machine)
    stop, junction = _junctions(blocks, machine, bounds)
    length, speed, a, j = blocks.length, bounds.speed, bounds.acceleration, bounds.jerk
    energy = np.concatenate([[0.0], np.where(stop[:-1], 0.0, junction) ** 2, [0.0]])
    gain = 2.0 * a * length
    if control.look_ahead:  # it must be able to stop before what it cannot see
        seen = np.concatenate([[0.0], np.cumsum(gain)])
        ahead = np.minimum(np.arange(len(seen)) + control.look_ahead, len(seen) - 1)
        energy = np.minimum(energy, seen[ahead] - seen)
    energy = _passes(energy.tolist(), gain.tolist())
    begin, end = np.sqrt(energy[:-1]), np.sqrt(energy[1:])
    peak = np.sqrt(np.minimum(speed * speed, 0.5 * (gain + energy[:-1] + energy[1:])))
    peak = np.maximum(peak, np.maximum(begin, end))
    curved = np.isfinite(j) & ((begin == 0.0) | (end == 0.0))
    if curved.any():
        peak[curved] = _peaks(*(each[curved] for each in (begin, end, peak, a, j, length)))
    up, down = _change(begin, peak, a, j), _change(end, peak, a, j)
    rest = length - 0.5 * (begin + peak) * up - 0.5 * (end + peak) * down
    seconds = np.maximum(up + down + rest / peak, length / speed)
    seconds += np.where(stop, control.stop_time, 0.0)
    limit = np.where(peak < speed * (1.0 - 1e-6), bounds.acceleration_by, bounds.speed_by)
    return BlockTimes(seconds, end, limit, LIMITS)


def _axis_values(machine: Machine, take: Callable[[AxisControl], float | None], limit: str) -> Array:
    """A value (9,) of each axis: of the control, else the limit of the axis, else inf."""
    assert machine.control is not None
    found = np.full(AXES, np.inf)
    for axis in range(AXES):
        name = letter(axis)
        said = machine.control.axes.get(name)
        value = None if said is None else take(said)
        if value is None and name in machine.axes:
            value = getattr(machine.axes[name].limits, limit)
        found[axis] = np.inf if value is None else value
    return found


def _along(blocks: Blocks, bound: Array) -> tuple[Array, IntArray]:
    """What bounds (9,) of axes allow along each straight block (n,), and which axis binds; arcs turn through all."""
    with np.errstate(divide="ignore", invalid="ignore"):
        allowed = np.where(blocks.step != 0.0, bound * blocks.length[:, None] / np.abs(blocks.step), np.inf)
    turning = np.isfinite(blocks.radius)
    allowed[turning] = np.where(blocks.moved[turning], bound, np.inf)
    by = np.argmin(allowed, axis=1)
    return allowed[np.arange(len(blocks)), by], by


def _bounds(blocks: Blocks, machine: Machine) -> _Bounds:
    control = machine.control
    assert control is not None
    rapid = blocks.rapid | ~np.isfinite(blocks.feed)
    velocity, velocity_by = _along(blocks, _axis_values(machine, lambda axis: axis.rapid, "velocity"))
    if not np.all(np.isfinite(velocity[rapid])):
        axis = letter(int(np.argmax(np.abs(blocks.step[rapid & ~np.isfinite(velocity)][0]))))
        raise InputError(f"{machine.name}: control.axis.{axis}.rapid: missing; give the rapid velocity of {axis}")
    axis_acceleration, axis_by = _along(blocks, _axis_values(machine, lambda axis: axis.acceleration, "acceleration"))
    axis_jerk, _ = _along(blocks, _axis_values(machine, lambda axis: axis.jerk, "jerk"))

    def chosen(feed: float | None, fast: float | None) -> Array:
        at_feed = np.inf if feed is None else feed
        return np.where(rapid, at_feed if fast is None else fast, at_feed)

    along = chosen(control.acceleration, control.rapid_acceleration)
    acceleration = np.minimum(along, axis_acceleration)
    if not np.all(np.isfinite(acceleration)):
        raise InputError(f"{machine.name}: control.acceleration: missing; give the acceleration along the path")
    arc = np.minimum(np.inf if control.arc_acceleration is None else control.arc_acceleration, axis_acceleration)
    speed, by = np.where(rapid, velocity, blocks.feed), np.where(rapid, len(NAMES) + velocity_by, 0)
    lowered: list[tuple[Any, Array]] = [(1, _arc_speed(arc, blocks.radius, control.arc_growth))]
    if control.block_time:
        lowered.append((2, np.where(rapid, np.inf, blocks.length / control.block_time)))
    lowered.append((len(NAMES) + velocity_by, velocity))
    for number, top in lowered:
        by = np.where(top < speed, number, by)
        speed = np.minimum(speed, top)
    own = np.where(axis_acceleration < along, len(NAMES) + AXES + axis_by, np.where(rapid, 4, 3))
    return _Bounds(speed, acceleration, np.minimum(chosen(control.jerk, control.rapid_jerk), axis_jerk), arc, by, own)


def _arc_speed(acceleration: Array, radius: Array, growth: float) -> Array:
    """Speed on a radius, mm/s: v^2 = a R^(1 + growth), R in mm; inf where there is no limit."""
    with np.errstate(over="ignore", invalid="ignore"):
        speed = np.sqrt(acceleration * radius ** (1.0 + growth))
    return np.where(np.isfinite(radius) & np.isfinite(acceleration), speed, np.inf)


def _junctions(blocks: Blocks, machine: Machine, bounds: _Bounds) -> tuple[BoolArray, Array]:
    """Whether the tool stops at the end of each block (n,), and the speed between each two (n - 1,), mm/s."""
    control = machine.control
    assert control is not None
    stop = blocks.stops.copy()
    stop[:-1] |= blocks.rapid[:-1] | blocks.rapid[1:]
    stop[-1] = True
    at = np.array([mark.move for mark in blocks.marks if mark.stop], dtype=np.int64)
    stop[at[(at > 0) & (at < len(blocks))] - 1] = True
    if control.mode == "exact stop":
        stop[:] = True
    step = blocks.first[1:] - blocks.last[:-1]
    kink = control.arc_kink * (blocks.kink[:-1] + blocks.kink[1:])
    turn = np.linalg.norm(step, axis=1) + kink
    speed = np.minimum(bounds.speed[:-1], bounds.speed[1:])
    bends = turn > SMOOTH
    bound = np.zeros(len(turn))
    arc = np.minimum(bounds.arc[:-1], bounds.arc[1:])
    with np.errstate(divide="ignore", invalid="ignore"):
        if control.velocity_step is not None:
            bound = control.velocity_step / (np.max(np.abs(step), axis=1) + kink)
        tolerance = np.where(np.isnan(blocks.tolerance[:-1]), control.tolerance or 0.0, blocks.tolerance[:-1])
        half = np.cos(np.arcsin(np.minimum(0.5 * turn, 1.0)))  # of half the angle by which the path turns
        blend = np.where(tolerance > 0.0, tolerance * half / (1.0 - half), 0.0)
        room = 0.5 * np.minimum(blocks.length[:-1], blocks.length[1:])
        blend = np.minimum(blend, room * half / np.sqrt(1.0 - half * half))
        around = np.where(np.isfinite(arc), arc, np.minimum(bounds.acceleration[:-1], bounds.acceleration[1:]))
        bound = np.maximum(bound, _arc_speed(around, blend, control.arc_growth))
        row = 0.5 * (blocks.length[:-1] + blocks.length[1:]) / turn
        bound = np.minimum(bound, _arc_speed(arc, row, control.arc_growth))
    return stop, np.where(bends, np.minimum(speed, bound), speed)


def _passes(energy: list[float], gain: list[float]) -> Array:
    """Squares of speeds at the ends of blocks (n + 1,), lowered to what 2 a L lets them change by."""
    here = energy[0]
    for k, more in enumerate(gain):
        here += more
        if here < energy[k + 1]:
            energy[k + 1] = here
        else:
            here = energy[k + 1]
    here = energy[-1]
    for k in range(len(gain) - 1, -1, -1):
        here += gain[k]
        if here < energy[k]:
            energy[k] = here
        else:
            here = energy[k]
    return np.array(energy)


def _change(low: Array, high: Array, a: Array, j: Array) -> Array:
    """Seconds from one speed to a higher one; from rest under jerk, else at constant acceleration."""
    step = high - low
    with np.errstate(divide="ignore", invalid="ignore"):
        ramp = step / a
        curve = np.where(step * j >= a * a, ramp + a / j, 2.0 * np.sqrt(step / j))
    return np.where((low == 0.0) & np.isfinite(j) & (step > 0.0), curve, ramp)


def _peaks(begin: Array, end: Array, high: Array, a: Array, j: Array, length: Array) -> Array:
    """The greatest peak speed, at most `high`, for which both changes of speed fit into the length."""

    def needs(peak: Array) -> Array:
        up, down = _change(begin, peak, a, j), _change(end, peak, a, j)
        total: Array = 0.5 * (begin + peak) * up + 0.5 * (end + peak) * down
        return total

    short = needs(high) > length
    still = short & (begin == 0.0) & (end == 0.0)  # L = v (v/a + a/j), or 2 v sqrt(v/j): in closed form
    knee = a * a / j
    peak = 0.5 * (np.sqrt(knee * knee + 4.0 * a * length) - knee)
    peak = np.where(peak >= knee, peak, np.cbrt(0.25 * length * length * j))
    found = np.where(still, np.minimum(peak, high), high)
    rest = np.flatnonzero(short & ~still)
    if not len(rest):
        return found
    begin, end, a, j, length = (each[rest] for each in (begin, end, a, j, length))
    low, top = np.maximum(begin, end), high[rest]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + top)
        fits = needs(middle) <= length
        low, top = np.where(fits, middle, low), np.where(fits, top, middle)
    found[rest] = low
    return found
