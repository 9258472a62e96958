"""Block times as LinuxCNC 2.9 plans them: trapezoids along lines and arcs, and corners blended by arcs of G64 P.

What its documentation says (G64 P: corners within a tolerance; its naive CAM detector joins lines within Q, which is P
where it is not given; G61: the path exactly; [AXIS_L]MAX_ACCELERATION bounds each axis) and what a live LinuxCNC 2.9
was measured to do: the acceleration along lines is what the axes allow; on arcs the normal acceleration is at most
sqrt(3)/2 of the axes' least, and along them what is left of that beside v^2/R of the machine's greatest speed; a corner
is cut by the arc that keeps the tolerance, a quarter of the shorter line, and half of both lines, at constant speed and
at most the feed of the faster line; between rapid moves and feed it stops; under G64 the last line has half of the
acceleration; under G61 a corner is a stop, and lines beside it keep to 0.9 of theirs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.programs.blocks import Blocks
from splinefeed.programs.bounds import reached
from splinefeed.records import Array, BoolArray, IntArray

#: Shares of the axes' acceleration: normal on arcs, along the arcs of corners and a last arc, along lines beside a
#: corner that is a stop under G61, and of what it would be along the last line under G64.
NORMAL, ALONG_ARC, BESIDE_A_STOP, LAST = 3.0**0.5 / 2.0, 0.5, 0.9, 0.5
#: Most lines that are joined to one: so that the time of a long program grows with its length alone.
MOST_JOINED = 100
#: Corners that turn by less are none, rad; share of a line's length that a corner may be cut by.
SMOOTH, CUT = 1e-3, 0.25


@dataclass(frozen=True, eq=False)
class TimedLines:
    """The m lines and arcs that the planner has; lines that the naive CAM detector has joined are one.

    Parameters
    ----------
    of : array (n,)
        Which of them each block of the program belongs to.
    length : array (m,)
        mm.
    speed, acceleration : array (m,)
        Along it, mm/s and mm/s^2.
    box : array (m,)
        The axes' least acceleration, mm/s^2.
    first, last : array (m, 6)
        Directions at both ends.
    tolerance : array (m,)
        mm.
    stop, final : array (m,)
        Whether it stops at its end, and whether that stop ends a row of blended lines.
    """

    of: IntArray
    length: Array
    speed: Array
    acceleration: Array
    box: Array
    first: Array
    last: Array
    tolerance: Array
    stop: BoolArray
    final: BoolArray


def seconds_of(blocks: Blocks, lines: TimedLines) -> tuple[Array, Array]:
    """Time each block of a program.

    Parameters
    ----------
    blocks : Blocks
        n of them.
    lines : TimedLines
        The lines and arcs that they are of.

    Returns
    -------
    seconds : array (n,)
        Of each block. The time of a corner's arc is that of the line behind it, as LinuxCNC counts; joined lines share
        theirs by length.
    end_speed : array (n,)
        At its end, mm/s.
    """
    count = len(lines.length)
    turn = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(lines.first[1:] - lines.last[:-1], axis=1), 1.0))
    stop = lines.stop[:-1]
    sharp = (turn > SMOOTH) & ~stop
    exact = sharp & (np.minimum(lines.tolerance[:-1], lines.tolerance[1:]) <= 0.0)
    half, tangent = np.cos(0.5 * turn), np.tan(0.5 * turn)
    box = np.minimum(lines.box[:-1], lines.box[1:])
    slower, faster = (pick(lines.speed[:-1], lines.speed[1:]) for pick in (np.minimum, np.maximum))
    shorter = np.minimum(lines.length[:-1], lines.length[1:])
    allowed = np.minimum(np.minimum(lines.tolerance[:-1], lines.tolerance[1:]), CUT * shorter)
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = np.minimum(allowed * half / (1.0 - half), 0.5 * shorter / tangent)
        radius = np.where(sharp & ~exact, np.minimum(radius, faster * faster / (NORMAL * box)), 0.0)
    around = np.minimum(faster, np.sqrt(NORMAL * box * radius))
    through = np.where(radius > 0.0, around, np.where(sharp, 0.0, slower))
    through = np.where(stop | exact, 0.0, through)
    cut = radius * tangent
    acceleration = lines.acceleration
    beside = np.zeros(count, dtype=bool)
    beside[:-1] |= exact
    beside[1:] |= exact
    acceleration = np.where(beside, BESIDE_A_STOP, 1.0) * acceleration
    acceleration = np.where(lines.final & (lines.tolerance > 0.0), LAST, 1.0) * acceleration
    # cores of lines and arcs of corners in turn
    length, top, a = np.zeros(2 * count - 1), np.full(2 * count - 1, np.inf), np.ones(2 * count - 1)
    length[0::2] = np.maximum(lines.length - np.append(0.0, cut) - np.append(cut, 0.0), 0.0)
    length[1::2], top[0::2], top[1::2] = radius * turn, lines.speed, np.maximum(through, 1e-300)
    a[0::2], a[1::2] = acceleration, ALONG_ARC * box
    energy = np.zeros(2 * count)
    energy[1:-1] = np.repeat(through, 2) ** 2
    gain = 2.0 * a * length
    energy = reached(reached(energy, gain)[::-1], gain[::-1])[::-1]
    low, high = np.sqrt(energy[:-1]), np.sqrt(energy[1:])
    peak = np.sqrt(np.minimum(top * top, 0.5 * (gain + energy[:-1] + energy[1:])))
    peak = np.where(length > 0.0, peak, 1.0)
    # a corner is passed at the feed of the faster line: the slower one may begin, and end, above its own
    way = (np.abs(peak**2 - low**2) + np.abs(peak**2 - high**2)) / (2.0 * a)
    changing = (np.abs(peak - low) + np.abs(peak - high)) / a
    time = np.where(length > 0.0, changing + np.maximum(length - way, 0.0) / peak, 0.0)
    whole = time[0::2].copy()
    whole[1:] += time[1::2]
    share = blocks.length / np.bincount(lines.of, blocks.length, count)[lines.of]
    ends = np.append(high[0::2], 0.0)[lines.of]
    return whole[lines.of] * share, ends


def along_arcs(acceleration: Array, radius: Array, fastest: Array) -> Array:
    """Compute what is left along arcs beside the normal acceleration at the machine's greatest speed.

    Parameters
    ----------
    acceleration : array (n,)
        That the axes allow, mm/s^2.
    radius : array (n,)
        mm, inf on lines.
    fastest : array (n,)
        The machine's greatest speed there, mm/s.

    Returns
    -------
    array (n,)
        a sqrt(1 - n^2), n = v^2 / (R a), at most NORMAL, mm/s^2; along lines all of it.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.minimum(fastest * fastest / (radius * acceleration), NORMAL)
    return np.where(np.isfinite(radius), acceleration * np.sqrt(1.0 - np.nan_to_num(share) ** 2), acceleration)


