"""Tables of results: as Markdown, as JSON and back, and between their markers in the README and the docs."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

Cell = float | int | str | None

#: A rule of a colon alone, without a dash, makes no table.
LEAST_WIDTH = 2


@dataclass(frozen=True)
class Column:
    """A heading, and how its numbers are written: a format of Python's, such as '.1f'."""

    title: str
    form: str = ""

    def text(self, cell: Cell) -> str:
        """One cell as it is printed; a word stays as it is, and nothing becomes a dash."""
        if cell is None:
            return "-"
        return cell.replace("|", "\\|") if isinstance(cell, str) else format(cell, self.form)


@dataclass(frozen=True)
class Table:
    """Rows of cells under columns, with a sentence above and sentences below."""

    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse two columns of one title: as_dict would keep the numbers of the second only."""
        titles = [column.title for column in self.columns]
        if len(set(titles)) < len(titles):
            raise ValueError(f"two columns of {self.caption!r} have the same title: {titles}")

    def markdown(self) -> str:
        """The table as GitHub shows it: words to the left, numbers to the right, also when read as plain text."""
        blocks = []
        for i, column in enumerate(self.columns):
            cells = [column.title, *(column.text(row[i]) for row in self.rows)]
            width = max(LEAST_WIDTH, *(len(cell) for cell in cells))
            padded = [cell.rjust(width) if column.form else cell.ljust(width) for cell in cells]
            rule = "-" * (width - 1) + (":" if column.form else "-")
            blocks.append([padded[0], rule, *padded[1:]])
        lines = ["| " + " | ".join(line) + " |" for line in zip(*blocks, strict=True)]
        return "\n".join([self.caption, "", *lines, *(("", *self.notes) if self.notes else ())])

    def as_dict(self) -> dict[str, Any]:
        """The table for results.json: numbers as they were measured, one object a row."""
        titles = [column.title for column in self.columns]
        rows = [dict(zip(titles, row, strict=True)) for row in self.rows]
        forms = {column.title: column.form for column in self.columns}
        return {"caption": self.caption, "forms": forms, "rows": rows, "notes": list(self.notes)}

    @classmethod
    def from_dict(cls, entry: dict[str, Any]) -> Table:
        """The table that `as_dict` gave."""
        columns = tuple(Column(title, form) for title, form in entry["forms"].items())
        rows = tuple(tuple(row[column.title] for column in columns) for row in entry["rows"])
        return cls(entry["caption"], columns, rows, tuple(entry["notes"]))


@dataclass(frozen=True)
class Headline:
    """One line of the README's summary: what was measured, the outcome in words, the target, and whether it is met.

    target, met  None where nothing was promised, or nothing could be measured
    """

    what: str
    outcome: str
    target: str | None = None
    met: bool | None = None


@dataclass(frozen=True)
class Report:
    """What one benchmark found."""

    tables: tuple[Table, ...]
    headlines: tuple[Headline, ...] = ()

    def markdown(self) -> str:
        """All tables, one below the other."""
        return "\n\n".join(table.markdown() for table in self.tables)

    def as_dict(self) -> dict[str, Any]:
        """Tables and headlines for results.json."""
        return {
            "tables": [table.as_dict() for table in self.tables],
            "headlines": [asdict(headline) for headline in self.headlines],
        }

    @classmethod
    def from_dict(cls, entry: dict[str, Any]) -> Report:
        """The report that `as_dict` gave."""
        headlines = tuple(Headline(**line) for line in entry["headlines"])
        return cls(tuple(Table.from_dict(table) for table in entry["tables"]), headlines)


def summary(headlines: Iterable[Headline]) -> Table:
    """One table of all headlines."""
    words = {None: "", True: "met", False: "**missed**"}
    rows = tuple((line.what, line.outcome, line.target, words[line.met]) for line in headlines)
    return Table("Targets, and what was measured.", tuple(map(Column, ("what", "measured", "target", ""))), rows)


def between_markers(text: str, name: str, replacement: str, maker: str = "benchmarks") -> str | None:
    """`text` with what stands between the markers of `name` replaced, every other character kept; None without both.

    maker  the script, or the lot of them, that the markers name as the one that makes what stands between
    """
    opening, closing = f"<!-- {maker}:{name} -->", f"<!-- /{maker}:{name} -->"
    before, first, rest = text.partition(opening)
    _, second, after = rest.partition(closing)
    return f"{before}{opening}\n{replacement}\n{closing}{after}" if first and second else None


def write_into(file: Path, name: str, replacement: str, maker: str = "benchmarks") -> bool:
    """Put `replacement` between the markers of `name` in `file`; False, and nothing done, without file or markers."""
    text = file.read_bytes().decode() if file.exists() else ""
    after = between_markers(text, name, replacement, maker)
    if after is None:
        return False
    if after != text:
        write_whole(file, after)
    return True


def read_results(file: Path) -> dict[str, Any]:
    """All entries of results.json, by the name of the benchmark; none if there is no such file yet."""
    if not file.exists():
        return {}
    results: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return results


def write_results(file: Path, name: str, entry: dict[str, Any]) -> None:
    """Set the entry of one benchmark in results.json; the others stay as they were last measured."""
    results = {**read_results(file), name: entry}
    write_whole(file, json.dumps(dict(sorted(results.items())), indent=1, allow_nan=False) + "\n")


def write_whole(file: Path, text: str) -> None:
    """Write a file whole or not at all: beside its place first, then moved there, with the old one's permissions."""
    mode = file.stat().st_mode & 0o777 if file.exists() else 0o644
    handle, temporary = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}-")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(text.encode())
        os.chmod(temporary, mode)
        os.replace(temporary, file)
    except BaseException:
        os.unlink(temporary)
        raise
