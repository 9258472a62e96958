"""A file that is read part by part: paths too long to be held in memory."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from splinefeed.errors import FormatError
from splinefeed.files.sizes import MAX_MOVES
from splinefeed.files.source import count_lines
from splinefeed.formats import registry
from splinefeed.paths.path import Path

#: Lines of the longest file that `splinefeed run` reads as a whole.
MOST_LINES = MAX_MOVES


@dataclass(frozen=True)
class PathParts:
    """A path whose parts are made each time that it is iterated over; each begins where the one before ends.

    axes       of all parts; name, findings  as a Path has them; those of its parts are empty
    count      how many moves or points the file holds, in the `unit` that is counted
    feeds      highest finite feed that a curve says, mm/s, and whether any says none; None where feeds are not said
    tolerance  largest tolerance that a curve says, mm; None where none says any
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

    tool_path = joint_path = linking = None

    @property
    def in_parts(self) -> PathParts:
        """This path: its parts come one after the other."""
        return self

    @property
    def feed_range(self) -> tuple[float, bool] | None:
        """Highest finite feed of its curves, mm/s, and whether some have none; see `Path`."""
        return self.feeds

    def __iter__(self) -> Iterator[Path]:
        return self.make()


def read_parts(source: str | os.PathLike[str], **options: Any) -> PathParts:
    """The one path in a file of G-code or a table of points, part by part, in memory that does not grow with the file.

    options  as for `read`: dialect, start, offsets, tools and repair for G-code. The points of a table are joined by
             straight lines: `smooth_stream` makes curves of them within a tolerance.
    The parts are those of `read`, curve for curve, for G-code. Raises FormatError for other files, and for what `read`
    would not read; of a table only while its parts are made.
    Lengths in mm, feeds in mm/s. Source: docs/scale.md.
    Example: `sf.write(path, "part.nc"); sum(part.length for part in sf.formats.read_parts("part.nc"))`
    """
    found, read = _parted(source)
    if read is None:
        raise FormatError(
            f"{source}: {found.title} is read as a whole; G-code and tables of points can be read in parts"
        )
    known = registry.options_of(getattr(found.load(), "from_file", read))
    found.check_options(known, options)
    return read(pathlib.Path(source), **options)


def too_long(source: str | os.PathLike[str]) -> bool:
    """Whether a file that can be read part by part has more than MOST_LINES lines."""
    if not os.path.isfile(source) or os.path.getsize(source) <= MOST_LINES:
        return False
    return _parted(source)[1] is not None and count_lines(source) > MOST_LINES


def _parted(source: str | os.PathLike[str]) -> tuple[registry.Format, Callable[..., PathParts] | None]:
    """The format of a file, and `in_parts` of its module, if it has that."""
    found = registry.format_of(source, any_size=True)
    return found, getattr(found.load(), "in_parts", None)
