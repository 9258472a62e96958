"""Rows into the FIFO of a running LinuxCNC HAL, by a child process in LinuxCNC's own Python."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import threading
import time
from array import array
from contextlib import suppress
from dataclasses import replace
from importlib.resources import files
from typing import NoReturn

import numpy as np

from splinefeed.errors import SplinefeedError
from splinefeed.formats.metadata import to_radians
from splinefeed.live.hal_files import sampler_cfg
from splinefeed.live.sink import Rows, Taken, starting_rows
from splinefeed.records import ROTARY_AXES, Array

#: The Python that has LinuxCNC's `hal` module on Debian.
PYTHON = "/usr/bin/python3"
#: How long the child may take to begin, s.
PATIENCE = 20.0


class LinuxcncError(SplinefeedError):
    """LinuxCNC is not installed, or its HAL is not running."""


def as_nobody() -> tuple[str, ...]:
    """The prefix of a HAL command: HAL refuses to run as root, so root becomes `nobody`."""
    if os.geteuid() != 0:
        return ()
    return ("setpriv", "--reuid=nobody", "--regid=nogroup", "--clear-groups")


def installed() -> bool:
    """Whether LinuxCNC's HAL is installed."""
    return shutil.which("halcmd") is not None and os.path.exists(PYTHON)


class LinuxcncSink:
    """Plays into HAL; the signals are those of `hal_text`.

    ahead   rows that are in the FIFO before it starts and that are kept there
    record  whether to keep what HAL sampled at every tick: `samples` (n, columns) then has rows of sample number, row,
            rows in the FIFO, commands, positions, underruns, with rotary axes in degrees
    settle  s of samples after the last row
    """

    paced = True

    def __init__(self, ahead: int, *, record: bool = False, settle: float = 0.0, home: str | None = None) -> None:
        if not installed():
            raise LinuxcncError("LinuxCNC is not installed here: on Debian, apt-get install linuxcnc-uspace")
        self._ahead, self._record, self._settle, self._home = ahead, record, settle, home
        self._child: subprocess.Popen[bytes] | None = None
        self._taken = Taken(0)
        self._written = 0
        self._done = False
        self._ready = threading.Event()
        self._position: list[float] = []
        self._said: list[str] = []
        self._threads: list[threading.Thread] = []
        self._stopped: str | None = None
        self._dry = self._restarts = 0  # how often it ran dry, and was restarted
        self._axes: tuple[str, ...] = ()
        self._samples = array("d")

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        """Start the child; where the axes are."""
        self._axes, count = axes, len(axes)
        nets = [f"{name} splinefeed.{name}" for name in ("run", "end", "allowed", "underruns", "last", "ok")]
        nets += ["row splinefeed.taken"]
        nets += [f"{name}-{k} splinefeed.{name}-{k}" for name in ("command", "position") for k in range(count)]
        given = {
            "axes": count,
            "rows": starting_rows(self._ahead),
            "nets": "".join(f"net spf-{each}\n" for each in nets),
            "sampler": sampler_cfg(count) if self._record else None,
            "settle": self._settle,
            "period": period,
        }
        program = files("splinefeed.live").joinpath("hal_player.py").read_text(encoding="utf-8")
        # handed over as text: the user who may talk to HAL need not be one who may read this folder
        command = [*as_nobody(), PYTHON, "-c", program, json.dumps(given)]
        environment = {**os.environ, **({"HOME": self._home} if self._home else {})}
        self._child = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=environment,
            cwd="/",
            start_new_session=True,  # Ctrl-C is for us: the child continues to the last row
        )
        self._threads = [threading.Thread(target=each, daemon=True) for each in (self._listen, self._hear)]
        for thread in self._threads:
            thread.start()
        if not self._ready.wait(PATIENCE) or not self._position:
            self._end()
            said = self._said[-1] if self._said else "it gives no reason"
            raise LinuxcncError(f"HAL does not answer: {said}; start it first, see splinefeed linuxcnc init")
        at: Array = to_radians(np.array([self._position]), axes)[0]
        return at

    def _listen(self) -> None:
        child = self._child
        assert child is not None
        assert child.stdout is not None
        for line in child.stdout:
            said = json.loads(line)
            if "ready" in said:
                self._position = said["position"]
                self._ready.set()
            elif "samples" in said:
                for row in said["samples"]:
                    self._samples.extend(row)
            else:
                # it is no longer dry once the restart is sent, not once it is confirmed
                dry = said["dry"] > self._restarts
                self._dry = max(self._dry, said["dry"])
                self._taken = Taken(said["taken"], said["underruns"], said["override"], dry)
                self._done, self._stopped = said.get("done", False), said.get("stopped")
        child.stdout.close()
        self._ready.set()

    def _hear(self) -> None:
        child = self._child
        assert child is not None
        assert child.stderr is not None
        for line in child.stderr:
            if line.strip():
                self._said = [*self._said[-20:], line.decode(errors="replace").strip()]
        child.stderr.close()

    def write(self, rows: Rows) -> None:
        """Hand the rows to the child."""
        assert self._child is not None
        assert self._child.stdin is not None
        try:
            self._child.stdin.write(rows.text().encode("ascii"))
            self._child.stdin.flush()
        except BrokenPipeError:
            self._raise_why()
        self._written = rows.first + len(rows) - 1

    def taken(self) -> Taken:
        """What HAL reported last."""
        return self._taken

    def depth(self) -> int:
        """Rows on their way, in the FIFO and before it."""
        if self._stopped is not None or (self._child is not None and self._child.poll() is not None):
            self._raise_why()
        return self._written - self._taken.row

    def _raise_why(self) -> NoReturn:
        """LinuxcncError with why no more rows are taken."""
        for thread in self._threads:
            thread.join(0.5)
        where = f"after row {self._taken.row}"
        if self._stopped is not None:
            axis, away = self._stopped.split()
            name = self._axes[int(axis)]
            unit = "deg" if name in ROTARY_AXES else "mm"
            raise LinuxcncError(
                f"{name} does not follow: it is {away} {unit} from its commanded position; HAL was stopped {where} and "
                "holds it"
            )
        said = self._said[-1] if self._said else "its reason is not known"
        raise LinuxcncError(f"HAL stopped taking rows {where}, of {self._written} that were sent: {said}")

    def restart(self) -> None:
        """Tell the child that rows come again."""
        child = self._child
        assert child is not None
        assert child.stdin is not None
        self._restarts = self._dry
        self._written = self._taken.row
        self._taken = replace(self._taken, dry=False)
        try:
            child.stdin.write(b"# restart\n")
            child.stdin.flush()
        except BrokenPipeError:
            self._raise_why()

    @property
    def samples(self) -> Array:
        """What HAL sampled, if it was to be kept."""
        return np.array(self._samples).reshape(-1, 2 * len(self._axes) + 4)

    def close(self) -> Taken:
        """Wait for the last row; LinuxcncError if it was never taken."""
        child = self._child
        if child is None:
            return self._taken
        assert child.stdin is not None
        with suppress(OSError):
            child.stdin.close()
        while child.poll() is None:
            time.sleep(0.02)
        self._end()
        if not self._done:
            self._raise_why()
        return self._taken

    def abandon(self) -> None:
        """End the child; HAL holds the last row that it took."""
        self._end()

    def _end(self) -> None:
        child = self._child
        if child is None:
            return
        with suppress(OSError):
            assert child.stdin is not None
            child.stdin.close()
        if child.poll() is None:
            child.terminate()
            child.wait(5.0)
        for thread in self._threads:
            thread.join(5.0)
