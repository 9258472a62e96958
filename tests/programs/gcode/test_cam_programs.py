"""Programs as the posts of CAM systems write them, made up here: each is read, and comes to the moves it should."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import detect, path_of, program, refusal
from splinefeed.errors import FormatError

FREECAD = """(Exported by FreeCAD)
(Post Processor: linuxcnc_post)
G17 G54 G40 G49 G80 G90
G21
M5
M6 T1 G43 H1
M3 S1000
G0 Z8.000
G0 X10.000 Y20.000
G0 Z5.000
G1 X10.000 Y20.000 Z-1.000 F240.000
G2 X20.000 Y30.000 Z-1.000 I10.000 J0.000 K0.000 F480.000
G0 Z8.000
M05
G17 G54 G90 G80 G40
M2
"""
FUSION = """%
O01001 (TEST)
(T1 D=6. CR=0. - ZMIN=-1. - FLAT END MILL)
G90 G94 G17 G49 G40 G80
G21
G28 G91 Z0.
G90
T1 M06
S5000 M03
G54
M08
G00 X-3. Y10.
G43 Z15. H01
G01 Z1. F333.
G18 G02 X-2.4 Z0.4 I0.6 K0. F1000.
G17 G01 Y20.
G02 X0. Y22.4 I2.4 J0.
G00 Z15.
M09
G28 G91 Z0.
M30
%
"""
INKSCAPE = """%
(Header)
M3
G21 (All units in mm)
G00 Z5.000000
G00 X10.000000 Y20.000000
G01 Z-0.125000 F100.0(Penetrate)
G02 X30.000000 Y40.000000 Z-0.125000 I20.000000 J-0.000000 F400.000000
G01 X50.000000 Y60.000000 Z-0.125000
G00 Z5.000000
M5
M2
(end)
%
"""
PYCAM = """;PYCAM-META-DATA: Filename: x.stl
G40 ; disable tool radius compensation
G90 ; use absolute coordinates
G61 ; exact path mode
F300.00000
S1000.00000
G04 P3 ; wait for 3 seconds
G0 Z25.0000
G0 X1.0000 Y2.0000
G1 Z0.5000
X3
M2
"""
LASER = """; LightBurn
G00 G17 G40 G21 G54
G90
M4
G0 X0Y0
G1 X10S500F1000
G1 Y10
G1 X0 S250
G1 Y0
G1 S0
M2
"""
VECTRIC = """( Job )
T1M6
G0Z20.320
G0X0.000Y0.000S16000M3
G0X16.000Y5.750Z5.080
G1Z-1.500F254.0
G2X12.750Y5.750I-1.625J0.000F762.0
G2X16.000Y5.750I1.625J0.000
M30
"""
MARLIN = """; like the programs of printers
M17
G21
G92 E0
G28 ; home
G0 F6000 X10 Y10 Z.2
G1 X20 E1.5 F1200
M106 S255
M117 Printing (no bracket...
G1 X20 Y20 E3
M84
"""
HAAS = """%
O12345 (HAAS)
G00 G17 G20 G40 G80 G90
T1 M06
G00 G90 G54 X0.5 Y-0.5
G43 H01 Z0.1 M08
G01 Z-0.1 F10.
G187 P1 E0.0005
X1.
G53 G49 Z0.
M30
%
"""
TERSE = "g21g90g17\nm3s1000\ng0x1y1\ng1x2f100\n/g1x3\n/2x4(a)\ny5\nm2\n"
FIVE_AXES = """%
O1000
N1 G21 G90 G94 G17
N2 G0 X10. Y0. Z100. A0. C0.
N3 G43.4 H1 Z50.
N4 G1 X9.9 Y.1 Z49. A-5.123 C12.34 F3000.
N7 M30
%
"""
QUARTER = 0.5 * math.pi
PROGRAMS = {
    "FreeCAD": (FREECAD, "linuxcnc", "xyz", 3 + 6 + QUARTER * 10 + 9),
    "Fusion": (FUSION, "fanuc", "xyz", 14 + QUARTER * 0.6 + 10 + QUARTER * 2.4 + 14.6),
    "Inkscape": (INKSCAPE, "linuxcnc", "xyz", 5.125 + QUARTER * 20 + 20 * math.sqrt(2) + 5.125),
    "PyCAM": (PYCAM, "linuxcnc", "xyz", 24.5 + 2),
    "laser": (LASER, "linuxcnc", "xy", 40.0),
    "Vectric": (VECTRIC, "linuxcnc", "xyz", math.hypot(16, 5.75, 15.24) + 6.58 + math.pi * 3.25),
    "Marlin": (MARLIN, "printer", "xyz", 20.0),
    "Haas": (HAAS, "haas", "xyz", 25.4 * 0.7),
    "terse": (TERSE, "linuxcnc", "xy", 1 + 1 + 1 + 4),
    "five axes": (FIVE_AXES, "fanuc", "xyz", math.hypot(0.1, 0.1, 1)),
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_of_this_kind_is_read(tmp_path: Path, name: str) -> None:
    text, dialect, axes, length = PROGRAMS[name]
    assert detect(text.encode()).name == dialect
    path = sf.read(program(tmp_path, text))
    assert "".join(path.axes) == axes and path.length == pytest.approx(length, rel=1e-9)


def test_comments_in_comments_are_mended_when_asked_for(tmp_path: Path) -> None:
    lines = ["G1 (a (b) c) X1 F60", "X2 (no end", "X3 ) Y1"]
    assert refusal(tmp_path, *lines) == "line 1: ) closes no comment"
    path = path_of(tmp_path, *lines, repair=True)
    assert path.length == pytest.approx(2.0 + math.sqrt(2.0))
    assert sum("a comment ends at its last bracket" in finding for finding in path.findings) == 2


def test_the_centre_across_the_plane_may_be_said_if_it_is_0(tmp_path: Path) -> None:
    for fast in ("", "[0]"):  # an expression is for the interpreter
        path = path_of(tmp_path, "G1 X1 F60", f"G2 X3 I1 K0{fast}".replace("K0[0]", "K[0]"))
        assert path.length == pytest.approx(1.0 + math.pi)
    assert refusal(tmp_path, "G2 X2 I1 K0.1 F60").startswith("line 1: K lies across the plane G17")


SIEMENS = """; %_N_PART_MPF
;$PATH=/_N_WKS_DIR/_N_PART_WPD
N10 G17 G90 G71 G40 G54
N20 T="MILL_D6" D1
N40 S5000 M3
N45 MSG("a text (in brackets")
N50 G0 X0 Y0 Z50 M8
N60 CYCLE832(0.01,_FINISH,1)
N65 TRAORI
N70 G1 Z-1 F500
N80 G2 X10 Y10 CR=10
N90 G3 X20 Y20 I=AC(10) J=AC(20)
N100 G1 X=30 Y=IC(5)
N110 G91 X1 Y=AC(0)
N120 SUPA G0 Z0
N130 M30
"""


def test_siemens_words_that_say_their_own_way(tmp_path: Path) -> None:
    path = sf.read(program(tmp_path, SIEMENS, name="part.mpf"))
    ends = [curve.control_points[-1].round(9).tolist() for curve in path.curves]
    assert ends == [[0, 0, -1], [10, 10, -1], [20, 20, -1], [30, 25, -1], [31, 0, -1]]
    middle = path.curves[2]
    assert np.hypot(*(middle(np.linspace(*middle.domain, 9))[:, :2] - [10, 20]).T) == pytest.approx([10.0] * 9)
    assert any("TRAORI" in finding for finding in path.findings)


def test_modal_words_of_a_bspline(tmp_path: Path) -> None:
    """PW and PL are of their point alone, IC counts from the point before, SD is of its spline."""
    path = path_of(
        tmp_path, "; SINUMERIK", "G1 X0 Y0 F600", "BSPLINE SD=2 X10 Y20 PW=0.5", "X=IC(10) Y=IC(-5) PL=2", "X30 Y0",
        "G1 X40", "BSPLINE SD=2 X45 Y5", "X50 Y0", "G1 X60",
    )  # fmt: skip
    first, line, second, last = path.curves
    assert first.control_points.tolist() == [[0, 0], [10, 20], [20, 15], [30, 0]]
    assert first.weights is not None and first.weights.tolist() == [1.0, 0.5, 1.0, 1.0]
    assert first.knots.tolist() == [0, 0, 0, 1, 3, 3, 3] and (line.degree, last.degree) == (1, 1)
    assert (second.degree, second.control_points.tolist()) == (2, [[40, 0], [45, 5], [50, 0]])


def test_modal_words_of_g6_2(tmp_path: Path) -> None:
    """A second block begins with a new order; feeds change between; coordinates that are not said stay."""
    lines = ["O0001", "G1 X0 Y0 F600", "G6.2 P3 K0 X0 Y0 R1", "K0 X5 Y5 R2", "K0 Y0 R1", "K1", "K1", "K1", "G1 X9 F300"]
    path = path_of(tmp_path, *lines)
    spline, line = path.curves
    assert spline.control_points.tolist() == [[0, 0], [5, 5], [5, 0]] and spline.degree == 2
    assert spline.weights is not None and spline.weights.tolist() == [1, 2, 1]
    assert line.ends[0].tolist() == [5, 0] and path.feeds is not None and path.feeds.tolist() == [10, 5]
    again = [*lines[:-1], "G6.2 P2 K0", "K0 X7 Y1", "K1", "K1"]  # without its first point, which is where the tool is
    assert path_of(tmp_path, *again).curves[1].control_points.tolist() == [[5, 0], [7, 1]]
    assert (
        refusal(tmp_path, *again, "X8") == "line 13: the spline before has all its knots; begin the next one with G6.2"
    )


def test_a_round_pocket_of_a_haas_is_not_left_out_in_silence(tmp_path: Path) -> None:
    file = tmp_path / "part.nc"
    file.write_text("%\nO00005 (POCKET)\nG21 G90\nG1 X1. F100.\nG13 I5. F50.\nM30\n%\n")
    with pytest.raises(FormatError, match="line 5: G13 is not known in the dialect Fanuc"):
        sf.read(file)
