"""Maps of rooms, the docstrings of their __init__, name every file; pages name no file that is not there."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from docs_pages import PAGES, ROOT, name

SOURCE = ROOT / "src/splinefeed"
ROOMS = sorted(file.parent for file in SOURCE.rglob("*/__init__.py") if file.parent != SOURCE)
#: What a map may name beside files of its own room: rooms, and functions and records of the API.
OTHERS = {room.name for room in ROOMS} | {"sf"}
#: Scripts that pages have the reader write.
OWN: set[str] = set()


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: str(room.relative_to(SOURCE)))
def test_a_map_names_what_is_there(room: Path) -> None:
    text = ast.get_docstring(ast.parse((room / "__init__.py").read_text(encoding="utf-8"))) or ""
    named = set(re.findall(r"`([a-z_0-9]+)/?`", text))
    groups = re.findall(r"`([a-z_0-9]+)\*`", text)  # `dxf*`: all files that begin so
    there = {
        each.stem
        for each in room.iterdir()
        if each.name not in ("__init__.py", "__pycache__") and (each.suffix == ".py" or each.is_dir())
    }
    left_out = {name for name in there - named if not name.startswith(tuple(groups))}
    assert not left_out, f"{room.name}: the map leaves out {sorted(left_out)}"
    assert not named - there - OTHERS, f"{room.name}: the map names {sorted(named - there - OTHERS)}"


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_pages_name_files_that_are_there(page: Path) -> None:
    """`planner/rows.py` from the package, the tests or the docs; `rows.py` anywhere."""
    if name(page).startswith(("docs/decisions/", "CHANGELOG.md")):
        return  # what was, in the names of its day
    roots = [ROOT, SOURCE, *(ROOT / folder for folder in ("src", "tests", "docs", "benchmarks"))]
    everywhere = {
        file.name
        for root in (SOURCE, *(ROOT / folder for folder in ("tests", "docs", "benchmarks")))
        for file in root.rglob("*.py")
    }
    for said in set(re.findall(r"`((?:[a-z_0-9]+/)*[a-z_0-9]+\.py)`", page.read_text(encoding="utf-8"))) - OWN:
        found = said in everywhere if "/" not in said else any((root / said).is_file() for root in roots)
        assert found, f"{name(page)} names {said}, which is not there"
