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
from splinefeed.machine.control import PLAIN, Control, ControlFit, Place, SpindleControl, changed
from splinefeed.machine.machine import Machine
from splinefeed.machine.parts import values
from splinefeed.machine.quantities import KINDS
from splinefeed.programs.blocks import Blocks, read_blocks
from splinefeed.programs.control_planning import FEED
from splinefeed.programs.cycle_time import RPM, WIDTH, CycleTime, timed
from splinefeed.programs.run_log import RunLog, read_run
from splinefeed.records import Array, BoolArray, IntArray

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
#: A fit that misses a run, or an operation by more than so many seconds, by more than this share misses its own runs.
MISS, MISS_SECONDS = 0.02, 0.5
#: A number is at the edge of its prior beyond so many of the prior's standard deviations.
EDGE = 2.0
#: A number that moves no operation by this share, for a deviation of its prior, is not shown: the model may be as far
#: off.
EFFECT = 0.01
#: Share of a piece's time that the programmed feed must bind for the piece to show an override, the least pieces that
#: do, and the least override.
AT_FEED, LEAST_AT_FEED, OVERRIDE = 0.8, 3, 0.015


@dataclass(frozen=True, eq=False)
class Recorded:
    """One run of a program, cut into k pieces.

    Parameters
    ----------
    program : str
        The file.
    log : RunLog
        Of the run.
    first, last : array (k,)
        Lines that begin and end each piece.
    seconds, scatter : array (k,)
        Of each, and how much it scatters, s.
    tool : array (k,)
        Of each, index of `names`.
    names : tuple of str
        Of the tools.
    options : mapping of str to object
        Of reading the program.
    spindle : float, optional
        Highest speed that it starts the spindle at, rad/s.
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
    spindle: float = 0.0

    def estimated(self, time: CycleTime, limit: int | None = None) -> Array:
        """Sum the seconds of each piece by an estimate.

        Parameters
        ----------
        time : CycleTime
            The estimate.
        limit : int, optional
            Index of LIMITS: only of blocks that this one binds.

        Returns
        -------
        array (k,)
            s.
        """
        line, seconds, _, number = time.rows
        if limit is not None:
            bound = np.append(time.times.limit, -1)[number]
            seconds = np.where(bound == limit, seconds, 0.0)
        reached = np.maximum.accumulate(line)
        clock = np.concatenate([[0.0], np.cumsum(seconds)])
        out: Array = clock[np.searchsorted(reached, self.last)] - clock[np.searchsorted(reached, self.first)]
        return out


@dataclass(frozen=True)
class Fitted:
    """One number of a control as the runs show it.

    Parameters
    ----------
    name : str
        As the machine file has it.
    value, low, high : float
        With its 95 % interval, in `unit`.
    unit : str
        Of these.
    shown : bool
        Whether the runs narrow the prior's interval.
    edge : bool, optional
        Whether it lies at the edge of the prior, if that has one.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    shown: bool
    edge: bool = False


@dataclass(frozen=True, eq=False)
class Calibration:
    """A machine with fitted numbers, what is known of each, and how each run is reproduced.

    Parameters
    ----------
    machine : Machine
        With the fitted numbers.
    numbers : tuple of Fitted
        Each of them.
    runs : tuple of dict
        How each run is reproduced.
    misses : tuple of str, optional
        Where the fit misses its own runs, and what is likely missing.
    notes : tuple of str, optional
        What the runs leave open.
    """

    machine: Machine
    numbers: tuple[Fitted, ...]
    runs: tuple[dict[str, Any], ...]
    misses: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """The keys of `splinefeed calibrate --json`."""
        numbers = [vars(each) for each in self.numbers]
        return {
            "machine": self.machine.name, "meets_runs": not self.misses, "misses": list(self.misses),
            "numbers": numbers, "runs": list(self.runs), "notes": list(self.notes),
        }  # fmt: skip


