"""A drawing of several contours as one motion: in which order they are cut, where each begins, and how they are linked.

Inner contours come before those around them, as what is cut loose moves; among those that may be next the one is taken
that begins nearest (a greedy tour). The contours themselves are followed as they are drawn: the offset of a tool's
radius is CAM's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from splinefeed import units
from splinefeed.curves.editing import section
from splinefeed.errors import InputError
from splinefeed.kernels.layout import HIGH, LOW
from splinefeed.paths.each_curve import Marker, chosen_of_each
from splinefeed.paths.parts import in_a_row
from splinefeed.paths.path import JOIN_TOLERANCE, Path
from splinefeed.records import Array, BoolArray, IntArray
from splinefeed.records.arrays import expanded, taken

#: Feed of the contours unless one is given, mm/s: that of the paper's experiment.
DEFAULT_FEED = 60.0
#: Places of a knot span that is no line: where a smooth contour may begin, and the polygon that says what is in it.
PLACES = 32
#: A joint that turns by more than this, rad, is a corner, at which a closed contour begins if it has any.
CORNER = 0.02
#: Nearest places that are looked at first; four times as many where none of them may be next.
FIRST_NEAR = 8
#: Points of a contour by which it lies in another one: most of them do.
LOOKED_AT = 5
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
    kept = sorted(enumerate(paths), key=lambda each: each[0] != begin)
    runs = kept if keep_order else _ordered(paths, begin)
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


class _Contour:
    """A contour's polygon, and the places at which it may begin."""

    def __init__(self, path: Path) -> None:
        self.path, self.closed = path, path.closed
        pieces, flat = path.span_pieces, path.flat
        owner = np.repeat(np.arange(len(flat)), pieces.rows[:, 1] - pieces.rows[:, 0] + 1)
        bent = (flat.degrees > 1) | (flat.rational > 0)
        piece, number = expanded(np.where(bent[owner], PLACES, 1))
        low, high = pieces.table[piece, LOW], pieces.table[piece, HIGH]
        self.curve, self.u = owner[piece], low + (high - low) * number / PLACES
        self.bent, self.points = bent[self.curve], path.evaluate(self.curve, self.u)[:, 0]
        self.plane = np.ascontiguousarray(self.points[:, :2])
        self.low, self.high = self.plane.min(axis=0), self.plane.max(axis=0)
        x, y = self.plane.T
        self.area = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) if self.closed else 0.0

    def _corners(self) -> IntArray:
        """Numbers of the samples at which it may begin: its corners, or all of them where it has none."""
        after = np.roll(self.points, -1, axis=0) - self.points
        after /= np.maximum(np.linalg.norm(after, axis=1), 1e-300)[:, None]
        turn = np.arccos(np.clip(np.sum(after * np.roll(after, 1, axis=0), axis=1), -1.0, 1.0))
        # the polygon turns at every place of a curve: a corner is where it turns by more than its neighbours do
        curved = self.bent | np.roll(self.bent, 1)  # the polygon stands for a curve before or behind it
        corner = turn > CORNER + 1.5 * np.maximum(np.roll(turn, 1), np.roll(turn, -1)) * curved
        found = np.flatnonzero(corner)
        return found if found.size else np.arange(len(self.points))

    def entries(self) -> tuple[Array, list[int]]:
        """Places at which the contour may begin, (k, axes), and what names each: a sample, or -1 for its other end."""
        if self.path.markers:  # those of a program stand at places: it begins where it does
            return self.points[:1], [0]
        if not self.closed:
            return np.stack([self.path.ends[0, 0], self.path.ends[-1, 1]]), [0, -1]
        starts = self._corners()
        return self.points[starts], starts.tolist()

    def begun(self, entry: int) -> Path:
        """The contour from an entry on."""
        path = self.path
        if entry <= 0:
            return path.reversed() if entry < 0 else path
        at, u = int(self.curve[entry]), float(self.u[entry])
        count = len(path.curves)
        numbers = np.arange(at, at + count) % count
        turned = [path.joined[i] for i in numbers.tolist()]
        low, high = turned[0].domain
        if low < u < high:
            turned = [section(turned[0], u, high), *turned[1:], section(turned[0], low, u)]
            numbers = np.append(numbers, at)
        return Path(turned, path.axes, **{**chosen_of_each(path._said(), numbers), "times": None})


