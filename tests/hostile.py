"""What strangers' files cost: small ones that ask for much, and changed ones by the thousand, as tables for the docs.

    python tests/hostile.py --small --bounds --kills 125 --count 1000 --seed 1 --write

Each file is read by a process of its own with SECONDS and MEMORY. It has to end by an answer or by one line that
names the file: exit code 0, 1 or 2. `--write` puts the tables into docs/security.md.
"""

from __future__ import annotations

import argparse
import fcntl
import json
import re
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from benchmarks.tables import Column, Table, write_into  # noqa: E402 - found from here only

import beyond_bounds  # noqa: E402
import command_kills  # noqa: E402
import fuzzing  # noqa: E402

PAGE = ROOT / "docs" / "security.md"
#: s and bytes of address space that a process has, and s for files as large as a bound lets them be.
SECONDS, MEMORY, PATIENCE = 20, 2 * 2**30, 120
DXF = "0\nSECTION\n2\nENTITIES\n{}0\nENDSEC\n0\nEOF\n"
SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm" viewBox="0 0 9 9">{}</svg>'

#: A subprogram that is called for ever, or nearly so, a label that is jumped to for ever, and names of many digits.
CALLS = "%\nO1\nG21 G90\nM98 P2 L99999999\nM30\nO2\nG91 G1 X1. F100.\nM99\n%\n"
JUMP = "0 BEGIN PGM A MM\n1 L X+0 F100\n2 LBL 1\n3 FN 9: IF +0 EQU +0 GOTO LBL 1\n4 END PGM A MM\n"
WORDS = f"G21\no{'9' * 5000} sub\no{'9' * 5000} endsub\nM2\n"


def entities() -> str:
    """Entities of entities: ten times ten times ... letters."""
    named = '<!ENTITY a "aaaaaaaaaa">' + "".join(
        f'<!ENTITY {name} "{f"&{before};" * 10}">' for before, name in zip("abcdefghi", "bcdefghij", strict=True)
    )
    return f"<!DOCTYPE svg [{named}]>" + SVG.format("<style>&j;</style>")


def uses() -> str:
    """Uses of groups of uses: ten to the ninth paths."""
    groups = "".join(f'<g id="g{k}">' + f'<use href="#g{k + 1}"/>' * 10 + "</g>" for k in range(9))
    return SVG.format(groups + '<path id="g9" d="M0 0H1"/>')


def css() -> str:
    """A style with a number of thousands of digits."""
    return SVG.format(f"<style>rect{{x:{'9' * 5000}}}</style><rect width='1' height='1'/>")


def entity(kind: str, tags: str) -> str:
    """One entity of a drawing at 0, 0."""
    return DXF.format("\n".join(["0", kind, "10", "0", "20", "0", *tags.split(), ""]))


def blocks(depth: int, each: int) -> str:
    """Blocks that insert each other and draw nothing."""
    reference = "0\nINSERT\n8\n0\n2\nb{}\n10\n0\n20\n0\n"
    inside = "".join(
        f"0\nBLOCK\n2\nb{k}\n70\n0\n10\n0\n20\n0\n{reference.format(k + 1) * (each if k < depth else 0)}0\nENDBLK\n"
        for k in range(depth + 1)
    )
    return f"0\nSECTION\n2\nBLOCKS\n{inside}0\nENDSEC\n" + DXF.format(reference.format(0))


def fit_points(count: int, splines: int = 1) -> str:
    """Splines through so many points each."""
    rows = "".join(f"11\n{k}\n21\n{k * k % 17}\n31\n0\n" for k in range(count))
    return DXF.format(f"0\nSPLINE\n8\n0\n70\n8\n71\n3\n74\n{count}\n{rows}" * splines)


def same_places(count: int) -> str:
    """A table of points that goes back and forth between twenty places."""
    return "\n".join(f"{k * k % 19} {k * k * k % 17} {k * 7 % 5}" for k in range(count))


def runs() -> str:
    """A sweep of more runs than an index holds."""
    values = ", ".join(map(str, range(1, 3001)))
    names = ("feed", "acceleration", "jerk", "deceleration", "deceleration_jerk", "chord_error")
    return 'sources = ["circle"]\n[grid]\n' + "".join(f'"limits.{name}" = [{values}]\n' for name in names)


