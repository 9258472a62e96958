"""The servo simulation: one axis and tick, the contour error of a million samples, and a job of ten hours."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

import splinefeed as sf
from benchmarks import cases, child
from benchmarks.stream import peak_memory
from benchmarks.tables import Column, Headline, Report, Table
from benchmarks.timing import interleaved
from splinefeed.analysis.following import ContourMeter
from splinefeed.kernels import mechanics
from splinefeed.runs.following import Servo, follow_chunks
from splinefeed.simulation.plant import SUB_STEPS, parameters, plant, step_table

#: Ticks that are timed at once, few enough to pass between two other programs, and rounds; machine and axis.
TICKS = 8_000
ROUNDS = 60
AXES = (("xytheta", "x"), ("xytheta", "theta"), ("router", "x"), ("lintable", "x"))
#: One axis and tick may take so many ns.
FULL_TARGET, LINEAR_TARGET = 250.0, 60.0
#: Samples whose contour error is measured, how far off the path they are, mm, and what it may take, s.
SAMPLES = 1_000_000
OFF = 0.01
CONTOUR_TARGET = 2.0
#: Long jobs at 1 ms on three axes, hours; ticks of a chunk; memory that ten hours may need more than one, bytes.
HOURS = (1.0, 10.0)
CHUNK = 65_536
FLAT = 50e6


def measure() -> Report:
    """Nanoseconds of an axis and tick, seconds of a contour, memory and seconds of ten hours."""
    ticks, tick_lines = _ticks()
    contour, contour_lines = _contour()
    jobs, job_lines = _jobs()
    return Report((ticks, contour, jobs), (*tick_lines, *contour_lines, *job_lines))


def _ticks() -> tuple[Table, tuple[Headline, ...]]:
    runs = {}
    for machine, name in AXES:
        for linear in (False, True):
            runs[machine, name, linear] = AxisRun(machine, name, linear)
    times = interleaved({str(key): run for key, run in runs.items()}, ROUNDS)
    ns = {key: 1e9 * times[str(key)].least / TICKS for key in runs}
    rows = tuple((machine, name, ns[machine, name, False], ns[machine, name, True]) for machine, name in AXES)
    columns = (Column("machine"), Column("axis"), Column("full model, ns", ",.0f"), Column("linear, ns", ",.0f"))
    notes = (
        f"One axis and servo tick: measure, control, convert, move for 1 ms; fastest of {ROUNDS} rounds of {TICKS:,} "
        "ticks on laps of the paper's airfoil. Full: friction, backlash, counts, codes, limits, two sub-steps.",
    )
    full, linear = (max(value for key, value in ns.items() if key[2] is each) for each in (False, True))
    return Table("The servo simulation.", columns, rows, notes), (
        Headline("one axis and tick, full servo model", f"{full:.0f} ns", f"{FULL_TARGET:g} ns", full < FULL_TARGET),
        Headline("the same, linear", f"{linear:.0f} ns", f"{LINEAR_TARGET:g} ns", linear < LINEAR_TARGET),
    )  # fmt: skip


class AxisRun:
    """One axis of a machine over TICKS ticks of laps on the paper's airfoil, at each call from rest."""

    def __init__(self, machine: str, name: str, linear: bool) -> None:
        axis = sf.Machine.load(machine).axes[name]
        self.table = step_table(plant(axis), cases.PERIOD, SUB_STEPS)
        self.parameters = parameters(axis, cases.PERIOD, SUB_STEPS, linear=linear)
        lap = _lap()[:, 1 if name == "y" else 2 if name == "theta" else 0]
        self.command = np.ascontiguousarray(np.resize(np.concatenate([lap, lap[::-1]]), TICKS))
        self.room = [np.empty(TICKS) for _ in range(4)]

    def __call__(self) -> int:
        memory, scratch = np.zeros(mechanics.MEMORY), np.zeros(mechanics.SCRATCH)
        memory[[mechanics.MOTOR, mechanics.LOAD]] = self.command[0]
        return mechanics.run_axis(self.command, self.table, self.parameters, memory, scratch, *self.room)


def _lap() -> np.ndarray:
    """Positions (n, 3) of the paper's airfoil with theta, there once around."""
    points = sf.run(sf.paths.tangential(sf.shapes.naca("0025", perimeter=33))).points
    return np.asarray(points.position)


