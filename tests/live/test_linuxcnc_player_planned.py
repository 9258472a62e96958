"""LinuxCNC's planner and player without LinuxCNC: moves in, every tick checked by third differences."""

from __future__ import annotations

from copy import copy

import numpy as np
import pytest

from linuxcnc_machine import NEAR, PERIOD, Machine, mill, needs_gcc
from splinefeed.live import linuxcnc_wire as wires
from splinefeed.live.linuxcnc_motion import PlannedMotion
from splinefeed.planner.receding import OutOfReachError
from splinefeed.records import Array, State


def distance(points: Array, polyline: Array) -> float:
    """How far points (n, 3) are from the lines between others (m, 3), mm."""
    a, ab = polyline[:-1], np.diff(polyline, axis=0)
    t = np.einsum("nmj,mj->nm", points[:, None] - a, ab) / np.einsum("mj,mj->m", ab, ab)
    off = a + np.clip(t, 0.0, 1.0)[:, :, None] * ab - points[:, None]
    return float(np.linalg.norm(off, axis=2).min(axis=1).max())


@needs_gcc
@pytest.mark.parametrize("term", [0, 1, 2])
def test_exact_stops_exact_paths_and_blends_keep_limits_and_path(term):
    machine = Machine()
    places = np.array([[0, 0, 0], [10, 0, 5], [40, 0, 0], [40.0, 20, 0], [39, 21, 0]], dtype=float)
    for place in places[1:]:
        machine.line(*place, term=term, tolerance=0.02)
    machine.run()
    assert machine.said == [] and machine.wire.seg_done == 4 and machine.wire.late == 0
    np.testing.assert_allclose(machine.at[:3], places[-1], atol=1e-9)
    assert machine.kept()
    rows = np.array(machine.rows)[:, :3]
    assert distance(rows, places) <= (0.02 if term == 2 else 1e-6)
    at_corner = np.linalg.norm(rows - places[2], axis=1).min()
    assert at_corner <= 1e-9 if term < 2 else at_corner > 1e-4


@needs_gcc
def test_overrides_up_and_down_are_planned_anew_within_the_limits():
    machine = Machine(mill(velocity=200.0))
    machine.wavy(600, feed=30.0)
    machine.run(1500)
    for scale in (1.5, 0.4, 2.0, 0.5, 1.0):
        machine.feed_scale = scale
        machine.run(600)
        assert machine.player["speed"][0] == pytest.approx(30.0 * scale, rel=0.03)
    machine.vlimit = 10.0
    machine.run(600)
    assert machine.player["speed"][0] <= 10.0 * (1 + NEAR)
    machine.vlimit = 1e3
    machine.run()
    assert machine.said == [] and machine.wire.seg_done == 600
    assert machine.kept()


@needs_gcc
def test_where_no_motion_on_is_found_it_stops_on_the_path_and_goes_on_from_there(monkeypatch):
    machine, failed, block = Machine(), [], PlannedMotion.block
    machine.wavy(300)
    machine.pausing = True  # what is sent waits, and the machine is at rest

    def failing(self, **how):
        if machine.planner.sent and len(failed) < 2:
            failed.append(machine.moving)
            raise OutOfReachError("no way on")
        return block(self, **how)

    monkeypatch.setattr(PlannedMotion, "block", failing)
    machine.run(200)
    assert failed == [False]
    machine.pausing = False
    machine.run()
    assert len(failed) == 2 and machine.said == [] and machine.wire.seg_done == 300
    assert machine.kept()


@needs_gcc
def test_an_override_is_planned_over_as_much_path_at_the_end_of_a_part_as_elsewhere():
    machine = Machine()
    machine.line(200.0, 0.0, 0.0, term=1)
    for k in range(40):
        machine.line(200.0, 10.0 * (k + 1), 0.0, term=1)
    machine.run(50)
    assert machine.planner is not None and machine.planner.run is not None
    run = copy(machine.planner.run)
    end = run.track.starts[1]
    run.restart(end - 1e-3, State())
    run.block(soon=True)
    known = run.track.starts[run.given - 1] + run.track.parts[run.given - 1].length
    assert known >= end + 60.0 * run.soon


