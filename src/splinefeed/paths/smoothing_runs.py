"""Runs of short lines: freed of points that are noise, found among the curves that come, and fitted by splines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.differential import angles
from splinefeed.curves.packed import Flat, Packed
from splinefeed.kernels.matching import thin
from splinefeed.paths.fitting.grid import graded, halved
from splinefeed.records import Array, BoolArray, IntArray

#: Share of the tolerance within which points stand for one: duplicates, jitter and tiny steps back.
THIN = 0.1
#: Share of the tolerance that a fit may use. Between its samples it may be off by a little more.
FIT = 0.6
#: Two lines make a run if an arc over the shorter one that turns as they do rises by no more than this many tolerances.
RISE = 1.5
#: A line longer than this many tolerances, or so many times as long as the median of its run, stays a line.
LONG, LONGER = 500.0, 12.0
#: Lines that a run needs at least, and most lines of one fit.
LEAST, MOST = 4, 500
#: A corner turns between arms of at least this many tolerances, which noise does not reach, of at most so many lines.
ARM, ARM_LINES = 5.0, 8
#: Samples a line of mean length, the least and the most of any.
SAMPLES, MOST_SAMPLES = 3, 48
#: Degree of the splines.
DEGREE = 5
#: A coefficient that samples tell to less than this share of its square is open: rounding.
OPEN = 1e-13
#: Rounds of halving knot spans at most: a span is at least a 2^ROUNDS-th of the run.
ROUNDS = 12
#: Samples that a span needs to be halved.
FEWEST = 9
#: A span is halved if it is wider than this many of its neighbours.
GRADE = 2.5


@dataclass(frozen=True, eq=False)
class LineBatch:
    """Curves that follow each other.

    Parameters
    ----------
    flat : Flat
        The curves.
    first : (n,) array of int
        Number of the first curve of the path that each stands for.
    allowed, spent : (n,) array
        Tolerance, mm, and the share of it that is used up.
    line : (n,) array of bool
        Straight lines that may be changed.
    free, apart, corner : (n,) array of bool
        Whether the joint before it may be smoothed, whether feed or tolerance changes there, and whether it turns by
        more than the corner angle.
    feed, said : (n,) array
        mm/s, and tolerance of the program, mm; NaN where none is given.
    """

    flat: Flat
    first: IntArray
    allowed: Array
    spent: Array
    line: BoolArray
    free: BoolArray
    apart: BoolArray
    corner: BoolArray
    feed: Array
    said: Array

    @classmethod
    def joined(cls, batches: Sequence[LineBatch]) -> LineBatch:
        """All of them, one behind the other."""
        if len(batches) == 1:
            return batches[0]
        columns = {name: np.concatenate([getattr(batch, name) for batch in batches]) for name in COLUMNS}
        return cls(flat=Flat.joined([batch.flat for batch in batches]), **columns)

    def part(self, low: int, high: int) -> LineBatch:
        """The curves from `low` to the one before `high`."""
        return LineBatch(self.flat.part(low, high), **{name: getattr(self, name)[low:high] for name in COLUMNS})

    def standing(self, flat: Flat, at: IntArray, spent: Array) -> LineBatch:
        """Other curves, number i of which stands for those from at[i] to the one before at[i + 1]."""
        columns = {name: getattr(self, name)[at] for name in COLUMNS}
        columns["allowed"] = np.minimum.reduceat(self.allowed, at)
        columns["spent"] = spent
        return LineBatch(flat, **columns)

    def __len__(self) -> int:
        return len(self.first)


COLUMNS = tuple(field.name for field in fields(LineBatch) if field.name != "flat")


@dataclass
class Runs:
    """Make splines of degree 5 of runs of short lines that turn gently; everything else stays as it is.

    Parameters
    ----------
    linear : int
        How many of the first axes are linear.
    angular, corner_angle : float
        rad, as for `smoothed`.
    fits : int, optional
        Splines so far.

    Notes
    -----
    Before, points within a tenth of the tolerance of the last one go: lines between those that stay take their place.
    """

    linear: int
    angular: float
    corner_angle: float
    fits: int = 0
    _tail: LineBatch | None = None  # from the last point but one that is sure to stay: few lines, however many came
    _waiting: LineBatch | None = None
    _past: int = 0  # how many of those that wait are out already: corners are seen between arms

    @property
    def waiting(self) -> int:
        """Curves that are held."""
        return 0 if self._waiting is None else len(self._waiting)

    def _thinned(self, batch: LineBatch, last: bool) -> LineBatch | None:
        if self._tail is not None:
            batch = LineBatch.joined([self._tail, batch])
        ends, line, allowed, count = Packed(batch.flat).ends, batch.line, batch.allowed, len(batch)
        vertices = np.vstack([ends[:1, 0], ends[:, 1]])
        held = np.ones(count + 1, dtype=bool)
        held[1:-1] = ~(batch.free[1:] & ~batch.apart[1:] & line[:-1] & line[1:])
        held[-1] = last or not line[-1]
        near = THIN * np.minimum(np.append(allowed[:1], allowed), np.append(allowed, allowed[-1:]))
        kept = np.empty(count + 1, dtype=bool)
        thin(vertices, held, self.linear, near, THIN * self.angular, kept)
        at = np.flatnonzero(kept)
        self._tail = None
        if last:
            return _between(batch, vertices, at)
        sure, end = (int(at[-2]) if len(at) > 1 else 0), int(at[-1])
        # what is not sure yet: a line to the last point that stays, one to the first point elsewhere, one to the end
        aside = np.flatnonzero(np.any(vertices[end + 1 :, : self.linear] != vertices[end, : self.linear], axis=1))
        marks = {sure, end, *(end + 1 + aside[:1]).tolist(), count}
        self._tail = _between(batch.part(sure, count), vertices[sure:], np.array(sorted(marks)) - sure)
        return _between(batch.part(0, sure), vertices[: sure + 1], at[at <= sure]) if sure else None

    def push(self, batch: LineBatch, last: bool) -> LineBatch | None:
        """Take more curves; those that are final, all with `last`."""
        given = [each for each in (self._waiting, self._thinned(batch, last)) if each is not None]
        if not given:
            return None
        batch = LineBatch.joined(given)
        past, count = self._past, len(batch)
        known = count if last else count - ARM_LINES
        if known <= past:
            self._waiting = batch
            return None
        ends = Packed(batch.flat).ends
        steps = ends[:, 1] - ends[:, 0]
        lengths = np.linalg.norm(steps[:, : self.linear], axis=1)
        line, allowed = batch.line, batch.allowed
        angle = angles(steps[:-1, : self.linear], steps[1:, : self.linear])
        angle[~(line[:-1] & line[1:])] = 0.0
        vertices = np.vstack([ends[:1, 0], ends[:, 1]])
        corner = _corners(vertices[:, : self.linear], line, angle, allowed, self.corner_angle)
        rise = angle * np.minimum(lengths[:-1], lengths[1:]) / 8.0
        gentle = batch.free[1:] & ~batch.apart[1:] & ~corner & (rise < RISE * np.minimum(allowed[:-1], allowed[1:]))
        batch = replace(batch, corner=np.append(batch.corner[:1], corner))
        short = line & (lengths > 0.0) & (lengths < LONG * allowed)
        end, runs = known, []
        top = count if last else known + 1
        for low, high in _stretches(short[past:top], gentle[past : top - 1]):
            a, b = past + low, past + high
            if b > known:  # it may go on
                b = a + (known - a) // MOST * MOST
                end = b
            runs += _runs(lengths, a, b)
        keep = max(end - ARM_LINES, 0)
        self._waiting, self._past = (None, 0) if last else (batch.part(keep, count), end - keep)
        stretches = [(low - past, high - past) for low, high in runs]
        return self._fitted(batch.part(past, end), vertices[past : end + 1], lengths[past:end], stretches)

    def _fitted(
        self, batch: LineBatch, vertices: Array, lengths: Array, waiting: list[tuple[int, int]]
    ) -> LineBatch | None:
        """The curves, splines in place of runs; where none is near enough a run is cut."""
        starts, line = np.ones(len(batch), dtype=bool), batch.line.copy()
        curves: list[NurbsCurve] = []
        places: list[int] = []
        while waiting:
            a, b = waiting.pop()
            curve, worst = self._spline(vertices[a : b + 1], lengths[a:b], float(batch.allowed[a:b].min()))
            if curve is not None:
                starts[a + 1 : b] = line[a] = False
                places.append(a)
                curves.append(curve)
            elif b - a >= 2 * LEAST:
                cut = min(max(a + worst, a + LEAST), b - LEAST)
                waiting += [(cut, b), (a, cut)]
        self.fits += len(curves)
        if not curves:
            return batch if len(batch) else None
        at = np.flatnonzero(starts)
        spent, index, new = batch.spent[at], at.copy(), np.searchsorted(at, places)
        spent[new] = FIT + THIN
        index[new] = len(batch) + np.arange(len(curves))
        flat = Flat.joined([batch.flat, Flat.of(curves)]).chosen(index)
        return replace(batch, line=line).standing(flat, at, spent)

    def _spline(self, vertices: Array, lengths: Array, allowed: float) -> tuple[NurbsCurve | None, int]:
        """The spline near lines between vertices (n + 1, axes), or None and the line at which it is furthest off."""
        linear = self.linear
        counts = np.clip(np.ceil(SAMPLES * lengths / lengths.mean()), SAMPLES, MOST_SAMPLES).astype(np.int64)
        owner = np.repeat(np.arange(len(lengths)), counts)
        share = (np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[owner]
        start = np.concatenate([[0.0], np.cumsum(lengths)])
        points = np.vstack([vertices[owner] + share[:, None] * np.diff(vertices, axis=0)[owner], vertices[-1:]])
        s = np.append(start[owner] + share * lengths[owner], start[-1])
        weights = np.append(lengths[owner] / counts[owner], 0.0)
        middle = points[0].copy()
        coefficients, knots, worst = fit_run(s, points - middle, weights, linear, FIT * allowed, FIT * self.angular)
        line = int(owner[min(worst, len(owner) - 1)])
        if coefficients is None:
            return None, line
        slopes = np.diff(coefficients[:, :linear], axis=0)
        if np.any(np.sum(slopes[1:] * slopes[:-1], axis=1) <= 0.0):
            return None, line  # it may turn back, which the lines do not
        coefficients += middle
        coefficients[0], coefficients[-1] = vertices[0], vertices[-1]
        for array in (knots, coefficients):
            array.setflags(write=False)
        return NurbsCurve.trusted(DEGREE, knots, coefficients), line


def _between(batch: LineBatch, vertices: Array, at: IntArray) -> LineBatch:
    """The curves of a batch, lines between the vertices `at`, which begin with the first and end with the last."""
    first, length = at[:-1], np.diff(at)
    flat = batch.flat if len(first) == len(batch) else batch.flat.chosen(first)
    lines = np.flatnonzero(batch.line[first])
    points = flat.points.copy()
    place = flat.point_starts[lines]
    points[place], points[place + 1] = vertices[first[lines]], vertices[at[lines + 1]]
    spent = np.maximum(np.maximum.reduceat(batch.spent, first), np.where(length > 1, THIN, 0.0))
    return batch.standing(replace(flat, points=points), first, spent)


def _corners(vertices: Array, lines: BoolArray, angle: Array, allowed: Array, corner_angle: float) -> BoolArray:
    """Joints (n - 1,) between lines that turn by more than the angle, both between the lines and between arms."""
    sharp = np.flatnonzero(angle > corner_angle)
    corner = np.zeros(len(angle), dtype=bool)
    if not len(sharp):
        return corner
    arms = []
    for way in (-1, 1):
        at = sharp + 1
        tip = at + way
        for k in range(2, ARM_LINES + 1):
            further = at + way * k
            line = np.minimum(further, further - way)  # the line between the last tip and the next one
            inside = (line >= 0) & (line < len(lines))
            inside &= lines[np.clip(line, 0, len(lines) - 1)]
            reached = np.linalg.norm(vertices[tip] - vertices[at], axis=1) >= ARM * allowed[sharp]
            tip = np.where(inside & ~reached & (tip == further - way), further, tip)
        arms.append(way * (vertices[tip] - vertices[at]))
    corner[sharp] = angles(arms[0], arms[1]) > corner_angle
    return corner


def _runs(lengths: Array, low: int, high: int) -> list[tuple[int, int]]:
    """First line and line behind the last of every run of at least LEAST and at most MOST lines of a stretch.

    Lines that are too long for a run are runs of their own where several stand together.
    """
    runs = []
    for a in range(low, high, MOST):
        part = lengths[a : min(a + MOST, high)]
        even = part <= LONGER * np.median(part)
        for chosen in (even, ~even):
            found = _stretches(chosen, np.ones(len(part) - 1, dtype=bool))
            runs += [(a + i, a + k) for i, k in found if k - i >= LEAST]
    return sorted(runs)


def _stretches(chosen: BoolArray, joined: BoolArray) -> list[tuple[int, int]]:
    """First and behind the last of every stretch of two or more `chosen` (n,) with `joined` (n - 1,) between them."""
    together = np.zeros(len(chosen) + 1, dtype=np.int8)
    together[1:-1] = chosen[:-1] & chosen[1:] & joined
    change = np.diff(together)
    return list(zip(np.flatnonzero(change == 1).tolist(), (np.flatnonzero(change == -1) + 1).tolist(), strict=True))


def fit_run(
    s: Array, points: Array, weights: Array, linear: int, allowed: float, angular: float
) -> tuple[Array | None, Array, int]:
    """Coefficients (n + 5, axes) and knots of the spline near samples (count, axes) at s (count,), and the worst one.

    Spans are halved where a sample is further than `allowed`, mm, from C(s), or `angular`, rad, over the axes behind
    the linear ones. No coefficients if that needs spans with fewer than FEWEST samples.
    """
    most, grid, worst = max(len(s) // FEWEST, 1), s[[0, -1]], 0
    for _ in range(ROUNDS):
        knots = np.concatenate([[grid[0]] * DEGREE, grid, [grid[-1]] * DEGREE])
        try:
            coefficients, off, span = least_squares(s, points, weights, knots)
        except LinAlgError:  # samples leave a coefficient open
            break
        norms = [np.linalg.norm(off[:, part], axis=1) for part in (slice(linear), slice(linear, None))]
        share = np.maximum(norms[0] / allowed, norms[1] / angular)
        found = int(np.argmax(share))
        worst = found if share[found] > 0.0 else worst
        if share[found] <= 1.0:
            return coefficients, knots, worst
        wide = np.zeros(len(grid) - 1, dtype=bool)
        wide[span[share > 1.0]] = True
        if np.any(np.bincount(span, minlength=len(wide))[wide] < 2 * FEWEST):
            break
        grid = graded(halved(grid, wide), grade=GRADE)
        if len(grid) - 1 > most:
            break
    return None, knots, worst


def least_squares(s: Array, points: Array, weights: Array, knots: Array) -> tuple[Array, Array, IntArray]:
    """B-spline coefficients (n, axes) with the least sum of weights |C(s) - points|^2, through both end points.

    Also C(s) - points (count, axes), and the span of each sample (count,). Normal equations by Cholesky's method;
    LinAlgError where samples leave a coefficient open.
    """
    design = BSpline.design_matrix(s, knots, DEGREE)
    coefficients = np.zeros((design.shape[1], points.shape[1]))
    coefficients[[0, -1]] = points[[0, -1]]
    weighted = design.multiply(weights[:, None]).T.tocsr()
    normal, right = weighted @ design, weighted @ (points - design @ coefficients)
    band = np.array([np.pad(normal.diagonal(-d), (0, d)) for d in range(DEGREE + 1)])  # [d, k] is row k + d, column k
    factor = cholesky_banded(band[:, 1:-1], lower=True, check_finite=False)
    if np.any(factor[0] ** 2 <= OPEN * band[0, 1:-1]):
        raise LinAlgError("samples leave a coefficient open")
    coefficients[1:-1] = cho_solve_banded((factor, True), right[1:-1], check_finite=False)
    return coefficients, design @ coefficients - points, design.indices[:: DEGREE + 1]
