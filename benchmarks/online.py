"""The online object: one tick at a time, called from Python as a controller's loop would."""

from __future__ import annotations

import gc
import time

import numpy as np

from benchmarks import cases
from benchmarks.tables import Column, Headline, Report, Table
from splinefeed.interpolation.interpolator import Interpolator
from splinefeed.interpolation.registry import DEFAULT_METHOD

TICKS = 1_000_000
METHODS = (DEFAULT_METHOD, "milne-simpson", "arc-length")
#: The middle one of all steps may take this long, us.
TARGET = 5.0


def measure() -> Report:
    """Microseconds of `Interpolator.step()`: the middle one, the slowest of a thousand and the slowest of all."""
    columns = (
        Column("method"),
        Column("ticks", ",d"),
        Column("median, us", ".2f"),
        Column("99.9 % below, us", ".1f"),
        Column("worst, us", ",.0f"),
    )
    notes = (
        f"Laps on the butterfly at {cases.FAST.feed:g} mm/s and {1e3 * cases.PERIOD:g} ms; each step timed by itself, "
        f"the clock's own {_clock():.2f} us included; garbage collection off. The worst step is what an ordinary "
        "operating system and the machine's other work made of it.",
    )
    rows = tuple(_row(method) for method in METHODS)
    _, ticks, median, _, worst = rows[0]
    headline = Headline(
        "one `Interpolator.step()` from Python",
        f"{median:.1f} us median, {worst:,.0f} us the worst of {ticks:,}",
        f"{TARGET:g} us median",
        median < TARGET,
    )
    return Report((Table("`Interpolator.step()` from Python.", columns, rows, notes),), (headline,))


def _row(method: str) -> tuple[str, int, float, float, float]:
    nanoseconds = step_times(method, TICKS)
    return (
        method,
        len(nanoseconds),
        float(np.median(nanoseconds)) / 1e3,
        float(np.quantile(nanoseconds, 0.999)) / 1e3,
        float(np.max(nanoseconds)) / 1e3,
    )


def step_times(method: str, ticks: int) -> np.ndarray:
    """Nanoseconds of each of at least `ticks` steps, in whole laps."""
    path = cases.butterfly()
    law = cases.law()
    lap = Interpolator(path, law, method=method).ticks
    times = np.empty((-(-ticks // lap), lap), dtype=np.int64)
    clock = time.perf_counter_ns
    Interpolator(path, law, method=method, compiled=True).step()
    collecting = gc.isenabled()
    gc.disable()
    try:
        for row in times:
            step = Interpolator(path, law, method=method, compiled=True).step
            for i in range(lap):
                start = clock()
                step()
                row[i] = clock() - start
    finally:
        if collecting:
            gc.enable()
    return times.ravel()


def _clock() -> float:
    """What two readings of the clock are apart, us, when nothing happens between them."""
    clock = time.perf_counter_ns
    return float(np.median([-(clock() - clock()) for _ in range(10_000)])) / 1e3
