"""What the program is busy with, on stderr: one line that changes on a terminal, and elsewhere a line now and then."""

from __future__ import annotations

import shutil
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from splinefeed.cli.failures import visible
from splinefeed.cli.output import Say
from splinefeed.telling import listening, percent

COMPILING = "compiling kernels for this machine, once, up to half a minute"
#: ... and where there is no compiler for work that is worth one.
PLAIN = "running as plain Python; pip install 'splinefeed[sim]' brings Numba, which makes this many times faster"
#: Where stderr is not a terminal, work that lasts less than this, s, is not spoken of, and other work not sooner; what
#: goes on is spoken of again after the second time, s.
PATIENCE, AGAIN = 2.0, 10.0
#: Kernels are spoken of sooner, s, but not before a mistake in the input would have ended the program.
FIRST_WORD = 1.5
#: Time between two pictures of a terminal, s.
LOOK = 0.2


@contextmanager
def busy() -> Iterator[Say]:
    """Give a function that says what is being done now; say so, too, when kernels are compiled for it."""
    doing, part, share = "starting", "", ""  # the last two as the work itself tells them
    ended = threading.Event()
    terminal = sys.stderr.isatty()

    def speak() -> None:
        said, remarked, began = ("starting", ""), "", time.monotonic()
        start = began
        while not ended.wait(LOOK if terminal else FIRST_WORD):
            remark, now = _remark(), time.monotonic()
            words = f"{doing}: {part} {share}" if doing and part else doing
            if terminal:
                words = f"{now - start:.0f} s  {words}" if words and now - start > PATIENCE else words
                line = visible(f"{words} ({remark})" if words and remark else words)
                line = line[: shutil.get_terminal_size().columns - 1]
                print(f"\r{line}\x1b[K", end="", file=sys.stderr, flush=True)
                continue
            if remark != remarked:
                remarked = remark
                print(f"splinefeed: {remark}", file=sys.stderr, flush=True)
            if doing and now - began >= (AGAIN if said == (doing, part) else PATIENCE):
                said, began = (doing, part), now
                print(f"splinefeed: {visible(words)} ({now - start:.0f} s)", file=sys.stderr, flush=True)
        if terminal:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def say(what: str) -> None:
        nonlocal doing, part
        doing, part = what, ""

    def heard(what: str, done: float, of: float) -> None:
        nonlocal part, share
        part, share = what, percent(done, of)

    speaker = threading.Thread(target=speak, daemon=True)
    speaker.start()
    try:
        with listening(heard):
            yield say
    finally:
        ended.set()
        speaker.join()


def _remark() -> str:
    """What is to be said of kernels: that this process compiles some, or would if it could; else empty."""
    jit = sys.modules.get("splinefeed.kernels.jit")
    if getattr(jit, "compiled_here", False):  # it may be half imported just now
        return COMPILING
    return PLAIN if getattr(jit, "wanted_numba", False) else ""
