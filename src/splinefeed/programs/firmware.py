"""Corners and arcs as open firmware passes them: grbl, Klipper and Marlin, from their published rules.

Junction deviation d [1]_ [2]_: a corner is passed at the speed of the circle that touches both lines and comes within d
of it, v^2 = a d s / (1 - s), s the sine of half the angle between the lines. Klipper [3]_ gives d by the corner
velocity c of a right angle, d = c^2 (sqrt 2 - 1) / a, bounds v^2 by the circle that touches both lines within half of
their lengths, a L / 2 tan(angle / 2), and lowers the top of moves that speed up and slow down at once: the look-ahead
is made with (1 - minimum_cruise_ratio) a first, and its tops bound the moves between. Marlin's older rule, jerk [4]_,
bounds the step of the velocity of each axis, at corners and from rest; stops are planned to rest, or nearly so.

References
----------
.. [1] S. K. Jeon, "Improving Grbl: cornering algorithm", 2011.
.. [2] The documentation of grbl and of Marlin.
.. [3] Klipper's documentation, "Kinematics" and "Config reference".
.. [4] Marlin's documentation, M205 and "Configuration": jerk, minimum planner speed.
"""

from __future__ import annotations

import math

import numpy as np

from splinefeed.machine.control import Control
from splinefeed.machine.machine import Machine
from splinefeed.programs.blocks import Blocks
from splinefeed.programs.bounds import axis_bounds
from splinefeed.records import Array, BoolArray

#: Directions that differ by less are one, rad.
SMOOTH = 1e-6
#: Linear axes: those of directions.
_LINEAR = (0, 1, 2, 6, 7, 8)


def deviation(control: Control) -> float | None:
    """The junction deviation of a control, mm, by its corner velocity where it has that; None where it has neither."""
    if control.corner_velocity is not None and control.acceleration:
        return control.corner_velocity**2 * (math.sqrt(2.0) - 1.0) / control.acceleration
    return control.junction_deviation


def corner_speeds(blocks: Blocks, machine: Machine, control: Control, acceleration: Array) -> Array:
    """Compute the speed at which each corner may be passed.

    Parameters
    ----------
    blocks : Blocks
        n of them.
    machine, control : Machine, Control
        Whose rule, and whose limits of axes.
    acceleration : array (n,)
        Along each block, mm/s^2.

    Returns
    -------
    array (n - 1,)
        mm/s; inf where the direction stays, 0 where nothing says how corners are passed.

    Notes
    -----
    v^2 = a d s / (1 - s), or by the steps of the velocities of axes; see the head of the module.
    """
    step = blocks.first[1:] - blocks.last[:-1]
    turn = np.minimum(np.linalg.norm(step, axis=1), 2.0)
    half = np.sqrt(np.maximum(1.0 - 0.25 * turn * turn, 0.0))  # the sine of half the angle between the lines
    along = np.minimum(acceleration[:-1], acceleration[1:])
    bounds = [np.where(turn > SMOOTH, 0.0, np.inf)]
    with np.errstate(divide="ignore", invalid="ignore"):
        if (deviates := deviation(control)) is not None:
            around = along if control.model == "klipper" else _across(step, machine, control)
            around = np.where(np.isfinite(around), around, along)
            bounds = [around * deviates * half / (1.0 - half)]
            if control.model == "klipper":
                tangent = half / (0.5 * turn)
                bounds += [0.5 * a * length * tangent for a, length in (
                    (acceleration[:-1], blocks.length[:-1]), (acceleration[1:], blocks.length[1:]))]  # fmt: skip
        elif control.velocity_step is not None or any(each.velocity_step for each in control.axes.values()):
            bounds = [np.min(_steps(control) / np.abs(step), axis=1) ** 2]
        speed = np.sqrt(np.min(bounds, axis=0))
    return np.where(turn > SMOOTH, speed, np.inf)


def start_speeds(blocks: Blocks, control: Control) -> Array:
    """Compute the speed at which each block may begin from rest.

    Parameters
    ----------
    blocks : Blocks
        n of them.
    control : Control
        With Marlin's jerk, or without.

    Returns
    -------
    array (n,)
        mm/s: a step of each axis by its jerk, or 0.
    """
    if deviation(control) is not None:
        return np.zeros(len(blocks))
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = np.min(_steps(control) / np.abs(blocks.first), axis=1)
    return np.where(np.isfinite(speed), speed, 0.0)


