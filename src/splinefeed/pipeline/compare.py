"""Every interpolation method on the same path and law, measured the same way."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from splinefeed.analysis.measures import chord_errors, drift, feed_ripple
from splinefeed.geometry.path import Path
from splinefeed.interpolation import registry
from splinefeed.interpolation.interpolator import Interpolator
from splinefeed.pipeline.run import check_ticks
from splinefeed.records import Array, TimeLaw, positive, view

#: A method is timed until it has run this long, s, or this often; the fastest counts.
TIMING = 0.02
TIMING_RUNS = 50


#: Methods that a run is set beside: the paper's, the classical ones and ours; the others are left to `compare`.
BESIDE_A_RUN = (
    "taylor-1",
    "taylor-2",
    "runge-kutta-4",
    "adams-bashforth-moulton",
    "hamming",
    "milne-simpson",
    "milne-simpson-anchored",
    "arc-length",
)


@dataclass(frozen=True)
class MethodResult:
    """What one interpolation method did.

    ripple_max, ripple_rms  relative feed error of the steps; ripple_floor  the part due to the rounding of s alone
    drift_mm        how far it was ahead of the law at the end (behind: negative), runs beyond the path's end included
    drift_max_mm    the largest |drift| on the way; chord_error_mm  largest, to the true curve
    ns_per_tick     time of a setpoint, point included, by the compiled loop on this machine, if it was timed
    replaced        steps without a finite result
    Source: docs/math/interpolators.md.
    Example: `next(sf.compare(path, law, methods=["taylor-2"], timed=False)).result.as_dict()`
    """

    method: str
    title: str
    ripple_max: float
    ripple_rms: float
    ripple_floor: float
    drift_mm: float
    drift_max_mm: float
    chord_error_mm: float
    ns_per_tick: float | None
    replaced: int

    def as_dict(self) -> dict[str, Any]:
        """Names and values, as `compare --json` prints them."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class MethodTrace:
    """A result with its ripple over time: t (m,), s, and relative (m,).

    Source: docs/math/interpolators.md.
    Example: `next(sf.compare(path, law, methods=["taylor-2"], timed=False)).result.ripple_max`
    """

    result: MethodResult
    t: Array
    relative: Array

    def _repr_html_(self) -> str:
        result = self.result
        rows = {
            "method": f"{result.method}: {result.title}",
            "feed ripple": f"at most {result.ripple_max:.3g}, rms {result.ripple_rms:.3g}",
            "drift": f"{result.drift_mm:.3g} mm at the end",
            "chord error": f"at most {result.chord_error_mm:.3g} mm",
        }
        return view.table(rows, view.sparkline(self.relative, "relative feed error over time"))


def compare(
    path: Path,
    law: TimeLaw,
    *,
    period: float | None = None,
    methods: str | Iterable[str] | None = None,
    corrections: int = 1,
    tolerance: float = 0.0,
    timed: bool = True,
) -> Iterator[MethodTrace]:
    """Run each method over the whole motion and measure it; one trace at a time, in the given order (default: all).

    methods  their names, or one name
    timed    also measures the time of a setpoint: each method is compiled for it, and run again and again
    Raises what `Interpolator` raises, before the first method runs, and LimitsError for more than MOST_TICKS ticks.
    period in s, the law's by default; errors in mm, times in ns. Source: docs/math/interpolators.md names the papers.
    Example: `[trace.result for trace in sf.compare(path, law, methods=["taylor-2", "arc-length"], timed=False)]`
    """
    if period is not None or law.period is not None:
        check_ticks(law, positive(law.period if period is None else period, "period"))
    names = registry.methods() if methods is None else (methods,) if isinstance(methods, str) else tuple(methods)
    for name in names:
        registry.method(name)
    for name in names:
        yield _measure(path, law, period, name, corrections, tolerance, timed)


def _measure(
    path: Path, law: TimeLaw, period: float | None, name: str, corrections: int, tolerance: float, timed: bool
) -> MethodTrace:
    def fresh() -> Interpolator:
        return Interpolator(
            path, law, period=period, method=name, corrections=corrections, tolerance=tolerance, compiled=timed
        )

    source = fresh()
    setpoints = source.block()
    ripple = feed_ripple(setpoints, path, law)
    ahead = drift(setpoints, law)
    return MethodTrace(
        MethodResult(
            method=name,
            title=registry.method(name).title,
            ripple_max=ripple.max,
            ripple_rms=ripple.rms,
            ripple_floor=ripple.floor,
            drift_mm=float(ahead[-1]) + source.overrun,
            drift_max_mm=float(np.max(np.abs(ahead))),
            chord_error_mm=float(np.max(chord_errors(setpoints, path), initial=0.0)),
            ns_per_tick=1e9 * _seconds(fresh) / len(setpoints) if timed else None,
            replaced=source.replaced,
        ),
        ripple.t,
        ripple.relative,
    )


def _seconds(fresh: Callable[[], Interpolator]) -> float:
    best = np.inf
    spent = 0.0
    for _ in range(TIMING_RUNS):
        again = fresh()
        start = time.perf_counter()
        again.block()
        took = time.perf_counter() - start
        best = min(best, took)
        spent += took
        if spent > TIMING:
            break
    return float(best)
