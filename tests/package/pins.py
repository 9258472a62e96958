"""constraints.txt made anew: the versions that it has, the hashes of all their files, and the sets that need each.

    python tests/package/pins.py [PACKAGE==VERSION ...]

Needs uv (pip install uv) and a package registry. A package that is named gets that version; one that is new gets the
newest. Each line is a requirement with the hashes of its files for every system and Python, and behind # the sets of
the Makefile that install it.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FILE = ROOT / "constraints.txt"
#: The extras of each stamp of the Makefile.
SETS = {
    "run": ("plots",),
    "dev": ("dev", "cad", "parquet", "plots", "robots", "sim", "studio"),
    "all": ("dev", "slow", "docs", "all", "mpi"),
    "bench": ("bench", "cad", "sim"),
}
#: The build backend, and what it asks for where the project is installed in place.
BUILD = ("hatchling", "editables")
HEAD = """\
# The versions that the tests ran with and the hashes of their files, made by tests/package/pins.py: every package that
# the project, its build or its extras install, and behind # the sets of the Makefile that need it. Each has wheels for
# every Python from 3.11.0 to 3.14; tests/package/test_constraints.py asks the registry.
"""


def pins() -> dict[str, str]:
    """Package to version, as constraints.txt has them."""
    lines = FILE.read_text(encoding="utf-8").splitlines()
    return dict(re.findall(r"^([A-Za-z0-9][\w.-]*)==([^\s;]+)", "\n".join(lines), re.MULTILINE))


def of_set(extras: tuple[str, ...], versions: dict[str, str], folder: Path) -> dict[str, str]:
    """Requirement to its hashes, of all that a set installs."""
    known, build, out = (folder / name for name in ("known.txt", "build.in", "out.txt"))
    known.write_text("".join(f"{name}=={version}\n" for name, version in versions.items()))
    build.write_text("\n".join(BUILD) + "\n")
    words = ["uv", "pip", "compile", "--quiet", "--universal", "--generate-hashes", "--no-annotate", "--no-header",
             "--python-version", "3.11", "--constraint", known, *(f"--extra={each}" for each in extras),
             ROOT / "pyproject.toml", build, "--output-file", out]  # fmt: skip
    subprocess.run(words, check=True)
    lines = out.read_text(encoding="utf-8").replace("\\\n", " ").splitlines()
    found = {}
    for line in lines:
        requirement, *hashes = re.split(r" +--hash=", line.strip())
        if not requirement.startswith("splinefeed"):
            found[requirement.strip()] = " ".join(f"--hash={each.strip()}" for each in hashes)
    return found


def main() -> None:
    """Run as a program: see above."""
    versions = {**pins(), **dict(each.split("==") for each in sys.argv[1:])}
    sets: dict[str, list[str]] = {}
    hashes: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, extras in SETS.items():
            for requirement, known in of_set(extras, versions, Path(folder)).items():
                sets.setdefault(requirement, []).append(name)
                hashes[requirement] = known
    lines = [f"{each} {hashes[each]}  # {' '.join(sets[each])}\n" for each in sorted(sets, key=str.lower)]
    FILE.write_text(HEAD + "".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
