"""Readers against changed files: only errors of ours. `make torture` has very many more of them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import fuzzing

SEED = 20_261_122


@pytest.mark.parametrize("kind", ["svg", "json", "airfoil", "csv", "npz", "h5"])  # others have samples of their own
def test_changed_files_end_in_curves_or_in_our_errors(tmp_path: Path, kind: str) -> None:
    assert fuzzing.fuzz(kind, SEED, 40, tmp_path).startswith(f"{kind}: 40 inputs")


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(fuzzing.SUFFIXES))
def test_each_reader_is_led_by_the_lines_that_it_runs(tmp_path: Path, kind: str) -> None:
    """Some seconds each, a minute or two in all; `make torture` goes on for as long as one likes."""
    program = str(Path(fuzzing.__file__))
    done = subprocess.run(
        [sys.executable, program, kind, str(SEED + 1), "150"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-800:]
    assert done.stdout.startswith(f"{kind}: 150 inputs")
