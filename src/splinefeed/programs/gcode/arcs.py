"""Arcs: their circles, whether they end on them, and the curves that they are.

An arc in its plane is a rational B-spline of degree 2 and exact. Along a helix z is linear in the angle, which no
rational curve is: x and y stay exact, and z (and axes that turn with it) is within HELIX_ERROR of linear.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.programs.gcode.faults import LineError
from splinefeed.programs.gcode.moves import PLANES, Findings, Flag, MoveKind, Moves
from splinefeed.records import Array, BoolArray, IntArray

#: An arc misses its circle where the radii at its ends differ by more than ALWAYS, mm, or by more than ROUNDED, mm, and
#: RELATIVE of the radius; in programs in inches by more than these: what LinuxCNC 2.9 accepts, measured on its
#: interpreter. Its documentation ("G2, G3 Arc Move") has 0.5 and 0.005 mm, 0.05 and 0.0005 in.
ALWAYS, ROUNDED, RELATIVE = 2.8284, 0.028284, 1e-3
ALWAYS_INCH, ROUNDED_INCH = 0.28284 * 25.4, 0.0028284 * 25.4
#: A radius may be less than half the chord by this, mm: rounding of the words.
SHORT_RADIUS = 0.00127
#: Ends this near each other, mm, make a full circle.
SAME_POINT = 1e-9
#: No sweep is less than this, rad, so that it may be divided by; an arc below the second is its chord.
LEAST_SWEEP, CHORD_SWEEP = 1e-12, 1e-9
#: How far the axis of a helix may be from linear in the angle, mm or rad.
HELIX_ERROR = 1e-9
#: Degree along a helix, its widest piece, rad, and how far such a piece is from linear, relative to its rise; the
#: error of narrower ones falls with the eighth power.
_HELIX_DEGREE, _HELIX_PIECE, _HELIX_RELATIVE = 7, math.pi / 4.0, 5e-10


@dataclass(frozen=True)
class Arcs:
    """Circles of m arcs among moves.

    Parameters
    ----------
    move : array (m,)
        Numbers of the moves.
    axes : array (m, 2)
        The plane of each.
    centre : array (m, 2)
        mm.
    first, last : array (m,)
        Radius at start and end, mm.
    angle, sweep : array (m,)
        At the start, and turned through, rad, positive counterclockwise.
    """

    move: IntArray
    axes: IntArray
    centre: Array
    first: Array
    last: Array
    angle: Array
    sweep: Array

    def __len__(self) -> int:
        return len(self.move)


def find_arcs(moves: Moves, mended: Findings | None = None) -> Arcs:
    """The circles of all arcs; one that misses its circle is mended, or without findings for it a LineError."""
    chosen = np.flatnonzero((moves["kind"] == MoveKind.CLOCKWISE) | (moves["kind"] == MoveKind.COUNTERCLOCKWISE))
    axes = np.array(list(PLANES.values()))[moves["plane"][chosen] - 17]
    rows = np.arange(len(chosen))[:, None]
    start, end = moves.starts[chosen][rows, axes], moves["end"][chosen][rows, axes]
    words = moves["centre"][chosen][rows, axes]
    flags, ccw = moves["flags"][chosen], moves["kind"][chosen] == MoveKind.COUNTERCLOCKWISE
    by_radius = flags & Flag.R != 0
    radius, length = moves["radius"][chosen], np.linalg.norm(end - start, axis=1)

    def refuse(wrong: BoolArray, reason: Callable[[int], str], read_as: Callable[[int], str] | None = None) -> None:
        for i in np.flatnonzero(wrong).tolist():
            line = int(moves["line"][chosen[i]])
            if read_as is None or mended is None:
                fault = LineError(reason(i))
                fault.line = line
                raise fault
            mended.say(f"line {line}: {reason(i)}: read as {read_as(i)}")

    refuse(
        by_radius & (length == 0.0), lambda _: "an arc with R ends where it begins; write a full circle with I and J"
    )
    short = 0.5 * length - np.abs(radius)
    refuse(
        by_radius & (short > SHORT_RADIUS),
        lambda i: (
            f"the radius R {radius[i]:.6g} mm is {short[i]:.6g} mm too small for ends {length[i]:.6g} mm apart "
            f"(tolerance {SHORT_RADIUS:g} mm)"
        ),
        lambda i: f"half a circle of radius {0.5 * length[i]:.6g} mm",
    )
    centre = np.where((flags & Flag.ABSOLUTE != 0)[:, None], words, start + words)
    # less than half a turn if R > 0, more if R < 0
    height = np.sqrt(np.maximum((radius - 0.5 * length) * (radius + 0.5 * length), 0.0))
    aside = np.where(ccw == (radius > 0.0), height, -height) / np.where(by_radius, length, 1.0)
    left = np.column_stack([start[:, 1] - end[:, 1], end[:, 0] - start[:, 0]])
    centre = np.where(by_radius[:, None], 0.5 * (start + end) + left * aside[:, None], centre)
    first, last = (np.linalg.norm(each - centre, axis=1) for each in (start, end))
    refuse(first <= SAME_POINT, lambda _: "the arc has its centre where it begins: radius 0")
    off, inch = np.abs(last - first), flags & Flag.INCH != 0
    as_places = [np.linalg.norm(each - words, axis=1) for each in (start, end)]
    hint = (flags & Flag.ABSOLUTE == 0) & (np.abs(as_places[1] - as_places[0]) <= ROUNDED) & (as_places[0] > ROUNDED)
    always, rounded = np.where(inch, ALWAYS_INCH, ALWAYS), np.where(inch, ROUNDED_INCH, ROUNDED)
    refuse(
        ~by_radius & ((off > always) | ((off > rounded) & (off > RELATIVE * np.maximum(first, last)))),
        lambda i: (
            f"the arc ends {off[i]:.6g} mm off its circle: radius {first[i]:.6g} mm at its start, "
            f"{last[i]:.6g} mm at its end (tolerance {rounded[i]:.4g} mm and {RELATIVE:.1%} of the radius, at most "
            f"{always[i]:.4g} mm)"
            + "; as the centre's place, not the way to it, its words fit: write G90.1"
            * bool(hint[i])
        ),
        lambda _: "a spiral between them",
    )
    angle = np.arctan2(*(start - centre).T[::-1])
    sweep = np.arctan2(*(end - centre).T[::-1]) - angle
    sweep = np.maximum(np.mod(np.where(ccw, sweep, -sweep), 2.0 * math.pi), LEAST_SWEEP)
    sweep = np.where(length <= SAME_POINT, 2.0 * math.pi, sweep)
    sweep += 2.0 * math.pi * (moves["turns"][chosen] - 1.0)
    return Arcs(chosen, axes, centre, first, last, angle, np.where(ccw, sweep, -sweep))


def arc_lengths(moves: Moves, arcs: Arcs) -> Array:
    """Compute the lengths of arcs over the linear axes.

    Parameters
    ----------
    moves : Moves
        With the arcs.
    arcs : Arcs
        m circles.

    Returns
    -------
    array (m,)
        sqrt((r sweep)^2 + dr^2 + rise^2) with the mean radius r, mm.
    """
    step = moves.step[arcs.move]
    step[np.arange(len(arcs))[:, None], arcs.axes] = 0.0
    step[:, 3:6] = 0.0
    along = 0.5 * (arcs.first + arcs.last) * arcs.sweep
    lengths: Array = np.hypot(np.hypot(along, arcs.last - arcs.first), np.linalg.norm(step, axis=1))
    return lengths


def arc_degrees(moves: Moves, arcs: Arcs) -> IntArray:
    """Degrees (m,) of the curves that `arc_curve` makes: 1, 2, or 7 where another axis moves too."""
    step = moves.step[arcs.move]
    step[np.arange(len(arcs))[:, None], arcs.axes] = 0.0
    degrees: IntArray = np.where(np.any(step != 0.0, axis=1), _HELIX_DEGREE, 2)
    return np.where(np.abs(arcs.sweep) <= CHORD_SWEEP, 1, degrees)


def arc_curve(start: Array, end: Array, arcs: Arcs, i: int, columns: IntArray) -> NurbsCurve:
    """Make a curve of an arc.

    Parameters
    ----------
    start, end : array (9,)
        Of the move, mm and rad.
    arcs : Arcs
        With its circle.
    i : int
        Which of them it is.
    columns : array (axes,)
        Of the axes of the path.

    Returns
    -------
    NurbsCurve
        Its weights are those of a circle in pieces of a quarter turn at most; the radius goes linearly from the one at
        the start to the one at the end, which differ by rounding.
    """
    axes, sweep = arcs.axes[i], float(arcs.sweep[i])
    if abs(sweep) <= CHORD_SWEEP:
        return NurbsCurve.bezier([start[columns], end[columns]])
    rise = end - start
    rise[axes] = 0.0
    steep = bool(np.any(rise != 0.0))
    pieces = math.ceil(abs(sweep) / (_HELIX_PIECE if steep else 0.5 * math.pi) - 1e-12)
    if steep:
        top = float(np.max(np.abs(rise)))
        while top / pieces * _HELIX_RELATIVE * (abs(sweep) / pieces / _HELIX_PIECE) ** 8 > HELIX_ERROR:
            pieces *= 2
    half = 0.5 * abs(sweep) / pieces
    steps = np.linspace(0.0, 1.0, 2 * pieces + 1)
    angle = arcs.angle[i] + sweep * steps
    radius = arcs.first[i] + (arcs.last[i] - arcs.first[i]) * steps
    radius[1::2] /= math.cos(half)
    plane = arcs.centre[i] + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    plane[0], plane[-1] = start[axes], end[axes]
    weights = np.ones(2 * pieces + 1)
    weights[1::2] = math.cos(half)
    degree, along = 2, steps
    if steep:
        degree, wide = _HELIX_DEGREE, np.column_stack([plane * weights[:, None], weights])
        raised = _elevation()[:-1] @ np.stack([wide[:-2:2], wide[1::2], wide[2::2]], axis=1)
        raised = np.append(raised.reshape(-1, 3), wide[-1:], axis=0)
        plane, weights = raised[:, :2] / raised[:, 2:], raised[:, 2]
        parts = np.arange(pieces)[:, None] + _rises(half)[:-1] / weights[:degree]
        along = np.append(parts.ravel() / pieces, 1.0)
    points = start + along[:, None] * rise
    points[:, axes] = plane
    points[-1] = end
    knots = np.repeat(np.arange(pieces + 1.0), [degree + 1, *[degree] * (pieces - 1), degree + 1])
    return NurbsCurve(degree, knots, points[:, columns], weights)


@lru_cache(maxsize=1)
def _elevation() -> Array:
    """Bernstein coefficients of degree 2 to those of _HELIX_DEGREE, (p + 1, 3)."""
    return NurbsCurve.bezier(np.eye(3)).elevated(_HELIX_DEGREE - 2).control_points


@lru_cache(maxsize=1024)
def _rises(half: float) -> Array:
    """Parts of the rise at the control points of a piece of angle 2 half, times their weights, (p + 1,).

    w(u) (theta(u) + half) / (2 half), interpolated at Chebyshev's nodes with both ends held.
    """
    from scipy.interpolate import make_interp_spline

    p = _HELIX_DEGREE
    inner = 0.5 - 0.5 * np.cos((2.0 * np.arange(p - 1) + 1.0) * math.pi / (2.0 * (p - 1)))
    u = np.concatenate([[0.0], inner, [1.0]])
    low, middle, high = (1.0 - u) ** 2, 2.0 * u * (1.0 - u), u**2
    weight = low + middle * math.cos(half) + high
    theta = np.arctan2(math.sin(half) * (high - low), math.cos(half) * (low + high) + middle)
    wanted = weight * (theta + half) / (2.0 * half)
    rises: Array = make_interp_spline(u, wanted, p, t=np.repeat([0.0, 1.0], p + 1)).c
    return rises
