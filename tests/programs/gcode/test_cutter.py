"""Cutter compensation: held against LinuxCNC's own interpreter where it is installed, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gcode_programs import path_of, program, refusal
from rs274_held import held_against
from rs274_twin import PROGRAM

TWIN = pytest.mark.skipif(PROGRAM is None, reason="no LinuxCNC; on Debian 12: apt-get install linuxcnc-uspace")
BEGIN = ("G21 G90 F100", "G0 X-10 Y-10")

PROGRAMS = [
    "G41.1 D4\nG1 X0 Y0\nX20\nY20\nX0\nY0\nX20\nG40\nG0 X30 Y-10",
    "G42.1 D4\nG1 X0 Y0\nX20\nY20\nZ-2\nX0\nY0\nG40 G1 X-10",
    "G41.1 D4\nG1 X0 Y0\nG2 X10 Y0 R20\nG3 X20 Y10 R15\nG1 X0 Y30\nG3 X-10 Y40 R8\nG1 X-40",
    "G18 G0 X-10 Z-10\nG41.1 D4\nG1 X0 Z0\nZ20\nX20\nZ0",
    "G41.1 D-4\nG1 X0 Y0\nX20",
    "G41.1 D4\nG0 X0 Y0\nX20\nY-20\nX0",
    "G41.1 D1\nG2 X5 Y5 R30\nG1 X9\nG40\nX3",
    "G41.1 D1\nG1 X5 Y5\nX9\nG40\nG0 Z5\nX3",
    "G42.1 D1\nG3 X5 Y0 R20\nG1 X9 Y9\nG40",
    "G41.1 D0\nG2 X5 Y5 R30\nG40\nG1 X3",
    "G41.1 D4\nG1 X0 Y0\nX20\nX40\nG2 X40 Y0 I0 J-10\nG1 Y30",
    # arcs that meet twice: the corner is cut off at the place that lies on both
    "G20\nG41.1 D.15\nG1 X.0652 Y1.5342\nY2.4577\nG2 X.6065 I.2707\nG2 X1.4888 I.4411\nG1 X2",
    "G41.1 D.5\nG1 X-39.500873 Y-104.657107\nX-54.500873 Y-94.657107\nG2 I-1.575966 J-2.552711 X-57.872219 Y-99.613276",
]
REFUSED = [
    ("G42.1 D4\nG1 X0 Y0\nX1\nX1 Y-20", 6, "the tool of radius 2 mm cannot reach this corner without a gouge"),
    ("G42.1 D40\nG1 X0 Y0\nX10", 4, "the line on which cutter compensation begins must be longer than the tool's rad"),
    ("G41.1 D4\nG1 X0 Y0\nX10\nG3 X15 Y5 I0 J1.5", 6, ""),
    ("G41.1 D4\nG1 X0 Y0\nX10\nG3 X10 Y3 I0 J1.5", 6, "the arc's radius 1.5 mm is too small for the tool's 2 mm"),
    ("G41.1 D4\nG1 X0 Y0\nG55\nX10", 5, "G55 is not allowed between G41 or G42 and G40"),
    ("G41.1 D4\nG41.1 D4\nX10", 4, "G41.1 needs G40 before it"),
    ("G19\nG41.1 D4\nX10", 4, "G41.1 needs G17 or G18 before it"),
    ("G41.1\nX10", 3, "G41.1 needs D"),
    ("G41.1 D1\nG1 X0 Y0\nX20\nG40\nG2 X30 Y5 R30", 7, "the first move after G40 must be a line, G0 or G1"),
    ("G41.1 D2\nG3 X-9.7 Y-9.7 R3", 4, "the arc on which cutter compensation begins does not lead beside its contour"),
]  # fmt: skip


@TWIN
@pytest.mark.linuxcnc
@pytest.mark.parametrize("text", PROGRAMS)
def test_moves_beside_a_contour_are_those_of_linuxcnc(tmp_path: Path, text: str) -> None:
    assert held_against(program(tmp_path, *BEGIN, text, "M2")).error == ""


@TWIN
@pytest.mark.slow
@pytest.mark.linuxcnc
# in 1 the second line would be run backwards, which is a gouge here and not in LinuxCNC
@pytest.mark.parametrize("seed", [*(seed for seed in range(60) if seed != 1), 76, 181, 205, 243])
def test_random_contours_are_those_of_linuxcnc(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-30, -12, 2)
    lines = [f"G0 X{x:.2f} Y{y:.2f}", f"{rng.choice(['G41.1', 'G42.1'])} D{rng.uniform(0.5, 4):.2f}", "G1 X0 Y0"]
    for _ in range(rng.integers(2, 6)):
        x, y = rng.uniform(-20, 20, 2)
        kind = rng.choice(["G1", "G1", "G1", "G2", "G3", "Z"])
        radius = f" R{rng.uniform(30, 50):.2f}" if kind in ("G2", "G3") else ""
        lines.append(f"G1 Z{x:.2f}" if kind == "Z" else f"{kind} X{x:.2f} Y{y:.2f}{radius}")
    held_against(program(tmp_path, "G21 G90 F100", *lines, "G40", "G0 X50 Y0", "M2"))


@pytest.mark.parametrize(("text", "line", "reason"), REFUSED)
def test_what_cannot_be_is_refused_with_its_line(tmp_path: Path, text: str, line: int, reason: str) -> None:
    assert refusal(tmp_path, *BEGIN, text, "M2").startswith(f"line {line}: {reason}")


def test_the_radius_is_that_of_the_tool(tmp_path: Path) -> None:
    (tmp_path / "t.tbl").write_text("T3 D4\n")
    path = path_of(tmp_path, *BEGIN, "T3 M6", "G41", "G1 X0 Y0", "Y20", "G40", "G0 X50", tools=tmp_path / "t.tbl")
    ends = np.array([curve.control_points[-1] for curve in path.curves])
    assert ends == pytest.approx(np.array([[-10, -10], [-2, 0.8284271], [-2, 20], [50, 20]]), abs=1e-6)