@needs_gcc
def test_a_motion_that_is_never_found_is_said_and_nothing_moves(monkeypatch):
    machine = Machine()
    machine.wavy(300)

    def failing(self, **how):
        raise OutOfReachError("no way on")

    monkeypatch.setattr(PlannedMotion, "block", failing)
    machine.run(200)
    assert machine.said[0] == "no way on" and not machine.moving


@needs_gcc
def test_a_pause_a_hold_and_an_abort_stop_on_the_path():
    machine = Machine()
    machine.wavy(600)
    lines = np.array([[0.4 * k, 2.0 * np.sin(0.15 * k), 0.0] for k in range(601)])
    for how in ("pausing", "feed_scale"):
        machine.run(700)
        before = getattr(machine, how)
        setattr(machine, how, how == "pausing")
        if how == "feed_scale":
            machine.feed_scale = 0.0
        machine.run(1000, until=lambda: bool(machine.lib.player_held(machine.me)))
        assert machine.lib.player_held(machine.me)
        place = machine.at.copy()
        machine.run(50)
        np.testing.assert_array_equal(machine.at, place)
        setattr(machine, how, before)
    machine.run(700)
    machine.aborting = True
    machine.run()
    assert not machine.aborting and machine.wire.seg_done == 600 and not machine.moving
    machine.line(0.0, 0.0, 10.0)
    machine.run()
    np.testing.assert_allclose(machine.at[:3], [0, 0, 10], atol=1e-9)
    assert machine.kept() and machine.said == []
    assert distance(np.array(machine.rows)[:2000, :3], lines) <= 0.011


@needs_gcc
def test_a_pause_in_a_curve_at_its_highest_feed_takes_hardly_longer_than_on_a_line():
    machine = Machine()
    centre = np.array([3.9, 0.0, 0.0])  # 60 mm/s there is 0.92 of the acceleration
    for k in range(16):
        machine.move(np.r_[7.8 * (k % 2 == 0), np.zeros(8)], kind=wires.ARC, feed=60.0, centre=centre, normal=[0, 0, 1])
    taken = []
    for k in range(8):
        machine.run(250 + 17 * k)
        assert machine.player["speed"][0] > 58.0
        machine.pausing, before = True, len(machine.rows)
        machine.run(1000, until=lambda: bool(machine.lib.player_held(machine.me)))
        taken.append(len(machine.rows) - before)
        machine.pausing = False
    assert max(taken) <= 120
    assert machine.kept() and machine.said == []


@needs_gcc
def test_a_higher_override_on_a_line_is_obeyed_midway():
    machine = Machine()
    machine.line(400.0, 0.0, 0.0, feed=40.0)
    machine.run(500)
    for scale in (0.3, 1.5, 0.3, 1.5):
        machine.feed_scale, before = scale, len(machine.rows)
        machine.run(400)
        speed = np.diff(np.array(machine.rows)[before:, 0]) / PERIOD
        late = np.flatnonzero(np.abs(speed - 40.0 * scale) > 0.4 * scale)
        assert late[-1] < 130  # 72 ms of it are what the limits ask for
    machine.feed_scale = 1.0
    machine.run()
    assert machine.wire.seg_done == 1 and machine.said == [] and machine.kept()


@needs_gcc
def test_an_override_that_never_rests_keeps_the_limits():
    machine = Machine()
    machine.wavy(600)
    rng = np.random.default_rng(5)
    for _ in range(300):
        machine.feed_scale = float(rng.choice([rng.uniform(0.0, 1.0), 0.0, 1.0, 2.0]))
        machine.pausing = bool(rng.random() < 0.2)
        machine.run(int(rng.integers(1, 60)))
    machine.feed_scale, machine.pausing = 1.0, False
    machine.run()
    assert machine.wire.seg_done == 600 and machine.said == []
    assert machine.kept()


