"""Rows as text: to a file in the layout of `halstreamer`, whole or not at all, or to a pipe as they come."""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack
from typing import TextIO

from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.setpoints_halstreamer import cfg
from splinefeed.live.sink import Rows, Taken
from splinefeed.records import Array


class TextSink:
    """Rows as lines of text on a stream that is open, such as stdout; its reader sets the pace by reading."""

    paced = False

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream
        self._row = 0

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        """Say what the columns are in a comment."""
        self._put(
            f"# row {' '.join(axes)} last   (cfg={cfg(axes)}, one row every {period:.17g} s, last row repeated)\n"
        )
        return start

    def write(self, rows: Rows) -> None:
        """Write the lines, and wait until they are gone."""
        self._put(rows.text())
        self._row = rows.first + len(rows) - 1

    def _put(self, text: str) -> None:
        assert self._stream is not None
        self._stream.write(text)
        self._stream.flush()

    def depth(self) -> int:
        """0: what is written is gone."""
        return 0

    def taken(self) -> Taken:
        """All that was written."""
        return Taken(self._row)

    def restart(self) -> None:
        """Never needed: the reader waits."""

    def abandon(self) -> None:
        """What was written stays."""

    def close(self) -> Taken:
        """Nothing is left to wait for."""
        return Taken(self._row)


class FileSink(TextSink):
    """A file that appears under its name when the stream has ended."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        super().__init__()
        self._path = path
        self._stack = ExitStack()

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        """Begin under a temporary name."""
        temporary = self._stack.enter_context(atomic_write(self._path))
        self._stream = self._stack.enter_context(temporary.open("w", encoding="ascii", newline="\n"))
        return super().open(axes, period, start)

    def abandon(self) -> None:
        """Take the temporary file away."""
        self._stack.__exit__(*sys.exc_info())

    def close(self) -> Taken:
        """Put the file in its place."""
        self._stack.close()
        return super().close()
