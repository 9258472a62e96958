"""What public programs of people who run the machine showed (docs/gcode-public-programs.md)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import detect, path_of, program, refusal, said


@pytest.mark.parametrize("line", ["$I  ; View build info", "$$", "$G", "$X", "$#", "$N0=G54", "$J=G91 X5 F100", "$C"])
def test_commands_to_grbl_show_it_and_move_nothing(tmp_path: Path, line: str) -> None:
    assert detect(f"{line}\nG1 X10 F600\n".encode()).name == "grbl"
    path = path_of(tmp_path, line, "?  ; View current status", "G1 X10 F600")
    assert path.length == 10.0
    assert any("lines that begin with $" in each for each in path.findings)


def test_a_name_behind_a_dollar_is_another_control_s() -> None:
    assert detect(b"$PART.MIN%\nG1 X1\n").name == "linuxcnc"
    assert detect(b"$GROUP\nG1 X1\n").name == "linuxcnc"


def test_a_bare_g5_of_a_slicer_moves_nothing(tmp_path: Path) -> None:
    path = path_of(tmp_path, ";FLAVOR:Marlin", "M82", "G1 X10 F600", "G5", "G1 X20 E1")
    assert path.length == 20.0
    assert any("G5 (1)" in each for each in path.findings)


def test_an_arc_by_k_in_the_plane_of_a_lathe_shows_one(tmp_path: Path) -> None:
    wrong = refusal(tmp_path, "G97 S220 M3", "G0 X205. Z10.", "G1 Z0. F0.1", "G3 X206. Z-.366 I0. K-.6")
    assert wrong.startswith("line 4: an arc of X, Z and K without G18 shows a lathe's program")
    assert path_of(tmp_path, "G18 G0 X0 Z0", "G1 X10 F60", "G3 X5 Z5 I0 K5").length > 10.0


def test_p_of_a_deep_hole_waits_on_a_haas_and_is_no_word_of_a_fanuc(tmp_path: Path) -> None:
    lines = ("G90 G21 S500 M3", "G0 X0. Y0. Z5.", "G83 X0. Y0. Z-4. R1. Q2. P500 F100.", "G80", "M30")
    haas = path_of(tmp_path, *lines, dialect="haas")
    assert sum(marker.dwell for marker in haas.markers) == 0.5
    fanuc = path_of(tmp_path, *lines, dialect="fanuc")
    assert sum(marker.dwell for marker in fanuc.markers) == 0.0
    assert any("P of G83 is left out" in each for each in fanuc.findings)
    assert haas.length == fanuc.length


def test_an_arc_whose_centre_is_a_place_is_said_to_be_one(tmp_path: Path) -> None:
    wrong = refusal(tmp_path, "O0001", "G0 X40. Y19.", "G1 X28. F600.", "G2 X30. Y15. I25. J15.")
    assert wrong.endswith("as the centre's place, not the way to it, its words fit: write G90.1")
    assert path_of(tmp_path, "G90.1", "G0 X40. Y19.", "G1 X28. F600.", "G2 X30. Y15. I25. J15.").length > 10.0
    assert "G90.1" not in refusal(tmp_path, "O0001", "G0 X40. Y19.", "G1 X28. F600.", "G2 X30. Y15. I31. J2.")


def test_variables_of_a_siemens_post_are_numbers_where_they_are_used(tmp_path: Path) -> None:
    path = path_of(
        tmp_path, "; SINUMERIK", "N10 DEF REAL _A, _B=5, _C", "DEF INT _N=2", "_A=10 _C=-3", "N5 G71 G90 G1 F600 X0 Y0",
        "G1 X=_A Y=_B", "X=-_C Y=-_A", "_A=20", "N60 X=_A", "SETMS(1)", "M30",
    )  # fmt: skip
    assert path.ends[:, 1].tolist() == [[10.0, 5.0], [3.0, -10.0], [20.0, -10.0]]


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["DEF REAL A1[3]"], "arrays are not supported"),
        (["DEF REAL _A", "G1 X=_B F60"], "_B has no value; set it in the program before it is used"),
        (["DEF REAL _A", "_B=_A*2", "G1 X=_A F60"], "_B= is not supported in a Siemens program"),
    ],
)
def test_what_computes_in_a_siemens_program_is_refused(tmp_path: Path, lines: list[str], reason: str) -> None:
    assert reason in refusal(tmp_path, "; SINUMERIK", *lines)


USUAL = [
    "N10 G1 X=AC( 5 ) Y2 F600", "Z = -1 X=IC(-2.5)", "G91", "X1 Y=AC(7)", "G2 X=IC(4) Y0 I=AC(5.5) J=IC(0)", "G90",
    "G0 X=5", "G01 A3 B=90 F=300 Y-.5",
]  # fmt: skip


def test_usual_lines_of_siemens_are_what_they_are_word_by_word(tmp_path: Path) -> None:
    """A line that only moves is read by two patterns; a label before it leads to the words one by one."""
    usual = path_of(tmp_path, "; SINUMERIK", *USUAL)
    labels = [f"A_LABEL{i}: {line}" if line[0] != "N" else line for i, line in enumerate(USUAL)]
    assert said(path_of(tmp_path, "; SINUMERIK", *labels)) == said(usual)
    places = [curve.control_points[-1][:3].tolist() for curve in usual.curves]
    assert places == [[5, 2, 0], [2.5, 2, -1], [3.5, 7, -1], [7.5, 7, -1], [5, 7, -1], [5, -0.5, -1]]


def test_a_usual_line_of_siemens_may_say_the_tool_axis(tmp_path: Path) -> None:
    lines = ["TRAORI", "G0 X0 Y0 Z5 A3=0 B3=0 C3=1", "G1 X9 A3 = .5 C3=2 F600", "Y5 B3=-1 C3=1"]
    path = sf.read(program(tmp_path, "; SINUMERIK", *lines))
    labels = sf.read(program(tmp_path, "; SINUMERIK", *[f"A_LABEL{i}: {line}" for i, line in enumerate(lines)]))
    for each in (path, labels):
        assert isinstance(each, sf.ToolPath)
        last = each.tool_axis[-1].control_points[-1]
        assert (last / np.linalg.norm(last)).tolist() == pytest.approx([0.0, -(0.5**0.5), 0.5**0.5])
    assert path.length == labels.length == 14.0


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("G1 X1 X2 F60", "X appears twice"),
        ("G1 X AC(5) F60", "AC( is a call"),
        ("G1 X5 F=AC(60)", "F=AC( is not supported"),
        ("G1 X5.2.3 F60", "expected a word"),
        ("G2 X5 I2.5 F60 A3=1", "given with an arc"),
    ],
)
def test_lines_of_siemens_that_are_not_usual(tmp_path: Path, line: str, reason: str) -> None:
    assert reason in refusal(tmp_path, "; SINUMERIK", "TRAORI", "G0 X0 Y0", line)
