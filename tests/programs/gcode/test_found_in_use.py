"""What public programs of people who run the machine showed (docs/gcode-dialects.md, "Programs of others")."""

from __future__ import annotations

from pathlib import Path

import pytest

from gcode_programs import path_of, refusal
from splinefeed.programs.gcode.dialects import detect


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
