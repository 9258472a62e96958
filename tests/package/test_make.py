"""What `make` says to a Python that it cannot use: one line, and what to do."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from docs_pages import ROOT

pytestmark = pytest.mark.skipif(
    os.name != "posix" or shutil.which("make") is None, reason="no make, or no shell of POSIX"
)
INSTEAD = "or name another Python: make PYTHON=python3.12"


def told(folder: Path, python: str) -> list[str]:
    """The lines of `make` that fails to make an environment with that Python, without make's own."""
    shutil.copy(ROOT / "Makefile", folder)
    (folder / "pyproject.toml").touch()
    (folder / "constraints.txt").touch()
    made = subprocess.run(["make", "run", f"PYTHON={python}"], cwd=folder, capture_output=True, text=True, check=False)
    assert made.returncode == 2
    assert not (folder / ".venv").exists()
    return [line for line in (made.stdout + made.stderr).splitlines() if not line.startswith("make: ")]


def faked(folder: Path, code: str) -> str:
    """A Python in which `code` has run before what it is asked."""
    file = folder / "python3"
    file.write_text(f"#!/bin/sh\nexec {sys.executable} -c \"$(printf '%s\\n' '{code}' \"$2\")\"\n")
    file.chmod(0o755)
    return "./python3"


@pytest.mark.parametrize(("version", "name"), [((3, 10), "3.10"), ((3, 15), "3.15")])
def test_a_python_too_old_or_too_new(tmp_path: Path, version: tuple[int, int], name: str) -> None:
    python = faked(tmp_path, f"import sys; sys.version_info = (*{version}, 0)")
    assert told(tmp_path, python) == [
        f"splinefeed: needs Python 3.11 to 3.14, and ./python3 is {name}; "
        f"on Debian 12: apt-get install python3 python3-venv; {INSTEAD}"
    ]


def test_debians_python_without_venv(tmp_path: Path) -> None:
    python = faked(tmp_path, 'import sys; sys.modules["ensurepip"] = None')
    assert told(tmp_path, python) == [
        f"splinefeed: ./python3 cannot make environments; on Debian: apt-get install python3-venv; {INSTEAD}"
    ]


def test_no_python(tmp_path: Path) -> None:
    assert told(tmp_path, "python3.99") == [
        f"splinefeed: there is no python3.99; on Debian: apt-get install python3 python3-venv; {INSTEAD}"
    ]
