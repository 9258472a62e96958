"""Times of LinuxCNC 2.9 as the model has them, against what a live one took: `linuxcnc_programs` says how measured."""

from __future__ import annotations

import time
from dataclasses import replace
from statistics import median

import numpy as np
import pytest

import splinefeed as sf
from linuxcnc_programs import MACHINES, SECONDS, programs
from splinefeed.machine.control import Control
from splinefeed.machine.parts import Axis, AxisLimits


def machine(which: str) -> sf.Machine:
    """The machine that `machine from-ini` makes of the INI file of the set."""
    velocity, acceleration = MACHINES[which]
    limits = AxisLimits(velocity=velocity, acceleration=acceleration)
    control = Control(model="linuxcnc", velocity=velocity, acceleration=acceleration, tolerance=1000.0)
    return sf.Machine(name=which, axes={name: Axis(name=name, limits=limits) for name in "xyz"}, control=control)


def errors(which: str, folder) -> dict[str, float]:
    """By how much the model is over what was measured, as a share, by program."""
    found = {}
    for name, text in programs(which).items():
        file = folder / f"{name}.ngc"
        file.write_text(text)
        found[name] = sf.cycle_time(file, machine(which), dialect="linuxcnc").total / SECONDS[name] - 1.0
    return found


@pytest.mark.parametrize(("which", "count"), [("first", 20), ("second", 10), ("third", 10)])
def test_the_model_is_within_half_a_percent_in_the_median_and_two_at_worst(tmp_path, which, count):
    found = errors(which, tmp_path)
    assert len(found) == count
    sizes = [abs(each) for each in found.values()]
    assert median(sizes) <= 0.005
    assert max(sizes) <= 0.02, max(found, key=lambda name: abs(found[name]))


def test_a_corner_is_passed_at_the_speed_of_the_arc_within_the_tolerance(tmp_path):
    """A right angle within 0.02 mm: R = 0.02 s / (1 - s), v^2 = sqrt(3)/2 a R; measured 4.56 mm/s."""
    file = tmp_path / "part.ngc"
    file.write_text("G21 G90 G64 P0.02\nG1 X40 F1800\nY40\nM2\n")
    time = sf.cycle_time(file, machine("first"), dialect="linuxcnc")
    assert time.times.end_speed[0] == pytest.approx(4.56, abs=0.02)
    assert time.control == "linuxcnc, as 2.9 was measured"


def test_exact_path_stops_at_corners_and_not_where_the_path_is_smooth(tmp_path):
    file = tmp_path / "part.ngc"
    file.write_text("G21 G90 G17 G61\nG1 X10 F1800\nX30\nG3 X40 Y10 R10\nG1 X50\nM2\n")
    times = sf.cycle_time(file, machine("first"), dialect="linuxcnc").times
    assert times.end_speed.tolist() == pytest.approx([30.0, 30.0, 0.0, 0.0])


def test_rotary_moves_stop_and_do_not_slow_the_others(tmp_path):
    """A turns between two squares: its acceleration in rad/s^2 is no limit of X and Y."""
    turning = machine("first")
    limits = AxisLimits(velocity=2.0, acceleration=10.0)
    turning = replace(turning, axes={**turning.axes, "a": Axis(name="a", motion="rotary", limits=limits)})
    file = tmp_path / "part.ngc"
    file.write_text("G21 G90 G64 P0.02\nG1 X40 F1800\nY40\nG0 A90\nG1 X0\nY0\nM2\n")
    found = sf.cycle_time(file, turning, dialect="linuxcnc")
    seconds = found.times.seconds
    assert np.all(np.isfinite(seconds)) and seconds[2] == pytest.approx(0.5 * np.pi / 2.0 + 0.2, rel=0.01)
    file.write_text("G21 G90 G64 P0.02\nG1 X40 F1800\nY40\nM2\n")
    alone = sf.cycle_time(file, machine("first"), dialect="linuxcnc").times.seconds
    assert seconds[0] == pytest.approx(alone[0])


def test_a_long_row_of_lines_takes_time_by_its_length(tmp_path):
    """30,000 lines on one straight line: joined by hundreds, in seconds."""
    file = tmp_path / "part.ngc"
    file.write_text("G21 G90 G64 P0.01 F3000\n" + "".join(f"G1 X{0.01 * k:.2f}\n" for k in range(1, 30001)) + "M2\n")
    begin = time.monotonic()
    found = sf.cycle_time(file, machine("first"), dialect="linuxcnc")
    assert found.total == pytest.approx(6.0 + 50.0 / 500.0, rel=0.01)
    assert time.monotonic() - begin < 60.0


def test_lines_within_the_tolerance_are_one(tmp_path):
    """Lines of 0.26 mm on a circle of 15 mm, a degree each: four of them are within 0.01 mm of their chord."""
    text = programs("first")["poly360-g64p01"]
    file = tmp_path / "part.ngc"
    file.write_text(text)
    joined = sf.cycle_time(file, machine("first"), dialect="linuxcnc").times.seconds
    file.write_text(text.replace("P0.01", "P0.0001"))
    assert sf.cycle_time(file, machine("first"), dialect="linuxcnc").total > 1.05 * joined.sum()


def test_a_line_at_the_feed_of_the_program_is_bound_by_that(tmp_path):
    file = tmp_path / "part.ngc"
    file.write_text("G21 G90 G61\nG1 X40 F60\nX40.01 F1800\nM2\n")
    places = sf.cycle_time(file, machine("first"), dialect="linuxcnc").places()
    assert {each["line"]: each["limit"] for each in places} == {2: "programmed feed", 3: "axis acceleration x"}
