"""3-D printers and lasers: a word moves the tool only if its command does, and what the printer waits for.

After OrcaSlicer#4211 and #1427, PrusaSlicer#7773 and #8901, Cura#13826, FlatCAM#228, klipper_estimator#66, grbl#446 and
LaserWeb4#616; values by hand from Marlin's G-code index and Klipper's "G-Codes".
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import detect, path_of, program, refusal
from splinefeed.programs.gcode.dialects import holds
from splinefeed.programs.gcode.moves import joined
from splinefeed.programs.gcode.overview import summary
from splinefeed.programs.gcode.reader import Reading


def seconds(path: sf.Path) -> float:
    """Time at the feeds of the program, dwells included."""
    assert path.feeds is not None
    lengths = np.array([curve.length for curve in path.curves])
    return float(np.sum(lengths / path.feeds)) + sum(wait for _, wait in path.dwells)


MOVES = ["G90", "M83", "G1 X10 Y10 Z0.2 F6000", "G1 X50 Y10 E1.2"]


@pytest.mark.parametrize(
    "line",
    [
        "M205 X8 Y8", "M201 X9000 Y9000 Z500 E10000", "M203 X500 Y500 Z12 E120", "M92 X80 Y80 Z400 E93", "M206 X1 Y2",
        "M17 X0.8 Y0.8 Z0.5", "M906 X800 Y800 E650", "M555 X89 Y89 W62 H52", "m201x500y500", "N12 M201 X9 Y9*55",
        "G29 P1 X30 Y0 W50 H20 C", "G80 X1", "G28 X0 Y0", "G28 W", "G42 I1 J2", "G10 S1", "G12 P1", "M84 X Y E",
        "M115 U3.13.2", 'M862.3 P "MK3S"', "M117 X marks G1 X99", "SET_VELOCITY_LIMIT ACCEL=5000",
        "EXCLUDE_OBJECT_START NAME=cube", "@pause X1", "M486 Acube.stl id:0", "M204 P1250 R1250 T1250",
    ],
)  # fmt: skip
def test_words_of_what_is_no_motion_move_nothing(tmp_path: Path, line: str) -> None:
    whole = path_of(tmp_path, *MOVES, line, "G1 X50 Y50 E1.2", dialect="printer")
    assert whole.length == pytest.approx(math.sqrt(200.04) + 80.0)
    assert not any(marker.stop for marker in whole.markers)
    assert [curve.control_points[-1].tolist() for curve in whole.curves][-1] == [50.0, 50.0, 0.2]


def test_what_moves_nothing_is_named_once_with_a_count(tmp_path: Path) -> None:
    lines = ["M73 P1 R3", "G28", "M201 X1", "START_PRINT BED=60", "M73 P2 R3", "G29 P1"]
    findings = path_of(tmp_path, *lines, *MOVES).findings
    assert "commands of the printer that move nothing: M73 (2), M201 (1), M83 (1)" in findings
    assert any(each.startswith("moves of the printer's own") and "G28 (1), G29 (1)" in each for each in findings)
    assert any(each.startswith("macros") and each.endswith("START_PRINT (1)") for each in findings)


def test_a_printer_moves_g0_at_f(tmp_path: Path) -> None:
    lines = ("G0 F600 X0 Y0 Z0", "G0 X100", "G1 F1500 X100 Y50 E5", "G0 F600 X0 Y50", "G1 F1500 X0 Y0 E10")
    path = path_of(tmp_path, ";FLAVOR:Marlin", "M82", "G90", *lines)
    assert seconds(path) == pytest.approx(10.0 + 2.0 + 10.0 + 2.0)
    milled = path_of(tmp_path, "G90", "G0 X100", "G1 X0 F600")
    assert milled.feeds is not None and milled.feeds.tolist() == [math.inf, 10.0]


def test_what_a_printer_waits_for(tmp_path: Path) -> None:
    lines = [f"G1 X{x} E.1\nM73 P{x} R3\nM106 S{x}\nM204 S{900 + x}" for x in range(1, 90)]
    path = path_of(tmp_path, "M83", "G90", "G1 Y0 F6000", *lines)
    assert not path.stops and seconds(path) == pytest.approx(0.89)
    for code in ("M400", "M109 S200", "T1", "G4", "M600"):
        assert path_of(tmp_path, "M83", "G1 X1 E1 F600", code, "G1 X2 E1").stops


@pytest.mark.parametrize(
    ("lines", "waits"),
    [
        (["M83", "G90", "G1 X1 F300", "G1 E-6", "G1 X2 F3000", "G1 E6 F300", "G1 X3 E1"], [1.2, 1.2]),
        (["M82", "G92 E0", "G1 X1 E5 F300", "G1 E-1", "G92 E0", "G1 X2", "G1 E6"], [1.2, 1.2]),
        (["G91", "G1 X1 F300", "G1 E-6", "G1 X2", "G1 E-6"], [1.2, 1.2]),
    ],
)
def test_a_retraction_takes_its_time(tmp_path: Path, lines: list[str], waits: list[float]) -> None:
    path = path_of(tmp_path, "M104 S200", *lines)
    assert [wait for _, wait in path.dwells] == pytest.approx(waits)
    file = program(tmp_path, "M104 S200", *lines * 40)
    parts = [joined(list(Reading(fast=fast).moves(file))) for fast in (True, False)]
    assert np.array_equal(parts[0].rows, parts[1].rows)
    for fast, slow in zip(parts[0].marks, parts[1].marks, strict=True):
        assert (fast.move, fast.line, fast.text) == (slow.move, slow.line, slow.text)
        assert fast.dwell == pytest.approx(slow.dwell, rel=1e-9)


def test_a_feed_multiplied_by_m220(tmp_path: Path) -> None:
    path = path_of(tmp_path, "M83", "G1 X10 E1 F600", "M220 S50", "G1 X20 E1", "G1 X30 F1200", "M220 S100", "G1 X40")
    assert path.feeds is not None and path.feeds.tolist() == pytest.approx([10.0, 5.0, 10.0, 20.0])


def test_a_comment_has_any_length(tmp_path: Path) -> None:
    assert len(path_of(tmp_path, "; start = " + "M104 S200 " * 2000, "G1 X1 F5 ;" + "x" * 9000).curves) == 1
    assert "at most 4096 can be read" in refusal(tmp_path, "G1 X1" + " " * 9000)


@pytest.mark.parametrize(
    ("line", "reason"),
    [("G1 X", "line 2: X: a number is missing"), ("G1 X1 ?", "line 2: expected a letter and a number, got '?'")],
)
def test_what_no_printer_takes(tmp_path: Path, line: str, reason: str) -> None:
    assert refusal(tmp_path, "M83", line) == reason


def test_the_power_of_a_laser_is_no_stop(tmp_path: Path) -> None:
    lines = ["M4 S0", "G0 X0 Y0", "F3000", *[f"G1 X{k / 10:g} S{37 * k % 1000}" for k in range(1, 201)]]
    file = program(tmp_path, "G90", "G21", *lines)
    assert detect(file.read_bytes()).name == "grbl" and seconds(path_of(tmp_path, *lines)) == pytest.approx(0.4)
    assert not path_of(tmp_path, *lines).stops
    assert len(path_of(tmp_path, *lines, dialect="linuxcnc").stops) > 190  # a spindle whose speed changes


def test_settings_of_grbl(tmp_path: Path) -> None:
    lines = ("$H", "$32=1", "G21 G90", "M4 S0", "G1 X10 S500 F1000", "M5")
    path = path_of(tmp_path, *lines)
    assert path.length == 10.0 and any("lines that begin with $" in each for each in path.findings)


def test_codes_that_linuxcnc_does_not_have_take_their_words(tmp_path: Path) -> None:
    lines = ("G1 X5 F600", "M201 X9000 Y9000", "M17 X8", "M201 X1", "X10", "M205 G1 X20")
    path = path_of(tmp_path, *lines, dialect="linuxcnc")
    assert path.length == 20.0
    assert "M201 is not known in the dialect LinuxCNC; its words move nothing: line 2, 4" in path.findings
    assert path_of(tmp_path, "G1 X5 F600", "M8 X10").length == 10.0  # as in RS274: the word is that of G1


def test_what_tells_a_dialect_is_said(tmp_path: Path) -> None:
    for first, by in (
        ("M201 X9", "'M201' in line 2"),
        (";FLAVOR:Marlin", "';FLAVOR:Marlin' in line 2"),
        ("G90", "nothing"),
    ):
        assert summary(program(tmp_path, "", first, "G1 X5 F60")).dialect_by.startswith(by)
    assert summary(program(tmp_path, "G1 X5 F60"), dialect="grbl").dialect_by == "as given"


def test_text_beside_words_is_no_program() -> None:
    assert holds(b"START_PRINT BED=60\nG90\nSET_VELOCITY_LIMIT ACCEL=5\nG1 X1\n")
    assert not holds(b"START HERE\nthe quick brown fox\nM73 or not\n")


def test_a_makerbot_has_its_filaments_on_a_and_b(tmp_path: Path) -> None:
    """Sailfish's GPX programs: A and B are filaments, not rotary axes; G161 and G162 home."""
    lines = "G162 X Y F3000\nG161 Z F1200\nM132 X Y Z A B\nG1 X10 Y10 Z0.2 F6000\nG1 X40 F3000 A3.5\nG1 Y50 B7"
    file = tmp_path / "a.gcode"
    file.write_text(lines)
    path = sf.read(file, dialect="marlin", start=(10, 10, 0.2))
    assert path.axes == ("x", "y", "z") and path.length == pytest.approx(70.0)
    assert "(homing, levelling, retraction), left out with their time: G162 (1), G161 (1)" in "".join(path.findings)


