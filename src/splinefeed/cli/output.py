"""What commands print: one JSON object, or blocks of lines and tables that stay whole in a pipe."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from splinefeed.cli.failures import spoken, visible

#: Letters of a line of a terminal.
WIDTH = 80
Page = dict[str, Any]
#: Lines without an empty one between them.
Block = Sequence[str]
#: How a command says what it is busy with.
Say = Callable[[str], None]


def print_json(numbers: Mapping[str, Any]) -> None:
    """One JSON object on stdout."""
    from splinefeed.files.plain import plain

    print(json.dumps(plain(numbers), indent=2, allow_nan=False))


def print_blocks(blocks: Iterable[Block]) -> None:
    """Blocks on stdout, an empty line between two; harmless to a terminal: a line break in a name is shown as one."""
    colour = sys.stdout.isatty() and not os.environ.get("NO_COLOR")
    lines = (map(_coloured if colour else str, map(visible, block)) for block in blocks if block)
    print("\n\n".join("\n".join(each) for each in lines))


def _coloured(line: str) -> str:
    """A line in the colour of what it says: whether limits hold."""
    good, bad = line.startswith("checked: "), line.startswith(("NOT KEPT", "problem "))
    return f"\x1b[{32 if good else 31}m{line}\x1b[0m" if good or bad else line


def table(columns: Sequence[str], rows: Iterable[Sequence[str]], *, texts: int = 1) -> list[str]:
    """The lines of a table; the first `texts` columns are words, all others are numbers and stand to the right.

    There are three blanks between columns, or two where only that fits 80 letters.
    """
    lines = [list(map(visible, row)) for row in [columns, *rows]]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    blanks = "   " if sum(widths) + 3 * (len(widths) - 1) <= WIDTH else "  "
    return [
        blanks.join(f"{cell:{'<' if i < texts else '>'}{widths[i]}}" for i, cell in enumerate(line)).rstrip()
        for line in lines
    ]


def listed(rows: Iterable[Mapping[str, Any]], columns: str, *, texts: int = 1) -> list[str]:
    """A table of what pages of numbers list; columns between commas, a key or `title=key`, with units by the key."""
    pairs = [(title, key or title) for title, _, key in (each.strip().partition("=") for each in columns.split(","))]
    cells = [[shown(key, row.get(key)) for _, key in pairs] for row in rows]
    return table([title for title, _ in pairs], cells, texts=texts)


def notes(said: Iterable[str]) -> list[str]:
    """What a reader or a planner had to say, one line each."""
    return [f"note      {spoken(note)}" for note in said]


def verdict(page: Page, why: str = "") -> list[str]:
    """The problems of a page, and whether every limit holds; why: what to say if not, by default their number."""
    from splinefeed.records.verdict import ALLOWED  # NumPy is imported only where it is needed

    problems = [f"problem   {problem}" for problem in page["problems"]]
    bad = f"NOT KEPT: {why or counted(len(problems), 'problem')}"
    return [*problems, f"checked: every limit holds, {ALLOWED}" if page["ok"] else bad]


#: Units by the end of a key.
_UNITS = {"_mm_s": " mm/s", "_mm": " mm", "_s": " s"}


def shown(key: str, value: Any) -> str:
    """What stands under a key of a page of numbers, with its unit."""
    if not isinstance(value, float):
        return "" if value is None else str(value)
    if "ripple" in key:
        return f"{value:.1e}"
    if key.endswith("_mm") and "error" in key:
        return length(value)
    return number(value, 6 if key == "duration_s" else 4) + next(
        (_UNITS[end] for end in _UNITS if key.endswith(end)), ""
    )


def counted(count: int, what: str) -> str:
    """`count` of `what`, in the plural but for one: 1 path, 2 paths."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def number(value: float, digits: int = 4) -> str:
    """`value` for people: `digits` digits, without a power of ten where it can be read without one."""
    if value == 0.0:
        return "0"
    if 1e-4 <= abs(value) < 1e6:
        places = digits - 1 - math.floor(math.log10(abs(value)))
        text = f"{value:.{max(places, 0)}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    return f"{value:.{digits - 1}e}".replace("e-0", "e-").replace("e+0", "e+").replace("e+", "e")


def length(value: float) -> str:
    """A length, mm, in micrometres below a millimetre."""
    return f"{number(1e3 * value)} um" if abs(value) < 1.0 else f"{number(value)} mm"
