"""What a program will not do with splinefeed as LinuxCNC's planner, said when the program is loaded."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path as File

import numpy as np

from splinefeed.errors import SplinefeedError
from splinefeed.files.source import read_text
from splinefeed.live.linuxcnc_curves import appears
from splinefeed.live.linuxcnc_limits import Mill
from splinefeed.programs.gcode.faults import SpindleError
from splinefeed.programs.gcode.moves import LETTERS, Flag
from splinefeed.programs.gcode.to_path import Program

#: What a program has that may be refused: motion that goes with the spindle, or calls of subprograms, which may.
LOOKED_AT = re.compile(r"(?i)G\s*0*(?:33|76|95)(?![0-9])|\bO\s*<|\bO\s*[0-9#\[]+\s*CALL|M\s*98(?![0-9])")


def refused(file: str, mill: Mill, say: Callable[[str], None]) -> str:
    """Say what of a program the machine will not run.

    Parameters
    ----------
    file : str
        The program.
    mill : Mill
        The machine.
    say : callable
        Takes a line where the program cannot be looked through.

    Returns
    -------
    str
        One line with the place and the mend; "" for nothing.
    """
    try:
        if not appears(LOOKED_AT, read_text(File(file), "a program")):
            return ""
        reading = Program(file, "linuxcnc", repair=True).reading()
    except SplinefeedError as error:
        say(f"the program was not looked through for what cannot be planned: {error}")
        return ""
    known = {LETTERS.index(axis.upper()): velocity for axis, velocity in zip(mill.axes, mill.velocity, strict=True)}
    over: dict[int, tuple[float, float]] = {}  # by line: how fast in step with the spindle, and what the axes allow
    try:
        for moves in reading.moves(file):
            for k in np.flatnonzero(moves.has(Flag.TIED)).tolist():
                step = np.abs(moves["end"][k] - moves.starts[k])
                way, feed = float(np.linalg.norm(step[:3])), float(moves["feed"][k]) / 60.0
                top = min((v * way / step[axis] for axis, v in known.items() if step[axis] > 0.0), default=np.inf)
                if way > 0.0 and feed >= top:
                    over.setdefault(int(moves["line"][k]), (feed, top))
    except SplinefeedError as error:
        stands = isinstance(reading.fault, SpindleError)
        if stands and not over:
            return f"{error}: it will not run unless the spindle turns when it begins"
        if not stands:
            say(f"the program was looked through for what cannot be planned up to {error}")
    if not over:
        return ""
    line, (feed, top) = next(iter(over.items()))
    others = f"; likewise {len(over) - 1} more" if len(over) > 1 else ""
    return (
        f"{file}: line {line}: will not run: in step with the spindle it goes at {feed:.4g} mm/s and the axes allow "
        f"less than {top:.4g}; lower S or the pitch{others}"
    )
