"""What readers of drawings share: pieces on layers become paths, and what was left out becomes findings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from splinefeed import units
from splinefeed.errors import FormatError, InputError
from splinefeed.formats.sizes import MAX_COORDINATE, MAX_DRAWING_CURVES, MAX_DRAWING_POINTS
from splinefeed.geometry.chaining import Chain, chain, copies
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.overlaps import overlaps
from splinefeed.geometry.path import JOIN_TOLERANCE, Path
from splinefeed.records import Array, IntArray

#: A drawing whose z is nowhere farther from 0 than this share of its size is flat: its paths have axes x and y.
FLAT = 1e-12
#: How many kinds or places a finding names.
NAMED = 8
#: Units that an option may name, in mm.
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8, "mil": 0.0254, "um": 0.001}


@dataclass
class Drawing:
    """Pieces in file order: the curves of each, joined end to end, mm, and its name; and what there is to say."""

    source: str
    pieces: list[list[NurbsCurve]] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    findings: list[str] = field(default_factory=list)
    left_out: Counter[str] = field(default_factory=Counter)
    curves: int = 0
    points: int = 0

    def add(self, curves: list[NurbsCurve], name: str) -> None:
        """One more piece; FormatError when there are too many."""
        self.curves += len(curves)
        self.points += sum(len(curve.control_points) for curve in curves)
        if self.curves > MAX_DRAWING_CURVES or self.points > MAX_DRAWING_POINTS:
            raise FormatError(
                f"{self.source}: has more than {MAX_DRAWING_CURVES} curves or {MAX_DRAWING_POINTS} control points; "
                f"choose layers, or split the drawing"
            )
        self.pieces.append(curves)
        self.names.append(name)

    def paths(self, stem: str, tolerance: float, repair: bool) -> list[Path]:
        """The pieces as paths: those whose ends meet are one; see `geometry.chaining`. FormatError without any."""
        if self.left_out:
            self.findings.append(f"left out: {counted(self.left_out)}")
        if not self.pieces:
            why = f" ({self.findings[-1]})" if self.findings else ""
            raise FormatError(f"{self.source}: holds no curves{why}")
        pieces, names = self._without_z(), self.names
        ends = np.array([[piece[0].ends[0], piece[-1].ends[1]] for piece in pieces])
        pools = self._copies(pieces, ends, repair)
        if repair and pools.any():
            kept = np.flatnonzero(pools == 0)
            pieces, names, ends = [pieces[i] for i in kept], [names[i] for i in kept], ends[kept]
            pools = pools[kept]
        found = chain(ends, tolerance, pools)
        self.findings += found.findings
        self._say_overlaps([piece for piece, pool in zip(pieces, pools.tolist(), strict=True) if not pool], names)
        moved = _Moves(tolerance)
        runs = [_run(pieces, each, moved) for each in found.chains]
        if moved.count:
            self.findings.append(
                f"{many(moved.count, 'joint had a gap', 'joints had gaps')} of up to {moved.widest:.3g} mm; "
                f"ends were moved together, each by half of its gap"
            )
        findings = tuple(self.findings)
        lone = len(runs) == 1
        axes = ("x", "y", "z")[: ends.shape[2]]
        return [
            Path(run, axes, name=stem if lone else f"{names[each.pieces[0]]}#{i}", findings=findings)
            for i, (run, each) in enumerate(zip(runs, found.chains, strict=True), start=1)
        ]

    def _without_z(self) -> list[list[NurbsCurve]]:
        """The pieces, without their z where the drawing is flat; FormatError for points too far out for a workpiece."""
        every = np.concatenate([curve.control_points for piece in self.pieces for curve in piece])
        near = np.abs(every).max(axis=1) <= MAX_COORDINATE
        if not near.all():
            owners = [
                name
                for piece, name in zip(self.pieces, self.names, strict=True)
                for c in piece
                for _ in c.control_points
            ]
            raise FormatError(
                f"{self.source}: a curve of {owners[int(np.argmin(near))]!r} goes beyond {MAX_COORDINATE:g} mm; "
                "check the units and the transforms"
            )
        if every.shape[1] == 2 or np.abs(every[:, 2]).max() > FLAT * np.ptp(every[:, :2], axis=0).max():
            return self.pieces
        flat = np.ascontiguousarray(every[:, :2])
        flat.setflags(write=False)
        pieces, row = [], 0
        for piece in self.pieces:
            curves = []
            for curve in piece:
                count = len(curve.control_points)
                points = flat[row : row + count]
                curves.append(
                    NurbsCurve.trusted(curve.degree, curve.knots, points, curve.weights, clamped=curve.clamped)
                )
                row += count
            pieces.append(curves)
        return pieces

    def _say_overlaps(self, pieces: list[list[NurbsCurve]], names: list[str]) -> None:
        """A finding for lines and arcs that lie on others in part; what is to become of them is not to be guessed."""
        shared = overlaps(pieces, JOIN_TOLERANCE)
        if shared is not None:
            begin, end = (", ".join(f"{value:.6g}" for value in place.tolist()) for place in (shared.begin, shared.end))
            self.findings.append(
                f"{many(shared.count, 'line or arc lies', 'lines or arcs lie')} on others in part, the first from "
                f"({begin}) to ({end}) in {names[shared.piece]!r}; they are left as drawn and cut twice there"
            )

    def _copies(self, pieces: list[list[NurbsCurve]], ends: Array, repair: bool) -> IntArray:
        """(n,) how many earlier pieces lie exactly where this one does, run through either way."""
        rounded = np.round(ends.reshape(len(ends), -1) / JOIN_TOLERANCE) + 0.0
        width = rounded.shape[1] // 2
        swapped = np.concatenate([rounded[:, width:], rounded[:, :width]], axis=1)
        column = np.argmax(rounded != swapped, axis=1)
        rows = np.arange(len(rounded))
        swap = rounded[rows, column] > swapped[rows, column]
        rounded[swap] = swapped[swap]
        _, group, counts = np.unique(rounded, axis=0, return_inverse=True, return_counts=True)
        suspects = np.flatnonzero(counts[group.ravel()] > 1)
        pools = np.zeros(len(pieces), dtype=np.int64)
        pools[suspects] = copies([_key(pieces[i]) for i in suspects])
        twice = np.flatnonzero(pools)
        if twice.size:
            fate = "copies are left out" if repair else "each copy is a separate path"
            place = ", ".join(f"{value:.6g}" for value in ends[twice[0], 0].tolist())
            self.findings.append(
                f"{many(twice.size, 'curve lies', 'curves lie')} exactly on others, the first from ({place}) "
                f"in {self.names[twice[0]]!r}; {fate}"
            )
        return pools


def counted(kinds: Counter[str]) -> str:
    """Kinds and their numbers, the most frequent first, for a finding."""
    most = kinds.most_common()
    shown = ", ".join(f"{count} {kind}" for kind, count in most[:NAMED])
    rest = most[NAMED:]
    return shown + (f" and {sum(count for _, count in rest)} of {len(rest)} other kinds" if rest else "")


def many(count: int, one: str, several: str) -> str:
    """The count and the words for one or for several, for a finding."""
    return f"{count} {one if count == 1 else several}"


def runs_that_meet(curves: Iterable[NurbsCurve]) -> list[list[NurbsCurve]]:
    """Runs of neighbouring curves whose ends meet."""
    runs: list[list[NurbsCurve]] = []
    for curve in curves:
        if runs and np.linalg.norm(curve.ends[0] - runs[-1][-1].ends[1]) <= JOIN_TOLERANCE:
            runs[-1].append(curve)
        else:
            runs.append([curve])
    return runs


def unit_in_mm(name: str) -> float:
    """How many mm the unit `name` of an option is; InputError for one that is not known."""
    if name not in MILLIMETRES:
        raise InputError(f"units {name!r} are not known; choose one of {', '.join(MILLIMETRES)}")
    return MILLIMETRES[name]


def join_tolerance(tolerance: float | str) -> float:
    """The option `tolerance` of a drawing in mm."""
    allowed = units.parse(tolerance, "length")
    if not allowed >= 0.0:
        raise InputError(f"tolerance is {allowed:g} mm; it must be 0 or more")
    return allowed


def layers_from(layer: str | Sequence[str] | None) -> list[str]:
    """The names in the option `layer`: a list, or one text with commas between them."""
    if layer is None:
        return []
    names: Iterable[str] = layer.split(",") if isinstance(layer, str) else layer
    return [name.strip() for name in names if name.strip()]


class _Moves:
    """How wide gaps may be that are closed by moving ends, mm, how many were, and the widest of them, mm."""

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self.count = 0
        self.widest = 0.0


def _run(pieces: list[list[NurbsCurve]], each: Chain, moved: _Moves) -> list[NurbsCurve]:
    """The curves of a chain, turned where they run backwards, and moved together at joints wider than a path's."""
    curves: list[NurbsCurve] = []
    for i, backwards in zip(each.pieces, each.backwards, strict=True):
        piece = pieces[i]
        curves += [curve.reversed() for curve in reversed(piece)] if backwards else piece
    if moved.tolerance <= JOIN_TOLERANCE or len(each.pieces) == 1:
        return curves
    # the last joint is the one of a closed path
    for before, after in [*pairwise(range(len(curves))), (len(curves) - 1, 0)]:
        left, right = curves[before].ends[1], curves[after].ends[0]
        gap = float(np.linalg.norm(right - left))
        if not JOIN_TOLERANCE < gap <= moved.tolerance:
            continue
        middle = 0.5 * (left + right)
        curves[before] = _with_end(curves[before], -1, middle)
        curves[after] = _with_end(curves[after], 0, middle)
        moved.count += 1
        moved.widest = max(moved.widest, gap)
    return curves


def _with_end(curve: NurbsCurve, index: int, place: Array) -> NurbsCurve:
    whole = curve.with_clamped_ends()
    points = whole.control_points.copy()
    points[index] = place
    return NurbsCurve(whole.degree, whole.knots, points, whole.weights)


def _key(piece: list[NurbsCurve]) -> bytes:
    """The same for pieces of the same shape, whichever way they are run through."""
    grids = [np.round(curve.control_points / JOIN_TOLERANCE) + 0.0 for curve in piece]
    there = b"".join(grid.tobytes() for grid in grids)
    back = b"".join(np.ascontiguousarray(grid[::-1]).tobytes() for grid in reversed(grids))
    return min(there, back)
