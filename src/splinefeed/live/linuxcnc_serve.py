"""The planner process: it waits for a LinuxCNC, plans for it until it ends, and waits for the next."""

from __future__ import annotations

import math
import os
import subprocess
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib.resources import files
from typing import NoReturn

import numpy as np

from splinefeed.live import linuxcnc_wire as wires
from splinefeed.live.linuxcnc_curves import ProgramCurves
from splinefeed.live.linuxcnc_limits import Mill
from splinefeed.live.linuxcnc_motion import PlannedMotion
from splinefeed.live.linuxcnc_moves import BLEND, EXACT, curve_of
from splinefeed.live.linuxcnc_pieces import quintics
from splinefeed.live.linuxcnc_planner import WINDOW, Planner
from splinefeed.live.linuxcnc_refusals import refused
from splinefeed.live.linuxcnc_sink import PYTHON
from splinefeed.planner.stream import LookAhead

#: A child that watches LinuxCNC's task is started again after this, s.
AGAIN = 0.2
#: The main loop is taken for dead after this, s.
DEAD = 8.0


def beat(planner: Planner, ends: threading.Event) -> None:
    """Beat for a planner, from a thread of its own, while its main loop lives."""
    while not ends.wait(0.02):
        if planner.clock() - planner.alive < DEAD:
            planner.wire.store("beat", int(planner.wire.beat) + 1)


class TaskWatch:
    """A child in LinuxCNC's Python that watches its task: whether it waits for motion to end, and what it has loaded.

    Parameters
    ----------
    home : str or None
        Home folder of the LinuxCNC.
    mill : Mill
        What runs the program.
    say : callable
        Takes what of the program will not run, which is said on the operator's screen, too.

    Attributes
    ----------
    curves : ProgramCurves or None
        Of the program that is loaded.
    waiting : float or None
        Since when the task waits, s by the monotonic clock; inf while it goes on, None where nobody knows.
    """

    def __init__(self, home: str | None, mill: Mill, say: Callable[[str], None]) -> None:
        self.curves: ProgramCurves | None = None
        self.waiting: float | None = None  # since when, by the monotonic clock; inf while it goes on
        self._mill, self._say = mill, say
        program = files("splinefeed.live").joinpath("linuxcnc_task.py").read_text(encoding="utf-8")
        self._words = [PYTHON, "-c", program]
        self._environment = os.environ if home is None else {**os.environ, "HOME": home}
        self._child: subprocess.Popen[str] | None = None
        self._ends = not os.path.exists(PYTHON)
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
                    self.curves = ProgramCurves(value, self._mill, self._say)
                    self._tell(refused(value, self._mill, self._say))
                else:
                    self.waiting = float(value)
            self.waiting = None
            self._child.wait()
            time.sleep(AGAIN)

    def _tell(self, text: str) -> None:
        """One line to all, unless it is empty."""
        if text:
            self._say(text)
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


def warm_up(mill: Mill) -> None:
    """Make the first calls of everything, which take seconds, before motion needs them: short lines and a long one.

    Parameters
    ----------
    mill : Mill
        The machine.
    """
    joints = None if mill.moved is None else mill.moved.with_lengths({})
    places = np.zeros((41, wires.AXES))
    places[:40, mill.columns] = 0.1 * np.sin(np.linspace(0.0, 3.0, 40))[:, None]
    places[:40, mill.columns[0]] = np.linspace(0.0, 3.0, 40)
    places[40, mill.columns] = places[39, mill.columns] + 9.0 * np.arange(1, len(mill.axes) + 1)
    moves = np.zeros(40, wires.SEGMENT)
    moves["from"], moves["to"] = places[:-1] / mill.units, places[1:] / mill.units
    moves["kind"], moves["feed"], moves["top"], moves["tolerance"] = wires.LINE, 50.0, 1e3, 0.01
    curves = [curve_of(move, mill) for move in moves]

    look_ahead = partial(LookAhead, mill.limits(0.05), 1e-3, mill.axes, WINDOW, joints=joints)
    for term in (BLEND, EXACT):
        moves["term"] = term
        run = PlannedMotion(0, mill, look_ahead, (1.0, 1.0, math.inf), joints)
        run.push(moves, curves)
        run.close()
        while (block := run.block()) is not None:
            quintics(run.track, run.track.place(run.base + block.curve, block.offset), block.law)


def serve(mill: Mill, reserve: float, window: int, say: Callable[[str], None]) -> NoReturn:
    """Plan for every LinuxCNC that comes, one after the other.

    Parameters
    ----------
    mill : Mill
        The machine.
    reserve : float
        Share of the acceleration that is kept for pause and override.
    window : int
        Cells that are planned at a time.
    say : callable
        Takes each message.

    Raises
    ------
    WireError
        Where another program, another version, or another user has the shared memory.
    """
    waiting = False
    while True:
        ident = wires.found()
        wire = None if ident is None else wires.attached(ident)
        if wire is None:
            if not waiting:
                say("ready: start LinuxCNC")
            waiting = True
            time.sleep(0.05)
            continue
        _plan_for(wire, mill, reserve, window, say)
        waiting = False
        say("LinuxCNC has ended")


def _plan_for(wire: wires.Wire, mill: Mill, reserve: float, window: int, say: Callable[[str], None]) -> None:
    """Plan for one LinuxCNC until it ends."""
    task = TaskWatch(wires.home(wire.ident), mill, say)
    planner = Planner(
        wire, mill, reserve, window=window, say=say, waits=lambda: task.waiting, curves=lambda: task.curves
    )
    dies = threading.Event()
    heart = threading.Thread(target=beat, args=(planner, dies), daemon=True)
    heart.start()
    say("LinuxCNC is here")
    try:
        looked = time.monotonic()
        while planner.there:
            if not planner.step():
                time.sleep(0.001)
            if time.monotonic() - looked > 0.5:
                looked = time.monotonic()
                if wires.users(wire.ident) < 2:  # we alone
                    return
    finally:
        dies.set()
        heart.join()  # before the memory goes
        task.stop()
        wires.detach(wire)
