"""Arcs: their circles, whether they end on them, and the curves that they are.

An arc in its plane is a rational B-spline of degree 2 and exact. Along a helix z is linear in the angle, which no
rational curve is: x and y stay exact, and z (and axes that turn with it) is within HELIX_ERROR of linear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.moves import AXES, CLOCKWISE, COUNTERCLOCKWISE, Findings, Moves
from splinefeed.geometry.curve import NurbsCurve
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
    """Circles of the arcs among moves, (m,) each.

    move  their numbers; axes (m, 2) the plane; centre (m, 2), mm; first, last  radius at start and end, mm;
    angle at the start and sweep, rad, positive counterclockwise
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


def find_arcs(moves: Moves, findings: Findings | None = None, repair: bool = False) -> Arcs:
    """The circles of all arcs; LineError with the line for one that misses its circle, or a finding with `repair`."""
    chosen = np.flatnonzero((moves.kind == CLOCKWISE) | (moves.kind == COUNTERCLOCKWISE))
    planes = moves.codes[chosen, layout.ROW_PLANE]
    axes = np.array(list(layout.PLANES.values()))[planes - 17]
    rows = np.arange(len(chosen))[:, None]
    start = moves.starts[chosen][rows, axes]
    end = moves.ends[chosen][rows, axes]
    words = moves.values[chosen, layout.CENTER : layout.CENTER + 3][rows, axes]
    flags = moves.flags[chosen]
    ccw = moves.kind[chosen] == COUNTERCLOCKWISE
    absolute = (flags & layout.ABSOLUTE != 0)[:, None]
    centre = np.where(absolute, words, start + words)
    by_radius = flags & layout.HAS_R != 0
    if by_radius.any():
        centre[by_radius] = _centres(
            moves, chosen[by_radius], start[by_radius], end[by_radius], ccw[by_radius], findings, repair
        )
    first, last = (np.linalg.norm(each - centre, axis=1) for each in (start, end))
    _check_radii(moves, chosen, first, last, flags, findings, repair)
    angle = np.arctan2(*(start - centre).T[::-1])
    sweep = np.arctan2(*(end - centre).T[::-1]) - angle
    sweep = np.mod(np.where(ccw, sweep, -sweep), 2.0 * math.pi)
    sweep = np.maximum(sweep, LEAST_SWEEP)
    full = np.linalg.norm(end - start, axis=1) <= SAME_POINT
    sweep = np.where(full, 2.0 * math.pi, sweep) + 2.0 * math.pi * (moves.values[chosen, layout.TURNS] - 1.0)
    return Arcs(chosen, axes, centre, first, last, angle, np.where(ccw, sweep, -sweep))


def _centres(
    moves: Moves, chosen: IntArray, start: Array, end: Array, ccw: BoolArray, findings: Findings | None, repair: bool
) -> Array:
    """Centres (m, 2) of arcs with R: less than half a turn if R > 0, more if R < 0."""
    radius = moves.values[chosen, layout.RADIUS]
    chord = end - start
    length = np.linalg.norm(chord, axis=1)
    if np.any(length == 0.0):
        i = int(np.argmax(length == 0.0))
        raise ArcError(moves, int(chosen[i]), "an arc with R ends where it begins; write a full circle with I and J")
    short = 0.5 * length - np.abs(radius)
    if np.any(short > SHORT_RADIUS):
        if not repair or findings is None:
            i = int(np.argmax(short > SHORT_RADIUS))
            raise ArcError(
                moves,
                int(chosen[i]),
                f"the radius R {radius[i]:.6g} mm is {short[i]:.6g} mm too small for ends {length[i]:.6g} mm apart "
                f"(tolerance {SHORT_RADIUS:g} mm)",
            )
        for i in np.flatnonzero(short > SHORT_RADIUS).tolist():
            findings.say(
                f"line {moves.line[chosen[i]]}: the radius R {radius[i]:.6g} mm is {short[i]:.6g} mm too small for "
                f"ends {length[i]:.6g} mm apart: read as half a circle of radius {0.5 * length[i]:.6g} mm"
            )
    height = np.sqrt(np.maximum((radius - 0.5 * length) * (radius + 0.5 * length), 0.0))
    left = np.column_stack([-chord[:, 1], chord[:, 0]]) / length[:, None]
    side = np.where(ccw == (radius > 0.0), height, -height)
    centres: Array = 0.5 * (start + end) + left * side[:, None]
    return centres


def _check_radii(
    moves: Moves,
    chosen: IntArray,
    first: Array,
    last: Array,
    flags: IntArray,
    findings: Findings | None,
    repair: bool,
) -> None:
    off = np.abs(last - first)
    inch = flags & layout.INCH != 0
    always, rounded = np.where(inch, ALWAYS_INCH, ALWAYS), np.where(inch, ROUNDED_INCH, ROUNDED)
    missed = (off > always) | ((off > rounded) & (off > RELATIVE * np.maximum(first, last)))
    missed &= flags & layout.HAS_R == 0
    none = first <= SAME_POINT
    if np.any(none):
        raise ArcError(moves, int(chosen[int(np.argmax(none))]), "the arc has its centre where it begins: radius 0")
    if not np.any(missed):
        return
    said = [
        f"the arc ends {off[i]:.6g} mm off its circle: radius {first[i]:.6g} mm at its start, {last[i]:.6g} mm at its "
        f"end (tolerance {rounded[i]:.4g} mm and {RELATIVE:.1%} of the radius, at most {always[i]:.4g} mm)"
        for i in np.flatnonzero(missed).tolist()
    ]
    lines = moves.line[chosen[missed]]
    if not repair or findings is None:
        raise ArcError(moves, int(chosen[int(np.argmax(missed))]), said[0])
    for line, each in zip(lines.tolist(), said, strict=True):
        findings.say(f"line {line}: {each}: read as a spiral between them")


