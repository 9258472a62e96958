"""LinuxCNC's own planner, headless: a program goes in, every joint's command at each servo tick comes out.

`recorded(program, machine)` runs all of LinuxCNC (uspace, no real-time kernel, no screen) on a simulated machine whose
axes have these limits, and gives what HAL's sampler saw. LinuxCNC 2.9 has no limit of jerk. A machine with one is
planned by splinefeed: the module of linuxcnc/ in place of LinuxCNC's own, and the planner process beside it.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.hal_session import alone
from splinefeed.live.linuxcnc_sink import LinuxcncError, as_nobody, installed

#: Servo period, s; how far the axes may travel to either side, mm or deg; what LinuxCNC may take to start and end, s.
PERIOD, TRAVEL, AROUND = 1e-3, 1e4, 60.0
#: What the planner process says when it is ready: without LinuxCNC, and beside one that runs.
READY = b"ready: start", b"LinuxCNC is here"
DISPLAY = Path(__file__).with_name("linuxcnc_display.py")
#: The planner module, and where LinuxCNC looks for it.
MODULE = Path(__file__).parents[1] / "linuxcnc" / "splinefeed_tp.c"
MODULES = Path("/usr/lib/linuxcnc/modules")

HAL = """\
loadrt {kinematics}
loadrt motmod servo_period_nsec={nanoseconds} num_joints={count}
loadrt sampler depth=20000 cfg={sampled}
addf motion-command-handler servo-thread
addf motion-controller servo-thread
{spindle}addf sampler.0 servo-thread
setp sampler.0.enable 0
{joints}
net feed motion.current-vel sampler.0.pin.{count}
net line motion.program-line sampler.0.pin.{last}
net turns spindle.0.speed-out-rps-abs spindle.0.speed-in
net safe iocontrol.0.user-enable-out iocontrol.0.emc-enable-in
net prepare iocontrol.0.tool-prepare iocontrol.0.tool-prepared
net change iocontrol.0.tool-change iocontrol.0.tool-changed
"""

# a spindle that takes its time to change its speed, 40 turns a second squared, with an encoder and its index
SPINDLE = """\
loadrt limit2 names=inertia
loadrt sim_spindle names=encoder
setp inertia.maxv 40
net asked spindle.0.speed-out-rps inertia.in
net turning inertia.out encoder.velocity-cmd
net angle encoder.position-fb spindle.0.revs sampler.0.pin.{pin}
net index encoder.index-enable spindle.0.index-enable
addf inertia servo-thread
addf encoder servo-thread
"""

INI = """\
[EMC]
VERSION = 1.1
MACHINE = splinefeed-bench
[DISPLAY]
DISPLAY = {folder}/display.py {folder}/job.ngc {folder}/out {sampled} {seconds}
MAX_FEED_OVERRIDE = 2.0
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
{module}COORDINATES = {letters}
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
DEFAULT_LINEAR_VELOCITY = {velocity}
MAX_LINEAR_VELOCITY = {velocity}
DEFAULT_LINEAR_ACCELERATION = {acceleration}
MAX_LINEAR_ACCELERATION = {acceleration}
NO_FORCE_HOMING = 1
[KINS]
KINEMATICS = {kinematics}
JOINTS = {count}
"""

# a joint that is homed where it stands: no search, no latch
JOINT = """\
[AXIS_{letter}]
MAX_VELOCITY = {velocity}
MAX_ACCELERATION = {acceleration}
MIN_LIMIT = -{travel}
MAX_LIMIT = {travel}
[JOINT_{number}]
TYPE = {kind}
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


