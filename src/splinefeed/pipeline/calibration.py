"""The numbers of a control fitted to recorded runs: least squares with priors, and how well each number is known.

A run is cut where tools change, where cutting begins and ends, and every few seconds between. Each piece gives one
residual, estimated minus recorded seconds, over the scatter that the log's sampling and the model leave. Numbers are
fitted as logarithms (places and exponents as they are), each with a Gaussian prior about the value of the machine file.
A number whose interval the runs do not narrow stays at its prior.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from splinefeed.errors import InputError
from splinefeed.formats.run_log import RunLog, read_run
from splinefeed.machine.control import Control, Place, changed
from splinefeed.machine.machine import Machine
from splinefeed.machine.parts import values
from splinefeed.machine.quantities import KINDS
from splinefeed.pipeline.blocks import Blocks, read_blocks
from splinefeed.pipeline.cycle_time import CycleTime, timed
from splinefeed.records import Array, IntArray

#: Prior of each number: what it is where the machine file says nothing, and the standard deviation of its logarithm,
#: or of itself for those in PLAIN: round values of machining centres, wide enough for the runs to decide.
PRIORS: dict[str, tuple[float, float]] = {
    "acceleration": (500.0, 1.0),
    "jerk": (5000.0, 1.0),
    "rapid_acceleration": (2000.0, 1.0),
    "rapid_jerk": (50000.0, 1.0),
    "velocity_step": (3.0, 1.0),
    "arc_acceleration": (300.0, 1.0),
    "arc_growth": (0.0, 0.1),
    "arc_kink": (1.0, 0.5),
    "stop_time": (0.02, 1.0),
    "block_time": (0.002, 1.0),
    "tool_change": (4.0, 0.5),
    "start_time": (1.0, 1.0),
    "spindle.start": (5.0, 0.7),
    "spindle.stop": (5.0, 0.7),
    "home.z": (300.0, 60.0),
    "change_place.x": (0.0, 200.0),
    "change_place.y": (0.0, 200.0),
}
#: Numbers that may be 0 or negative: fitted as they are.
PLAIN = ("arc_growth", "home.z", "change_place.x", "change_place.y")
#: A number is shown by the runs where they narrow its standard deviation to less than the first share of the prior's;
#: above the second they do not show it.
SHOWN, HIDDEN = 0.7, 0.95
#: Least seconds of a piece of a run, and the scatter of its ends by sampling, s.
PIECE, SAMPLING = 4.0, 0.07
#: What the model leaves out: share of a piece; s of a way whose length depends on tools and work offsets, and of the
#: first one, which begins where the last program ended.
MODEL, CHANGING, FIRST = 0.004, 0.15, 0.5
#: Where tools may be changed, mm: the fit begins at the best of these, for times have several best places.
TRIED = (-300.0, -150.0, 0.0, 150.0, 300.0)
#: Relative change of cost or numbers at which the fit ends: far within their intervals.
CLOSE = 1e-4
#: Half the width of a 95 % interval in standard deviations.
WIDTH = 1.96


@dataclass(frozen=True, eq=False)
class Recorded:
    """One run of a program, cut into pieces: lines (k,) that begin and end each, seconds, tool, and scatter, s.

    names  of the tools; options  of reading the program
    """

    program: str
    log: RunLog
    first: IntArray
    last: IntArray
    seconds: Array
    tool: IntArray
    scatter: Array
    names: tuple[str, ...]
    options: Mapping[str, Any]

    def estimated(self, time: CycleTime) -> Array:
        """Seconds (k,) of each piece by an estimate."""
        line, seconds, _, _ = time.rows
        reached = np.maximum.accumulate(line)
        clock = np.concatenate([[0.0], np.cumsum(seconds)])
        out: Array = clock[np.searchsorted(reached, self.last)] - clock[np.searchsorted(reached, self.first)]
        return out


@dataclass(frozen=True)
class Fitted:
    """One number of a control: value with its 95 % interval, in `unit`; shown: whether the runs narrow the prior's."""

    name: str
    value: float
    low: float
    high: float
    unit: str
    shown: bool


@dataclass(frozen=True, eq=False)
class Calibration:
    """A machine with fitted numbers, what is known of each, and how each run is reproduced."""

    machine: Machine
    numbers: tuple[Fitted, ...]
    runs: tuple[dict[str, Any], ...]

    def as_dict(self) -> dict[str, Any]:
        """The keys of `splinefeed calibrate --json`."""
        numbers = [vars(each) for each in self.numbers]
        return {"machine": self.machine.name, "numbers": numbers, "runs": list(self.runs)}


