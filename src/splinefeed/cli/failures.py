"""What goes wrong, as one line on stderr and an exit code."""

from __future__ import annotations

import os
import re
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NoReturn

import click

from splinefeed.errors import SplinefeedError, nearest

#: Set to anything but nothing, errors keep their traceback.
DEBUG = "SPLINEFEED_DEBUG"

DONE = 0
NOT_KEPT = 1
BAD_INPUT = 2
#: A fault of the program itself (sysexits.h: EX_SOFTWARE).
INTERNAL = 70
#: What a shell reports for a program ended by Ctrl-C, and by a pipe whose reader went away.
INTERRUPTED = 130
NO_READER = 141
#: The signals that this command got: a library may make an error of its own of what `on_signal` raises within it.
signalled: list[int] = []
#: Most problems of a file that are printed.
MOST_PROBLEMS = 30
#: Time after which a signal that came to nothing is sent again, s.
AGAIN = 1e-3


def guarded(call: Callable[[], Any]) -> int:
    """The exit code of `call`, whose errors are printed as one line each; what it printed is written when this ends."""
    code = _exit_code(call)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError as error:
            if stream is sys.stdout and code in (DONE, NOT_KEPT):
                code = NO_READER if isinstance(error, BrokenPipeError) else _say(_system_error(error), BAD_INPUT, error)
            with suppress(OSError, ValueError):  # it goes nowhere: Python would complain about it at its end
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, stream.fileno())
                os.close(nowhere)
    return code


def on_signal(number: int, frame: object) -> NoReturn:
    """Unwind, so that files begun are taken away: what SIGINT and SIGTERM do to a command."""
    signalled.append(number)
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    sys.exit(128 + number)


def on_unraisable(given: Any) -> None:
    """Send a signal again that came where Python can raise nothing, as while an object is taken away.

    Anything else goes to Python's own hook.
    """
    if signalled and isinstance(given.exc_value, KeyboardInterrupt | SystemExit):
        signal.signal(signal.SIGALRM, lambda number, frame: on_signal(signalled[0], frame))
        signal.setitimer(signal.ITIMER_REAL, AGAIN)
    else:
        sys.__unraisablehook__(given)


def _interrupted() -> int:
    return _say("interrupted; no half-written file is left", INTERRUPTED)


def _exit_code(call: Callable[[], Any]) -> int:
    try:
        code = call()
    except click.ClickException as error:
        return _say(usage_text(error), error.exit_code)
    except click.exceptions.Exit as end:
        return end.exit_code
    except KeyboardInterrupt:
        return _interrupted()
    except BrokenPipeError:
        return NO_READER
    except SystemExit as end:  # by SIGTERM
        code = end.code
    except SplinefeedError as error:
        return _say(str(error), BAD_INPUT, error)
    except MemoryError as error:
        return _say("not enough memory for so many points; choose a longer period or a shorter path", BAD_INPUT, error)
    except OSError as error:
        return _say(_system_error(error), BAD_INPUT, error)
    except Exception as error:
        if signalled:
            return _interrupted() if signalled[0] == signal.SIGINT else 128 + signalled[0]
        place = ", ".join([f"{type(error).__name__}: {error}", *getattr(error, "__notes__", ())])
        return _say(f"internal fault: {place}; {DEBUG}=1 shows where, please report it", INTERNAL, error)
    return code if isinstance(code, int) else DONE


def _system_error(error: OSError) -> str:
    from splinefeed.files.atomic import reason_of

    return f"{error.filename or 'output'}: {reason_of(error)}"


def usage_text(error: click.ClickException) -> str:
    """Click's words on a wrong option or argument, after the name of what is wrong."""
    text = error.format_message()
    if isinstance(error, click.NoSuchOption) and error.possibilities:
        text = f"no such option {error.option_name}; {nearest(error.option_name, error.possibilities)}"
    if isinstance(error, click.BadParameter) and not isinstance(error, click.MissingParameter) and error.param:
        name = error.param.opts[0] if error.param.param_type_name == "option" else error.param.human_readable_name
        return f"{name}: {error.message}"
    ctx = getattr(error, "ctx", None)
    if ctx is not None and "did you mean" not in text.lower():
        text = f"{text.rstrip('.')}; see {ctx.command_path} --help"
    return text


def visible(text: str) -> str:
    """`text` with escapes for what a terminal would take as an order, such as another colour."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def spoken(text: str) -> str:
    """What a reader says of an option, as a shell has it: (option start) is (--start)."""
    return re.sub(r"\(option ([a-z_]+)(?=[):])", lambda found: f"(--{found[1].replace('_', '-')}", text)


def _say(text: str, code: int, error: BaseException | None = None) -> int:
    if error is not None and os.environ.get(DEBUG):
        raise error
    # a file with several faults: its name and their number, then one line each
    text = spoken(text)
    lines = text.split("\n") if len(getattr(error, "problems", ())) > 1 else [" ".join(text.split())]
    if len(lines) > MOST_PROBLEMS + 1:
        lines[MOST_PROBLEMS + 1 :] = [f"  and {len(lines) - MOST_PROBLEMS - 1} more"]
    with suppress(OSError):
        print("splinefeed: " + "\n".join(map(visible, lines)), file=sys.stderr)
    return code
