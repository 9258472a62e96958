"""Readers against changed files: only errors of ours. `make torture` has very many more of them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import fuzzing
from splinefeed.errors import SplinefeedError

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


@pytest.mark.parametrize("kind", [each for each in fuzzing.SUFFIXES if each not in fuzzing.KEPT])
def test_sound_files_of_each_kind_are_read(tmp_path: Path, kind: str) -> None:
    """Changes of files that are refused as they are would reach little."""
    read = fuzzing.reader(kind, tmp_path)
    refused = []
    sound = list(fuzzing.seeds(kind, tmp_path))
    for k, content in enumerate(sound):
        (file := tmp_path / f"sound{k}{'.bin' if kind in fuzzing.DRAWINGS else fuzzing.SUFFIXES[kind]}").write_bytes(
            content
        )
        try:
            read(file, False)
        except SplinefeedError as error:
            refused.append(str(error))
    assert len(refused) <= len(sound) // 2, refused
