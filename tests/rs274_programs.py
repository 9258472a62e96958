"""Count LinuxCNC's own test programs and samples that move here as in its interpreter: the table of docs/programs.md.

    git clone https://github.com/LinuxCNC/linuxcnc && python tests/rs274_programs.py linuxcnc

Programs alike are counted once. A program is run in a copy of its folder, so that it finds its subprograms.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from rs274_held import compare, ours, tool_table
from rs274_twin import run
from splinefeed.programs.gcode.tools import Tools

#: Folders of LinuxCNC's repository that hold programs, and how their names end.
FOLDERS, SUFFIXES = ("nc_files", "tests"), (".ngc", ".nc", ".tap")
#: Tools that the programs may call for, in inches.
TABLE = "".join(f"T{n} P{n} Z{0.1 * n:.1f} D.02\n" for n in range(1, 51))
EQUAL, INCHES, BOTH, NO_END, ITS, OURS, DIFFERS, LONG = (
    "equal", "equal where it begins in inches", "both refuse", "no end: only it refuses", "only it refuses",
    "only we refuse", "differs", "no end of time",
)  # fmt: skip


def programs(checkout: Path) -> Iterator[Path]:
    """Its programs, those with the same text once."""
    seen: set[bytes] = set()
    for folder in FOLDERS:
        for file in sorted((checkout / folder).rglob("*")):
            if file.suffix in SUFFIXES and file.is_file() and not file.is_symlink():
                digest = hashlib.sha256(file.read_bytes()).digest()
                if digest not in seen:
                    seen.add(digest)
                    yield file


def verdict(file: Path, tools: tuple[Path, Tools]) -> tuple[str, str]:
    """What becomes of a program here and there, and why."""
    try:
        twin = run(file, tools[0])
    except subprocess.TimeoutExpired:
        return LONG, ""
    try:
        moves, message = ours(file, tools[1])
        if message and twin.error:
            return BOTH, f"{message} | {twin.error}"
        if message:
            return OURS, message
        if twin.error:
            ended = "file ended" in twin.error.lower()
            return (NO_END if ended else ITS), twin.error
        compare(moves, twin, file)
    except AssertionError as error:
        return (INCHES if _equal_in_inches(file, tools) else DIFFERS), str(error).replace("\n", " ")[:200]
    return EQUAL, ""


def _equal_in_inches(file: Path, tools: tuple[Path, Tools]) -> bool:
    """Whether the program moves as in a LinuxCNC that is in inches when it begins."""
    begun = file.with_name("begun-in-inches.ngc")
    begun.write_text("G20\n" + file.read_text(errors="replace"))
    try:
        compare(ours(file, tools[1])[0], run(begun, tools[0]), file)
    except AssertionError:
        return False
    return True


def main(checkout: Path) -> None:
    """Print each program that is not equal, and the counts."""
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "copy"
        tools = tool_table(Path(folder), TABLE)
        for each in FOLDERS:
            shutil.copytree(checkout / each, copy / each, symlinks=False, ignore_dangling_symlinks=True)
        for file in programs(copy):
            what, why = verdict(file, tools)
            found[what] += 1
            if what not in (EQUAL, BOTH, NO_END):
                print(f"{what}: {file.relative_to(copy)}: {why.replace(str(copy), '')}", flush=True)
    for what, count in found.most_common():
        print(f"{count:5d} {what}")
    print(f"{found.total():5d} programs")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
