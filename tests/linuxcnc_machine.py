"""LinuxCNC's side of its planner without LinuxCNC: the C player, compiled alone, and what task and motmod do."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from splinefeed.live import linuxcnc_wire as wires
from splinefeed.live.linuxcnc_joints import MODULES, MovedJoints
from splinefeed.live.linuxcnc_limits import Mill
from splinefeed.live.linuxcnc_planner import Planner
from splinefeed.live.linuxcnc_wire import Wire
from splinefeed.records import Array

HEADER = Path(__file__).parents[1] / "linuxcnc" / "splinefeed_player.h"
PERIOD = 1e-3
GCC = shutil.which("gcc")
needs_gcc = pytest.mark.skipif(GCC is None, reason="no C compiler; on Debian: apt-get install gcc")
#: A share of a limit by which third differences may be over it.
NEAR = 1e-6
#: What the player is told.
GO, HOLD, STEP = range(3)


@cache
def library() -> ctypes.CDLL:
    """The player as a shared object; warnings are errors."""
    assert GCC is not None
    folder = tempfile.mkdtemp(prefix="splinefeed-player-")
    out = f"{folder}/player.so"
    words = [GCC, "-shared", "-fPIC", "-O2", "-Wall", "-Wextra", "-Werror", "-DPLAYER_API=", "-x", "c", str(HEADER)]
    subprocess.run([*words, "-o", out, "-lm"], check=True)
    found = ctypes.CDLL(out)
    shutil.rmtree(folder)
    found.player_begin.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double]
    for name in ("player_size", "player_wire_size"):
        getattr(found, name).restype = ctypes.c_ulong
    found.player_listen.argtypes = [ctypes.c_void_p, ctypes.c_double]
    for name in ("come_out", "drop", "forget", "held", "planner_there"):
        getattr(found, f"player_{name}").argtypes = [ctypes.c_void_p]
    found.player_ready.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    found.player_set.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    found.player_turn_about.argtypes = [ctypes.c_void_p, ctypes.c_int]
    found.player_tick.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_double, ctypes.c_double]
    found.player_spindle.argtypes = [ctypes.c_void_p, ctypes.c_double]
    found.player_sync.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_double, ctypes.c_double]
    found.player_version_fits.argtypes = [ctypes.c_char_p]
    return found


#: The first fields of `player`, behind the pointer to the shared memory.
FIELDS = np.dtype(
    [("w", "<u8"), ("period", "<f8")]
    + [(name, "<f8", wires.COLUMNS) for name in ("vmax", "amax")]
    + [(name, "<f8", wires.AXES) for name in ("pmin", "pmax")]
    + [("there", "<i4", wires.COLUMNS), ("columns", "<i4")]
    + [("at", "<f8", wires.AXES), ("speed", "<f8"), ("moving", "<i4"), ("stopping", "<i4")]
    + [("piece", "<u8"), ("segment", "<u8"), ("piece_i", "<u4"), ("pad2", "<u4")]
    + [(name, "<f8") for name in ("t", "rate", "rate_v", "since")]
    + [("next", "<u8"), ("seen", "<u8"), ("part", "<u4"), ("pad3", "<u4")]
    + [(name, "<u8") for name in ("playing", "session", "beat", "fault")]
    + [("silent", "<f8"), ("faulty", "<i4")]
)


def mill(
    velocity: float = 60.0, acceleration: float = 1000.0, jerk: float = 50000.0, axes: str = "xyz", kinematics: str = ""
) -> Mill:
    """A machine in mm and degrees, alike in each axis, and in each joint of a kinematics module that is no axis."""
    order = tuple(sorted(axes, key=lambda a: (a in "abc", "xyzabcuvw".index(a))))
    units = np.array([np.pi / 180.0 if a in "abc" else 1.0 for a in "xyzabcuvw"])
    columns = np.array(["xyzabcuvw".index(a) for a in order])
    one, moved = units[columns], None
    if kinematics:
        module = MODULES[kinematics]
        numbers = tuple(range(len(module.moved)))
        moved = MovedJoints(kinematics, module, order, tuple(module.moved), numbers)
        one = np.append(one, np.ones(len(numbers)))
    return Mill(order, columns, units, 1.0, velocity * one, acceleration * one, jerk * one, 1e3, moved=moved)


class Machine:
    """Task, motmod and player: moves go in, `run` ticks until all is played; `rows` has the position of each tick.

    planner  plans for it, a step a tick unless it is taken away
    lengths  of its kinematics, mm, where it has joints that are no axes
    turns, turn_s  of a spindle: its angle, and the time of motion that a turn is, s
    """

    def __init__(
        self, machine: Mill | None = None, reserve: float = 0.05, travel: float = 1e3,
        lengths: Mapping[str, float] | None = None,
    ) -> None:  # fmt: skip
        self.lib, self.mill = library(), machine or mill()
        self.joints = None if self.mill.moved is None else self.mill.moved.with_lengths(lengths or {})
        self.buffer = np.zeros(wires.WIRE.itemsize // 8 + 1)
        self.own = np.zeros(self.lib.player_size() // 8 + 1)
        self.me = self.own.ctypes.data
        self.lib.player_begin(self.me, self.buffer.ctypes.data, PERIOD)
        self.wire = Wire(self.buffer)
        self.player = np.frombuffer(self.own, FIELDS, 1)
        inverse = 1.0 / self.mill.units[self.mill.columns]
        for name, values in (("vmax", self.mill.velocity), ("amax", self.mill.acceleration)):
            self.player[name][0, self.mill.columns] = values[: len(inverse)] * inverse
        self.player["there"][0, self.mill.columns] = 1
        self.player["pmin"], self.player["pmax"] = -travel, travel
        self.at = self.player["at"][0]
        self.goal = np.zeros(wires.AXES)
        self.said: list[str] = []
        self.planner: Planner | None = None
        self.reserve = reserve
        self.rows: list[Array] = [self.at.copy()]
        self.segments: list[int] = []
        self.feed_scale = self.rapid_scale = 1.0
        self.vlimit = 1e3
        self.pausing = self.aborting = self.stepping = False
        self.waits = True
        self.turns, self.turn_s = 0.0, 1.0
        self.greet()

    def greet(self) -> None:
        """Start a planner."""
        self._tell()
        self.planner = Planner(
            self.wire, self.mill, self.reserve, say=self.said.append, waits=lambda: 0.0 if self.waits else np.inf,
            clock=lambda: PERIOD * len(self.rows),
        )  # fmt: skip
        self.lib.player_listen(self.me, PERIOD)
        if self.joints is not None:
            own = self.joints_at(self.wire.probe)
            self.wire.answer[:, : own.shape[1]] = own
            self.wire.store("answered", int(self.wire.session))

    def joints_at(self, poses: Array) -> Array:
        """Joints that are no axes, (n, joints), at poses (n, 9)."""
        assert self.mill.moved is not None and self.joints is not None
        return self.mill.moved.at(self.joints, poses * self.mill.units)

    def _tell(self) -> None:
        self.wire.store("feed_scale", self.feed_scale)
        self.wire.store("rapid_scale", self.rapid_scale)
        self.wire.store("vlimit", self.vlimit)

    def line(self, *to: float, feed: float = 60.0, **said: object) -> None:
        """A straight move of the first axes; said: fields of wire.SEGMENT."""
        end = self.goal.copy()
        end[: len(to)] = to
        self.move(end, kind=wires.LINE, feed=feed, indexer=-1, **said)

    def wavy(self, count: int, feed: float = 60.0) -> None:
        """So many short lines along a sine."""
        for k in range(1, count + 1):
            self.line(0.4 * k, 2.0 * np.sin(0.15 * k), 0.0, feed=feed)

    def move(self, end: Array, **said: object) -> None:
        """A move, as tpAddLine or tpAddCircle gets it."""
        head = int(self.wire.seg_head)
        row = self.wire.segment[head % wires.SEGMENTS : head % wires.SEGMENTS + 1]
        fields = {"canon": 2, "enables": 15, "term": 2, "tolerance": 0.01, "top": 1e3, "indexer": -1, **said}
        for name, value in fields.items():
            row[name] = value
        row["from"], row["to"], row["id"] = self.goal, end, head + 1
        self.goal = np.array(end, dtype=float)
        self.wire.store("seg_head", head + 1)

    def tick(self, beat: bool = True) -> bool:
        """One servo period; whether anything is left to do."""
        lib, wire = self.lib, self.wire
        self._tell()
        if beat and self.planner is not None:
            wire.store("beat", int(wire.beat) + 1)
            self.planner.step()
        if lib.player_listen(self.me, PERIOD):
            self.said.append(f"fault {self.player['faulty'][0]}")
        hold = self.pausing or self.aborting or bool(self.player["faulty"][0])
        told = HOLD if hold else STEP if self.stepping else GO
        canon = int(wire.segment[int(self.player["segment"][0]) % wires.SEGMENTS]["canon"])
        net = self.rapid_scale if canon == 1 else self.feed_scale
        left = True
        if not self.player["moving"][0]:
            if self.aborting:
                self.drop()
                return False
            left = int(wire.seg_done) != int(wire.seg_head)
            if not left:
                lib.player_forget(self.me)
            segment = ctypes.c_ulonglong()
            if left and lib.player_ready(self.me, ctypes.byref(segment)) and not hold and net > 0.0:
                self.player["segment"] = segment.value
                sync = int(wire.segment[segment.value % wires.SEGMENTS]["sync"])
                if sync:
                    lib.player_sync(self.me, sync, self.turns, self.turn_s)
                lib.player_tick(self.me, told, net, self.vlimit)
        elif self.aborting and lib.player_held(self.me):
            self.drop()
            left = False
        else:
            lib.player_spindle(self.me, self.turns)
            lib.player_tick(self.me, told, net, self.vlimit)
        self.rows.append(self.at.copy())
        self.segments.append(int(self.player["segment"][0]))
        return left

    def turn_about(self, back: bool) -> bool:
        """Run back along the path, or forward again; False while it moves."""
        return bool(self.lib.player_turn_about(self.me, int(back)))

    def drop(self) -> None:
        """What an abort does at rest."""
        self.lib.player_drop(self.me)
        self.goal, self.aborting, self.pausing = self.at.copy(), False, False

    def run(self, ticks: int = 60_000, until: Callable[[], bool] = lambda: False, beat: bool = True) -> None:
        """Until all moves are played, `until`, or so many ticks are over."""
        for _ in range(ticks):
            if not self.tick(beat) or until():
                return

    @property
    def moving(self) -> bool:
        return bool(self.player["moving"][0])

    def differences(self) -> list[float]:
        """The largest velocity, acceleration and jerk of any tick, as shares of the limits of the machine."""
        rows = np.array(self.rows)[:, self.mill.columns] * self.mill.units[self.mill.columns]
        if self.joints is not None:
            rows = np.concatenate([rows, self.joints_at(np.array(self.rows))], axis=1)
        given = (self.mill.velocity, self.mill.acceleration, self.mill.jerk)
        return [
            float(np.max(np.abs(np.diff(rows, n=n, axis=0)) / PERIOD**n / limit, initial=0.0))
            for n, limit in enumerate(given, 1)
        ]

    def kept(self) -> bool:
        """Whether every tick kept the limits."""
        return max(self.differences()) <= 1.0 + NEAR