def _inside(points: Array, polygon: Array) -> BoolArray:
    """Whether each point (n, 2) is inside a polygon (m, 2): a ray to the right crosses an odd number of its sides."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    a, b = a[a[:, 1] != b[:, 1]], b[a[:, 1] != b[:, 1]]
    x, y = points[:, :1], points[:, 1:]
    across = (a[:, 1] > y) != (b[:, 1] > y)
    at = a[:, 0] + (y - a[:, 1]) * ((b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1]))
    return np.asarray(np.count_nonzero(across & (x < at), axis=1) % 2 == 1)


def _nested(contours: Sequence[_Contour]) -> tuple[list[list[int]], IntArray]:
    """For each contour those around it, and how many lie in it; one whose points lie in another, most of them, does."""
    low, high = np.array([each.low for each in contours]), np.array([each.high for each in contours])
    area = np.array([each.area for each in contours])
    around: list[list[int]] = [[] for _ in contours]
    within = np.zeros(len(contours), dtype=np.int64)
    for outer, each in enumerate(contours):
        fits = (low >= each.low).all(axis=1) & (high <= each.high).all(axis=1) & (area < each.area)
        for i in np.flatnonzero(fits).tolist():
            plane = contours[i].plane
            some = plane[np.linspace(0, len(plane) - 1, LOOKED_AT).astype(int)]
            if 2 * np.count_nonzero(_inside(some, each.plane)) > LOOKED_AT:
                around[i].append(outer)
                within[outer] += 1
    return around, within


# --- in which order ---------------------------------------------------------------------------------------------------


def _ordered(paths: Sequence[Path], begin: int | None) -> list[tuple[int, Path]]:
    """Contours in the order of the job, each from where it begins; `begin` is the first one if it is given.

    The next one is that of the nearest place at which one may begin that is not cut yet and has none left in it.
    """
    from scipy.spatial import cKDTree

    contours = [_Contour(path) for path in paths]
    around, within = _nested(contours)
    starts = [each.entries() for each in contours]
    places, entry = (np.concatenate(each) for each in zip(*starts, strict=True))
    owner = np.repeat(np.arange(len(contours)), [len(entries) for _, entries in starts])
    tree, left, place = cKDTree(places), np.ones(len(contours), dtype=bool), np.zeros(len(paths[0].axes))
    runs: list[tuple[int, Path]] = []
    for step in range(len(contours)):
        there = left[owner]
        if 2 * np.count_nonzero(there) < len(there):
            places, entry, owner = places[there], entry[there], owner[there]
            tree = cKDTree(places)
        may = np.arange(len(contours)) == begin if step == 0 and begin is not None else left & (within == 0)
        near, count = np.zeros(0, dtype=np.int64), FIRST_NEAR
        while not len(near):
            apart, near = map(np.atleast_1d, tree.query(place, k=min(count, len(owner))))
            apart, near = taken(may[owner[near]], apart, near)
            count *= 4
        first = near[apart == apart[0]].min()  # of those that are as near, the first that is drawn
        i = int(owner[first])
        runs.append((i, contours[i].begun(int(entry[first]))))
        place, left[i] = runs[-1][1].ends[-1, 1], False
        within[around[i]] -= 1
    return runs


# --- one path ---------------------------------------------------------------------------------------------------------


def _linked(runs: Sequence[tuple[int, Path]], contours: Sequence[Path], linking: Linking, name: str) -> Job:
    """The contours in their order as one path, with the rapid moves between them."""
    high, axes = linking.clearance, contours[0].axes
    if high is not None:
        top = 0.0 if len(axes) == 2 else max(float(path.flat.points[:, 2].max()) for path in contours)
        if not high > top:
            raise InputError(f"clearance is {high:g} mm; it must be above the contours, whose z reaches {top:g} mm")
        axes = ("x", "y", "z")
    feed = DEFAULT_FEED if linking.feed is None else linking.feed
    parts: list[Path] = []
    tip: Array | None = None
    for _, run in runs:
        feeds = np.full(len(run.joined), feed) if run.feeds is None else run.feeds
        if run.axes == axes:
            part = run.with_feeds(feeds)
        else:
            part = Path(run.joined.transformed(np.eye(3)[:, :2]), axes, **{**run._said(), "feeds": feeds})
        parts += [*_lead(tip, part.ends[0, 0], axes, high, feed), part]
        tip = part.ends[-1, 1]
    parts += _lead(tip, None, axes, high, feed)
    curves, said = in_a_row(parts)
    if high is None:
        said["markers"] = [Marker(0, ON), *said["markers"], Marker(len(curves), OFF)]
    rapid = float(np.sum(curves.flat.sizes()[np.isinf(said["feeds"]) & (curves.flat.degrees == 1)]))
    findings = [each for path in contours for each in path.findings]
    said["findings"] = list(dict.fromkeys([*findings, *_said(len(runs), rapid, linking, feed)]))
    return Job(curves, axes, name=name, contours=contours, linking=linking, order=[i for i, _ in runs], **said)


def _lead(tip: Array | None, to: Array | None, axes: tuple[str, ...], high: float | None, feed: float) -> list[Path]:
    """The path, if any, from where one contour ends to where the next one begins, of which there may be none."""
    if tip is not None and to is not None and np.linalg.norm(to - tip) <= JOIN_TOLERANCE:
        return []
    if high is None:
        if tip is None or to is None:
            return []
        laser = (Marker(0, OFF), Marker(1, ON))
        return [Path.polyline(np.stack([tip, to]), axes, feeds=[math.inf], markers=laser)]
    points = np.array([
        *([] if tip is None else [tip, [*tip[:2], high]]),
        *([] if to is None else [[*to[:2], high], to]),
    ])  # fmt: skip
    feeds = np.full(len(points) - 1, math.inf)
    if to is not None:
        feeds[-1] = feed
    long = np.linalg.norm(np.diff(points, axis=0), axis=1) > JOIN_TOLERANCE
    return [Path.polyline(points[np.append(True, long)], axes, feeds=feeds[long])] if long.any() else []


def _said(count: int, rapid: float, linking: Linking, feed: float) -> list[str]:
    """What there is to say of a job."""
    order = "in the order of the file" if linking.keep_order else "inner before outer, nearest next"
    way = "laser off (M5, M3)" if linking.clearance is None else f"at z {linking.clearance:g} mm"
    found = [f"{count} contours are one motion: {order}; {rapid:.6g} mm of rapid moves between them, {way}"]
    if linking.clearance is None:
        found[0] += "; for a tool give its height there (option clearance)"
    found.append("contours are followed as drawn: the offset of a tool's radius is CAM's")
    if linking.feed is None:
        found.append(f"contours without a feed are cut at {feed:g} mm/s (option feed of job)")
    return found
