"""A drawing of several contours as one motion: in which order they are cut, where each begins, and how they are linked.

Inner contours come before those around them, as what is cut loose moves; among those that may be next the one is taken
that begins nearest (a greedy tour). The contours themselves are followed as they are drawn: the offset of a tool's
radius is CAM's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from splinefeed import units
from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.editing import section
from splinefeed.errors import InputError
from splinefeed.paths.each_curve import Marker
from splinefeed.paths.path import JOIN_TOLERANCE, Path
from splinefeed.records import Array, BoolArray, IntArray
from splinefeed.records.arrays import taken

#: Feed of the contours unless one is given, mm/s: that of the paper's experiment.
DEFAULT_FEED = 60.0
#: Places of a knot span that is no line: where a smooth contour may begin, and the polygon that says what is in it.
PLACES = 32
#: A joint that turns by more than this, rad, is a corner, at which a closed contour begins if it has any.
CORNER = 0.02
#: Nearest places that are looked at first; four times as many where none of them may be next.
FIRST_NEAR = 8
#: What switches a laser on and off.
ON, OFF = "M3", "M5"


@dataclass(frozen=True, kw_only=True)
class Linking:
    """How contours become a job; see `job`."""

    clearance: float | None = None
    feed: float | None = None
    keep_order: bool = False
    first: str | int | None = None


class Job(Path):
    """Contours as one path, linked by rapid moves, whose feeds are infinite.

    Parameters
    ----------
    *made : object
        The curves of the path and names of their axes, as for `Path`, that `job` makes.
    contours : sequence of Path
        As they were drawn, mm.
    linking : Linking
        How they are linked.
    order : sequence of int
        Which contour is cut when, (n,).
    **said : object
        name, feeds, ... as for `Path`.

    Raises
    ------
    InputError
        As `job` does.

    References
    ----------
    .. [1] docs/formats.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.paths.job([sf.shapes.butterfly()], clearance=30).job(clearance=20).linking.clearance
    20.0
    """

    def __init__(
        self, *made: Any, contours: Sequence[Path], linking: Linking, order: Sequence[int], **said: Any
    ) -> None:
        self.contours, self.linking, self.order = tuple(contours), linking, tuple(order)
        super().__init__(*made, **said)

    def __reduce__(self) -> tuple[object, ...]:
        more: dict[str, Any] = {"contours": self.contours, "linking": self.linking, "order": self.order}
        return partial(Job, **self._said(), **more), (self.curves, self.axes)

    def job(self, **linking: Any) -> Job:
        """Link the same contours otherwise.

        Parameters
        ----------
        **linking : object
            What changes, as for `job`.

        Returns
        -------
        Job
            Of the same contours.
        """
        return job(self.contours, name=self.name, **linking)


def job(
    contours: Sequence[Path] | Path,
    *,
    clearance: float | str | None = None,
    feed: float | str | None = None,
    keep_order: bool = False,
    first: str | int | None = None,
    name: str | None = None,
) -> Job:
    """Join all contours, or a single one, to one path: inner before outer, nearest next, linked by rapid moves.

    Parameters
    ----------
    contours : Path or sequence of Path
        Of axes x, y and z.
    clearance : float or str, optional
        z of the rapid moves, mm, above all contours; the tool goes down and up at the start and the end of each. None
        for a laser: straight rapid moves with M5 before and M3 behind them.
    feed : float or str, optional
        Of contours that give none, and of going down, mm/s; 60 if it is not given.
    keep_order : bool, optional
        Whether to cut the contours as they come, each from where it is drawn.
    first : str or int, optional
        Name or number (from 1) of the contour to begin with, whatever lies in it.
    name : str, optional
        Of the path.

    Returns
    -------
    Job
        One path. A closed contour begins at the corner that is nearest, one without corners at its nearest place, where
        its curve is split (exactly); an open one at either end. Rapid moves have infinite feeds.

    Raises
    ------
    InputError
        For contours that have other axes than x, y and z, and for a clearance that is not above them.

    References
    ----------
    .. [1] docs/formats.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.paths.job([sf.shapes.circle(radius=10)], clearance=5, feed=20).feeds
    array([20., 20., 20., inf])
    """
    paths = [contours] if isinstance(contours, Path) else list(contours)
    _check(paths)
    linking = Linking(
        clearance=None if clearance is None else units.parse(clearance, "length"),
        feed=None if feed is None else units.parse(feed, "feed"),
        keep_order=keep_order,
        first=first,
    )
    if linking.feed is not None and not linking.feed > 0.0:
        raise InputError(f"feed is {linking.feed:g} mm/s; it must be greater than 0")
    begin = None if first is None else _number(paths, first)
    if keep_order:
        order = [*range(len(paths))]
        if begin is not None:
            order = [begin, *(i for i in order if i != begin)]
        runs = [(i, _run_of(paths[i])) for i in order]
    else:
        runs = _ordered(paths, begin)
    return _linked(runs, paths, linking, paths[0].name if name is None else name)


def _check(paths: Sequence[Path]) -> None:
    if not paths:
        raise InputError("a job needs at least one contour")
    for path in paths:
        if path.axes != paths[0].axes or path.axes not in (("x", "y"), ("x", "y", "z")) or path._tied:
            raise InputError(
                f"path {path.name!r} has axes {' '.join(path.axes)}: only contours in x and y, or x, y and z, are "
                "linked to one motion; choose one path (option path)"
            )


def _number(paths: Sequence[Path], first: str | int) -> int:
    """Which contour is called `first`."""
    names, said = [each.name for each in paths], str(first)
    if said in names:
        return names.index(said)
    if said.isascii() and said.isdigit() and 1 <= int(said[:9]) <= len(paths):
        return int(said[:9]) - 1
    raise InputError(f"first: there is no contour {said[:40]!r}; there are 1 to {len(paths)}, or their names")


# --- where a contour may begin, and what lies in it -------------------------------------------------------------------


class _Run(NamedTuple):
    """A contour from where it begins in the job: its curves with what is said of them, its first and last point."""

    curves: Sequence[NurbsCurve]
    feeds: Array | None
    tolerances: Array | None
    markers: Sequence[Marker]
    start: Array
    end: Array


def _run_of(path: Path) -> _Run:
    return _Run(path.curves, path.feeds, path.tolerances, path.markers, path.ends[0, 0], path.ends[-1, 1])


class _Contour:
    """A contour's polygon, and the places at which it may begin."""

    def __init__(self, path: Path) -> None:
        self.path, self.closed = path, path.closed
        samples = [_places(curve) for curve in path.curves]
        self.curve = np.repeat(np.arange(len(samples)), [len(u) for u, _ in samples])
        self.u = np.concatenate([u for u, _ in samples])
        self.points = np.concatenate([points for _, points in samples])
        self.plane = np.ascontiguousarray(self.points[:, :2])
        self.low, self.high = self.plane.min(axis=0), self.plane.max(axis=0)
        # markers of a program stand at places: a path with any begins where it does
        free = self.closed and not path.markers
        self.starts = self._corners() if free else np.array([0])
        x, y = self.plane.T
        self.area = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) if self.closed else 0.0

    def _corners(self) -> IntArray:
        """Numbers of the samples at which it may begin: its corners, or all of them where it has none."""
        after = np.roll(self.points, -1, axis=0) - self.points
        after /= np.maximum(np.linalg.norm(after, axis=1), 1e-300)[:, None]
        turn = np.arccos(np.clip(np.sum(after * np.roll(after, 1, axis=0), axis=1), -1.0, 1.0))
        # the polygon turns at every place of a curve: a corner is where it turns by more than its neighbours do
        corner = turn > CORNER + 1.5 * np.maximum(np.roll(turn, 1), np.roll(turn, -1)) * self._curved()
        found = np.flatnonzero(corner)
        return found if found.size else np.arange(len(self.points))

    def _curved(self) -> Array:
        """(n,) 1 where a side of the polygon before or behind a sample stands for a curve, 0 where lines meet."""
        bent = np.array([not _straight(curve) for curve in self.path.curves])[self.curve]
        return np.where(bent | np.roll(bent, 1), 1.0, 0.0)

    def entries(self) -> tuple[Array, list[int]]:
        """Places at which the contour may begin, (k, axes), and what names each: a sample, or -1 for its other end."""
        if self.closed or self.path.markers:
            return self.points[self.starts], self.starts.tolist()
        ends = np.stack([self.path.ends[0, 0], self.path.ends[-1, 1]])
        return ends, [0, -1]

    def begun(self, entry: int) -> _Run:
        """The contour from an entry on."""
        if entry <= 0:
            return _run_of(self.path.reversed() if entry < 0 else self.path)
        at, u = int(self.curve[entry]), float(self.u[entry])
        curves, path = list(self.path.curves), self.path
        numbers = [*range(at, len(curves)), *range(at)]
        turned = [curves[i] for i in numbers]
        low, high = turned[0].domain
        if low < u < high:
            turned = [section(turned[0], u, high), *turned[1:], section(turned[0], low, u)]
            numbers.append(at)
        feeds, tolerances = (None if each is None else each[numbers] for each in (path.feeds, path.tolerances))
        return _Run(turned, feeds, tolerances, (), self.points[entry], self.points[entry])


