"""Feeds that go with the spindle, threads; `test_linuxcnc_interpreter` asks LinuxCNC about them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from gcode_programs import path_of, program, said
from splinefeed.programs.gcode.dialects import named
from splinefeed.programs.gcode.moves import joined
from splinefeed.programs.gcode.reader import Reading


def feeds(folder: Path, *lines: str, **options: object) -> list[float]:
    """Feeds in mm/min."""
    found = path_of(folder, *lines, **options).feeds
    assert found is not None
    return [round(60.0 * feed, 9) for feed in found.tolist()]


def test_feed_a_revolution_goes_with_the_speed(tmp_path: Path) -> None:
    lines = ["S500 M3 G95 F.1", "G1 X1", "S800 X2", "X3 F.2", "G94", "X4 F7", "G20 G95 F.01", "X1"]
    assert feeds(tmp_path, *lines) == [50, 80, 160, 7, 0.254 * 800]


def test_at_constant_surface_speed_a_move_has_the_feed_of_its_mean_radius(tmp_path: Path) -> None:
    lines = ["G96 S100 D2000 M3 G95 F.1", "G1 X40", "X20", "Z-5", "X0", "G97 S300", "X5"]
    wanted = [0.1 * min(2000.0, 100e3 / (2.0 * math.pi * r)) for r in (20.0, 30.0, 20.0, 10.0)]
    assert feeds(tmp_path, *lines) == pytest.approx([*wanted, 30])
    turned = ["O0001", "G92 S1000", "G96 S100 M3 G95 F.1", "G1 X4. Y0", "M30"]
    assert feeds(tmp_path, *turned, dialect="fanuc") == pytest.approx([100])


def test_threads_have_the_feed_of_their_lead(tmp_path: Path) -> None:
    assert feeds(tmp_path, "S600 M3", "G33 Z-5 K1.5", "G33.1 Z-8 K.5", "G0 Z1") == [900, 300, 300, math.inf]
    assert feeds(tmp_path, "O0001", "S600 M3", "G33 Z-5. F1.5", "M30", dialect="fanuc") == [900]
    path = path_of(tmp_path, "S600 M3", "G33.1 Z-8 K.5")
    assert said(path) == ["S600 M3", "F-8", "M4", "F0", "M3"]
    assert any("constant" in each for each in path.findings)


def test_a_thread_is_cut_in_passes(tmp_path: Path) -> None:
    path = path_of(tmp_path, "S600 M3", "G0 X20 Z1", "G76 P2 Z-10 I-3 J.5 K1 R2 Q20 E1 L2")
    found = [np.round(curve.control_points[-1], 4).tolist() for curve in path.curves]
    slide = math.tan(math.radians(20.0))
    wanted = [[20, 1]]
    for depth in (0.5, 0.5 * math.sqrt(2.0), 0.5 * math.sqrt(3.0), 1.0):
        safe, cut, begin, end = 21 - depth, 17 - depth, 1 - slide * depth, -10 + slide * (1 - depth)
        wanted += [[safe, begin], [cut, begin], [cut, end + 1], [cut + 1, end], [safe, end]]
    assert found == np.round(wanted, 4).tolist()
    assert feeds(tmp_path, "S600 M3", "G0 X20 Z1", "G76 P2 Z-10 I-3 J.5 K1 R2 Q20 E1 L2")[3:5] == pytest.approx(
        [1200, 1200 * math.sqrt(2.0)]
    )


def test_feeds_with_the_spindle_are_read_by_arrays_as_line_by_line(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    words = ["", "", "", "S700", "F.2", "S900 F.3", "M5", "M3"]
    some = [f"G1 X{x:.3f} {words[k]}" for x, k in zip(rng.uniform(1, 9, 300), rng.integers(0, 8, 300), strict=True)]
    for head in ("S500 M3 G95 F.1", "G96 S50 M3 G95 F.1"):
        file = program(tmp_path, head, *some)
        fast, slow = (joined(list(Reading(dialect=named("linuxcnc"), fast=e).moves(file))) for e in (True, False))
        assert np.array_equal(fast.rows, slow.rows)
