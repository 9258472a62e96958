"""What drawings share: pieces on layers become paths, what was left out becomes findings; what cannot be written."""

from __future__ import annotations

import math
import os
import pathlib
from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from splinefeed import units
from splinefeed.curves.arcs import moved
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import InputError
from splinefeed.files.sizes import MAX_COORDINATE, MAX_DRAWING_CURVES, MAX_DRAWING_POINTS
from splinefeed.formats.same_contours import on_others
from splinefeed.paths.chaining import chain
from splinefeed.paths.contents import Contents
from splinefeed.paths.gaps import moved_ends
from splinefeed.paths.path import JOIN_TOLERANCE, Path
from splinefeed.records import ROTARY_AXES, Array, IntArray

#: A drawing whose z is nowhere farther from 0 than this share of its size, or than paths resolve, is flat: its paths
#: have axes x and y.
FLAT = 1e-12
#: Ends join that differ by this many units of the last decimal that a file writes, if it writes so many at least: a
#: point rounded twice differs by one in each coordinate. No decimal is larger than this, mm.
LAST_DIGITS, LEAST_DECIMALS, COARSEST = 1.5, 2, 0.01
#: Open ends nearer than this share of the drawing are said.
CLOSE = 1e-3
_FLAT_AXES = np.eye(3)[:2]
#: Columns of a drawing's coordinates by the names of axes; others stand where they come.
_PLACES = {"x": 0, "y": 1, "z": 2}
#: How many kinds a finding names, and how many faults have a finding each when repairing.
NAMED, NAMED_FAULTS = 8, 20
DASHED = "element with a dashed stroke, which is read without gaps"
BROKEN = "spline with a knot of multiplicity degree + 1, at which it may jump; it is the pieces between, exactly"


