"""What a program does not tell of its control is asked for: signs of two controls, and words that mean two things."""

from __future__ import annotations

from pathlib import Path

import pytest

import splinefeed as sf
from gcode_programs import detect, path_of, program, refusal
from splinefeed.errors import FormatError
from splinefeed.programs.gcode.dialects import DIALECTS, SIGNS, Sign, first_sign, not_read, recognized

#: Of each sign, in its order, a program that it is the first to tell.
SHOWN = (
    "0 BEGIN PGM PART MM\nL X+1 FMAX\n",
    "PRINT_START BED=60\nG1 X1\n",
    "N10 CR=5\n",
    "$H\nG1 X1\n",
    "O<part> sub\nO<part> endsub\n",
    "(post: Mach3)\nG1 X1\n",
    "; Mach4 mill\nG1 X1\n",
    "(HAAS VF-2)\nG1 X1\n",
    "O1234\nG1 X1\n",
    "M10 P1\nG1 X1\n",
    "(for grbl)\nG1 X1\n",
    ";FLAVOR:Marlin\nG1 X1\n",
    "G1 X1 E0.5\n",
    "(FANUC 18M)\nG1 X1\n",
)


@pytest.mark.parametrize(("sign", "text"), [*zip(SIGNS, SHOWN, strict=True)], ids=[sign.dialect for sign in SIGNS])
def test_every_sign_can_be_found(sign: Sign, text: str) -> None:
    assert first_sign(text.encode())[0] is sign
    assert recognized(text.encode())[0] is DIALECTS[sign.dialect]


def test_every_dialect_has_a_sign() -> None:
    assert {sign.dialect for sign in SIGNS} == set(DIALECTS)


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
        "mach4, printer, marlin, klipper; nothing shows which control the program is for: name it (option dialect)"
    )
    for dialect, seconds in (("linuxcnc", float(number)), ("fanuc", 1e-3 * float(number))):
        path = path_of(tmp_path, *lines, dialect=dialect)
        assert [marker.dwell for marker in path.markers] == [pytest.approx(seconds)]


