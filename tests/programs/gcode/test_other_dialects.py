"""Fanuc, Siemens, printers: what of them is read, by the examples of their manuals where there are some."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import detect, path_of, program, refusal
from sample_curves import random_curve
from splinefeed.programs.gcode.dialects import holds


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
        (["BSPLINE SD=-1 X=1"], "line 1: the order 0 of a spline must be whole"),
        (["BSPLINE X=1 PW=0"], "line 1: the weight 0 of a control point must be greater than 0"),
        (["BSPLINE X=1 PL=1", "X=2 PL=-2", "X=3 SD=2", "G1"], "line 4: the spline from line 1 on: knots decrease"),
        (["BSPLINE X=1", "X=2", "G1 X=3"], "line 3: the spline from line 1 on: 3 control point(s) for degree 3"),
        (["X=1 PL=2"], "line 1: PL and PW belong to BSPLINE"),
        (["CYCLE800(1,2)"], "line 1: CYCLE800( is a call, which is not supported; write plain lines"),
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
    assert refusal(tmp_path, "//x", "G1 X1", dialect="linuxcnc").startswith("line 1: expected a letter, got '/X'")


def test_printers(tmp_path: Path) -> None:
    path = path_of(
        tmp_path, "M104 S200", "M117 Hello (there", "G92 E0", "G1 X10 E1.5 F1200", "G1 E-2", "N7 G1 Y5 E2*71",
        "G4 P500", "M84",
    )  # fmt: skip
    # E from 1.5 to -2 at 20 mm/s, then G4
    assert len(path.curves) == 2 and [wait for _, wait in path.dwells] == pytest.approx([3.5 / 20.0, 0.5])
    assert "E words, the filament of a printer, are no axis of the path; alone, they take their time" in path.findings


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
        ("M104 S200\nG1 X1\n", "printer"),
        ("G1 X1 Y1 E0.5\n", "printer"),
        ("M201 X9000 Y9000\nG1 X1\n", "printer"),
        (";FLAVOR:Marlin\nG1 X1\n", "marlin"),
        ("START_PRINT BED=60\nG1 X1\n", "klipper"),
        ("$32=1\nG1 X1 S5\n", "grbl"),
        ("$H\nG1 X1\n", "grbl"),
        ("M4 S0\nG1 X1 S5\n", "grbl"),
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


def test_commands_of_senders_to_grbl_move_nothing(tmp_path: Path) -> None:
    """bCNC's %wait and FluidNC's [ESP800]."""
    path = path_of(tmp_path, "$H", "[ESP800]", "G0 X0 Y0", "%wait", "G1 X50 F800", "%m abs(1)", start=(0, 0, 0))
    assert path.length == 50.0
    assert path.findings[0] == (
        "lines that begin with $ or ? or ! or ~ or [ESP or % move nothing: line 1, 2, 4 and 1 more"
    )


def test_pins_of_hal_are_named(tmp_path: Path) -> None:
    said = refusal(tmp_path, "G1 X1 F#<_hal[plasmac.cut-feed-rate]>")
    assert said == "line 1: F: #<_hal[plasmac.cut-feed-rate]> is a value of the machine's own, which is not known here"


def test_alarms_and_prints_of_macros(tmp_path: Path) -> None:
    head = ["O0417", "POPEN", "DPRNT[X#5041[43]]", "PCLOS", "G0 X0. Y0. Z0.", "#3006=1(CHECK TOOL)", "G1 X9. F60."]
    path = path_of(tmp_path, *head, "IF [1 EQ 2] THEN #3000=1(BAD)", "M30")
    assert path.length == 9.0 and [each.text for each in path.markers] == ["#3006=1", "M30"]
    assert (
        refusal(tmp_path, *head, "#3000=1(TOO DEEP)") == "line 8: the program raises alarm #3000=1: #3000=1(TOO DEEP)"
    )


def test_codes_and_calls_of_siemens_that_are_not_read_are_named(tmp_path: Path) -> None:
    head = ["; SINUMERIK", "G0 X0 Y0 Z0"]
    assert refusal(tmp_path, *head, "G111 X0 Y0") == (
        "line 3: G111 is a code of Siemens Sinumerik that is not read; write its moves"
    )
    assert refusal(tmp_path, *head, "L10 P3").startswith("line 3: L10 calls a subprogram, which is not read")


def test_a_fanuc_program_without_any_point_says_what_it_was_taken_for(tmp_path: Path) -> None:
    lines = ["O0403", "G21 G90", "G0 X0 Y0 Z5000", "G1 X20000 F100"]
    assert path_of(tmp_path, *lines).findings[0] == (
        "axis words without a decimal point, as Z5000, are taken as mm or inches (option increments): line 3, 4"
    )
    path = path_of(tmp_path, *lines, increments=True)
    assert path.length == pytest.approx(25.0) and "taken as thousandths of mm" in path.findings[0]


def test_a_wait_in_the_words_of_another_control_names_it(tmp_path: Path) -> None:
    assert refusal(tmp_path, "G0 X0 Y0", "G4 X2.") == (
        "line 2: G4 needs P, the time to wait; X and U are Fanuc's: name the control (option dialect)"
    )
