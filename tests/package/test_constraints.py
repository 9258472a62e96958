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

from docs_pages import ROOT
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
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    return {plain(name): version for name, _, version in (line.partition("==") for line in lines if line[0] != "#")}


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("version", PYTHONS)
@pytest.mark.parametrize("extra", [None, *EXTRAS])
def test_an_extra_resolves_to_the_constraints(extra: str | None, version: str, tmp_path: Path) -> None:
    if (extra, version) in MISSING:
        pytest.skip("no wheels yet")
    asked = [*PROJECT["dependencies"], *(EXTRAS[extra] if extra else ())]
    asked = [each for line in asked for each in (of_all(line) if line.startswith("splinefeed[") else [line])]
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
        *("--constraint", ROOT / "constraints.txt", *asked),
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
