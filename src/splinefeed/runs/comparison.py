"""Methods side by side: every one on the same law, and those of the paper's experiment on its machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from splinefeed.analysis.measures import chord_errors, drift, feed_ripple
from splinefeed.interpolation import registry
from splinefeed.interpolation.interpolator import Interpolator, interpolate
from splinefeed.machine.machine import Machine
from splinefeed.paths.path import Path
from splinefeed.records import Array, TimeLaw, positive, view
from splinefeed.runs.following import Servo, serve
from splinefeed.runs.run import check_ticks

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
#: The machine of the paper as we model it, the methods that it compares and last the one that its setpoints are made
#: by here, and the largest error it measured, mm.
PAPER_MACHINE = "xytheta"
PAPER_METHODS = ("taylor-2", "milne-simpson", "milne-simpson-anchored")
PAPER_ERROR = 0.01218
#: Methods whose contour errors differ by less than this share of the largest count as the same.
SAME = 0.05


@dataclass(frozen=True)
class MethodResult:
    """What one interpolation method did.

    Attributes
    ----------
    method, title : str
        Its name, and in words.
    ripple_max, ripple_rms, ripple_floor : float
        Relative feed error of the steps, and the part due to the rounding of s alone.
    drift_mm : float
        How far it was ahead of the law at the end (behind: negative), runs beyond the path's end included.
    drift_max_mm : float
        The largest |drift| on the way.
    chord_error_mm : float
        Largest, to the true curve.
    ns_per_tick : float or None
        Time of a setpoint, point included, by the compiled loop on this machine, if it was timed.
    replaced : int
        Steps without a finite result.

    References
    ----------
    .. [1] docs/math/interpolators.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.circle(radius=10)
    >>> law = sf.plan(path, sf.Limits(feed=50, acceleration=1000, jerk=50000), period=1e-3)
    >>> result = next(sf.runs.compare(path, law, methods="taylor-1", timed=False)).result
    >>> result.title, result.replaced
    ('Taylor, first order', 0)
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
    """A result with its ripple over time.

    Attributes
    ----------
    result : MethodResult
        What the method did.
    t, relative : array (m,)
        Start of each step, s, and the relative error of its feed: |step / planned step - 1|.

    References
    ----------
    .. [1] docs/math/interpolators.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.circle(radius=10)
    >>> law = sf.plan(path, sf.Limits(feed=50, acceleration=1000, jerk=50000), period=1e-3)
    >>> trace = next(sf.runs.compare(path, law, methods="taylor-1", timed=False))
    >>> bool(trace.relative.max() == trace.result.ripple_max)
    True
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
    """Run each method over the whole motion and measure it.

    Parameters
    ----------
    path, law : Path, TimeLaw
        The motion.
    period : float, optional
        Of the servo, s; the law's by default.
    methods : str or iterable of str, optional
        Their names, or one name; all by default.
    corrections, tolerance : int, float, optional
        As for `interpolate`.
    timed : bool, optional
        Whether the time of a setpoint is measured: each method is compiled for it, and run again and again.

    Yields
    ------
    MethodTrace
        One at a time, in the given order; errors in mm, times in ns.

    Raises
    ------
    LimitsError
        For more than MOST_TICKS ticks; and what `Interpolator` raises, before the first method runs.

    References
    ----------
    .. [1] docs/math/interpolators.md names the papers of the methods.

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.circle(radius=10)
    >>> law = sf.plan(path, sf.Limits(feed=50, acceleration=1000, jerk=50000), period=1e-3)
    >>> for trace in sf.runs.compare(path, law, methods=["taylor-1", "arc-length"], timed=False):
    ...     print(trace.result.method, trace.result.ripple_max < 1e-9)
    taylor-1 False
    arc-length True
    """
    if period is not None or law.period is not None:
        check_ticks(law, positive(law.period if period is None else period, "period"))
    names = registry.methods() if methods is None else (methods,) if isinstance(methods, str) else tuple(methods)
    for name in names:
        registry.method(name)
    for name in names:
        how: dict[str, Any] = {"period": period, "method": name, "corrections": corrections, "tolerance": tolerance}
        fresh = partial(Interpolator, path, law, **how, compiled=timed)
        source = fresh()
        setpoints = source.block()
        ripple = feed_ripple(setpoints, path, law)
        ahead = drift(setpoints, law, path)
        result = MethodResult(
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
        )
        yield MethodTrace(result, ripple.t, ripple.relative)


def _seconds(fresh: Callable[[], Interpolator]) -> float:
    times: list[float] = []
    while sum(times) <= TIMING and len(times) < TIMING_RUNS:
        again = fresh()
        start = time.perf_counter()
        again.block()
        times.append(time.perf_counter() - start)
    return min(times)


def serve_methods(
    path: Path, law: TimeLaw, machine: Machine, methods: Iterable[str] = PAPER_METHODS, corrections: int = 1
) -> Iterator[Servo]:
    """Let a machine follow the same motion by one method after the other.

    Parameters
    ----------
    path, law : Path, TimeLaw
        The motion.
    machine : Machine
        That follows.
    methods : iterable of str, optional
        Their names; those of the paper by default.
    corrections : int, optional
        As for `interpolate`.

    Yields
    ------
    Servo
        What the machine did, by each method.
    """
    for method in methods:
        yield serve(path, law, interpolate(path, law, method=method, corrections=corrections), machine)


def comparison(served: list[Servo]) -> dict[str, Any]:
    """How far the methods are apart on this machine, beside the error that the servo makes itself, mm."""
    errors = [each.tally.contour.value for each in served if each.tally.contour is not None]
    spread = max(errors) - min(errors)
    return {
        "contour_error_least_mm": min(errors),
        "contour_error_largest_mm": max(errors),
        "spread_share": spread / max(errors) if max(errors) > 0.0 else 0.0,
        "setpoints_off_law_largest_mm": max(each.off_law for each in served),
        "method_matters": spread > SAME * max(errors),
    }


def experiment(served: list[Servo]) -> dict[str, Any]:
    """The paper's experiment: what is measured and assumed, and whether the choice of the method matters."""
    main, found = served[-1], comparison(served)
    assert main.path is not None
    name, (axis, worst), half = main.machine.name, main.tally.worst_linear(), 0.5 * main.path.length
    place = ""
    if worst.s is not None:
        place = f", {abs(worst.s - half):.2f} mm {'behind' if worst.s > half else 'before'} the nose"
    verdict = "matters" if found["method_matters"] else "is negligible next to the following error"
    return {
        "paper_error_mm": PAPER_ERROR,
        "largest_error_mm": worst.value,
        "largest_error_axis": axis,
        "largest_error_at": {"t_s": worst.t, "s_mm": worst.s},
        "methods": [each.numbers() for each in served],
        **found,
        "sentences": [
            f"model: {name}, simulated; the paper gives gains, encoders, scales and card, but not the plant: "
            f"speed per volt, lag, masses and friction are assumptions (splinefeed machine show {name})",
            f"measurement: the paper's {PAPER_ERROR * 1e3:.2f} um, the largest of its axes, where the arc begins; here "
            f"it is {worst.value * 1e3:.2f} um on {axis}{place}: {worst.value / PAPER_ERROR:.1f} times as much, an "
            f"effect of the plant, not of the interpolator",
            f"finding: on this machine the choice of the interpolator {verdict}: their contour errors are "
            f"{found['contour_error_least_mm'] * 1e3:.2f} to {found['contour_error_largest_mm'] * 1e3:.2f} um, "
            f"{found['spread_share']:.1%} apart, and their setpoints at most "
            f"{found['setpoints_off_law_largest_mm'] * 1e3:.2f} um off the time law",
        ],
    }


def servo_numbers(served: list[Servo], of_paper: bool = False) -> dict[str, Any]:
    """Give the numbers of `run` for a machine.

    Parameters
    ----------
    served : list of Servo
        Its errors are those of the last one.
    of_paper : bool, optional
        Whether it is the paper's experiment, of which the errors of all are given.

    Returns
    -------
    dict of str to object
        As `--json` prints them; mm, rotary axes rad.
    """
    main = served[-1]
    numbers = {"machine": main.machine.name, **main.tally.numbers(), "servo_notes": list(main.notes)}
    return numbers | ({"experiment": experiment(served)} if of_paper else {})
