"""A program resumed at a line: what is left of it is what the whole program does from there on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import path_of, program, refusal, said
from splinefeed.formats.long_files import read_parts
from splinefeed.programs.gcode.overview import summary

PROGRAM = (
    "T3 M6", "S900 M3 M8", "G20 G91 F10", "G10 L2 P1 X1", "G54 G0 X1 Y2 Z3", "G1 X.5", "Y.25 Z-.1", "G2 X.2 I.1",
    "#1=0", "o1 while [#1 lt 3]", "G1 X.1", "#1=[#1+1]", "o1 endwhile", "G81 X1 Z-1 R-1 L2", "X2", "G80", "G21 G90 F90",
    "o2 sub", "G1 X[#1*2]", "Y9", "o2 endsub", "o2 call [4]", "G0 X50", "M5", "G95 F.1 M4 S800", "G1 X60 Y0",
    "G41.1 D2",
    "X70", "Y20", "G40", "G1 X0", "M2", "G0 X1",
)  # fmt: skip


@pytest.mark.parametrize("line", [1, 5, 6, 7, 8, 11, 12, 14, 17, 19, 20, 22, 23, 26, 31])
def test_the_rest_of_a_program_is_as_in_the_whole(tmp_path: Path, line: int) -> None:
    whole, rest = path_of(tmp_path, *PROGRAM), path_of(tmp_path, *PROGRAM, from_line=line)
    left = len(whole.curves) - len(rest.curves)
    assert left >= 0
    for a, b in zip(list(whole.curves)[left:], rest.curves, strict=True):
        columns = [whole.axes.index(axis) for axis in rest.axes]
        assert np.asarray(b.control_points) == pytest.approx(np.asarray(a.control_points)[:, columns], abs=1e-12)
    assert whole.feeds is not None
    assert rest.feeds is not None
    assert np.array_equal(whole.feeds[left:], rest.feeds)
    if line > 5:
        assert said(rest)[0] == ("T3 M6 S900 M3 M8" if line < 24 else "T3 M6 S800 M4 M8")
        assert any(f"line {line}: the program is resumed with the tool at X" in each for each in rest.findings)


def test_long_stretches_are_cut_at_the_line(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    lines = ["F100", *(f"G1 X{x:.3f} Y{y:.3f}" for x, y in rng.uniform(-9, 9, (400, 2)))]
    whole, rest = path_of(tmp_path, *lines), path_of(tmp_path, *lines, from_line=311)
    assert [c.control_points.tolist() for c in list(whole.curves)[309:]] == [
        c.control_points.tolist() for c in rest.curves
    ]
    file = program(tmp_path, *lines)
    assert sum(len(part.curves) for part in read_parts(file, from_line=311).make()) == len(rest.curves)
    assert summary(file, from_line=311).moves["G1"] == len(rest.curves) == 91


def test_where_the_tool_is_the_lines_before_say(tmp_path: Path) -> None:
    file = program(tmp_path, "G0 X5", "G0 Y6 Z7", "G1 X9 F60", "Y8")
    path = sf.read(file, from_line=4)
    assert [each.control_points.tolist() for each in path.curves] == [[[6], [8]]]
    assert not any("taken as 0" in each for each in path.findings)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (34, "line 34: is never executed: the program ends before it or jumps over it; resume at another line"),
        (33, "line 33: is never executed: the program ends before it"),
        (
            15,
            "line 15: lies within a row of canned cycles (G80); resume at line 14, where that",
        ),
        (
            29,
            "line 29: lies within cutter compensation (G41, G42); resume at line 27, where that begins, or after its",
        ),
        (0, "from_line: '0' is not a line number; lines count from 1"),
        ("x", "from_line: 'x' is not a line number; lines count from 1"),
        (True, "from_line: 'True' is not a line number; lines count from 1"),
    ],
)
def test_lines_at_which_nothing_can_be_resumed(tmp_path: Path, line: object, reason: str) -> None:
    assert refusal(tmp_path, *PROGRAM, from_line=line).startswith(reason)


def test_a_line_that_is_not_carried_out(tmp_path: Path) -> None:
    lines = ["G1 X1 F1", "o1 if [0]", "G1 X2", "o1 endif", "G1 X3", "M2"]
    assert refusal(tmp_path, *lines, from_line=3).startswith("line 3: is never executed")
    assert refusal(tmp_path, "G5.2 X1 Y1 P1 L3 F1", "X2 Y0", "X3 Y1", "X4", "G5.3", from_line=3).startswith(
        "line 3: lies within a spline; resume at line 1"
    )
