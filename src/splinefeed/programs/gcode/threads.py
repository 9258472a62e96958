"""Motion that is tied to the spindle: G33, rigid tapping G33.1, and LinuxCNC's threading cycle G76.

Where the documentation [1]_ leaves a choice, what LinuxCNC's interpreter does. The spindle is taken to turn at the
constant speed S, so that the feed is the lead times S; the wait for its index, and what it takes to reverse, are not
known here.

References
----------
.. [1] LinuxCNC documentation, "G-Codes", G33, G33.1 and G76.
"""

from __future__ import annotations

import math
from itertools import count, takewhile

import numpy as np

from splinefeed.programs.gcode.codes import g_name
from splinefeed.programs.gcode.faults import LineError, SpindleError, refuse
from splinefeed.programs.gcode.moves import LETTERS, STATED, Findings, Flag, MoveKind
from splinefeed.programs.gcode.state import ProgramState, check_size
from splinefeed.records import Array

#: What is taken of the spindle.
TIED = (
    "moves tied to the spindle have the feed of their lead times its speed S, taken as constant; waits for its index "
    "are left out"
)
#: Most passes of a thread.
MAX_PASSES = 10_000
_X, _Z = 0, 2


def tied(
    state: ProgramState, code: int, target: tuple[Array, int], lead: float | None, line: int, findings: Findings
) -> None:
    """G33 and G33.1 to the target (place (9,), bits of its axes); `lead` is the way a revolution."""
    there, said = target
    if lead is None:
        raise LineError(f"{g_name(code)} needs the way a revolution, K (Fanuc: F)")
    feed = _feed(state, code, abs(lead), line, findings)
    start = state.position.copy()
    state.add(MoveKind.LINE, there, said, line, feed=feed, flags=Flag.TIED)
    if code == 331:  # the spindle turns back and takes the tap out
        state.say(line, f"M{7 - state.spindle}")
        state.add(MoveKind.LINE, start, said & (1 << STATED) - 1, line, feed=feed, flags=Flag.TIED)
        state.say(line, f"M{state.spindle}")


def thread(state: ProgramState, words: dict[str, float], line: int, findings: Findings) -> None:
    """G76: passes from the drive line, on which the tool is, to a thread beside it; `words` are taken."""
    taken = {letter: words.pop(letter) for letter in "PZIJKRQHEL" if letter in words}
    for letter in LETTERS:
        if words.pop(letter, None) is not None:  # as LinuxCNC, which does not move them
            findings.count(f"{letter} beside G76 moves nothing", line)
    for letter in "PZIJK":
        refuse(letter not in taken, f"G76 needs {letter}")
    peak, first, full = (state.scaled(_X, taken[letter]) for letter in "IJK")
    springs, regression, angle = taken.get("H", 0.0), max(taken.get("R", 1.0), 1.0), taken.get("Q", 0.0)
    ends, taper = taken.get("L", 0.0), state.scaled(_Z, taken.get("E", 0.0))
    whole = 0.0 <= springs <= MAX_PASSES and springs == math.floor(springs)
    for right, reason in (
        (peak != 0.0, "I, from the drive line to the crest of the thread, must not be 0"),
        (0.0 < first < full, f"J, the first cut, is greater than 0 and less than K, got {first:g}, {full:g} mm"),
        (whole, f"H{springs:g}: passes are whole, 0 to {MAX_PASSES}"),
        (abs(angle) < 90.0, f"Q{angle:g}: the angle of the slide is less than 90 degrees"),
        (ends in (0.0, 1.0, 2.0, 3.0), "L is 0 to 3, the ends with a taper"),
        (taper >= 0.0, "E, the length of a taper, must not be less than 0"),
        (full <= first * MAX_PASSES ** (1.0 / regression), f"more than {MAX_PASSES} passes; cut deeper at a time (J)"),
    ):
        refuse(not right, f"G76: {reason}")
    start = state.position.copy()
    base = start[_Z] if state.relative else state.offset[_Z]
    bottom = base + state.scaled(_Z, taken["Z"])
    check_size("Z", float(bottom))
    check_size("I", start[_X] + abs(peak) + full)
    rate = _feed(state, 760, abs(taken["P"]), line, findings)
    slope = rate * math.hypot(1.0, full / taper) if taper else rate
    entry, leave = (taper if ends in which else 0.0 for which in ((1.0, 3.0), (2.0, 3.0)))
    out = -math.copysign(1.0, peak)  # from the thread to the drive line
    way = math.copysign(1.0, start[_Z] - bottom)
    slide = way * math.tan(math.radians(angle))

    def move(kind: int, x: float, z: float, feed: float = 0.0) -> None:
        there = start.copy()
        there[[_X, _Z]] = x, z
        if not np.array_equal(there, state.position):
            state.add(kind, there, 0b101 | 0b101 << STATED, line, feed=feed or None, flags=Flag.TIED * (feed > 0.0))

    depths = takewhile(lambda depth: depth < full, (first * k ** (1.0 / regression) for k in count(1)))
    for depth in (*depths, *[full] * (1 + int(springs))):
        safe, cut = start[_X] + out * (full - depth), start[_X] + peak - out * depth
        begin, end = start[_Z] - slide * depth, bottom + slide * (full - depth)
        move(MoveKind.RAPID, safe, begin)
        if entry:
            move(MoveKind.LINE, cut + out * full, begin, slope)
            move(MoveKind.LINE, cut, begin - way * entry, slope)
        else:
            move(MoveKind.RAPID, cut, begin)
        move(MoveKind.LINE, cut, end + way * leave, rate)
        if leave:
            move(MoveKind.LINE, cut + out * full, end, slope)
        move(MoveKind.RAPID, safe, end)
    move(MoveKind.RAPID, start[_X], bottom)


def _feed(state: ProgramState, code: int, lead: float, line: int, findings: Findings) -> float:
    """What the spindle's speed makes of a lead in words of the program, mm a minute."""
    if not state.spindle:
        raise SpindleError(f"{g_name(code)} needs the spindle to turn; write M3 or M4 before it")
    turns = state.turns(float(state.position[_X] - state.offset[_X]))
    if not turns > 0.0:
        raise SpindleError(f"{g_name(code)} needs the speed of the spindle; write S before it")
    refuse(not lead > 0.0, f"{g_name(code)}: the way a revolution must not be 0")
    findings.count(TIED, line)
    return float(lead * state.scale[0] * turns)