def _contour() -> tuple[Table, tuple[Headline, ...]]:
    path = cases.butterfly()
    s = np.linspace(0.0, path.length, SAMPLES)
    position = path(s) + OFF * np.column_stack([np.sin(s), np.cos(s)])
    meter = ContourMeter(path)
    calls = {
        "near the commanded point": lambda: meter.measure(position, s_hint=s),
        "whole path": lambda: meter.measure(position),
    }
    times = interleaved(calls, 3)
    rows = tuple((name, each.least, 1e9 * each.least / SAMPLES) for name, each in times.items())
    columns = (Column("nearest point"), Column("s", ".2f"), Column("ns a sample", ",.0f"))
    notes = (f"{SAMPLES:,} samples in order, {1e3 * OFF:g} um off the butterfly (48 spans).",)
    worst = max(each.least for each in times.values())
    line = Headline(
        "contour error of a million samples against 48 spans", f"{worst:.2f} s", f"{CONTOUR_TARGET:g} s",
        worst < CONTOUR_TARGET,
    )  # fmt: skip
    return Table("Contour error.", columns, rows, notes), (line,)


def _jobs() -> tuple[Table, tuple[Headline, ...]]:
    found = [child.outcome("servo", "job", hours) for hours in HOURS]
    rows = tuple(
        (each["hours"], each["ticks"], each["peak"] / 1e6, each["seconds"], 1e9 * each["seconds"] / each["ticks"] / 3)
        for each in found
    )
    columns = (
        Column("hours at 1 ms", "g"),
        Column("ticks", ",d"),
        Column("peak memory, MB", ",.0f"),
        Column("s", ",.0f"),
        Column("ns an axis and tick", ",.0f"),
    )
    notes = (
        "Laps on a closed curve of x, y and theta followed by xytheta, full model, contour error and tally included, "
        "each job in a process of its own.",
    )
    last = found[-1]
    line = Headline(
        f"{last['hours']:g} hours at 1 ms on three axes, followed and measured",
        f"{last['peak'] / 1e6:.0f} MB, {last['seconds']:.0f} s",
        "flat memory",
        last["peak"] - found[0]["peak"] < FLAT,
    )
    return Table("Long jobs.", columns, rows, notes), (line,)


def job(hours: float) -> dict[str, Any]:
    """Follow setpoints of at least so many hours at 1 ms, chunk by chunk; called in a process of its own."""
    path = _closed()
    limits = sf.Limits(feed=60.0, acceleration=500.0, jerk=20000.0)
    points = sf.run(path, limits, period=cases.PERIOD).points
    wanted = round(3600.0 * hours / cases.PERIOD)
    machine = Servo(sf.Machine.load("xytheta"), points, path)
    start = time.perf_counter()
    for _ in follow_chunks(_laps(points, wanted), machine):
        pass
    assert machine.stopped is None, machine.stopped
    return {
        "hours": hours,
        "ticks": machine.tally.ticks,
        "seconds": time.perf_counter() - start,
        "peak": peak_memory(),
        "contour": machine.tally.numbers()["contour_error_max_mm"],
    }


def _laps(points: sf.Setpoints, wanted: int) -> Iterator[sf.Setpoints]:
    """Laps of a closed motion, from rest to rest, one after the other, in chunks of whole laps."""
    laps = max(1, CHUNK // (len(points) - 1))
    body = points.part(0, len(points) - 1)
    names = ("t", "curve", "u", "s", "feed", "position")
    block = replace(body, **{name: np.concatenate([getattr(body, name)] * laps) for name in names})
    even = cases.PERIOD * np.arange(len(block))
    done = 0
    while done < wanted:
        yield replace(block, t=even + cases.PERIOD * done)
        done += len(block)


def _closed() -> sf.Path:
    """A smooth closed curve of x, y, mm, and theta, rad, without a joint that rests."""
    angle = np.linspace(0.0, 2.0 * np.pi, 25)
    points = np.column_stack([60.0 * np.cos(angle), 35.0 * np.sin(angle), np.sin(angle)])
    points[-1] = points[0]
    knots = [0.0] * 3 + list(np.linspace(0.0, 1.0, 23)) + [1.0] * 3
    return sf.Path([sf.NurbsCurve(3, knots, points)], ("x", "y", "theta"), name="closed")
