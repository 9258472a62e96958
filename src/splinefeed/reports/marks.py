"""Figures as plain data: panels, axes with units, curves, limits and marks. Backends draw them; nothing here does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from splinefeed.records import Array
from splinefeed.reports import theme

#: A limit farther out than this many times the data is not drawn: it would press the data flat.
FARTHEST_LIMIT = 3.0


@dataclass(frozen=True)
class PlotAxis:
    """An axis of a panel.

    Parameters
    ----------
    label : str
        With the unit.
    low, high : float, optional
        Its ends, where they are not those of the data.
    log : bool, optional
        Whether it has powers of ten.
    """

    label: str
    low: float | None = None
    high: float | None = None
    log: bool = False


@dataclass(frozen=True, eq=False)
class Line:
    """A curve; a NaN breaks it.

    Parameters
    ----------
    x, y : array (n,)
        Its points; of a band x is (n + 1,), the edges between which it lies, and y the least there.
    name : str, optional
        Of the quantity.
    colour : str, optional
        As CSS has it.
    width : float, optional
        In px.
    dash : int, optional
        Number among `theme.DASHES`; 0, or False, is solid.
    named : bool or str, optional
        Whether its name stands in the legend, or a shorter one that does.
    fill : bool, optional
        Whether it is the area within it, on paper.
    high : array (n,), optional
        Of a band, the greatest between the edges.
    """

    x: Array
    y: Array
    name: str = ""
    colour: str = theme.BLUE
    width: float = 1.4
    dash: int = 0
    named: bool | str = False
    fill: bool = False
    high: Array | None = None

    def through(self, function: Callable[[Array], Array]) -> Line:
        """The same of a function of y that never falls."""
        return replace(self, y=function(self.y), high=None if self.high is None else function(self.high))

    @property
    def values(self) -> Array:
        """All that it reaches."""
        return self.y if self.high is None else np.concatenate([self.y, self.high])

    @property
    def rising(self) -> bool:
        """Whether x never falls: a curve over time or another quantity, of which a picture may show the envelope."""
        return bool(np.all(np.diff(self.x) >= 0.0))


@dataclass(frozen=True, eq=False)
class Dots:
    """Single points x, y (n,), and z in space, with a word beside each, or words for the page alone."""

    x: Array
    y: Array
    name: str = ""
    words: tuple[str, ...] = ()
    colour: str = theme.VERMILION
    size: float = 6.0
    named: bool | str = False
    z: tuple[Array, ...] = ()
    hover: tuple[str, ...] = ()

    @property
    def values(self) -> Array:
        """All that they reach."""
        return self.y


@dataclass(frozen=True)
class Level:
    """A dashed line across a panel at a value, such as a limit; upright: at a value of x. Near data only, or always."""

    value: float
    text: str = ""
    colour: str = theme.VERMILION
    upright: bool = False
    always: bool = False


@dataclass(frozen=True, eq=False)
class Shades:
    """Values (n,) that colour a path, with label and unit, and the ends of the scale."""

    values: Array
    label: str
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Coloured:
    """A path, coloured by a quantity.

    Parameters
    ----------
    place : array (n, 2 or 3)
        Its points, mm.
    shades : mapping of str to Shades
        Quantities to choose from, the first one shown.
    hover : array (n, k)
        What each point says of itself.
    names : tuple of str
        Of these k values.
    thread : array (m, 2 or 3)
        Where the path runs.
    joined : bool, optional
        Whether the points follow each other; else they are dots on the thread.
    rapid : array (k, 2 or 3), optional
        Where rapid moves run, which are dashed; rows of NaN part them, and `place` is NaN there.
    track : tuple of array, optional
        Times (j,), s, where the tool is then (j, 2 or 3), every tick of it, and 1 where a rapid move led there, else 0
        (j,); for a page that plays the motion.
    arm : tuple of array, optional
        Times (k,), s, and an arm then as lines (k, points, 3), from its base to its tip.
    """

    place: Array
    shades: Mapping[str, Shades]
    hover: Array
    names: tuple[str, ...]
    thread: Array
    joined: bool = True
    rapid: Array | None = None
    track: tuple[Array, Array, Array] | None = None
    arm: tuple[Array, Array] | None = None


@dataclass(frozen=True, eq=False)
class Heat:
    """A strip of colour for each row: share (n, rows) from 0 to 1 at x (n,); of more than pixels the greatest counts.

    Of a band the greatest share between edges x (n + 1,).
    """

    x: Array
    rows: tuple[str, ...]
    share: Array
    label: str

    def columns(self, count: int) -> tuple[Array, Array]:
        """Edges (k + 1,) of at most so many even columns of x, and the greatest share (rows, k) in each.

        A column without a point has that of the one before.
        """
        x, count = self.x, max(min(count, len(self.x) - 1), 1)
        edges = np.linspace(x[0], x[-1], count + 1)
        column = np.clip(np.searchsorted(edges, x[: len(self.share)], "right") - 1, 0, count - 1)
        starts = np.flatnonzero(np.diff(column, prepend=-1))
        greatest = np.maximum.reduceat(self.share, starts, axis=0)
        return edges, greatest[np.searchsorted(column[starts], np.arange(count), "right") - 1].T


Mark = Line | Dots | Level | Coloured | Heat


@dataclass(frozen=True, eq=False)
class Panel:
    """One pair of axes with marks.

    Parameters
    ----------
    x, y : PlotAxis
        Its axes.
    marks : tuple of Mark
        Curves, dots, levels, paths and heat maps.
    note : str, optional
        A few words beside the label.
    height : int, optional
        In px.
    equal : bool, optional
        Whether x and y have one scale.
    z : str, optional
        Label of the third axis of a path in space.
    """

    x: PlotAxis
    y: PlotAxis
    marks: tuple[Mark, ...]
    note: str = ""
    height: int = 150
    equal: bool = False
    z: str = ""

    def of(self, kind: Any) -> list[Any]:
        """Its marks of one kind, or of some: `Line | Dots`."""
        return [mark for mark in self.marks if isinstance(mark, kind)]

    def legend(self) -> list[tuple[str, Line | Dots]]:
        """The curves that stand in the legend, and how they are called there."""
        found = [mark for mark in self.of(Line | Dots) if mark.named]
        return [(mark.name if mark.named is True else mark.named, mark) for mark in found]

    def levels(self, *, drawn: bool = True) -> list[Level]:
        """The levels that are drawn, near the data; or upper limits that are too far out for that."""
        near = FARTHEST_LIMIT * max((peak(mark.values)[1] for mark in self.of(Line | Dots)), default=0)
        found = [level for level in self.of(Level) if np.isfinite(level.value)]
        if drawn:
            return [each for each in found if each.always or abs(each.value) <= near]
        return [each for each in found if not each.always and each.value > near]


@dataclass(frozen=True, eq=False)
class FigureData:
    """Panels below each other, or in columns; those with the same x label share that axis and its cursor.

    Parameters
    ----------
    title : str
        Above the panels.
    panels : tuple of Panel
        Each with its axes and marks.
    columns : int, optional
        How many stand beside each other.
    legend : bool, optional
        Whether curves of one name in all panels are one, and the page has a legend to choose from.
    width : int, optional
        In px.
    """

    title: str
    panels: tuple[Panel, ...]
    columns: int = 1
    legend: bool = False
    width: int = 730


def peak(values: Array) -> tuple[int, float]:
    """Index and size of the largest |value| that is finite; (0, 0.0) if none is."""
    if not len(values):
        return 0, 0.0
    sizes = np.where(np.isfinite(values), np.abs(values), 0.0)
    at = int(np.argmax(sizes))
    return at, float(sizes[at])
