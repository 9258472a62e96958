"""Files that are read part by part: their paths are too long to be held in memory."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Callable
from typing import Any

from splinefeed.errors import FormatError
from splinefeed.files.sizes import MAX_MOVES
from splinefeed.files.source import count_lines
from splinefeed.formats import registry
from splinefeed.paths.path_parts import PathParts

#: Lines of the longest file that `splinefeed run` reads as a whole.
MOST_LINES = MAX_MOVES


def read_parts(source: str | os.PathLike[str], **options: Any) -> PathParts:
    """Read the one path in a file of G-code or a table of points part by part; memory does not grow with the file.

    Parameters
    ----------
    source : path
        The file.
    **options : object
        As for `read`: dialect, start, offsets, tools and repair for G-code.

    Returns
    -------
    PathParts
        Of G-code those of `read`, curve for curve; lengths in mm, feeds in mm/s. The points of a table are joined by
        straight lines: `smooth_stream` makes curves of them within a tolerance.

    Raises
    ------
    FormatError
        For other files, and for what `read` would not read; of a table only while its parts are made.
    InputError
        For an option that the format does not have.

    References
    ----------
    .. [1] docs/scale.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> _ = sf.write(sf.Path.polyline([[0, 0], [10, 0]]), "part.nc", feed=10)
    >>> [part.length for part in sf.formats.read_parts("part.nc")]
    [10.0]
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
    """Tell whether a file that can be read part by part has more than MOST_LINES lines."""
    if not os.path.isfile(source) or os.path.getsize(source) <= MOST_LINES:
        return False
    return _parted(source)[1] is not None and count_lines(source) > MOST_LINES


def _parted(source: str | os.PathLike[str]) -> tuple[registry.Format, Callable[..., PathParts] | None]:
    """The format of a file, and `in_parts` of its module, if it has that."""
    found = registry.format_of(source, any_size=True)
    return found, getattr(found.load(), "in_parts", None)