class ArcError(LineError):
    """An arc that misses its circle; `line` is where it stands."""

    def __init__(self, moves: Moves, move: int, reason: str) -> None:
        super().__init__(reason)
        self.line = int(moves.line[move])


def arc_lengths(moves: Moves, arcs: Arcs) -> Array:
    """Lengths (m,) of the arcs over the linear axes, mm: sqrt((r sweep)^2 + dr^2 + rise^2) with the mean radius."""
    step = (moves.ends - moves.starts)[arcs.move]
    rows = np.arange(len(arcs))[:, None]
    step[rows, arcs.axes] = 0.0
    step[:, 3:6] = 0.0
    along = 0.5 * (arcs.first + arcs.last) * arcs.sweep
    lengths: Array = np.hypot(np.hypot(along, arcs.last - arcs.first), np.linalg.norm(step, axis=1))
    return lengths


def arc_degrees(moves: Moves, arcs: Arcs) -> IntArray:
    """Degrees (m,) of the curves that `arc_curve` makes: 1, 2, or 7 where another axis moves too."""
    step = (moves.ends - moves.starts)[arcs.move]
    step[np.arange(len(arcs))[:, None], arcs.axes] = 0.0
    degrees: IntArray = np.where(np.any(step != 0.0, axis=1), _HELIX_DEGREE, 2)
    return np.where(np.abs(arcs.sweep) <= CHORD_SWEEP, 1, degrees)


def arc_curve(start: Array, end: Array, arcs: Arcs, i: int, columns: IntArray) -> NurbsCurve:
    """Arc number i from start (9,) to end (9,) as a curve over the axes `columns` of the path, mm and rad.

    Weights are those of a circle in pieces of a quarter turn at most; the radius goes linearly from the one at the
    start to the one at the end, which differ by rounding.
    """
    a, b = (int(axis) for axis in arcs.axes[i])
    rest = np.array([column for column in range(AXES) if column not in (a, b)])
    rise = end[rest] - start[rest]
    sweep = float(arcs.sweep[i])
    if abs(sweep) <= CHORD_SWEEP:
        return NurbsCurve.bezier([start[columns], end[columns]])
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
    plane[0], plane[-1] = start[[a, b]], end[[a, b]]
    weights = np.ones(2 * pieces + 1)
    weights[1::2] = math.cos(half)
    if not steep:
        degree, along, places = 2, steps, plane
    else:
        degree = _HELIX_DEGREE
        places, weights, along = _raised(plane, weights, pieces, half)
    points = np.tile(start, (len(places), 1))
    points[:, [a, b]] = places
    points[:, rest] = start[rest] + along[:, None] * rise
    points[-1] = end
    knots = np.repeat(np.arange(pieces + 1.0), [degree + 1, *[degree] * (pieces - 1), degree + 1])
    return NurbsCurve(degree, knots, points[:, columns], weights)


def _raised(plane: Array, weights: Array, pieces: int, half: float) -> tuple[Array, Array, Array]:
    """The pieces of degree 2 raised to _HELIX_DEGREE: points, weights, and the part of the rise at each of them."""
    matrix = _elevation()
    homogeneous = np.column_stack([plane * weights[:, None], weights])
    raised = np.concatenate(
        [(matrix @ homogeneous[2 * k : 2 * k + 3])[: None if k == pieces - 1 else -1] for k in range(pieces)]
    )
    rises = _rises(half)
    along = np.concatenate([(k + rises)[: None if k == pieces - 1 else -1] / pieces for k in range(pieces)])
    places = raised[:, :2] / raised[:, 2:]
    places[0], places[-1] = plane[0], plane[-1]
    return places, raised[:, 2], along


@lru_cache(maxsize=1)
def _elevation() -> Array:
    """Bernstein coefficients of degree 2 to those of _HELIX_DEGREE, (p + 1, 3)."""
    p = _HELIX_DEGREE
    return np.array(
        [[math.comb(2, j) * math.comb(p - 2, i - j) / math.comb(p, i) if 0 <= i - j <= p - 2 else 0.0 for j in range(3)]
         for i in range(p + 1)]
    )  # fmt: skip


@lru_cache(maxsize=1024)
def _rises(half: float) -> Array:
    """Parts of the rise at the control points of a piece of angle 2 half, (p + 1,).

    w(u) (theta(u) + half) / (2 half), interpolated at Chebyshev's nodes with both ends held, over the weights.
    """
    p = _HELIX_DEGREE
    nodes = 0.5 - 0.5 * np.cos((2.0 * np.arange(p - 1) + 1.0) * math.pi / (2.0 * (p - 1)))
    basis = _bernstein(p, nodes)
    square = _bernstein(2, nodes)
    weight = square @ [1.0, math.cos(half), 1.0]
    sine, cosine = square @ [-math.sin(half), 0.0, math.sin(half)], square @ [math.cos(half), 1.0, math.cos(half)]
    wanted = weight * (np.arctan2(sine, cosine) + half) / (2.0 * half)
    inner = np.linalg.solve(basis[:, 1:p], wanted - basis[:, p])
    rises: Array = np.concatenate([[0.0], inner, [1.0]]) / (_elevation() @ [1.0, math.cos(half), 1.0])
    return rises


def _bernstein(degree: int, u: Array) -> Array:
    """Bernstein polynomials (n, degree + 1) at u (n,)."""
    i = np.arange(degree + 1)
    binomial = np.array([math.comb(degree, int(k)) for k in i])
    values: Array = binomial * u[:, None] ** i * (1.0 - u[:, None]) ** (degree - i)
    return values
