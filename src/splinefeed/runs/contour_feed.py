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
    """One simulated run under limits scaled by `scale`; feed is the highest of its law, mm/s.

    error, rms  contour error, mm; at_s  where it is largest, mm; stopped  why an axis ran away, or None
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
    """Trials by increasing scale, and the best that keeps the tolerance, mm, its setpoints and the machine's response.

    notes  what the search found that is unusual, and those of the law, one sentence each
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
    """The limits of the same motion in 1 / scale of its time: velocities by scale, accelerations by scale^2, jerks ^3.

    vary="feed": the feed along the path alone. Chord error and travel are lengths, and stay.
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
    """The fastest motion along `path`, of those under `limits` scaled down, whose contour error keeps `tolerance`, mm.

    Each trial plans, interpolates, and lets the machine follow. Friction, counts and saturation make the error a
    non-monotone function of the feed. So scales from 1 to LOWEST in equal ratios come first; the highest that keeps the
    tolerance is bracketed by the next one above, which does not, and the boundary between them is halved until it is
    known within CLOSE_ENOUGH. The result is a trial that was simulated, never interpolated between two.
    Raises what `plan`, `interpolate` and `follow` raise, and LimitsError for a tolerance that is not positive.
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
