"""The proof of a smoothed path: how far it is from the original side by side, and that it has no new self-crossing.

It looks at chords of both paths and shares nothing with the smoothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.pieces import coefficients, taylor
from splinefeed.errors import CurveError, InputError, expect
from splinefeed.kernels import matching as kernels
from splinefeed.kernels.layout import HIGH, LOW, SCALE, Shape
from splinefeed.paths.meetings import meetings
from splinefeed.paths.parts import cut_at_corners
from splinefeed.paths.path import Path
from splinefeed.paths.smoothing import (
    ANGULAR_TOLERANCE,
    SMOOTHING_CORNER_ANGLE,
    UNBOUNDED_TOLERANCE,
    allowed,
    lines_along,
    smoothed,
)
from splinefeed.paths.tool_path import ANGLES, POINTS, VECTORS, ToolPath, beside
from splinefeed.records import Array, IntArray
from splinefeed.records.arrays import chunks

#: The proof gives the distance from the original to this share of the tolerance.
PRECISION = 0.02
#: Rounds of smoothing more closely, each with half the tolerance, before the curves concerned stay exact.
ROUNDS = 6
#: What chords may cut off, as a share of the precision: each distance counts it of both paths.
SAG = 0.25
#: Traversals on which the paths come further apart than this many tolerances are not followed.
LIMIT = 3.0
#: Cells of a chord beside a chord at first, for each chord, and at most: beyond, the paths are too entangled.
CELLS, MOST_CELLS = 4, 30_000_000
#: Places that lie within this, relative to the coordinates, are one.
TOUCH = 1e-10
#: Most meetings of a path with itself that are examined.
MOST_MEETINGS = 1_000_000
#: A curve whose chord is longer than this many times what it cuts off does not turn back over it.
BACK = 4.0
#: Steps no longer than this, relative to the coordinates, are rounding.
ROUNDING = 1e-14
#: The share of a short span that its chords may cut off.
FLAT = 1.0 / 64.0
#: Chords of one span at most.
MOST_CHORDS = 100_000
#: Chords are so many that each is longer than BACK times what it cuts off, |C'| h > BACK max|C''| h^2 / 8, with a
#: margin; where C' is nearly 0, at most so many.
CLEAR, MOST_CLEAR = 1.5, 1000.0
#: Places of a span at which |C'| is looked at.
SPEEDS = 9
#: Places a span of a rational curve at which its second derivative is sampled, and the factor for values between them.
PLACES, BETWEEN = 17, 1.25
#: Names under which the columns of the tool axis go through the smoothing, beside x, y, z.
_COLUMNS = ("a", "b", "c")
#: Largest tolerance of the tool axis, rad: beyond it there is little left of a direction.
LARGEST_ANGLE = math.radians(30.0)
#: A curve's tool axis turns by less than this, rad, from its middle: otherwise its shortest vector is not bounded.
MOST_TURN = math.radians(80.0)


@dataclass(frozen=True, eq=False)
class Order:
    """Two paths traversed side by side, from start to end and never back.

    Parameters
    ----------
    largest : float
        A bound of the Frechet distance over the linear axes, mm, infinite if none was found.
    largest_angle : float
        Of the angle between the rotary axes meanwhile, rad.
    crossings : (n, 2) array, optional
        Arc lengths of the result at which it meets itself and the original, near there, does not.
    concerned : (2 n, 2) array of int, optional
        First and last curve of the original that the pieces which meet there stand for.
    unclear : int, optional
        Chords of the result too short, for their bend, to show whether there are loops in them.
    """

    largest: float
    largest_angle: float
    crossings: Array = field(default_factory=lambda: np.empty((0, 2)))
    concerned: IntArray = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))
    unclear: int = 0


@dataclass(frozen=True, eq=False)
class Proof:
    """The proof of a smoothed path, by means that the smoothing does not share.

    Parameters
    ----------
    path : Path
        The result, with its findings.
    order : Order
        How far both are apart when they are traversed side by side, and which self-crossings are new.
    tolerance : float
        mm, the largest that was allowed.
    angular_tolerance : float
        rad.
    closer : int
        Curves of the original that were smoothed with less, so that there is no new self-crossing.
    """

    path: Path
    order: Order
    tolerance: float
    angular_tolerance: float
    closer: int

    @property
    def holds(self) -> bool:
        """Whether every distance is within its tolerance, in order, and no crossing is new."""
        most = (1.0 + PRECISION) * self.tolerance
        turned = self.order.largest_angle <= (1.0 + PRECISION) * self.angular_tolerance
        return self.order.largest <= most and turned and not len(self.order.crossings)

    @property
    def sentence(self) -> str:
        """The proof as a sentence, for findings."""
        found = (
            f"at most {self.order.largest:.4g} mm from the original, both ways, side by side in the same order "
            f"(tolerance {self.tolerance:g} mm)"
        )
        if self.path.linear < len(self.path.axes):
            found += f" and {math.degrees(self.order.largest_angle):.4g} deg"
        found += ", and no new self-crossing" if not len(self.order.crossings) else (
            f", and {len(self.order.crossings)} place(s) where it crosses itself and the original does not, "
            f"the first at {self.order.crossings[0, 0]:.6g} mm"
        )  # fmt: skip
        if self.order.unclear:
            found += f" ({self.order.unclear} place(s) too small to tell)"
        if self.closer:
            found += f"; {self.closer} curve(s) smoothed with less for that"
        return found


def proven(
    path: Path, tolerance: float | str, *, angular_tolerance: float = ANGULAR_TOLERANCE, use: float = 1.0, **how: Any
) -> Proof:
    """Smooth a path as by `smoothed`, and prove it.

    Parameters
    ----------
    path : Path
        The path.
    tolerance : float or str
        mm, or "program".
    angular_tolerance : float, optional
        rad.
    use : float, optional
        The share of the tolerance that counts as all of it.
    **how : object
        Other arguments of `smoothed`.

    Returns
    -------
    Proof
        Where the original nearly touches itself, a result within the tolerance may cross itself: there it is smoothed
        again with half the tolerance, and finally not smoothed.

    Raises
    ------
    CurveError
        If it is over its tolerance nevertheless, which is not known to happen.
    InputError
        As `smoothed`.
    """
    given = path
    path, _ = cut_at_corners(path)
    share, largest = np.full(len(path.flat), use), use * largest_tolerance(path, tolerance)
    for attempt in range(ROUNDS + 2):
        result = smoothed(path, tolerance, angular_tolerance=angular_tolerance, share=share, **how)
        if result is path:
            return Proof(given, Order(0.0, 0.0), largest, angular_tolerance, 0)
        found = order(path, result, largest, angular_tolerance, PRECISION)
        if not len(found.crossings) or attempt > ROUNDS:
            break
        closer = np.zeros(len(share), dtype=bool)
        for low, high in found.concerned:
            closer[low : high + 1] = True
        share[closer] *= 0.5 if attempt < ROUNDS else 0.0
    proof = Proof(result, found, largest, angular_tolerance, int(np.count_nonzero(share < use)))
    if not proof.holds and not len(found.crossings):
        raise CurveError(f"{path.name}: smoothed, but {proof.sentence}; please report it")
    return replace(proof, path=result.with_findings(*result.findings, proof.sentence))


def proven_tool(
    path: ToolPath, tolerance: float | str, *, angular_tolerance: float = ANGULAR_TOLERANCE, **how: Any
) -> tuple[ToolPath, Proof]:
    """Smooth tip and tool axis of a tool path, and prove both tolerances.

    Parameters
    ----------
    path : ToolPath
        The path.
    tolerance : float or str
        Of the tip, mm, or "program".
    angular_tolerance : float, optional
        Of the tool axis, rad.
    **how : object
        As for `smoothed`.

    Returns
    -------
    path : ToolPath
        With continuous tangent and curvature of tip and tool axis.
    proof : Proof
        Of both.

    Raises
    ------
    InputError
        For a tolerance that cannot be used, and for curves whose tool axis has other knots than the tip.

    Notes
    -----
    Tip and tool axis are one curve of up to six columns, (r, w): w holds vectors k / m, where m is the shortest of
    them all, or angles of rotary joints, rad. That curve is smoothed as any path with rotary axes is, and `order` runs
    both paths through side by side: at each place of the result there is one of the original, in the same order, with

        |r - r0| <= tolerance  and  |w - w0| <= sin(angular_tolerance)   (angles: <= angular_tolerance).

    As |w0| >= 1, the angle between the tool axes is at most asin |w - w0|, which is within the tolerance. m is no
    sample: each curve lies in the hull of its control points, so that |k| >= min_i (p_i . d) for any unit vector d.
    Of angles, the tool axis of two joints that turn about crossing axes has dk^2 = dA^2 + sin^2(A) dC^2: it turns by
    no more than the joints do. Both bounds hold with what the chords of that proof cut off.
    """
    if not (isinstance(angular_tolerance, int | float) and 0.0 < angular_tolerance <= LARGEST_ANGLE):
        raise InputError(
            f"the tolerance of the tool axis is {angular_tolerance!r} rad; it must be above 0 and at most "
            f"{math.degrees(LARGEST_ANGLE):g} deg"
        )
    packed = _packed(path)
    angular = angular_tolerance if path.kind == ANGLES else math.sin(angular_tolerance)
    least = 1.0 + PRECISION  # the proof tells distances to this: what it says is within the tolerances themselves
    proof = proven(packed, tolerance, angular_tolerance=angular / least, use=1.0 / least, **how)
    said_of = replace(proof, tolerance=largest_tolerance(packed, tolerance), angular_tolerance=angular_tolerance)
    if proof.path is packed:
        return path, said_of
    return _unpacked(proof.path, path).with_findings(*proof.path.findings[:-1], said_of.sentence), said_of


def largest_tolerance(path: Path, tolerance: float | str) -> float:
    """The largest tolerance of all curves, mm."""
    return float(allowed(path, tolerance).max()) or UNBOUNDED_TOLERANCE


def _packed(path: ToolPath) -> Path:
    """Tip and tool axis as one path of x, y, z and up to three columns that are looked at as rotary axes."""
    said = {**path._said(), "tolerance": path.tolerance}
    if path.tool_axis is None:
        return Path(path.curves, **said)
    columns = []
    for i, (tip, axis) in enumerate(zip(path.curves, path.tool_axis, strict=True)):
        same = tip.degree == axis.degree and np.array_equal(tip.knots, axis.knots)
        one, other = (np.ones(1) if each.weights is None else each.weights for each in (tip, axis))
        if not same or not np.array_equal(one, other):
            raise InputError(
                f"{path.name}: curve {i} has other knots or weights for the tool axis than for the tip; give both the "
                "same to smooth them together"
            )
        columns.append(axis.control_points - tip.control_points if path.kind == POINTS else axis.control_points)
    scale = 1.0 if path.kind == ANGLES else 1.0 / _shortest(columns, path)
    curves = [
        beside(tip, np.column_stack([tip.control_points, scale * rows]))
        for tip, rows in zip(path.curves, columns, strict=True)
    ]
    return Path(curves, ("x", "y", "z", *_COLUMNS[: path.columns]), **said)


def _shortest(columns: list[Array], path: ToolPath) -> float:
    """A length that no vector of the tool axis is shorter than."""
    least = math.inf
    for i, rows in enumerate(columns):
        sizes = np.linalg.norm(rows, axis=1)
        units = rows / np.maximum(sizes, np.finfo(float).tiny)[:, None]
        middle = units.sum(axis=0)
        along = rows @ (middle / max(float(np.linalg.norm(middle)), np.finfo(float).tiny))
        if np.any(along < math.cos(MOST_TURN) * sizes) or not np.all(sizes > 0.0):
            raise InputError(
                f"{path.name}: the tool axis turns too far along curve {i} to be smoothed, at "
                f"{path.place(float(path.curve_starts[i + 1]))}; split the curve"
            )
        least = min(least, float(along.min()))
    return least


def _unpacked(smooth: Path, path: ToolPath) -> ToolPath:
    curves = [NurbsCurve(c.degree, c.knots, c.control_points[:, :3], c.weights) for c in smooth.curves]
    said = {**smooth._said(), "tolerance": smooth.tolerance, "tool_length": path.tool_length}
    said["lines"] = lines_along(smooth, path)
    if path.tool_axis is None:
        return ToolPath(curves, **said)
    axes = [beside(c, c.control_points[:, 3:].copy()) for c in smooth.curves]
    kind = ANGLES if path.kind == ANGLES else VECTORS
    return ToolPath(curves, axes, kind=kind, rotary=path.rotary, **said)


def order(original: Path, result: Path, tolerance: float, angular_tolerance: float, precision: float = 0.02) -> Order:
    """Traverse both paths side by side, so that they stay near each other, and find new self-crossings of the result.

    Parameters
    ----------
    original, result : Path
        The paths.
    tolerance, angular_tolerance : float
        mm and rad: what counts as equally far over linear and rotary axes.
    precision : float, optional
        Of both, as a share: what chords in place of curves may cost.

    Returns
    -------
    Order
        The largest distance of the traversal bounds the Frechet distance: the order of places, and the direction, are
        those of the original, nothing is left out or traversed twice.

    Notes
    -----
    The way is found from the chords of both paths alone, cell by cell [1]_; the distance is convex along it within a
    cell, so that its places on the edges give the largest. It shares nothing with the smoothing.

    References
    ----------
    .. [1] Alt, Godau, "Computing the Frechet distance between two polygonal curves", Int. J. Comput. Geom. Appl. 5
       (1995), 75-91, doi 10.1142/S0218195995000064.
    """
    linear = result.linear
    scale = np.repeat([1.0 / tolerance, 1.0 / angular_tolerance], [linear, len(result.axes) - linear])
    p, owner, cut = chords(result, SAG * precision, scale)
    q, source, _ = chords(original, SAG * precision, scale)
    way = _way(p, q, linear)
    if way is None:
        return Order(math.inf, math.inf)
    sag = 2.0 * SAG * precision
    off = _at(p, way[:, 0]) - _at(q, way[:, 1])
    distance, angle = (float(np.linalg.norm(each, axis=1).max()) for each in (off[:, :linear], off[:, linear:]))
    crossings, places = np.empty((0, 2)), np.empty((0, 2))
    if linear > 1:
        crossings, places = _new_meetings(result, p[:, :linear] * tolerance, q[:, :linear] * tolerance, owner, way)
    concerned = np.clip(np.column_stack([np.floor(places[:, 0]), np.ceil(places[:, 1]) - 1.0]), 0, len(source) - 1)
    return Order(
        tolerance * (distance + sag),
        angular_tolerance * (angle + (sag if linear < len(result.axes) else 0.0)),
        crossings,
        source[concerned.astype(np.int64)],
        _unclear(p[:, :linear], cut, owner),
    )


def _way(p: Array, q: Array, linear: int) -> Array | None:
    """Places (n, 2) on both lines, chord and share in one number, that lead from start to end; None if none is near."""
    columns, chord = len(p) - 1, len(q) - 1
    lows, starts = np.zeros(columns + 1, dtype=np.int64), np.zeros(columns + 1, dtype=np.int64)
    room = CELLS * (columns + chord)
    while True:
        places, ways = np.empty((room, 2)), np.empty((room, 2), dtype=np.int64)
        used = kernels.side_by_side(p, q, linear, LIMIT**2, lows, starts, places, ways)
        if used >= 0 or room >= MOST_CELLS:
            break
        room *= 4
    if used <= 0:
        return None
    out = np.empty((columns + chord + 2, 2))
    count = kernels.traced(lows, starts, places, ways, out)
    return np.vstack([[[0.0, 0.0]], out[:count][::-1]])


def _at(points: Array, place: Array) -> Array:
    i = np.minimum(place.astype(np.int64), len(points) - 2)
    return np.asarray(points[i] + (place - i)[:, None] * (points[i + 1] - points[i]))


def _new_meetings(result: Path, p: Array, q: Array, owner: IntArray, way: Array) -> tuple[Array, Array]:
    """Arc lengths (n, 2) at which the result meets itself where the original, over the same pieces, does not.

    And (2 n, 2) where on the original these pieces begin and end.
    """
    found, known = (meetings(each, TOUCH * float(np.abs(each).max()), MOST_MEETINGS) for each in (p, q))
    if found is None or known is None or not len(found):
        return np.empty((0, 2)), np.empty((0, 2))
    # the pieces at both places and their neighbours, as places on the original
    first = np.searchsorted(owner, np.arange(len(result.curves)))
    bounds = np.append(first, len(owner)).astype(float)
    piece = owner[np.minimum(found.astype(np.int64), len(owner) - 1)]
    low = np.interp(bounds[np.maximum(piece - 1, 0)], way[:, 0], way[:, 1])
    high = np.interp(bounds[np.minimum(piece + 2, len(result.curves))], way[:, 0], way[:, 1])
    new = np.ones(len(found), dtype=bool)
    ordered = known[np.argsort(known[:, 0], kind="stable")]
    begin = np.searchsorted(ordered[:, 0], np.floor(low[:, 0]))
    end = np.searchsorted(ordered[:, 0], np.ceil(high[:, 0]), side="right")
    for k in range(len(found)):
        other = ordered[begin[k] : end[k], 1]
        new[k] = not np.any((other >= np.floor(low[k, 1])) & (other <= np.ceil(high[k, 1])))
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
    mine = piece[new].ravel()
    places = np.column_stack([np.interp(bounds[each], way[:, 0], way[:, 1]) for each in (mine, mine + 1)])
    return np.asarray(np.interp(found[new], np.arange(len(p)), length)), places


def _unclear(p: Array, cut: Array, owner: IntArray) -> int:
    """Chords (n,) within which, or over to the next of which, the curve could turn back: it cuts off too much.

    With e the distance of a curve from its chord at equal shares, |e'| <= 4 cut / h: the curve goes forwards along any
    direction in which its chord is longer than four times what it cuts off.
    """
    step = np.diff(p, axis=0)
    length = np.linalg.norm(step, axis=1)
    unit = step / np.maximum(length, 1e-300)[:, None]
    cosine = np.sqrt(np.maximum(0.5 * (1.0 + np.sum(unit[1:] * unit[:-1], axis=1)), 0.0))
    open_ = (cut > 0.0) & (length <= BACK * cut)
    over = (owner[1:] == owner[:-1]) & (cut[1:] > 0.0)
    open_[1:] |= over & ((cosine * length[1:] <= BACK * cut[1:]) | (cosine * length[:-1] <= BACK * cut[:-1]))
    return int(np.count_nonzero(open_))


def chords(path: Path, sag: float, scale: Array | None = None) -> tuple[Array, IntArray, Array]:
    """Replace a path by chords.

    Parameters
    ----------
    path : Path
        The path.
    sag : float
        The most that a chord may cut off; that is a small share of its span, too.
    scale : (axes,) array, optional
        What each axis is taken times; only the linear ones, in mm, if it is not given.

    Returns
    -------
    points : (n + 1, axes) array
        Of the chords.
    curve : (n,) array of int
        Of each chord.
    off : (n,) array
        What it cuts off at most.
    """
    scale = np.ones(path.linear) if scale is None else scale
    table, rows = path.span_pieces.table, path.span_pieces.rows
    owner = np.repeat(np.arange(len(path.flat)), rows[:, 1] - rows[:, 0] + 1)
    low, high, top = table[:, LOW], table[:, HIGH], np.zeros(len(table))
    long, slowest = np.ones((2, len(table)))
    bent = np.flatnonzero(((path.flat.degrees > 1) | (path.flat.rational > 0))[owner])
    for part in chunks(len(bent)):
        top[bent[part]], long[bent[part]], slowest[bent[part]] = _bends(table[bent[part]].T, path.shape, scale)
    with np.errstate(divide="ignore"):
        parts = (high - low) / np.sqrt(8.0 * np.minimum(FLAT * long, sag) / top)
        clear = np.minimum((high - low) * top / (CLEAR * slowest), MOST_CLEAR)
    parts = np.clip(np.ceil(np.maximum(parts, clear)), 1, MOST_CHORDS).astype(np.int64)
    cuts = top * ((high - low) / parts) ** 2 / 8.0
    # the places of a piece: the ends of its chords, and its start if a curve begins there
    opens = np.append(True, owner[1:] != owner[:-1])
    count = parts + opens
    piece = np.repeat(np.arange(len(table)), count)
    share = np.arange(len(piece)) - np.repeat(np.cumsum(count) - parts - 1, count)
    u = np.where(share < parts[piece], low[piece] + share / parts[piece] * (high - low)[piece], high[piece])
    line = path.evaluate(owner[piece], u)[:, 0, : len(scale)] * scale
    # where two curves join there may be a step of a rounding, which is no chord
    least = ROUNDING * float(np.abs(line).max())
    moved = np.append(True, np.any(np.abs(line[1:] - line[:-1]) > least, axis=1))
    return line[moved], owner[piece][moved][1:], np.where(share > 0, cuts[piece], 0.0)[moved][1:]


def _bends(c: Array, shape: Shape, scale: Array) -> tuple[Array, Array, Array]:
    """Largest |C''|, and about the length and the least |C'| (n,) of columns c of a table, of the axes times `scale`.

    The first by the Bernstein coefficients of C'', which bound it; with weights by samples.
    """
    degree, axes, _, rational = shape
    a, size = coefficients(c, shape), scale[:, None, None]
    by_weight = np.any(a[axes:, 1:], axis=(0, 1))
    first = taylor(a[:, :, None], rational, np.linspace(-1.0, 1.0, SPEEDS)[:, None], 1)[1][: len(scale)] * size
    speed = np.linalg.norm(first, axis=0)
    k, t = np.arange(2, degree + 1), np.linspace(0.0, 1.0, degree - 1)[:, None]
    bernstein = np.array([math.comb(degree - 2, i) for i in k - 2]) * t ** (k - 2) * (1.0 - t) ** (degree - k)
    to_bernstein = np.linalg.solve(bernstein, k * (k - 1) * (2.0 * t - 1.0) ** (k - 2))
    top = np.linalg.norm(np.einsum("ik,akn->ain", to_bernstein, a[: len(scale), 2:] * size), axis=0).max(axis=0)
    if by_weight.any():
        bend = taylor(a[:, :, None, by_weight], 1, np.linspace(-1.0, 1.0, PLACES)[:, None], 2)[2][: len(scale)]
        top[by_weight] = BETWEEN * 2.0 * np.linalg.norm(bend * size, axis=0).max(axis=0)
    return top * c[SCALE] ** 2, 2.0 * speed.mean(axis=0), speed.min(axis=0) * c[SCALE]


def smooth(
    path: Path,
    tolerance: float | str,
    *,
    corners: str = "keep",
    corner_angle: float = SMOOTHING_CORNER_ANGLE,
    angular_tolerance: float = ANGULAR_TOLERANCE,
) -> Path:
    """Smooth a path, or that of a tool, within a tolerance, with proof.

    Parameters
    ----------
    path : Path
        Curves of any kind: lines, arcs, splines.
    tolerance : float or str
        How far the result may be from the path, mm; "program" for that of each curve (G64 P).
    corners : str, optional
        "keep" them, the tool stops there, or "round" them within the tolerance.
    corner_angle : float, optional
        Joints that turn by more, rad, are corners.
    angular_tolerance : float, optional
        Of rotary axes or of the tool axis, rad.

    Returns
    -------
    Path
        With a continuous tangent and curvature and a bounded third derivative; its findings state the proof. Of a
        ToolPath a ToolPath.

    Raises
    ------
    InputError
        For arguments that cannot be used.

    References
    ----------
    .. [1] docs/smoothing.md
    .. [2] docs/math/smoothing.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.Path.polyline([[0, 0], [5, 0], [9, 1]])
    >>> len(path.stops), len(sf.smooth(path, 0.01, corners="round").stops)
    (1, 0)
    """
    expect("smooth(path, tolerance)", (path, Path))
    said: dict[str, Any] = {"corners": corners, "corner_angle": corner_angle, "angular_tolerance": angular_tolerance}
    if isinstance(path, ToolPath):
        return proven_tool(path, tolerance, **said)[0]
    return proven(path, tolerance, **said).path
