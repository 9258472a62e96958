"""Arcs, helices and splines against their formulas."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import splinefeed as sf
from gcode_programs import path_of, refusal
from splinefeed.programs.gcode.arcs import HELIX_ERROR


def test_an_arc_is_exact_and_runs_the_right_way(tmp_path: Path) -> None:
    path = path_of(tmp_path, "G21 F600", "G2 X10 Y0 I5 J0", "G3 X0 Y0 R5", "G2 X10 Y0 R-5.5", "G3 I0 J5")
    points = [curve(np.linspace(*curve.domain, 201)) for curve in path.curves]
    centres = [(5, 0), (5, 0), (5, math.sqrt(5.5**2 - 25)), (10, 5)]
    for each, centre, radius in zip(points, centres, (5, 5, 5.5, 5), strict=True):
        assert np.max(np.abs(np.hypot(*(each - centre).T) - radius)) < 5e-14
    turned = [np.unwrap(np.arctan2(*(each - centre).T[::-1])) for each, centre in zip(points, centres, strict=True)]
    sweeps = [turn[-1] - turn[0] for turn in turned]
    large = 2 * math.pi - 2 * math.asin(5 / 5.5)
    assert np.allclose(sweeps, [-math.pi, math.pi, -large, 2 * math.pi])


@given(
    plane=st.sampled_from([17, 18, 19]),
    start=st.tuples(*[st.floats(-50, 50)] * 3),
    offset=st.tuples(st.floats(1, 50), st.floats(-50, 50)),
    turn=st.floats(0.05, 6.2),
    rise=st.floats(-30, 30),
    turns=st.integers(1, 3),
    ccw=st.booleans(),
)
def test_a_helix_is_linear_in_the_angle(
    tmp_path_factory: pytest.TempPathFactory,
    plane: int,
    start: tuple[float, float, float],
    offset: tuple[float, float],
    turn: float,
    rise: float,
    turns: int,
    ccw: bool,
) -> None:
    a, b, c = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}[plane]
    begin = np.array(start)
    centre = begin[[a, b]] + offset
    angle = (1 if ccw else -1) * turn
    arm = begin[[a, b]] - centre
    end = begin.copy()
    end[[a, b]] = centre + [
        arm[0] * math.cos(angle) - arm[1] * math.sin(angle),
        arm[0] * math.sin(angle) + arm[1] * math.cos(angle),
    ]
    end[c] += rise
    words = [f"{'XYZ'[k]}{end[k]:.15f}" for k in range(3)]
    words += [f"{'IJK'[k]}{value:.15f}" for k, value in zip((a, b), offset, strict=True)]
    line = f"G{3 if ccw else 2} {' '.join(words)} P{turns}"
    path = path_of(tmp_path_factory.mktemp("g"), f"G{plane} F1", line, start=start)
    (curve,) = path.curves
    u = np.linspace(*curve.domain, 400)
    points = curve(u)
    radius = np.hypot(*arm)
    assert np.max(np.abs(np.hypot(*(points[:, [a, b]] - centre).T) - radius)) < 1e-11 * (1 + radius)
    swept = np.unwrap(np.arctan2(*(points[:, [a, b]] - centre).T[::-1]))
    whole = angle + (1 if ccw else -1) * 2 * math.pi * (turns - 1)
    linear = begin[c] + rise * (swept - swept[0]) / whole
    assert swept[-1] - swept[0] == pytest.approx(whole, abs=1e-9)
    assert np.max(np.abs(points[:, c] - linear)) < HELIX_ERROR + 1e-12 * (1 + abs(rise)) * (1 + radius)
    assert path.length == pytest.approx(math.hypot(radius * whole, rise), rel=1e-8)


def test_rotary_axes_go_with_the_angle_of_an_arc(tmp_path: Path) -> None:
    path = path_of(tmp_path, "F100", "G3 X0 Y20 I0 J10 A90", start=(0, 0, 0, 0))
    assert path.axes == ("x", "y", "a")
    points = path.curves[0](np.linspace(*path.curves[0].domain, 101))
    angle = np.unwrap(np.arctan2(points[:, 0], 10 - points[:, 1]))
    assert np.max(np.abs(points[:, 2] - angle / 2)) < HELIX_ERROR


def test_absolute_centres_and_offsets(tmp_path: Path) -> None:
    path = path_of(tmp_path, "G10 L2 P1 X100", "G90.1 F100", "G0 X0 Y0", "G2 X10 Y0 I5 J0", start=(100, 0))
    points = path.curves[-1](np.linspace(*path.curves[-1].domain, 50))
    assert np.allclose(np.hypot(*(points - [105, 0]).T), 5)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("G2 X10 I5.1", "line 2: the arc ends"),
        ("G2 X10 R4", "line 2: the radius R 4 mm is 1 mm too small for ends 10 mm apart (tolerance 0.00127 mm)"),
        ("G2 X0 Y0 R4", "line 2: an arc with R ends where it begins; write a full circle with I and J"),
        ("G2 X10", "line 2: an arc needs its centre (I, J, K) or its radius (R), and none is given"),
        ("G2 X10 I5 R5", "line 2: an arc needs its centre (I, J, K) or its radius (R), and both are given"),
        ("G2 X10 I5 K1", "line 2: K lies across the plane G17; choose another plane or leave it out"),
        ("G2 X10 I0 J0", "line 2: the arc has its centre where it begins: radius 0"),
        ("G2 X10 I5 P1.5", "line 2: P1.5: the turns of an arc must be whole, 1 to 1000"),
        ("G90.1 G2 X10 I5", "line 2: with G90.1 an arc needs both words of its centre"),
    ],
)
def test_arcs_that_cannot_be(tmp_path: Path, line: str, reason: str) -> None:
    assert refusal(tmp_path, "F100", line).startswith(reason)


def test_the_tolerance_of_arcs_in_inches_is_that_of_inches(tmp_path: Path) -> None:
    words = "G2 X1 Y0 I0.502 J0"  # radii that differ by 0.004 in, of 0.5 in
    assert "off its circle" in refusal(tmp_path, "G20 F10", words)
    path_of(tmp_path, "G20 F10", "G2 X1 Y0 I0.501 J0")  # by 0.002 in = 0.05 mm, as words of three decimals may
    assert "off its circle" in refusal(tmp_path, "G21 F10", "G2 X25.4 Y0 I12.7254 J0")


def test_an_arc_that_only_goes_outwards_is_its_chord(tmp_path: Path) -> None:
    path = path_of(tmp_path, "F100", "G2 X-0.001 Y0 I10 J0", "G3 X-0.002 Y0 Z1 I10 J0")
    assert [curve.degree for curve in path.curves] == [1, 1]


def test_cubic_and_quadratic_splines(tmp_path: Path) -> None:
    path = path_of(tmp_path, "F100", "G5 I0 J3 P0 Q-3 X1 Y1", "G5 P0 Q-3 X2 Y2", "G5.1 X6 Y2 I2 J-8")
    first, second, third = path.curves
    assert first.control_points.tolist() == [[0, 0], [0, 3], [1, -2], [1, 1]]
    assert second.control_points.tolist() == [[1, 1], [1, 4], [2, -1], [2, 2]]
    assert third.control_points.tolist() == [[2, 2], [4, -6], [6, 2]]


def test_a_nurbs_block_begins_where_the_tool_is(tmp_path: Path) -> None:
    path = path_of(tmp_path, "F10", "G5.2 P2 L3", "X0 Y1 P1", "X2 Y2", "X2 Y0", "X0 Y0 P2", "G5.3", "G1 X5")
    curve = path.curves[0]
    assert curve.degree == 2 and curve.knots.tolist() == [0, 0, 0, 1, 2, 3, 3, 3]
    assert curve.control_points.tolist() == [[0, 0], [0, 1], [2, 2], [2, 0], [0, 0]]
    assert curve.weights is not None and curve.weights.tolist() == [2, 1, 1, 1, 2]
    assert path.curves[1].control_points.tolist() == [[0, 0], [5, 0]]


def test_knots_of_g6_2_with_and_without_the_first_point(tmp_path: Path) -> None:
    knots = [0, 0, 0, 0, 0.4, 1, 1, 1, 1]
    points = [(0, 0, 0), (1, 2, 0), (3, 1, 1), (4, -1, 2), (6, 0, 0)]
    weights = [1, 2, 0.5, 1, 1]
    lines = [f"K{k} X{x} Y{y} Z{z} R{w}" for k, (x, y, z), w in zip(knots, points, weights, strict=False)]
    tail = [f"K{k}" for k in knots[5:]]
    whole = path_of(tmp_path, "F60", f"G6.2 P4 {lines[0]}", *lines[1:], *tail, "G1 X7")
    without = path_of(tmp_path, "F60", "G6.2 P4 K0 R1", *lines[1:], *tail, "G1 X7")
    late = path_of(tmp_path, "F60", "G6.2 P4", *lines[1:], *tail, "G1 X7", dialect="fanuc")
    for path in (whole, without, late):
        assert path.curves[0] == sf.NurbsCurve(3, knots, points, weights)
        assert len(path.curves) == 2


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["G5 X1 P1 Q1"], "line 2: the first G5 of a row needs I and J"),
        (["G5 X1 I1 J1"], "line 2: G5 needs P and Q"),
        (["G5 X1 I1 P1 Q1"], "line 2: I and J belong together; one is missing"),
        (["G5.1 X1 Y1"], "line 2: G5.1 needs I or J, and not both 0"),
        (["G5.1 X1 Y1 Z1 I1"], "line 2: G5.1 moves X and Y, and nothing else"),
        (["G18 G5.1 X1 Y1 I1"], "line 2: G5.1 needs the plane G17"),
        (
            ["G5.2 L3", "X1 Y1", "G5.3"],
            "line 4: the spline from line 2 on: 2 control point(s) for degree 2; expected at least 3",
        ),
        (["G5.2 L30"], "line 2: the order 30 of a spline must be whole, 2 to 13"),
        (["G5.2", "X1 Z1"], "line 3: a control point of G5.2 in G17 needs X and Y, and nothing else but P"),
        (["G5.2", "X1 Y1 P-1"], "line 3: the weight -1 of a control point must be greater than 0"),
        (
            ["G6.2 P2 K0 X0 Y0", "K0 X1 Y1", "K1", "G1 X2"],
            "line 5: the spline from line 2 on: 3 knots for",
        ),
        (["G6.2 P2 K0 X5 Y0", "K0 X1 Y1", "K1", "K1"], "line 5: the spline from line 2 on begins 5 mm from where"),
        (["G6.2 P2 K0 X0 Y0", "X1 Y1"], "line 3: every line of G6.2 needs its knot, K"),
        (["G6.2 P2 K0 X0 Y0", "K2 X1 Y1", "K1", "K1"], "line 5: the spline from line 2 on: knots decrease"),
    ],
)
def test_splines_that_cannot_be(tmp_path: Path, lines: list[str], reason: str) -> None:
    assert refusal(tmp_path, "F100", *lines).startswith(reason)


HOUSE = ((0, 0), (5, 9), (9, 12), (15, 3), (20, 0))


def g6_2(letters: str, last: str) -> list[str]:
    """The spline of HOUSE as LinuxCNC 2.10 writes it: points with knots, then the last knots alone."""
    a, b = letters
    knots = (0, 0, 0, 0, 1)
    lines = [f"{a}{x} {b}{y} R{1 + k} K{k}" for (x, y), k in zip(HOUSE, knots, strict=True)]
    return [f"G6.2 {lines[0]} P4 Q1", *lines[1:], *(f"G6.2 K{k}" for k in last.split())]


@pytest.mark.parametrize(("plane", "letters"), [("G17", "XY"), ("G18", "XZ"), ("G19", "YZ")])
def test_a_spline_whose_last_knots_stand_alone(tmp_path: Path, plane: str, letters: str) -> None:
    path = path_of(
        tmp_path, "#10=600", plane, "G0 X1 Y1 Z1", "X0 Y0 Z0", "F#10", *g6_2(letters, "2 2 2 2"), "G1 X30 Y30 Z30",
        *("G0 X0 Y0 Z0", *g6_2(letters, "2 2 2 2")), "M2",
    )  # fmt: skip
    columns = ["XYZ".index(letter) for letter in letters]
    wanted = sf.NurbsCurve(3, [0, 0, 0, 0, 1, 2, 2, 2, 2], HOUSE, [1, 1, 1, 1, 2])
    for curve in (path.curves[2], path.curves[5]):
        u = np.linspace(0.0, 2.0, 50)
        assert np.allclose(curve(u)[:, columns], wanted(u), atol=1e-13)
    assert path.feeds is not None and path.feeds[2] == 10.0


def test_a_spline_that_ends_before_its_last_control_point_says_so(tmp_path: Path) -> None:
    path = path_of(tmp_path, "F600", *g6_2("XY", "2 3 4 5"), "G1 X30")
    whole = sf.NurbsCurve(3, [0, 0, 0, 0, 1, 2, 3, 4, 5], HOUSE, [1, 1, 1, 1, 2])
    end = whole(whole.domain[1])
    assert np.allclose(path.curves[0].control_points[-1], end) and np.allclose(path.curves[1].control_points[0], end)
    off = np.max(np.abs(end - HOUSE[-1]))
    said = f"the spline ends where its last knot span ends, at knot 2, {off:.6g} mm from its last control point"
    assert any(said in finding for finding in path.findings)


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (
            g6_2("XY", "2 2 2"),
            "line 10: the spline from line 2 on: 8 knots for 5 control points",
        ),
        ([*g6_2("XY", "2 2 2 2"), "G6.2 K2"], "line 12: the spline from line 11 on: 1 control point(s) for degree 3"),
        (g6_2("XY", "2 1 2 2"), "line 10: the spline from line 2 on: knots decrease"),
        (["G18", "G5.2 P1 L3 X1 Y1"], "line 3: a control point of G5.2 in G18 needs X and Z, and nothing else but P"),
        (["G19", "G5.2 P1 L3", "X1 Y1"], "line 4: a control point of G5.2 in G19 needs Y and Z"),
    ],
)
def test_splines_that_are_not_complete(tmp_path: Path, lines: list[str], reason: str) -> None:
    assert refusal(tmp_path, "F600", *lines, "G1 X1").startswith(reason)


def test_g5_2_takes_the_words_of_its_plane(tmp_path: Path) -> None:
    blocks = [
        [plane, "G0 X0 Y0 Z0", "G5.2 P1 L3", *(f"{a}{x} {b}{y} P{w}" for x, y, w in ((0, 1, 1), (2, 2, 2), (2, 0, 1)))]
        for plane, (a, b) in (("G17", "XY"), ("G18", "XZ"), ("G19", "YZ"))
    ]
    path = path_of(tmp_path, "F600", *(line for block in blocks for line in (*block, "G5.3")))
    flat = [curve for curve in path.curves if curve.degree == 2]
    wanted = sf.NurbsCurve(2, [0, 0, 0, 1, 2, 2, 2], [(0, 0), (0, 1), (2, 2), (2, 0)], [1, 1, 2, 1])
    u = np.linspace(0.0, 2.0, 50)
    for curve, columns in zip(flat, ([0, 1], [0, 2], [1, 2]), strict=True):
        assert np.allclose(curve(u)[:, columns], wanted(u), atol=1e-13)