def record(program: str | os.PathLike[str], log: str | os.PathLike[str], machine: Machine, **options: Any) -> Recorded:
    """Cut a recorded run of a program into pieces.

    Parameters
    ----------
    program, log : str or PathLike
        The program, and the record of its run.
    machine : Machine
        That it ran on.
    **options : object
        Of reading the program.

    Returns
    -------
    Recorded
        Its pieces, s.

    Raises
    ------
    FormatError
        For files that cannot be read.
    InputError
        For a run of another program, or one with loops.
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
    top = _spindle(blocks)
    return Recorded(os.fspath(program), run, lines[:-1], lines[1:], seconds, tools[:-1], scatter, names, options, top)


def _spindle(blocks: Blocks) -> float:
    """The highest speed, rad/s, at which a program starts the spindle; 0 where it does not."""
    words = [word for mark in blocks.marks for word in mark.text.split()]
    starts = {"M3", "M4"} & {*words}
    return max((float(word[1:]) / RPM for word in words if word[0] == "S"), default=0.0) if starts else 0.0


def calibrate(
    runs: Sequence[Recorded], machine: Machine, *, keep: Sequence[str] = (), say: Callable[[str], None] = lambda _: None
) -> Calibration:
    """Fit the control of a machine to recorded runs.

    Parameters
    ----------
    runs : sequence of Recorded
        At least one.
    machine : Machine
        The values of its file are the middle of each prior.
    keep : sequence of str, optional
        Numbers that stay as the file has them, by their names there (`home.z`).
    say : callable, optional
        Called with what is being done, in words.

    Returns
    -------
    Calibration
        With the machine and each number.

    Raises
    ------
    InputError
        Without runs.

    Notes
    -----
    Minimises sum r^2 + sum ((x - x0) / s)^2 over the logarithms x of the numbers, r the residuals of the pieces under a
    soft L1 loss (scipy.optimize.least_squares, trust region); the covariance is that of the linearised problem, times
    the residuals' mean square where that is more than 1. Numbers that the runs do not show go back to their prior, and
    the rest is fitted again.
    """
    if not runs:
        raise InputError("no runs: give at least one recorded run")
    start, notes = _with_spindle(machine.control or Control(), runs)
    fit = _Fit(runs, machine, _started(start, keep), keep)
    say(f"fitting {len(fit.middle)} numbers to {sum(len(run.seconds) for run in runs)} pieces")
    seen = list(fit.middle)
    solved, deviation, _ = fit.solve(seen, fit.place())
    # what moves no operation by more than the model may be off there is not shown, however narrow its interval is;
    # nor is what they bound on one side alone, where the prior's middle is within that bound
    effects = fit.effects(seen, solved)
    deviation |= {
        name: max(deviation[name], 1.0)
        for name, (up, down) in effects.items()
        if max(up, down) < EFFECT or (up < EFFECT and solved[name] < 0.0) or (down < EFFECT and solved[name] > 0.0)
    }
    correlation = np.eye(len(seen))
    while hidden := [name for name in seen if deviation[name] > SHOWN]:
        # what no run shows at all goes at once; of those that stand in for each other the least known one
        worst = max(hidden, key=lambda name: deviation[name])
        seen = [name for name in seen if name != worst and deviation[name] <= HIDDEN]
        say(f"fitting {len(seen)} numbers again")
        solved, known, correlation = fit.solve(seen, solved)
        deviation |= known
    numbers = []
    for name, kind in fit.kinds.items():
        best, width = solved.get(name, 0.0), WIDTH * (deviation[name] if name in seen else 1.0)
        # four digits: far within every interval, and fit to be read in a file
        value, low, high = (float(f"{fit.value(name, each):.4g}") for each in (best, best - width, best + width))
        unit = KINDS[kind][False].base if kind in KINDS else ""
        numbers.append(Fitted(name, value, low, high, unit, name in seen, name in seen and abs(best) > EDGE))
    prior = ", ".join(each.name for each in numbers if not each.shown)
    source = f"fitted by splinefeed calibrate to {', '.join(run.log.name for run in runs)}"
    source += f"; left at the prior: {prior}" if prior else ""
    fitted = {each.name: each.value for each in numbers} | {"source": source}
    model = replace(machine, control=changed(fit.start, fitted))
    met = tuple(compared(run, model) for run in runs)
    if edges := [each.name for each in numbers if each.edge]:
        notes.append(f"at the edge of the prior, so wrong or made up for something else: {', '.join(edges)}")
    if prior:
        notes.append(f"not shown by these runs, left at the prior: {prior}")
    how_well = _known(fit, seen, deviation, correlation, _spread(runs, met))
    model = replace(model, control=replace(changed(fit.start, fitted), fit=how_well))
    misses = [words for run, each in zip(runs, met, strict=True) for words in _misses(run, each, model)]
    return Calibration(model, tuple(numbers), met, tuple(misses), tuple(notes))


def _with_spindle(control: Control, runs: Sequence[Recorded]) -> tuple[Control, list[str]]:
    """The control with a spindle where the runs start one and the file has none, and notes on it."""
    top = max((run.spindle for run in runs), default=0.0)
    if control.spindle is not None or not top:
        return control, []
    words = f"the file has no [control.spindle] and the runs start one: top_speed is {top * RPM:.6g} rpm, their highest"
    return replace(control, spindle=SpindleControl(top_speed=top)), [words]


def _known(
    fit: _Fit, seen: Sequence[str], deviation: Mapping[str, float], correlation: Array, spread: float
) -> ControlFit:
    """What a machine file says of how well its numbers are known: those not shown as well as their priors."""
    names = [*seen, *(name for name in fit.kinds if name not in seen)]
    whole = np.eye(len(names))
    whole[: len(seen), : len(seen)] = correlation
    sizes = [PRIORS[name][1] * (min(deviation[name], 1.0) if name in seen else 1.0) for name in names]
    return ControlFit(
        spread=float(f"{spread:.3g}"),
        numbers=names,
        deviation=[float(f"{each:.4g}") for each in sizes],
        correlation=np.round(whole, 4).tolist(),
    )


def _spread(runs: Sequence[Recorded], met: Sequence[Mapping[str, Any]]) -> float:
    """What the fit leaves, as a share of a time: of its own operations, and between repeats of a program."""
    tools = [tool for each in met for tool in each["tools"]]
    apart = sum((tool["estimated_s"] - tool["recorded_s"]) ** 2 for tool in tools)
    whole = sum(tool["recorded_s"] ** 2 for tool in tools)
    repeats = [0.0]
    for program in {run.program for run in runs}:
        times = [run.log.duration for run in runs if run.program == program]
        repeats.append(float(np.std(times, ddof=1) / np.mean(times)) if len(times) > 1 else 0.0)
    return max(MODEL, math.sqrt(apart / whole) if whole else 0.0, *repeats)


def _misses(run: Recorded, met: Mapping[str, Any], machine: Machine) -> list[str]:
    """Where a fit misses a run by more than MISS, operation by operation, with what is likely missing."""
    tools = [each for each in met["tools"] if abs(each["error"]) > MISS]
    tools = [each for each in tools if abs(each["estimated_s"] - each["recorded_s"]) > MISS_SECONDS]
    if not tools:
        return [f"{met['run']}: {met['error']:+.1%}, spread over its operations"] if abs(met["error"]) > MISS else []
    assert machine.control is not None
    time = timed(read_blocks(run.program, machine.control, **run.options), machine)
    estimated, at_feed = run.estimated(time), run.estimated(time, FEED)
    found = []
    for tool in tools:
        of = np.array([run.names[number] == tool["tool"] for number in run.tool])
        why = _likely(run, of, estimated, at_feed)
        apart = tool["estimated_s"] - tool["recorded_s"]
        found.append(f"{met['run']}, {tool['tool'] or 'no tool'}: {tool['error']:+.1%} ({apart:+.1f} s); likely {why}")
    return found


def _likely(run: Recorded, of: BoolArray, estimated: Array, at_feed: Array) -> str:
    """What is likely missing where the pieces of an operation are missed."""
    apart = estimated - run.seconds
    loose: BoolArray = of & (run.scatter**2 - SAMPLING**2 - (MODEL * run.seconds) ** 2 > 1e-9)
    if abs(apart[loose].sum()) >= 0.5 * abs(apart[of].sum()):
        return "the tool change, the spindle or the way there: tool_change, [control.spindle], home, change_place"
    shown = of & ~loose & (at_feed >= AT_FEED * estimated) & (estimated > 0.0)
    if np.count_nonzero(shown) >= LEAST_AT_FEED:
        ratio = float(np.median(estimated[shown] / run.seconds[shown]))
        if abs(ratio - 1.0) > OVERRIDE:
            return f"a feedrate override: it cut at {ratio:.2f} times the programmed feed where that binds"
    return "how it cuts away from the programmed feed: corners, arcs, short blocks; or something that the model lacks"


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

    def effects(self, names: Sequence[str], best: Mapping[str, float]) -> dict[str, tuple[float, float]]:
        """How much a deviation of its prior, up or down, of each number moves an operation, as a share of its time.

        Of the operation that it moves most.
        """
        scatter = np.concatenate([run.scatter for run in self.runs])
        numbers = [1000 * k + run.tool for k, run in enumerate(self.runs)]
        _, operation = np.unique(np.concatenate(numbers), return_inverse=True)
        whole = np.bincount(operation, np.concatenate([run.seconds for run in self.runs]))
        here = self.residuals(best)

        def moved(name: str, side: float) -> float:
            away = self.residuals({**best, name: best[name] + side}) - here
            return float(np.max(np.bincount(operation, np.abs(away) * scatter) / whole))

        return {name: (moved(name, 1.0), moved(name, -1.0)) for name in names}

    def solve(
        self, names: Sequence[str], begin: Mapping[str, float]
    ) -> tuple[dict[str, float], dict[str, float], Array]:
        """The best value of each number, its standard deviation, both as they are fitted, and their correlation."""
        if not names:
            return {}, {}, np.eye(0)

        def priors_too(x: Array) -> Array:
            return np.concatenate([self.residuals(dict(zip(names, x, strict=True))), x])

        near = [begin.get(name, 0.0) for name in names]
        found = least_squares(priors_too, near, bounds=(-4.0, 4.0), loss="soft_l1", ftol=CLOSE, xtol=CLOSE)
        spread = max(1.0, float(np.mean(priors_too(found.x)[: -len(names)] ** 2)))
        covariance = spread * np.linalg.inv(found.jac.T @ found.jac)
        deviation = np.sqrt(np.diag(covariance))
        best, known = (dict(zip(names, each.tolist(), strict=True)) for each in (found.x, deviation))
        return best, known, covariance / np.outer(deviation, deviation)
