"""Fanuc, Siemens, Heidenhain, printers: what of them is read, by the examples of their manuals where there are some."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import path_of, program, refusal
from sample_curves import random_curve
from splinefeed.formats.gcode.dialects import detect, holds

#: From the example for three axes in HEIDENHAIN's iTNC 530 manual, 12.7.
SPL = (
    "0 BEGIN PGM spline MM",
    "1 BLK FORM 0.1 Z X+0 Y+0 Z-10",
    "2 TOOL CALL 1 Z S4000",
    "7 L X+28.338 Y+19.385 Z-0.5 FMAX",
    "8 SPL X24.875 Y15.924 Z-0.5 ~",
    "K3X-4.688E-002 K2X2.459E-002 K1X3.486E+000 ~",
    "K3Y-4.563E-002 K2Y2.155E-002 K1Y3.486E+000 ~",
    "K3Z0.000E+000 K2Z0.000E+000 K1Z0.000E+000 F10000",
    "9 SPL X17.952 Y9.003 Z-0.500 ~",
    "K3X5.159E-002 K2X-5.644E-002 K1X6.928E+000 ~",
    "K3Y3.753E-002 K2Y-2.644E-002 K1Y6.910E+000 ~",
    "K3Z0.000E+000 K2Z0.000E+000 K1Z0.000E+000",
    "10 L X+0 Y+0 R0 F500 M9",
    "11 END PGM spline MM",
)


def test_the_example_of_heidenhains_manual(tmp_path: Path) -> None:
    path = sf.read(program(tmp_path, *SPL))
    assert path.axes == ("x", "y", "z") and [curve.degree for curve in path.curves] == [3, 3, 1]
    for curve, words in (
        (path.curves[0], ((-4.688e-2, 2.459e-2, 3.486, 24.875), (-4.563e-2, 2.155e-2, 3.486, 15.924))),
        (path.curves[1], ((5.159e-2, -5.644e-2, 6.928, 17.952), (3.753e-2, -2.644e-2, 6.910, 9.003))),
    ):
        v = np.linspace(0.0, 1.0, 21)
        t = 1.0 - v
        wanted = np.column_stack([np.polyval(each, t) for each in words])
        assert np.max(np.abs(curve(v)[:, :2] - wanted)) < 2e-3  # the first control point is where the tool is
        assert np.max(np.abs(curve(v)[1:, :2] - wanted[1:])) < 1e-3
    assert path.feeds is not None and path.feeds.tolist() == [10000 / 60, 10000 / 60, 500 / 60]
    assert [marker.text for marker in path.markers] == ["T1 M6 S4000", "M9"]
    assert "SPL is read as the manual describes it; it was not checked on a control" in path.findings


def test_circles_of_heidenhain(tmp_path: Path) -> None:
    lines = ["BEGIN PGM a MM", "L X+0 Y+0 F600", "CC X+5 Y+0", "C X+10 Y+0 DR-", "CR X+0 Y+0 R+5 DR+", "L IX+3 FMAX"]
    path = path_of(tmp_path, *[f"{i} {line}" for i, line in enumerate(lines)], "6 END PGM a MM")
    middle = [curve(0.5 * sum(curve.domain)).tolist() for curve in path.curves]
    assert np.allclose(middle, [[5, 5], [5, 5], [1.5, 0]])


@pytest.mark.parametrize(
    ("block", "reason"),
    [
        ("L X+1 RL", "line 2: RL and RR are cutter compensation"),
        ("C X+1 DR+", "line 2: C needs the centre of its circle, CC, before it"),
        ("CR X+1 R+5", "line 2: CR needs DR+ or DR-"),
        ("SPL X+1 K3X0 K2X0", "line 2: K1X needs a number, got ''"),
        ("SPL X+1 K3X0 K2X0 K1X5", "line 2: SPL begins 6 from where the tool is in X; at most 0.002 is allowed"),
        ("CYCL DEF 200", "line 2: 'CYCL' is not supported in a Heidenhain program"),
        ("L X+1 X+2", "line 2: X appears twice"),
        ("L X+1 Q5", "line 2: expected a word of a Heidenhain program, got 'Q5'"),
    ],
)
def test_what_heidenhain_has_and_is_not_read(tmp_path: Path, block: str, reason: str) -> None:
    assert refusal(tmp_path, "0 BEGIN PGM a MM", f"1 {block}").startswith(reason)


def test_a_bspline_of_siemens(tmp_path: Path) -> None:
    path = path_of(
        tmp_path, "N10 G71 G90 G1 X0 Y0 F600 G642", "N20 BSPLINE X=10 Y20 PW=0.5 PL=1 SD=2", "N30 X20 Y0 PL=2.5",
        'MSG("rest")', "N40 X30 Y-10 PL=1", "N50 X40 Y=0 PL=0", "N60 G1 X50", "N70 G2 X60 CR=5", "N80 M30",
    )  # fmt: skip
    points = [(0, 0), (10, 20), (20, 0), (30, -10), (40, 0)]
    assert path.curves[0] == sf.NurbsCurve(2, [0, 0, 0, 1, 3.5, 4.5, 4.5, 4.5], points, [1, 0.5, 1, 1, 1])
    assert path.curves[1].control_points.tolist() == [[40, 0], [50, 0]] and path.curves[2].degree == 2
    assert path.tolerances is not None and path.feeds is not None and set(path.feeds.tolist()) == {10.0}


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["BSPLINE SD=4"], "line 1: SD=4: the degree of a BSPLINE is 2 or 3"),
        (["BSPLINE X=1 PW=4"], "line 1: PW=4: weights are greater than 0 and at most 3"),
        (["BSPLINE X=1", "X=2", "G1 X=3"], "line 3: the BSPLINE of line 1 has 3 control points; degree 3 needs more"),
        (["X=1 PL=2"], "line 1: PL and PW belong to BSPLINE"),
        (["CYCLE800(1,2)"], "line 1: CYCLE800( is a call, which is not supported; write plain lines"),
        (["R1=5", "BSPLINE"], "line 1: R1= is not supported in a Siemens program"),
        (["ASPLINE X=1"], "line 1: ASPLINE is not supported in a Siemens program; write plain lines"),
        (["X=IC(5)"], "line 1: "),
    ],
)
def test_what_siemens_has_and_is_not_read(tmp_path: Path, lines: list[str], reason: str) -> None:
    assert refusal(tmp_path, *lines, dialect="siemens").startswith(reason)


@pytest.mark.parametrize("seed", [1, 2, 13, 25, 14, 26])
def test_a_bspline_comes_back(tmp_path: Path, seed: int) -> None:
    curve = random_curve(seed, axes=3)
    weights = None if curve.weights is None else np.clip(curve.weights / curve.weights[0], 0.2, 3.0)
    if weights is not None:
        weights[0] = 1.0
    curve = sf.NurbsCurve(curve.degree, curve.knots, curve.control_points, weights)
    said = sf.write(sf.Path([curve]), tmp_path / "a.mpf", dialect="siemens", feed=10, decimals=17)
    back = sf.read(tmp_path / "a.mpf")
    assert detect((tmp_path / "a.mpf").read_bytes()).name == "siemens"
    if said:
        assert "written as lines" in said[0]
        return
    u, v = np.linspace(*curve.domain, 100), np.linspace(*back.curves[0].domain, 100)
    assert np.max(np.abs(curve(u) - back.curves[0](v))) < 1e-10 * (1 + np.max(np.abs(curve.control_points)))


def test_fanuc_programs(tmp_path: Path) -> None:
    path = path_of(
        tmp_path, "%", "O0001(part)", "G05 P10000", "G05.1 Q1", "G90 G1 X0. Y1. F600", "G04 X0.5", "G04 P250",
        "G06.2 P3 K0. X0. Y1. R1.", "K0. X2. Y3.", "K0. X4. Y1.", "K1.", "K1.", "K1.", "G01 X5.", "M30", "%",
    )  # fmt: skip
    assert path.curves[1] == sf.NurbsCurve.bezier([(0, 1), (2, 3), (4, 1)])
    assert [wait for _, wait in path.dwells] == [0.75]
    assert sum("switches a function of the control" in finding for finding in path.findings) == 2


def test_directives_and_program_numbers_of_fanuc(tmp_path: Path) -> None:
    lines = ("%", ":O1234(part)", "//highspeedmodeon", "G90 G1 X1. F600", "// smooth 3", "G04 P250", "X2.", "M30", "%")
    file = program(tmp_path, *lines)
    assert holds(file.read_bytes()) and detect(file.read_bytes()).name == "fanuc"
    path = path_of(tmp_path, *lines)
    assert len(path.curves) == 2 and [wait for _, wait in path.dwells] == [0.25]
    assert any("lines that begin with //" in each and "line 3, 5" in each for each in path.findings)
    assert refusal(tmp_path, "//x", "G1 X1", dialect="linuxcnc").startswith("line 1: expected a letter, got '/x'")


def test_printers(tmp_path: Path) -> None:
    path = path_of(
        tmp_path, "M104 S200", "M117 Hello (there", "G92 E0", "G1 X10 E1.5 F1200", "G1 E-2", "N7 G1 Y5 E2*71",
        "G4 P500", "M84",
    )  # fmt: skip
    assert len(path.curves) == 2 and path.dwells[0][1] == 0.5
    assert "E words, the filament of a 3-D printer, are not part of the path and are left out" in path.findings


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("G21\nG1 X1\n", "linuxcnc"),
        ("O1234\nG1 X1\n", "fanuc"),
        (":O12\nG1 X1\n", "fanuc"),
        ("G06.2 P3 K0. X0. Y1. R1.\nK1. X1.\n", "fanuc"),
        ("G6.2 X0 Y1 R1 K0 P4 Q1\nX1 Y1 R1 K0\nG6.2 K1\n", "linuxcnc"),
        ("G1 X=1 Y=2\n", "siemens"),
        ("N10 BSPLINE X1\n", "siemens"),
        ("0 BEGIN PGM A MM\n", "heidenhain"),
        ("M104 S200\nG1 X1\n", "printer"),
        ("G1 X1 Y1 E0.5\n", "printer"),
        ("(for Mach3)\nG1 X1\n", "mach3"),
    ],
)
def test_dialects_are_told_apart(text: str, name: str) -> None:
    assert detect(text.encode()).name == name
    assert holds(text.encode())


@pytest.mark.parametrize(
    "text", [b"", b"hello world\n", b"1.0 2.0\n3.0 4.0\n", b'{"degree": 3}', b"G1\0X1", b"\n" * 65536]
)
def test_what_is_no_program(text: bytes) -> None:
    assert not holds(text)
