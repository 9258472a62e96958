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

#: Steps of the keys + and -, %.
KEY_STEP = 10.0
HOLD = {"hold": True}
#: What other keys order.
KEYS = {"h": HOLD, " ": HOLD, "b": {"reverse": True}, "r": {"hold": False, "reverse": False}, "s": {"stop": True}}


@contextlib.contextmanager
def ended_by_signals() -> Iterator[None]:
    """Before anything moves SIGINT and SIGTERM end the program at once, also within a compiler, which catches them."""

    def end(number: int, frame: object) -> None:
        os.write(2, b"splinefeed: interrupted before anything moved\n")
        os._exit(128 + number)

    with _on_signals(end):
        yield


@contextlib.contextmanager
def signals(operator: Operator) -> Iterator[None]:
    """The first SIGINT or SIGTERM stops on the path; the next one is what it always is."""

    def stop(number: int, frame: object) -> None:
        operator.obey({"stop": True})
        print("stopping on the path; press again to end at once", file=sys.stderr, flush=True)
        signal.signal(number, before[number])

    with _on_signals(stop) as before:
        yield


@contextlib.contextmanager
def _on_signals(handler: Callable[[int, object], None]) -> Iterator[dict[int, signal._HANDLER]]:
    """Within this `handler` answers SIGINT and SIGTERM; then what did before. Only a main thread has signals."""
    before: dict[int, signal._HANDLER] = {}
    if threading.current_thread() is threading.main_thread():
        before = {number: signal.signal(number, handler) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield before
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
    from splinefeed.live.operator import MOST

    while key := os.read(number, 1).decode(errors="replace"):
        if key in "+-":
            turned = 100.0 * operator.rate + (KEY_STEP if key == "+" else -KEY_STEP)
            operator.obey({"override": min(max(turned, 0.0), 100.0 * MOST)})
        else:
            operator.obey(KEYS.get(key, {}))
