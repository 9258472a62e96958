"""Corners by a word, against places that are computed by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import path_of, refusal

FANUC = ("O0001", "G90 G21 G17 F600", "G0 X0. Y0. Z0.")
SIEMENS = ("; SINUMERIK 840D", "G90 G71 G17 F600", "G0 X0 Y0 Z0")
ROOT5 = math.sqrt(5.0)


def corners(path: sf.Path) -> list[list[float]]:
    return path.ends[:, 1, :2].tolist()


@pytest.mark.parametrize(
    ("head", "word"), [(FANUC, ",R5."), (FANUC, ", R 5."), (SIEMENS, "RND=5"), (SIEMENS, "RND = 5")]
)
def test_a_radius_touches_both_lines(tmp_path: Path, head: tuple[str, ...], word: str) -> None:
    path = path_of(tmp_path, *head, f"G1 X20. {word}", "Y20.", "M30")
    assert np.allclose(corners(path), [[15.0, 0.0], [20.0, 5.0], [20.0, 20.0]])
    assert path.length == pytest.approx(15.0 + 2.5 * math.pi + 15.0)
    assert path.minimum_radius() == pytest.approx(5.0)
    assert not path.stops  # tangent on both sides


def test_of_a_sharp_corner_to_the_left_and_to_the_right(tmp_path: Path) -> None:
    for sign in (1.0, -1.0):
        path = path_of(tmp_path, *FANUC, "G1 X20. ,R2.", f"X0. Y{10.0 * sign:.1f}", "M30")
        # lines at atan(1/2); the arc begins 2 / tan(atan(1/2) / 2) before the corner
        away = 2.0 / math.tan(0.5 * math.atan(0.5))
        first, last = [20.0 - away, 0.0], [20.0 - away * 2.0 / ROOT5, sign * away / ROOT5]
        assert np.allclose(corners(path)[:2], [first, last])
        middle = np.array([20.0 - away, 2.0 * sign])
        arc = path.curves[1](np.linspace(*path.curves[1].domain, 9))[:, :2]
        assert np.allclose(np.linalg.norm(arc - middle, axis=1), 2.0)


@pytest.mark.parametrize(
    ("head", "word", "away"),
    [(FANUC, ",C3.", 3.0), (SIEMENS, "CHR=3", 3.0), (SIEMENS, "CHF=3", 1.5 / math.sin(math.pi / 4))],
)
def test_a_chamfer(tmp_path: Path, head: tuple[str, ...], word: str, away: float) -> None:
    path = path_of(tmp_path, *head, f"G1 X20. {word}", "Y20.", "M30")
    assert np.allclose(corners(path), [[20.0 - away, 0.0], [20.0, away], [20.0, 20.0]])


def test_in_inches_in_another_plane_and_by_steps(tmp_path: Path) -> None:
    path = path_of(tmp_path, "O0001", "G91 G20 G18 F20.", "G0 X0. Z0.", "G1 X2. ,R.5", "Z-2.", "M30", start=(0, 0, 0))
    assert np.allclose(path.ends[:, 1] / 25.4, [[1.5, 0.0], [2.0, -0.5], [2.0, -2.0]])
    assert path.minimum_radius() == pytest.approx(12.7)


def test_one_after_the_other_on_a_line_share_it(tmp_path: Path) -> None:
    path = path_of(tmp_path, *FANUC, "G1 X20. ,R8.", "Y20. ,R12.", "X0.", "M30")
    assert np.allclose(corners(path), [[12.0, 0.0], [20.0, 8.0], [20.0, 8.0], [8.0, 20.0], [0.0, 20.0]][:2]
                       + [[8.0, 20.0], [0.0, 20.0]])  # fmt: skip


def test_lines_that_go_on_straight_have_no_corner(tmp_path: Path) -> None:
    path = path_of(tmp_path, *FANUC, "G1 X10. ,R2.", "X20. ,C0.", "Y5.", "M30")
    assert np.allclose(corners(path), [[10.0, 0.0], [20.0, 0.0], [20.0, 5.0]])


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["G1 X20. ,R5.", "M30"], ",R has no line behind it"),
        (["G1 X20. ,R5.", "G2 X30. Y10. I10."], ",R joins two lines, G1, in the plane G17"),
        (["G1 X20. ,C5.", "G0 Y9."], ",C joins two lines, G1, in the plane G17"),
        (["G1 X20. ,R5.", "Y20. Z1."], ",R joins two lines, G1, in the plane G17"),
        (["G0 X20. ,R5.", "G1 Y20."], ",R needs a line, G1, where it stands and behind it"),
        (["G1 X20. ,R25.", "Y40."], ",R25 takes 25 mm of lines of 20 and 40 mm"),
        (["G1 X20. ,R15.", "Y20. ,R15.", "X0."], ",R15 takes 15 mm of lines of 5 and 20 mm"),
        (["G1 X20. ,R-1.", "Y20."], ",R-1: the size of a corner is 0 or more"),
        (["G1 X20. ,R1. ,R2.", "Y20."], ",R appears twice"),
        (["G1 X20. ,A30.", "Y20."], ",A is the angle of a line, which is not supported"),
        (["G1 X20. ,R5.", "G81 X5. Z-5. R1."], "a corner needs a line, G1, behind it"),
    ],
)
def test_what_cannot_be_a_corner_is_refused(tmp_path: Path, lines: list[str], reason: str) -> None:
    assert reason in refusal(tmp_path, *FANUC, *lines)


def test_rndm_is_refused_by_name(tmp_path: Path) -> None:
    assert "RNDM= rounds all corners, which is not supported" in refusal(tmp_path, *SIEMENS, "G1 X20 RNDM=5", "Y20")
