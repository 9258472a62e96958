"""Setpoints as the text that LinuxCNC's `halstreamer` feeds to a HAL streamer component, one row a servo period.

A row is `row x y ... last` between blanks: the number of the row from 1, the axes (mm, rotary ones in degrees) with 17
digits, so that doubles arrive unchanged, and a bit that is 1 on the last row. There is no time: the thread that takes
the rows must have the period that the comment above them names; a plan whose last step is a short one says so
in another. `#` in the first column begins a comment.

The last row appears twice: a ring that holds `depth` rows does not deliver the very last one if the number of rows is a
multiple of `depth` (hal_stream_depth() of LinuxCNC 2.9 is one too small once the ring has wrapped). What can get lost
so is the repetition; and where it does arrive, the axes hold their position.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from splinefeed.formats.metadata import axis_units, write_rows
from splinefeed.records import Setpoints

#: Fields that a streamer component takes.
MAX_FIELDS = 21
#: A last step that differs from the period by more than this part of it is worth a comment.
SHORT = 1e-6


def write(chunks: Iterable[Setpoints], file: Path) -> None:
    """Write chunks of setpoints."""
    waiting = iter(chunks)
    chunk: Setpoints | None = next(waiting)
    ticks, before = 0, np.empty(0)
    with file.open("w", encoding="ascii", newline="\n") as stream:
        while chunk is not None:
            if ticks == 0:
                stream.write(_head(chunk))
            after = next(waiting, None)
            number, last = np.arange(ticks + 1, ticks + len(chunk) + 1), np.zeros(len(chunk), dtype=np.int64)
            position = chunk.position
            before = np.append(before, chunk.t)[-2:]
            if after is None:
                step = float(before[-1] - before[0])
                if len(before) > 1 and abs(step - chunk.period) > SHORT * chunk.period:
                    stream.write(f"# the plan takes {step:.9g} s for the last step, the streamer one period\n")
                number, last = np.append(number, number[-1] + 1), np.append(last, 1)
                last[-2] = 1
                position = np.vstack([position, position[-1:]])
            write_rows(stream, [number, *position.T, last], " ", whole=(0, 1 + len(chunk.axes)))
            ticks += len(chunk)
            chunk = after


def cfg(axes: tuple[str, ...]) -> str:
    """The letters of the streamer's `cfg=` for these axes: u for the row, f for each axis, b for the last flag."""
    return f"u{'f' * len(axes)}b"


def _head(first: Setpoints) -> str:
    axes = [f"{axis}_{unit}" for axis, unit in zip(first.axes, axis_units(first.axes, "deg"), strict=True)]
    every = f"one row every {first.period:.17g} s, last row repeated"
    return f"# row {' '.join(axes)} last   (cfg={cfg(first.axes)}, {every})\n"