def test_macros_of_klipper_with_places_are_no_words_of_siemens(tmp_path: Path) -> None:
    file = tmp_path / "a.gcode"
    file.write_text("SET_KINEMATIC_POSITION X=0 Y=0\n_MOVE_TO X=10 Y=5\nG90\nG1 X10 F3000\nP0 S1 ; park\nM98 P5 X90")
    assert detect(file.read_bytes()).name == "klipper"
    path = sf.read(file, start=(0, 0, 0))
    assert path.length == pytest.approx(10.0)
    assert "left out with their moves and time: _MOVE_TO (1), P0 (1), M98 (1)" in "".join(path.findings)


def test_pictures_before_a_program_do_not_hide_its_printer(tmp_path: Path) -> None:
    """CrealityOfficial/K1_Series_Klipper, K1/3DBenchy.gcode: 77 KB of pictures come before the first command."""
    picture = ["; png begin 300*300 57344", *["; " + 38 * "iV" for _ in range(1200)], "; png end"]
    lines = [*picture, "START_PRINT EXTRUDER_TEMP=210", "G1 X10 F600", "SET_PRESSURE_ADVANCE ADVANCE=0.05; own", "X20"]
    path = path_of(tmp_path, *lines)
    assert path.length == 20.0 and any("START_PRINT (1)" in each for each in path.findings)
    reading = Reading()
    list(reading.moves(program(tmp_path, *lines)))
    assert reading.dialect_by == "'START_PRINT' in line 1203"