#: What each file asks, its name, its text, and the words of the command before its name.
CASES: tuple[tuple[str, str, Callable[[], str], tuple[str, ...]], ...] = (
    ("SVG: a row of digits in points", "points.svg", lambda: SVG.format(f'<polyline points="{"9" * 1000}x"/>'), ()),
    ("SVG: a transform without an end", "transform.svg", lambda: SVG.format(f'<g transform="{"a(" * 1000}"/>'), ()),
    ("SVG: entities of entities", "entities.svg", entities, ()),
    ("SVG: CSS with a number of 5,000 digits", "css.svg", css, ()),
    ("SVG: uses of uses", "uses.svg", uses, ()),
    ("DXF: blocks of blocks, all empty", "blocks.dxf", lambda: blocks(6, 10), ()),
    ("DXF: an arc of 1e308 degrees", "arc.dxf", lambda: entity("ARC", "40 1 50 1e308 51 0"), ()),
    ("DXF: a count of 1e400", "count.dxf", lambda: entity("LWPOLYLINE", "90 1e400"), ()),
    ("DXF: 20,000 fit points", "fit.dxf", lambda: fit_points(20_000), ()),
    ("DXF: nine splines of 9,999 fit points", "nine.dxf", lambda: fit_points(9_999, 9), ()),
    ("DXF: 50,000 fit points", "fit50.dxf", lambda: fit_points(50_000), ()),
    ("G-code: a row of digits, --repair", "digits.ngc", lambda: "X" + "9" * 2000 + "\n", ("--repair",)),
    ("G-code: a loop without an end", "loop.ngc", lambda: "o1 while [1]\no1 endwhile\nM2\n", ()),
    ("Fanuc: a subprogram 99,999,999 times", "calls.nc", lambda: CALLS, ()),
    ("Fanuc: G2, X, Z, K again and again", "arcs.nc", lambda: "%\nO1\n" + "G2XZK" * 800 + "\nM30\n", ()),
    ("Heidenhain: a jump back to itself", "jump.h", lambda: JUMP, ()),
    ("O-words with numbers of 5,000 digits", "word.ngc", lambda: WORDS, ()),
    ("DXF: 8,000 lines from one point", "lines.dxf", lambda: DXF.format("".join(
        f"0\nLINE\n10\n0\n20\n0\n11\n{k % 97}\n21\n{k % 89}\n" for k in range(8000))), ()),
    ("JSON: 60,000 keys, one twice", "keys.json", lambda: "{" + "".join(
        f'"k{k}": 1,' for k in range(60_000)) + '"k59999": 1}', ()),
    ("points: the same places again and again", "places.csv", lambda: same_places(2000), ()),
    ("sweep: keys of 20,000 words", "keys.toml", lambda: f"limits.{'a.' * 20_000}b = 1\n", ("sweep",)),
    ("sweep: a number of 5,000 digits", "digits.toml", lambda: f"seed = {'9' * 5000}\n", ("sweep",)),
    ("sweep: 7e20 runs", "runs.toml", runs, ("sweep",)),
    ("sweep: a pattern over /proc", "proc.toml", lambda: 'sources = ["/proc/**/*.dxf"]\n', ("sweep",)),
)  # fmt: skip


def cost(command: list[str], folder: Path, most: int = SECONDS) -> tuple[int, float, float, str]:
    """Exit code, s of processor time, MB, and what it says, of a command."""
    done = subprocess.run(
        [sys.executable, "-c", MEASURED, *command], cwd=folder, capture_output=True, text=True, check=False,
        timeout=20 * most, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (most, most + 1)),
    )  # fmt: skip
    found = re.search(r"^cost ([\d.]+) (\d+)$", done.stderr, re.MULTILINE)
    seconds, peak = (float(found[1]), int(found[2]) / 2**20) if found else (float("nan"), float("nan"))
    said = [line for line in done.stderr.splitlines() if line.startswith("splinefeed: ") and line[-3:] != " s)"]
    return done.returncode, seconds, peak, said[-1].removeprefix("splinefeed: ") if said else ""


