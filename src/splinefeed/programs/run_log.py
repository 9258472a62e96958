"""Recorded runs of programs: a CSV of events, `seconds,what,value`, as adapters of machine tools report them."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import FormatError, InputError
from splinefeed.files.source import read_text
from splinefeed.numbers import finite, whole
from splinefeed.records import Array, IntArray

#: Largest log, bytes.
MAX_BYTES = 2**28
#: Events that are read: line that runs, and status of the program; what else stands there is left aside.
LINE, STATUS = "Block_Number", "Program_Status"
RUNS, ENDS = ("ACTIVE",), ("PROGRAM_COMPLETED", "STOPPED", "READY")


@dataclass(frozen=True, eq=False)
class RunLog:
    """When each line (n,) of a program was first seen, seconds (n,), and when the run began and ended.

    A log samples: a line began at most one sample before it was seen, and short lines are not seen.
    """

    name: str
    seconds: Array
    line: IntArray
    start: float
    end: float

    @property
    def duration(self) -> float:
        """Seconds from the status ACTIVE, or the first line that moves, to the end."""
        return self.end - self.start


def read_run(file: str | os.PathLike[str]) -> RunLog:
    """The log in `file`; FormatError with the line for what is no event, or no run."""
    seen: list[tuple[float, int]] = []
    start, end, last = math.nan, math.nan, -math.inf
    for number, text in enumerate(read_text(file, "a run's log", MAX_BYTES).splitlines(), 1):
        if not text.strip() or (number == 1 and text.lower().startswith("seconds")):
            continue
        time, what, value = map(str.strip, (text + ",,").split(",")[:3])
        try:
            at = finite(time)
        except InputError:
            at = math.nan
        if text.count(",") < 2 or not last <= at < math.inf:
            raise FormatError(f"{file}: line {number}: expected seconds,what,value, sorted by time, got {text[:60]!r}")
        last = at
        if what == LINE:
            try:
                seen.append((at, whole(value, LINE, 0)))
            except InputError as error:
                raise FormatError(f"{file}: line {number}: {error}, the number of a line") from None
        elif what == STATUS and value in RUNS and math.isnan(start):
            start = at
        elif what == STATUS and value in ENDS and not math.isnan(start):
            end = at
    if not any(line for _, line in seen):
        raise FormatError(f"{file}: no event {LINE} names a line of a program")
    start = next(at for at, line in seen if line) if math.isnan(start) else start
    end = last if math.isnan(end) else end
    if not end > start:
        raise FormatError(f"{file}: the run ends where it begins, at {start:g} s")
    seconds, lines = zip(*seen, strict=True)
    return RunLog(os.path.basename(os.fspath(file)), np.array(seconds), np.array(lines, dtype=np.int64), start, end)
