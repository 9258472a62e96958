"""How many lines of each computing room tests run as plain Python, from what `make coverage` left: all must reach 95 %.

The rooms and the least share stand in pyproject.toml, under [tool.coverage.report]. With --write the table goes into
docs/tests.md.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from coverage import Coverage
from coverage.exceptions import NoDataError

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "tests.md"
#: Files of a room with the most lines that do not run, named beside it.
NAMED = 3


def main() -> int:
    """Print the table; 1 if a room is below the least share, or if there is nothing to count."""
    parser = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    parser.add_argument("--write", action="store_true", help=f"write the table into {PAGE.relative_to(ROOT)}")
    given = parser.parse_args()
    rooms, least = counted()
    poor = [room for room, files in rooms.items() if share(files.values()) < least]
    text = table(rooms)
    print(text)
    if poor:
        print(f"below {least:g} %: {', '.join(poor)}", file=sys.stderr)
    if given.write:
        from benchmarks.tables import write_into

        if not write_into(PAGE, "lines", text):
            raise SystemExit(f"{PAGE} has no place for the table")
    return 1 if poor else 0


def counted() -> tuple[dict[str, dict[str, tuple[int, int]]], float]:
    """Lines, and lines that did not run, of every file of every room; and the least share wanted, %."""
    coverage = Coverage(data_file=str(ROOT / ".coverage"), config_file=str(ROOT / "pyproject.toml"))
    coverage.load()
    rooms: dict[str, dict[str, tuple[int, int]]] = {}
    for pattern in coverage.get_option("report:include") or []:
        folder = (ROOT / pattern).parent
        files = rooms.setdefault(folder.name, {})
        for file in sorted(folder.rglob("*.py")):
            try:
                _, statements, _, missing, _ = coverage.analysis2(str(file))
            except NoDataError:
                raise SystemExit(f"nothing is known of {file.relative_to(ROOT)}; run make coverage first") from None
            files[file.name] = len(statements), len(missing)
    return rooms, float(coverage.get_option("report:fail_under") or 0.0)


def share(files) -> float:
    """Lines that run of (lines, missing), %."""
    lines, missing = (sum(column) for column in zip(*files, strict=True))
    return 100.0 * (1.0 - missing / lines)


def table(rooms: dict[str, dict[str, tuple[int, int]]]) -> str:
    """The table as Markdown."""
    from benchmarks.tables import Column, Table

    rows = []
    for room, files in rooms.items():
        worst = sorted(files, key=lambda name: -files[name][1])[:NAMED]
        named = ", ".join(f"`{name}` {files[name][1]}" for name in worst if files[name][1])
        lines = sum(count for count, _ in files.values())
        rows.append((f"`{room}`", lines, share(files.values()), named or "none"))
    every = [each for files in rooms.values() for each in files.values()]
    rows.append(("together", sum(count for count, _ in every), share(every), ""))
    columns = (Column("room"), Column("lines", "d"), Column("run, %", ".1f"), Column("most lines not run"))
    return Table("Lines of the computing rooms that run as plain Python:", columns, tuple(rows)).markdown()


if __name__ == "__main__":
    sys.exit(main())
