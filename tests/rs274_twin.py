"""LinuxCNC's own interpreter, run apart, as a twin: its canonical moves in machine coordinates, mm and rad."""

from __future__ import annotations

import fcntl
import math
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

PROGRAM = shutil.which("rs274")
LOCK = Path(tempfile.gettempdir()) / "splinefeed-tests-rs274.lock"
#: It prints four decimals, in the units of the program.
ROUNDED = 6e-5
_CALL = re.compile(r"^\s*\d+\s+N[.\d]*\s*([A-Z]\w*)\((.*)\)\s*$")
_SWITCHES = {
    "START_SPINDLE_CLOCKWISE": "M3", "START_SPINDLE_COUNTERCLOCKWISE": "M4", "STOP_SPINDLE_TURNING": "M5",
    "CHANGE_TOOL": "M6", "MIST_ON": "M7", "FLOOD_ON": "M8", "PROGRAM_STOP": "M0", "OPTIONAL_PROGRAM_STOP": "M1",
}  # fmt: skip
_PLANES = {"XY": (0, 1), "XZ": (2, 0), "YZ": (1, 2)}


@dataclass
class Canon:
    """A move: its kind, end (6,), how far that is rounded, feed, mm a minute, tolerance, the middle (3,) of an arc.

    feed_rounded  how far the feed is rounded, mm a minute: where it goes with the spindle as far as that turns
    """

    kind: str
    end: np.ndarray
    rounded: float
    feed: float
    tolerance: float
    middle: np.ndarray | None = None
    feed_rounded: float = 2e-4


@dataclass
class Run:
    """What the interpreter says of a program: its moves, waits and switches in their order, and its error if any."""

    moves: list[Canon] = field(default_factory=list)
    waits: list[float] = field(default_factory=list)
    switches: list[str] = field(default_factory=list)
    error: str = ""


