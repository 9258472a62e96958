"""Block times as a shop's control plans them: speeds at junctions by a backward and a forward pass over all blocks.

Between junctions a block speeds up, cruises and slows down at constant acceleration; where it begins or ends at rest
the change of speed v takes v/a + a/j (or 2 sqrt(v/j)) under jerk, as an S-curve does. At corners the step of the
velocity of each axis is bounded, or the arc that blends the corner within the tolerance is passed at the arc limit; a
row of short lines counts as the arc that it stands for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.machine.control import Control
from splinefeed.machine.machine import Machine
from splinefeed.machine.quantities import KINDS as QUANTITIES
from splinefeed.programs import firmware as rules
from splinefeed.programs import linuxcnc_times
from splinefeed.programs.blocks import Blocks
from splinefeed.programs.bounds import axis_bounds, reached
from splinefeed.programs.gcode.moves import AXES, LETTERS, ROTARY
from splinefeed.records import ROTARY_AXES, Array, BoolArray, IntArray

#: Directions that differ by less are one: a turn of 0.06 degrees, rounding of the words of a program.
SMOOTH = 1e-3
#: Halvings of the interval of a peak speed: to 1e-15 of the speed.
_HALVINGS = 50
#: From rest to rest at constant acceleration half of the time is at the top speed where this share of it is more than
#: the length over that speed: below it the speed binds longest.
CRUISES = 0.25
#: Kinds of time that no limit binds, in the order of the keys of `--json`.
KINDS = ("cutting", "rapid", "tool_change", "spindle", "dwell", "start")
#: What binds, by number: kinds of time, what follows, and with an axis behind them those of the last row.
LIMITS = (
    *(name.replace("_", " ") for name in KINDS),
    *("programmed feed", "arc acceleration", "block time", "acceleration", "rapid acceleration", "path velocity"),
    *(f"{name} {letter}" for name in ("rapid velocity", "axis acceleration") for letter in LETTERS.lower()),
)
FEED, ARC, SHORT, ALONG, RAPIDLY, PATH, OF_AXES = range(len(KINDS), len(KINDS) + 7)


@dataclass(frozen=True, eq=False)
class BlockTimes:
    """How long n blocks take.

    Parameters
    ----------
    seconds : array (n,)
        Of each block.
    end_speed : array (n,)
        At its end, mm/s.
    limit : array (n,)
        What binds, index of LIMITS.
    """

    seconds: Array
    end_speed: Array
    limit: IntArray


@dataclass(frozen=True, eq=False)
class _Bounds:
    """Speed, acceleration and jerk (n,) of each block, mm and s, and the numbers of what sets the first two."""

    speed: Array
    acceleration: Array
    jerk: Array
    arc: Array
    speed_by: IntArray
    acceleration_by: IntArray


def block_times(blocks: Blocks, machine: Machine) -> BlockTimes:
    """Time each block as a control plans it.

    Parameters
    ----------
    blocks : Blocks
        Of a program.
    machine : Machine
        With a control.

    Returns
    -------
    BlockTimes
        Of each block.

    Raises
    ------
    InputError
        Where the machine file has too little.
    """
    control = machine.control
    assert control is not None
    bounds = _bounds(blocks, machine, control)
    if control.model == "linuxcnc":
        seconds, end = _linuxcnc(blocks, machine, control, bounds)
        cruises = seconds - blocks.length / bounds.speed < CRUISES * seconds
        return BlockTimes(seconds, end, np.where(cruises, bounds.speed_by, bounds.acceleration_by))
    firmware = control.model != "general"
    if firmware:
        stop = rules.stops(blocks)
        corners = rules.corner_speeds(blocks, machine, control, bounds.acceleration)
        junction = np.minimum(corners, np.minimum(bounds.speed[:-1], bounds.speed[1:]))
    else:
        stop, junction = _junctions(blocks, control, bounds)
    length, speed, a, j = blocks.length, bounds.speed, bounds.acceleration, bounds.jerk
    energy = np.concatenate([[0.0], np.where(stop[:-1], 0.0, junction) ** 2, [0.0]])
    gain = 2.0 * a * length
    if control.look_ahead:  # it must be able to stop before what it cannot see
        seen = np.concatenate([[0.0], np.cumsum(gain)])
        ahead = np.minimum(np.arange(len(seen)) + control.look_ahead, len(seen) - 1)
        energy = np.minimum(energy, seen[ahead] - seen)
    if control.cruise_ratio:
        soft = (1.0 - control.cruise_ratio) * gain
        smooth = reached(reached(energy, soft)[::-1], soft[::-1])[::-1]
        speed = np.minimum(speed, rules.smoothed_tops(smooth, soft, speed))
        inner = np.minimum(speed[:-1], speed[1:])
        energy[1:-1] = np.minimum(energy[1:-1], inner * inner)
    energy = reached(energy[::-1], gain[::-1])[::-1]
    start = np.zeros(len(blocks))
    if control.model == "marlin":  # a block may begin at once at a speed from which it can still slow down to its end
        from_rest = np.concatenate([[True], stop[:-1]])
        start[from_rest] = np.minimum(rules.start_speeds(blocks, control), speed)[from_rest] ** 2
        start = np.minimum(start, energy[1:] + gain)
    energy = reached(energy, gain + start)
    before, after = energy[:-1] + start, energy[1:]
    begin, end = np.sqrt(before), np.sqrt(after)
    peak = np.sqrt(np.minimum(speed * speed, 0.5 * (gain + before + after)))
    peak = np.maximum(peak, np.maximum(begin, end))
    curved = np.isfinite(j) & ((begin == 0.0) | (end == 0.0))
    peak[curved] = _peaks(*(each[curved] for each in (begin, end, peak, a, j, length)))
    seconds, way = _changes(begin, end, peak, a, j)
    seconds = np.maximum(seconds + (length - way) / peak, length / speed) + np.where(stop, control.stop_time, 0.0)
    limit = np.where(peak < speed * (1.0 - 1e-6), bounds.acceleration_by, bounds.speed_by)
    return BlockTimes(seconds, end, limit)


def _linuxcnc(blocks: Blocks, machine: Machine, control: Control, bounds: _Bounds) -> tuple[Array, Array]:
    """Seconds (n,) of each block, and the speed at its end, as LinuxCNC plans them."""
    waits = rules.stops(blocks)
    stop: BoolArray = np.logical_or(waits, control.mode == "exact stop")
    stop[:-1] |= blocks.rapid[:-1] != blocks.rapid[1:]
    turning = _turning(blocks)  # there is no direction to blend
    stop |= turning
    stop[:-1] |= turning[1:]
    tolerance = np.where(np.isnan(blocks.tolerance), control.tolerance or 0.0, blocks.tolerance)
    of = linuxcnc_times.joined(blocks, tolerance, stop)
    starts = np.flatnonzero(np.diff(of, prepend=-1))
    ends = np.append(starts[1:], len(blocks)) - 1
    length = np.add.reduceat(blocks.length, starts)
    first, last = blocks.first[starts], blocks.last[ends]
    several = ends > starts
    chord = np.add.reduceat(blocks.step, starts, axis=0)
    size = np.linalg.norm(chord[:, :3], axis=1)
    for rows in np.flatnonzero(several).tolist():
        first[rows] = last[rows] = 0.0
        first[rows, :3] = last[rows, :3] = chord[rows, :3] / size[rows]
        length[rows] = size[rows]
    allowed = axis_bounds(control, "acceleration", machine, "acceleration")
    allowed[list(ROTARY)] = np.inf
    box = np.min(np.where(blocks.moved, allowed, np.inf), axis=1)
    box = np.where(np.isfinite(box), box, bounds.acceleration)
    fastest, _ = _along(blocks, machine, control, "rapid", "velocity")
    fastest = np.minimum(fastest, np.inf if control.velocity is None else control.velocity)
    acceleration = linuxcnc_times.along_arcs(bounds.acceleration, blocks.radius, fastest)
    half = linuxcnc_times.ALONG_ARC * bounds.acceleration
    last_arc = waits & (tolerance > 0.0) & np.isfinite(blocks.radius)
    acceleration = np.where(last_arc, np.minimum(acceleration, half), acceleration)
    lines = linuxcnc_times.TimedLines(
        of=of, length=length, speed=np.minimum.reduceat(bounds.speed, starts),
        acceleration=np.minimum.reduceat(acceleration, starts), box=np.minimum.reduceat(box, starts),
        first=first, last=last, tolerance=np.minimum.reduceat(tolerance, starts),
        stop=stop[ends], final=waits[ends],
    )  # fmt: skip
    return linuxcnc_times.seconds_of(blocks, lines)


def _turning(blocks: Blocks) -> BoolArray:
    """Whether rotary axes alone move (n,): lengths are then in degrees."""
    out: BoolArray = np.logical_not(np.any(blocks.first, axis=1))
    return out


def _along(blocks: Blocks, machine: Machine, control: Control, key: str, limit: str) -> tuple[Array, IntArray]:
    """What the bounds of axes allow along each straight block (n,), and which axis binds; arcs turn through all.

    The bound of an axis is that of the control, `key`, else its own `limit`, else there is none.
    """
    bound = axis_bounds(control, key, machine, limit)
    with np.errstate(divide="ignore", invalid="ignore"):
        allowed = np.where(blocks.step != 0.0, bound * blocks.length[:, None] / np.abs(blocks.step), np.inf)
    allowed = np.where(np.isfinite(blocks.radius)[:, None], np.where(blocks.moved, bound, np.inf), allowed)
    by = np.argmin(allowed, axis=1)
    return allowed[np.arange(len(blocks)), by], by


def _bounds(blocks: Blocks, machine: Machine, control: Control) -> _Bounds:
    rapid = blocks.rapid | ~np.isfinite(blocks.feed)
    velocity, velocity_by = _along(blocks, machine, control, "rapid", "velocity")
    if not np.all(np.isfinite(velocity[rapid])):
        axis = LETTERS.lower()[int(np.argmax(np.abs(blocks.step[rapid & ~np.isfinite(velocity)][0])))]
        raise InputError(f"{machine.name}: the velocity of axis {axis} is not known; {_lines(axis)}")
    axis_acceleration, axis_by = _along(blocks, machine, control, "acceleration", "acceleration")
    axis_jerk, _ = _along(blocks, machine, control, "jerk", "jerk")

    def chosen(feed: float | None, fast: float | None) -> Array:
        at_feed = np.inf if feed is None else feed
        return np.where(rapid, at_feed if fast is None else fast, at_feed)

    along = chosen(control.acceleration, control.rapid_acceleration)
    if control.model == "linuxcnc":  # the axes bound it alone, where they say
        along = np.where(np.isfinite(axis_acceleration), np.inf, along)
    acceleration = np.minimum(along, axis_acceleration)
    if not np.all(np.isfinite(acceleration)):
        block = int(np.argmin(np.isfinite(acceleration)))
        axis = LETTERS.lower()[int(np.argmax(blocks.moved[block]))]
        raise InputError(f"{machine.name}: the acceleration of axis {axis} is not known; {_lines(axis)}")
    arc = np.minimum(np.inf if control.arc_acceleration is None else control.arc_acceleration, axis_acceleration)
    shortest = np.where(rapid, 0.0, control.block_time)
    by_axis = OF_AXES + velocity_by
    if control.model == "general":
        arcs = _arc_speed(arc, blocks.radius, control.arc_growth)
    elif control.model == "linuxcnc":
        arcs = _arc_speed(linuxcnc_times.NORMAL * arc, blocks.radius, 0.0)
    else:
        arcs = rules.arc_speeds(blocks, control, acceleration)
    tops: list[tuple[Any, Array]] = [  # what bounds the speed, the first of equal ones binds
        (np.where(rapid, by_axis, FEED), np.where(rapid, velocity, blocks.feed)),
        (ARC, arcs),
        (SHORT, np.where(shortest > 0.0, blocks.length / np.maximum(shortest, 1e-300), np.inf)),
        (by_axis, velocity),
        (PATH, np.where(_turning(blocks) | (control.velocity is None), np.inf, control.velocity or np.inf)),
    ]
    speeds = np.array([top for _, top in tops])
    by = np.choose(np.argmin(speeds, axis=0), [number for number, _ in tops])
    own = np.where(axis_acceleration < along, OF_AXES + AXES + axis_by, np.where(rapid, RAPIDLY, ALONG))
    return _Bounds(
        np.min(speeds, axis=0),
        acceleration,
        np.minimum(chosen(control.jerk, control.rapid_jerk), axis_jerk),
        arc,
        by,
        own,
    )


def _lines(axis: str) -> str:
    """The lines of a machine file that say what an axis can do."""
    kinds = (QUANTITIES[each][axis in ROTARY_AXES].example for each in ("velocity", "acceleration"))
    return 'add the lines [axis.{}.limits], velocity = "{}", acceleration = "{}"'.format(axis, *kinds)


def _arc_speed(acceleration: Array, radius: Array, growth: float) -> Array:
    """Speed on a radius, mm/s: v^2 = a R^(1 + growth), R in mm; inf where there is no limit."""
    with np.errstate(over="ignore", invalid="ignore"):
        speed = np.sqrt(acceleration * radius ** (1.0 + growth))
    return np.where(np.isfinite(radius) & np.isfinite(acceleration), speed, np.inf)


def _junctions(blocks: Blocks, control: Control, bounds: _Bounds) -> tuple[BoolArray, Array]:
    """Whether the tool stops at the end of each block (n,), and the speed between each two (n - 1,), mm/s."""
    stop = blocks.stops | (control.mode == "exact stop")
    stop[:-1] |= blocks.rapid[:-1] | blocks.rapid[1:]
    stop[-1] = True
    at = np.array([mark.move for mark in blocks.marks if mark.stop], dtype=np.int64)
    stop[at[(at > 0) & (at < len(blocks))] - 1] = True
    step = blocks.first[1:] - blocks.last[:-1]
    kink = control.arc_kink * (blocks.kink[:-1] + blocks.kink[1:])
    turn = np.linalg.norm(step, axis=1) + kink
    arc, acceleration = (np.minimum(each[:-1], each[1:]) for each in (bounds.arc, bounds.acceleration))
    speed = np.minimum(bounds.speed[:-1], bounds.speed[1:])
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = (control.velocity_step or 0.0) / (np.max(np.abs(step), axis=1) + kink)
        tolerance = np.where(np.isnan(blocks.tolerance[:-1]), control.tolerance or 0.0, blocks.tolerance[:-1])
        half = np.cos(np.arcsin(np.minimum(0.5 * turn, 1.0)))  # of half the angle by which the path turns
        blend = np.where(tolerance > 0.0, tolerance * half / (1.0 - half), 0.0)
        room = 0.5 * np.minimum(blocks.length[:-1], blocks.length[1:])
        blend = np.minimum(blend, room * half / np.sqrt(1.0 - half * half))
        around = np.where(np.isfinite(arc), arc, acceleration)
        bound = np.maximum(bound, _arc_speed(around, blend, control.arc_growth))
        row = 0.5 * (blocks.length[:-1] + blocks.length[1:]) / turn
        bound = np.minimum(bound, _arc_speed(arc, row, control.arc_growth))
    return stop, np.where(turn > SMOOTH, np.minimum(speed, bound), speed)


def _changes(begin: Array, end: Array, peak: Array, a: Array, j: Array) -> tuple[Array, Array]:
    """Seconds and way of speeding up to a peak and slowing down: at rest under jerk, else at constant acceleration."""
    seconds, way = np.zeros(len(peak)), np.zeros(len(peak))
    for low in (begin, end):
        step = peak - low
        ramp = step / a
        with np.errstate(divide="ignore", invalid="ignore"):
            curve = np.where(step * j >= a * a, ramp + a / j, 2.0 * np.sqrt(step / j))
        change = np.where((low == 0.0) & np.isfinite(j) & (step > 0.0), curve, ramp)
        seconds, way = seconds + change, way + 0.5 * (low + peak) * change
    return seconds, way


def _peaks(begin: Array, end: Array, high: Array, a: Array, j: Array, length: Array) -> Array:
    """The greatest peak speed, at most `high`, for which both changes of speed fit into the length."""
    found = high.copy()
    short = np.flatnonzero(_changes(begin, end, high, a, j)[1] > length)
    begin, end, a, j, length, top = (each[short] for each in (begin, end, a, j, length, high))
    low = np.maximum(begin, end)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + top)
        fits = _changes(begin, end, middle, a, j)[1] <= length
        low, top = np.where(fits, middle, low), np.where(fits, top, middle)
    found[short] = low
    return found
