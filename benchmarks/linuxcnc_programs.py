"""Twenty programs for LinuxCNC's planner and ours: own ones, from reports of its users, its own files, CAM files."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

#: Where Debian puts the programs that LinuxCNC brings, and where CAM programs of the tests are.
THEIRS = Path("/usr/share/linuxcnc/ncfiles")
CAM = Path(__file__).parents[1] / "tests" / "data" / "gcode"
HEAD = "G21 G90 G17 G64 P0.01\nF3000\n"


@dataclass(frozen=True)
class Program:
    """A program, its text, and the axes of the machine that runs it; exact  whether it is in G61 or G61.1."""

    name: str
    text: str
    axes: str = "xyz"
    exact: bool = False


def exact(word: str = "G61") -> str:
    """Lines, arcs and a helix, exact path or exact stop."""
    return (
        f"G21 G90 G17 {word}\nF3000\nG0 X10 Y0 Z5\nG1 X40 Y0 Z0\nG2 X60 Y20 I0 J20\nG3 X60 Y20 I-10 J0\n"
        "G3 X50 Y30 Z2 I-10 J0\nG1 X0 Y0 Z5\nM2\n"
    )


def pocket(rings: int = 4) -> str:
    """Rings with rounded corners, as a CAM program leaves them, in G64 P0.01."""
    lines = ["G0 X5 Y0 Z2", "G1 Z0"]
    for k in range(1, rings + 1):
        x, y, r = 4.0 * k + 8.0, 4.0 * k, 3.0
        lines += [
            f"G1 X{x - r} Y{-y}", f"G3 X{x} Y{-y + r} I0 J{r}", f"G1 Y{y - r}", f"G3 X{x - r} Y{y} I{-r} J0",
            f"G1 X{-x + r}", f"G3 X{-x} Y{y - r} I0 J{-r}", f"G1 Y{-y + r}", f"G3 X{-x + r} Y{-y} I{r} J0",
        ]  # fmt: skip
    return HEAD + "\n".join([*lines, "G1 X0 Y0", "G0 Z5", "M2", ""])


def spiral(lines: int = 1000) -> str:
    """Short lines of a spiral that rises and falls."""
    t = np.linspace(0.0, 8.0 * np.pi, lines + 1)[1:]
    r = 20.0 - 12.0 * t / t[-1]
    rows = np.column_stack([r * np.cos(t), r * np.sin(t), 0.5 * np.sin(3.0 * t)])
    return HEAD + "G0 X20 Y0\n" + _lines(rows) + "G0 Z5\nM2\n"


def tangents() -> str:
    """Long lines that turn by 2 degrees each, then arcs of a millimetre, tangent to each other."""
    angle, at, lines = 0.0, np.zeros(2), []
    for _ in range(60):
        angle += np.radians(2.0)
        at = at + 4.0 * np.array([np.cos(angle), np.sin(angle)])
        lines.append(f"G1 X{at[0]:.5f} Y{at[1]:.5f}")
    lines += [f"G{2 + k % 2} X{at[0] + 2.0 * (k + 1):.5f} I1 J0" for k in range(40)]
    return HEAD + "\n".join([*lines, "M2", ""])


def zigzag() -> str:
    """A raster in G64 without a tolerance."""
    rows = [f"G1 X{40 * ((k + 1) % 2)} Y{2 * k}\nG1 Y{2 * k + 2}" for k in range(6)]
    return "G21 G90 G17 G64\nF3000\n" + "\n".join([*rows, "M2", ""])


def drilling() -> str:
    """Holes on a circle by G81, with rapid moves between them."""
    holes = [
        f"X{15 * np.cos(t):.4f} Y{15 * np.sin(t):.4f}" for t in np.linspace(0, 2 * np.pi, 6, endpoint=False).tolist()
    ]
    return HEAD + f"G0 Z5\nG81 {holes[0]} R2 Z-3\n" + "\n".join([*holes[1:], "G80", "G0 X0 Y0", "M2", ""])


def planes() -> str:
    """Helices in the three planes."""
    return (
        "G21 G90 G64 P0.01\nF3000\nG17\nG2 X0 Y0 Z6 I8 J0 P2\nG18\nG3 X0 Z6 Y5 I6 K0 P1\nG19\nG2 Y5 Z6 X8 J5 K0 P1\n"
        "G17\nG1 X0 Y0 Z0\nM2\n"
    )


def trochoid(turns: int = 12) -> str:
    """A slot in loops: whole circles, each a little further on."""
    loops = [f"G3 X{1.2 * k} Y0 I0 J4\nG1 X{1.2 * (k + 1)}" for k in range(turns)]
    return HEAD + "\n".join([*loops, "M2", ""])


def nurbs() -> str:
    """A wave by G5.2, which LinuxCNC hands to its planner as pairs of arcs."""
    points = [f"X{5 * k} Y{10 * (-1) ** k} P1" for k in range(1, 9)]
    return HEAD + f"G0 X0 Y0\nG5.2 {points[0]} L3\n" + "\n".join([*points[1:], "G5.3", "G1 X0 Y0", "M2", ""])


def outputs() -> str:
    """Moves with outputs in step, dwells and words that empty the queue between them."""
    parts = [
        f"M62 P0\nG1 X{6 * k + 6} Y{4 * (k % 2)}\nM63 P0\nG1 Z{k % 2}\n{'M8' if k % 2 else 'G4 P0.05'}"
        for k in range(8)
    ]
    return HEAD + "\n".join([*parts, "M9", "M2", ""])


def small_arcs() -> str:
    """Arcs of 4 mm, some degrees each, in a tolerance as large as they are long (LinuxCNC's issue 3773)."""
    lines, at, angle, side = [], np.zeros(2), 0.0, 1
    for k in range(160):
        turn = np.radians(9.0)
        centre = at + 4.0 * side * np.array([-np.sin(angle), np.cos(angle)])
        angle += side * turn
        end = centre - 4.0 * side * np.array([-np.sin(angle), np.cos(angle)])
        i, j = centre - at
        lines.append(f"G{3 if side > 0 else 2} X{end[0]:.4f} Y{end[1]:.4f} I{i:.4f} J{j:.4f}")
        at, side = end, side if k % 23 else -side
    return "G21 G90 G17 G64 P0.1\nF3600\n" + "\n".join([*lines, "G1 X0 Y0", "M2", ""])


def divided_line() -> str:
    """A straight line in pieces of 0.1 to 100 mm (LinuxCNC's issue 4149)."""
    places = [1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 2.0, 5.0, 8.0, 20.0, 50.0, 100.0, 200.0]
    return "G21 G90 G17 G64 P0.01\nG0 X0 Y0\nF16000\n" + "\n".join(
        [*(f"G1 Y{y}" for y in places), "G0 X0 Y0", "M2", ""]
    )


def micro_segments(count: int = 3000) -> str:
    """Lines of 0.05 mm along a smooth contour (LinuxCNC's issue 4194)."""
    t = np.linspace(0.0, 2.0 * np.pi, count + 1)[1:]
    r = 22.0 + 3.0 * np.cos(5.0 * t)
    return HEAD + "G0 X25 Y0\n" + _lines(np.column_stack([r * np.cos(t), r * np.sin(t)])) + "M2\n"


def inverse_time() -> str:
    """A rotary axis with a linear one in inverse time, turning back and forth (LinuxCNC's issue 1738)."""
    rows = [f"G1 X{2 * k} A{[90, 20, 130, 40][k % 4]} F{[60, 45, 90, 75][k % 4]}" for k in range(1, 11)]
    return "G21 G90 G17 G64\nG93\n" + "\n".join([*rows, "G94", "G0 X0 A0", "M2", ""])


def brought(name: str, lines: int | None, feed: float, end: str = "") -> str:
    """A file that LinuxCNC brings, its first lines, at a feed of this machine, in units of the file a minute."""
    text = (THEIRS / name).read_text(encoding="utf-8", errors="replace")
    kept = text.splitlines()[:lines]
    body = "\n".join(
        re.sub(r"(?i)(?<![a-z<#_])f\s*[\d.]+", f"f{feed:g}", line) for line in kept if "(debug" not in line
    )
    return f"g21 g90 g17\n{body}\n{end}"


def cam(name: str, lines: int | None, feed: float) -> str:
    """A CAM program of the tests, its first lines."""
    kept = (CAM / name).read_text(encoding="utf-8", errors="replace").splitlines()[:lines]
    return "G64 P0.01\n" + "\n".join(re.sub(r"F[\d.]+", f"F{feed:g}", line) for line in kept) + "\nM2\n"


def programs() -> Iterator[Program]:
    """All of them."""
    yield Program("lines, arcs, helix, G61", exact(), exact=True)
    yield Program("the same, G61.1", exact("G61.1"), exact=True)
    yield Program("pocket", pocket())
    yield Program("1,000 short lines", spiral())
    yield Program("tangent lines and small arcs", tangents())
    yield Program("raster, G64 without P", zigzag())
    yield Program("six holes, G81", drilling())
    yield Program("helices in three planes", planes())
    yield Program("trochoidal slot", trochoid())
    yield Program("G5.2", nurbs())
    yield Program("outputs in step, dwells", outputs())
    yield Program("#3773: arcs of 4 mm, P0.1", small_arcs())
    yield Program("#4149: a line in pieces", divided_line())
    yield Program("#4194: lines of 0.05 mm", micro_segments())
    yield Program("#1738: A by inverse time", inverse_time(), axes="xyza")
    yield Program("arcspiral.ngc, 60 arcs", brought("arcspiral.ngc", 67, 100.0, "m2\n"))
    yield Program("spiral.ngc, 100 lines", brought("spiral.ngc", None, 100.0).replace("800", "100"))
    yield Program("3dtest.ngc, 30 lines", brought("3dtest.ngc", 30, 100.0, "m2\n"))
    yield Program("cncjs_tball.gcode, 400 lines", cam("cncjs_tball.gcode", 400, 3000.0))
    yield Program("one-inch-circle.nc", cam("gcodetoolpath_one-inch-circle.nc", None, 100.0))


def _lines(rows: np.ndarray) -> str:
    return "".join(
        "G1 " + " ".join(f"{a}{x:.5f}" for a, x in zip("XYZ", row, strict=False)) + "\n" for row in rows.tolist()
    )
