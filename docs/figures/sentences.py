"""Make single sentences with numbers anew, each between its markers on its page: all, or those whose names are given.

A sentence is a function under `tells`, with its name and its page; all of them together take a few seconds.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from marked import words, write

import splinefeed as sf
from splinefeed.errors import InputError
from splinefeed.formats import bit_pattern
from splinefeed.runs import pulses

from benchmarks import cases, curves  # isort: skip - marked knows where

#: Function and page of each sentence, by name.
SENTENCES: dict[str, tuple[Callable[[], str], str]] = {}
PERIOD = 1e-3
LIMITS = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
#: A pulse clock that is not enough for the paper's airfoil, slots a period.
TOO_FEW = 128
#: Cells of a window of look-ahead, the largest first.
WINDOWS = (600, 300, 150, 60)


def tells(name: str, page: str) -> Callable[[Callable[[], str]], Callable[[], str]]:
    """Enter a function as the one that makes the sentence of that name on that page of docs/."""

    def entered(made: Callable[[], str]) -> Callable[[], str]:
        SENTENCES[name] = made, page
        return made

    return entered


def airfoil() -> sf.runs.run.Run:
    """The paper's airfoil, planned as the paper does, with its setpoints."""
    return sf.run(sf.shapes.naca("0025", perimeter=33))


@tells("pieces", "math/arc-length.md")
def pieces() -> str:
    """Pieces of the butterfly."""
    return words(
        f"""The butterfly takes {len(sf.shapes.butterfly().table)} pieces; how long that takes is
        [measured](../benchmarks/setpoints.md#interpolation)."""
    )


@tells("nose", "math/seven-phase.md")
def nose() -> str:
    """What an axis sees at the nose of the airfoil."""
    run = airfoil()
    share = run.axis_peaks()["x"]["acceleration_share"]
    return words(
        f"""At the nose of the paper's airfoil (least radius {run.path.minimum_radius():.2f} mm,
        {run.points.feed.max():.0f} mm/s) an axis sees {share:.1f} times the A of the profile."""
    )


@tells("pulses", "bit-pattern.md")
def slots() -> str:
    """Slots and pulses of the airfoil on the paper's table."""
    points = airfoil().points
    scales = pulses.pulses_of(sf.Machine.load("xytheta"), points.axes)
    pattern, numbers = pulses.pulse_words(points, scales)
    fastest, sent = numbers["fastest"], numbers["pulses_plus"]
    assert numbers["off_max_pulses"] <= 0.5
    assert sent == numbers["pulses_minus"]
    return words(
        f"""The second line says, for the paper's airfoil on its table with {scales["x"]:g} encoder counts a millimetre:
        {pattern.slots_per_period} slots a millisecond ({pattern.pulse_clock / 1e3:g} kHz) are enough, the fastest
        period has {fastest["pulses"]} pulses of {fastest["axis"].upper()} after tick {fastest["tick"]}, X gets
        {sent["x"]} pulses each way and Y {sent["y"]}, and no setpoint is missed by more than half a pulse."""
    )


@tells("slow-clock", "bit-pattern.md")
def slow_clock() -> str:
    """The error where a clock is too slow."""
    points = airfoil().points
    try:
        bit_pattern.encode(points, pulses.pulses_of(sf.Machine.load("xytheta"), points.axes), TOO_FEW)
    except InputError as error:
        return words(
            f"With `--clock {TOO_FEW / PERIOD / 1e3:g}kHz` the airfoil is refused: `{str(error).split(' (')[0]} ...`."
        )
    raise AssertionError(f"{TOO_FEW} slots are enough")


@tells("velocities", "setpoint-files.md")
def velocities() -> str:
    """How well the velocities of a PVT table are those of the path."""
    path, limits = sf.shapes.butterfly(), sf.Limits(feed=60, acceleration=500, jerk=20000)
    points = sf.run(path, limits, period=PERIOD).points
    with tempfile.TemporaryDirectory() as folder:
        sf.save(points, Path(folder) / "butterfly.pvt")
        rows = np.loadtxt(Path(folder) / "butterfly.pvt", delimiter=",")
    tangent = path.evaluate(points.curve, points.u, 1)[1:, 1]
    exact = tangent / np.linalg.norm(tangent, axis=1, keepdims=True) * points.feed[1:, None]
    error = np.linalg.norm(rows[:, 2::2] - exact, axis=1) / limits.feed
    return words(
        f"""On the butterfly at {limits.feed:g} mm/s, {limits.acceleration:g} mm/s^2, {limits.jerk:g} mm/s^3 and 1 ms
        their error against the path's own tangent is {np.median(error):.0e} of the feed in the median and
        {np.quantile(error, 0.99):.0e} at 99 of 100 ticks; at its sharpest tips, where the tool turns within a few
        ticks, it reaches {100.0 * error.max():.0f} %: there, use a shorter period."""
    )


@tells("windows", "math/planner.md")
def windows() -> str:
    """What smaller windows cost."""
    longest = []
    for path in (sf.shapes.butterfly(), sf.shapes.naca("0025", perimeter=33)):
        times = []
        for cells in WINDOWS:
            planner = sf.planner.LookAhead(LIMITS, PERIOD, path.axes, cells)
            last = [*planner.push(path), *planner.finish()][-1]
            times.append(last.time + last.law.duration)
        longest.append(max(times) / min(times) - 1.0)
    return words(
        f"""A smaller window costs little time: with {", ".join(map(str, WINDOWS[:-1]))} and {WINDOWS[-1]} cells the
        times differ by {100.0 * max(longest):.1f} % at most on the butterfly and the airfoil ({LIMITS.feed:g} mm/s,
        axes {LIMITS.axis_acceleration:g} mm/s^2 and {LIMITS.axis_jerk:g} mm/s^3). It must only be long enough to stop
        in, or the feed comes down to what it allows."""
    )


@tells("bound", "math/planner.md")
def bound() -> str:
    """How close the lower bound comes."""
    shapes = {"butterfly": cases.butterfly(), "airfoil12": cases.airfoil12()}
    shapes |= {name: getattr(curves, name)() for name in ("trident", "star", "heart")}
    known = cases.BEST | curves.REFERENCE
    gaps, over = {}, []
    for name, path in shapes.items():
        for setting in cases.SETTINGS:
            law = sf.plan(path, cases.axis_limits(setting), strategy="time-optimal", bound=True)
            gaps[name, setting] = 100.0 * (1.0 - law.settings["lower_bound_s"] / law.duration)
            over.append(100.0 * (law.settings["lower_bound_s"] / known[name, setting] - 1.0))
    middle = sorted(gaps.values())[len(gaps) // 2]
    worst = max(gaps, key=lambda case: gaps[case])
    return words(
        f"""On {len(shapes)} smooth curves under {len(cases.SETTINGS)} sets of limits it is {min(gaps.values()):.1f} to
        {max(gaps.values()):.1f} % below the plan (median {middle:.1f} %, most on the {worst[0]}, {worst[1]}), and
        {"never" if max(over) < 0.0 else "once at least"} above the best known time."""
    )


if __name__ == "__main__":
    for name in sys.argv[1:] or SENTENCES:
        made, page = SENTENCES[name]
        write(page, "sentences", name, made())
