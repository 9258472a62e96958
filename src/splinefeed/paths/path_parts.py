"""A path that comes part by part: too long to be held in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from splinefeed.paths.path import Path


@dataclass(frozen=True)
class PathParts:
    """A path whose parts are made each time that it is iterated over; each begins where the one before ends.

    Parameters
    ----------
    axes : tuple of str
        Of all parts.
    name : str
        As a Path has it.
    make : callable
        Gives the parts, each a Path, from the first one on.
    count : int
        How many moves or points the file holds.
    unit : str
        What is counted.
    feeds : (float, bool), optional
        Highest finite feed that a curve gives, mm/s, and whether any gives none; None where feeds are not given.
    tolerance : float, optional
        Largest tolerance that a curve gives, mm; None where none gives any.
    findings : tuple of str, optional
        As a Path has them; those of its parts are empty.

    References
    ----------
    .. [1] docs/scale.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> notes = sf.write(sf.Path.polyline([[0, 0], [5, 0], [5, 5]]), "part.nc")
    >>> parts = sf.formats.read_parts("part.nc")
    >>> [len(part.curves) for part in parts], parts.axes
    ([2], ('x', 'y'))
    """

    name: str
    axes: tuple[str, ...]
    count: int
    unit: str
    make: Callable[[], Iterator[Path]]
    findings: tuple[str, ...] = ()
    feeds: tuple[float, bool] | None = None
    tolerance: float | None = None

    needs_machine, linking = False, None

    @property
    def in_parts(self) -> PathParts:
        """The path itself: its parts come one after the other."""
        return self

    @property
    def feed_range(self) -> tuple[float, bool] | None:
        """Highest finite feed of its curves, mm/s, and whether some have none; see `Path`."""
        return self.feeds

    def __iter__(self) -> Iterator[Path]:
        return self.make()
