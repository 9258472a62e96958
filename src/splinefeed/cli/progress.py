"""What the program is busy with, on stderr: a spinner on a terminal, and elsewhere a line now and then."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from splinefeed.cli.failures import one_line

if TYPE_CHECKING:
    from rich.text import Text

#: How to say what is being done now.
Say = Callable[[str], None]

COMPILING = "compiling kernels for this machine, once, up to half a minute"
#: ... and where there is no compiler for work that is worth one.
PLAIN = "running as plain Python; pip install 'splinefeed[sim]' brings Numba, which makes this many times faster"
#: Where stderr is not a terminal, work that lasts less than this, s, is not spoken of, and longer work not more often.
PATIENCE = 5.0
#: Kernels are spoken of sooner, s, but not before a mistake in the input would have ended the program.
FIRST_WORD = 1.5


@contextmanager
def busy() -> Iterator[Say]:
    """Give a function that says what is being done now; say so, too, when kernels are compiled for it."""
    with _on_terminal() if sys.stderr.isatty() else _in_lines() as say:
        yield say


def _remark() -> str:
    """What is to be said of kernels: that this process compiles some, or would if it could; else empty."""
    jit = sys.modules.get("splinefeed.kernels.jit")
    if getattr(jit, "compiled_here", False):  # it may be half imported just now
        return COMPILING
    return PLAIN if getattr(jit, "wanted_numba", False) else ""


class _Status:
    """What stands beside the spinner; it is computed again at every turn."""

    what = "starting"

    def __rich__(self) -> Text:
        from rich.text import Text

        return Text(f"{self.what} ({remark})" if (remark := _remark()) else self.what)


@contextmanager
def _on_terminal() -> Iterator[Say]:
    from rich.console import Console

    shown = _Status()
    with Console(stderr=True, highlight=False, emoji=False).status(shown):
        yield lambda what: setattr(shown, "what", what)


@contextmanager
def _in_lines() -> Iterator[Say]:
    doing = ""
    ended = threading.Event()

    def speak() -> None:
        said = ""
        remarked = False
        began = time.monotonic()
        while not ended.wait(FIRST_WORD):
            if not remarked and (remark := _remark()):
                remarked = True
                print(f"splinefeed: {remark}", file=sys.stderr, flush=True)
            if doing != said and time.monotonic() - began >= PATIENCE:
                began = time.monotonic()
                said = doing
                print(f"splinefeed: {one_line(said)}", file=sys.stderr, flush=True)

    def say(what: str) -> None:
        nonlocal doing
        doing = what

    speaker = threading.Thread(target=speak, daemon=True)
    speaker.start()
    try:
        yield say
    finally:
        ended.set()
        speaker.join()
