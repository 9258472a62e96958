"""LinuxCNC's player without LinuxCNC: what it refuses, how it follows a spindle, and a planner that fails."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable

import numpy as np
import pytest

from linuxcnc_machine import PERIOD, Machine, needs_gcc
from splinefeed.live import linuxcnc_wire as wires
from splinefeed.records import Array


@needs_gcc
def test_the_layout_is_that_of_the_header():
    machine = Machine()
    assert machine.lib.player_wire_size() == wires.WIRE.itemsize
    assert (machine.wire.magic, machine.wire.protocol, machine.wire.size) == (
        wires.MAGIC, wires.PROTOCOL, wires.WIRE.itemsize,
    )  # fmt: skip


@needs_gcc
@pytest.mark.parametrize(
    ("version", "fits"),
    [(b"2.9.0~pre1", 1), (b"2.9.4", 1), (b"2.10.0~pre0", 0), (b"2.8.4", 0), (b"2.91", 0), (None, 1)],
)
def test_the_module_is_for_one_version_of_linuxcnc(version, fits):
    assert bool(Machine().lib.player_version_fits(version)) == bool(fits)


def spoilt(field: str, value: float, which: int = 3) -> Machine:
    """A machine whose planner sends a piece with something wrong in it."""
    machine = Machine()
    machine.wavy(40)
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
    assert machine.wire.seg_done == 2 and machine.said == [] and machine.kept()
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
    assert machine.wire.seg_done == 2 and machine.said == [] and machine.kept()
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
    assert machine.kept()


@needs_gcc
def test_a_planner_that_comes_late_costs_a_stop_and_nothing_else():
    machine = Machine()
    machine.wavy(600)
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
    assert machine.kept()


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
    machine.wavy(600)
    machine.run(1000)
    machine.run(3000, until=lambda: not machine.moving, beat=False)
    machine.run(1500, beat=False)
    assert "fault 1" in machine.said
    assert machine.kept()
    machine.aborting = True
    machine.run()
    machine.said.clear()
    machine.greet()
    machine.line(1.0, 1.0, 1.0)
    machine.run()
    assert machine.said == []
    np.testing.assert_allclose(machine.at[:3], 1.0, atol=1e-9)
    assert machine.kept()


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
