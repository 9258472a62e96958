"""How soon LinuxCNC obeys, with its own trajectory planner and with splinefeed: pause, override, MDI, standstills."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from benchmarks.linuxcnc_motion import LINEAR, machine, run
from benchmarks.linuxcnc_planner import PERIOD, Mill, Recording, module_missing
from benchmarks.linuxcnc_programs import HEAD, pocket
from benchmarks.tables import Cell, Column, Headline, Report, Table
from splinefeed.live.linuxcnc_sink import LinuxcncError

#: A jerk that LinuxCNC's own planner keeps, mm/s^3.
LEGAL = 1_000_000.0
#: What may be: seconds, and the time of the pocket over stock's.
PAUSE, SETTLED, FIRST, STILL, LONGER = 0.120, 0.200, 0.100, 0.030, 1.01
LINE = HEAD + "G1 X400 F3600\nG1 X0\nM2\n"
CIRCLE = HEAD + "G1 X1 F3600\n" + "G3 X1 Y0 I3.9 J0 P9\n" * 3 + "M2\n"


def measure() -> Report:
    """Each reaction by stock and by ours."""
    if missing := module_missing():
        raise LinuxcncError(missing)
    tasks: list[tuple[str, Callable[[Mill], float], float]] = [
        ("pause from 60 mm/s on a line", lambda mill: pauses(LINE, mill), PAUSE),
        ("pause from 60 mm/s on a circle of 3.9 mm", lambda mill: pauses(CIRCLE, mill), PAUSE),
        ("override 100 to 30 %, settled", lambda mill: settled(mill, 100, 30), SETTLED),
        ("override 30 to 150 %, settled", lambda mill: settled(mill, 30, 150), SETTLED),
        ("first motion behind an MDI command", first_motion, FIRST),
        ("standstill at G4 P0", standstill, STILL),
    ]
    rows: list[tuple[Cell, ...]] = []
    for name, what, most in tasks:
        print(f"  {name}", file=sys.stderr, flush=True)
        rows.append((name, what(machine("xyz")), what(machine("xyz", LINEAR[2])), most))
    one, other = (run(pocket(), machine("xyz", jerk)) for jerk in (None, LEGAL))
    seconds = [PERIOD * len(each.moving()) for each in (one, other)]
    rows.append(("pocket where stock's jerk is legal (10^6 mm/s^3)", *seconds, LONGER * seconds[0]))
    columns = (
        Column("what"),
        *(Column(f"{name}, s", ".3f") for name in ("stock", "splinefeed")),
        Column("at most", ".3f"),
    )
    notes = (
        "LinuxCNC and planner before all other work (chrt -r 1). "
        "Axes of 60 mm/s, 1,000 mm/s^2 and, for splinefeed, 50,000 mm/s^3, where nothing else is said; LinuxCNC 2.9 "
        "knows no jerk. From the call of LinuxCNC's Python interface, its way to the task included; the longest of 6 "
        "pauses, 3 overrides, 6 MDI moves; the median of 12 standstills. Override: until the feed is within 1 % to "
        "stay (40 mm/s at 100 %). Pocket: from first to last motion.",
    )
    met = [name for name, _, ours, most in rows if float(ours) <= float(most)]  # type: ignore[arg-type]
    line = Headline(
        "inside LinuxCNC: pause, override, first motion, standstill, time of a pocket",
        f"{len(met)} of {len(rows)} within", "all", len(met) == len(rows),
    )  # fmt: skip
    return Report((Table("From the operator's command to what LinuxCNC does.", columns, tuple(rows), notes),), (line,))


def speed(found: Recording) -> NDArray[np.float64]:
    """The speed of each tick, mm/s."""
    return np.asarray(np.linalg.norm(np.diff(found.position[:, :3], axis=0), axis=1) / PERIOD)


def pauses(program: str, mill: Mill) -> float:
    """The longest time from a pause to standstill, s."""
    times = [0.8 + 1.31 * k for k in range(6)]
    actions = ",".join(f"{at:.2f}:pause,{at + 0.5:.2f}:resume" for at in times)
    found = run(program, mill, actions=actions)
    v, longest = speed(found), []
    for row, what in found.acted:
        if what == "pause" and v[min(row, len(v) - 1)] > 0.95 * LINEAR[0]:
            longest.append(int(np.argmax(v[row:] == 0.0)) * PERIOD)
    return max(longest, default=math.nan)


def settled(mill: Mill, before: int, after: int) -> float:
    """From a change of the feed override to the new feed, within 1 % of it to stay, s: the longest of three."""
    actions = ",".join(f"{0.4 + 1.6 * k:.2f}:feed={before},{1.2 + 1.6 * k:.2f}:feed={after}" for k in range(3))
    found = run(HEAD + "G1 X600 F2400\nM2\n", mill, actions=f"{actions},5.5:feed=150")
    v, longest = speed(found), []
    for row, what in found.acted:
        if what == f"feed={after}" and row < len(v) - 700:
            good = np.abs(v[row : row + 700] - 40.0 * after / 100.0) < 0.01 * 40.0 * after / 100.0
            longest.append(PERIOD * (int(np.max(np.flatnonzero(~good), initial=-1)) + 1))
    return max(longest, default=math.nan)


def first_motion(mill: Mill) -> float:
    """From an MDI command to the first tick of its motion, s: the longest of six."""
    actions = ",".join(f"{2.0 + 1.5 * k:.2f}:mdi=G0 X{5 + 5 * k} Y{k}" for k in range(6))
    found = run(HEAD + "G1 X1\nM2\n", mill, actions=f"{actions},12:feed=100")
    moves = speed(found) > 0.0
    return max(PERIOD * int(np.argmax(moves[row:])) for row, what in found.acted if what.startswith("mdi"))


def standstill(mill: Mill) -> float:
    """The median of the times at rest between moves with words between them that wait for the end of motion, s."""
    program = HEAD + "".join(f"G1 X{4 * k + 4} Y{3 * (k % 2)}\nG4 P0\n" for k in range(13)) + "M2\n"
    v = speed(run(program, mill))
    moves = np.flatnonzero(v > 0.0)
    gaps = np.diff(moves)
    return PERIOD * float(np.median(gaps[gaps > 1] - 1))
