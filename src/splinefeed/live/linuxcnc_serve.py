"""The planner process: it waits for a LinuxCNC, plans for it until it ends, and waits for the next."""

from __future__ import annotations

import os
import subprocess
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from importlib.resources import files
from typing import Any

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.live import linuxcnc_wire as wires
from splinefeed.live.linuxcnc_curves import ProgramCurves
from splinefeed.live.linuxcnc_limits import Mill
from splinefeed.live.linuxcnc_pieces import PlannedTrack, quintics
from splinefeed.live.linuxcnc_planner import Planner
from splinefeed.live.linuxcnc_refusals import refused
from splinefeed.paths.path import Path
from splinefeed.paths.smoothing import Smoother
from splinefeed.planner.stream import LookAhead

#: A child that watches LinuxCNC's task is started again after this, s.
AGAIN = 0.2
#: The main loop is taken for dead after this, s.
DEAD = 8.0


class Heart:
    """Beats for the planner from a thread of its own, while its main loop lives."""

    def __init__(self, planner: Planner) -> None:
        self._planner, self._ends = planner, threading.Event()
        self._thread = threading.Thread(target=self._beat, daemon=True)
        self._thread.start()

    def _beat(self) -> None:
        planner = self._planner
        while not self._ends.wait(0.02):
            if planner.clock() - planner.alive < DEAD:
                planner.wire.store("beat", int(planner.wire.beat) + 1)

    def stop(self) -> None:
        """Stop beating, before the memory goes."""
        self._ends.set()
        self._thread.join()


class TaskWatch:
    """Whether LinuxCNC's task waits for motion to end, and what it has loaded, as a child in LinuxCNC's Python sees it.

    curves_of  makes them of a file; refused  says what of a file will not run, for the operator's screen
    """

    def __init__(
        self, python: str, home: str | None, curves_of: Callable[[str], ProgramCurves], refused: Callable[[str], str]
    ) -> None:
        self.curves: ProgramCurves | None = None
        self._curves_of, self._refused = curves_of, refused
        self.waiting: float | None = None  # since when, by the monotonic clock; inf while it goes on
        program = files("splinefeed.live").joinpath("linuxcnc_task.py").read_text(encoding="utf-8")
        self._words = [python, "-c", program]
        self._environment = os.environ if home is None else {**os.environ, "HOME": home}
        self._child: subprocess.Popen[str] | None = None
        self._ends = not os.path.exists(python)
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        while not self._ends:  # it ends where LinuxCNC was not there yet, and never sees it then
            self._child = subprocess.Popen(
                self._words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                env=self._environment,
            )  # fmt: skip
            assert self._child.stdout is not None
            for line in self._child.stdout:
                word, _, value = line.rstrip("\n").partition(" ")
                if word == "file":
                    self.curves = None
                    self.curves = self._curves_of(value)
                    self._tell(self._refused(value))
                else:
                    self.waiting = float(value)
            self.waiting = None
            self._child.wait()
            time.sleep(AGAIN)

    def _tell(self, text: str) -> None:
        """One line on the operator's screen, unless it is empty."""
        if text and self._child is not None and self._child.stdin is not None:
            with suppress(OSError):  # it has ended
                self._child.stdin.write(" ".join(text.split()) + "\n")
                self._child.stdin.flush()

    def stop(self) -> None:
        """End the child."""
        self._ends = True
        if self._child is not None:
            self._child.kill()
            self._child.wait()


def warm_up(mill: Mill, period: float = 1e-3) -> None:
    """Make the first calls of everything, which take seconds, before motion needs them."""
    n = len(mill.axes)
    joints = None if mill.moved is None else mill.moved.with_lengths({})
    points = np.zeros((40, n))
    points[:, 0] = np.linspace(0.0, 3.0, 40)
    points[:, 1:] = 0.1 * np.sin(points[:, :1])
    lines = [NurbsCurve.bezier(points[k : k + 2]) for k in range(len(points) - 1)]
    far = points[-1] + np.arange(1, n + 1) * 9.0
    for tolerance in (0.01, 0.0):
        curves = [*lines, NurbsCurve.bezier([points[-1], far])]
        count = len(curves)
        path = Path(curves, mill.axes, feeds=[50.0] * count, tolerances=[tolerance] * count)
        smoother = Smoother("program", mill.axes, corners="round", window=20)
        look = LookAhead(mill.limits(0.05), period, mill.axes, 40, joints=joints)
        track = PlannedTrack(0, joints)
        track.push(np.ones(count))
        for each in [*smoother.push(path), *smoother.finish()]:
            track.add(each, np.zeros(len(each.curves), dtype=np.int64))
            look.take(each)
        for block in look.blocks(whole=True):
            quintics(track, track.place(block.curve, block.offset), block.law)


def _refused(file: str, mill: Mill, say: Callable[[str], None]) -> str:
    text = refused(file, mill, say)
    if text:
        say(text)
    return text


def serve(
    mill: Mill, reserve: float, python: str, say: Callable[[str], None], ends: Callable[[], bool], **how: Any
) -> None:
    """Plan for every LinuxCNC that comes, one after the other, until `ends`."""
    waiting = False
    while not ends():
        ident = wires.found()
        wire = None if ident is None else wires.attached(ident)
        if wire is None:
            if not waiting:
                say("ready: start LinuxCNC")
            waiting = True
            time.sleep(0.05)
            continue
        task = TaskWatch(
            python, wires.home(wire.ident), lambda file: ProgramCurves(file, mill, say),
            lambda file: _refused(file, mill, say),
        )  # fmt: skip
        planner = Planner(
            wire, mill, reserve, say=say, waits=lambda task=task: task.waiting,  # type: ignore[misc]
            curves=lambda task=task: task.curves, **how,  # type: ignore[misc]
        )  # fmt: skip
        heart = Heart(planner)
        say("LinuxCNC is here")
        try:
            looked = time.monotonic()
            while planner.there and not ends():
                if not planner.step():
                    time.sleep(0.001)
                if time.monotonic() - looked > 0.5:
                    looked = time.monotonic()
                    if wires.users(wire.ident) < 2:  # we alone
                        break
        finally:
            heart.stop()
            task.stop()
            wires.detach(wire)
        waiting = False
        say("LinuxCNC has ended")