def arc_speeds(blocks: Blocks, control: Control, acceleration: Array) -> Array:
    """Compute the mean speed on arcs, which are cut as chords.

    Parameters
    ----------
    blocks : Blocks
        n of them.
    control : Control
        That says how long chords are.
    acceleration : array (n,)
        Along each block, mm/s^2.

    Returns
    -------
    array (n,)
        mm/s; inf on lines, and where nothing says how.

    Notes
    -----
    Each corner between chords is passed at its speed, which rises and falls between two of them; a look-ahead of N
    blocks must be able to stop within N chords, v^2 <= 2 N a chord.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        sweep, radius = blocks.length / blocks.radius, blocks.radius
        if control.arc_tolerance:
            bow = np.minimum(control.arc_tolerance, radius)
            count = np.floor(0.5 * sweep * radius / np.sqrt(bow * (2.0 * radius - bow)))
        elif control.arc_segment:
            count = np.floor(blocks.length / control.arc_segment)
        else:
            return np.full(len(blocks), np.inf)
        half = 0.5 * sweep / np.maximum(count, 1.0)  # of the turn at each corner between chords
        bounds = []
        if (deviates := deviation(control)) is not None:
            bounds.append(acceleration * deviates * np.cos(half) / (1.0 - np.cos(half)))
        elif control.velocity_step is not None:
            bounds.append((control.velocity_step / (2.0 * np.sin(half))) ** 2)
        if control.model == "klipper":
            bounds.append(acceleration * radius * np.cos(half))  # a / 2 of the chord, over the tangent of half the turn
        chord = 2.0 * radius * np.sin(half)
        if control.look_ahead:
            bounds.append(2.0 * control.look_ahead * acceleration * chord)
        if not bounds:
            return np.full(len(blocks), np.inf)
        corner = np.sqrt(np.min(bounds, axis=0))
        top = np.minimum(np.sqrt(corner * corner + acceleration * chord), blocks.feed)
        seconds = 2.0 * (top - corner) / acceleration + (chord - (top * top - corner * corner) / acceleration) / top
        speed = np.where(corner < blocks.feed, chord / seconds, np.inf)
    return np.where(np.isfinite(radius) & (count > 1.0), speed, np.inf)


def smoothed_tops(energy: Array, gain: Array, speed: Array) -> Array:
    """Bound the speed of blocks by Klipper's smoothed look-ahead.

    Parameters
    ----------
    energy : array (n + 1,)
        Squares of the speeds at junctions, reachable with the smoothed acceleration.
    gain : array (n,)
        2 a L of that acceleration.
    speed : array (n,)
        Of each block, mm/s.

    Returns
    -------
    array (n,)
        The top speed of each block, mm/s. Between two places where the smoothed look-ahead slows down to, its highest
        top bounds every block.
    """
    top = np.minimum(speed * speed, 0.5 * (gain + energy[:-1] + energy[1:]))
    ends = [0, *(np.flatnonzero((energy[1:-1] <= energy[:-2]) & (energy[1:-1] <= energy[2:])) + 1).tolist(), len(top)]
    highest = np.maximum.reduceat(top, ends[:-1])
    hill = np.repeat(highest, np.diff(ends))
    # an end between two hills belongs to both
    out: Array = np.sqrt(np.maximum(hill, np.maximum(energy[:-1], energy[1:])))
    return out


def stops(blocks: Blocks) -> BoolArray:
    """Whether the tool stops at the end of each block (n,): at events that wait, and at the end alone."""
    stop = blocks.stops.copy()
    stop[-1] = True
    at = np.array([mark.move for mark in blocks.marks if mark.stop], dtype=np.int64)
    stop[at[(at > 0) & (at < len(blocks))] - 1] = True
    return stop


def _steps(control: Control) -> Array:
    """The steps of velocity (6,), mm/s, of the linear axes under Marlin's jerk."""
    own = axis_bounds(control, "velocity_step")
    others = math.inf if control.velocity_step is None else control.velocity_step
    steps: Array = np.where(np.isfinite(own), own, others)[list(_LINEAR)]
    return steps


def _across(step: Array, machine: Machine, control: Control) -> Array:
    """The acceleration (n - 1,) that the axes allow along each change of direction."""
    allowed = axis_bounds(control, "acceleration", machine, "acceleration")[list(_LINEAR)]
    size = np.linalg.norm(step, axis=1)[:, None]
    out: Array = np.min(allowed * size / np.abs(step), axis=1)
    return np.minimum(out, math.inf if control.acceleration is None else control.acceleration)
