"""Every extra resolves, from wheels alone, to the versions of constraints.txt on every Python that is promised.

Needs a package registry. pip reads the markers of packages for the Python that runs it, so what a package asks for on
another Python alone is not seen here.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from package.pins import BUILD, FILE, SETS, pins
from package.test_dependencies import PROJECT

#: The first of each; Debian 12 has 3.11.2.
PYTHONS = ("3.11.2", "3.12", "3.13", "3.14")
EXTRAS = PROJECT["optional-dependencies"]
#: (extra, Python) of what only developers use and has no wheels there.
MISSING = {("bench", "3.14")}


def plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def constraints() -> dict[str, str]:
    """Package to version, as constraints.txt has them."""
    return {plain(name): version for name, version in pins().items()}


def test_every_package_has_hashes_and_every_set_what_its_extras_ask_for() -> None:
    lines = [line for line in FILE.read_text(encoding="utf-8").splitlines() if line[0] != "#"]
    line = re.compile(r"([\w.-]+)==[\w.]+( ; [^#]*?)?(?: --hash=sha256:[0-9a-f]{64})+  # ((?:\w+ ?)+)")
    found = [line.fullmatch(each) for each in lines]
    assert all(found) and {each[1] for each in found if each} == pins().keys()
    for name, extras in SETS.items():
        there = {plain(each[1]) for each in found if each and name in each[3].split()}
        own = [of_all(f"splinefeed[{extra}]") for extra in extras]
        asked = [*BUILD, *PROJECT["dependencies"], *(line for lines in own for line in lines)]
        assert {plain(re.split(r"[<>=!\[; ]", line)[0]) for line in asked} <= there, name


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("version", PYTHONS)
@pytest.mark.parametrize("extra", [None, *EXTRAS])
def test_an_extra_resolves_to_the_constraints(extra: str | None, version: str, tmp_path: Path) -> None:
    if (extra, version) in MISSING:
        pytest.skip("no wheels yet")
    asked = [*PROJECT["dependencies"], *(EXTRAS[extra] if extra else ())]
    asked = [each for line in asked for each in (of_all(line) if line.startswith("splinefeed[") else [line])]
    known = tmp_path / "known.txt"  # of versions alone: with hashes pip takes no names without
    known.write_text("".join(f"{name}=={version}\n" for name, version in constraints().items()))
    words = [
        *(
            sys.executable,
            "-m",
            "pip",
            "--disable-pip-version-check",
            "install",
            "--quiet",
            "--dry-run",
            "--report",
            "-",
        ),
        *("--ignore-installed", "--only-binary=:all:", "--python-version", version, "--target", tmp_path),
        *("--constraint", known, *asked),
    ]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    found = {
        plain(each["metadata"]["name"]): each["metadata"]["version"] for each in json.loads(done.stdout)["install"]
    }
    assert found.keys() >= {plain(re.split(r"[<>=!\[; ]", line)[0]) for line in asked}
    pinned = constraints()
    assert {name: version for name, version in found.items() if pinned.get(name) != version} == {}


def of_all(line: str) -> list[str]:
    """What `splinefeed[a,b]` asks for."""
    names = line.partition("[")[2].rstrip("]").split(",")
    lines = [each for name in names for each in EXTRAS[name]]
    return [each for line in lines for each in (of_all(line) if line.startswith("splinefeed[") else [line])]