def _straight(curve: NurbsCurve) -> bool:
    return curve.degree == 1 and not curve.rational


def _places(curve: NurbsCurve) -> tuple[Array, Array]:
    """Parameters and points of a curve: its start, and places inside each span of one that is no line."""
    breaks = curve.breaks
    if _straight(curve):
        u = breaks[:-1]
    else:
        u = (breaks[:-1, None] + np.diff(breaks)[:, None] * np.arange(PLACES) / PLACES).ravel()
    return u, curve(u)


def _inside(points: Array, polygon: Array) -> IntArray:
    """How often a ray from each point (n, 2) to the right crosses the sides of a polygon (m, 2)."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    a, b = a[a[:, 1] != b[:, 1]], b[a[:, 1] != b[:, 1]]
    x, y = points[:, :1], points[:, 1:]
    across = (a[:, 1] > y) != (b[:, 1] > y)
    at = a[:, 0] + (y - a[:, 1]) * ((b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1]))
    return np.asarray(np.count_nonzero(across & (x < at), axis=1), dtype=np.int64)


def _nested(contours: Sequence[_Contour]) -> tuple[list[list[int]], IntArray]:
    """For each contour those around it, and how many lie in it; one whose points lie in another, most of them, does."""
    low, high = np.array([each.low for each in contours]), np.array([each.high for each in contours])
    area = np.array([each.area for each in contours])
    around: list[list[int]] = [[] for _ in contours]
    within = np.zeros(len(contours), dtype=np.int64)
    by_x = np.argsort(low[:, 0], kind="stable")
    sorted_x = low[by_x, 0]
    for outer, each in enumerate(contours):
        if each.area <= 0.0:
            continue
        near = by_x[np.searchsorted(sorted_x, each.low[0]) : np.searchsorted(sorted_x, each.high[0], "right")]
        fits = (low[near] >= each.low).all(axis=1) & (high[near] <= each.high).all(axis=1)
        near = near[fits & (area[near] < each.area)]
        if not near.size:
            continue
        picked = [contours[i].plane[np.linspace(0, len(contours[i].plane) - 1, 5).astype(int)] for i in near]
        points = np.concatenate(picked)
        crossings = np.concatenate([
            _inside(points[k : k + 256], each.plane) for k in range(0, len(points), 256)
        ])  # fmt: skip
        for i, odd in zip(near.tolist(), (crossings.reshape(-1, 5) % 2).sum(axis=1).tolist(), strict=True):
            if odd >= 3:
                around[i].append(outer)
                within[outer] += 1
    return around, within


# --- in which order ---------------------------------------------------------------------------------------------------


class _Starts:
    """Places at which contours begin that are not cut yet, in a tree; the nearest one to a place."""

    def __init__(self, contours: Sequence[_Contour]) -> None:
        entries = [each.entries() for each in contours]
        self._places = np.concatenate([points for points, _ in entries])
        self._entry = np.concatenate([names for _, names in entries])
        self._contour = np.repeat(np.arange(len(entries)), [len(names) for _, names in entries])
        self._left = np.ones(len(entries), dtype=bool)
        self._tree: Any = None

    def nearest(self, place: Array, may: BoolArray) -> tuple[int, int]:
        """The contour that begins nearest to a place, of those that may be next, (contours,), and where; it is cut."""
        from scipy.spatial import cKDTree

        left = self._left[self._contour]
        if self._tree is None or 2 * np.count_nonzero(left) < len(left):
            self._places, self._entry, self._contour = self._places[left], self._entry[left], self._contour[left]
            self._tree = cKDTree(self._places)
        may, near, count = may & self._left, np.zeros(0, dtype=np.int64), FIRST_NEAR
        while not len(near):
            apart, near = map(np.atleast_1d, self._tree.query(place, k=min(count, len(self._contour))))
            apart, near = taken(may[self._contour[near]], apart, near)
            count *= 4
        first = near[apart == apart[0]].min()  # of those that are as near, the first that is drawn
        contour, entry = int(self._contour[first]), int(self._entry[first])
        self._left[contour] = False
        return contour, entry


def _ordered(paths: Sequence[Path], begin: int | None) -> list[tuple[int, _Run]]:
    """Contours in the order of the job, each from where it begins; `begin` is the first one if it is given."""
    contours = [_Contour(path) for path in paths]
    around, within = _nested(contours)
    starts, place = _Starts(contours), np.zeros(len(paths[0].axes))
    runs: list[tuple[int, _Run]] = []
    for step in range(len(contours)):
        first = step == 0 and begin is not None
        i, entry = starts.nearest(place, np.arange(len(contours)) == begin if first else within == 0)
        runs.append((i, contours[i].begun(entry)))
        place = runs[-1][1].end
        within[around[i]] -= 1
    return runs


# --- one path ---------------------------------------------------------------------------------------------------------


def _line(a: Array, b: Array) -> NurbsCurve:
    return NurbsCurve(1, [0.0, 0.0, 1.0, 1.0], np.stack([a, b]))


def _linked(runs: Sequence[tuple[int, _Run]], contours: Sequence[Path], linking: Linking, name: str) -> Job:
    """The contours in their order as one path, with the rapid moves between them."""
    high = linking.clearance
    feed = DEFAULT_FEED if linking.feed is None else linking.feed
    flat = len(contours[0].axes) == 2
    if high is not None:
        top = 0.0 if flat else max(float(path.flat.points[:, 2].max()) for path in contours)
        if not high > top:
            raise InputError(f"clearance is {high:g} mm; it must be above the contours, whose z reaches {top:g} mm")
    axes = ("x", "y") if flat and high is None else ("x", "y", "z")
    curves: list[NurbsCurve] = []
    feeds: list[float] = []
    markers: list[Marker] = []
    said: list[Array] = []
    tip: Array | None = None

    def add(*lines: tuple[Array, Array, float]) -> None:
        for a, b, rate in lines:
            if np.linalg.norm(b - a) > JOIN_TOLERANCE:
                curves.append(_line(a, b))
                feeds.append(rate)
                said.append(np.zeros(1))

    def above(point: Array) -> Array:
        return np.array([*point[:2], high])

    def lead(to: Array | None) -> None:
        """From where the last contour ended to where the next one begins, of which there may be none."""
        if tip is not None and to is not None and np.linalg.norm(to - tip) <= JOIN_TOLERANCE:
            return
        if high is not None:
            add(*([] if tip is None else [(tip, above(tip), math.inf)]))
            if to is not None:
                add(*([] if tip is None else [(above(tip), above(to), math.inf)]), (above(to), to, feed))
            return
        markers.extend([] if tip is None else [Marker(len(curves), OFF)])
        if to is not None:
            add(*([] if tip is None else [(tip, to, math.inf)]))
            markers.append(Marker(len(curves), ON))

    for _, run in runs:
        placed = [curve if curve.axes == len(axes) else curve.transformed(np.eye(3)[:, :2]) for curve in run.curves]
        start, end = (np.append(point, [0.0] * (len(axes) - len(point))) for point in (run.start, run.end))
        lead(start)
        markers += [replace(marker, before=marker.before + len(curves)) for marker in run.markers]
        curves += placed
        feeds += [feed] * len(placed) if run.feeds is None else run.feeds.tolist()
        said.append(np.zeros(len(placed)) if run.tolerances is None else run.tolerances)
        tip = end
    lead(None)
    findings = [each for path in contours for each in path.findings]
    return Job(
        curves,
        axes,
        name=name,
        findings=list(dict.fromkeys([*findings, *_said(len(runs), curves, feeds, linking, feed)])),
        feeds=feeds,
        tolerances=None if all(path.tolerances is None for path in contours) else np.concatenate(said),
        markers=markers,
        tolerance=max(path.tolerance for path in contours),
        contours=contours,
        linking=linking,
        order=[i for i, _ in runs],
    )


def _said(count: int, curves: Sequence[NurbsCurve], feeds: Sequence[float], linking: Linking, feed: float) -> list[str]:
    """What there is to say of a job."""
    rapid = sum(
        float(np.linalg.norm(np.diff(curve.control_points, axis=0)))
        for curve, rate in zip(curves, feeds, strict=True)
        if rate == math.inf and curve.degree == 1
    )
    order = "in the order of the file" if linking.keep_order else "inner before outer, nearest next"
    way = "laser off (M5, M3)" if linking.clearance is None else f"at z {linking.clearance:g} mm"
    found = [f"{count} contours are one motion: {order}; {rapid:.6g} mm of rapid moves between them, {way}"]
    if linking.clearance is None:
        found[0] += "; for a tool give its height there (option clearance)"
    found.append("contours are followed as drawn: the offset of a tool's radius is CAM's")
    if linking.feed is None:
        found.append(f"contours without a feed are cut at {feed:g} mm/s (option feed of job)")
    return found
