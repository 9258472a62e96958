"""The words of a program: expressions, modes, offsets, and what is refused in one line."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import path_of, program, refusal


def ends(path: sf.Path) -> list[list[float]]:
    return [curve.control_points[-1].tolist() for curve in path.curves]


def test_expressions_and_parameters(tmp_path: Path) -> None:
    path = path_of(
        tmp_path,
        "#1=2",
        "#2=[#1*3 - 4/2] #<deep one>=-1.5",
        "F100 G1 X#2 Y[-#1 + 2**3 MOD 5] Z#<deepone>",
        "X[sqrt[16] + round[2.5] + fix[-1.5] + fup[1.2] + abs[-3]]",
        "Y[atan[1]/[-1] - 10 * [#1 GT 1] + cos[60] + sin[30]]",
        "Z#5420 (where X is)",
        "X[exists[#<deep one>] + exists[#<none>] + [1 EQ 1 AND 0 NE 0]]",
    )
    assert np.allclose(
        ends(path),
        [[4, 1, -1.5], [4 + 3 - 2 + 2 + 3, 1, -1.5], [10, 126, -1.5], [10, 126, 10], [1, 126, 10]],
    )


def test_settings_of_a_line_count_from_the_next_one_on(tmp_path: Path) -> None:
    assert ends(path_of(tmp_path, "#1=2", "F100 G1 #1=5 X#1", "X#1")) == [[2], [5]]


def test_case_blanks_comments_and_numbers_of_lines_mean_nothing(tmp_path: Path) -> None:
    path = path_of(tmp_path, "%", "n10 g 1 x+1. (a comment) y.5f6000;rest", "", "N20.1 X 2", "/ Y3", "%")
    assert ends(path) == [[1, 0.5], [2, 0.5], [2, 3]]
    assert path.feeds is not None and path.feeds.tolist() == [100, 100, 100]
    assert any("lines with / are executed" in finding for finding in path.findings)


def test_units_distances_and_rotary_axes(tmp_path: Path) -> None:
    path = path_of(tmp_path, "G20 G91 F60 G1 X1 A90", "X1", "G21 X10", "G90 X1 B-180 U2")
    assert path.axes == ("x", "u", "a", "b")
    assert np.allclose(ends(path), [[25.4, 0, math.pi / 2, 0], [50.8, 0, math.pi / 2, 0], [60.8, 0, math.pi / 2, 0],
                                    [1, 2, math.pi / 2, -math.pi]])  # fmt: skip
    assert path.feeds is not None and path.feeds[:3].tolist() == [25.4] * 3
    assert path.feeds[3] == pytest.approx(25.4 * math.sqrt(59.8**2 + 2**2) / 59.8, rel=1e-12)  # F is of X, not of U


def test_feeds_beside_a_change_of_units(tmp_path: Path) -> None:
    """LinuxCNC knows the units of the lines before; where the program says none, and elsewhere, the new ones count."""
    lines = ["G20 F60 G1 X1", "G21 F60 X2", "G20 F60 X3"]
    path = path_of(tmp_path, *lines)
    assert path.feeds is not None and path.feeds.tolist() == pytest.approx([25.4, 25.4, 1.0])
    assert path.findings == (
        "F on a line that changes units is taken in inches a minute: line 1, 2",
        "F on a line that changes units is taken in mm a minute: line 3",
    )
    path = path_of(tmp_path, *lines, dialect="fanuc")
    assert path.feeds is not None and path.feeds.tolist() == pytest.approx([25.4, 1.0, 25.4])


def test_offsets_of_coordinate_systems(tmp_path: Path) -> None:
    lines = ["F60 G1 X1", "G10 L2 P2 X100 Y5", "G55 X1 Y1", "G92 X0", "X1", "G92.2", "X1", "G92.3", "X1", "G92.1 X1",
             "G52 X10", "X1", "G52 X0", "G10 L20 P0 X0 Y0", "X1 Y1"]  # fmt: skip
    assert ends(path_of(tmp_path, *lines)) == [
        [1, 0], [101, 6], [102, 6], [101, 6], [102, 6], [101, 6], [111, 6], [112, 7],
    ]  # fmt: skip
    file = program(tmp_path, "G21 G54", "F60 G1 X1", "G56 X1")
    path = sf.read(file, start=(0,), offsets="G56=50")
    assert ends(path) == [[1], [51]] and path.findings == ()
    assert sf.read(file, start=(0,)).findings == (
        "the offset of G56 is not known: taken as 0 (option offsets): line 3",
        "1 move(s) without length are left out: line 3",
    )


def test_systems_between_which_a_program_moves_are_known_or_said(tmp_path: Path) -> None:
    """From one system to another a move is as long as their offsets say, those before the first word included."""

    def unknown(*lines: str) -> list[str]:
        return [each for each in path_of(tmp_path, *lines).findings if "is not known" in each]

    assert unknown("G1 X1 F60", "G55 X2") == ["the offset of G55 is not known: taken as 0 (option offsets): line 2"]
    assert unknown("G1 X1 F60", "G10 L2 P2 X100", "G55 X2") == [
        "the offset of G54 is not known: taken as 0 (option offsets): line 3"
    ]
    assert unknown("G55", "G1 X1 F60", "X2") == [] and unknown("G54", "G1 X1 F60", "G54 X2") == []
    haas = unknown("(HAAS)", "G154 P3", "G1 X1. F60.", "G54 X2.")
    assert haas == ["the offset of G54 is not known: taken as 0 (option offsets): line 4"]
    back = unknown("(HAAS)", "G54 G1 X1. F60.", "G154 P3 X2.")
    assert back == ["the offset of G54.1 P3 is not known: taken as 0 (option offsets): line 3"]


def test_machine_places_need_a_known_machine(tmp_path: Path) -> None:
    lines = ["F60 G1 X1", "G53 G0 X0", "G28 X5", "G28.1", "G1 X9", "G28", "M30"]
    path = path_of(tmp_path, *lines)
    assert ends(path) == [[1], [5], [9], [5]]
    assert any(finding.startswith("G53 is left out") for finding in path.findings)
    assert any(finding.startswith("G28 is left out") for finding in path.findings)
    assert ends(path_of(tmp_path, *lines, offsets={"G54": (3,)}))[:2] == [[4], [0]]


def test_where_a_path_starts(tmp_path: Path) -> None:
    lines = ["G21 G0 Z5", "G0 X1 Y1", "G0 Z1", "G1 X2 F60"]
    path = sf.read(program(tmp_path, *lines))
    assert path.curves[0].control_points.tolist() == [[1, 1, 5], [1, 1, 1]]
    assert path.findings == ("2 rapid move(s) to the first place, up to line 2, are left out (option start)",)
    whole = sf.read(program(tmp_path, *lines), start="0,0,9")
    assert whole.curves[0].control_points.tolist() == [[0, 0, 9], [0, 0, 5]] and whole.findings == ()
    early = sf.read(program(tmp_path, "G21 G0 Z5", "G1 X1 F60"))
    assert early.curves[0].control_points.tolist() == [[0, 5], [1, 5]]
    assert early.findings == (
        "line 2: where X is before this move is unknown and taken as 0 "
        "in the program's first coordinate system (option start)",
    )


def test_feeds_tolerances_and_markers(tmp_path: Path) -> None:
    path = path_of(
        tmp_path, "T1 M6", "G64 P0.05", "G1 X1 F120 S1000 M3", "G4 P0.5", "G0 X2", "G61.1", "G1 X3", "X4", "G61",
        "G93 X6 F30", "G94 F60 X7 M8", "M62 P1", "X8", "M30",
    )  # fmt: skip
    assert path.feeds is not None and path.feeds.tolist() == [2, math.inf, 2, 2, 1, 1, 1]
    assert path.tolerances is not None and path.tolerances.tolist() == [0.05, 0.05, 0, 0, 0, 0, 0]
    said = [(m.before, m.text, m.dwell, m.stop) for m in path.markers]
    assert said == [
        (0, "T1 M6", 0, True), (0, "S1000 M3", 0, True), (1, "", 0.5, True), (3, "", 0, True), (4, "", 0, True),
        (5, "M8", 0, True), (6, "M62 P1", 0, False), (7, "M30", 0, True),
    ]  # fmt: skip


def test_rotary_axes_alone_have_feeds_in_degrees(tmp_path: Path) -> None:
    path = path_of(tmp_path, "G1 A90 F600", "G20 C30 F60", "X1", "G93 A0 F2")
    assert path.axes == ("x", "a", "c") and path.feeds is not None
    assert path.feeds.tolist() == pytest.approx([10.0, 1.0, 25.4, 3.0])
    assert np.diff(path.tip_length(path.curve_starts)).tolist() == pytest.approx([90.0, 30.0, 25.4, 90.0])
    assert path_of(tmp_path, "G1 A90 F600").length == pytest.approx(90.0)


def test_a_move_before_any_feed_runs_as_fast_as_the_limits_allow(tmp_path: Path) -> None:
    path = path_of(tmp_path, "G21 G1 X1", "X2 F60")
    assert path.feeds is not None and path.feeds.tolist() == [math.inf, 1]
    assert path.findings == ("moves without a feed before them (F) run as fast as the limits allow: line 1",)


def test_percents_are_the_ends_of_a_program(tmp_path: Path) -> None:
    assert ends(path_of(tmp_path, "%", "G1 X1 F60", "%", "X2", "no code at all")) == [[1]]
    assert ends(path_of(tmp_path, "(a note)", "%", ":0001", "G1 X1 F60", "X2", "%", "X3")) == [[1], [2]]
    assert ends(path_of(tmp_path, "G1 X1 F60", "%", "X3")) == [[1]]


def test_a_line_that_begins_many_programs(tmp_path: Path) -> None:
    path = path_of(tmp_path, "G00 G17 G21 G40 G49 G80 G90 X1", "X2", "G80 G1 X3 F60", "X4")
    assert ends(path) == [[1], [2], [3], [4]] and path.feeds is not None and path.feeds.tolist()[1:] == [math.inf, 1, 1]


def test_blanks_within_numbers_mean_nothing_either(tmp_path: Path) -> None:
    assert ends(path_of(tmp_path, "G 1 X 1 0 . 5 (note) F6 0", "X-\t2")) == [[10.5], [-2]]


def test_absolute_centres_hold_until_they_are_called_off(tmp_path: Path) -> None:
    path = path_of(tmp_path, "G90.1 F60 G1 X10", "G2 X10 I12 J0", "G2 I12 J0", "G91.1", "G3 X14 I2")
    assert [curve((curve.domain[0] + curve.domain[1]) / 2)[0] for curve in path.curves[1:]] == pytest.approx(
        [14, 14, 12]
    )
    assert refusal(tmp_path, "G90.1 F60 G1 X10", "G2 X14 I12").startswith("line 2: with G90.1 an arc needs both words")


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["G0 G1 X1"], "line 1: G0 and G1 exclude each other (both: motion); write one of them"),
        (["G17 G18"], "line 1: G17 and G18 exclude each other (both: plane); write one of them"),
        (["M3 M5"], "line 1: M3 and M5 exclude each other (both: spindle); write one of them"),
        (["G1 X1 X2"], "line 1: X appears twice"),
        (["X1"], "line 1: axis words without G0, G1, G2 or G3 before them"),
        (["G1 X1 F1", "G80", "X2"], "line 3: axis words without G0, G1, G2 or G3 before them"),
        (["G1 X"], "line 1: X: a number is missing at the end of the line"),
        (["G1 Xnan"], "line 1: X: a number is missing before 'NAN'"),
        (["G1 X1 (and) 0,5"], "line 1: expected a letter, got ',5'; a number has a decimal point, not a comma"),
        (["G92"], "line 1: G92 needs the axes whose places it gives"),
        (["G1 X1e9"], "line 1: E9 is used by no code of the line; a number has no exponent, and E is a"),
        (["G1 X99999999999"], "line 1: X leads to 1e+11; at most 1e+09 mm or rad from the zero point is possible"),
        (["G1 X1 I2"], "line 1: I2 is used by no code of the line"),
        (["G1 X#7"], "line 1: X: #7 has no value; set it in the program before it is used"),
        (["G1 X#<no>"], "line 1: X: #<no> has no value; set it in the program before it is used"),
        (["G1 X[1/0]"], "line 1: X: 1 / 0 has no value"),
        (["G1 X[ln[-1]]"], "line 1: X: LN[-1] has no value"),
        (["G1 X[1+2"], "line 1: X: ] is missing at the end of the line"),
        (["G1 X" + "[" * 99 + "1"], "line 1: X: more than 40 brackets within brackets"),
        (["G1 X1 (open"], "line 1: a comment opens with ( and is not closed with )"),
        (["G1 X1 )"], "line 1: ) closes no comment"),
        (["G1.7 X1"], "line 1: G1.7 is not known in the dialect LinuxCNC"),
        (["G41 D1"], "line 1: G41 is cutter compensation"),
        (["G95 F.1", "G1 X1"], "line 2: feed a revolution (G95) needs the speed of the spindle; write S before it"),
        (["G96 G95 F.1", "G1 X1"], "line 1: G96 needs S, the speed at the surface"),
        (["G96 S100 G95 F.1", "G1 Z1"], "line 2: G96 at X0 turns without bound; write D, the highest speed of the"),
        (["G33 Z-1 K1"], "line 1: G33 needs the spindle to turn; write M3 or M4 before it"),
        (["M3", "G33 Z-1 K1"], "line 2: G33 needs the speed of the spindle; write S before it"),
        (["M3 S100", "G33 Z-1"], "line 2: G33 needs the way a revolution, K (Fanuc: F)"),
        (["M3 S100", "G33 Z-1 K0"], "line 2: G33: the way a revolution must not be 0"),
        (["M3 S100", "G33 Z-1 K1 F9"], "line 2: F is not allowed with G33, whose feed is K times the spindle's speed"),
        (["M3 S100", "G76 P1 Z-1 I0 J.1 K1"], "line 2: G76: I, from the drive line to the crest of the thread, must"),
        (["M3 S100", "G76 P1 Z-1 I1 J1 K1"], "line 2: G76: J, the first cut, is greater than 0 and less than K"),
        (["M3 S100", "G76 P1 Z-1 I1 J.1"], "line 2: G76 needs K"),
        (["M3 S100", "G76 P1 Z-1 I1 J.1 K1 H-1"], "line 2: G76: H-1: passes are whole, 0 to 10000"),
        (["M3 S100", "G76 P1 Z-1 I1 J.1 K1 Q90"], "line 2: G76: Q90: the angle of the slide is less than 90 degrees"),
        (["M3 S100", "G76 P1 Z-1 I1 J.1 K1 L4"], "line 2: G76: L is 0 to 3, the ends with a taper"),
        (["M3 S100", "G76 P1 Z-1 I1 J.00001 K1"], "line 2: G76: more than 10000 passes; cut deeper at a time (J)"),
        (["G10 L2 P1 X1 R3"], "line 1: G10 L2 R turns a coordinate system; write the turned coordinates"),
        (["G10 L20 P1 R3"], "line 1: R3 is used by no code of the line"),
        (["G87 X1 Z-1 R1"], "line 1: G87 is a canned cycle that is not supported; let the CAM system write its moves"),
        (["O100 sub"], "line 1: o100 sub has no o100 endsub after it"),
        (["M98 P100"], "line 1: o100 is called, and is neither in the program nor in 100.ngc beside it"),
        (["#1=1", "WHILE [#1 LT 5] DO1"], "line 2: DO1 has no END1 after it"),
        (["F1", "G93 G1 X1"], "line 2: F is missing; in inverse time (G93) every move needs its own"),
        (["G1 X1 F-3"], "line 1: F-3 is not a feed"),
        (["G4"], "line 1: G4 needs P, the time to wait"),
        (["G4 P-1"], "line 1: G4: a wait of -1 s is not possible"),
        (["G10 L2 P12 X1"], "line 1: G10 P12: coordinate systems are 1 to 9, or 0 for the one in force"),
        (["G53 G2 X1 I1"], "line 1: G53 needs G0 or G1"),
        (["G1 X1 F1", "X" + " " * 5000 + "2"], "line 2: has 5002 characters; at most 4096 can be read"),
        (["M3 S100"], "no line moves an axis"),
        (["G1 X0 F1"], "no move has a length; is the program complete?"),
    ],
)
def test_what_cannot_be_read_is_named_in_one_line(tmp_path: Path, lines: list[str], reason: str) -> None:
    assert refusal(tmp_path, *lines).startswith(reason)


def test_the_first_line_that_is_wrong_is_named(tmp_path: Path) -> None:
    assert refusal(tmp_path, "F1", "G2 X5 I9", "G1 Q").startswith("line 2: the arc ends")