MEASURED = f"""
import atexit, resource, sys, time
resource.setrlimit(resource.RLIMIT_AS, ({MEMORY}, resource.getrlimit(resource.RLIMIT_AS)[1]))
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
atexit.register(lambda: print("cost", time.process_time(), peak(), file=sys.stderr))
from splinefeed.cli.main import main
main()
"""


#: Cost of each file, by what it is.
Costs = dict[str, tuple[Any, ...]]
COST = (Column("bytes", ",d"), Column("exit code", "d"), Column("s", ".1f"), Column("MB", ".0f"))


def asked(folder: Path, only: str) -> Costs:
    """What small files cost that ask for much: those in whose name `only` stands."""
    rows: Costs = {}
    for what, name, make, words in CASES:
        if only in what:
            (folder / name).write_text(text := make())
            command = [words[0], name] if words[:1] == ("sweep",) else ["info", name, *words]
            rows[what] = (len(text), *cost(command, folder)[:3])
    return rows


def beyond(folder: Path, only: str) -> Costs:
    """What files beyond each bound of the page cost."""
    for name, text in beyond_bounds.BESIDE.items():
        (folder / name).write_text(text)
    rows: Costs = {}
    for what, name, make, words in beyond_bounds.BOUNDS:
        if only in what:
            make(file := folder / name)
            code, seconds, memory, said = cost([word.format(name) for word in words], folder, PATIENCE)
            rows[what] = (file.stat().st_size, code, seconds, memory)
            print(what, *rows[what], said, sep=" | ", file=sys.stderr, flush=True)
            file.unlink()
    return rows


def of_small(rows: Costs, page: str) -> Table:
    """The table of small files that ask for much; rows that were not measured now are those of the page."""
    caption = (
        f"Small files that ask for much, each in a process with {SECONDS} s of processor time and {MEMORY // 2**30} GB."
    )
    known = merged("what it asks", [what for what, *_ in CASES], rows, page)
    return Table(caption, (Column("what it asks"), *COST), known, ("Starting takes some 0.4 s and 60 MB of it.",))


def of_bounds(rows: Costs, page: str) -> Table:
    """The table of files beyond each bound, and the tests of those bounds that no file reaches."""
    held = [
        f"- {what}: {', '.join(f'`tests/{test}`' for test in tests)}." for what, tests in beyond_bounds.HELD.items()
    ]
    known = merged("a file with", [what for what, *_ in beyond_bounds.BOUNDS], rows, page)
    return Table("Files at or beyond the bounds of the table above.", (Column("a file with"), *COST), known,
                 ("Held by tests where no file reaches the bound:", "", *held))  # fmt: skip


def merged(first: str, names: list[str], rows: Costs, page: str) -> tuple[tuple[Any, ...], ...]:
    """Rows in the order of `names`: those measured, and others as the page has them."""
    before = {name: more for name, *more in rows_of(page, first)}
    there = {name: rows.get(name) or before.get(name.replace(",", "")) for name in names}
    return tuple((name, *more) for name, more in there.items() if more)


#: Kinds that libraries in C or our reader of binary structures read: ten times as many.
MANY = ("mat", "h5", "parquet", "step", "iges", "3dm")


