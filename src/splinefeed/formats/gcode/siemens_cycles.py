"""Siemens' drilling cycles CYCLE81 to CYCLE84 at the place where the tool is.

Source: SINUMERIK 840D/840Di/810D, Programming Guide "Cycles" (PGZ), 11.02 Edition, 2.1 "Drilling cycles". RTP, RFP and
DP are places of the program, SDIS, DPR, FDPR and DAM ways without a sign. CYCLE81 and 82 drill in one go; CYCLE83 by
pecks that become less by DAM; CYCLE84 taps with the spindle, whose speed SST is taken as constant.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.cycles import MAX_MOVES, SAME_LEVEL, Along
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.moves import LINE, RAPID, Findings
from splinefeed.formats.gcode.state import State, check_size
from splinefeed.formats.gcode.threads import TIED

#: Names of the parameters in their order; behind those, others for special machines may stand, which must be empty.
_HOLE = ("RTP", "RFP", "SDIS", "DP", "DPR")
PARAMETERS: dict[str, tuple[str, ...]] = {
    "CYCLE81": _HOLE,
    "CYCLE82": (*_HOLE, "DTB"),
    "CYCLE83": (*_HOLE, "FDEP", "FDPR", "DAM", "DTB", "DTS", "FRF", "VARI"),
    "CYCLE84": (*_HOLE, "DTB", "SDAC", "MPIT", "PIT", "POSS", "SST", "SST1"),
}
#: Least stroke of CYCLE83 where a factor makes it less, mm (_MDEP is not read); what a peck for breaking chips is
#: lifted, mm; how far above the last depth feed begins again, mm, in holes to so deep, mm, and as a part of the depth
#: of deeper ones, and at most, mm.
_LEAST, _LIFT, _AHEAD, _AHEAD_TO, _AHEAD_PART, _AHEAD_MOST = 1.0, 1.0, 0.6, 30.0, 1.0 / 50.0, 7.0
#: Coarse pitches of metric threads, mm, by size: ISO 261.
_PITCHES = {
    3: 0.5, 4: 0.7, 5: 0.8, 6: 1.0, 8: 1.25, 10: 1.5, 12: 1.75, 14: 2.0, 16: 2.0, 18: 2.5, 20: 2.5, 22: 2.5, 24: 3.0,
    27: 3.0, 30: 3.5, 33: 3.5, 36: 4.0, 39: 4.0, 42: 4.5, 45: 4.5, 48: 5.0,
}  # fmt: skip


@dataclass(frozen=True)
class Call:
    """A cycle with its parameters by name, those that are left out not among them."""

    name: str
    given: dict[str, float]


def call_of(name: str, text: str) -> Call:
    """The call of a cycle by what stands in its brackets; LineError for too many parameters, or none that is one."""
    names, given = PARAMETERS[name], {}
    for i, each in enumerate(text.split(",")):
        if not each.strip():
            continue
        if i >= len(names):
            raise LineError(f"{name}: parameter {i + 1} is not supported; leave out what follows {names[-1]}")
        try:
            given[names[i]] = float(each)
        except ValueError:
            raise LineError(f"{name}: {names[i]} is {each.strip()[:20]!r}, not a number") from None
        check_size(names[i], given[names[i]])
    return Call(name, given)


def drill(call: Call, state: State, line: int, findings: Findings) -> None:
    """Carry out the cycle where the tool is."""
    name, given = call.name, call.given
    across = state.across
    zero, scale = float(state.values[layout.OFFSET + across]), float(state.values[layout.SCALE + across])
    for needed in ("RTP", "RFP"):
        if needed not in given:
            raise LineError(f"{name} needs {needed}")
    if not given.keys() & {"DP", "DPR"}:
        raise LineError(f"{name} needs DP or DPR, the depth")
    surface, back = (zero + given[each] * scale for each in ("RFP", "RTP"))
    begin = surface + abs(given.get("SDIS", 0.0)) * scale
    bottom = surface - abs(given["DPR"]) * scale if given.get("DPR") else zero + given.get("DP", 0.0) * scale
    if bottom >= begin:
        raise LineError(f"{name}: the depth lies {bottom - begin:.6g} mm above the plane where it begins (RFP + SDIS)")
    if back < begin - SAME_LEVEL:
        raise LineError(f"{name}: RTP lies {begin - back:.6g} mm below the plane where it begins (RFP + SDIS)")
    hole = Along(state, across, line)
    hole.move(RAPID, begin)
    if name == "CYCLE83":
        _pecks(call, hole, surface, begin, bottom)
    elif name == "CYCLE84":
        _tap(call, hole, begin, bottom, findings)
    else:
        hole.move(LINE, bottom)
        hole.wait(_seconds(call, "DTB", state), name)
    hole.move(RAPID, back)


def _seconds(call: Call, word: str, state: State) -> float:
    """A wait in seconds; below 0 it counts turns of the spindle."""
    value = call.given.get(word, 0.0)
    if value >= 0.0:
        return value
    turns = state.turns(0.0)
    if not turns:
        raise LineError(f"{call.name}: {word} counts turns of the spindle, whose speed is not known; write S before it")
    return -60.0 * value / turns


def _depths(first: float, total: float, less: float) -> list[float]:
    """How deep the pecks of CYCLE83 reach below RFP, the last one `total`, mm.

    less  by how much a stroke is shorter than the one before, mm; below 0 the factor, -1 to 0; 0 for strokes alike
    """
    if not 0.0 < first <= total + SAME_LEVEL:
        raise LineError(f"CYCLE83: the first depth, {first:.6g} mm, must be greater than 0 and at most {total:.6g} mm")
    if less <= -1.0:
        raise LineError(f"CYCLE83: DAM={less:g}; a factor of the stroke lies between -1 and 0")
    stroke, depths = first, [first]
    while (rest := total - depths[-1]) > SAME_LEVEL:
        if len(depths) > MAX_MOVES // 4:
            raise LineError(f"CYCLE83 makes more than {MAX_MOVES} moves; drill deeper at a time (FDPR, DAM)")
        if less > 0.0:
            stroke = 0.5 * rest if less < rest <= 2.0 * less else max(stroke - less, less)  # the last two are alike
        elif less < 0.0:
            stroke = max(-less * stroke, _LEAST)
        depths.append(depths[-1] + min(stroke, rest))
    return [*depths[:-1], total]


def _pecks(call: Call, hole: Along, surface: float, begin: float, bottom: float) -> None:
    """CYCLE83: with VARI=1 back to the beginning after each peck, else lifted by 1 mm."""
    state, given, total = hole.state, call.given, surface - bottom
    scale = float(state.values[layout.SCALE + hole.across])
    part = given.get("FRF", 0.0) or 1.0
    if not 0.001 <= part <= 1.0:
        raise LineError(f"CYCLE83: FRF={part:g}, the part of the feed for the first depth, is 0.001 to 1")
    first = abs(given.get("FDPR", 0.0)) * scale
    if not first:
        zero = float(state.values[layout.OFFSET + hole.across])
        first = surface - zero - given["FDEP"] * scale if "FDEP" in given else total
    less = given.get("DAM", 0.0)
    ahead = _AHEAD if total <= _AHEAD_TO else min(total * _AHEAD_PART, _AHEAD_MOST)
    feed: float | None = float(state.values[layout.FEED]) * part
    for depth in _depths(first, total, less * scale if less > 0.0 else less):
        level = surface - depth
        hole.move(LINE, level, feed)
        feed = None
        hole.wait(_seconds(call, "DTB", state), call.name)
        if depth == total:
            break
        if given.get("VARI", 0.0):
            hole.move(RAPID, begin)
            hole.wait(_seconds(call, "DTS", state), call.name)
            hole.move(RAPID, min(level + ahead, begin))
        else:
            hole.move(LINE, min(level + _LIFT, begin))


def _tap(call: Call, hole: Along, begin: float, bottom: float, findings: Findings) -> None:
    state, given = hole.state, call.given
    size, pitch = given.get("MPIT", 0.0), given.get("PIT", 0.0)
    if not pitch and abs(size) not in _PITCHES:
        raise LineError("CYCLE84 needs PIT, the pitch, or MPIT, the size of a metric thread, 3 to 48")
    lead = abs(pitch) * float(state.values[layout.SCALE]) if pitch else _PITCHES[int(abs(size))]
    speed = given.get("SST", 0.0) or state.turns(0.0)
    out = given.get("SST1", 0.0) or speed
    if not (0.0 < speed <= layout.LARGEST and 0.0 < out <= layout.LARGEST):
        raise LineError("CYCLE84 needs SST, the speed of the spindle, greater than 0")
    after = int(given.get("SDAC", 5.0) or 5.0)
    if after not in (3, 4, 5):
        raise LineError(f"CYCLE84: SDAC={given['SDAC']:g}; the spindle goes on by 3, 4 or 5 (M3, M4, M5)")
    findings.count(TIED, hole.line)
    turning = 3 if math.copysign(1.0, pitch or size) > 0.0 else 4
    state.say(hole.line, f"M19 S{speed:g} M{turning}")
    hole.move(LINE, bottom, lead * speed)
    hole.wait(_seconds(call, "DTB", state), call.name)
    state.say(hole.line, f"S{out:g} M{7 - turning}")
    hole.move(LINE, begin, lead * out)
    hole.switch(after)
    state.switch(after)
