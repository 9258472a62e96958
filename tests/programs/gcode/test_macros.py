"""Fanuc's macros: IF, GOTO, WHILE and THEN. Source: B-64484EN, "Custom macro", "Branch and repetition"."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from gcode_programs import path_of, refusal, said

BEGIN = ("O0116", "G90 G54", "G01 Y0 F100.")


def places(folder: Path, *lines: str) -> list[str]:
    """Where the moves lead in X."""
    return [each[1:].split()[0] for each in said(path_of(folder, *BEGIN, *lines, "M30")) if each[0] == "F"]


@pytest.mark.parametrize(
    ("lines", "wanted"),
    [
        (["#100=5", "N10 G01 X#100", "#100=#100+5", "IF[#100LT20]GOTO10"], ["5", "10", "15"]),  # macro-executor#45
        (["#1=0", "WHILE[#1 LT 3] DO1", "#1=#1+1", "X#1", "END1", "X9."], ["1", "2", "3", "9"]),
        (["#1=0", "WHILE[#1LT2]DO1", "#2=0", "WHILE[#2LT2]DO2", "X[#1*10+#2+1]", "#2=#2+1", "END2", "#1=#1+1", "END1"],
         ["1", "2", "11", "12"]),
        (["#1=0", "while[#1lt1]do1", "#1=1", "X1.", "end1", "WHILE[#1LT2]DO1", "#1=2", "X2.", "END1"], ["1", "2"]),
        (["#1=3", "IF[#1EQ3]THEN #2=7", "IF[#1NE3]THEN #2=8", "X#2"], ["7"]),
        (["GOTO 20", "X1.", "N20 X2."], ["2"]),
        (["#1=20", "GOTO#1", "X1.", "N0020 X2.", "N30 GOTO[#1*2]", "X3.", "N40 X4."], ["2", "4"]),
        (["#1=0", "DO1", "#1=#1+1", "IF[[#1GE2]AND[#1LT9]]GOTO5", "X#1", "END1", "N5 X7."], ["1", "7"]),
        (["IF[1EQ2]GOTO 99", "(GOTO 98)", "X1. (END1)"], ["1"]),
    ],
)  # fmt: skip
def test_branches_and_loops(tmp_path: Path, lines: list[str], wanted: list[str]) -> None:
    assert places(tmp_path, *lines) == wanted


def test_lines_are_those_of_the_program_that_jumps(tmp_path: Path) -> None:
    sub = ("O0200", "GOTO 10", "X5.", "N10 X6.", "M99")
    lines = (*BEGIN, "M98 P200", "GOTO 10", "X1.", "N10 X2.", "M30", *sub)
    assert [each for each in said(path_of(tmp_path, *lines)) if each[0] == "F"] == ["F6 0", "F2 0"]


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["GOTO 99"], "line 4: GOTO 99: no line of the program begins with N99"),
        (["GOTO 1.5"], "line 4: GOTO 1.5: expected the number of a line (N)"),
        (["WHILE[1EQ1]DO1", "X1."], "line 4: DO1 has no END1 after it"),
        (["END2"], "line 4: END2 has no DO2 before it"),
        (["WHILE[1EQ1]", "END1"], "line 4: WHILE needs DO1, DO2 or DO3 at the end of its line"),
        (["IF[1EQ1] X5."], "line 4: IF[..]: expected GOTO or THEN, got 'X5.'"),
        (["IF[#107EQ1]GOTO1"], "line 4: #107 has no value; set it in the program before it is used"),
        (["DO1", "END1"], "more than 300000 jumps are executed; is there an endless loop near here?"),
        (["G66 P9000 X1."], "line 4: G66 is a modal macro call, which is not supported; write plain lines"),
    ],
)
def test_what_leads_nowhere_is_refused(tmp_path: Path, lines: list[str], reason: str) -> None:
    assert reason in refusal(tmp_path, *BEGIN, *lines)


def test_other_controls_have_no_such_jumps(tmp_path: Path) -> None:
    assert "jumps and loops of macros are not supported" in refusal(
        tmp_path, "#1=1", "IF[#1EQ1]GOTO10", dialect="linuxcnc"
    )


def test_thousands_of_turns(tmp_path: Path) -> None:
    begin = time.perf_counter()
    lines = ("#1=0", "WHILE[#1LT5000]DO1", "G01 X[10*COS[#1*7]] Y[10*SIN[#1*7]]", "#1=#1+1", "END1")
    assert len(path_of(tmp_path, *BEGIN, *lines).curves) > 4990
    assert time.perf_counter() - begin < 5.0
