"""Where rows of a stream go: what every sink does, and those that need nothing but Python: clock, UDP, text."""

from __future__ import annotations

import os
import socket
import struct
import sys
import threading
import time
from collections import deque
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TextIO

import numpy as np

from splinefeed.errors import InputError
from splinefeed.files.atomic import atomic_write
from splinefeed.files.metadata import to_degrees
from splinefeed.formats.setpoints_text import cfg
from splinefeed.records import Array

#: Rows made at a time where a clock takes them, a share of the buffer but no fewer: how soon a change of the override
#: takes effect.
BATCH_SHARE, LEAST_ROWS = 1.0 / 16.0, 8
#: A clock starts when this many fewer rows are there than are kept ahead, at least.
SPARE_ROWS = 20
#: How often the end of the rows is tested, s.
LOOK = 0.005
#: The head of a datagram: four letters, number of the row, whether it is the last, number of axes; behind it stand
#: that many doubles, mm and degrees. All in network order.
HEAD = struct.Struct("!4sQBB")
MAGIC = b"spf1"


def batch_rows(ahead: int) -> int:
    """Rows made at a time for a clock that `ahead` rows are kept ahead of."""
    return max(int(BATCH_SHARE * ahead), LEAST_ROWS)


def starting_rows(ahead: int) -> int:
    """Rows with which that clock starts: the producer waits until there is room for a whole batch."""
    return max(ahead - max(batch_rows(ahead), SPARE_ROWS), 1)


@dataclass(frozen=True, eq=False)
class SetpointRows:
    """Rows of a stream in order.

    Parameters
    ----------
    first : int
        Number of the first one; the first row of a stream is 1.
    position : array (n, axes)
        In mm, rotary axes rad.
    axes : tuple of str
        Their names.
    last : bool, optional
        Whether the last of them is the last row of the stream, on which the axes stay.
    """

    first: int
    position: Array
    axes: tuple[str, ...]
    last: bool = False

    def __len__(self) -> int:
        return len(self.position)

    def numbered(self) -> list[tuple[int, list[float], bool]]:
        """Number, position with rotary axes in degrees, and whether it is the last, of each row."""
        values, end = to_degrees(self.position, self.axes).tolist(), len(self) - 1
        return [(self.first + k, row, self.last and k == end) for k, row in enumerate(values)]

    def text(self) -> str:
        """One line a row, `row x y ... last`, as `halstreamer` takes them: 17 digits, rotary axes in degrees."""
        return "".join(
            f"{number} {' '.join(f'{value:.17g}' for value in row)} {last:d}\n" for number, row, last in self.numbered()
        )


@dataclass(frozen=True)
class Taken:
    """The state of a sink's consumer.

    Parameters
    ----------
    row : int
        The last row that it has confirmed; 0 if none.
    underruns : int, optional
        Periods in which it wanted a row and there was none.
    override : float or None, optional
        The rate set at the controller, negative backwards; None where it has no override.
    dry : bool, optional
        Whether it has run out of rows and waits for `restart`: rows behind `row` were not taken.
    """

    row: int
    underruns: int = 0
    override: float | None = None
    dry: bool = False


class Sink:
    """A consumer of rows; what stands here is right for one that confirms rows by writing them.

    Attributes
    ----------
    paced : bool
        Whether rows are taken by a clock, so that only so many may be sent ahead.
    feedback : bool
        Whether it tells where the axes are.
    """

    paced = False
    feedback = False
    _row = 0

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        """Begin a stream.

        Parameters
        ----------
        axes : tuple of str
            Their names.
        period : float
            Between two rows, s.
        start : array (axes,)
            Where the first row is, mm and rad.

        Returns
        -------
        array (axes,)
            Where the axes are, `start` if that is not known.
        """
        return start

    def write(self, rows: SetpointRows) -> None:
        """Take more rows; may wait for room."""
        self._row = rows.first + len(rows) - 1

    def depth(self) -> int:
        """Rows that were written and are not confirmed yet."""
        return self._row - self.taken().row

    def taken(self) -> Taken:
        """What the consumer has confirmed by now."""
        return Taken(self._row)

    def restart(self) -> None:
        """Resume after `dry`: the next row written is the one behind `taken().row`, and begins at rest."""
        self._row = self.taken().row

    def close(self) -> Taken:
        """Wait until every row is taken, and end."""
        return self.taken()

    def abandon(self) -> None:
        """End at once, after an error; leave nothing half-written."""


