"""What scripts beside this one put into pages: sentences and tables, each between markers that name script and part."""

from __future__ import annotations

import sys
from pathlib import Path
from textwrap import fill

sys.path.insert(0, str(Path(__file__).parents[2]))

from benchmarks.tables import write_into  # the markers of the benchmarks are these

DOCS = Path(__file__).parents[1]
WIDTH = 120


def write(page: str, maker: str, name: str, text: str) -> None:
    """Put `text` between the markers of `name` of the script `maker` in a page of docs/, and print it."""
    print(f"## {name}\n\n{text}\n", flush=True)
    assert write_into(DOCS / page, name, text, maker), f"{page} has no markers for {maker}:{name}"


def rows(*lines: tuple[str, ...], left: int = 1) -> str:
    """A Markdown table, its first line the heading; words in so many columns at its left, numbers in the others."""
    head, *rest = lines
    bars = ["---"] * left + ["---:"] * (len(head) - left)
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, tuple(bars), *rest))


def words(text: str) -> str:
    """Sentences in lines of WIDTH, as the rest of a page has them."""
    return fill(" ".join(text.split()), WIDTH, break_long_words=False, break_on_hyphens=False)
