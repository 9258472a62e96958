"""Setpoints to and from CSV: 17 significant digits, metadata in lines that begin with #, rotary axes in degrees."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable
from typing import Any, TextIO

import numpy as np

from splinefeed.errors import FormatError, SplinefeedError
from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.metadata import (
    COLUMNS,
    check_all_finite,
    checked_chunks,
    column_names,
    description,
    read_description,
    to_degrees,
    to_radians,
    write_rows,
)
from splinefeed.formats.sizes import MAX_TICKS
from splinefeed.formats.source import check_file
from splinefeed.records import Array, Setpoints

_TITLE = "# splinefeed setpoints"
_METADATA = "# metadata: "
#: The last line: without it a file that was cut off between two lines would pass for a whole one.
_END = "# end: {} ticks"
#: More than the longest last line.
_TAIL_BYTES = 64


def save(record: Setpoints | Iterable[Setpoints], path: str | os.PathLike[str]) -> None:
    """Write setpoints, whole or as an iterable of chunks of which only one is in memory at a time."""
    ticks = 0
    with atomic_write(path) as temporary, temporary.open("w", encoding="ascii", newline="\n") as stream:
        for chunk in checked_chunks(record, path):
            if ticks == 0:
                stream.write(_head(chunk))
            places = to_degrees(chunk.position, chunk.axes).T
            write_rows(stream, [chunk.t, chunk.curve, chunk.u, chunk.s, chunk.feed, *places], ",", whole=(1,))
            ticks += len(chunk)
        stream.write(_END.format(ticks) + "\n")


def load(path: str | os.PathLike[str]) -> Setpoints:
    """Read setpoints that `save` wrote; FormatError for a file that is cut off, changed, or something else."""
    file = check_file(path)
    try:
        with file.open(encoding="ascii") as stream:
            ticks = _ticks_at_end(stream, path)
            metadata = _read_metadata(stream, path)
            names = _column_names(metadata["axes"])
            if stream.readline().rstrip("\n") != names:
                raise FormatError(f"{path}: line 3: expected the column names {names}")
            rows = np.loadtxt(stream, delimiter=",", ndmin=2)
            points = _points(rows, metadata, ticks, path)
            check_all_finite(points)
    except FormatError:
        raise
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror or error}") from None
    except SplinefeedError as error:
        raise FormatError(f"{path}: {error}") from None
    except (ValueError, KeyError, TypeError, RecursionError, MemoryError) as error:
        reason = str(error).split(";")[0] or type(error).__name__  # behind the ; NumPy explains its own options
        raise FormatError(f"{path}: is not a valid file of setpoints: {reason}") from None
    return points


def _head(first: Setpoints) -> str:
    return f"{_TITLE}\n{_METADATA}{json.dumps(description(first, 'deg'))}\n{_column_names(first.axes)}\n"


def _column_names(axes: tuple[str, ...]) -> str:
    return ",".join(column_names(axes, "deg"))


def _ticks_at_end(stream: TextIO, path: object) -> int:
    """Number of ticks that the last line states; leaves the stream at its beginning."""
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, size - _TAIL_BYTES))
    match = re.search(r"\n# end: ([0-9]{1,12}) ticks\n\Z", stream.read())
    stream.seek(0)
    if stream.readline(len(_TITLE) + 1).rstrip("\n") != _TITLE:
        raise FormatError(f"{path}: line 1: expected {_TITLE!r}; was this written by splinefeed?")
    if match is None:
        raise FormatError(f"{path}: the last line does not say where the setpoints end; the file looks cut off")
    ticks = int(match[1])
    if not 0 < ticks <= MAX_TICKS:
        raise FormatError(f"{path}: the last line claims {ticks} ticks; 1 to {MAX_TICKS} can be read")
    return ticks


def _read_metadata(stream: TextIO, path: object) -> dict[str, Any]:
    line = stream.readline()
    if not line.startswith(_METADATA):
        raise FormatError(f"{path}: line 2: expected {_METADATA!r}")
    return read_description(line[len(_METADATA) :], f"{path}: line 2")


def _points(rows: Array, metadata: dict[str, Any], ticks: int, path: object) -> Setpoints:
    axes = metadata["axes"]
    expected = (ticks, len(COLUMNS) + len(axes))
    if rows.shape != expected:
        raise FormatError(f"{path}: has {rows.shape} rows and columns; expected {expected}")
    t, curve, u, s, feed = rows[:, : len(COLUMNS)].T
    if not np.array_equal(curve, np.floor(curve)) or not np.all(np.abs(curve) < 2.0**31):
        raise FormatError(f"{path}: column curve: holds something other than whole numbers")
    return Setpoints(
        t=t,
        curve=curve.astype(np.int64),
        u=u,
        s=s,
        feed=feed,
        position=to_radians(np.ascontiguousarray(rows[:, len(COLUMNS) :]), axes),
        **metadata,
    )