@needs_gcc
@pytest.mark.parametrize(("feed", "term", "near"), [(60.0, 1, 1e-7), (12.0, 1, 1e-7), (60.0, 2, 0.2), (30.0, 2, 0.2)])
def test_a_step_stands_where_the_next_move_begins(feed, term, near):
    machine = Machine()
    places = np.array([[9.0 * k, 5.0 * (k % 3 == 2), 0.0] for k in range(1, 20)])
    for place in places:
        machine.line(*place, term=term, feed=feed)
    machine.run(200)
    machine.pausing = True
    machine.run(1000, until=lambda: bool(machine.lib.player_held(machine.me)))
    for _ in range(12):
        machine.pausing, machine.stepping, before = False, True, machine.segments[-1]
        machine.run(5000, until=lambda: machine.segments[-1] != before)  # noqa: B023
        machine.pausing, machine.stepping = True, False  # motmod sees another move
        machine.run(1)
        assert machine.lib.player_held(machine.me)
        np.testing.assert_allclose(machine.at[:3], places[machine.segments[-1] - 1], atol=near)
    machine.pausing = False
    machine.run()
    assert machine.wire.seg_done == len(places) and machine.said == []
    assert machine.kept()


def held(machine: Machine, ticks: int = 1000) -> bool:
    """Whether it comes to rest on its path in so many ticks."""
    machine.pausing = True
    machine.run(ticks, until=lambda: bool(machine.lib.player_held(machine.me)))
    return bool(machine.lib.player_held(machine.me))


@needs_gcc
def test_a_run_back_goes_along_the_path_that_it_came_and_forward_again():
    machine = Machine()
    machine.wavy(600)
    machine.run(1500)
    assert not machine.turn_about(back=True)  # it moves
    assert held(machine)
    turned, known = machine.at.copy(), (int(machine.wire.seg_done), int(machine.wire.piece_now))
    came = np.array(machine.rows)[:, :3]
    assert machine.turn_about(back=True)
    machine.pausing, before = False, len(machine.rows)
    machine.run(700)
    assert held(machine)
    back = np.array(machine.rows)[before:, :3]
    assert came[-1, 0] - back[-1, 0] > 20.0
    assert distance(back[::7], came[np.append(True, np.any(np.diff(came, axis=0) != 0.0, axis=1))]) < 2e-3  # chords
    assert np.all(np.diff(machine.segments[before:]) <= 0) and machine.segments[-1] < machine.segments[before] - 40
    assert (machine.wire.seg_done, machine.wire.piece_now) == known
    assert machine.turn_about(back=False)
    machine.pausing, before = False, len(machine.rows)
    machine.run()
    forward = np.array(machine.rows)[before:]
    assert np.min(np.linalg.norm(forward - turned, axis=1)) < 0.04  # of a tick at 60 mm/s
    np.testing.assert_allclose(machine.at[0], 240.0, atol=1e-9)
    assert machine.said == [] and machine.wire.seg_done == 600 and machine.wire.late == 0
    assert machine.kept()


@needs_gcc
def test_a_run_back_ends_at_rest_where_motion_began_and_goes_on_from_there():
    machine = Machine()
    machine.wavy(200)
    machine.run(400)
    assert held(machine) and machine.turn_about(back=True)
    machine.pausing = False
    machine.run(1500)
    np.testing.assert_allclose(machine.at, 0.0, atol=1e-9)
    assert machine.lib.player_held(machine.me) and machine.turn_about(back=False)
    machine.run()
    np.testing.assert_allclose(machine.at[0], 80.0, atol=1e-9)
    assert machine.said == [] and machine.wire.seg_done == 200 and machine.kept()
    assert machine.turn_about(back=True)  # all is done: nothing is kept
    machine.line(90.0, 0.0, 0.0)
    machine.run(500)
    np.testing.assert_allclose(machine.at[0], 80.0, atol=1e-9)
    assert machine.turn_about(back=False)
    machine.run()
    np.testing.assert_allclose(machine.at[0], 90.0, atol=1e-9)
    assert machine.kept()


