"""Tool tables, and what G43, T and M6 make of them; `test_linuxcnc_interpreter` holds the moves against LinuxCNC."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import splinefeed as sf
from gcode_programs import path_of, program, refusal
from splinefeed.errors import FormatError
from splinefeed.formats.long_files import read_parts
from splinefeed.programs.gcode.tools import read_tools

TBL = "T1 P1 D6 Z+50.5 ;drill\n\nt2 p12 x1.5 A90 Z-.5 I10 Q1\n; T3\n"
TABLE = "T1 P1 Z50.5 D6.35\nT2 P2 X1.5 Z-.5 A90\n"


def table(folder: Path, text: str, name: str) -> Path:
    file = folder / name
    file.write_text(text)
    return file


def test_a_table_is_read_as_linuxcnc_has_it(tmp_path: Path) -> None:
    tools = read_tools(table(tmp_path, TBL, "tool.tbl")).by_number
    assert list(tools) == [1, 2]
    assert tools[1].offset.tolist() == [0, 0, 50.5, 0, 0, 0, 0, 0, 0] and tools[1].diameter == 6.0
    assert tools[2].offset.tolist() == pytest.approx([1.5, 0, -0.5, math.pi / 2, 0, 0, 0, 0, 0])


def test_lengths_shift_the_path(tmp_path: Path) -> None:
    lines = ["G0 X0 Z60", "T1 M6", "G43 H1 G0 Z10", "T2", "G1 X5 F600", "M6", "G43", "X6 Z3", "G49 X0 Z0"]
    tools = table(tmp_path, TABLE, "tools.tbl")
    file = program(tmp_path, *lines)
    path = sf.read(file, start=(0, 0, 0), tools=tools)
    assert path.axes == ("x", "z", "a") or path.axes == ("x", "z")
    assert [curve.control_points[-1][:2].tolist() for curve in path.curves] == [
        [0, 60], [0, 60.5], [5, 60.5], [7.5, 2.5], [0, 0],
    ]  # fmt: skip
    parts = list(read_parts(file, start=(0, 0, 0), tools=tools))
    assert sum(part.length for part in parts) == pytest.approx(path.length)
    bare = path_of(tmp_path, *lines)
    assert bare.curves[1].control_points[-1].tolist() == [0, 10] and not bare.dwells
    assert any("the path is that of the tool tip, as programmed (option tools)" in each for each in bare.findings)


def test_tables_are_changed_by_the_program(tmp_path: Path) -> None:
    """L1 says the offset, L10 the place in the system in force, L11 that in G59.3; M61 names the tool that is there."""
    tools = table(tmp_path, TABLE, "tools.tbl")
    begin = ["G10 L2 P9 X2 Z1", "G10 L2 P1 X4", "G0 X1 Z9"]  # the tool at X5 Z9 of the machine
    for word, x, z in (("L1 X1 Z3", 1, 3), ("L10 X1 Z3", 0, 6), ("L11 X1 Z3", 2, 5)):
        path = path_of(tmp_path, *begin, f"G10 P1 {word}", "M61 Q1", "G43", "G0 X0 Z0", tools=tools)
        assert path.curves[-1].control_points[-1].tolist() == [4 + x, z]
    assert [marker.text for marker in path.markers] == ["M61 Q1"]
    assert refusal(tmp_path, "M61 Q5", tools=tools).startswith("line 1: tool 5 is not in the tool table")
    assert refusal(tmp_path, "M61") == "line 1: M61 needs Q"


def test_reference_places_may_be_given(tmp_path: Path) -> None:
    path = path_of(tmp_path, "G0 X5 Z2", "G28 Z9", "G1 X1 F60", "G30", offsets="G28=-1,0,30;G30=7")
    ends = [curve.control_points[-1].tolist() for curve in path.curves]
    assert ends == [[5, 2], [5, 9], [5, 30], [1, 30], [7, 0]]


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("T9 M6", "tool 9 is not in the tool table, which has T1, T2; add it there"),
        ("X1 F1 T9", "tool 9 is not in the tool table, which has T1, T2; add it there"),
        ("G43 H3", "tool 3 is not in the tool table, which has T1, T2; add it there"),
        ("G43.2", "G43.2 needs H, or axes, and not both"),
    ],
)
def test_a_tool_that_is_missing(tmp_path: Path, line: str, reason: str) -> None:
    tools = table(tmp_path, TBL, "tool.tbl")
    assert refusal(tmp_path, "G1 X5 F60", line, "X7", tools=tools) == f"line 2: {reason}"


@pytest.mark.parametrize(
    ("text", "name", "reason"),
    [
        ("T1 Z5\nZ5 D3\n", "a.tbl", "line 2: expected T1 P1 Z50.2 D6, got 'Z5 D3'"),
        ("T1 Z5 hello\n", "a.tbl", "line 1: expected T1 P1 Z50.2 D6, got 'T1 Z5 hello'"),
        ("T1 Z5\nT1 Z6\n", "a.tbl", "line 2: T1 appears twice, or is not a tool number"),
        ("T1 Z1e9\n", "a.tbl", "line 1: expected T1 P1 Z50.2 D6"),
        ("T1 Z99999999999\n", "a.tbl", "line 1: a word is beyond 1e+09"),
    ],
)
def test_tables_that_cannot_be_read(tmp_path: Path, text: str, name: str, reason: str) -> None:
    file = table(tmp_path, text, name)
    with pytest.raises(FormatError) as error:
        read_tools(file)
    assert str(error.value).startswith(f"{file}: {reason}") and "\n" not in str(error.value)
