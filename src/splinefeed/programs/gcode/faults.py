"""What is wrong with a line of a program."""

from __future__ import annotations

import re


class LineError(Exception):
    """What is wrong with a line, without its number; the reader adds that unless `line` says another one."""

    line = 0


class SpindleError(LineError):
    """A motion that goes with a spindle which does not turn, as far as the program says."""


def refuse(wrong: object, reason: str) -> None:
    """LineError with the reason for what is wrong."""
    if wrong:
        raise LineError(reason)


def shown(rest: str) -> str:
    """What is left of a line that cannot be read, with a hint for a comma that stands for a decimal point."""
    hint = "; a number has a decimal point, not a comma" if re.match(r",[0-9]", rest) else ""
    return f"{rest[:20].strip()!r}{hint}"