def run(file: Path, tools: Path | None = None) -> Run:
    """Run `file` through rs274 in the folder of the file, which gets its parameters, all 0.

    tools  a tool table, whose lengths rs274 takes for inches where it has no INI file
    """
    memory = file.with_suffix(".var")
    memory.write_text("")
    # two of them at once get in each other's way by the table of tools that they share
    with LOCK.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = _run(file, memory, tools)
        for _ in range(3):
            if done.stdout.strip():
                break
            done = _run(file, memory, tools)  # another program of LinuxCNC was at it
    found = Run()
    said = [line for line in done.stderr.splitlines() if line.strip() and line.strip() != "executing"]
    found.error = said[0] if said else ""
    rounded = ROUNDED
    unit, tolerance, plane = 1.0, math.inf, (0, 1)
    feed, per_turn, lead, speed, turning = 0.0, False, 0.0, 0.0, ""
    system, shift, tool, turned = np.zeros(6), np.zeros(6), np.zeros(6), np.eye(6)
    place = np.zeros(6)

    def machine(end: np.ndarray) -> np.ndarray:
        """A place (6,) of the program in machine coordinates."""
        return np.asarray(turned @ (end + shift) + system + tool)

    for line in done.stdout.splitlines():
        match = _CALL.match(line)
        if match is None:
            continue
        name, words = match.group(1), [word.strip() for word in match.group(2).split(",")]
        scale = np.array([unit] * 3 + [math.pi / 180.0] * 3)
        if name == "USE_LENGTH_UNITS":
            unit = 25.4 if "INCH" in words[0] else 1.0
            rounded = max(rounded, ROUNDED * unit)  # places said before are still in use
        elif name == "SET_G5X_OFFSET":
            system = np.array([float(word) for word in words[1:7]]) * scale
        elif name == "SET_G92_OFFSET":
            shift = np.array([float(word) for word in words[:6]]) * scale
        elif name == "USE_TOOL_LENGTH_OFFSET":
            tool = np.array([float(word) for word in " ".join(words).split()[:6]]) * scale
        elif name == "SELECT_PLANE":
            plane = _PLANES[words[0].rpartition("_")[2]]
        elif name == "SET_XY_ROTATION":
            angle = math.radians(float(words[0]))
            turned[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        elif name == "SET_FEED_MODE":
            per_turn = words[1] == "1"
        elif name == "SET_FEED_RATE":
            feed = float(words[0]) * unit
        elif name == "SET_SPINDLE_SPEED":
            speed = float(words[1])
        elif name == "START_SPEED_FEED_SYNC":
            lead = abs(float(words[0])) * unit
        elif name == "STOP_SPEED_FEED_SYNCH":
            lead = 0.0
        elif name == "SET_MOTION_CONTROL_MODE":
            tolerance = (float(words[1]) * unit or math.inf) if "CONTINUOUS" in words[0] else 0.0
        elif name == "DWELL":
            found.waits.append(float(words[0]))
        elif name in _SWITCHES:
            found.switches.append(_SWITCHES[name])
            turning = _SWITCHES[name] if "SPINDLE" in name else turning
        rate = lead * speed or (feed * speed if per_turn else feed)
        loose = 2e-4 + (ROUNDED * unit * speed if lead or per_turn else 0.0)
        if name == "RIGID_TAP":  # to the end and back, with the spindle turning the other way
            end = machine(np.append([float(word) for word in words[:3]], 0.0 * place[3:]) * scale)
            end[3:] = place[3:]
            found.moves += [Canon("FEED", each, rounded, rate, tolerance, None, loose) for each in (end, place)]
            found.switches += [{"M3": "M4", "M4": "M3"}[turning], turning]
        elif name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED"):
            end = machine(np.array([float(word) for word in words[:6]]) * scale)
            found.moves.append(Canon(name[9:], end, rounded, rate, tolerance, None, loose))
            place = end
        elif name == "ARC_FEED":
            end = np.array([0.0, 0.0, 0.0, *(float(word) for word in words[6:9])])
            across = 3 - sum(plane)
            end[[*plane, across]] = float(words[0]), float(words[1]), float(words[5])
            end = end * scale
            centre = np.array([float(words[2]), float(words[3])]) * unit
            start = turned.T @ (place - system - tool) - shift
            middle = np.append(_middle(start, end, centre, plane, int(words[4])), np.zeros(3))
            end, middle = machine(end), machine(middle)[:3]
            found.moves.append(Canon("ARC", end, rounded, rate, tolerance, middle, loose))
            place = end
        elif name == "NURBS_FEED":
            found.moves.append(Canon("NURBS", np.full(6, np.nan), rounded, rate, tolerance))
    return found


def _run(file: Path, memory: Path, tools: Path | None) -> subprocess.CompletedProcess[str]:
    assert PROGRAM is not None
    return subprocess.run(
        [PROGRAM, "-g", "-v", memory.name, *(["-t", str(tools)] if tools else []), file.name],
        cwd=file.parent, capture_output=True, text=True, timeout=20, check=False,
    )  # fmt: skip


def _middle(start: np.ndarray, end: np.ndarray, centre: np.ndarray, plane: tuple[int, int], turns: int) -> np.ndarray:
    """The place (3,) halfway along an arc of so many turns, counterclockwise if above 0."""
    first, last = start[list(plane)] - centre, end[list(plane)] - centre
    sign = math.copysign(1.0, turns)
    sweep = (sign * (math.atan2(last[1], last[0]) - math.atan2(first[1], first[0]))) % (2.0 * math.pi)
    # rounded ends of a full circle may be a little apart on either side
    if min(sweep, 2.0 * math.pi - sweep) * np.linalg.norm(first) < 3.0 * ROUNDED * 25.4:
        sweep = 2.0 * math.pi
    sweep += 2.0 * math.pi * (abs(turns) - 1)
    angle = math.atan2(first[1], first[0]) + 0.5 * sign * sweep
    radius = 0.5 * (np.linalg.norm(first) + np.linalg.norm(last))
    middle = 0.5 * (start[:3] + end[:3])
    middle[list(plane)] = centre + radius * np.array([math.cos(angle), math.sin(angle)])
    return middle
