"""Rows into the FIFO of a running LinuxCNC HAL, by a child process in LinuxCNC's own Python."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import threading
from array import array
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from importlib.resources import files
from typing import Any, NoReturn

import numpy as np

from splinefeed.errors import InputError, SplinefeedError
from splinefeed.files.metadata import to_radians
from splinefeed.live.hal_files import sampler_cfg
from splinefeed.live.sinks import SetpointRows, Sink, Taken, starting_rows
from splinefeed.records import ROTARY_AXES, Array, Response

#: The Python that has LinuxCNC's `hal` module on Debian.
PYTHON = "/usr/bin/python3"
#: How long the child may take to begin, and to end after its input has ended too early, s.
PATIENCE, LAST_WORDS = 20.0, 5.0


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


class LinuxcncSink(Sink):
    """A sink that plays into HAL; the signals are those of `hal_text`.

    Parameters
    ----------
    ahead : int
        Rows that are in the FIFO before it starts and that are kept there.
    record : bool, optional
        Whether to keep what HAL sampled at every tick: `samples` (n, columns) then has rows of sample number, row, rows
        in the FIFO, commands, positions, underruns, with rotary axes in degrees.
    settle : float, optional
        Time of samples after the last row, s.
    home : str, optional
        Home folder of the user who runs HAL.

    Raises
    ------
    LinuxcncError
        Where LinuxCNC is not installed, by `open` where HAL does not answer, and where it stops taking rows.
    """

    paced = True
    feedback = True

    def __init__(self, ahead: int, *, record: bool = False, settle: float = 0.0, home: str | None = None) -> None:
        if not installed():
            raise LinuxcncError("LinuxCNC is not installed here: on Debian, apt-get install linuxcnc-uspace")
        self._ahead, self._record, self._settle, self._home = ahead, record, settle, home
        self._child: subprocess.Popen[str] | None = None
        self._taken = Taken(0)
        self._ended: dict[str, Any] = {}
        self._complaint = "it gives no reason"  # the last line that is no report
        self._ready = threading.Event()
        self._position: list[float] = []
        self._dry = self._restarts = 0  # how often it ran dry, and was restarted
        self._samples = array("d")

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        """Start the child; where the axes are."""
        self._axes, self._period, count = axes, period, len(axes)
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
        self._child = subprocess.Popen(
            [*as_nobody(), PYTHON, "-c", program, json.dumps(given)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            env={**os.environ, **({"HOME": self._home} if self._home else {})},
            cwd="/",
            start_new_session=True,  # Ctrl-C is for us: the child continues to the last row
        )
        self._input: Any = self._child.stdin
        self._listener = threading.Thread(target=self._listen, args=(self._child.stdout,), daemon=True)
        self._listener.start()
        if not self._ready.wait(PATIENCE) or not self._position:
            self.abandon()
            raise LinuxcncError(f"HAL does not answer: {self._complaint}; start it first, see splinefeed linuxcnc init")
        at: Array = to_radians(np.array([self._position]), axes)[0]
        return at

    def _listen(self, output: Any) -> None:
        with output as lines:
            for line in lines:
                try:
                    said = json.loads(line)
                except ValueError:
                    self._complaint = line.strip() or self._complaint
                    continue
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
                    self._ended = said if "done" in said else {}
        self._ready.set()

    def _send(self, text: str) -> None:
        try:
            self._input.write(text)
            self._input.flush()
        except BrokenPipeError:
            self._raise_why()

    def write(self, rows: SetpointRows) -> None:
        """Hand the rows to the child."""
        self._send(rows.text())
        super().write(rows)

    def taken(self) -> Taken:
        """What HAL reported last."""
        return self._taken

    def depth(self) -> int:
        """Rows on their way, in the FIFO and before it."""
        if self._ended.get("stopped") or (self._child is not None and self._child.poll() is not None):
            self._raise_why()
        return super().depth()

    def _raise_why(self) -> NoReturn:
        """LinuxcncError with why no more rows are taken."""
        self._listener.join(0.5)
        where = f"after row {self._taken.row}"
        if stopped := self._ended.get("stopped"):
            axis, away = stopped.split()
            name = self._axes[int(axis)]
            unit = "deg" if name in ROTARY_AXES else "mm"
            raise LinuxcncError(
                f"{name} does not follow: it is {away} {unit} from its commanded position; HAL was stopped {where} and "
                "holds it"
            )
        raise LinuxcncError(f"HAL stopped taking rows {where}, of {self._row} that were sent: {self._complaint}")

    def restart(self) -> None:
        """Tell the child that rows come again."""
        super().restart()
        self._restarts = self._dry
        self._taken = replace(self._taken, dry=False)
        self._send("# restart\n")

    @property
    def samples(self) -> Array:
        """What HAL sampled, if it was to be kept."""
        return np.array(self._samples).reshape(-1, 2 * len(self._axes) + 4)

    def response(self, settings: Mapping[str, Any]) -> Response:
        """Give what HAL sampled at its servo ticks, from the last one before the stream's first row on.

        Parameters
        ----------
        settings : mapping of str to object
            Of the setpoints.

        Returns
        -------
        Response
            Positions (n, axes) are the measured ones, mm and rad; the control output is unknown, 0.

        Raises
        ------
        InputError
            Where no row was taken.
        """
        samples = self.samples
        row = samples[:, 1].astype(np.int64)
        changes = np.flatnonzero(np.diff(row))
        if not len(changes):
            raise InputError("nothing was recorded: the controller took no row")
        first, count = int(changes[0]), len(self._axes)
        kept = samples[first:]
        command, measured = (to_radians(kept[:, k : k + count], self._axes) for k in (3, 3 + count))
        lost = int(np.sum(np.diff(kept[:, 0]) - 1.0))
        return Response(
            t=(kept[:, 0] - kept[0, 0]) * self._period,
            command=command,
            position=measured,
            measured=measured,
            output=np.zeros(command.shape),
            saturated=np.zeros(command.shape, dtype=np.bool_),
            axes=self._axes,
            period=self._period,
            row=np.maximum(row[first:] - (row[first + 1] - 1), 0) * (np.arange(len(kept)) > 0),
            depth=kept[:, 2].astype(np.int64),
            underruns=(kept[:, -1] - kept[0, -1]).astype(np.int64),
            settings={**settings, "samples_lost": lost, "output": "not recorded"},
        )

    def close(self) -> Taken:
        """Wait for the last row; LinuxcncError if it was never taken."""
        with suppress(OSError):
            self._input.close()
        if self._child is not None:
            self._child.wait()
        self.abandon()
        if not self._ended.get("done"):
            self._raise_why()
        return self._taken

    def abandon(self) -> None:
        """End the child; HAL holds the last row that it took."""
        if self._child is None:
            return
        with suppress(OSError):
            self._input.close()
        if self._child.poll() is None:
            self._child.terminate()
            self._child.wait(LAST_WORDS)
        self._listener.join(LAST_WORDS)