@needs_gcc
def test_a_run_back_passes_stops_and_rests_before_what_is_not_kept():
    machine = Machine()
    machine.wavy(100)
    for k in range(1, 40):
        machine.line(40.0 + 3.0 * k, 5.0 * (k % 2), 0.0, term=0)
    machine.run(400)
    machine.feed_scale = 0.5  # planned anew at half the rate: that is not run back over
    place = machine.at[0]
    machine.run(4000)
    assert held(machine) and machine.at[0] > 60.0 and machine.turn_about(back=True)
    machine.pausing = False
    machine.run(300)
    machine.run(8000, until=lambda: bool(machine.lib.player_held(machine.me)))
    assert machine.lib.player_held(machine.me) and place < machine.at[0] < 60.0
    machine.feed_scale = 1.0
    assert machine.turn_about(back=False)
    machine.run()
    np.testing.assert_allclose(machine.at[0], 157.0, atol=1e-9)
    assert machine.said == [] and machine.wire.seg_done == 139 and machine.kept()


@needs_gcc
@pytest.mark.parametrize("seed", range(3))
def test_runs_back_and_forth_with_pauses_and_overrides_keep_limits_and_path(seed: int):
    machine, rng = Machine(), np.random.default_rng(seed)
    machine.wavy(500)
    back = False
    for _ in range(60):
        machine.run(int(rng.integers(20, 400)))
        machine.feed_scale = float(rng.choice([1.0, 1.0, 0.5, 1.3, 0.8]))
        if rng.random() < 0.5 and int(machine.wire.seg_done) < 500:
            assert held(machine, 3000)
            back = bool(not back and rng.random() < 0.7)
            assert machine.turn_about(back)
            machine.pausing = False
    if machine.moving:
        assert held(machine, 3000) and machine.turn_about(back=False)
    machine.pausing, machine.feed_scale = False, 1.0
    machine.run()
    np.testing.assert_allclose(machine.at[0], 200.0, atol=1e-9)
    lines = np.array([[0.4 * k, 2.0 * np.sin(0.15 * k), 0.0] for k in range(501)])
    assert distance(np.array(machine.rows)[::11, :3], lines) <= 0.011
    assert machine.said == [] and machine.wire.seg_done == 500 and machine.kept()


@needs_gcc
def test_a_move_that_waits_for_the_spindle_begins_at_rest():
    machine = Machine()
    machine.line(20.0, 0.0, 0.0)
    machine.line(40.0, 0.0, 0.0, atspeed=1)
    machine.run()
    rows = np.array(machine.rows)[:, 0]
    still = rows[1:][np.diff(rows) == 0.0]
    assert np.any(np.abs(still - 20.0) < 1e-9) and rows[-1] == pytest.approx(40.0)
    assert machine.kept()


@needs_gcc
def test_nine_axes_move_together_within_their_limits():
    machine = Machine(mill(axes="xyzabcuvw"))
    rng = np.random.default_rng(3)
    for _ in range(6):
        end = machine.goal + rng.uniform(-8.0, 8.0, 9)
        machine.move(end, kind=wires.LINE, feed=20.0, tolerance=0.05)
    machine.move(machine.goal + np.r_[np.zeros(3), 30.0, np.zeros(5)], kind=wires.LINE, feed=20.0)  # a alone
    machine.run()
    assert machine.said == []
    np.testing.assert_allclose(machine.at, machine.goal, atol=1e-9)
    assert machine.kept()


LENGTHS = {"x-rot-point": 5.0, "y-offset": 20.0, "z-offset": -10.0, "tool-offset": 40.0}


