"""A path that comes part by part: too long to be held in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from splinefeed.paths.path import Path


@dataclass(frozen=True)
class PathParts:
    """A path whose parts are made each time that it is iterated over; each begins where the one before ends.

    axes       of all parts; name, findings  as a Path has them; those of its parts are empty
    count      how many moves or points the file holds, in the `unit` that is counted
    feeds      highest finite feed that a curve says, mm/s, and whether any says none; None where feeds are not said
    tolerance  largest tolerance that a curve says, mm; None where none says any
    make       gives the parts from the first one on
    Iterating gives each part as a Path. Source: docs/scale.md.
    Example: `sf.write(path, "part.nc"); sf.formats.read_parts("part.nc").axes`
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
