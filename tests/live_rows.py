"""What tests of streams share: a consumer of UDP rows, and the limits of what it got by differences alone."""

from __future__ import annotations

import socket
import struct
import threading
import time

import numpy as np

from splinefeed.live.sinks import HEAD
from splinefeed.records import Array

PERIOD = 1e-3
#: Longest wait for rows, s.
PATIENCE = 60.0


def differences(position: Array) -> list[float]:
    """Largest velocity, acceleration and jerk of an axis in rows of 1 ms, from rest to rest."""
    still = np.concatenate([position[:1]] * 3 + [position] + [position[-1:]] * 3)
    return [float(np.max(np.abs(np.diff(still, order, axis=0)))) / PERIOD**order for order in (1, 2, 3)]


def assert_limits(position: Array, feed: float = 60.0, acceleration: float = 500.0, jerk: float = 20000.0) -> None:
    """The limits of the axes, up to the rounding of positions of some 10 mm."""
    found = differences(position)
    assert found[0] <= feed * (1 + 1e-9)
    assert found[1] <= acceleration * (1 + 1e-6)
    assert found[2] <= jerk * (1 + 1e-4)


class Datagrams:
    """A consumer of UDP rows, until it is left and nothing comes any more."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 21)
        self.socket.settimeout(0.2)
        self.port = self.socket.getsockname()[1]
        self.numbers: list[int] = []
        self.rows: list[tuple[float, ...]] = []
        self._end = False
        self._thread = threading.Thread(target=self._listen)

    def __enter__(self) -> Datagrams:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._end = True
        self._thread.join(10.0)
        self.socket.close()

    def _listen(self) -> None:
        while True:
            try:
                data = self.socket.recv(1000)
            except TimeoutError:
                if self._end:
                    return
                continue
            _, number, _, axes = HEAD.unpack(data[: HEAD.size])
            self.rows.append(struct.unpack(f"!{axes}d", data[HEAD.size :]))
            self.numbers.append(number)

    def wait(self, count: int) -> None:
        """Until so many rows have come."""
        end = time.monotonic() + PATIENCE
        while len(self.numbers) < count:
            assert time.monotonic() < end, f"{len(self.numbers)} rows have come, not {count}"
            time.sleep(0.01)

    def rest(self) -> None:
        """Until 200 rows in a row are the same."""
        end = time.monotonic() + PATIENCE
        while len(set(self.rows[-200:])) > 1:
            assert time.monotonic() < end, "it does not come to rest"
            time.sleep(0.01)