class ClockSink(Sink):
    """A sink whose rows are taken by this computer's clock, one a period; where there is none it runs dry and waits.

    Parameters
    ----------
    fill : int, optional
        Rows that must be there before its clock starts, at the beginning and after a restart, or the last one.
    """

    paced = True

    def __init__(self, fill: int = 1) -> None:
        self._fill, self._waits = fill, True
        self._rows: deque[Array] = deque()  # written and not taken
        self._lock = threading.Lock()
        self._period = 0.0
        self._next: float | None = None  # when the next row is due, s of the monotonic clock; None while it waits
        self._dry_at: float | None = None
        self._at = np.zeros(0)
        self._taken = self._underruns = 0
        self._last = False

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        """Begin: the axes are where the first row is."""
        self._period, self._at = period, start
        return start

    def write(self, rows: SetpointRows) -> None:
        """Take more rows; the clock starts when there are enough."""
        with self._lock:
            self._rows.extend(rows.position)
            self._last = rows.last
            if self._waits and (self._last or len(self._rows) >= self._fill):
                now = time.monotonic()
                if self._dry_at is not None:
                    self._underruns += int((now - self._dry_at) / self._period)
                self._waits, self._next, self._dry_at = False, now + self._period, None
        super().write(rows)

    def restart(self) -> None:
        """Resume once there are enough rows again."""
        super().restart()
        with self._lock:
            self._rows.clear()
            self._waits = True

    def taken(self) -> Taken:
        """The row that the axes are at."""
        with self._lock:
            self._pass()
            return Taken(self._taken, self._underruns, dry=self._dry_at is not None and not self._waits)

    def now(self) -> tuple[int, Array]:
        """The row that was taken last, 0 before the first, and its position (axes,)."""
        with self._lock:
            self._pass()
            return self._taken, self._at

    def close(self) -> Taken:
        """Wait until the last row is taken."""
        while self.depth():
            time.sleep(min(LOOK, self._period))
        return self.taken()

    def _pass(self) -> None:
        """Take the rows that have fallen due; where one is due and not there, stop the clock."""
        now = time.monotonic()
        while self._next is not None and self._next <= now:
            if self._rows:
                self._at = self._rows.popleft()
                self._taken += 1
                self._next += self._period
            else:
                if not self._last:
                    self._dry_at = self._next
                    self._underruns += 1
                self._next = None


class UdpSink(ClockSink):
    """A sink that sends rows as UDP datagrams, numbered, so that the receiver sees loss, repeats and order.

    The clock confirms them.

    Parameters
    ----------
    host : str, optional
        Name or address of the receiver.
    port : int, optional
        From 1 to 65535.
    ahead : int, optional
        Rows that are kept before the clock.

    Raises
    ------
    InputError
        For another port.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 5010, *, ahead: int = 1) -> None:
        if not 0 < port < 65536:
            raise InputError(f"port {port}: must be from 1 to 65535")
        super().__init__(starting_rows(ahead))
        self._to = (host, port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def write(self, rows: SetpointRows) -> None:
        """Send each row as a datagram."""
        for number, row, last in rows.numbered():
            self._socket.sendto(HEAD.pack(MAGIC, number, last, len(row)) + struct.pack(f"!{len(row)}d", *row), self._to)
        super().write(rows)

    def abandon(self) -> None:
        """Close the socket."""
        self._socket.close()

    def close(self) -> Taken:
        """Wait for the clock, and close the socket."""
        done = super().close()
        self._socket.close()
        return done


class TextSink(Sink):
    """A sink that writes rows as lines of text in the layout of `halstreamer`.

    Parameters
    ----------
    target : text stream, str or PathLike
        An open stream, or a file, which is written whole or not at all.
    """

    def __init__(self, target: TextIO | str | os.PathLike[str]) -> None:
        self._target = target
        self._stack = ExitStack()

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        """Say what the columns are in a comment; a file begins under a temporary name."""
        self._stream: TextIO
        if isinstance(self._target, str | os.PathLike):
            temporary = self._stack.enter_context(atomic_write(self._target))
            self._stream = self._stack.enter_context(temporary.open("w", encoding="ascii", newline="\n"))
        else:
            self._stream = self._target
        columns = f"cfg={cfg(axes)}, one row every {period:.17g} s, last row repeated"
        self._put(f"# row {' '.join(axes)} last   ({columns})\n")
        return start

    def write(self, rows: SetpointRows) -> None:
        """Write the lines, and wait until they are gone."""
        self._put(rows.text())
        super().write(rows)

    def _put(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()

    def abandon(self) -> None:
        """Take a temporary file away."""
        self._stack.__exit__(*sys.exc_info())

    def close(self) -> Taken:
        """Put a file in its place."""
        self._stack.close()
        return super().close()
