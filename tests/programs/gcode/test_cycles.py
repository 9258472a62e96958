"""Canned cycles as their moves and switches; `test_linuxcnc_interpreter` holds them against LinuxCNC itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from gcode_programs import path_of, program, refusal, said
from splinefeed.programs.gcode.overview import summary

BEGIN = ("G21 G90 F600 S500 M3", "G0 X0 Y0 Z5")


def holes(folder: Path, *lines: str, **options: object) -> list[str]:
    """What `lines` add to BEGIN, which ends at 0 0 5."""
    return said(path_of(folder, *BEGIN, *lines, start=(0, 0, 9), **options))[2:]


@pytest.mark.parametrize(
    ("lines", "wanted"),
    [
        (["G98 G81 X1 Y2 Z-3 R1", "X4", "G80"],
         "T1 2 5;T1 2 1;F1 2 -3;T1 2 5;T4 2 5;T4 2 1;F4 2 -3;T4 2 5"),
        (["G99 G82 X1 Z-3 R1 P.5"], "T1 0 5;T1 0 1;F1 0 -3;P0.5;T1 0 1"),
        (["G83 X1 Z-3 R1 Q1.5"],
         "T1 0 5;T1 0 1;F1 0 -0.5;T1 0 1;T1 0 -0.246;F1 0 -2;T1 0 1;T1 0 -1.746;F1 0 -3;T1 0 1"),
        (["G73 X1 Z-3 R1 Q2 D.5"], "T1 0 5;T1 0 1;F1 0 -1;T1 0 -0.5;F1 0 -3;T1 0 1"),
        (["G98 G84 X1 Z-3 R1 P.2"], "T1 0 5;T1 0 1;F1 0 -3;M5;M4;P0.2;F1 0 5;M5;M3"),
        (["M4", "G74 X1 Z-3 R1"], "M4;T1 0 5;T1 0 1;F1 0 -3;M5;M3;F1 0 1;M5;M4"),
        (["G98 G85 X1 Z-3 R1"], "T1 0 5;T1 0 1;F1 0 -3;F1 0 1;T1 0 5"),
        (["G86 X1 Z-3 R1 P.3"], "T1 0 5;T1 0 1;F1 0 -3;P0.3;M5;T1 0 1;M3"),
        (["G98 G89 X1 Z-3 R1 P.3"], "T1 0 5;T1 0 1;F1 0 -3;P0.3;F1 0 5"),
        (["G91 G81 X1 Y1 Z-2 R-1 L2"], "T1 1 5;T1 1 4;F1 1 2;T1 1 4;T2 2 4;F2 2 2;T2 2 4"),
        (["G81 X1 Z-3 R8"], "T0 0 8;T1 0 8;F1 0 -3;T1 0 8"),
        (["G19 G98 G81 X-4 Y3 Z2 R1"], "T1 0 5;T1 3 2;F-4 3 2;T1 3 2"),
    ],
)  # fmt: skip
def test_what_a_cycle_stands_for(tmp_path: Path, lines: list[str], wanted: str) -> None:
    assert holes(tmp_path, *lines) == wanted.split(";")


def test_within_cycles_linuxcnc_keeps_to_the_path(tmp_path: Path) -> None:
    lines = [*BEGIN, "G64 P.1", "G1 X1", "G81 X2 Z-3 R1", "G0 X3"]
    path = path_of(tmp_path, *lines)
    assert path.tolerances is not None
    assert path.tolerances.tolist() == [0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.1]
    path = path_of(tmp_path, *lines, dialect="mach3")
    assert path.tolerances is not None and path.tolerances.tolist()[1:] == [0.1] * (len(path.curves) - 1)


@pytest.mark.parametrize(
    ("lines", "wanted"),
    [
        (["G76 X1. Z-3. R1. Q.2 P500"], "T1 0 5;T1 0 1;F1 0 -3;P0.5;M19;T1.2 0 -3;T1.2 0 5;T1 0 5;M3"),
        (["G99 G18 G76 X1. Y-3. R0. Q.2"], "T1 0 5;F1 -3 5;M19;T1 -3 5.2;T1 0 5.2;T1 0 5;M3"),
        (["G99 G87 X1. Z-3. R-9. Q.2 P500"],
         "T1 0 5;M19;T1.2 0 5;T1.2 0 -9;T1 0 -9;M3;F1 0 -3;P0.5;M19;T1.2 0 -3;T1.2 0 5;T1 0 5;M3"),
        (["G88 X1. Z-3. R1. P500"], "T1 0 5;T1 0 1;F1 0 -3;P0.5;M5;M0;T1 0 5;M3"),
        (["G84 X1. Z-3. R1. Q1.5 P500"],
         "T1 0 5;T1 0 1;F1 0 -0.5;M5;M4;P0.5;F1 0 1;M5;M3;F1 0 -2;M5;M4;P0.5;F1 0 1;M5;M3;F1 0 -3;M5;M4;P0.5;F1 0 1;"
         "M5;M3;T1 0 5"),
        (["G84 X1. Z-3. R1."], "T1 0 5;T1 0 1;F1 0 -3;M5;M4;F1 0 1;M5;M3;T1 0 5"),
        (["G89 X1. Z-3. R1. P500"], "T1 0 5;T1 0 1;F1 0 -3;P0.5;F1 0 1;T1 0 5"),
    ],
)  # fmt: skip
def test_cycles_that_fanuc_has(tmp_path: Path, lines: list[str], wanted: str) -> None:
    assert holes(tmp_path, *lines, dialect="fanuc") == wanted.split(";")


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("G76 X1. Z-3. R1.", "G76 needs Q"),
        ("M5 G76 X1. Z-3. R1. Q1.", "G76 needs the spindle to turn; write M3 or M4 before it"),
        ("G87 X1. Z-9. R-3. Q.2", "G87: R lies 6 mm above Z, to which it cuts"),
        ("G84 X1. Z-3. R1. Q0", "G84 Q0: the depth of a peck is greater than 0"),
    ],
)
def test_cycles_of_fanuc_that_cannot_be(tmp_path: Path, line: str, reason: str) -> None:
    assert refusal(tmp_path, *BEGIN, line, dialect="fanuc") == f"line 3: {reason}"


def test_cycles_of_fanuc_keep_their_words_and_return_to_the_initial_plane(tmp_path: Path) -> None:
    lines = ["G82 X1. Z-3. R1. P500 K0", "X2.", "G81 X3.", "G80", "G0 X9."]
    assert ";".join(holes(tmp_path, *lines, dialect="fanuc")) == (
        "T2 0 5;T2 0 1;F2 0 -3;P0.5;T2 0 5;T3 0 5;T3 0 1;F3 0 -3;T3 0 5;T9 0 5"
    )


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("G81 X1 Z-3", "G81 needs R"),
        ("G81 X1 R1", "G81 needs Z"),
        ("G81", "G81 needs the place of its hole, X, Y or Z"),
        ("G82 X1 Z-3 R1", "G82 needs P"),
        ("G83 X1 Z-3 R1", "G83 needs Q"),
        ("G83 X1 Z-3 R1 Q0", "G83 Q0: the depth of a peck is greater than 0"),
        ("G83 X1 Z-3 R1 Q.0000001", "G83 makes more than 100000 moves; drill deeper at a time (Q)"),
        ("G81 X1 Z-3 R-4", "G81: R lies 1 mm below Z, the bottom of the hole"),
        ("G81 X1 Z-3 R1 L0", "L0: repeats of G81 are whole, 1 to 10000"),
        ("G81 X1 Z-3 R1 A5", "A: G81 moves X, Y and Z only"),
        ("G81 X1 Z-3 R1 Q5", "Q5 is used by no code of the line"),
        ("G93 G81 X1 Z-3 R1 F1", "G81 cannot have feeds by inverse time; write G94"),
        ("G74 X1 Z-3 R1", "G74 needs the spindle to turn by M4"),
        ("G86 X1 Z-3 R1 P1 M5", "G86 needs the spindle to turn; write M3 or M4 before it"),
        ("G82 X1 Z-3 R1 P-1", "G82: a wait of -1 s is not possible"),
        ("G87 X1 Z-3 R1", "G87 is a canned cycle that is not supported; let the CAM system write its moves"),
    ],
)
def test_cycles_that_cannot_be(tmp_path: Path, line: str, reason: str) -> None:
    assert refusal(tmp_path, *BEGIN, line) == f"line 3: {reason}"


def test_one_line_may_stand_for_more_moves_than_are_kept_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = [*BEGIN, "G91 G83 X1 Z-20 R-1 Q.1 L3", "G80 G90 G1 X0"]
    whole = path_of(tmp_path, *lines)
    monkeypatch.setattr("splinefeed.programs.gcode.state.CAPACITY", 16)
    assert said(path_of(tmp_path, *lines)) == said(whole)
    found = summary(program(tmp_path, *lines), start=(0, 0, 0))
    assert sum(found.lengths.values()) == pytest.approx(whole.length) and found.moves["G1"] == 3 * 200 + 1
