"""What commands print: one JSON object, or text and tables that stay whole in a pipe."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from splinefeed.cli.failures import visible


def print_json(numbers: Mapping[str, Any]) -> None:
    """One JSON object on stdout."""
    from splinefeed.formats.plain import plain

    print(json.dumps(plain(numbers), indent=2, allow_nan=False))


def print_text(text: str = "") -> None:
    """One line of text on stdout, harmless to a terminal: a line break in a name is shown as one."""
    print(visible(text))


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]], *, texts: int = 1) -> None:
    """A table on stdout; the first `texts` columns are words, all others are numbers and stand to the right."""
    lines = [list(map(visible, row)) for row in [columns, *rows]]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for k, line in enumerate(lines):
        cells = [f"{cell:{'<' if i < texts else '>'}{widths[i]}}" for i, cell in enumerate(line)]
        bold = k == 0 and sys.stdout.isatty()
        print("\x1b[1m" * bold + "   ".join(cells).rstrip() + "\x1b[0m" * bold)


def print_rows(rows: Iterable[Mapping[str, Any]], columns: str, *, texts: int = 1) -> None:
    """A table of what pages of numbers list; columns between commas, a key or `title=key`, with units by the key."""
    pairs = [(title, key or title) for title, _, key in (each.strip().partition("=") for each in columns.split(","))]
    cells = [[shown(key, row.get(key)) for _, key in pairs] for row in rows]
    print_table([title for title, _ in pairs], cells, texts=texts)


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
