"""Codes that mean something else on another control, each by that control's manual.

After the SINUMERIK 802D sl and 840D sl programming guides (G58, G59, TRANS, G70, G700), Fanuc B-64484EN (G10, G54.1,
G80, decimal point), Haas, Mill Operator's Manual (G04, G154, loops of canned cycles), pygcode#19, CAMotics#298 and
z64/cncbook.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import splinefeed as sf
from gcode_programs import detect, path_of, program, refusal, said


def feeds(path: sf.Path) -> list[float]:
    """Feeds in mm/min."""
    assert path.feeds is not None
    return [round(60.0 * feed, 6) for feed in path.feeds.tolist()]


@pytest.mark.parametrize(
    ("lines", "length", "feed"),
    [
        (["G70", "G1 X10 F500"], 254.0, 500.0),
        (["G70 F500", "G1 X10"], 254.0, 500.0),
        (["F500", "G70 G1 X10"], 254.0, 500.0),
        (["G700", "G1 X10 F500"], 254.0, 12700.0),
        (["G710", "G1 X10 F500"], 10.0, 500.0),
        (["G700 F20", "G71", "G1 X10"], 10.0, 508.0),
        (["S100 M3 G95 F0.5 G70", "G1 X10 Y0"], 254.0, 50.0),
    ],
)
def test_of_siemens_g70_leaves_the_feed_alone_and_g700_does_not(
    tmp_path: Path, lines: list[str], length: float, feed: float
) -> None:
    path = path_of(tmp_path, "; SINUMERIK 840D", "G17 G90", *lines)
    assert path.length == pytest.approx(length) and feeds(path) == [feed]


def test_siemens_shifts_the_zero_point_by_words(tmp_path: Path) -> None:
    begin = ("G54 G17 G90 G71", "G0 X0 Y0 Z5")
    path = path_of(tmp_path, *begin, "G58 X10 Y20", "G0 X0 Y0", "G1 Z-1 F200", "X20", "G59 X5", "X0", dialect="siemens")
    assert said(path) == ["T0 0 5", "T10 20 5", "F10 20 -1", "F30 20 -1", "F15 20 -1"]
    lines = ("TRANS X10", "X0", "ATRANS X5 Y1", "X0 Y0", "G59 Y2", "X1 Y0", "G59 Y3", "Y1", "TRANS", "X0 Y0")
    path = path_of(tmp_path, "G1 Y0 F60", *lines, dialect="siemens")
    assert said(path) == ["F10 0", "F15 1", "F16 3", "F16 5", "F0 0"]
    path = path_of(tmp_path, "G58", "G1 X1 F60", dialect="siemens")  # without words a system of the control
    assert said(path) == ["F1"]


def test_fanuc_sets_systems_by_g10(tmp_path: Path) -> None:
    lines = ["O0001", "G90 G10 L20 P1 X10. Y5.", "G10 L2 P1 X100.", "G91 G10 L2 P1 X1.", "G90 G10 L2 P0 Y50."]
    path = path_of(tmp_path, *lines, "G54.1 P1 G1 X1. Y0. F100.", "G54 X1. Y0.", "M30")
    assert said(path)[:2] == ["F11 55", "F102 50"]
    linuxcnc = path_of(tmp_path, "G1 X5 Y0 F60", "G10 L20 P1 X1", "X2")  # there it gives the place a value
    assert said(linuxcnc) == ["F5 0", "F6 0"]


def test_more_systems(tmp_path: Path) -> None:
    lines = ["G90 G154 P7 G0 X0. Y0.", "G1 X1. F60.", "M30"]
    path = path_of(tmp_path, "O0001", *lines, offsets="G154P7=5,1")
    assert said(path)[:2] == ["T5 1", "F6 1"] and detect(program(tmp_path, *lines).read_bytes()).name == "haas"
    assert refusal(tmp_path, "G54.1 P1 G1 X1") == "line 1: G54.1 is not known in the dialect LinuxCNC"
    wrong = refusal(tmp_path, "O0001", "G54.1 P301 G1 X1.")
    assert wrong == "line 2: G54.1 P301: coordinate systems are P1 to P300"


@pytest.mark.parametrize(
    ("word", "dialect", "wait"),
    [
        ("P2.", "haas", 2.0),
        ("P2000", "haas", 2.0),
        ("P.5", "haas", 0.5),
        ("P500", "fanuc", 0.5),
        ("X1.5", "fanuc", 1.5),
    ],
)
def test_how_long_g4_waits(tmp_path: Path, word: str, dialect: str, wait: float) -> None:
    path = path_of(tmp_path, "G1 X1. F60.", f"G04 {word}", "X2.", dialect=dialect)
    assert [each for _, each in path.dwells] == [wait]


def test_a_point_in_g4_is_said_where_the_control_has_none(tmp_path: Path) -> None:
    path = path_of(tmp_path, "G1 X1. F60.", "G04 P2.", "X2.", dialect="fanuc")
    assert path.dwells[0][1] == 2.0 and any("is taken in s" in each for each in path.findings)


def test_behind_g80_fanuc_goes_on_as_before_the_cycle(tmp_path: Path) -> None:
    begin = ["O0112", "G90 G54", "G00 X0 Y0 Z20."]
    path = path_of(tmp_path, *begin, "G98 G81 X5. Y5. Z-5. R2. F100.", "G80", "X50. Y0.", "M30", start=(0, 0, 20))
    assert said(path)[-2:] == ["T50 0 20", "M30"]
    path = path_of(tmp_path, *begin, "G1 X1. F60.", "G81 X5. Z-5. R2.", "G80 X9.", "M30", start=(0, 0, 20))
    assert said(path)[-2:] == ["F9 0 20", "M30"]
    assert "axis words without G0" in refusal(tmp_path, "G0 Z5", "G81 X5 Z-5 R2 F100", "G80", "X9")


@pytest.mark.parametrize("dialect", ["fanuc", "haas"])
def test_a_row_of_holes_goes_on_with_steps(tmp_path: Path, dialect: str) -> None:
    repeats = "K3" if dialect == "fanuc" else "L3"
    lines = ["G90 G0 X0 Z50.", "G99 G81 X10. Z-20. R2. F120.", f"G91 X10. {repeats}", "G90 G80", "G0 Z50."]
    path = path_of(tmp_path, *lines, dialect=dialect, start=(0, 0, 50))
    holes = ["T10 50", "T10 2", "F10 -20", "T10 2"]
    holes += [f"{word} {level}" for x in (20, 30, 40) for word, level in ((f"T{x}", 2), (f"F{x}", -20), (f"T{x}", 2))]
    assert said(path) == [*holes, "T40 50"]


def test_numbers_without_a_point(tmp_path: Path) -> None:
    lines = ["O0107", "G21 G17 G90 G54", "G00 X0 Y0 Z5.", "G01 Z-1. F100.", "X20. Y10000", "M30"]
    path = path_of(tmp_path, *lines, start=(0, 0, 5))
    assert path.length == pytest.approx(6.0 + (20.0**2 + 1e8) ** 0.5)
    assert any("as Y10000, are taken as mm or inches (option increments): line 5" in each for each in path.findings)
    path = path_of(tmp_path, *lines, start=(0, 0, 5), increments=True)
    assert path.length == pytest.approx(6.0 + 500.0**0.5) and said(path)[-2] == "F20 10 -1"
    assert any("as Y10000, are taken as thousandths of mm" in each for each in path.findings)
    inches = path_of(tmp_path, "O1", "G20", "G1 X10000 Y1. F1.", dialect="fanuc", increments=True)
    assert said(inches)[0] == "F25.4 25.4"


def test_words_of_m_codes_beside_moves(tmp_path: Path) -> None:  # LinuxCNC#2948, #2987, #1669; as rs274 takes them
    lines = ("G21 G90 F100", "G1 X1", "G1 X2 M67 E0 Q30", "G1 X3 M62 P1", "M64 P2 G0 X4", "X5 M66 P0 L0")
    path = path_of(tmp_path, *lines)
    assert path.length == 5.0 and said(path)[1::2] == ["M67 Q30 E0", "M62 P1", "M64 P2", "M66 P0 L0"]
    assert detect(program(tmp_path, *lines).read_bytes()).name == "linuxcnc"
    assert "P2" in refusal(tmp_path, "G1 X1 F60 P2")


def test_the_number_of_a_spindle(tmp_path: Path) -> None:
    path = path_of(tmp_path, "M3 S1000 $0", "G1 X10 F60", "M3 S5 $1", "G96 S100 D500 $0", "X11", "M5 $0")
    assert said(path) == ["S1000 M3", "F10", "G96 S100", "F11", "M5"]
    assert "spindles other than $0 are left out: line 3" in path.findings
    assert refusal(tmp_path, "G1 X1 F60 $0") == "line 1: $0 is used by no code of the line"


def test_a_slash_within_a_line_of_fanuc(tmp_path: Path) -> None:  # macro-executor#52
    lines = ("O0115", "N20 / G01 X10. F100.", "N30 G01 Y10./2 M8 (a/b)", "/ X5. (c)", "#1=6/2", "X#1", "M30")
    path = path_of(tmp_path, *lines)
    assert said(path) == ["F10 0", "M8", "F10 10", "F5 10", "F3 10", "M30"]
    assert any("a / within a line skips its rest" in each and "line 2, 3" in each for each in path.findings)
    assert "expected a letter" in refusal(tmp_path, "N20 / G1 X1", dialect="linuxcnc")


def test_macros_of_fanuc_set_parameters_without_brackets(tmp_path: Path) -> None:  # macro-executor#45
    lines = ("O0116", "#100=5", "#101=#100+5*2", "#102=-[#101-1]/2", "G01 X#100 Y#101 F100.", "X#102", "M30")
    assert said(path_of(tmp_path, *lines)) == ["F5 15", "F-7 15", "M30"]


@pytest.mark.parametrize(
    ("line", "dialect", "reason"),
    [
        ("G1 X5. F60. ,R2.", "fanuc", ",R has no line behind it"),
        ("G1 X5. F60. ,C2.", "mach3", ",C is a chamfer, which is not supported; write its moves"),
        ("G1 X5 F60 RND=3", "siemens", "RND= has no line behind it"),
        ("G1 X5 F60 CHR=-3", "siemens", "CHR=-3: the size of a corner is 0 or more"),
        ("G4 S30", "siemens", "G4 S counts turns of the spindle, whose speed is not known; write S and M3 before it"),
    ],
)
def test_what_is_refused_is_named(tmp_path: Path, line: str, dialect: str, reason: str) -> None:
    assert refusal(tmp_path, line, dialect=dialect).startswith(f"line 1: {reason}")


def test_what_posts_for_siemens_write(tmp_path: Path) -> None:
    lines = ("N10 G40 G17 G710 G94 G90 G60 FNORM", 'T="MILL_10" D1', "M6", "CYCLE800()", "S3000 M3", "G1 X50 F500")
    path = path_of(tmp_path, *lines, "G4 S30", "G1 X60", dialect="siemens")
    assert path.length == 60.0 and [wait for _, wait in path.dwells] == [pytest.approx(30 / 3000 * 60)]


def test_a_leader_of_nul_bytes(
    tmp_path: Path,
) -> None:  # a tape punched for a reader, and files that DNC software saves
    file = tmp_path / "a.nc"
    file.write_bytes(b"\0" * 40 + b"%\nO0120\nG21 G90\nG0 X0 Y0\nG1 X10 F100\nM30\n%\n" + b"\0" * 9)
    assert sf.read(file).length == 10.0
    file.write_bytes(b"G1 X1\nM30\n\0")
    assert sf.read(file, start=(0, 0, 0)).length == 1.0
    file.write_bytes(b"G21 G90\nG1 X1\nG1 X12\0\0\0")  # cut off, and filled up
    with pytest.raises(sf.errors.FormatError):
        sf.read(file, start=(0, 0, 0))


def test_what_people_write_for_siemens(tmp_path: Path) -> None:
    path = path_of(tmp_path, "G71 G90", "G1 X0 Y0 F100", "G3 X8. Y0. CR=4. F250.", dialect="siemens")
    assert path.length == pytest.approx(4.0 * math.pi)
    reason = refusal(tmp_path, "G90 G17 G71", "G41 G1 X1 Y1 F100", dialect="siemens")
    assert reason.startswith("line 2: G41 is cutter compensation, which is not read in the dialect Siemens Sinumerik")
    for line in ("EXTERN WARMUP(REAL, REAL)", "N10 PROC CUT(REAL A)", "G0 SUPA Z0", "N15 LIMS=2500"):
        assert detect(f"G90 G17\n{line}\n".encode()).name == "siemens"


def test_what_is_no_text_is_named(tmp_path: Path) -> None:
    file = tmp_path / "a.nc"
    file.write_bytes(bytes(range(256)) * 4)
    with pytest.raises(sf.errors.FormatError, match="is no text, so no G-code program: it may be encrypted"):
        sf.read(file)


@pytest.mark.parametrize("line", ["G1 X5 F1O0", "G1 X1O F100", "G1 F100 X5 O12"])
def test_a_letter_o_within_a_line_is_a_mistake(tmp_path: Path, line: str) -> None:
    assert "a letter O within a line; is it the digit 0?" in refusal(tmp_path, line)
    assert path_of(tmp_path, "N1 O12", "G1 X5. F60.", dialect="fanuc").length == 5.0


def test_comments_behind_two_slashes(tmp_path: Path) -> None:
    lines = ("O0001", "G1 X5. F60. // rough (see http://x)", "X6. (see // there)", "X7.// end", "M30")
    assert path_of(tmp_path, *lines).length == 7.0
    assert "expected a letter" in refusal(tmp_path, "G1 X5 F60 // rough", dialect="linuxcnc")


def test_the_dialect_is_named_as_a_likely_reason(tmp_path: Path) -> None:
    wrong = refusal(tmp_path, "G1 X1 F60", "G77 X2")
    assert wrong.endswith(
        "is not known in the dialect LinuxCNC; it is a code of fanuc and mach3: name the control (option dialect)"
    )


UNSAID = ["G90 G0 X0 Y0", "M3 S5000 F15", "G1 X2", "Y1"]


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc", "haas", "mach3", "mach4"])
def test_units_that_no_line_says_are_mm_with_a_finding_and_an_option(tmp_path: Path, dialect: str) -> None:
    """dberlin/vscode-centroid-gcode, recycle2.cnc: a part of 2 inches whose program has neither G20 nor G21."""
    path = path_of(tmp_path, *UNSAID, dialect=dialect)
    assert path.length == pytest.approx(3.0) and feeds(path) == [15.0, 15.0]
    assert "no line has G20 or G21: lengths are taken in mm (option units)" in path.findings
    path = path_of(tmp_path, *UNSAID, dialect=dialect, units="in")
    assert path.length == pytest.approx(76.2) and feeds(path) == [381.0, 381.0]
    assert not any("G20 or G21" in each for each in path.findings)
    assert path_of(tmp_path, "G21", *UNSAID, dialect=dialect, units="in").length == pytest.approx(3.0)
    assert not any("G20 or G21" in each for each in path_of(tmp_path, *UNSAID, units="mm").findings)


def test_units_are_known_where_the_control_has_one_or_the_program_begins_with_them(tmp_path: Path) -> None:
    for dialect in ("grbl", "marlin", "klipper"):
        assert not any("lengths are taken" in each for each in path_of(tmp_path, *UNSAID, dialect=dialect).findings)
    said = path_of(tmp_path, "; SINUMERIK 840D", *UNSAID).findings
    assert "no line has G70 or G71: lengths are taken in mm (option units)" in said


def test_moves_before_the_line_with_units_are_said(tmp_path: Path) -> None:
    path = path_of(tmp_path, "G1 X10 F100", "G20", "X1")
    assert path.length == pytest.approx(25.4)  # 10 mm, and on to 1 inch
    assert "moves before the first line with units are taken in mm (option units): line 2" in path.findings
    assert not any("before the first" in each for each in path_of(tmp_path, "G1 X10 F100", "G21", "X1").findings)


def test_units_of_a_program_are_mm_or_inches(tmp_path: Path) -> None:
    assert refusal(tmp_path, *UNSAID, units="cm") == "units: 'cm' is none of a program; give mm or in"
