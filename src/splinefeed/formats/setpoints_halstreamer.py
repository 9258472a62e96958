"""Setpoints as the text that LinuxCNC's `halstreamer` feeds to a HAL streamer component, one row a servo period.

A row is `row x y ... last` between blanks: the number of the row from 1, the axes (mm, rotary ones in degrees) with 17
digits, so that doubles arrive unchanged, and a bit that is 1 on the last row. There is no time: the thread that takes
the rows must have the period that the comment above them names; a plan whose last step is a short one says so
before it. `#` in the first column begins a comment.

The last row appears twice: a ring that holds `depth` rows does not deliver the very last one if the number of rows is a
multiple of `depth` (hal_stream_depth() of LinuxCNC 2.9 is one too small once the ring has wrapped). What can get lost
so is the repetition; and where it does arrive, the axes hold their position.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TextIO

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.metadata import axis_units, checked_chunks, to_degrees, write_rows
from splinefeed.records import Array, Setpoints

#: The options of the layout: a column with the number of the row, one with the bit of the last row, and how often
#: the last row is said again.
ROW_NUMBER = True
LAST_FLAG = True
REPEATED_LAST_ROWS = 1
#: Fields that a streamer component takes.
MAX_FIELDS = 21
#: A last step that differs from the period by more than this part of it is worth a comment.
SHORT = 1e-6


def save(record: Setpoints | Iterable[Setpoints], path: str | os.PathLike[str]) -> None:
    """Write setpoints, whole or as an iterable of chunks of which only one is in memory at a time."""
    rows = 0
    end: Array | None = None
    before = step = period = 0.0
    with atomic_write(path) as temporary, temporary.open("w", encoding="ascii", newline="\n") as stream:
        for chunk in checked_chunks(record, path):
            if len(chunk) == 0:
                continue
            position = to_degrees(chunk.position, chunk.axes)
            if end is None:
                stream.write(_head(chunk, path))
            else:
                _write_rows(stream, rows, end[None])
                rows += 1
            _write_rows(stream, rows, position[:-1])
            rows += len(chunk) - 1
            end = position[-1]
            step, period = chunk.t[-1] - (chunk.t[-2] if len(chunk) > 1 else before), chunk.period
            before = chunk.t[-1]
        assert end is not None  # checked_chunks refuses to give none
        if rows and abs(step - period) > SHORT * period:
            stream.write(f"# the plan takes {step:.9g} s for the last step, the streamer one period\n")
        for _ in range(1 + REPEATED_LAST_ROWS):
            _write_rows(stream, rows, end[None], last=True)
            rows += 1


def cfg(axes: tuple[str, ...]) -> str:
    """The letters of the streamer's `cfg=` for these axes: u for the row, f for each axis, b for the last flag."""
    return "u" * ROW_NUMBER + "f" * len(axes) + "b" * LAST_FLAG


def _head(first: Setpoints, path: object) -> str:
    fields = cfg(first.axes)
    if len(fields) > MAX_FIELDS:
        raise FormatError(f"{path}: {len(fields)} fields a row; a streamer takes at most {MAX_FIELDS}")
    axes = [f"{axis}_{unit}" for axis, unit in zip(first.axes, axis_units(first.axes, "deg"), strict=True)]
    names = " ".join([*["row"] * ROW_NUMBER, *axes, *["last"] * LAST_FLAG])
    return f"# {names}   (cfg={fields}, one row every {first.period:.17g} s, last row repeated)\n"


def _write_rows(stream: TextIO, before: int, position: Array, *, last: bool = False) -> None:
    """Rows for position (n, axes), the first of them number before + 1."""
    count = len(position)
    number, flag = [np.arange(before + 1, before + count + 1)] * ROW_NUMBER, [np.full(count, last)] * LAST_FLAG
    columns = [*number, *position.T, *flag]
    write_rows(stream, columns, " ", whole=[k for k, each in enumerate(columns) if each.dtype != np.float64])
