"""LinuxCNC's own planner, headless: a program goes in, every joint's command at each servo tick comes out.

`recorded(program, velocity, acceleration)` runs all of LinuxCNC (uspace, no real-time kernel, no screen) on a simulated
XYZ mill whose axes have these limits, and gives what HAL's sampler saw. LinuxCNC 2.9 has no limit of jerk.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.hal_session import alone
from splinefeed.live.linuxcnc_sink import LinuxcncError, as_nobody, installed

#: Servo period, s; how far the axes may travel to either side, mm; what LinuxCNC may take to start and end, s.
PERIOD, TRAVEL, AROUND = 1e-3, 1e4, 60.0
AXES = ("x", "y", "z")
#: What HAL samples at every tick: x, y, z, feed, line of the program.
SAMPLED = "ffffs"
DISPLAY = Path(__file__).with_name("linuxcnc_display.py")

HAL = """\
loadrt trivkins
loadrt motmod servo_period_nsec={nanoseconds} num_joints=3
loadrt sampler depth=20000 cfg={sampled}
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf sampler.0 servo-thread
setp sampler.0.enable 0
net x joint.0.motor-pos-cmd joint.0.motor-pos-fb sampler.0.pin.0
net y joint.1.motor-pos-cmd joint.1.motor-pos-fb sampler.0.pin.1
net z joint.2.motor-pos-cmd joint.2.motor-pos-fb sampler.0.pin.2
net feed motion.current-vel sampler.0.pin.3
net line motion.program-line sampler.0.pin.4
net safe iocontrol.0.user-enable-out iocontrol.0.emc-enable-in
net prepare iocontrol.0.tool-prepare iocontrol.0.tool-prepared
net change iocontrol.0.tool-change iocontrol.0.tool-changed
"""

INI = """\
[EMC]
VERSION = 1.1
MACHINE = splinefeed-bench
[DISPLAY]
DISPLAY = {folder}/display.py {folder}/job.ngc {folder}/out {sampled} {seconds}
[TASK]
TASK = milltask
CYCLE_TIME = 0.001
[RS274NGC]
PARAMETER_FILE = mill.var
[EMCMOT]
EMCMOT = motmod
COMM_TIMEOUT = 1.0
SERVO_PERIOD = {nanoseconds}
[EMCIO]
EMCIO = io
CYCLE_TIME = 0.1
TOOL_TABLE = mill.tbl
[HAL]
HALFILE = mill.hal
[TRAJ]
COORDINATES = X Y Z
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
DEFAULT_LINEAR_VELOCITY = {velocity}
MAX_LINEAR_VELOCITY = {velocity}
DEFAULT_LINEAR_ACCELERATION = {acceleration}
MAX_LINEAR_ACCELERATION = {acceleration}
NO_FORCE_HOMING = 1
[KINS]
KINEMATICS = trivkins
JOINTS = 3
"""

# a joint that is homed where it stands: no search, no latch
JOINT = """\
[AXIS_{letter}]
MAX_VELOCITY = {velocity}
MAX_ACCELERATION = {acceleration}
MIN_LIMIT = -{travel}
MAX_LIMIT = {travel}
[JOINT_{number}]
TYPE = LINEAR
MAX_VELOCITY = {velocity}
MAX_ACCELERATION = {acceleration}
MIN_LIMIT = -{travel}
MAX_LIMIT = {travel}
FERROR = 5
MIN_FERROR = 5
HOME = 0
HOME_OFFSET = 0
HOME_SEARCH_VEL = 0
HOME_LATCH_VEL = 0
HOME_SEQUENCE = 0
"""


@dataclass(frozen=True, eq=False)
class Recording:
    """What LinuxCNC commanded, one row a servo tick, from before the program to after it.

    position  (n, 3) mm; feed  (n,) mm/s, as LinuxCNC says; line  (n,) of the program, from 1; period  s
    wall_s    how long the program ran; version  of LinuxCNC
    """

    position: NDArray[np.float64]
    feed: NDArray[np.float64]
    line: NDArray[np.int64]
    period: float
    wall_s: float
    version: str

    def moving(self, first_line: int = 0) -> NDArray[np.float64]:
        """The rows from the last at rest before anything moves in `first_line` or behind it, to the first at rest."""
        begin = int(np.argmax(self.line >= first_line)) if first_line else 0
        moves = np.flatnonzero(np.any(np.diff(self.position[max(begin - 1, 0) :], axis=0) != 0.0, axis=1))
        if not len(moves):
            return self.position[:0]
        begin = max(begin - 1, 0)
        return self.position[begin + moves[0] : begin + moves[-1] + 2]


def recorded(program: str, velocity: float, acceleration: float, seconds: float = 600.0) -> Recording:
    """Run a G-code program (its text) under one velocity, mm/s, and one acceleration, mm/s^2, of path and of each axis.

    seconds  the most that the program may take. One LinuxCNC runs at a time; others wait for it.
    Raises LinuxcncError where LinuxCNC is not installed, does not start, complains, or misses a sample.
    """
    if not installed() or shutil.which("linuxcnc") is None:
        raise LinuxcncError("LinuxCNC is not installed here: on Debian, apt-get install linuxcnc-uspace")
    values = {"velocity": velocity, "acceleration": acceleration, "nanoseconds": round(PERIOD * 1e9)}
    with alone(), tempfile.TemporaryDirectory(prefix="splinefeed-linuxcnc-") as name:
        folder = Path(name)
        joints = "".join(
            JOINT.format(number=k, letter=axis.upper(), travel=TRAVEL, **values) for k, axis in enumerate(AXES)
        )
        files = {
            "job.ngc": program,
            "mill.hal": HAL.format(sampled=SAMPLED, **values),
            "mill.ini": INI.format(folder=folder, seconds=seconds, sampled=SAMPLED, **values) + joints,
            "mill.tbl": "T1 P1 D1\n",
        }
        return _run(folder, files, seconds)


def _run(folder: Path, files: dict[str, str], seconds: float) -> Recording:
    for file, text in files.items():
        (folder / file).write_text(text, encoding="utf-8")
    shutil.copy(DISPLAY, folder / "display.py")
    (folder / "display.py").chmod(0o755)
    folder.chmod(0o755)
    if as_nobody():
        for each in (folder, *folder.iterdir()):
            shutil.chown(each, "nobody", "nogroup")
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    with open(folder / "said.txt", "w+", encoding="utf-8", errors="replace") as said:
        child = subprocess.Popen(
            [*as_nobody(), "linuxcnc", str(folder / "mill.ini")],
            env={**environment, "HOME": str(folder)},
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # so that all of it can be ended
        )
        try:
            child.wait(seconds + AROUND)
        except BaseException as error:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()
            if isinstance(error, subprocess.TimeoutExpired):
                raise LinuxcncError(f"LinuxCNC has not ended after {seconds + AROUND:g} s") from None
            raise
        said.seek(0)
        lines = [line.strip() for line in said if line.strip()]
    if not (folder / "out.json").exists():
        raise LinuxcncError(f"LinuxCNC recorded nothing; it said: {'; '.join(lines[-5:])}")
    told = json.loads((folder / "out.json").read_text(encoding="utf-8"))
    if told["said"]:
        raise LinuxcncError(f"LinuxCNC complained: {'; '.join(told['said'])}")
    if told["lost"]:
        raise LinuxcncError(f"{told['lost']} samples were lost: the machine is too busy")
    rows = np.fromfile(folder / "out.f64").reshape(-1, len(SAMPLED))
    return Recording(
        np.ascontiguousarray(rows[:, :3]),
        rows[:, 3].copy(),
        rows[:, 4].astype(np.int64),
        PERIOD,
        told["wall_s"],
        told["version"],
    )