@pytest.mark.parametrize(
    ("code", "control"),
    [
        ("G187 P2", "haas"),
        ("G505", "siemens"),
        ("G29", "printer"),
        ("G12 I5", "haas, mach3 and mach4"),
        ("G68.2 X0", "fanuc and haas"),
    ],
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


def test_repeats_of_a_cycle_are_no_places_without_a_point(tmp_path: Path) -> None:
    begin = ["O0109", "G21 G17 G90", "G0 X0. Y0. Z50.", "G99 G81 X10. Y0. Z-20. R2. F120.", "G91 X10. K3", "G80", "M30"]
    assert not [each for each in path_of(tmp_path, *begin).findings if "without a decimal point" in each]
    arc = ["O0109", "G21 G18 G90", "G0 X0. Y0. Z0.", "G2 X10. Z0. I5. K0 F100.", "G2 X0. Z0. I-5. K0", "G1 X5", "M30"]
    assert [each for each in path_of(tmp_path, *arc).findings if "as X5," in each]


def test_a_code_that_the_control_has_and_that_is_not_read_is_said_so(tmp_path: Path) -> None:
    said = refusal(tmp_path, "G21 G90", "G70 I25. J0 L6", dialect="haas")
    assert said == "line 2: G70 is a code of Haas that is not read; let the CAM system write its moves"


def test_a_short_number_where_a_program_begins_is_a_fanucs() -> None:
    for text in ("%\nO77\nG0 X1\n", "O5 (PART)\nG0 X1\n", "\r\n%\r\no12\r\nG0 X1\r\n"):
        assert detect(text.encode()).name == "fanuc", text
    for text in ("O77 sub\nO77 endsub\n", "G0 X1\nO77\n", "O<a> call\n", "o10 if [1]\n"):
        assert detect(text.encode()).name == "linuxcnc", text


@pytest.mark.parametrize(
    ("dialect", "lines"),
    [
        ("mach3", ["( for Mach2/3 from Vectric )", "G00G21G17G90G40G49G80", "G71G91.1"]),  # Vectric's post
        ("grbl", ["$H", "[ESP800]", "M62 P0", "G1 X60 F1000"]),  # FluidNC has M62
        ("linuxcnc", ["(v1.6-sheetcam)", "F#<_hal[plasmac.cut-feed-rate]>", "M190 P3", "G1 X1"]),  # no printer's M190
        ("linuxcnc", ["M190 P3", "M3 $0 S1", "G1 X60"]),
        ("linuxcnc", ["M190 P3", "M66 P3 L3 Q1", "G1 X60"]),
    ],
)
def test_programs_of_posts_are_told(dialect: str, lines: list[str]) -> None:
    assert detect("\n".join(lines).encode()).name == dialect


@pytest.mark.parametrize(
    ("lines", "dialect"),
    [
        (["(Mach3 post)", "M98 P2000", "M30", "O2000", "G1 X1", "M99"], "mach3"),  # subprograms of Mach3 have an O
        (["(Mach3Turn)", "G1 X1"], "mach3"),
        (["(Mach4 Mill)", "G1 X1"], "mach4"),
        (["( FANUC 18M )", "G21 G90", "G1 X1. F90."], "fanuc"),
        (["; post: Fanuc", "G1 X1. F90."], "fanuc"),
        (["N10 MCALL CYCLE81(10,0,2,-5) ; drill", "X10"], "siemens"),
        (["(CYCLE 1) (X=10)", "G1 X1"], "linuxcnc"),
        (["START_PRINT BED=60", "PARK X=3", "G1 X1 F90"], "klipper"),
        (["G1 X1 F90 (machine 30, not Mach 33)"], "linuxcnc"),
    ],
)
def test_words_that_show_a_control(lines: list[str], dialect: str) -> None:
    assert detect("\n".join(lines).encode()).name == dialect


def test_mach3_has_the_unit_of_a_wait_as_a_setting_and_comments_behind_percent(tmp_path: Path) -> None:
    """Using Mach3Mill, 1.84-A2: 5.6.3 and 10.7.4, G4; 10.5.5, comments."""
    lines = ["%", "(Mach3)", "% O0001 X9", "G1 X10 F60", "G4 P2", "%", "X20", "M30"]
    path = path_of(tmp_path, *lines)
    assert path.length == 20.0 and sum(each.dwell for each in path.markers) == 2.0
    assert [each for each in path.findings if each.startswith("times P are taken in s; a setting of Mach3 makes them")]


def test_times_of_fanuc_with_a_point_are_said_in_cycles_too(tmp_path: Path) -> None:
    lines = ["G21 G90", "G0 X0. Y0. Z5.", "G82 X10. Z-5. R2. {} F100."]
    dwells = {}
    for word in ("P500", "P0.5"):
        path = path_of(tmp_path, "O1000", *[line.format(word) for line in lines])
        dwells[word] = sum(each.dwell for each in path.markers)
        assert any("with a decimal point is taken in s" in each for each in path.findings) == ("." in word)
    assert dwells == {"P500": 0.5, "P0.5": 0.5}


def test_a_peck_of_fanuc_without_a_point_is_said(tmp_path: Path) -> None:
    lines = ["O1000", "G21 G90", "G0 X0. Y0. Z5.", "G83 X10. Z-6. R0. Q2000 F100."]
    whole = path_of(tmp_path, *lines)
    assert any(each.startswith("Q, the depth of a peck, without a decimal point") for each in whole.findings)
    parts = path_of(tmp_path, *lines, increments=True)
    assert len(parts.curves) > len(whole.curves) and not any(each.startswith("Q,") for each in parts.findings)


def test_mach4_has_times_by_the_point_and_numbers_as_they_are(tmp_path: Path) -> None:
    """Mach4 Mill Programming Guide 1.1, build 3775, pp. 8, 10, 57 (P, X1 = X1.0, cycles), 17 (G4), 45 (G54.1)."""
    lines = [
        "(Mach4)",
        "G21 G90 G54",
        "G0 X0 Y0 Z5",
        "G4 P500",
        "G4 P2.0",
        "G4 X100",
        "G82 X10 Z-5 R2 P200 F100",
        "G80",
        "M30",
    ]
    path = path_of(tmp_path, *lines)
    assert [each.dwell for each in path.markers if each.dwell] == [0.5, 2.0, 0.1, 0.2]
    assert not [each for each in path.findings if "decimal point" in each or "increments" in each]
    shifted = path_of(tmp_path, "(Mach4)", "G21 G90 G10 L20 P2 X50", "G54.1 P2 G1 X5 F60")
    assert shifted.length == 55.0
    assert "not read" in refusal(tmp_path, "(Mach4)", "G0 X0 Y0", "G13 I5 F60")


def test_a_wait_by_x_of_fanuc_without_a_point_is_said(tmp_path: Path) -> None:
    lines = ["O1000", "G21 G90", "G0 X0. Y0.", "G1 X5. F90.", "G4 X2000"]
    taken = path_of(tmp_path, *lines)
    assert any(each.startswith("X of G4 without a decimal point is taken in s") for each in taken.findings)
    parts = path_of(tmp_path, *lines, increments=True)
    assert [sum(each.dwell for each in path.markers) for path in (taken, parts)] == [2000.0, 2.0]


UNREAD = {
    "an Okuma OSP": [["$PART1.MIN%", "O1000"], ["N1 G15 H1", "G0 X0"], ["G0 X0", "VC1=10"], ["CALL OBORE"]],
    "a Centroid": [
        ['G65 "c:\\cncm\\probe.cnc" A1'],
        ["IF #4201 || #4202 THEN GOTO 100"],
        ["<PREVENT_LOOK_AHEAD>"],
        ["M115 /Z-2 P5"],
        ["IF #A == 1 THEN M200"],
    ],
    "a Fadal": [["#V1=0"], ["#:LOOP", "G0 X1"], ["#PRINT V1"]],
    "a Sinumerik 810 to 880": [["%MPF1234", "N10 G0 X0"]],
    "a Heidenhain in DIN/ISO": [["%PART G71 *", "N10 G30 G17 X+0 Y+0 Z-20 *"], ["N10 G30 G17 X+0 Y+0 Z-20"]],
    "WinCNC": [["[VECTRIC CNC OUTPUT FOR CAMASTER]", "G0 X1"]],
}


@pytest.mark.parametrize(("name", "lines"), [(name, lines) for name, each in UNREAD.items() for lines in each])
def test_a_control_that_is_not_read_is_named(tmp_path: Path, name: str, lines: list[str]) -> None:
    """After TD-4242, corbinstreehouse (Centroid), LaserWing/ProbeKit (Fadal), dillonhuff/gpr (WinCNC) and manuals."""
    said = refusal(tmp_path, "G21 G0 X0 Y0", *lines, "G1 X9 F100")
    assert said.startswith(f"is a program for {name} (") and "which is not read; post it for one of linuxcnc" in said


@pytest.mark.parametrize(
    "line", ["(VC1= is Okuma's)", "O100 CALL", "#<vc1> = 3", "G15", "#1=[2+3]", "[1]", "%", "IF [#1 EQ 2] THEN #2=3"]
)
def test_what_others_write_shows_none_of_them(line: str) -> None:
    assert not_read(f"G21 G0 X0\n{line}\nG1 X9 F100\n".encode()) == ""


def test_a_program_in_din_iso_is_one_under_any_name(tmp_path: Path) -> None:
    file = program(tmp_path, "%PART G71 *", "N10 G30 G17 X+0 Y+0 Z-20 *", "N40 G00 G40 G90 Z+50 M3 *", name="part.i")
    with pytest.raises(FormatError, match="is a program for a Heidenhain in DIN/ISO"):
        sf.read(file)


def test_an_equal_fault_of_one_line_counts_once(tmp_path: Path) -> None:
    path = path_of(tmp_path, ";FLAVOR:Marlin", "G00 G90 G21 X1 F600", "G1 X10", start=(0, 0, 0))
    (found,) = [each for each in path.findings if "one after the other" in each]
    assert found.endswith(": line 2")


def test_the_sign_of_a_dialect_is_named_in_its_own_line():
    assert recognized(b"G21\nG28  X   ; home X\n\n\nG1 X5 F60\n")[1] == "'G28 X' in line 2"
