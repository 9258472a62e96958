"""Files of public repositories: their whole length is what another library says (`tests/reference_lengths.py`).

`tests/data/public_files.json` says of each where it is from, its licence and its length. Some stand in
`tests/data/public`; the others are read too where they lie as `build/public-files/OWNER+REPOSITORY/PATH`.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import pytest

from reference_lengths import length
from splinefeed.formats.registry import read_all

DATA = Path(__file__).parents[1] / "data"
FILES: dict[str, dict[str, Any]] = json.loads((DATA / "public_files.json").read_text())
FOLDERS = [DATA / "public", DATA.parents[1] / "build" / "public-files"]
SAME = 1e-6


THERE = {name: folder / name for name in FILES for folder in FOLDERS if (folder / name).is_file()}


@pytest.mark.parametrize("name", THERE)
def test_a_public_file_is_as_long_as_another_library_says(name: str) -> None:
    assert hashlib.sha256(THERE[name].read_bytes()).hexdigest() == FILES[name]["sha256"]
    total = sum(path.length for path in read_all(THERE[name]))
    assert total == pytest.approx(FILES[name]["length_mm"], rel=SAME)


@pytest.mark.slow
@pytest.mark.parametrize("name", THERE)
def test_the_page_has_the_lengths_of_those_libraries(name: str) -> None:
    assert length(THERE[name]) == pytest.approx(FILES[name]["length_mm"], rel=1e-9)


def test_every_file_kept_here_is_on_the_page() -> None:
    kept = {str(file.relative_to(DATA / "public")) for file in (DATA / "public").rglob("*") if file.is_file()}
    assert kept and kept <= set(FILES)