def record(program: str | os.PathLike[str], log: str | os.PathLike[str], machine: Machine, **options: Any) -> Recorded:
    """A run of a program cut into pieces; `options` are those of reading the program.

    Raises FormatError for files that cannot be read, InputError for a run of another program, or one with loops.
    """
    run = read_run(log)
    blocks = read_blocks(program, machine.control or Control(), **options)
    end = int(max(blocks.line.max(), max((mark.line for mark in blocks.marks), default=0))) + 1
    if run.line.max() > end:
        raise InputError(
            f"{log}: line {run.line.max()} runs, and {program} has {end - 1} lines; is it the log of another program?"
        )
    if np.any(np.diff(blocks.line) < 0):
        raise InputError(f"{program}: its lines do not run in order (loops, subprograms); use runs of other programs")
    changes = [mark for mark in blocks.marks if "M6" in mark.text.split()]
    names = tuple(next((w for w in mark.text.split() if w[0] == "T"), "") for mark in changes) or ("",)
    starts = [mark.line for mark in changes] or [0]
    # line, when, tool, scatter of what follows: the way to the first change may come before its line is logged
    cuts: list[tuple[int, float, int, float]] = [(0, run.start, 0, FIRST)]
    for tool, (low, high) in enumerate(pairwise([*starts, end])):
        cutting = blocks.line[(blocks.line >= low) & (blocks.line < high) & ~blocks.rapid]
        first, last = (int(cutting[0]), int(cutting[-1])) if len(cutting) else (high, high)
        for line, when in zip(run.line.tolist(), run.seconds.tolist(), strict=True):
            if not low + (tool == 0) <= line < high or line <= cuts[-1][0] or when <= cuts[-1][1]:
                continue
            inside = first < line <= last
            if not inside or when - cuts[-1][1] >= PIECE:
                cuts.append((line, when, tool, 0.0 if inside or line == first else CHANGING))
    lines, whens, tools, loose = (np.array(each) for each in zip(*cuts, (end, run.end, -1, 0.0), strict=True))
    seconds = np.diff(whens)
    scatter = np.sqrt(SAMPLING**2 + (MODEL * seconds) ** 2 + loose[:-1] ** 2)
    return Recorded(os.fspath(program), run, lines[:-1], lines[1:], seconds, tools[:-1], scatter, names, options)


def calibrate(
    runs: Sequence[Recorded], machine: Machine, *, keep: Sequence[str] = (), say: Callable[[str], None] = lambda _: None
) -> Calibration:
    """Fit the control of `machine` to recorded runs; the values of its file are the middle of each prior.

    keep  numbers that stay as the file has them, by their names there (`home.z`)

    Minimises sum r^2 + sum ((x - x0) / s)^2 over the logarithms x of the numbers, r the residuals of the pieces under a
    soft L1 loss (scipy.optimize.least_squares, trust region); the covariance is that of the linearised problem, times
    the residuals' mean square where that is more than 1. Numbers that the runs do not show go back to their prior, and
    the rest is fitted again.

    Raises InputError without runs.
    """
    if not runs:
        raise InputError("no runs: give at least one recorded run")
    fit = _Fit(runs, machine, _started(machine.control or Control(), keep), keep)
    say(f"fitting {len(fit.middle)} numbers to {sum(len(run.seconds) for run in runs)} pieces")
    seen = list(fit.middle)
    solved, deviation = fit.solve(seen, fit.place())
    while hidden := [name for name in seen if deviation[name] > SHOWN]:
        # what no run shows at all goes at once; of those that stand in for each other the least known one
        worst = max(hidden, key=lambda name: deviation[name])
        seen = [name for name in seen if name != worst and deviation[name] <= HIDDEN]
        say(f"fitting {len(seen)} numbers again")
        solved, known = fit.solve(seen, solved)
        deviation |= known
    numbers = []
    for name, kind in fit.kinds.items():
        best, width = solved.get(name, 0.0), WIDTH * (deviation[name] if name in seen else 1.0)
        # four digits: far within every interval, and fit to be read in a file
        value, low, high = (float(f"{fit.value(name, each):.4g}") for each in (best, best - width, best + width))
        unit = KINDS[kind][False].base if kind in KINDS else ""
        numbers.append(Fitted(name, value, low, high, unit, name in seen))
    prior = ", ".join(each.name for each in numbers if not each.shown)
    source = f"fitted by splinefeed calibrate to {', '.join(run.log.name for run in runs)}"
    source += f"; left at the prior: {prior}" if prior else ""
    fitted = {each.name: each.value for each in numbers} | {"source": source}
    model = replace(machine, control=changed(fit.start, fitted))
    return Calibration(model, tuple(numbers), tuple(compared(run, model) for run in runs))


