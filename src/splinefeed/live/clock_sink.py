"""Rows taken by this computer's clock, one a period, and dropped: to watch a motion in real time."""

from __future__ import annotations

import threading
import time
from collections import deque

import numpy as np

from splinefeed.live.sink import Rows, Taken
from splinefeed.records import Array

#: How often the end of the rows is tested, s.
LOOK = 0.005


class ClockSink:
    """A consumer that takes a row each period; if there is none it runs dry and waits.

    fill  rows that must be there before its clock starts, at the beginning and after a restart, or the last one
    """

    paced = True

    def __init__(self, fill: int = 1) -> None:
        self._fill, self._waits = fill, True
        self._rows: deque[Array] = deque()  # written and not taken
        self._lock = threading.Lock()
        self._period = 0.0
        self._next: float | None = None  # when the next row is due, s of the monotonic clock; None while it waits
        self._at = np.zeros(0)
        self._row = self._underruns = 0
        self._last = False

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        """Begin: the axes are where the first row is."""
        self._period, self._at = period, start
        return start

    def write(self, rows: Rows) -> None:
        """Take more rows; the clock starts when there are enough."""
        with self._lock:
            self._rows.extend(rows.position)
            self._last = rows.last
            if self._waits and (self._last or len(self._rows) >= self._fill):
                self._waits, self._next = False, time.monotonic() + self._period
            self._pass()

    def depth(self) -> int:
        """Rows that are not due yet."""
        with self._lock:
            self._pass()
            return len(self._rows)

    def restart(self) -> None:
        """Resume once there are enough rows again."""
        with self._lock:
            self._rows.clear()
            self._waits = True

    def taken(self) -> Taken:
        """The row that the axes are at."""
        with self._lock:
            self._pass()
            return Taken(self._row, self._underruns, dry=self._next is None and not self._waits and not self._last)

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
        """Drop the rows that are not taken."""
        with self._lock:
            self._rows.clear()

    def _pass(self) -> None:
        """Take the rows that have fallen due; where one is due and not there, stop the clock."""
        now = time.monotonic()
        while self._next is not None and self._next <= now:
            if self._rows:
                self._at = self._rows.popleft()
                self._row += 1
                self._next += self._period
            else:
                self._next = None
                self._underruns += not self._last
