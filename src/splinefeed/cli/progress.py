"""What the program is busy with, on stderr: a spinner on a terminal, and elsewhere a line now and then."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from splinefeed.cli.failures import one_line

#: How to say what is being done now.
Say = Callable[[str], None]

COMPILING = "compiling the kernels for this machine, once, about half a minute"
#: Where stderr is no terminal, work that lasts less than this, s, is not spoken of, and longer work not more often.
PATIENCE = 5.0
#: Kernels are spoken of sooner, s, but not before a mistake in the input would have ended the program.
FIRST_WORD = 1.5


@contextmanager
def busy(command: str) -> Iterator[Say]:
    """Give a function that says what is being done now; say so if `command` must compile its kernels first."""
    import numba

    from splinefeed.kernels.jit import cache_directory

    done_before = cache_directory() / f"{command}.ready"
    first = not numba.config.DISABLE_JIT and not done_before.exists()
    with _on_terminal(first) if sys.stderr.isatty() else _in_lines(first) as say:
        yield say
    if first:
        with suppress(OSError):
            done_before.touch()


@contextmanager
def _on_terminal(first: bool) -> Iterator[Say]:
    from rich.console import Console
    from rich.text import Text

    suffix = f" ({COMPILING})" if first else ""
    console = Console(stderr=True, highlight=False, emoji=False)
    with console.status(Text(f"starting{suffix}")) as status:
        yield lambda what: status.update(Text(f"{what}{suffix}"))


@contextmanager
def _in_lines(first: bool) -> Iterator[Say]:
    doing = ""
    ended = threading.Event()

    def speak() -> None:
        said = ""
        if first and not ended.wait(FIRST_WORD):
            print(f"splinefeed: {COMPILING}", file=sys.stderr, flush=True)
        while not ended.wait(PATIENCE):
            if doing != said:
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