def compared(run: Recorded, machine: Machine) -> dict[str, Any]:
    """Recorded and estimated seconds of a run, in total and per tool."""
    assert machine.control is not None
    estimated = run.estimated(timed(read_blocks(run.program, machine.control, **run.options), machine))
    tools = []
    for number, name in enumerate(run.names):
        of = run.tool == number
        tools.append(_pair(float(run.seconds[of].sum()), float(estimated[of].sum())) | {"tool": name})
    return {"run": run.log.name, **_pair(run.log.duration, float(estimated.sum())), "tools": tools}


def _pair(recorded: float, estimated: float) -> dict[str, float]:
    return {"recorded_s": recorded, "estimated_s": estimated, "error": estimated / recorded - 1.0 if recorded else 0.0}


def _started(control: Control, keep: Sequence[str]) -> Control:
    """The control of the file, with the prior's middle for what it leaves out and is not kept so."""
    said = {name for name, one, value, _ in values(control) if value != one.default}
    if control.spindle is None:
        said |= {name for name in PRIORS if name.startswith("spindle.")}
    return changed(control, {name: middle for name, (middle, _) in PRIORS.items() if name not in {*said, *keep}})


class _Fit:
    """The least squares of one calibration; programs are read once for each set of places.

    A number is fitted as its distance from the prior's middle over the prior's standard deviation, 0 at the middle.
    """

    def __init__(self, runs: Sequence[Recorded], machine: Machine, start: Control, keep: Sequence[str]) -> None:
        self.runs, self.machine, self.start = runs, machine, start
        found = [(name, one, value) for name, one, value, _ in values(start) if name in PRIORS and name not in keep]
        self.kinds = {name: one.metadata.get("kind") for name, one, _ in found}
        self.middle = {name: float(value) for name, _, value in found}
        self._read: dict[tuple[str, Place, Place], Blocks] = {}

    def value(self, name: str, x: float) -> float:
        """The number itself."""
        away = PRIORS[name][1] * x
        return self.middle[name] + away if name in PLAIN else self.middle[name] * math.exp(away)

    def residuals(self, best: Mapping[str, float]) -> Array:
        """Those of all pieces for numbers as they are fitted; the middle for those left out."""
        control = changed(self.start, {name: self.value(name, x) for name, x in best.items()})
        machine = replace(self.machine, control=control)
        times: dict[str, CycleTime] = {}
        found = []
        for run in self.runs:
            if run.program not in times:
                key = (run.program, control.home, control.change_place)
                if key not in self._read:
                    self._read[key] = read_blocks(run.program, control, **run.options)
                times[run.program] = timed(self._read[key], machine)
            found.append((run.estimated(times[run.program]) - run.seconds) / run.scatter)
        return np.concatenate(found)

    def place(self) -> dict[str, float]:
        """The prior's middle, with tools changed at the best place of those tried."""
        pair: list[str] = [name for name in ("change_place.x", "change_place.y") if name in self.middle]
        tried = [
            {name: (place - self.middle[name]) / PRIORS[name][1] for name, place in zip(pair, at, strict=True)}
            for at in product(TRIED, repeat=len(pair))
        ]
        return min(tried, key=lambda each: float(np.sum(np.sqrt(1.0 + self.residuals(each) ** 2))))

    def solve(self, names: Sequence[str], begin: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
        """The best value of each number, and its standard deviation, both as they are fitted."""
        if not names:
            return {}, {}

        def priors_too(x: Array) -> Array:
            return np.concatenate([self.residuals(dict(zip(names, x, strict=True))), x])

        near = [begin.get(name, 0.0) for name in names]
        found = least_squares(priors_too, near, bounds=(-4.0, 4.0), loss="soft_l1", ftol=CLOSE, xtol=CLOSE)
        spread = max(1.0, float(np.mean(priors_too(found.x)[: -len(names)] ** 2)))
        deviation = np.sqrt(spread * np.diag(np.linalg.inv(found.jac.T @ found.jac)))
        return dict(zip(names, found.x.tolist(), strict=True)), dict(zip(names, deviation.tolist(), strict=True))
