"""Readers against changed files: only errors of ours. `make torture` has very many more of them."""

from __future__ import annotations

from pathlib import Path

import pytest

import fuzzing

SEED = 20_261_122


@pytest.mark.parametrize("kind", ["svg", "json", "airfoil", "csv", "npz", "h5"])  # others have samples of their own
def test_changed_files_end_in_curves_or_in_our_errors(tmp_path: Path, kind: str) -> None:
    assert fuzzing.fuzz(kind, SEED, 40, tmp_path).startswith(f"{kind}: 40 inputs")
