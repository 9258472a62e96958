"""The map of each room, the docstring of its __init__: it names every file of the room, and none that is not there."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from docs_pages import ROOT

SOURCE = ROOT / "src/splinefeed"
ROOMS = sorted(file.parent for file in SOURCE.glob("*/__init__.py"))
#: What a map may name beside files of its own room: rooms, and functions and records of the API.
OTHERS = {room.name for room in ROOMS} | {"sf"}


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: room.name)
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
