"""Every reader against a hundred thousand changed files: only errors of ours, each in bounded time and memory."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import fuzzing
import splinefeed

KINDS = ["dxf", "svg", "json", "airfoil", "gcode", "step", "iges", "3dm", "csv", "npz", "h5"]
INPUTS, SEED = 100_000, 20_261_122


@pytest.mark.parametrize("kind", ["svg", "json", "airfoil", "csv", "npz", "h5"])  # others have samples of their own
def test_changed_files_end_in_curves_or_in_our_errors(tmp_path: Path, kind: str) -> None:
    assert fuzzing.fuzz(kind, SEED, 40, tmp_path).startswith(f"{kind}: 40 inputs")


@pytest.mark.torture
@pytest.mark.timeout(0)
@pytest.mark.parametrize("kind", KINDS)
def test_a_hundred_thousand_changed_files_under_limits(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    home = str(Path(splinefeed.__file__).parent.parent)
    done = subprocess.run(
        [sys.executable, fuzzing.__file__, kind, str(SEED), str(INPUTS)],
        env={**os.environ, "PYTHONPATH": home}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    with capsys.disabled():
        print(done.stdout.strip())


@pytest.mark.torture
@pytest.mark.timeout(0)
@pytest.mark.parametrize("kind", ["dxf", "svg", "json", "airfoil", "gcode"])
def test_inputs_found_by_coverage(kind: str, tmp_path: Path) -> None:
    """Atheris looks for inputs that reach lines not reached before, from the sound files on (extra `torture`)."""
    pytest.importorskip("atheris")
    home = str(Path(splinefeed.__file__).parent.parent)
    target = Path(fuzzing.__file__).with_name("fuzzing_by_coverage.py")
    done = subprocess.run(
        [sys.executable, str(target), kind, str(tmp_path), f"-runs={INPUTS}", f"-seed={SEED % 2**31}",
         "-timeout=60", "-rss_limit_mb=6000", "-max_len=8000", "-verbosity=0"],
        env={**os.environ, "PYTHONPATH": home}, capture_output=True, text=True, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
