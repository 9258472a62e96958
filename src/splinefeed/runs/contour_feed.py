"""The highest feed at which a machine keeps a contour tolerance, found by simulating it at many feeds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.interpolation.interpolator import interpolate
from splinefeed.interpolation.registry import DEFAULT_METHOD
from splinefeed.machine.machine import Machine
from splinefeed.paths.path import Path
from splinefeed.planner.planning import plan
from splinefeed.records import Limits, Setpoints, TimeLaw, order_of, positive
from splinefeed.runs.following import Servo, serve
from splinefeed.runs.result import MOST_TICKS
from splinefeed.runs.run import check_ticks

#: Scales that are tried first, from 1 down to LOWEST in equal ratios, and where the search for the boundary ends.
GRID = 10
LOWEST = 0.05
CLOSE_ENOUGH = 1.002
#: What may be scaled: all limits as one stretches time, or the feed alone.
VARY = ("all", "feed")
_FEEDS = ("feed", "start_feed", "end_feed")


@dataclass(frozen=True, eq=False)
class Trial:
    """One simulated run under limits that are scaled.

    Parameters
    ----------
    scale : float
        Of the limits, 1 as they are given.
    limits, law : Limits, TimeLaw
        Of this run.
    feed : float
        The highest of its law, mm/s.
    duration : float
        In s.
    error, rms : float
        Contour error, the largest and the root mean square, mm.
    at_s : float or None
        Where it is largest, mm.
    stopped : str or None
        Why an axis ran away, or None.
    """

    scale: float
    limits: Limits
    law: TimeLaw
    feed: float
    duration: float
    error: float
    rms: float
    at_s: float | None
    stopped: str | None

    def keeps(self, tolerance: float) -> bool:
        """Whether the contour error stays within the tolerance, mm, and no axis runs away."""
        return self.stopped is None and self.error <= tolerance

    def numbers(self) -> dict[str, Any]:
        """What `--json` prints."""
        return {
            "scale": self.scale,
            "feed_limit_mm_s": self.limits.feed,
            "feed_max_mm_s": self.feed,
            "duration_s": self.duration,
            "contour_error_max_mm": self.error,
            "contour_error_rms_mm": self.rms,
            "at_s_mm": self.at_s,
            "stopped": self.stopped,
        }


@dataclass(frozen=True, eq=False)
class FeedTuning:
    """Trials of a search for the fastest motion, and the best.

    Parameters
    ----------
    tolerance : float
        Of the contour error, mm.
    trials : tuple of Trial
        By increasing scale.
    best : Trial or None
        The one with the highest scale that keeps the tolerance; None where none does.
    setpoints, served : Setpoints, Servo, or None
        Of the best one, and what the machine did.
    notes : tuple of str
        What the search found that is unusual, and those of the law, one sentence each.
    """

    tolerance: float
    trials: tuple[Trial, ...]
    best: Trial | None
    setpoints: Setpoints | None
    served: Servo | None
    notes: tuple[str, ...]

    @property
    def least(self) -> Trial:
        """The trial with the least contour error of those that no axis ran away in, or of all."""
        sound = [trial for trial in self.trials if trial.stopped is None]
        return min(sound or self.trials, key=lambda trial: trial.error)

    def numbers(self) -> dict[str, Any]:
        """What `--json` prints."""
        return {
            "ok": self.best is not None,
            "contour_tolerance_mm": self.tolerance,
            "best": None if self.best is None else self.best.numbers(),
            "limits": None if self.best is None else self.best.limits.as_dict(),
            "trials": [trial.numbers() for trial in self.trials],
            "notes": list(self.notes),
        }


def scaled(limits: Limits, scale: float, vary: str = "all") -> Limits:
    """Scale limits so that the same motion takes 1 / scale of its time.

    Parameters
    ----------
    limits : Limits
        To be scaled.
    scale : float
        Of time: velocities are multiplied by it, accelerations by its square, jerks by its cube. Chord error and travel
        are lengths, and stay.
    vary : str, optional
        "all", or "feed": the feed along the path alone.

    Returns
    -------
    Limits
        The scaled ones.

    Raises
    ------
    InputError
        For another `vary`, and for "feed" without a feed.
    """
    if vary not in VARY:
        raise InputError(f"vary is {vary!r}; choose one of {', '.join(VARY)}")
    flat = limits.as_dict()
    for key in flat:
        if vary == "all" or key in _FEEDS:
            flat[key] *= scale ** order_of(key)
    if vary == "feed" and "feed" not in flat:
        raise InputError("there is no feed along the path to vary; give a feed, or let all limits vary")
    return Limits.from_dict(flat)


def tune_feed(
    path: Path, limits: Limits, machine: Machine, tolerance: float, *, period: float, strategy: str | None = None,
    method: str = DEFAULT_METHOD, corrections: int = 1, vary: str = "all",
    on_progress: Callable[[str], None] | None = None,
) -> FeedTuning:  # fmt: skip
    """Find the fastest motion along a path, of those under scaled limits, whose contour error keeps a tolerance.

    Parameters
    ----------
    path : Path
        To drive along.
    limits : Limits
        Of the motion at scale 1.
    machine : Machine
        That follows it, simulated.
    tolerance : float
        Of the contour error, mm.
    period : float
        Of the servo, s.
    strategy : str, optional
        As for `plan`.
    method, corrections : str, int, optional
        As for `interpolate`.
    vary : str, optional
        As for `scaled`.
    on_progress : callable, optional
        Called with what is being tried, in words.

    Returns
    -------
    FeedTuning
        With every trial, and the best.

    Raises
    ------
    LimitsError
        For a tolerance that is not positive, and for too many ticks; and what `plan`, `interpolate` and `follow` raise.

    Notes
    -----
    Each trial plans, interpolates, and lets the machine follow. Friction, counts and saturation make the error a
    non-monotone function of the feed. So scales from 1 to LOWEST in equal ratios come first; the highest that keeps the
    tolerance is bracketed by the next one above, which does not, and the boundary between them is halved until it is
    known within CLOSE_ENOUGH. The result is a trial that was simulated, never interpolated between two.
    """
    allowed = positive(tolerance, "contour tolerance")
    for axis in path.axes:
        if axis in machine.axes:
            machine.servo_axis(axis)
    found: dict[float, Trial] = {}
    kept: list[tuple[Trial, Setpoints, Servo]] = []  # the best so far

    def attempt(scale: float) -> Trial:
        if on_progress is not None:
            on_progress(f"trial {len(found) + 1}: {scale:.4g} of the limits")
        lower = scaled(limits, scale, vary)
        law = plan(path, lower, strategy=strategy, period=period)
        check_ticks(law, period)
        setpoints = interpolate(path, law, period=period, method=method, corrections=corrections)
        served = serve(path, law, setpoints, machine)
        tally, contour = served.tally, served.tally.contour
        assert contour is not None  # there is a path
        trial = found[scale] = Trial(
            scale, lower, law, float(np.max(setpoints.feed)), law.duration,
            contour.value, contour.rms, contour.s, tally.stopped,
        )  # fmt: skip
        if trial.keeps(allowed) and (not kept or scale >= kept[0][0].scale):
            kept[:] = [(trial, setpoints, served)]
        return trial

    notes = []
    for scale in (LOWEST ** (i / (GRID - 1)) for i in range(GRID)):
        least = min(found, default=1.0)
        if found and found[least].duration / period * (least / scale) > MOST_TICKS:
            notes.append(f"scales below {least:.3g} would take more than {MOST_TICKS} ticks and were not tried")
            break
        attempt(scale)
    low = kept[0][0].scale if kept else None
    high = min((scale for scale in found if low is not None and scale > low), default=None)
    while low is not None and high is not None and high / low > CLOSE_ENOUGH:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if attempt(middle).keeps(allowed) else (low, middle)
    trials = tuple(found[scale] for scale in sorted(found))
    best, setpoints, served = kept[0] if kept else (None, None, None)
    if best is not None:
        holes = [trial for trial in trials if trial.scale < best.scale and not trial.keeps(allowed)]
        if holes:
            feeds = ", ".join(f"{trial.feed:.4g}" for trial in holes)
            notes.append(f"slower is not always better here: at top feeds of {feeds} mm/s the tolerance is exceeded")
        if best.scale == 1.0:
            notes.append("the given limits keep the tolerance already; raise them to go faster")
    notes += (trials[0] if best is None else best).law.notes
    return FeedTuning(allowed, trials, best, setpoints, served, tuple(notes))