@needs_gcc
@pytest.mark.parametrize(
    ("kinematics", "axes", "lengths"),
    [
        ("corexykins", "xyz", {}),
        ("rotatekins", "xyzabc", {}),
        ("xyzac-trt-kins", "xyzac", LENGTHS),
        ("5axiskins", "xyzbcw", {"pivot-length": 90.0}),
    ],
)
def test_joints_that_are_no_axes_keep_their_limits_while_overrides_and_pauses_come(kinematics, axes, lengths):
    machine = Machine(mill(axes=axes, kinematics=kinematics), lengths=lengths)
    turns = len(axes) - 3
    for k in range(1, 81):
        angles = [8.0 * np.sin(0.05 * k), 12.0 * np.sin(0.04 * k), 2.0 * np.sin(0.06 * k)][:turns]
        places = dict(zip(axes, [0.4 * k, 2.0 * np.sin(0.15 * k), 0.05 * k, *angles], strict=False))
        machine.line(*(places.get(axis, 0.0) for axis in "xyzabcuvw"), feed=60.0)
    machine.run(until=lambda: machine.at[0] > 6.0)
    machine.pausing = True
    machine.run(300, until=lambda: machine.lib.player_held(machine.me))
    assert machine.lib.player_held(machine.me)
    machine.pausing = False
    machine.run(until=lambda: machine.at[0] > 12.0)
    machine.feed_scale = 0.5
    machine.run(until=lambda: machine.at[0] > 20.0)
    machine.feed_scale = 1.2
    machine.run()
    assert machine.said == []
    np.testing.assert_allclose(machine.at, machine.goal, atol=1e-9)
    assert machine.kept()
    own = len(machine.mill.axes)  # some joint is what bounds the motion, so that it would be over its limit without
    rows = machine.joints_at(np.array(machine.rows))
    assert np.abs(np.diff(rows, n=3, axis=0)).max() / PERIOD**3 > 0.85 * machine.mill.jerk[own]


@needs_gcc
def test_a_machine_that_answers_something_else_does_not_move():
    machine = Machine(mill(axes="xyzac", kinematics="xyzac-trt-kins"), lengths=LENGTHS)
    machine.wire.answer[3, 1] += 1e-3
    machine.line(10.0, 5.0, 0.0)
    machine.run(2000, until=lambda: bool(machine.said))
    assert "neither those of xyzac-trt-kins nor trivial" in machine.said[0]
    assert np.array_equal(machine.at, np.zeros(wires.AXES))


@needs_gcc
def test_moves_of_a_rotary_axis_beside_a_linear_one_are_counted_where_they_are():
    machine = Machine(mill(axes="xyza"))
    for k in range(1, 11):
        end = np.zeros(wires.AXES)
        end[[0, 3]] = 2.0 * k, [40.0, 90.0, 20.0, 130.0][k % 4]
        machine.move(end, kind=wires.LINE, feed=1.0, tolerance=0.0)
    machine.run()
    assert machine.kept() and machine.wire.seg_done == 10
    taken = np.bincount(machine.segments, minlength=10) * PERIOD
    assert taken[1:9].min() > 1.8 and taken[1:9].max() < 2.5  # s, of 2 mm each
    rows = np.array(machine.rows)[1:]
    ends = [rows[machine.segments.index(k), 0] for k in range(1, 10)]
    np.testing.assert_allclose(ends, 2.0 * np.arange(1, 10), atol=0.02)


@needs_gcc
def test_a_program_longer_than_the_queue_is_planned_while_its_task_has_more():
    machine = Machine()
    machine.waits = False
    for k in range(1, 1901):
        machine.line(0.3 * k, 0.5 * np.sin(0.05 * k), 0.0)
    machine.run(4000)
    assert machine.at[0] > 150.0 and machine.wire.late == 0
    for k in range(1901, 2500):
        machine.line(0.3 * k, 0.5 * np.sin(0.05 * k), 0.0)
    machine.run(2000)
    machine.waits = True
    machine.run()
    assert machine.wire.seg_done == 2499 and machine.said == []
    assert machine.kept()
