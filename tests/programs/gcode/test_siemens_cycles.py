"""Siemens' CYCLE81 to CYCLE84 and MCALL, move by move as the Programming Guide "Cycles" (PGZ, 11.02) describes them."""

from __future__ import annotations

from pathlib import Path

import pytest

from gcode_programs import path_of, refusal, said

BEGIN = ("G17 G90 F200 S300 M3", "G0 X=40 Y=120 Z=110")


def moves(folder: Path, *lines: str) -> str:
    path = path_of(folder, *BEGIN, *lines, dialect="siemens", start=(0, 0, 110))
    return ";".join(said(path)[2:])


def test_the_example_of_the_manual(tmp_path: Path) -> None:
    lines = ["CYCLE81(110,100,2,35)", "Y30", "CYCLE81(110,102,,35)", "G0 X90", "CYCLE81(110,100,2,,65)"]
    assert moves(tmp_path, *lines) == (
        "T40 120 102;F40 120 35;T40 120 110;T40 30 110;T40 30 102;F40 30 35;T40 30 110;"
        "T90 30 110;T90 30 102;F90 30 35;T90 30 110"
    )


@pytest.mark.parametrize(
    ("call", "wanted"),
    [
        ("CYCLE82(110, 102, 4, 75, , 2)", "T40 120 106;F40 120 75;P2;T40 120 110"),
        ("CYCLE82(110,102,4,75,,-1.5)", "T40 120 106;F40 120 75;P0.3;T40 120 110"),  # 1.5 turns at S300
        ("CYCLE83(110,100,1,,20,,10,0,0,0,1,0)",
         "T40 120 101;F40 120 90;F40 120 91;F40 120 80;T40 120 110"),
        ("CYCLE83(110,100,1,,20,90,,4,0.5,1,1,1)",  # strokes 10, 6, then the rest of 4
         "T40 120 101;F40 120 90;P0.5;T40 120 101;P1;T40 120 90.6;F40 120 84;P0.5;T40 120 101;P1;T40 120 84.6;"
         "F40 120 80;P0.5;T40 120 110"),
        ("CYCLE83(110,100,1,,50,,25,10,,,1,1)",  # strokes 25, 15, then 10 as less than twice 10 is left
         "T40 120 101;F40 120 75;T40 120 101;T40 120 76;F40 120 60;T40 120 101;T40 120 61;F40 120 50;T40 120 110"),
        ("CYCLE83(110,100,1,,18,,8,-0.5)",
         "T40 120 101;F40 120 92;F40 120 93;F40 120 88;F40 120 89;F40 120 86;F40 120 87;F40 120 85;F40 120 86;"),
        ("CYCLE84(110,100,2,,30,0.5,3,5,,90,200,500)",
         "T40 120 102;M19 S200 M3;F40 120 70;P0.5;S500 M4;F40 120 102;M3;T40 120 110"),
        ("CYCLE84(110,100,2,,30,,,,-1.5,90,200)",
         "T40 120 102;M19 S200 M4;F40 120 70;S200 M3;F40 120 102;M5;T40 120 110"),
    ],
)  # fmt: skip
def test_what_a_cycle_stands_for(tmp_path: Path, call: str, wanted: str) -> None:
    found = moves(tmp_path, call)
    assert found.startswith(wanted) if wanted.endswith(";") else found == wanted


def test_the_feed_of_taps_and_of_the_first_peck(tmp_path: Path) -> None:
    path = path_of(tmp_path, *BEGIN, "CYCLE84(110,100,2,,30,,3,5,,90,200,500)", dialect="siemens", start=(0, 0, 110))
    assert path.feeds is not None
    assert path.feeds[2:4] * 60.0 == pytest.approx([0.8 * 200, 0.8 * 500])
    path = path_of(tmp_path, *BEGIN, "CYCLE83(110,100,1,,20,,10,0,0,0,0.5,1)", dialect="siemens", start=(0, 0, 110))
    assert path.feeds is not None
    feeds = [feed * 60.0 for feed in path.feeds if feed < 1e9]
    assert feeds == pytest.approx([100, 200])


def test_mcall_repeats_the_cycle_behind_each_move(tmp_path: Path) -> None:
    lines = ["MCALL CYCLE81(110,100,2,35)", "X50", "F300", "X60", "MCALL", "X70"]
    assert moves(tmp_path, *lines) == (
        "T50 120 110;T50 120 102;F50 120 35;T50 120 110;T60 120 110;T60 120 102;F60 120 35;T60 120 110;T70 120 110"
    )


def test_the_axis_is_that_across_the_plane(tmp_path: Path) -> None:
    assert moves(tmp_path, "G18 CYCLE81(130,125,2,90)") == "T40 127 110;F40 90 110;T40 130 110"


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("CYCLE81(110,100,2)", "CYCLE81 needs DP or DPR"),
        ("CYCLE81(110,,2,35)", "CYCLE81 needs RFP"),
        ("CYCLE81(110,100,2,35,,7)", "CYCLE81: parameter 6 is not supported; leave out what follows DPR"),
        ("CYCLE81(110,100,2,x)", "X has no value; set it in the program before it is used"),
        ("CYCLE81(110,100,2,35", "CYCLE81( is not closed by )"),
        ("CYCLE81(110,100,2,105)", "CYCLE81: the depth lies 3 mm above the plane where it begins (RFP + SDIS)"),
        ("CYCLE81(100,100,2,35)", "CYCLE81: RTP lies 2 mm below the plane where it begins (RFP + SDIS)"),
        ("CYCLE81(nan,100,2,35)", "NAN has no value; set it in the program before it is used"),
        ("CYCLE83(110,100,1,,20,,30)", "CYCLE83: the first depth, 30 mm, must be greater than 0 and at most 20 mm"),
        ("CYCLE83(110,100,1,,20,,10,-1)", "CYCLE83: DAM=-1; a factor of the stroke lies between -1 and 0"),
        ("CYCLE83(110,100,1,,20,,0.0001)", "CYCLE83 makes more than 100000 moves; drill deeper at a"),
        ("CYCLE83(110,100,1,,20,,10,0,0,0,2)", "CYCLE83: FRF=2, the part of the feed for the first depth, is 0.00"),
        ("CYCLE84(110,100,2,,30,,3,7,,90,200)", "CYCLE84 needs PIT, the pitch, or MPIT, the size of a metric thread"),
        ("CYCLE84(110,100,2,,30,,7,5,,90,200)", "CYCLE84: SDAC=7; the spindle goes on by 3, 4 or 5 (M3, M4, M5)"),
        ("CYCLE85(110,100,2,35)", "CYCLE85( is a call, which is not supported; write plain lines"),
    ],
)  # fmt: skip
def test_cycles_that_cannot_be(tmp_path: Path, line: str, reason: str) -> None:
    assert refusal(tmp_path, *BEGIN, line, dialect="siemens").startswith(f"line 3: {reason}")