def counted(kind: str, seed: int, count: int) -> tuple[Any, ...]:
    """What came of changed files of one kind: how many were read and refused, and what took longest."""
    asked = count * 10 if kind in MANY else count
    words = [sys.executable, str(ROOT / "tests" / "fuzzing.py"), kind, str(seed), str(asked)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    found = re.search(r"(\d+) inputs, (\d+) read, the slowest ([\d.]+) s, peak (\d+) MB", done.stdout)
    if found is None:
        print(done.stderr[-600:], file=sys.stderr)
        return (kind, asked, None, None, 1, None, None, seed)
    inputs, read = int(found[1]), int(found[2])
    return (kind, inputs, read, inputs - read, 0, float(found[3]), int(found[4]), seed)


def counts(rows: dict[str, tuple[Any, ...]]) -> Table:
    """The table of changed files by kind."""
    known = tuple(rows[kind] for kind in fuzzing.SUFFIXES if kind in rows)
    total = sum(int(row[1] or 0) for row in known)
    columns = (Column("reader"), Column("files", ",d"), Column("read", ",d"), Column("refused in one line", ",d"),
               Column("anything else", "d"), Column("slowest, s", ".1f"), Column("MB", "d"),
               Column("from seed", "d"))  # fmt: skip
    return Table(f"{total:,} changed files: what came of them.", columns, known)


def killed(seed: int, count: int) -> Table:
    """The table of commands that signals ended."""
    rows = []
    for name in command_kills.COMMANDS:
        words = [sys.executable, str(ROOT / "tests" / "command_kills.py"), str(seed), str(count), name]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        seen = json.loads(done.stdout.split(" ", 1)[1]) if done.returncode == 0 else {}
        if done.returncode:
            print(done.stderr[-2000:], file=sys.stderr)
        rows.append(
            (name, *(seen.get(each.name, 0) for each in command_kills.SIGNALS), int(done.returncode != 0), seed)
        )
    columns = (Column("command"), *(Column(each.name, "d") for each in command_kills.SIGNALS),
               Column("with a file that is not whole, or a row lost", "d"), Column("from seed", "d"))  # fmt: skip
    total = sum(sum(row[1:4]) for row in rows)
    return Table(f"{total:,} commands ended by a signal at a random moment.", columns, tuple(rows))


def put(name: str, make: Callable[[str], Table]) -> Table:
    """Put a table, made from the page as it is, into docs/security.md; others that do so wait."""
    with PAGE.open("r+", encoding="utf-8") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        table = make(PAGE.read_text(encoding="utf-8"))
        assert write_into(PAGE, name, table.markdown(), "tests/hostile.py"), f"{PAGE} has no place for {name}"
    return table


def rows_of(page: str, first: str) -> list[tuple[Any, ...]]:
    """The rows of the table of a page whose first column is `first`."""
    found = re.search(rf"^\| {first} .*\n\|[-| :]+\n((?:\|.*\n)+)", page, re.MULTILINE)
    lines = [[cell.strip().replace(",", "") for cell in line.strip("|").split("|")] for line in
             (found[1] if found else "").splitlines()]  # fmt: skip
    return [(name, *(None if cell == "-" else float(cell) if "." in cell else int(cell) for cell in rest))
            for name, *rest in lines]  # fmt: skip


def main() -> int:
    """Run as a program: see above."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000, help="changed files of each kind (1000)")
    parser.add_argument("--kind", choices=fuzzing.SUFFIXES, action="append", help="these kinds alone; the others stay")
    parser.add_argument("--small", action="store_true", help="try the small files that ask for much, too")
    parser.add_argument("--only", default="", help="of these files those in whose name this stands; the others stay")
    parser.add_argument("--bounds", action="store_true", help="try files beyond each bound, too")
    parser.add_argument("--kills", type=int, default=0, help="end so many of each command by signals (0)")
    parser.add_argument("--seed", type=int, default=1, help="of the changes (1)")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/security.md")
    given = parser.parse_args()
    tables: list[Table] = []
    bad = False
    for wanted, name, measure, table in (
        (given.small, "much", asked, of_small),
        (given.bounds, "bounds", beyond, of_bounds),
    ):
        if wanted:
            with tempfile.TemporaryDirectory() as folder:
                costs = measure(Path(folder), given.only)
            bad |= any(row[1] not in (0, 1, 2) for row in costs.values())
            tables.append(table(costs, PAGE.read_text(encoding="utf-8")))
            _ = given.write and put(name, partial(table, costs))
    if given.kills:
        tables.append(killed(given.seed, given.kills))
        bad |= any(row[4] for row in tables[-1].rows)
        _ = given.write and put("killed", lambda page: tables[-1])
    rows: dict[str, tuple[Any, ...]] = {}
    for kind in (given.kind or list(fuzzing.SUFFIXES)) if given.count else []:
        rows[kind] = row = counted(kind, given.seed, given.count)
        print(*row, file=sys.stderr, flush=True)
        if given.write:  # each as it comes; kinds that are not counted now keep their rows
            put("counted", lambda page, row=row: counts({each[0]: each for each in [*rows_of(page, "reader"), row]}))
        bad |= bool(row[4])
    print("\n\n".join(each.markdown() for each in [*tables, *([counts(rows)] if rows else [])]))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
