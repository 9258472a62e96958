"""Cycle times against formulas: one block, a corner, waits, tool changes, and what a run of a real machine took."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import FormatError, InputError
from splinefeed.machine.control import AxisControl, Control, Place, SpindleControl

pytestmark = pytest.mark.nojit
AXES = {name: AxisControl(rapid=200.0) for name in "xyz"}
RPM = math.pi / 30.0


def machine(**control) -> sf.Machine:
    return sf.Machine(name="mill", axes={}, control=Control(**{"acceleration": 500.0, "axes": AXES, **control}))


@pytest.fixture
def timed(tmp_path):
    """Times of a program, its lines joined, on a machine with this control."""

    def take(*lines: str, **control) -> sf.programs.CycleTime:
        file = tmp_path / "part.nc"
        file.write_text("\n".join(["G21 G90 G94", *lines, "M30", ""]))
        return sf.cycle_time(file, machine(**control), dialect="fanuc")

    return take


def test_one_block_is_a_trapezoid(timed):
    assert timed("G1 X100 F3000").total == pytest.approx(100 / 50 + 50 / 500, rel=1e-12)


def test_a_short_block_is_a_triangle(timed):
    assert timed("G1 X1 F3000").total == pytest.approx(2 * math.sqrt(1 / 500), rel=1e-12)


def test_jerk_makes_each_change_of_speed_an_s_curve(timed):
    a, j, v = 500.0, 5000.0, 100.0
    assert timed("G1 X100 F6000", jerk=j).total == pytest.approx(100 / v + v / a + a / j, rel=1e-12)
    assert timed("G1 X1 F6000", jerk=j).total == pytest.approx(4 * (1 / (2 * j)) ** (1 / 3), rel=1e-12)
    peak = 0.5 * (math.sqrt((a * a / j) ** 2 + 4 * a * 20) - a * a / j)  # L = v (v/a + a/j)
    assert timed("G1 X20 F18000", jerk=j).total == pytest.approx(2 * (peak / a + a / j), rel=1e-12)


def test_a_corner_is_passed_at_the_velocity_step(timed):
    """Each half: from rest to 50 mm/s and down to 10, the step of either axis there."""
    half = 50 / 500 + 40 / 500 + (100 - 50**2 / 1000 - (50**2 - 10**2) / 1000) / 50
    assert timed("G1 X100 F3000", "Y100", velocity_step=10.0).total == pytest.approx(2 * half, rel=1e-12)
    stopped = timed("G1 X100 F3000", "Y100", velocity_step=10.0, mode="exact stop", stop_time=0.05)
    assert stopped.total == pytest.approx(2 * (100 / 50 + 50 / 500 + 0.05), rel=1e-12)


def test_a_tolerance_lets_the_corner_be_passed_on_an_arc(timed):
    """A right angle blended within 0.1 mm: radius 0.1 cos 45 / (1 - cos 45), at v^2 = 300 R."""
    radius = 0.1 * math.cos(math.pi / 4) / (1 - math.cos(math.pi / 4))
    corner = math.sqrt(300 * radius)
    half = 50 / 500 + (50 - corner) / 500 + (100 - 50**2 / 1000 - (50**2 - corner**2) / 1000) / 50
    blended = timed("G1 X100 F3000", "Y100", tolerance=0.1, arc_acceleration=300.0)
    assert blended.total == pytest.approx(2 * half, rel=1e-9)
    assert blended.times.end_speed[0] == pytest.approx(corner, rel=1e-9)
    assert timed("G1 X100 F3000", "Y100").times.end_speed[0] == 0.0


def test_arcs_are_slowed_to_their_limit_which_may_grow_with_the_radius(timed):
    circle = "G3 X0 Y0 I5 J0 F6000"
    for growth in (0.0, 0.2):
        speed = math.sqrt(100.0 * 5.0 ** (1 + growth))
        slow = timed(circle, arc_acceleration=100.0, arc_growth=growth)
        assert slow.total == pytest.approx(10 * math.pi / speed + speed / 500, rel=1e-9)
        assert slow.places()[0]["limit"] == "arc acceleration"


def test_rows_of_short_lines_count_as_the_arc_that_they_stand_for(timed):
    angles = np.linspace(0.0, 6 * math.pi, 3001)
    rows = [f"G1 X{5 - 5 * math.cos(a):.6f} Y{5 * math.sin(a):.6f} F6000" for a in angles[1:]]
    row = timed(*rows, arc_acceleration=100.0, velocity_step=50.0)
    assert row.total == pytest.approx(30 * math.pi / math.sqrt(500.0), rel=0.01)


def test_arcs_whose_radii_differ_join_at_a_turn(timed):
    """Half circles with centres 0.01 mm off: each turns by sqrt(2 d / r) at its ends, d twice that."""
    rows = ["F6000 G3 X20 I10 J0", "X0 I-10.01 J0", "X20 I10.01 J0"]
    kinks = [math.sqrt(2 * difference / 10) for difference in (0.0, 0.02, 0.02)]
    ends = timed(*rows, arc_kink=0.5, velocity_step=1.0).times.end_speed
    assert ends[1] == pytest.approx(1.0 / (0.5 * (kinks[1] + kinks[2])), rel=1e-3)
    assert ends[0] == pytest.approx(1.0 / (0.5 * kinks[1]), rel=2e-2)
    assert timed(*rows, velocity_step=1.0).times.end_speed[1] > 90.0


def test_block_time_and_look_ahead(timed):
    rows = [f"G1 X{0.1 * k:.1f} F6000" for k in range(1, 101)]
    assert timed(*rows, block_time=0.01).total == pytest.approx(100 * 0.01 + 10 / 500, rel=1e-3)
    blind = timed(*rows, look_ahead=2)
    assert blind.times.end_speed.max() == pytest.approx(math.sqrt(2 * 500 * 0.2), rel=1e-9)
    assert timed(*rows).times.end_speed.max() == pytest.approx(math.sqrt(2 * 500 * 5), rel=1e-2)


def test_a_full_circle_moves_both_of_its_axes(timed):
    axes = {
        "x": AxisControl(rapid=40.0, acceleration=100.0),
        "y": AxisControl(rapid=200.0),
        "z": AxisControl(rapid=200.0),
    }
    for start in ("G3 X0 Y0 I50 J0", "G3 X0 Y0 I0 J50"):
        speed = min(40.0, math.sqrt(100.0 * 50.0))
        assert timed(f"{start} F6000", axes=axes).total == pytest.approx(100 * math.pi / speed + speed / 100, rel=1e-9)


def test_rapid_moves_go_as_fast_as_their_slowest_axis(timed):
    axes = {
        "x": AxisControl(rapid=200.0, acceleration=400.0),
        "y": AxisControl(rapid=100.0),
        "z": AxisControl(rapid=50.0),
    }
    fast = timed("G0 X300 Y300", axes=axes, rapid_acceleration=1000.0)
    speed, a = 100 * math.sqrt(2), 400 * math.sqrt(2)
    assert fast.total == pytest.approx(300 * math.sqrt(2) / speed + speed / a, rel=1e-12)
    assert fast.by_kind()["rapid_s"] == fast.total
    assert fast.places()[0]["limit"] == "rapid velocity y"


def test_dwells_tool_changes_and_the_start(timed):
    waits = timed("G4 P1500", "T1 M6", "G1 X100 F3000", tool_change=6.0, start_time=2.0)
    assert waits.by_kind() == pytest.approx(
        {
            "total_s": 11.6,
            "cutting_s": 2.1,
            "rapid_s": 0,
            "tool_change_s": 6,
            "spindle_s": 0,
            "dwell_s": 1.5,
            "start_s": 2,
        }
    )
    assert [(each["tool"], each["total_s"]) for each in waits.tools] == [("", 3.5), ("T1", pytest.approx(8.1))]


def test_tools_are_changed_at_their_place(timed):
    """From X100 to 150 for the change, from there to X0, and Z alone is left as it is."""
    ways = timed("G0 X100", "T1 M6", "G0 X0", tool_change=1.0, change_place=Place(x=150.0))
    each = [length / 200 + 200 / 500 if length >= 80 else 2 * math.sqrt(length / 500) for length in (100, 50, 150)]
    assert ways.total == pytest.approx(sum(each) + 1.0, rel=1e-12)
    assert ways.by_kind()["tool_change_s"] == pytest.approx(1.0 + each[1])


def test_the_spindle_is_waited_for_behind_the_move_of_its_line(timed):
    """Half of the top speed takes a quarter of the time, a part of which the move on the line of M3 covers."""
    spindle = SpindleControl(top_speed=12000 * RPM, start=8.0, stop=4.0)
    turning = timed("G0 X100 S6000 M3", "G1 X0 F3000", "M5", spindle=spindle)
    away, back = 100 / 200 + 200 / 500, 100 / 50 + 50 / 500
    assert turning.total == pytest.approx(max(8 / 4, away) + back + 4 / 4)
    assert turning.by_kind()["spindle_s"] == pytest.approx(8 / 4 - away + 4 / 4)
    ramp = SpindleControl(top_speed=12000 * RPM, start=8.0, stop=4.0, growth="ramp")
    assert timed("G0 X100 S6000 M3", "G1 X0 F3000", "M5", spindle=ramp).total == pytest.approx(4 + back + 2)


def test_g28_leads_home(timed):
    home = timed("G0 Z10", "G91 G28 Z0", home=Place(z=90.0))
    assert home.by_kind()["rapid_s"] == pytest.approx(2 * (80 / 200 + 200 / 500))  # from home to Z10, and back
    assert any("G28 is left out" in each for each in timed("G0 Z10", "G91 G28 Z0").blocks.findings)


def test_a_machine_without_control_is_planned_within_the_limits_of_its_axes(timed, tmp_path):
    timed("G1 X100 F3000")
    limits = sf.Machine.load("router").axes["x"].limits
    v, a = 50.0, limits.acceleration
    assert sf.cycle_time(tmp_path / "part.nc", "router").total == pytest.approx(100 / v + v / a, rel=0.1)


def test_what_would_save_is_planned_anew(timed):
    slow = timed("G0 X100", "T1 M6", "G1 X0 F3000", tool_change=5.0)
    saves = {each["what"]: each["saves_s"] for each in slow.saves()}
    assert saves["tool_change"] == pytest.approx(1.0)
    faster = timed("G0 X100", "T1 M6", "G1 X0 F3000", tool_change=5.0, axes=AXES | {"x": AxisControl(rapid=240.0)})
    assert saves["axis.x.rapid"] == pytest.approx(slow.total - faster.total)
    assert saves["axis.y.rapid"] == 0.0


@pytest.mark.parametrize(
    ("control", "words"),
    [
        ({"axes": {}}, r"the velocity of axis x is not known; add the lines \[axis.x.limits\], velocity = "),
        ({"acceleration": None}, "the acceleration of axis x is not known; add the lines"),
    ],
)
def test_a_control_that_says_too_little_is_refused(timed, control, words):
    with pytest.raises(InputError, match=words):
        timed("G0 X100", "G1 X0 F3000", **control)


def test_a_program_that_moves_nothing_is_refused(timed):
    with pytest.raises(FormatError, match="no line moves an axis"):
        timed("M3 S100")


def test_a_hundred_thousand_lines_in_seconds(timed):
    rows = [f"G1 X{k % 2} Y{0.01 * k:.2f} F6000" for k in range(1, 100_001)]
    began = time.process_time()
    estimate = timed(*rows, velocity_step=5.0, jerk=5000.0)
    assert len(estimate.blocks) == 100_000
    assert estimate.total > 0.0
    assert time.process_time() - began < 10.0


def test_each_line_has_its_time_place_limit_and_operation(timed):
    time = timed("T1 M6", "G1 X10 F3000", "G4 P2", "T2 M6", "X30", "Y40", rapid_acceleration=2000.0, tool_change=6.0)
    of = time.by_line
    assert of.line.tolist() == [0, 2, 3, 4, 5, 6, 7]  # the start is before the first line
    assert [time.limits[k] for k in of.limit[1:5]] == ["tool change", "programmed feed", "dwell", "tool change"]
    assert of.place[2:].tolist() == [[10, 0, 0], [10, 0, 0], [10, 0, 0], [30, 0, 0], [30, 40, 0]]
    assert of.operation.tolist() == [0, 1, 1, 1, 2, 2, 2]
    assert np.sum(of.seconds) == pytest.approx(time.total, rel=1e-12)
    assert of.begin[1:] == pytest.approx(np.cumsum(of.seconds)[:-1])
    assert of.beyond[2] == pytest.approx(of.seconds[2] - 10 / 50)
    places = time.places(2)
    assert [each["line"] for each in places] == [2, 5]


def test_a_line_that_is_carried_out_again_counts_each_time(tmp_path):
    file = tmp_path / "part.ngc"
    file.write_text("G21 G91 G1 F600\no1 repeat [5]\nX2\no1 endrepeat\nM2\n")
    of = sf.cycle_time(file, machine(mode="exact stop"), dialect="linuxcnc").by_line
    assert of.seconds[of.line == 3] == pytest.approx([5 * (2 / 10 + 10 / 500)])
    assert of.place[-1, 0] == 10.0


def test_a_trace_follows_arcs_and_splines_and_ends_where_blocks_do(tmp_path):
    file = tmp_path / "part.ngc"
    file.write_text("G21 G90 F600\nG1 X10\nG3 X20 Y10 I0 J10 Z3\nG5 I5 J0 P-5 Q0 X40 Y20\nG1 X50 Y0\nM2\n")
    blocks = sf.cycle_time(file, machine(), dialect="linuxcnc").blocks
    assert blocks.trace[blocks.end] == pytest.approx(np.cumsum(blocks.step[:, :3], axis=0))
    arc, spline = (blocks.trace[low : high + 1] for low, high in zip(blocks.end[:2], blocks.end[1:3], strict=True))
    assert np.hypot(arc[:, 0] - 10, arc[:, 1] - 10) == pytest.approx(np.full(len(arc), 10.0))
    assert np.all(np.diff(arc[:, 2]) > 0.0)
    u = np.interp(30.0, spline[:, 0], spline[:, 1])  # symmetric about its middle
    assert u == pytest.approx(15.0, abs=1e-6)
    assert len(spline) > 30


def test_a_drawing_is_no_program(data_dir):
    with pytest.raises(FormatError, match="holds no G-code; expected a program"):
        sf.cycle_time(data_dir / "dxf" / "cadquery_genshi.dxf", "hurco-02")
