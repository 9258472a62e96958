"""A run of a program as the program has it: its lines by time, its tools and operations, places by line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path as File
from typing import Any

import numpy as np

from splinefeed.checks.law import times_at
from splinefeed.records import Array, IntArray
from splinefeed.runs.result import Run

#: Bytes of a program that a page shows the lines of.
MOST_SHOWN = 2_000_000
#: A change of tools, and the tool in its words.
_CHANGE, _TOOL = re.compile(r"\bM0?6\b"), re.compile(r"\bT\d+\b")
#: Of two lines that meet at a time, within so many s, the one that begins there has it.
TINY = 1e-9
#: mm/min in mm/s.
MINUTE = 60.0


@dataclass(frozen=True)
class Operation:
    """What is done from one change of tools to the next.

    Parameters
    ----------
    tool : str
        Its name.
    lines : tuple of int
        The first and the last one.
    seconds, rapid_s : float
        In all, and of rapid moves, s.
    cut_mm : float
        Length of feed moves, mm.
    feeds : tuple of float or None
        Least and greatest programmed, mm/min; None where none is.
    """

    tool: str
    lines: tuple[int, int]
    seconds: float
    rapid_s: float
    cut_mm: float
    feeds: tuple[float, float] | None


def line_at(run: Run, t: float) -> int | None:
    """The line of the program at a time, s; None where the path is of none."""
    if run.path.lines is None:
        return None
    begin, lines = starts(run)
    return int(lines[max(int(np.searchsorted(begin, t + TINY, "right")) - 1, 0)])


def starts(run: Run) -> tuple[Array, IntArray]:
    """When each curve begins, s, and its line, (curves,) each; to the tick of those kept where there is no law."""
    lines = run.path.lines
    assert lines is not None
    if run.planned is not None:
        return times_at(run.law, run.path.curve_starts[:-1]), lines
    first = np.searchsorted(run.kept.curve, np.arange(len(lines)))
    t: Array = np.append(run.kept.t, run.duration)[np.minimum(first, len(run.kept))]
    return np.maximum.accumulate(t), lines


def operations(run: Run) -> list[Operation]:
    """The operations of a program, in its order; one where it changes no tool."""
    path, (begin, lines) = run.path, starts(run)
    count = len(lines)
    changes = [(m.before, m.text) for m in path.markers if _CHANGE.search(m.text)]
    edges = [0, *(before for before, _ in changes), count]
    names = ["", *((_TOOL.search(text) or [""])[0] for _, text in changes)]
    seconds = np.diff(begin, append=run.duration)
    feeds = np.full(count, np.inf) if path.feeds is None else path.feeds
    rapid, size = np.isinf(feeds), np.diff(path.curve_starts)
    found = []
    for name, low, high in zip(names, edges, edges[1:], strict=False):
        if high <= low:
            continue
        part, cut = slice(low, high), feeds[low:high][~rapid[low:high]]
        said = (MINUTE * float(cut.min()), MINUTE * float(cut.max())) if len(cut) else None
        span = int(lines[part].min()), int(lines[part].max())
        spent, idle = float(seconds[part].sum()), float(seconds[part][rapid[part]].sum())
        found.append(Operation(name, span, spent, idle, float(size[part][~rapid[part]].sum()), said))
    return found


def text_of_program(record: Mapping[str, Any]) -> str:
    """The program as the run read it, for a listing; empty where the file is not at hand, or too long."""
    source = record.get("source")
    file = File(str(source.get("text", ""))) if isinstance(source, Mapping) else File("")
    if not file.is_file() or file.stat().st_size > MOST_SHOWN:
        return ""
    return file.read_bytes().decode("utf-8", errors="replace")
