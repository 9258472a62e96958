"""LinuxCNC's planner and player without LinuxCNC: moves in, every tick checked by third differences."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path as File

import numpy as np
import pytest

import splinefeed as sf
from linuxcnc_machine import GCC, PERIOD, Machine, mill
from splinefeed.live import linuxcnc_wire as wires
from splinefeed.live.linuxcnc_joints import PROBES
from splinefeed.live.linuxcnc_limits import mill_of
from splinefeed.live.linuxcnc_moves import curve_of, feeds_of
from splinefeed.live.linuxcnc_pieces import PlannedTrack, portions, quintics
from splinefeed.records import Array

needs_gcc = pytest.mark.skipif(GCC is None, reason="no C compiler; on Debian: apt-get install gcc")
NEAR = 1e-6


def wavy(machine: Machine, count: int, feed: float = 60.0) -> None:
    for k in range(1, count + 1):
        machine.line(0.4 * k, 2.0 * np.sin(0.15 * k), 0.0, feed=feed)


def kept(machine: Machine) -> bool:
    velocity, acceleration, jerk = machine.differences()
    return velocity <= 1.0 + NEAR and acceleration <= 1.0 + NEAR and jerk <= 1.0 + NEAR


def distance(points: Array, polyline: Array) -> float:
    """How far points (n, 3) are from the lines between others (m, 3), mm."""
    a, ab = polyline[:-1], np.diff(polyline, axis=0)
    t = np.einsum("nmj,mj->nm", points[:, None] - a, ab) / np.einsum("mj,mj->m", ab, ab)
    off = a + np.clip(t, 0.0, 1.0)[:, :, None] * ab - points[:, None]
    return float(np.linalg.norm(off, axis=2).min(axis=1).max())


@needs_gcc
def test_the_layout_is_that_of_the_header():
    machine = Machine()
    assert machine.lib.player_wire_size() == wires.WIRE.itemsize
    assert (machine.wire.magic, machine.wire.protocol, machine.wire.size) == (
        wires.MAGIC, wires.PROTOCOL, wires.WIRE.itemsize,
    )  # fmt: skip


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
    assert kept(machine)
    rows = np.array(machine.rows)[:, :3]
    assert distance(rows, places) <= (0.02 if term == 2 else 1e-6)
    at_corner = np.linalg.norm(rows - places[2], axis=1).min()
    assert at_corner <= 1e-9 if term < 2 else at_corner > 1e-4


@needs_gcc
def test_overrides_up_and_down_are_planned_anew_within_the_limits():
    machine = Machine(mill(velocity=200.0))
    wavy(machine, 600, feed=30.0)
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
    assert kept(machine)


@needs_gcc
def test_a_pause_a_hold_and_an_abort_stop_on_the_path():
    machine = Machine()
    wavy(machine, 600)
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
    assert kept(machine) and machine.said == []
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
    assert kept(machine) and machine.said == []


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
    assert machine.wire.seg_done == 1 and machine.said == [] and kept(machine)


@needs_gcc
def test_an_override_that_never_rests_keeps_the_limits():
    machine = Machine()
    wavy(machine, 600)
    rng = np.random.default_rng(5)
    for _ in range(300):
        machine.feed_scale = float(rng.choice([rng.uniform(0.0, 1.0), 0.0, 1.0, 2.0]))
        machine.pausing = bool(rng.random() < 0.2)
        machine.run(int(rng.integers(1, 60)))
    machine.feed_scale, machine.pausing = 1.0, False
    machine.run()
    assert machine.wire.seg_done == 600 and machine.said == []
    assert kept(machine)


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
    assert kept(machine)


def held(machine: Machine, ticks: int = 1000) -> bool:
    """Whether it comes to rest on its path in so many ticks."""
    machine.pausing = True
    machine.run(ticks, until=lambda: bool(machine.lib.player_held(machine.me)))
    return bool(machine.lib.player_held(machine.me))


@needs_gcc
def test_a_run_back_goes_along_the_path_that_it_came_and_forward_again():
    machine = Machine()
    wavy(machine, 600)
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
    assert kept(machine)


@needs_gcc
def test_a_run_back_ends_at_rest_where_motion_began_and_goes_on_from_there():
    machine = Machine()
    wavy(machine, 200)
    machine.run(400)
    assert held(machine) and machine.turn_about(back=True)
    machine.pausing = False
    machine.run(1500)
    np.testing.assert_allclose(machine.at, 0.0, atol=1e-9)
    assert machine.lib.player_held(machine.me) and machine.turn_about(back=False)
    machine.run()
    np.testing.assert_allclose(machine.at[0], 80.0, atol=1e-9)
    assert machine.said == [] and machine.wire.seg_done == 200 and kept(machine)
    assert machine.turn_about(back=True)  # all is done: nothing is kept
    machine.line(90.0, 0.0, 0.0)
    machine.run(500)
    np.testing.assert_allclose(machine.at[0], 80.0, atol=1e-9)
    assert machine.turn_about(back=False)
    machine.run()
    np.testing.assert_allclose(machine.at[0], 90.0, atol=1e-9)
    assert kept(machine)


@needs_gcc
def test_a_run_back_passes_stops_and_rests_before_what_is_not_kept():
    machine = Machine()
    wavy(machine, 100)
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
    assert machine.said == [] and machine.wire.seg_done == 139 and kept(machine)


@needs_gcc
@pytest.mark.parametrize("seed", range(3))
def test_runs_back_and_forth_with_pauses_and_overrides_keep_limits_and_path(seed: int):
    machine, rng = Machine(), np.random.default_rng(seed)
    wavy(machine, 500)
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
    assert machine.said == [] and machine.wire.seg_done == 500 and kept(machine)


def in_step(machine: Machine, speed: Callable[[], float], ticks: int, noise: float = 0.0) -> Array:
    """Turn a spindle at a speed, turns/s, for so many ticks of motion; angle (n,) at each of machine.rows since."""
    rng, angles, angle, begin = np.random.default_rng(1), [], 0.0, len(machine.rows)
    for _ in range(ticks):
        if machine.moving:
            angle += speed() * PERIOD
        machine.turns = angle + rng.uniform(-noise, noise)
        more = machine.tick()
        angles.append(angle)
        if not more:
            break
    assert len(angles) == len(machine.rows) - begin
    return np.array(angles)


@needs_gcc
@pytest.mark.parametrize(("wobble", "noise", "near"), [(0.0, 0.0, 1e-4), (0.05, 0.0, 2e-3), (0.0, 2e-4, 2e-3)])
def test_a_thread_is_as_far_on_as_its_spindle_has_turned(wobble, noise, near):
    machine, pitch, turns = Machine(), 1.5, 10.0
    for end in (-12.0, -30.0):
        machine.line(0.0, 0.0, end, feed=1.2 * pitch * turns, sync=wires.THREAD, enables=13)
    machine.turn_s = pitch / (1.2 * pitch * turns)
    at = len(machine.rows)
    machine.feed_scale, machine.vlimit = 0.3, 1.0  # which do not count
    angle = in_step(machine, lambda: turns * (1.0 + wobble * np.sin(0.02 * len(machine.rows))), 4000, noise)
    z = -np.array(machine.rows)[at:, 2]
    assert machine.wire.seg_done == 2 and machine.said == [] and kept(machine)
    middle = (z > 3.0) & (z < 27.0)
    off = (z - pitch * angle)[middle]
    assert np.ptp(off) <= 2.0 * near
    assert middle.sum() > 1000


@needs_gcc
def test_a_tap_goes_out_as_it_came_in_and_ends_where_it_began():
    machine, pitch, turns = Machine(), 1.0, 8.0
    machine.line(0.0, 0.0, -20.0 - 10.0 * pitch, feed=1.2 * pitch * turns, sync=wires.TAP, enables=13)
    machine.goal[:] = 0.0
    machine.line(5.0, 0.0, 0.0)
    machine.turn_s = 1.0 / (1.2 * turns)
    speed, deepest = turns, len(machine.rows)

    def spindle() -> float:
        nonlocal speed, deepest
        if machine.at[2] <= -20.0 and speed == turns:
            machine.lib.player_come_out(machine.me)
            speed -= 0.08
        if speed < turns:
            speed = max(speed - 0.08, -turns)  # 0.2 s to turn round
            deepest = len(machine.rows) if machine.at[2] < np.array(machine.rows)[:, 2].min() else deepest
        return speed

    at = len(machine.rows)
    angle = in_step(machine, spindle, 9000)
    rows = np.array(machine.rows)[at:]
    z = rows[:, 2]
    assert machine.wire.seg_done == 2 and machine.said == [] and kept(machine)
    np.testing.assert_allclose(rows[-1, :3], [5.0, 0.0, 0.0], atol=1e-9)
    bottom = int(np.argmin(z))
    assert -21.0 < z[bottom] < -20.3  # the spindle went on by 0.4 turns
    out = bottom + int(np.argmax(z[bottom:] == z[-1]))
    came = np.interp(z[bottom:out][::-1], z[:bottom][::-1], angle[:bottom][::-1])
    away = (z[bottom:out][::-1] > -19.0) & (z[bottom:out][::-1] < -2.0)
    assert np.abs(came - angle[bottom:out][::-1])[away].max() * pitch <= 2e-3


@needs_gcc
def test_a_spindle_that_is_too_fast_stops_the_motion_with_a_fault():
    machine = Machine()
    machine.line(0.0, 0.0, -30.0, feed=12.0, sync=wires.THREAD, enables=13)
    machine.turn_s = 1.0 / 12.0
    in_step(machine, lambda: 15.0, 1000)
    assert machine.said == ["fault 3"] and machine.lib.player_held(machine.me)
    assert kept(machine)


@needs_gcc
def test_a_planner_that_comes_late_costs_a_stop_and_nothing_else():
    machine = Machine()
    wavy(machine, 600)
    machine.run(1000)
    planner, machine.planner = machine.planner, None
    for _ in range(20_000):
        machine.wire.store("beat", int(machine.wire.beat) + 1)
        machine.tick()
        if not machine.moving:
            break
    assert machine.wire.late == 1 and machine.wire.seg_done < 600
    machine.planner = planner
    machine.run()
    assert machine.wire.seg_done == 600 and machine.said == []
    np.testing.assert_allclose(machine.at[:2], [240.0, 2.0 * np.sin(90.0)], atol=1e-9)
    assert kept(machine)


@needs_gcc
def test_moves_that_are_dropped_as_late_before_they_are_smooth_are_planned():
    machine = Machine()
    machine.waits = False
    machine.line(5.0, 0.0, 0.0)
    machine.run(3)
    machine.wire.store("why", wires.WHY_LATE)
    machine.wire.store("epoch", int(machine.wire.epoch) + 1)  # as an override that came too late does at rest
    machine.run(3)
    machine.waits = True
    machine.run()
    assert machine.said == [] and machine.wire.seg_done == 1 and machine.at[0] == pytest.approx(5.0)


@needs_gcc
def test_a_silent_planner_is_a_fault_with_a_stop_and_another_one_goes_on_after_an_abort():
    machine = Machine()
    wavy(machine, 600)
    machine.run(1000)
    machine.run(3000, until=lambda: not machine.moving, beat=False)
    machine.run(1500, beat=False)
    assert "fault 1" in machine.said
    assert kept(machine)
    machine.aborting = True
    machine.run()
    machine.said.clear()
    machine.greet()
    machine.line(1.0, 1.0, 1.0)
    machine.run()
    assert machine.said == []
    np.testing.assert_allclose(machine.at[:3], 1.0, atol=1e-9)
    assert kept(machine)


def spoilt(field: str, value: float, which: int = 3) -> Machine:
    """A machine whose planner sends a piece with something wrong in it."""
    machine = Machine()
    wavy(machine, 40)
    planner = machine.planner
    assert planner is not None
    send = planner.wire.store

    def store(name: str, given: object) -> None:
        if name == "batch_head":
            row = machine.wire.piece[which]
            if field == "span":
                row["span"] = value
            else:
                row["c"][0, int(field)] += value
        send(name, given)

    planner.wire.store = store  # type: ignore[method-assign]
    machine.run(400)
    return machine


@needs_gcc
@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("0", np.nan, "a piece that is not finite: axis X"),
        ("0", 1e-4, "a jump of the position: axis X"),
        ("1", 1.0, "a jump of the velocity: axis X"),
        ("2", 200.0, "a jump of the acceleration: axis X"),
        ("4", 1e9, "more than the limit of acceleration: axis X"),
        ("span", np.inf, "a piece without a time"),
        ("span", -1.0, "a piece without a time"),
    ],
)
def test_a_wrong_piece_is_refused_before_it_moves_anything(field, value, said):
    machine = spoilt(field, value)
    assert machine.wire.refused >= 1
    assert any(said in text for text in machine.said), machine.said
    assert not machine.moving and np.all(np.array(machine.rows) == 0.0)


@needs_gcc
def test_motion_beyond_the_travel_is_refused():
    machine = Machine(travel=5.0)
    machine.line(4.0, 0.0, 0.0)
    machine.line(9.0, 0.0, 0.0)
    machine.run(500)
    assert any("beyond the travel: axis X" in text for text in machine.said)
    assert np.array(machine.rows)[:, 0].max() <= 5.0


@needs_gcc
def test_a_move_that_waits_for_the_spindle_begins_at_rest():
    machine = Machine()
    machine.line(20.0, 0.0, 0.0)
    machine.line(40.0, 0.0, 0.0, atspeed=1)
    machine.run()
    rows = np.array(machine.rows)[:, 0]
    still = rows[1:][np.diff(rows) == 0.0]
    assert np.any(np.abs(still - 20.0) < 1e-9) and rows[-1] == pytest.approx(40.0)
    assert kept(machine)


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
    assert kept(machine)


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
    assert kept(machine)
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


def test_lengths_of_kinematics_come_from_the_answers_and_the_module_may_be_switched():
    moved = mill(axes="xyzac", kinematics="xyzac-trt-kins").moved
    assert moved is not None
    rng, pose = np.random.default_rng(4), (1.0, 2.0, 3.0, 0.4, -0.7)
    for _ in range(20):
        wanted = moved.with_lengths(dict(zip(moved.module.lengths, rng.uniform(-200.0, 200.0, 6), strict=True)))
        found = moved.answering(np.array([wanted.of(moved._pose(row)) for row in PROBES], dtype=float))
        np.testing.assert_allclose(found.of(pose), wanted.of(pose), atol=1e-9)
    trivial = moved.answering(PROBES[:, :3])
    assert trivial.of(pose) == (1.0, 2.0, 3.0) and not trivial.bend
    with pytest.raises(sf.errors.SplinefeedError, match="not planned"):
        moved.answering(np.full((wires.PROBES, 3), np.nan))


@needs_gcc
def test_moves_of_a_rotary_axis_beside_a_linear_one_are_counted_where_they_are():
    machine = Machine(mill(axes="xyza"))
    for k in range(1, 11):
        end = np.zeros(wires.AXES)
        end[[0, 3]] = 2.0 * k, [40.0, 90.0, 20.0, 130.0][k % 4]
        machine.move(end, kind=wires.LINE, feed=1.0, tolerance=0.0)
    machine.run()
    assert kept(machine) and machine.wire.seg_done == 10
    taken = np.bincount(machine.segments, minlength=10) * PERIOD
    assert taken[1:9].min() > 1.8 and taken[1:9].max() < 2.5  # s, of 2 mm each
    rows = np.array(machine.rows)[1:]
    ends = [rows[machine.segments.index(k), 0] for k in range(1, 10)]
    np.testing.assert_allclose(ends, 2.0 * np.arange(1, 10), atol=0.02)


def moves(rows: list[dict[str, object]]) -> Array:
    out = np.zeros(len(rows), wires.SEGMENT)
    for k, row in enumerate(rows):
        for name, value in row.items():
            out[name][k] = value
    return out


@pytest.mark.parametrize(
    ("turn", "angle"), [(0, 0.5 * np.pi), (1, 2.5 * np.pi), (-1, -1.5 * np.pi), (-2, -3.5 * np.pi)]
)
@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, 1, 0), (0.6, 0.0, 0.8)])
def test_arcs_turn_as_their_numbers_say(turn, angle, normal):
    machine = mill(axes="xyzu")
    axis = np.array(normal, dtype=float)
    u = np.cross(axis, [0.3, 0.9, 0.1])
    u /= np.linalg.norm(u)
    w, centre, r, rise = np.cross(axis, u), np.array([1.0, 2, 3]), 5.0, 4.0

    def at(share: float) -> Array:
        t = share * angle
        place = np.zeros(9)
        place[:3] = centre + r * (np.cos(t) * u + np.sin(t) * w) + share * rise * axis
        place[6] = 2.0 * share
        return place

    row = moves([{"kind": wires.ARC, "turn": turn, "centre": centre, "normal": axis, "from": at(0.0), "to": at(1.0)}])
    curve = curve_of(row[0], machine)
    path = sf.Path([curve], machine.axes)
    for share in (0.0, 0.2, 0.5, 0.9, 1.0):
        wanted = at(share)[machine.columns]
        np.testing.assert_allclose(path(share * path.length), wanted, atol=2e-7)


def test_a_curve_is_cut_at_the_knot_that_is_there():
    knots = np.r_[np.zeros(4), np.cumsum(np.full(6, 1.0 / 7.0)), np.ones(4)]
    points = np.column_stack([np.arange(10.0), np.arange(10.0) % 3, np.zeros(10)])
    path = sf.Path([sf.NurbsCurve(3, knots, points)], ("x", "y", "z"), feeds=[10.0])
    parts = portions(path, np.array([0]), np.array([7.0]), 1.0)
    assert len(parts) == 7 and sum(part.length for part, _ in parts) == pytest.approx(path.length)


def test_pieces_join_where_a_path_has_a_curve_shorter_than_a_piece():
    places = np.array([0.0, 5.0, 5.0002, 10.0])  # the short one begins another part of the path
    lines = [sf.NurbsCurve.bezier([[a, 0.0, 0.0], [b, 0.0, 0.0]]) for a, b in pairwise(places)]
    track = PlannedTrack(0)
    track.push(np.diff(places))
    for part, origins in ((lines[:1], [0]), (lines[1:], [1, 2])):
        track.add(sf.Path(part, ("x", "y", "z")), np.array(origins))
    law = np.array([[0.0, 50.0, 0.0, 0.0, 0.0, 0.0], [5.0, 50.0, 0.0, 0.0, 0.0, 0.0]])
    found = quintics(track, 0.0, np.array([5.0, 10.0 - 5.0]) / 50.0, law)
    ends = np.einsum("nak,nk->na", found.c, found.span[:, None] ** np.arange(6))
    np.testing.assert_allclose(ends[:-1], found.c[1:, :, 0], atol=1e-9)
    np.testing.assert_allclose(ends[-1], [10.0, 0.0, 0.0], atol=1e-9)


def test_a_stale_memory_of_another_size_is_removed_and_one_in_use_is_named(monkeypatch):
    monkeypatch.setattr(wires, "KEY", 0x53500000 + os.getpid() % 0xFFFF)  # no LinuxCNC's
    libc = ctypes.CDLL(None)
    libc.shmat.restype, libc.shmat.argtypes = ctypes.c_void_p, [ctypes.c_int, ctypes.c_void_p, ctypes.c_int]
    size, create = ctypes.c_size_t(5000), 0o1600
    libc.shmget(wires.KEY, size, create)
    assert wires.found() is None
    assert libc.shmget(wires.KEY, ctypes.c_size_t(0), 0) < 0
    ident = libc.shmget(wires.KEY, size, create)
    address = libc.shmat(ident, None, 0)
    try:
        with pytest.raises(wires.WireError, match="another size: it is of another version of splinefeed_tp"):
            wires.found()
    finally:
        libc.shmdt(ctypes.c_void_p(address))
        libc.shmctl(ident, wires.IPC_RMID, None)


def test_feeds_count_as_linuxcnc_counts_them():
    machine = mill(axes="xyzau")
    rows = moves(
        [
            {"kind": 1, "canon": 2, "enables": 15, "feed": 10.0, "top": 99.0, "to": [3, 4, 0, 0, 0, 0, 0, 0, 0]},
            {"kind": 1, "canon": 2, "enables": 15, "feed": 10.0, "top": 99.0, "to": [3, 4, 0, 0, 0, 0, 12, 0, 0]},
            {"kind": 1, "canon": 2, "enables": 13, "feed": 10.0, "top": 99.0, "to": [3, 4, 0, 9, 0, 0, 0, 0, 0]},
            {"kind": 1, "canon": 1, "enables": 15, "feed": 80.0, "top": 80.0, "to": [3, 4, 0, 0, 0, 0, 0, 0, 0]},
            {"kind": 1, "canon": 2, "enables": 15, "feed": 70.0, "top": 99.0, "to": [0, 0, 0, 9, 0, 0, 0, 0, 0]},
        ]
    )
    feeds, scales = feeds_of(rows, machine, 1.5, 0.5, 30.0)
    np.testing.assert_allclose(feeds, [15.0, 15.0 * 13 / 5, 10.0, 30.0, 99.0])
    np.testing.assert_allclose(scales, [1.5, 1.5, 1.0, 0.5, 1.5])


INI = """\
[TRAJ]
TPMOD = splinefeed_tp
COORDINATES = X Z A
LINEAR_UNITS = inch
ANGULAR_UNITS = degree
[KINS]
KINEMATICS = trivkins coordinates=XZA
[AXIS_X]
MAX_VELOCITY = 2
MAX_ACCELERATION = 20
[JOINT_0]
MAX_VELOCITY = 1.5
MAX_JERK = 700
[AXIS_Z]
MAX_VELOCITY = 1
MAX_ACCELERATION = 10
[AXIS_A]
MAX_VELOCITY = 90
MAX_ACCELERATION = 900
MAX_JERK = 9000
"""


def test_the_machine_comes_from_the_ini_file(tmp_path: File):
    file = tmp_path / "mill.ini"
    file.write_text(INI)
    found = mill_of(str(file))
    assert found.axes == ("x", "z", "a") and found.columns.tolist() == [0, 2, 3]
    np.testing.assert_allclose(found.velocity, [1.5 * 25.4, 25.4, np.pi / 2])
    np.testing.assert_allclose(found.acceleration, [20 * 25.4, 254.0, 5 * np.pi])
    np.testing.assert_allclose(found.jerk, [700 * 25.4, 20 * 254.0, 50 * np.pi])
    assert found.notes == ["[AXIS_Z]MAX_JERK is missing: 200, 20 times the acceleration a second"]


TRUNNION = """\
[TRAJ]
TPMOD = splinefeed_tp
COORDINATES = XYZAC
[KINS]
KINEMATICS = xyzac-trt-kins coordinates=XYZACY
"""


def test_joints_that_are_no_axes_have_their_own_limits(tmp_path: File):
    limits = "MAX_VELOCITY = {}\nMAX_ACCELERATION = 100\nMAX_JERK = 2000\n"
    text = TRUNNION + "".join(f"[AXIS_{axis}]\n{limits.format(50)}" for axis in "XYZAC")
    text += "".join(f"[JOINT_{k}]\n{limits.format(20 + k)}" for k in range(6))
    file = tmp_path / "mill.ini"
    file.write_text(text)
    found = mill_of(str(file))
    assert found.limited == ("x", "y", "z", "a", "c", "joint 0", "joint 1", "joint 2", "joint 5")
    turns = np.radians([23.0, 24.0])  # a rotary joint is its axis
    np.testing.assert_allclose(found.velocity, [50.0, 50.0, 50.0, *turns, 20.0, 21.0, 22.0, 25.0])
    assert found.moved is not None and found.moved.letters == ("x", "y", "z", "y")
    assert found.piece_columns.tolist() == [0, 1, 2, 3, 5, 9, 10, 11, 12]
    file.write_text(text.replace("COORDINATES = XYZAC\n", "COORDINATES = XYZ\n"))
    with pytest.raises(sf.errors.FormatError, match=r"\[TRAJ\]COORDINATES has no [AC]: xyzac-trt-kins has joints for"):
        mill_of(str(file))
    file.write_text(text.partition("[JOINT_5]")[0])
    with pytest.raises(sf.errors.FormatError, match=r"MAX_VELOCITY of joint 5 is missing; add it to \[JOINT_5\]"):
        mill_of(str(file))


@pytest.mark.parametrize(
    ("ratio", "left", "said"),
    [
        # a jerk of 4/3 * ratio * 10 / 0.001 in 200, of which offsets take half at most
        (0.005, 200.0 - 66.666667, "0.5 % of velocity and acceleration are kept for external offsets, and 66.6667 of"),
        (0.2, 100.0, "the sum is beyond the jerk of 200 (OFFSET_AV_RATIO of at most 0.0075 keeps it)"),
    ],
)
def test_external_offsets_take_their_share_of_an_axis(ratio: float, left: float, said: str, tmp_path: File):
    file = tmp_path / "mill.ini"
    file.write_text(INI.replace("[AXIS_Z]", f"[AXIS_Z]\nOFFSET_AV_RATIO = {ratio}"), encoding="utf-8")
    found = mill_of(str(file))
    k = found.axes.index("z")
    np.testing.assert_allclose(found.velocity[k], 25.4 * (1.0 - ratio))
    np.testing.assert_allclose(found.acceleration[k], 254.0 * (1.0 - ratio))
    np.testing.assert_allclose(found.jerk[k], 25.4 * left)
    assert said in found.notes[-1]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("trivkins coordinates=XZA", "genserkins", r"KINEMATICS = genserkins: it can plan trivkins, corexykins"),
        ("MAX_ACCELERATION = 10\n", "", r"MAX_ACCELERATION of axis Z is missing; add it to \[AXIS_Z\]"),
        ("LINEAR_UNITS = inch", "LINEAR_UNITS = furlong", r"\[TRAJ\]LINEAR_UNITS is 'furlong'"),
        ("MAX_JERK = 700", "MAX_JERK = -700", r"\[JOINT_0\]MAX_JERK: -700; must be greater than 0"),
        ("[TRAJ]", "[TRAY]", r"no section \[TRAJ\]"),
        ("[AXIS_X]", "[AXIS_X]\nOFFSET_AV_RATIO = 1", r"\[AXIS_X\]OFFSET_AV_RATIO is 1; give 0 to 0.9"),
    ],
)
def test_an_ini_file_that_cannot_be_planned_is_one_line(tmp_path: File, old: str, new: str, said: str):
    file = tmp_path / "mill.ini"
    file.write_text(INI.replace(old, new))
    with pytest.raises(sf.errors.FormatError, match=said):
        mill_of(str(file))


@needs_gcc
@pytest.mark.parametrize(
    ("version", "fits"),
    [(b"2.9.0~pre1", 1), (b"2.9.4", 1), (b"2.10.0~pre0", 0), (b"2.8.4", 0), (b"2.91", 0), (None, 1)],
)
def test_the_module_is_for_one_version_of_linuxcnc(version, fits):
    assert bool(Machine().lib.player_version_fits(version)) == bool(fits)


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
    assert kept(machine)