@dataclass(frozen=True)
class Mill:
    """A simulated machine: LinuxCNC's name of its kinematics, its axes, and their limits, mm or deg, and s.

    velocity, acceleration  of each axis; those of the path are those of the first one
    jerk  of each axis; where it is given, splinefeed plans, and its nanoseconds a tick are sampled behind all else
    spindle  it has one with an encoder, whose angle is sampled behind that
    offsets  share of the velocity and acceleration of each axis that LinuxCNC keeps for external offsets
    hal      lines of HAL, such as those that set the lengths of the kinematics
    tools    lines of its tool table
    """

    velocity: tuple[float, ...]
    acceleration: tuple[float, ...]
    axes: str = "xyz"
    kinematics: str = "trivkins"
    jerk: tuple[float, ...] = ()
    spindle: bool = False
    offsets: tuple[float, ...] = ()
    hal: str = ""
    tools: str = "T1 P1 D1\n"

    @property
    def sampled(self) -> str:
        """What HAL samples at every tick: each joint, feed, line of the program."""
        return "f" * len(self.axes) + "fs" + "u" * bool(self.jerk) + "f" * self.spindle

    def files(self, program: str, folder: Path, seconds: float, actions: str = "") -> dict[str, str]:
        """The files of its configuration by name; actions as linuxcnc_display.py takes them."""
        count = len(self.axes)
        values = {
            "kinematics": self.kinematics,
            "count": count,
            "last": count + 1,
            "nanoseconds": round(PERIOD * 1e9),
            "sampled": self.sampled,
            "velocity": self.velocity[0],
            "acceleration": self.acceleration[0],
            "letters": " ".join(self.axes.upper()),
            "spindle": SPINDLE.format(pin=count + 2 + bool(self.jerk)) if self.spindle else "",
        }
        joints = "".join(
            JOINT.format(
                number=k,
                letter=axis.upper(),
                travel=TRAVEL,
                kind="ANGULAR" if axis in "abc" else "LINEAR",
                velocity=self.velocity[k],
                acceleration=self.acceleration[k],
            )
            for k, axis in enumerate(self.axes)
        )
        nets = "\n".join(
            f"net {axis} joint.{k}.motor-pos-cmd joint.{k}.motor-pos-fb sampler.0.pin.{k}"
            for k, axis in enumerate(self.axes)
        )
        if self.jerk:
            nets += f"\nnet spent splinefeed-tp.ns sampler.0.pin.{count + 2}"
        for key, given in (("MAX_JERK", self.jerk), ("OFFSET_AV_RATIO", self.offsets)):
            for axis, value in zip(self.axes.upper(), given, strict=bool(given)):
                joints = joints.replace(f"[AXIS_{axis}]\n", f"[AXIS_{axis}]\n{key} = {value}\n")
        for k, jerk in enumerate(self.jerk):
            joints = joints.replace(f"[JOINT_{k}]\n", f"[JOINT_{k}]\nMAX_JERK = {jerk}\n")
        return {
            "job.ngc": program,
            "mill.hal": HAL.format(joints=nets, **values) + self.hal,
            "mill.ini": INI.format(
                folder=folder, seconds=seconds, module="TPMOD = splinefeed_tp\n" * bool(self.jerk), **values
            )
            + joints,
            "mill.tbl": self.tools,
        }


def mill(velocity: float, acceleration: float, jerk: float | None = None) -> Mill:
    """A simulated XYZ mill with one velocity, mm/s, acceleration and jerk of path and of each axis."""
    return Mill((velocity,) * 3, (acceleration,) * 3, jerk=() if jerk is None else (jerk,) * 3)