class Drawing:
    """Collect what a reader finds in a drawing; errors do not name the file.

    Parameters
    ----------
    file : path
        The drawing.
    tolerance : float, str or None
        Ends within it join, mm; None for what the decimals of the file allow.
    repair : bool
        Whether faults are findings.
    layer : str or sequence of str, optional
        Layers to read: names, or what is between commas; none for all.
    hidden : bool, optional
        Whether what the author's program does not show is read all the same.

    Attributes
    ----------
    pieces, names : list
        The curves of each piece in file order, joined end to end, mm, and its name.
    layers : sequence of str
        Names of the layers to read.
    notes, left_out : counter
        How many of a kind were read in a way that is worth a finding, or not at all.
    unshown : counter
        How much there is that the author's program does not show.
    """

    def __init__(
        self,
        file: str | os.PathLike[str],
        tolerance: float | str | None,
        repair: bool,
        layer: str | Sequence[str] | None = None,
        hidden: bool = False,
    ) -> None:
        self.file, self.repair = pathlib.Path(file), repair
        self.by_digits = tolerance is None  # joints within what the digits of the file allow
        self.decimals, self.digit = 0, math.inf  # most decimals, and the smallest last one, mm
        self.tolerance = JOIN_TOLERANCE if tolerance is None else units.parse(tolerance, "length")
        if not self.tolerance >= 0.0:
            raise InputError(f"tolerance is {self.tolerance:g} mm; it must be 0 or more")
        names = layer.split(",") if isinstance(layer, str) else layer or ()
        self.layers = [name.strip() for name in names if name.strip()]
        self.wanted = {name.casefold() for name in self.layers}
        self.pieces: list[list[NurbsCurve]] = []
        self.names: list[str] = []
        self.findings: list[str] = []
        self.notes: Counter[str] = Counter()
        self.left_out: Counter[str] = Counter()
        self.hidden, self.unshown = hidden, Counter[str]()
        self.curves = self.points = self.faults = 0

    def add(self, curves: list[NurbsCurve], name: str) -> None:
        """Add one more piece; InputError when there are too many."""
        self.curves += len(curves)
        self.points += sum(len(curve.control_points) for curve in curves)
        if self.curves > MAX_DRAWING_CURVES or self.points > MAX_DRAWING_POINTS:
            raise InputError(
                f"has more than {MAX_DRAWING_CURVES} curves or {MAX_DRAWING_POINTS} control points; "
                f"choose layers, or split the drawing"
            )
        self.pieces.append(curves)
        self.names.append(name)

    def written(self, decimals: int, unit: float) -> None:
        """Note that some places have so many decimals of a `unit`, mm: the last one is how near ends join."""
        if self.by_digits and decimals:
            self.decimals, self.digit = max(self.decimals, decimals), min(self.digit, unit * 10.0**-decimals)

    def reads(self, unseen: str) -> bool:
        """Tell whether something is read; `unseen` is why the author's program does not show it, "" if it does."""
        self.unshown.update([unseen] if unseen else [])
        return self.hidden or not unseen

    def fault(self, text: str, fate: str = "left out") -> None:
        """Raise InputError for a fault; when repairing note it with its `fate`, and after the first ones a number."""
        if not self.repair:
            raise InputError(text)
        self.faults += 1
        if self.faults <= NAMED_FAULTS:
            self.findings.append("; ".join(filter(None, (text, fate))))
        else:
            self.left_out["faulty entity"] += 1

    def add_runs(self, curves: Iterable[NurbsCurve], name: str) -> None:
        """Add a piece for each run of neighbouring curves whose ends meet."""
        run: list[NurbsCurve] = []
        for curve in curves:
            if run and np.linalg.norm(curve.ends[0] - run[-1].ends[1]) > JOIN_TOLERANCE:
                self.add(run, name)
                run = []
            run.append(curve)
        if run:
            self.add(run, name)

    def check_layers(self, there: Iterable[str], kind: str) -> None:
        """Refuse a layer or group to read that is not there, by InputError; capitals count as small letters."""
        known = {name.casefold(): name for name in there}
        for name in self.layers:
            if name.casefold() not in known:
                listed = ", ".join(repr(each) for each in list(known.values())[:12]) or "none"
                raise InputError(f"has no {kind} {name[:40]!r}; there are {listed}")

    def contents(self, unit: str) -> Contents:
        """Return the pieces as paths: those whose ends meet are one, see `paths.chaining`; InputError without any."""
        self.findings += [f"{count} x {kind}" for kind, count in self.notes.items()]
        if self.unshown:
            named = ", ".join(f"{count} {why}" for why, count in self.unshown.most_common(NAMED))
            fate = "read all the same" if self.hidden else "left out (option hidden)"
            self.findings.append(f"not shown in the drawing, {fate}: {named}" + " ..." * (len(self.unshown) > NAMED))
        if self.left_out:
            most = [f"{count} {kind}" for kind, count in self.left_out.most_common()]
            self.findings.append(f"left out: {', '.join(most[:NAMED])}{' and others' * (len(most) > NAMED)}")
        if not self.pieces:
            raise InputError("holds no curves" + (f" ({self.findings[-1]})" if self.findings else ""))
        pieces = self._without_z()
        pools = self._copies(pieces)
        if pools.any():
            fate = "copies are left out" if self.repair else "each copy is a separate path"
            at = int(np.argmax(pools > 0))
            place = ", ".join(f"{value:.6g}" for value in pieces[at][0].ends[0].tolist())
            self.findings.append(
                f"{np.count_nonzero(pools)} curve(s) lie exactly on others, the first from ({place}) in "
                f"{self.names[at]!r}; {fate}"
            )
        kept = np.flatnonzero(pools == 0) if self.repair else np.arange(len(pieces))
        ends = np.array([[pieces[i][0].ends[0], pieces[i][-1].ends[1]] for i in kept])
        if self.decimals >= LEAST_DECIMALS and self.digit <= COARSEST:
            self.tolerance = max(self.tolerance, LAST_DIGITS * self.digit)
        size = float(np.linalg.norm(np.ptp(ends.reshape(-1, ends.shape[2]), axis=0))) if self.by_digits else 0.0
        chains, findings = chain(ends, self.tolerance, pools[kept], CLOSE * size)
        self.findings += findings
        gaps: list[float] = []
        runs = []
        for each in chains:
            run: list[NurbsCurve] = []
            for i, backwards in each:
                piece = pieces[kept[i]]
                run += [curve.reversed() for curve in reversed(piece)] if backwards else piece
            runs.append(_moved_together(run, self.tolerance, gaps) if len(each) > 1 else run)
        if gaps:
            why = ", as far as the decimals of the file leave them apart (option tolerance)" if self.by_digits else ""
            self.findings.append(
                f"{len(gaps)} gap(s) of up to {max(gaps):.3g} mm closed: ends were moved, each by half{why}"
            )
        names = [f"{self.names[kept[each[0][0]]]}#{i}" for i, each in enumerate(chains, start=1)]
        first = [i for i, each in enumerate(chains) if not any(pools[kept[k]] for k, _ in each)]
        twice = on_others([runs[i] for i in first], self.tolerance)
        if twice is None:
            self.findings.append("too many paths look alike to find those that lie on others")
        twice = [(first[i], first[k]) for i, k in twice or []]
        if twice:
            i, other = twice[0]
            fate = "left out" if self.repair else "each is a path of its own"
            self.findings.append(
                f"{len(twice)} path(s) lie on others that are described otherwise, the first {names[i]!r} on "
                f"{names[other]!r}; {fate}"
            )
        again = {i for i, _ in twice} if self.repair else set()
        runs = [run for i, run in enumerate(runs) if i not in again]
        names = [name for i, name in enumerate(names) if i not in again]
        axes = ("x", "y", "z")[: ends.shape[2]]
        if len(runs) == 1:
            names = [self.file.stem]
        made = [Path(run, axes, name=name, findings=self.findings) for run, name in zip(runs, names, strict=True)]
        return Contents(made, unit)

    def _without_z(self) -> list[list[NurbsCurve]]:
        """The pieces, without their z where the drawing is flat; InputError for points too far out for a workpiece."""
        every = np.concatenate([curve.control_points for piece in self.pieces for curve in piece])
        if not np.abs(every).max() <= MAX_COORDINATE:
            near = [all(np.abs(curve.control_points).max() <= MAX_COORDINATE for curve in each) for each in self.pieces]
            name = self.names[near.index(False)]
            raise InputError(f"a curve of {name!r} goes beyond {MAX_COORDINATE:g} mm; check the units and transforms")
        if every.shape[1] == 2:
            return self.pieces
        high = float(np.abs(every[:, 2]).max())
        if high > max(FLAT * np.ptp(every[:, :2], axis=0).max(), JOIN_TOLERANCE):
            return self.pieces
        if high > 0.0:
            self.findings.append(f"z, nowhere more than {high:.2g} mm from 0, is taken as 0")
        return [[moved(curve, _FLAT_AXES, np.zeros(2)) for curve in piece] for piece in self.pieces]

    def _copies(self, pieces: list[list[NurbsCurve]]) -> IntArray:
        """(n,) how many earlier pieces lie exactly where this one does, traversed either way."""
        seen: Counter[bytes] = Counter()
        pools = np.zeros(len(pieces), dtype=np.int64)
        for i, piece in enumerate(pieces):
            points = np.concatenate([curve.control_points for curve in piece])
            grid = np.round(points / JOIN_TOLERANCE) + 0.0
            key = min(grid.tobytes(), grid[::-1].tobytes())
            pools[i] = seen[key]
            seen[key] += 1
        return pools