def joined(blocks: Blocks, tolerance: Array, stop: BoolArray) -> IntArray:
    """Join lines that lie within a tolerance of one another's chord.

    Parameters
    ----------
    blocks : Blocks
        n of them.
    tolerance : array (n,)
        mm.
    stop : array (n,)
        Whether the tool stops at the end of each.

    Returns
    -------
    array (n,)
        Which line each block belongs to.

    Notes
    -----
    As far as all places between the ends lie within the tolerance of the chord: the naive CAM detector of G64 P.
    """
    lines = np.isinf(blocks.radius) & ~blocks.rapid & np.isfinite(tolerance) & (tolerance > 0.0)
    points = np.concatenate([np.zeros((1, 3)), np.cumsum(blocks.step[:, :3], axis=0)])
    out, number, begin = np.zeros(len(blocks), dtype=np.int64), 0, 0
    for k in range(1, len(blocks)):
        goes_on = lines[k] and lines[k - 1] and not stop[k - 1] and blocks.feed[k] == blocks.feed[k - 1]
        goes_on = goes_on and k - begin < MOST_JOINED
        if not goes_on or not _within(points[begin : k + 2], float(tolerance[k])):
            number, begin = number + 1, k
        out[k] = number
    return out


def _within(points: Array, tolerance: float) -> bool:
    """Whether all points between the ends lie within a distance of their chord, and in order along it."""
    chord = points[-1] - points[0]
    size = float(np.linalg.norm(chord))
    if size <= 0.0:
        return False
    along = (points - points[0]) @ chord / size
    off = np.linalg.norm(points - points[0] - along[:, None] * chord / size, axis=1)
    return bool(np.all(off <= tolerance) and np.all(np.diff(along) > 0.0))
