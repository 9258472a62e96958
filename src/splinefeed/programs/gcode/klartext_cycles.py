"""Drilling and tapping cycles of Heidenhain's conversational programs: CYCL DEF, called by M99, M89 and CYCL CALL.

Cycles are 200 (drilling), 201 (reaming), 203 (universal drilling), 240 (centring), 206 and 207 (tapping) [1]_, and 1
(pecking: a peck as deep as the hole drills it at once), 2 (tapping) and 17 (rigid tapping) [2]_. Q203 and Q200 say
where feed begins, Q204 where the tool ends if that is higher, depths are below 0. The feed of a cycle is its own; F of
the program stays.

References
----------
.. [1] HEIDENHAIN TNC 640, User's Manual Cycle Programming (34059x-01), "Fixed Cycles: Drilling" and "Fixed Cycles:
       Tapping".
.. [2] HEIDENHAIN TNC 407 (280 580), User's Manual ISO Programming, p. 8-4 (pecking, and where feed begins again), and
       the chapters of tapping and rigid tapping.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from splinefeed.programs.gcode.cycles import MAX_MOVES, SAME_LEVEL, Hole, ahead
from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.moves import Findings
from splinefeed.programs.gcode.state import ProgramState
from splinefeed.programs.gcode.threads import TIED

#: Steps as `cycles` has them, R where feed begins and C where the tool ends; H a wait above, B a peck's way back.
STEPS = {
    1: "Q( 1L 0R 0A ) 1Z P 0R",
    2: "1Z P M5 M- 1R M5 M+",
    17: "1Z M5 M- 1R M5 M+",
    200: "0R Q( 1L 0R H 0A ) 1Z P 0R 0C",
    201: "0R 1Z P 1R 0C",
    203: "0R Q( 1L 1B H 0A ) 1Z P 1R 0C",
    206: "0R 1Z P M5 M- 1R M5 M+ 0C",
    207: "0R 1Z M5 M- 1R M5 M+ 0C",
    240: "0R 1Z P 0R 0C",
}
#: What the old cycles call by the numbers behind their points, as the new ones call it; 1.5 F100 is the feed.
_OLD = {
    1: {1: "Q200", 2: "Q201", 3: "Q202", 4: "Q211", 5: "Q206"},
    2: {1: "Q200", 2: "Q201", 3: "Q211", 4: "Q206"},
    17: {1: "Q200", 2: "Q201", 3: "Q239"},
}


def old_name(number: int, part: int) -> str:
    """The parameter of a new cycle that CYCL DEF 1.2 and its kind set; "" for none."""
    return _OLD.get(number, {}).get(part, "")


def drill(number: int, given: Mapping[str, float], state: ProgramState, line: int, findings: Findings) -> None:
    """Carry out the cycle `number` with its parameters where the tool is; LineError for what it lacks."""
    name, zero, here = f"cycle {number}", float(state.offset[2]), float(state.position[2])
    old = number in _OLD
    need = {"Q200", "Q201"} | ({"Q239"} if number in (17, 207) else {"Q206"}) | (set() if old else {"Q203"})
    missing = sorted(need - given.keys())
    refuse(missing, f"{name} needs {missing[0] if missing else ''}")
    depth, setup = given["Q201"], abs(given["Q200"])
    refuse(number == 240 and given.get("Q343"), f"{name} by the diameter (Q343) needs the point of the tool")
    refuse(depth > 0.0, f"{name}: a depth above 0, {depth:g}, works upwards, which is not read")
    if depth == 0.0:
        return
    surface = here - setup if old else zero + given["Q203"]
    begin = here if old else surface + setup
    hole = Hole(
        state, line, name,
        {"R": begin, "B": begin, "Z": surface + depth, "C": max(begin, surface + given.get("Q204", 0.0))},
        said={"P": given.get("Q211", 0.0), "H": given.get("Q210", 0.0)},
    )  # fmt: skip
    feed, steps = given.get("Q206", 0.0), STEPS[number]
    if "M-" in steps:
        turning = 3 if given.get("Q239", 1.0) > 0.0 else 4
        hole.said = {**hole.said, "M-": f"M{7 - turning}", "M+": f"M{turning}"}
        findings.count(TIED, line)
    if "Q239" in given and number in (17, 207):
        feed = abs(given["Q239"]) * state.turns(0.0)
        refuse(not feed, f"{name} needs the speed of the spindle and a pitch; write S in TOOL CALL")
    back = given.get("Q208", 0.0) or (feed if number == 201 else math.inf)
    if math.isinf(back) and number == 203:
        steps = steps.replace("1R", "0R").replace("1B", "0B")
    if "Q(" in steps:
        hole.pecks = _pecks(number, name, given, surface, depth, begin)
    kept = state.feed
    hole.steady = {"R": back, "B": back} if number in (201, 203) else {}
    try:
        state.feed = feed
        hole.drill(steps)
    finally:
        state.feed = kept


def _pecks(
    number: int, name: str, given: Mapping[str, float], surface: float, depth: float, begin: float
) -> list[tuple[float, float]]:
    """Where all pecks but the last end, and where feed begins again, mm."""
    step, total = abs(given.get("Q202", 0.0)) or -depth, -depth
    less, least = given.get("Q212", 0.0), given.get("Q205", 0.0)
    refuse(number == 203 and given.get("Q213") and step < total, f"{name} with chip breaking (Q213) is not read")
    refuse(less < 0.0 or (less and not least > 0.0), f"{name}: Q212 needs Q205, the least depth of a peck")
    setup = ahead(total) if number == 1 else abs(given["Q200"])
    pecks, done = list[tuple[float, float]](), 0.0
    while (done := done + step) < total - SAME_LEVEL:
        if len(pecks) > MAX_MOVES // 4:
            raise LineError(f"{name} makes more than {MAX_MOVES} moves; drill deeper at a time")
        pecks.append((surface - done, min(surface - done + setup, begin)))
        step = max(step - less, least) if less else step
    return pecks
