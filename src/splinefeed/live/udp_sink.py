"""Rows as UDP datagrams: one a period, numbered, so that the receiver sees loss, repeats and order."""

from __future__ import annotations

import math
import socket
import struct
import time

from splinefeed.errors import InputError
from splinefeed.formats.metadata import to_degrees
from splinefeed.live.sink import Rows, Taken, starting_rows
from splinefeed.records import Array

#: The head of a datagram: four letters, number of the row, whether it is the last, number of axes; behind it stand
#: that many doubles, mm and degrees. All in network order.
HEAD = struct.Struct("!4sQBB")
MAGIC = b"spf1"
#: Where datagrams go by default.
HOST, PORT = "127.0.0.1", 5010


class UdpSink:
    """Sends rows ahead of a clock; there is no answer; the clock is the consumer.

    ahead  rows that are there before the clock starts, and before it goes on after it has waited
    """

    paced = True

    def __init__(self, host: str = HOST, port: int = PORT, *, ahead: int = 1) -> None:
        if not 0 < port < 65536:
            raise InputError(f"port {port}: must be from 1 to 65535")
        self._to = (host, port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._ahead = ahead
        self._row = self._underruns = 0
        self._before = 0  # rows that it had passed when it last started
        self._waits = math.nan  # since when it waits for rows
        self._ended = False
        self._start = math.nan
        self._period = math.inf

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        """Remember the period."""
        self._period = period
        return start

    def write(self, rows: Rows) -> None:
        """Send each row as a datagram."""
        for k, row in enumerate(to_degrees(rows.position, rows.axes).tolist()):
            number, last = rows.first + k, rows.last and k == len(rows) - 1
            head = HEAD.pack(MAGIC, number, last, len(row))
            self._socket.sendto(head + struct.pack(f"!{len(row)}d", *row), self._to)
        self._row = rows.first + len(rows) - 1
        self._ended = rows.last
        if math.isnan(self._start) and (self._row >= self._before + starting_rows(self._ahead) or self._ended):
            self._start = time.monotonic()
            if not math.isnan(self._waits):
                self._underruns += int((self._start - self._waits) / self._period)

    def _passed(self) -> int:
        """Rows that the clock has come to, sent or not."""
        ran = 0.0 if math.isnan(self._start) else (time.monotonic() - self._start) / self._period
        return self._before + int(ran)

    def taken(self) -> Taken:
        """As many rows as the clock has passed; dry where it has come to one that was not sent."""
        passed = self._passed()
        return Taken(min(passed, self._row), self._underruns, dry=passed > self._row and not self._ended)

    def restart(self) -> None:
        """The clock waits since it came to a row that was not there, and goes on when there are enough."""
        late = self._passed() - self._row
        self._before, self._start = self._row, math.nan
        self._waits = time.monotonic() - late * self._period

    def depth(self) -> int:
        """Rows that the clock has not come to."""
        return self._row - self.taken().row

    def abandon(self) -> None:
        """Close the socket."""
        self._socket.close()

    def close(self) -> Taken:
        """Wait for the clock, and close the socket."""
        while self.depth() > 0:
            time.sleep(min(self.depth() * self._period, 0.05))
        done = self.taken()
        self._socket.close()
        return done