def _moved_together(curves: list[NurbsCurve], tolerance: float, gaps: list[float]) -> list[NurbsCurve]:
    """The curves, and the last one with the first, moved together where they are farther apart than a path's may be."""
    if tolerance <= JOIN_TOLERANCE:
        return curves
    ends = np.array([curve.ends for curve in curves])
    after = np.roll(ends[:, 0], -1, axis=0)
    gap = np.linalg.norm(after - ends[:, 1], axis=1)
    wide = (gap > JOIN_TOLERANCE) & (gap <= tolerance)
    middle = np.where(wide[:, None], 0.5 * (ends[:, 1] + after), ends[:, 1])
    starts = np.where(np.roll(wide, 1)[:, None], np.roll(middle, 1, axis=0), ends[:, 0])
    gaps += gap[wide].tolist()
    touched = wide | np.roll(wide, 1)
    places = np.stack([starts, middle], axis=1)
    return [moved_ends(curves[i], places[i]) if touched[i] else curves[i] for i in range(len(curves))]


# --- out --------------------------------------------------------------------------------------------------------------


def losses(paths: Sequence[Path], title: str, *, depth: bool = True) -> list[str]:
    """Return a sentence on what `paths` have and a format does not; depth: whether it has a z."""
    rotary = sorted({axis for path in paths for axis in path.axes if axis in ROTARY_AXES})
    deep = not depth and any(
        np.ptp(np.concatenate([three_axes(each.control_points, path)[:, 2] for each in path.curves])) > 0.0
        for path in paths
    )
    lost = {
        f"rotary axes ({', '.join(rotary)})": bool(rotary),
        "z": deep,
        "feeds": any(path.feeds is not None for path in paths),
        "tolerances of smoothing": any(path.tolerances is not None for path in paths),
        "markers": any(path.markers for path in paths),
    }
    found = [what for what, there in lost.items() if there]
    return [f"{title} has no place for these, which are left out: {', '.join(found)}"] if found else []


def three_axes(points: Array, path: Path) -> Array:
    """Return the linear axes of `points` (n, axes) of `path` as x, y, z (n, 3), mm; InputError for more than three."""
    if path.linear > len(_PLACES):
        raise InputError(f"path {path.name!r} has {path.linear} linear axes; a drawing has x, y and z")
    names = path.axes[: path.linear]
    placed = [_PLACES[name] for name in names] if set(names) <= set(_PLACES) else list(range(path.linear))
    out = np.zeros((len(points), len(_PLACES)))
    out[:, placed] = points[:, : path.linear]
    return out
