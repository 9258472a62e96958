"""Rows taken by the clock of this computer, one a period, and kept nowhere: to watch a motion in real time."""

from __future__ import annotations

import threading
import time
from collections import deque

import numpy as np

from splinefeed.live.sink import Rows, Taken
from splinefeed.records import Array

#: How often the end of the rows is looked for, s.
LOOK = 0.005


class ClockSink:
    """A consumer that takes a row each period from the first one on, and waits on the last where there is none.

    An underrun is a period that wanted a row and had none; the clock then goes on from where it stopped.
    """

    paced = True

    def __init__(self) -> None:
        self._rows: deque[Array] = deque()  # written and not taken
        self._lock = threading.Lock()
        self._period = 0.0
        self._next = 0.0  # when the next row is due, s of the monotonic clock
        self._at = np.zeros(0)
        self._row = self._underruns = 0
        self._last = False

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        """Begin: the axes are where the first row is."""
        self._period, self._at = period, start
        self._next = time.monotonic() + period
        return start

    def write(self, rows: Rows) -> None:
        """Take more rows."""
        with self._lock:
            self._pass()
            self._rows.extend(rows.position)
            self._last = rows.last

    def depth(self) -> int:
        """Rows that are not due yet."""
        with self._lock:
            self._pass()
            return len(self._rows)

    def taken(self) -> Taken:
        """The row that the axes are at."""
        with self._lock:
            self._pass()
            return Taken(self._row, self._underruns)

    def now(self) -> tuple[int, Array]:
        """The row that was taken last, 0 before the first, and its position (axes,)."""
        with self._lock:
            self._pass()
            return self._row, self._at

    def close(self) -> Taken:
        """Wait until the last row is taken."""
        while self.depth():
            time.sleep(min(LOOK, self._period))
        return self.taken()

    def abandon(self) -> None:
        """Forget what is not taken."""
        with self._lock:
            self._rows.clear()

    def _pass(self) -> None:
        """Take the rows that have fallen due."""
        now = time.monotonic()
        while self._rows and self._next <= now:
            self._at = self._rows.popleft()
            self._row += 1
            self._next += self._period
        if not self._rows and self._next <= now:
            late = int((now - self._next) / self._period) + 1
            if self._row and not self._last:
                self._underruns += late
            self._next += late * self._period
