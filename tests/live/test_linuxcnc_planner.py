"""Debian's LinuxCNC, headless, with splinefeed as its trajectory planner: every servo tick of ordinary programs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.linuxcnc_planner import PERIOD, Recording, mill, module_missing, recorded

import splinefeed as sf
from splinefeed.records import Array

pytestmark = [
    pytest.mark.slow,
    pytest.mark.linuxcnc,
    pytest.mark.skipif(bool(missing := module_missing()), reason=missing),
]
VELOCITY, ACCELERATION, JERK = 60.0, 1000.0, 50_000.0
OURS, STOCK = mill(VELOCITY, ACCELERATION, JERK), mill(VELOCITY, ACCELERATION)
LINES = "".join(f"G1 X{0.3 * k:.4f} Y{4 * np.sin(0.08 * k):.4f}\n" for k in range(1, 301))
PROGRAM = f"""G21 G90 G17 G61
F3000
G0 X10 Y0 Z5
G1 X40 Y0 Z0
G2 X60 Y20 I0 J20
G3 X60 Y20 I-10 J0
G3 X50 Y30 Z2 I-10 J0
G64 P0.01
G1 X0 Y0 Z5
{LINES}G4 P0.1
M62 P0
G0 X0 Y0
M63 P0
M2
"""


def shares(found: Recording) -> list[float]:
    """The largest velocity, acceleration and jerk of a joint at any tick, as shares of the limits."""
    limits = (VELOCITY, ACCELERATION, JERK)
    return [
        float(np.abs(np.diff(found.position, n=n, axis=0)).max() / PERIOD**n / limit)
        for n, limit in enumerate(limits, 1)
    ]


def apart(points: Array, polyline: Array) -> float:
    keep = np.append(True, np.any(np.diff(polyline, axis=0) != 0.0, axis=1))
    line = polyline[keep]
    a, ab = line[:-1], np.diff(line, axis=0)
    square = np.einsum("ij,ij->i", ab, ab)
    worst = 0.0
    for x in points:
        t = np.clip(np.einsum("ij,ij->i", x - a, ab) / square, 0.0, 1.0)
        worst = max(worst, float(np.min(np.linalg.norm(a + t[:, None] * ab - x, axis=1))))
    return worst


def test_an_ordinary_program_keeps_the_limits_and_stocks_path():
    ours, stock = recorded(PROGRAM, OURS), recorded(PROGRAM, STOCK)
    assert max(shares(ours)) <= 1.0
    assert shares(stock)[2] > 2.0
    np.testing.assert_allclose(ours.position[-1], stock.position[-1], atol=1e-6)
    one, other = ours.moving(), stock.moving()
    assert apart(one[::20], other) <= 0.02 and apart(other[::20], one) <= 0.02  # both leave it by up to 0.01 mm
    assert set(ours.line.tolist()) >= {3, 4, 5, 6, 7, 9}


def test_an_operator_turns_and_pauses_within_the_limits():
    actions = (
        "1:feed=50,1.8:feed=150,2.6:pause,3.2:resume,3.8:most=20,4.6:most=60,5.2:rapid=50,5.5:feed=30,6.5:feed=100"
    )
    found = recorded(PROGRAM, OURS, actions=actions)
    assert len(found.acted) == 9
    assert max(shares(found)) <= 1.0
    np.testing.assert_allclose(found.position[-1], [0, 0, 5], atol=1e-6)
    still = np.flatnonzero(np.all(np.diff(found.position, axis=0) == 0.0, axis=1))
    pause, resume = (next(row for row, what in found.acted if what == name) for name in ("pause", "resume"))
    assert np.any((still > pause) & (still < resume))


def test_an_abort_stops_on_the_path_and_mdi_goes_on():
    found = recorded(PROGRAM, OURS, actions="2:abort,3:mdi=G0 X1 Y2 Z3,5:mdi=G0 X2,8:feed=100")
    assert max(shares(found)) <= 1.0
    np.testing.assert_allclose(found.position[-1], [2, 2, 3], atol=1e-6)


def test_a_feed_per_revolution_follows_the_spindle_and_its_override():
    program = "G21 G90 M3 S600\nG95 F1.5\nG1 X120\nM2\n"
    found = recorded(program, OURS, actions="2:spindle=0.5,4:spindle=1.1")
    assert max(shares(found)) <= 1.0
    speed = np.abs(np.diff(found.position[:, 0])) / PERIOD
    for turns in (600.0, 300.0, 660.0):
        assert np.sum(np.abs(speed - 1.5 * turns / 60.0) < 1e-6) > 1000


def in_step(found: Recording, low: float, high: float) -> Array:
    """Ticks at which z is between two places."""
    z = found.position[:, 2]
    return np.flatnonzero((z > low) & (z < high))


def test_threads_begin_at_one_angle_and_are_as_far_on_as_the_spindle_has_turned():
    turned = replace(OURS, spindle=True)
    passes = "".join(f"G33 Z-25 K1.5\nG0 X{k}\nG0 Z0\n" for k in range(1, 4))
    actions = "1.2:pause,1.7:resume,1.3:feed=50"  # which wait for the end of a thread
    found = recorded(f"G21 G90 G61\nM3 S600\n{passes}M2\n", turned, actions=actions)
    assert max(shares(found)) <= 1.0 + 1e-9
    cut = in_step(found, -20.0, -5.0)
    cut = cut[np.abs(np.diff(found.position[:, 2])[cut] / PERIOD + 15.0) < 1.0]
    groups = np.split(cut, np.flatnonzero(np.diff(cut) > 1) + 1)
    assert len(groups) == 3
    begins = []
    for rows in groups:
        off = found.position[rows, 2] + 1.5 * found.turns[rows]
        assert np.ptp(off) < 0.002
        begins.append(off.mean())
    assert np.ptp(begins) < 0.002  # the same thread each time


def test_each_pass_of_a_threading_cycle_cuts_the_same_thread():
    cycle = "G18 G8 G61\nM3 S600\nG0 X10 Z0\nG76 P1.5 Z-25 I-1 J0.4 R1 K1 Q0 H1 E0 L0\nM5\nM2\n"
    found = recorded(f"G21 G90 {cycle}", replace(OURS, spindle=True))
    assert max(shares(found)) <= 1.0 + 1e-9
    cut = in_step(found, -20.0, -5.0)
    cut = cut[np.abs(np.diff(found.position[:, 2])[cut] / PERIOD + 15.0) < 1.0]
    off = (found.position[:, 2] + 1.5 * found.turns)[cut]
    assert len(np.unique(found.position[cut, 0].round(6))) == 3  # depths
    assert len(cut) > 3500 and np.ptp(off) < 0.002


@pytest.mark.parametrize("way", ["M3", "M4"])
def test_a_hole_is_tapped_and_left_in_step_with_the_spindle(way):
    turned = replace(OURS, spindle=True)
    found = recorded(f"G21 G90\n{way} S480\nG33.1 Z-15 K1\nG0 X5\nM5\nM2\n", turned)
    assert max(shares(found)) <= 1.0
    z, bottom = found.position[:, 2], int(np.argmin(found.position[:, 2]))
    assert -17.0 < z[bottom] < -15.5
    np.testing.assert_allclose(found.position[-1], [5.0, 0.0, 0.0], atol=1e-9)
    down = np.flatnonzero((z[:bottom] < -2.0) & (z[:bottom] > -14.9))
    up = bottom + np.flatnonzero((z[bottom:] < -2.0) & (z[bottom:] > -14.9))
    turns = found.turns if way == "M3" else -found.turns
    off = np.interp(z[up], z[down][::-1], turns[down][::-1]) - turns[up]
    assert np.abs(off).max() < 0.003  # turns, at a pitch of 1 mm


def test_a_tap_that_is_aborted_follows_its_spindle_until_that_stands():
    found = recorded("G21 G90\nM3 S480\nG33.1 Z-80 K1\nM2\n", replace(OURS, spindle=True), actions="6:abort,8:feed=100")
    assert max(shares(found)) <= 1.0
    abort = found.acted[0][0]
    z, turns = found.position[abort - 50 :, 2], found.turns[abort - 50 :]
    assert z[0] < -2.0 and turns[-1] - turns[50] > 0.5 and np.ptp(turns[-100:]) == 0.0
    assert np.ptp(z + turns) < 0.02  # turns, at a pitch of 1 mm; LinuxCNC's own planner is off by 0.9


def test_a_curve_of_the_program_is_planned_in_place_of_its_arcs():
    points = [f"X{5 * k} Y{10 * (-1) ** k} P1" for k in range(1, 9)]
    program = f"G21 G90 G61 F3000\nG10 L2 P1 X3 Y-2\nG54\nG0 X0 Y0\nG5.2 {points[0]} L3\n" + "\n".join(points[1:])
    found = recorded(f"{program}\nG5.3\nG0 X0 Y0\nG10 L2 P1 X0 Y0\nM2\n", OURS)
    assert max(shares(found)) <= 1.0
    control = np.array([[0, 0], *([5 * k, 10 * (-1) ** k] for k in range(1, 9))], dtype=float) + [3.0, -2.0]
    curve = sf.NurbsCurve(2, np.r_[0, 0, np.arange(8), 7, 7], control)
    cut = np.flatnonzero(found.position[:, 1] != found.position[-1, 1])
    ticks = found.position[cut][:, :2]
    ticks = ticks[(ticks[:, 0] > 5.0) & (ticks[:, 0] < 38.0) & (ticks[:, 1] > -9.0)]
    near = np.sort(curve.nearest(ticks)[1])
    assert near[: len(near) // 2].max() < 1e-3  # the way there; LinuxCNC's arcs are off by 0.04 mm


def test_a_step_stands_where_the_next_move_begins():
    program = "G21 G90 G61 F1800\n" + "".join(f"G1 X{8 * k}\n" for k in range(1, 9)) + "M2\n"
    found = recorded(program, OURS, actions="0.3:pause,0.9:step,1.9:step,2.9:step,3.9:resume")
    assert max(shares(found)) <= 1.0
    rows = [row for row, what in found.acted if what in ("step", "resume")]
    stands = found.position[np.array(rows[1:]) - 5, 0]
    np.testing.assert_allclose(stands, stands[0] + 8.0 * np.arange(3), atol=1e-6)
    np.testing.assert_allclose(stands % 8.0, 0.0, atol=1e-6)


def test_a_standstill_at_a_word_that_waits_for_motion_is_short():
    program = (
        "G21 G90 G64 P0.01 F3000\n" + "".join(f"G1 X{4 * k} Y{3 * (k % 2)}\nG4 P0\n" for k in range(1, 14)) + "M2\n"
    )
    moves = np.flatnonzero(np.any(np.diff(recorded(program, OURS).position, axis=0) != 0.0, axis=1))
    still = np.diff(moves)
    assert np.median(still[still > 1] - 1) <= 45  # 11 to 15 ms; 65 where LinuxCNC's task is not seen


def test_a_probe_trips():
    program = "G21 G90 F300\nG38.2 X60\nG1 X2 F1200\nM2\n"
    found = recorded(program, OURS, actions="1:probe")
    assert max(shares(found)) <= 1.0
    assert 3.0 < found.position[:, 0].max() < 8.0 and found.position[-1, 0] == pytest.approx(2.0, abs=1e-6)


@pytest.mark.parametrize(
    ("program", "planner", "said"),
    [
        ("G21 G90\nG0 X5\nM2\n", False, "no planner answers: start it with  splinefeed linuxcnc planner"),
        ("G21 G90\nM3 S6000\nO100 repeat [1]\nG33 X5 K1\nO100 endrepeat\nM2\n", True, "line 4: will not run"),
        ("G21 G90\nG95 F1\nG1 X5\nM2\n", True, "line 3: feed a revolution (G95) needs the speed of the spindle"),
    ],
)
def test_what_is_not_there_is_said_on_the_screen_and_nothing_moves(program: str, planner: bool, said: str):
    found = recorded(program, OURS, planner=planner, complains=True)
    assert any(said in text for text in found.said), found.said
    assert np.all(found.position == 0.0)


def test_what_will_not_run_is_said_when_the_program_is_loaded():
    program = "G21 G90 F600\nG1 X30\nM3 S6000\nG33 Z-5 K1\nM2\n"
    found = recorded(program, OURS, complains=True)
    assert [text.partition("job.ngc: ")[2] for text in found.said] == [
        "line 4: will not run: in step with the spindle it goes at 100 mm/s and the axes allow less than 60; lower S "
        "or the pitch"
    ]
    assert found.wall_s == 0.0 and np.all(found.position == 0.0)


def test_external_offsets_and_a_program_keep_the_limits_in_sum():
    machine = replace(OURS, offsets=(0.02, 0.02, 0.02))
    on = [
        f"0.0{k}:set=axis.{axis}.eoffset-{pin}"
        for k, axis in enumerate("xyz", 1)
        for pin in ("enable 1", "scale 0.0001")
    ]
    counts = [(0.3, "z", 3000), (0.5, "x", 20000), (0.53, "x", -20000), (0.56, "x", 20000), (0.7, "y", 10000)]
    counts += [(1.1, "x", -20000), (1.2, "y", -20000), (1.6, "x", 0), (2.0, "y", 0), (2.1, "z", 0)]
    moved = [f"{at}:set=axis.{axis}.eoffset-counts {count}" for at, axis, count in counts]
    program = f"G21 G90 G64 P0.01 F3600\n{LINES}G0 X0 Y0\nM2\n"
    found = recorded(program, machine, actions=",".join([*on, *moved]))
    assert found.position[:, 2].max() > 0.2  # it has no motion in z of its own
    assert max(shares(found)) <= 1.0


ZIGZAG = "G64 P0.01 F1800\n" + "".join(f"G1 X{8 * k} Y{2 * (k % 2)}\n" for k in range(1, 20)) + "G4 P0.1\nG1 X0\nM2\n"


def test_a_run_back_goes_along_the_path_as_far_as_it_began_and_forward_again():
    actions = "5:pause,6:reverse,6.2:resume,7:pause,8:forward,8.2:resume,9:pause,10:reverse,10.2:resume,18:forward"
    found = recorded(f"G21 G90 {ZIGZAG}", OURS, actions=f"0.1:patient,{actions}")
    assert found.said == [] and max(shares(found)) <= 1.0
    rows = [row for row, what in found.acted if what != "patient"]
    x = found.position[rows, 0]  # as it is turned about: back, pause, forward, pause, back
    assert x[4] < x[2] - 2.0 and x[7] > x[5] + 2.0
    np.testing.assert_allclose(found.position[rows[-1]], 0.0, atol=1e-6)  # where motion began
    np.testing.assert_allclose(found.position[-1], [0, 2, 0], atol=1e-6)
    lines = np.array([[8.0 * k, 2.0 * (k % 2), 0.0] for k in range(20)])
    assert apart(found.moving()[:-1:11], np.append(lines, [[0, 2, 0]], axis=0)) <= 0.011


def test_an_adaptive_feed_below_zero_runs_back():
    program = f"G21 G90\nM52 P1\n{ZIGZAG}"
    found = recorded(program, OURS, actions="5:set=motion.adaptive-feed -0.5,7:set=motion.adaptive-feed 1")
    assert max(shares(found)) <= 1.0
    begin, end = (row for row, _ in found.acted)
    speed = np.diff(found.position[begin:end], axis=0) / PERIOD
    assert speed[-500:, 0].max() < 0.0 or np.all(found.position[end] == 0.0)
    assert np.linalg.norm(speed[300:], axis=1).max() <= 15.0 * (1 + 1e-6)
    np.testing.assert_allclose(found.position[-1], [0, 2, 0], atol=1e-6)
