"""A Haas by its manual: English - Mill NGC - Operator's Manual - 2017 (sections and pages beside the tests)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import path_of, refusal

HEAD = ("O00001 (HAAS)", "G90 G21 G17 F600.", "G0 X0. Y0. Z0.")


def ends(path: sf.Path) -> list[list[float]]:
    return np.round(path.ends[:, 1], 9).tolist()


def waits(path: sf.Path) -> float:
    return round(sum(marker.dwell for marker in path.markers), 9)


@pytest.mark.parametrize(("word", "seconds"), [("P10.0", 10.0), ("P10", 0.01), ("P1.5", 1.5)])
def test_g04_waits_s_with_a_point_and_ms_without(tmp_path: Path, word: str, seconds: float) -> None:  # G04 Dwell
    assert waits(path_of(tmp_path, *HEAD, f"G04 {word}", "G1 X1.")) == seconds


@pytest.mark.parametrize(  # G82, p. 294; G83: "P1.5 ... dwell for 1.5 seconds"; G73, p. 289
    ("line", "seconds"),
    [
        ("G82 Z-2. R1. P0.5 F100.", 0.5), ("G83 Z-2. R1. Q1. P1.5 F100.", 1.5), ("G73 Z-2. R1. Q1. P2. F100.", 2.0),
        ("G82 Z-2. R1. P500 F100.", 0.5),
    ],
)  # fmt: skip
def test_cycles_wait_as_g04_does(tmp_path: Path, line: str, seconds: float) -> None:
    assert waits(path_of(tmp_path, *HEAD, "G0 Z5.", f"{line} X0. Y0.", "G80", "M30")) == seconds


def test_g110_to_g129_are_g154_p1_to_p20(tmp_path: Path) -> None:  # G154, pp. 323 and 324
    for one, other in (("G110", "G154 P1"), ("G129", "G154 P20")):
        moved = f"G10 L20 P{1 if one == 'G110' else 20} X7. Y8."
        paths = [path_of(tmp_path, *HEAD, moved, each, "G1 X1. Y1.", "M30") for each in (one, other)]
        assert ends(paths[0]) == ends(paths[1]) == [[8.0, 9.0, 0.0]]
    assert "G110 is not known" in refusal(tmp_path, "O0001", "G110", "G1 X1.", dialect="fanuc")


def test_m97_calls_lines_of_the_program(tmp_path: Path) -> None:  # M97, p. 359
    path = path_of(tmp_path, *HEAD, "M97 P100 L3", "G1 X5.", "M30", "N100 G91 G1 Y2.", "G90", "M99")
    assert [each[:2] for each in ends(path)] == [[0.0, 2.0], [0.0, 4.0], [0.0, 6.0], [5.0, 6.0]]
    assert "GOTO 7: no line of the program begins with N7" in refusal(tmp_path, *HEAD, "M97 P7", "M30")
    assert "more than 10 calls within calls" in refusal(tmp_path, *HEAD, "N1 M97 P1", "M30")
    assert "M97" in refusal(tmp_path, "O0001", "M97 P100", "N100 G1 X1.", "M99", dialect="fanuc")


def test_the_macro_of_the_manual_drills_its_row(tmp_path: Path) -> None:  # G65, p. 232, example 3, with R
    path = path_of(
        tmp_path, "O00001 (HAAS)", "G00 G90 G21 X1.0 Y1.0 Z.05 S1000 M03",
        "G65 P9010 X.5 Y.25 Z-.05 F10. T3", "M30",
        "O09010 (DIAGONAL HOLE PATTERN)", "F#9", "WHILE [#20 GT 0] DO1", "G91 G81 Z#26 R0", "#20=#20-1",
        "IF [#20 EQ 0] GOTO5", "G00 X#24 Y#25", "N5 END1", "M99",
    )  # fmt: skip
    places = {tuple(each[:2]) for each in ends(path)}
    assert places == {(1.0, 1.0), (1.5, 1.25), (2.0, 1.5)}
    assert path.bounding_box()[0][2] == pytest.approx(0.0)


def test_what_is_undefined_is_ignored_as_a_word(tmp_path: Path) -> None:  # pp. 218 and 220
    assert ends(path_of(tmp_path, *HEAD, "G1 X#1 Y3.", "M30"))[0][:2] == [0.0, 3.0]


@pytest.mark.parametrize("line", ["G12 I5. F100.", "G13 I5. F100.", "G47 P0", "G150 X1. Y1. P1", "G70 I5. J0. L4"])
def test_pockets_text_and_rows_of_holes_are_refused(tmp_path: Path, line: str) -> None:
    assert "is a code of Haas that is not read" in refusal(tmp_path, *HEAD, line)
