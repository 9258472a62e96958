"""What a program does not tell of its control is asked for: signs of two controls, and words that mean two things."""

from __future__ import annotations

from pathlib import Path

import pytest

from gcode_programs import path_of, refusal
from splinefeed.formats.gcode.dialects import detect


@pytest.mark.parametrize(
    ("lines", "named"),
    [
        (["O1234", "G1 X10 F60", "X=20"], ["siemens ('X=' in line 3)", "fanuc ('O1234' in line 1)"]),
        (["O<part> sub", "O<part> endsub", "IF [#1 EQ 0] GOTO 10", "G1 X1 F60"], ["linuxcnc (", "fanuc ("]),
        (["$32=1", "M3 S0", "G1 X10 E0.5 F600"], ["grbl ('$32=' in line 1)", "printer ("]),
    ],
)
def test_signs_of_two_controls_are_both_named(tmp_path: Path, lines: list[str], named: list[str]) -> None:
    wrong = refusal(tmp_path, *lines)
    for each in named:
        assert each in wrong
    assert "name the control (option dialect: " in wrong


def test_a_control_that_is_named_is_not_asked_for(tmp_path: Path) -> None:
    path = path_of(tmp_path, "O1234", "G1 X10 F60", "X20 (X=30)")
    assert path.length == 20.0
    named = path_of(tmp_path, "O1234", "G4 P500", "G1 X10 F60", dialect="mach3")
    assert [marker.dwell for marker in named.markers if marker.dwell] == [500.0]


@pytest.mark.parametrize(
    ("wait", "asked"), [("P500", True), ("P100", True), ("P99", False), ("P500.", False), ("P0.5", False)]
)
def test_a_wait_that_may_be_s_or_ms_is_asked_for(tmp_path: Path, wait: str, asked: bool) -> None:
    lines = ["G1 X10 F60", f"G4 {wait}", "X20"]
    if not asked:
        path = path_of(tmp_path, *lines)
        assert [marker.dwell for marker in path.markers] == [float(wait[1:])]
        return
    number = wait[1:]
    assert refusal(tmp_path, *lines) == (
        f"line 2: G4 {wait} waits {number} s in linuxcnc, mach3, grbl, and {float(number) / 1e3:g} s in fanuc, haas, "
        "marlin; nothing shows which control the program is for: name it (option dialect)"
    )
    for dialect, seconds in (("linuxcnc", float(number)), ("fanuc", 1e-3 * float(number))):
        path = path_of(tmp_path, *lines, dialect=dialect)
        assert [marker.dwell for marker in path.markers] == [pytest.approx(seconds)]


@pytest.mark.parametrize(
    ("code", "control"),
    [("G187 P2", "haas"), ("G505", "siemens"), ("G29", "printer"), ("G12 I5", "haas"), ("G68.2 X0", "fanuc and haas")],
)
def test_a_code_that_is_not_known_names_the_controls_that_have_it(tmp_path: Path, code: str, control: str) -> None:
    wrong = refusal(tmp_path, "G1 X1 F60", code, dialect="linuxcnc")
    assert wrong.endswith(f"is not known in the dialect LinuxCNC; it is a code of {control}: name the control "
                          "(option dialect)")  # fmt: skip


@pytest.mark.parametrize(
    "line", ["N10 IF [#1 GT 2] GOTO 20", "WHILE [#1 LT 3] DO1", "G65 P9810 Z5.", "IF[#1EQ0]THEN#2=1"]
)
def test_macros_show_a_fanuc(line: str) -> None:
    assert detect(f"G1 X1\n{line}\n".encode()).name == "fanuc"
