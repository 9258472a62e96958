"""What commands print: one JSON object, or text and tables that stay whole in a pipe."""

from __future__ import annotations

import io
import json
import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from splinefeed.cli.failures import visible

#: Columns that the widest of our tables takes; a narrower terminal wraps its lines, but no number is cut.
WIDTH = 110


def print_json(numbers: Mapping[str, Any]) -> None:
    """One JSON object on stdout."""
    from splinefeed.formats.plain import plain

    print(json.dumps(plain(numbers), indent=2, allow_nan=False))


def print_text(text: str = "") -> None:
    """One line of text on stdout, harmless to a terminal: a line break in a name is shown as one."""
    print(visible(text))


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]], *, texts: int = 1) -> None:
    """A table on stdout; the first `texts` columns are words, all others are numbers and stand to the right."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), header_style="bold")
    for i, title in enumerate(columns):
        table.add_column(Text(title), justify="left" if i < texts else "right", no_wrap=True)
    for row in rows:
        table.add_row(*(Text(visible(cell)) for cell in row))
    # By way of a text of ours: where the reader of stdout has gone away, rich would end the program itself.
    text = io.StringIO()
    width = max(WIDTH, _natural_width(columns, rows))
    console = Console(file=text, width=width, force_terminal=sys.stdout.isatty(), highlight=False, emoji=False)
    console.print(table)
    sys.stdout.write(text.getvalue())


def _natural_width(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> int:
    return sum(3 + max(len(row[i]) for row in [columns, *rows]) for i in range(len(columns)))


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
