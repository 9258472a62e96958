"""`plan`: from a path and limits to a time law, by a strategy of that name."""

from __future__ import annotations

import dataclasses
import difflib
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from splinefeed.errors import CurveError, InputError
from splinefeed.feed.look_ahead import plan_look_ahead
from splinefeed.feed.look_ahead_window import STRATEGY as LOOK_AHEAD
from splinefeed.feed.seven_phase import STRATEGY, Stretched, plan_seven_phase
from splinefeed.feed.soft_limits import check_travel
from splinefeed.feed.stretches import check_ends, close_gaps, with_dwells
from splinefeed.feed.time_optimal import STRATEGY as TIME_OPTIMAL
from splinefeed.feed.time_optimal import plan_time_optimal
from splinefeed.geometry.path import Path
from splinefeed.records import Limits, TimeLaw, positive

#: A strategy makes a law for a path whose stops and length were checked, under limits, for a period in s or none.
#: What else it asks of the path is its own affair, hence Any.
Strategy = Callable[[Any, Limits, float | None], TimeLaw]

#: Every strategy by the name that `plan` and the command line know it by; a new one is one entry.
STRATEGIES: dict[str, Strategy] = {
    STRATEGY: plan_seven_phase,
    LOOK_AHEAD: plan_look_ahead,
    TIME_OPTIMAL: plan_time_optimal,
}


def plan(path: Stretched, limits: Limits, strategy: str = STRATEGY, period: float | None = None) -> TimeLaw:
    """Time law s(t) of a motion along `path` that obeys `limits`, resting at the path's stops.

    path      a Path, whose feeds and dwells count besides; for "seven-phase" anything with `length` (mm) and `stops`
              (arc lengths inside it, mm, where the tangent jumps)
    strategy  a name in STRATEGIES; "seven-phase" obeys the tangential limits only, not those of the axes
    period    servo period in s: stops and end are made to fall on ticks; None leaves the law as fast as it can be

    Where a tick cannot be met (start_feed = end_feed = feed), the law's `notes` say so. Where the path waits, the law
    has a piece of constant s, whole periods long.
    Raises CurveError (no length, stops not inside), InputError (unknown strategy), LimitsError (period not
    positive, or longer than the motion; the path leaves the travel of an axis; feeds at the ends that the path
    contradicts), PlanError (a stretch too short for its change of feed).
    """
    if strategy not in STRATEGIES:
        close = difflib.get_close_matches(str(strategy), STRATEGIES, n=1)
        hint = f"did you mean {close[0]!r}? The known ones are" if close else "the known ones are"
        raise InputError(f"strategy {strategy!r} is not known; {hint}: {', '.join(sorted(STRATEGIES))}")
    if period is not None:
        period = positive(period, "period")
    _check_path(path)
    if isinstance(path, Path):
        check_travel(path, limits)
        check_ends(path, limits)
    law = STRATEGIES[strategy](path, limits, period)
    if isinstance(path, Path):
        law = with_dwells(law, path.dwells, path.length)
    law = close_gaps(law)
    return dataclasses.replace(
        law, settings={**law.settings, "limits": limits.as_dict(), "strategy": strategy, "period": period}
    )


def _check_path(path: Stretched) -> None:
    """Raise CurveError unless the path has a length and its stops lie inside it, in order."""
    if not (math.isfinite(path.length) and path.length > 0.0):
        raise CurveError(
            f"the path has a length of {path.length:g} mm; only a path with a positive length can be planned"
        )
    marks = np.array([0.0, *path.stops, path.length])
    wrong = ~(np.diff(marks) > 0.0)
    if wrong.any():
        index = int(np.argmax(wrong))
        raise CurveError(
            f"stops of the path must increase and lie between 0 and its length of {path.length:g} mm; "
            f"{marks[index + 1]:g} mm follows {marks[index]:g} mm"
        )
