"""What a stream obeys on this terminal: keys, and the signals of Ctrl-C and of the system."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from splinefeed.live.operator import Operator

#: Steps of the keys + and -.
KEY_STEP = 0.1
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextlib.contextmanager
def ended_by_signals() -> Iterator[None]:
    """Before anything moves SIGINT and SIGTERM end the program at once, also within a compiler, which catches them."""

    def end(number: int, frame: object) -> None:
        os.write(2, b"splinefeed: interrupted before anything moved\n")
        os._exit(128 + number)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    with _on_signals(end):
        yield


@contextlib.contextmanager
def signals(operator: Operator) -> Iterator[None]:
    """The first SIGINT or SIGTERM stops on the path; the next one is what it always is."""
    before = {number: signal.getsignal(number) for number in _SIGNALS}

    def stop(number: int, frame: object) -> None:
        operator.stop()
        print("stopping on the path; press again to end at once", file=sys.stderr, flush=True)
        signal.signal(number, before[signal.Signals(number)])

    with _on_signals(stop):
        yield


@contextlib.contextmanager
def _on_signals(handler: Callable[[int, object], None]) -> Iterator[None]:
    """Within this `handler` answers SIGINT and SIGTERM; then what did before."""
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    for number in before:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number, own in before.items():
            signal.signal(number, own)


@contextlib.contextmanager
def keys(operator: Operator) -> Iterator[None]:
    """Obey keys, where there is a keyboard."""
    if os.name != "posix" or not sys.stdin.isatty():
        yield
        return
    import termios
    import tty

    number = sys.stdin.fileno()
    before = termios.tcgetattr(number)
    tty.setcbreak(number)
    threading.Thread(target=_obey, args=(operator, number), daemon=True).start()
    try:
        yield
    finally:
        termios.tcsetattr(number, termios.TCSADRAIN, before)


def _obey(operator: Operator, number: int) -> None:
    orders: dict[str, Callable[[], None]] = {
        "+": lambda: operator.turn(KEY_STEP),
        "-": lambda: operator.turn(-KEY_STEP),
        "h": operator.hold,
        " ": operator.hold,
        "b": operator.reverse,
        "r": operator.go,
        "s": operator.stop,
    }
    while key := os.read(number, 1):
        orders.get(key.decode(errors="replace"), lambda: None)()