KLIPPER = ["SET_VELOCITY_LIMIT ACCEL=5000", "M83", "G90", "G1 X10 Y10 Z1 F6000"]


def test_klipper_restores_how_places_are_read(tmp_path: Path) -> None:
    """Klipper, "G-Codes", gcode_move: before, the steps of a pause went on to the end of the print."""
    pause = ["SAVE_GCODE_STATE NAME=pause", "G91", "G1 Z5 F600", "RESTORE_GCODE_STATE NAME=pause"]
    path = path_of(tmp_path, *KLIPPER, *pause, "G1 X50 Y10 Z1 E1")
    assert path.curves[-1].ends.tolist() == [[10, 10, 6], [50, 10, 1]]
    assert path.feeds is not None and path.feeds.tolist() == [100.0, 10.0, 100.0]
    assert not any("RESTORE_GCODE_STATE" in each for each in path.findings)
    back = [*pause[:-1], "RESTORE_GCODE_STATE NAME=pause MOVE=1 MOVE_SPEED=20"]
    path = path_of(tmp_path, *KLIPPER, *back, "G1 X50 E1")
    assert path.curves[-2].ends.tolist() == [[10, 10, 6], [10, 10, 1]]
    assert path.feeds is not None and path.feeds.tolist() == [100.0, 10.0, 20.0, 100.0]


def test_a_state_that_a_macro_has_kept_is_the_printer_s(tmp_path: Path) -> None:
    path = path_of(tmp_path, *KLIPPER, "RESTORE_GCODE_STATE NAME=other", "G1 X50 E1")
    assert any("macros, which only the printer knows" in each and "RESTORE" in each for each in path.findings)


def test_klipper_shifts_what_follows(tmp_path: Path) -> None:
    path = path_of(tmp_path, *KLIPPER, "SET_GCODE_OFFSET X=10 Z_ADJUST=0.5", "G1 X20 Y10 Z1 E1", "G91", "G1 X5")
    assert [curve.ends[1].tolist() for curve in path.curves] == [[10, 10, 1], [30, 10, 1.5], [35, 10, 1.5]]
    path = path_of(tmp_path, *KLIPPER, "SET_GCODE_OFFSET X=10 MOVE=1", "SET_GCODE_OFFSET X=0", "G1 X20 E1")
    assert [curve.ends[1].tolist() for curve in path.curves] == [[10, 10, 1], [20, 10, 1], [20, 10, 1]][:2]
    said = refusal(tmp_path, *KLIPPER, "SET_GCODE_OFFSET X=a", "G1 X20")
    assert said == "line 5: X=a is not a number"


def test_marlin_goes_back_to_a_place_that_it_has_kept(tmp_path: Path) -> None:
    lines = [";FLAVOR:Marlin", "G1 X10 Y5 Z1 F600", "G60 S1", "G1 X50 Y50 Z9", "G61 XY S1", "G1 X20 E1"]
    path = path_of(tmp_path, *lines)
    assert [curve.ends[1].tolist() for curve in path.curves] == [[10, 5, 1], [50, 50, 9], [10, 5, 9], [20, 5, 9]]
    path = path_of(tmp_path, *lines[:4], "G61 S1 F1200", "G1 X20")
    assert path.curves[2].ends[1].tolist() == [10, 5, 1] and path.feeds is not None and path.feeds[2] == 20.0
    assert refusal(tmp_path, *lines[:2], "G61 S3") == "line 3: G61 goes back to place 3, which no G60 has kept"