def module_missing() -> str:
    """Why splinefeed's planner module cannot be used here, with the mend; builds and installs it where it can."""
    if not installed() or shutil.which("linuxcnc") is None:
        return "no LinuxCNC; on Debian 12: apt-get install linuxcnc-uspace linuxcnc-uspace-dev"
    target = MODULES / "splinefeed_tp.so"
    sources = [*MODULE.parent.glob("*.c"), *MODULE.parent.glob("*.h")]
    if target.exists() and target.stat().st_mtime > max(source.stat().st_mtime for source in sources):
        return ""
    if shutil.which("halcompile") is None:
        return "no halcompile; on Debian 12: apt-get install linuxcnc-uspace-dev"
    if not os.access(MODULES, os.W_OK):
        return (
            f"{target} is not there or older than its source; in linuxcnc/: sudo halcompile --install splinefeed_tp.c"
        )
    with tempfile.TemporaryDirectory(prefix="splinefeed-tp-") as name:
        for source in sources:
            shutil.copy(source, name)
        done = subprocess.run(
            ["halcompile", "--compile", MODULE.name],
            cwd=name,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        if done.returncode != 0:
            return f"halcompile: {done.stdout.strip()}"
        made = target.with_suffix(f".{os.getpid()}")  # tests side by side may be at it
        shutil.copy(Path(name) / target.name, made)
        made.replace(target)  # not --install, which writes into the file that a running LinuxCNC has loaded
    return ""


@contextmanager
def planned_by_us(folder: Path, options: tuple[str, ...] = ()) -> Iterator[subprocess.Popen[bytes]]:
    """The planner process of the mill.ini in a folder, warmed up; it is ended behind the block."""
    with open(folder / "planner.txt", "w+b") as said:
        words = [sys.executable, "-m", "splinefeed", "linuxcnc", "planner", "--ini", "mill.ini", *options]
        child = subprocess.Popen(
            words, cwd=folder, stdin=subprocess.DEVNULL, stdout=said, stderr=said,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        )  # fmt: skip
        try:
            end = time.monotonic() + AROUND
            while not any(text in (folder / "planner.txt").read_bytes() for text in READY):
                if child.poll() is not None or time.monotonic() > end:
                    text = (folder / "planner.txt").read_text(encoding="utf-8", errors="replace")
                    raise LinuxcncError(f"the planner does not start: {text.strip()}")
                time.sleep(0.05)
            yield child
        finally:
            child.terminate()
            child.wait()


@dataclass(frozen=True, eq=False)
class Recording:
    """What LinuxCNC commanded, one row a servo tick, from before the program to after it.

    position  (n, axes) of joints, mm or deg; feed  (n,) mm/s, as LinuxCNC says; line  (n,) of the program
    period   s
    wall_s    how long the program ran; version  of LinuxCNC
    spent_ns  (n,) of splinefeed's part of each tick; turns  (n,) angle of the spindle, where it has an encoder
    acted     ticks of the actions and what they were
    """

    position: NDArray[np.float64]
    feed: NDArray[np.float64]
    line: NDArray[np.int64]
    period: float
    wall_s: float
    version: str
    spent_ns: NDArray[np.int64]
    turns: NDArray[np.float64]
    acted: list[tuple[int, str]]
    said: list[str]

    def moving(self, first_line: int = 0) -> NDArray[np.float64]:
        """The rows from the last at rest before anything moves in `first_line` or behind it, to the first at rest."""
        begin = int(np.argmax(self.line >= first_line)) if first_line else 0
        moves = np.flatnonzero(np.any(np.diff(self.position[max(begin - 1, 0) :], axis=0) != 0.0, axis=1))
        if not len(moves):
            return self.position[:0]
        begin = max(begin - 1, 0)
        return self.position[begin + moves[0] : begin + moves[-1] + 2]


def recorded(
    program: str, machine: Mill, seconds: float = 600.0, actions: str = "", *, complains: bool = False,
    options: tuple[str, ...] = (), planner: bool = True,
) -> Recording:  # fmt: skip
    """Run a G-code program (its text) on a machine.

    seconds  the most that the program may take. One LinuxCNC runs at a time; others wait for it.
    actions  what the operator does, as linuxcnc_display.py takes it; options  of the planner, which is there or not
    Raises LinuxcncError where LinuxCNC is not installed, does not start, complains (unless it may), or misses a sample.
    """
    if not installed() or shutil.which("linuxcnc") is None:
        raise LinuxcncError("LinuxCNC is not installed here: on Debian, apt-get install linuxcnc-uspace")
    with alone(), tempfile.TemporaryDirectory(prefix="splinefeed-linuxcnc-") as name:
        folder, files = Path(name), machine.files(program, Path(name), seconds)
        (folder / "mill.ini").write_text(files["mill.ini"], encoding="utf-8")
        files["actions"] = actions
        with planned_by_us(folder, options) if machine.jerk and planner else nullcontext():
            rows, told = session(folder, files, seconds, len(machine.sampled), complains=complains)
        count = len(machine.axes)
        return Recording(
            np.ascontiguousarray(rows[:, :count]),
            rows[:, count].copy(),
            rows[:, count + 1].astype(np.int64),
            PERIOD,
            told["wall_s"],
            told["version"],
            rows[:, count + 2].astype(np.int64) if machine.jerk else np.zeros(0, dtype=np.int64),
            rows[:, -1].copy() if machine.spindle else np.zeros(0),
            [(int(row), str(what)) for row, what in told.get("acted", [])],
            told["said"],
        )


def without_screen(ini: str, hal: str, display: str) -> str:
    """An INI text that LinuxCNC brings, with this HALFILE and display, and without what needs a screen.

    Its first kinematics are those of the machine, as they were before switchkins: LinuxCNC starts on them.
    """
    kept = []
    for line in ini.splitlines():
        name, _, value = (part.strip() for part in line.partition("="))
        if name in ("PYVCP", "OPEN_FILE", "POSTGUI_HALFILE", "INTRO_GRAPHIC") or "loadusr" in value:
            continue
        if value.startswith("net"):  # a signal goes on where the window of the machine is not there to take it
            line = f"HALCMD = {' '.join(word for word in value.split() if '-gui.' not in word)}"
        line = {"DISPLAY": f"DISPLAY = {display}", "HALFILE": f"HALFILE = {hal}"}.get(name, line) if value else line
        kept.append(line.replace(" sparm=identityfirst", ""))
    return "\n".join([*kept, ""])


@contextmanager
def watched(
    machine: Mill, hal: str, seconds: float = 120.0, brought: Path | None = None
) -> Iterator[tuple[str, list[NDArray[np.float64]]]]:
    """Run LinuxCNC with a HALFILE (its text), homed and switched off, while its joints are moved by somebody else.

    brought  INI file that LinuxCNC brings: it runs from a copy of its folder instead of the machine's own files.
    Gives the home folder of its user, and a list that has what the second sampler saw, (n, axes), behind the block.
    """
    if not installed() or shutil.which("linuxcnc") is None:
        raise LinuxcncError("LinuxCNC is not installed here: on Debian, apt-get install linuxcnc-uspace")
    with alone(), tempfile.TemporaryDirectory(prefix="splinefeed-linuxcnc-") as name, ThreadPoolExecutor(1) as pool:
        folder, seen = Path(name), []
        count = len(machine.axes)
        files = {**machine.files("", folder, seconds), "mill.hal": hal}
        files["mill.ini"] = files["mill.ini"].replace(f"{folder}/job.ngc", "-").replace(machine.sampled, "f" * count)
        if brought is not None:
            shutil.copytree(brought.parent, folder, dirs_exist_ok=True)
            display = f"{folder}/display.py - {folder}/out {'f' * count} {seconds}"
            files["mill.ini"] = without_screen(brought.read_text(encoding="utf-8"), "mill.hal", display)
        running = pool.submit(session, folder, files, seconds, count)
        try:
            while not (folder / "out.ready").exists():
                if running.done():
                    running.result()
                time.sleep(0.05)
            yield name, seen
        finally:
            (folder / "out.stop").touch()
            seen.append(running.result()[0])


def end_all(folder: Path) -> None:
    """End what is left of a LinuxCNC whose home is a folder: parts of it leave its process group."""
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if f"HOME={folder}".encode() in (process / "environ").read_bytes().split(b"\0"):
                os.kill(int(process.name), signal.SIGKILL)
        except OSError:  # it has ended, or belongs to somebody else
            continue


def session(
    folder: Path, files: dict[str, str], seconds: float, columns: int, *, complains: bool = False
) -> tuple[NDArray[np.float64], dict[str, Any]]:
    """Run LinuxCNC in a folder with the files of a configuration; what was sampled, (n, columns), and what was told."""
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
        finally:
            end_all(folder)
        said.seek(0)
        lines = [line.strip() for line in said if line.strip()]
    if not (folder / "out.json").exists():
        raise LinuxcncError(f"LinuxCNC recorded nothing; it said: {'; '.join(lines[-5:])}")
    told: dict[str, Any] = json.loads((folder / "out.json").read_text(encoding="utf-8"))
    if told["said"] and not complains:
        raise LinuxcncError(f"LinuxCNC complained: {'; '.join(told['said'])}")
    if told["lost"]:
        raise LinuxcncError(f"{told['lost']} samples were lost: the machine is too busy")
    return np.fromfile(folder / "out.f64").reshape(-1, columns), told
