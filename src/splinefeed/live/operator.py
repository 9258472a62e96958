"""The operator's commands, from any thread: keys, the local socket, a signal, or pins of the controller."""

from __future__ import annotations

import threading

from splinefeed.errors import InputError

#: Highest rate.
MOST = 2.0


class Operator:
    """Feedrate override, feed hold, retrace and stop; a hold goes before a retrace, a stop before both."""

    def __init__(self, rate: float = 1.0) -> None:
        self._rate, self._hold, self._back, self._stop = rate, False, False, False
        self._lock = threading.Lock()

    def set_rate(self, rate: float) -> None:
        """Wanted rate, 1 = as planned. InputError unless from 0 to 2."""
        if not 0.0 <= rate <= MOST:
            raise InputError(f"override {100.0 * rate:g} %; it must be from 0 to {100.0 * MOST:g} %")
        with self._lock:
            self._rate = rate

    def turn(self, by: float) -> None:
        """Raise or lower the wanted rate, within 0 to 2."""
        with self._lock:
            self._rate = min(max(self._rate + by, 0.0), MOST)

    def hold(self, held: bool = True) -> None:
        """Feed hold, or resume."""
        with self._lock:
            self._hold = held

    def reverse(self, back: bool = True) -> None:
        """Retrace the path, or go forward again."""
        with self._lock:
            self._back = back

    def go(self) -> None:
        """Resume: no hold, forward."""
        with self._lock:
            self._hold = self._back = False

    def stop(self) -> None:
        """Stop on the path, and end."""
        with self._lock:
            self._stop = True

    @property
    def rate(self) -> float:
        """The feedrate override, 1 = as planned."""
        return self._rate

    @property
    def held(self) -> bool:
        """Whether feed hold is on."""
        return self._hold

    @property
    def back(self) -> bool:
        """Whether retrace is on."""
        return self._back

    @property
    def stopping(self) -> bool:
        """Whether a stop was commanded."""
        return self._stop

    @property
    def wanted(self) -> float:
        """The rate to run at, negative backwards."""
        if self._hold or self._stop:
            return 0.0
        return -self._rate if self._back else self._rate
