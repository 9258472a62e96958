"""Setpoints to and from CSV: 17 significant digits, metadata in lines that begin with #, rotary axes in degrees."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.formats.metadata import COLUMNS, column_names, description, write_rows
from splinefeed.formats.sizes import MAX_TICKS
from splinefeed.records import Setpoints

TITLE = "# splinefeed setpoints"
_METADATA = "# metadata: "
#: More than the longest last line, bytes.
_TAIL = 64


def write(chunks: Iterable[Setpoints], file: Path) -> None:
    """Write chunks of setpoints."""
    ticks = 0
    with file.open("w", encoding="ascii", newline="\n") as stream:
        for chunk in chunks:
            if ticks == 0:
                names = ",".join(column_names(chunk.axes, "deg"))
                stream.write(f"{TITLE}\n{_METADATA}{json.dumps(description(chunk, 'deg'))}\n{names}\n")
            columns = [getattr(chunk, name) for name in COLUMNS]
            write_rows(stream, [*columns, *chunk.position.T], ",", whole=(1,))
            ticks += len(chunk)
        # without it a file that was cut off between two lines would pass for a whole one
        stream.write(f"# end: {ticks} ticks\n")


def read(file: Path) -> tuple[dict[str, Any], Any]:
    """Columns and description of a file that `write` wrote."""
    with file.open("rb") as tail:
        tail.seek(-min(_TAIL, file.stat().st_size), 2)
        end = re.search(rb"\n# end: ([0-9]{1,12}) ticks\n\Z", tail.read())
    with file.open(encoding="ascii") as stream:
        if stream.readline() != f"{TITLE}\n":
            raise InputError(f"line 1: expected {TITLE!r}; was this written by splinefeed?")
        line = stream.readline()
        if not line.startswith(_METADATA):
            raise InputError(f"line 2: expected {_METADATA!r}")
        said = json.loads(line.removeprefix(_METADATA))
        names = column_names(said["axes"], "deg")
        if stream.readline().strip() != ",".join(names):
            raise InputError(f"line 3: expected the column names {','.join(names)}")
        if end is None or int(end[1]) > MAX_TICKS:
            raise InputError("the last line does not say how many setpoints there are; the file looks cut off")
        rows = np.loadtxt(stream, delimiter=",", ndmin=2)
    if rows.shape != (int(end[1]), len(names)):
        raise InputError(f"has {rows.shape} rows and columns; expected {(int(end[1]), len(names))}")
    columns = dict(zip(COLUMNS, rows.T, strict=False))
    if not np.array_equal(columns["curve"], columns["curve"].astype(np.int32)):
        raise InputError("column curve: holds something other than whole numbers")
    return {**columns, "position": rows[:, len(COLUMNS) :]}, said
