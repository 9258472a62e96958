"""One run of a sweep, as a worker does it: a task in, a row of numbers out, never an exception."""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

from splinefeed.errors import InputError, SplinefeedError
from splinefeed.formats import registry
from splinefeed.machine.machine import Machine
from splinefeed.paths import shapes
from splinefeed.paths.path import Path
from splinefeed.paths.track import Track
from splinefeed.planner.planning import cheap_to_bound, plan
from splinefeed.records import Limits, TimeLaw
from splinefeed.runs.measures import MEASURES
from splinefeed.runs.result import Run
from splinefeed.runs.run import MotionJob, carry_out, on_machine
from splinefeed.runs.settings import PAPER_PERIOD, fed, limited
from splinefeed.sweeps.spec import Settings, Task

#: What a run came to: every limit holds; a limit or a check does not; there is no result.
DONE, OVER, FAILED = "ok", "not kept", "failed"
_TEXT = ("status", "error_kind", "error", "strategy", "method")
_NUMBERS = ("period_s", "length_mm", "duration_s", "lower_bound_s")
_ERRORS = ("end_error_mm", *(key for each in MEASURES for key in each.columns))
_SERVO = ("contour_error_max_mm", "contour_error_rms_mm", "tracking_error_max_mm")
#: Columns of the dataset in addition to index, source and the settings that vary, with their kinds.
COLUMNS = {
    **dict.fromkeys(_TEXT, "text"), **dict.fromkeys(_NUMBERS, "number"), "ticks": "whole",
    **dict.fromkeys(_ERRORS, "number"), "worst_limit": "text", "worst_share": "number", "worst_at_s": "number",
    **dict.fromkeys(_SERVO, "number"), "stopped": "text",
}  # fmt: skip
#: Longest text of an error that is kept.
LONGEST = 500

Row = dict[str, Any]
#: Limits as `Limits.as_dict` has them, hashable.
Flat = tuple[tuple[str, float], ...]
#: Writes the other output of a run, its setpoints or its report; must be picklable: a function of a module.
Artefacts = Callable[[Task, Run], None]


def work(tasks: Sequence[Task], artefacts: Artefacts | None = None) -> list[tuple[Row, float]]:
    """Make the rows of tasks.

    Parameters
    ----------
    tasks : sequence of Task
        Runs.
    artefacts : callable, optional
        Is called with each task and its Run.

    Returns
    -------
    list of (dict, float)
        Each row, and the time that it took, s.
    """
    out = []
    for task in tasks:
        start = time.perf_counter()
        out.append((row_of(task, artefacts), time.perf_counter() - start))
    return out


def row_of(task: Task, artefacts: Artefacts | None = None) -> Row:
    """Return the row of one run: the same numbers, bit for bit, on every worker."""
    row = _bare(task)
    try:
        row |= _numbers(task, artefacts)
    except Exception as error:  # a sweep goes on: what went wrong is a result
        ours = isinstance(error, SplinefeedError)
        text = " ".join(str(error).split()) if ours else f"{type(error).__name__}: {error}"
        row |= {"status": FAILED, "error_kind": type(error).__name__, "error": text[:LONGEST]}
    return row


def lost_row(task: Task, times: int) -> Row:
    """Return the row of a run whose worker was lost each time that it was tried."""
    error = f"the worker was lost {times} times at this run"
    return _bare(task) | {"status": FAILED, "error_kind": "WorkerLost", "error": error}


def _bare(task: Task) -> Row:
    return {"index": task.index, "source": os.path.basename(task.source), **task.settings, **dict.fromkeys(COLUMNS)}


def _numbers(task: Task, artefacts: Artefacts | None) -> Row:
    settings = task.settings
    path, machine = _path(task.source), _machine(settings)
    given = {name.removeprefix("limits."): value for name, value in settings.items() if name.startswith("limits.")}
    made, limits, _ = limited(path, given, machine)
    cut = None if made is path else given["feed"]
    period, strategy = settings.get("period", PAPER_PERIOD), settings.get("strategy")
    how = {name: settings[name] for name in ("method", "corrections") if name in settings}
    tool = path.needs_machine
    simulated, joints = (None, settings.get("machine")) if tool else (machine, None)
    moved, law = _planned(task.source, cut, tuple(limits.as_dict().items()), joints, strategy, period)
    run = carry_out(MotionJob(moved, limits, simulated, period, strategy, source=task.source, **how), law=law)
    name, worst = max(run.verdict.limits.items(), key=lambda each: each[1].share, default=(None, None))
    numbers = run.numbers() | {
        "status": DONE if run.ok else OVER,
        "error": None if run.ok else "; ".join(run.verdict.problems)[:LONGEST] or None,
        "worst_limit": name,
        "worst_share": worst and worst.share,
        "worst_at_s": worst and worst.at_s,
    }
    if run.served is not None:
        axis, largest = run.served.tally.worst_linear()
        numbers |= run.served.tally.numbers() | {"tracking_error_max_mm": largest.value if axis else None}
    if artefacts is not None:
        artefacts(task, run)
    return {name: numbers[name] for name in COLUMNS if name in numbers}


@lru_cache(maxsize=16)
def _path(source: str) -> Path:
    """The path of a source; a worker that meets it again has it at hand."""
    return shapes.from_text(source) if shapes.is_shape(source) and not os.path.isfile(source) else registry.read(source)


@lru_cache(maxsize=4)
def _planned(
    source: str, cut: float | None, limits: Flat, machine: str | None, strategy: str | None, period: float
) -> tuple[Track, TimeLaw]:
    """Plan a path, or joints; runs that differ in method, or in what a machine does about it, share path and law.

    `cut` is the most of the feeds of moves that cut, mm/s, None for that of the program.
    """
    held, path = Limits.from_dict(dict(limits)), _path(source)
    moved = on_machine(path if cut is None else fed(path, cut), machine, held)
    return moved, plan(moved, held, strategy=strategy, period=period, bound=cheap_to_bound(moved, held))


def _machine(settings: Settings) -> Machine | None:
    """The machine with the multiples that the sweep asks for, or None."""
    if "machine" not in settings:
        if any(name.startswith("machine.") for name in settings):
            raise InputError("machine.* varies a machine, but there is none; add machine = NAME to the sweep")
        return None
    machine = Machine.load(settings["machine"])
    for name, factor in settings.items():
        if not name.startswith("machine."):
            continue
        _, axis, part, field = name.split(".")
        if axis not in machine.axes:
            raise InputError(f"{name}: machine {machine.name} has the axes {', '.join(machine.axes)}")
        of = machine.axes[axis]
        value = getattr(getattr(of, part, None), field, None)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(f"{name}: axis {axis} of {machine.name} has no number {part}.{field}")
        changed = dataclasses.replace(of, **{part: dataclasses.replace(getattr(of, part), **{field: factor * value})})
        machine = dataclasses.replace(machine, axes={**machine.axes, axis: changed})
    return machine
