"""`plan`: from a path and limits to a time law, by a strategy that holds every limit given."""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from splinefeed.errors import CurveError, InputError, LimitsError, PlanError, expect
from splinefeed.limit_table import TICKS
from splinefeed.paths.path import Path
from splinefeed.paths.track import GOES, Track
from splinefeed.planner.seven_phase import STRATEGY as SEVEN_PHASE
from splinefeed.planner.seven_phase import plan_seven_phase
from splinefeed.planner.strategies import LOOK_AHEAD, TIME_OPTIMAL, plan_in_mode
from splinefeed.planner.timed import in_time
from splinefeed.records import (
    TABLE,
    TRAVEL_ENDS,
    Joint,
    Limits,
    State,
    TimeLaw,
    axes_without_limits,
    field_of,
    positive,
    unit_along,
)

#: Fields of Limits that bound the motion along the path, whatever its shape.
SHAPELESS = frozenset({"feed", "acceleration", "jerk", "deceleration", "deceleration_jerk"})
#: Those that every strategy holds: the ends of the path, and travel, which `plan` looks after itself.
ENDS = frozenset({"start_feed", "end_feed", *TRAVEL_ENDS})
#: The unit of lengths along a path as messages say it: along joints of an arm it is another.
_MM = re.compile(r"\bmm\b")
#: Axes up to which a lower bound of the time is cheap.
CHEAP = 3
EVERY_LIMIT = frozenset(each.name for each in TABLE)


@dataclass(frozen=True)
class Strategy:
    """One way to plan.

    Parameters
    ----------
    make : callable
        Makes a law for a path whose stops and length were checked, under limits, for a period in s or none; what else
        it asks of the path is its own affair; with `start`, a State, if it is not "seven-phase".
    holds : frozenset of str
        Fields of Limits that its laws keep: any other that is given is refused.
    needs : frozenset of str
        Fields of Limits without which it makes no law.
    """

    make: Callable[..., TimeLaw]
    holds: frozenset[str]
    needs: frozenset[str] = frozenset()


#: Every strategy by the name that `plan` and the command line know it by; a new one is one entry.
STRATEGIES: dict[str, Strategy] = {
    SEVEN_PHASE: Strategy(plan_seven_phase, holds=SHAPELESS | ENDS, needs=SHAPELESS),
    LOOK_AHEAD: Strategy(partial(plan_in_mode, strategy=LOOK_AHEAD), holds=EVERY_LIMIT),
    TIME_OPTIMAL: Strategy(partial(plan_in_mode, strategy=TIME_OPTIMAL), holds=EVERY_LIMIT),
}


def strategy_for(limits: Limits, strategy: str | None = None) -> str:
    """Choose the strategy that plans under limits.

    Parameters
    ----------
    limits : Limits
        Of the motion.
    strategy : str, optional
        The one named, which must hold every limit given. None chooses "seven-phase" where feed, acceleration and jerk
        along the path are given and nothing but what it holds, else "time-optimal".

    Returns
    -------
    str
        Its name in STRATEGIES.

    Raises
    ------
    InputError
        For an unknown strategy.
    LimitsError
        Where the strategy named does not hold a limit.
    """
    given = dict.fromkeys([*map(field_of, limits.as_dict()), *(model.kind for model in limits.models)])
    if strategy is None:
        simple = STRATEGIES[SEVEN_PHASE]
        return SEVEN_PHASE if simple.needs <= given.keys() <= simple.holds else TIME_OPTIMAL
    if strategy not in STRATEGIES:
        close = difflib.get_close_matches(str(strategy), STRATEGIES, n=1)
        hint = f"did you mean {close[0]!r}? The known ones are" if close else "the known ones are"
        raise InputError(f"strategy {strategy!r} is not known; {hint}: {', '.join(sorted(STRATEGIES))}")
    beyond = [name for name in given if name not in STRATEGIES[strategy].holds]
    if beyond:
        able = [name for name, each in STRATEGIES.items() if given.keys() <= each.holds]
        raise LimitsError(
            f"{', '.join(beyond)}: the {strategy} strategy cannot hold {'it' if len(beyond) == 1 else 'them'}; choose "
            f"{' or '.join(sorted(able, reverse=True))}, or leave the strategy open"
        )
    return strategy


def plan(
    path: Track,
    limits: Limits,
    *,
    strategy: str | None = None,
    period: float | None = None,
    start: State | None = None,
    back: bool = False,
    bound: bool = False,
) -> TimeLaw:
    """Plan the time law s(t) of a motion along a path that obeys limits and rests at the path's stops.

    Parameters
    ----------
    path : Track
        A Path, whose feeds and dwells count, too, or a JointPath, whose axes are joints.
    limits : Limits
        What the motion must never exceed.
    strategy : str, optional
        A name in STRATEGIES; None chooses one that holds every limit given: "seven-phase" for feed, acceleration and
        jerk along the path alone, else "time-optimal".
    period : float, optional
        Servo period, s: stops and end are made to fall on ticks; None leaves the law as fast as it can be.
    start : State, optional
        Where on the path the motion begins, and its feed and acceleration there: the law begins at start.s, and has it
        in its settings, from which setpoints, files and `check` know it. None begins at the start of the path with the
        start_feed of the limits. Not for "seven-phase".
    back : bool, optional
        Whether the law begins at rest at the start of the path, too, and passes `start` on its way, at the law's
        `settings["start_s"]`: an override begins there, and can run back behind it.
    bound : bool, optional
        Whether to find, too, a time that no motion within the limits falls below: with "time-optimal" the law's
        `settings["lower_bound_s"]`, from `start` on. It takes as long as the plan for two axes, ten times that for
        seven joints.

    Returns
    -------
    TimeLaw
        Called with t (...), s, it gives arc lengths (...), mm.

    Raises
    ------
    CurveError
        For no length, and stops that are not inside.
    InputError
        For an unknown strategy.
    LimitsError
        For a limit that the strategy named does not hold, a chord error without a period, a period that is not positive
        or longer than the motion, a path that leaves the travel of an axis, and feeds at the ends that the path
        contradicts.
    PlanError
        For a stretch too short for its change of feed, and a start from which the limits cannot be kept, with the
        nearest from which they can.

    Notes
    -----
    Where a tick cannot be met (start_feed = end_feed = feed), the law's `notes` say so; they name each axis that moves
    without a limit that others have. Where the path waits, the law has a piece of constant s, whole periods long.

    References
    ----------
    .. [1] docs/math/planner.md
    .. [2] docs/math/seven-phase.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.Path.polyline([[0, 0], [30, 0]])
    >>> law = sf.plan(path, sf.Limits(feed=10, acceleration=100, jerk=1000), period=1e-3)
    >>> print(f"{law.strategy}: {law.duration:.3f} s")
    seven-phase: 3.200 s
    """
    expect("plan(path, limits)", (path, (Path, Track)), (limits, Limits))
    try:
        return _plan(path, limits, strategy, period, start, back=back, bound=bound)
    except (LimitsError, PlanError) as error:
        along = _along(path)
        if any(isinstance(axis, Joint) for axis in path.axes) and along != "mm" and not str(error).startswith(GOES):
            raise type(error)(_MM.sub(along, str(error))) from None
        raise


def _plan(
    path: Track,
    limits: Limits,
    strategy: str | None,
    period: float | None,
    start: State | None,
    *,
    back: bool,
    bound: bool,
) -> TimeLaw:
    if path.needs_machine:
        raise InputError(
            f"{path.name}: has a tool axis, which only a machine can follow; plan JointPath(tool_path, kinematics), "
            "or give run a machine"
        )
    limits, curves = limits.on(path.axes), path.tip_path
    if strategy is None and (start is not None or not path.carries_tip or path.mixed):
        strategy = TIME_OPTIMAL
    if strategy == SEVEN_PHASE:
        if path.mixed:
            raise LimitsError(
                f"{SEVEN_PHASE} cannot plan linear and rotary axes together, whose tip does not move as the path's "
                f"length does; choose {TIME_OPTIMAL} or {LOOK_AHEAD}, or leave the strategy open"
            )
        if not path.carries_tip:
            raise LimitsError(f"{SEVEN_PHASE} cannot plan joints; choose {TIME_OPTIMAL} or {LOOK_AHEAD}")
    strategy = strategy_for(limits, strategy)
    if period is not None:
        period = positive(period, "period")
    else:
        for name in limits.given(TICKS):
            raise LimitsError(f"{name}: needs the servo period, because it is measured from tick to tick; give period")
    _check_path(path)
    path.check_travel(limits.travel_of(path.axes))
    _check_ends(curves, limits)
    if start is not None:
        _check_start(path, strategy, start)
    if back and (start is None or limits.start_feed > 0.0):
        raise LimitsError("back: leads from rest at the start of the path to a start on it; give start, no start_feed")
    notes, unit = axes_without_limits(limits, path.axes, *path.reach), _unit(path)
    if curves.times is not None:
        law = _in_time(path, curves, limits, strategy, period, start)
    else:
        given: dict[str, Any] = {} if start is None else {"start": start, "back": back}
        given |= {"bound": True} if bound and strategy == TIME_OPTIMAL else {}
        law = STRATEGIES[strategy].make(path, limits, period, **given)
    begins = {} if start is None or (back and start.s > 0.0) else start.settings
    return dataclasses.replace(
        law,
        notes=(*law.notes, *notes),
        settings={
            **law.settings,
            **{"limits": limits.as_dict(), "strategy": strategy, "period": period},
            **begins,
            **unit,
        },
    )


def _along(path: Track) -> str:
    """The unit of lengths along a path."""
    return unit_along(path.tip_path.axes)


def _unit(path: Track) -> dict[str, str]:
    """The unit of lengths along a path as settings have it; nothing where it is mm and the axes say so."""
    found = _along(path)
    return {} if found == "mm" == unit_along(path.axes) else {"unit": found}


def _in_time(
    path: Track, curves: Path, limits: Limits, strategy: str, period: float | None, start: State | None
) -> TimeLaw:
    """The law at the times that a path wants; see `timed`."""
    if start is not None:
        raise LimitsError("times: a motion with wanted times begins at the start of its path; leave start out")
    if strategy == SEVEN_PHASE:
        if np.count_nonzero(~np.isnan(curves.times)) > 1:  # type: ignore[arg-type]
            raise LimitsError(f"times: {SEVEN_PHASE} slows a motion down as a whole; choose {TIME_OPTIMAL}")
        return in_time(lambda _: plan_seven_phase(curves, limits, period), curves, limits, period)
    return in_time(
        lambda paces: plan_in_mode(path, limits, period, strategy=strategy, paces=paces), curves, limits, period
    )


def cheap_to_bound(path: Track, limits: Limits) -> bool:
    """Tell whether a lower bound of the time costs about as much as the plan.

    Parameters
    ----------
    path : Track
        Of the motion.
    limits : Limits
        Of the motion.

    Returns
    -------
    bool
        True for up to three axes without torques.
    """
    return len(path.axes) <= CHEAP and not limits.models


def _check_ends(path: Path, limits: Limits) -> None:
    """Raise LimitsError for feeds at the ends of the path that its own curves or dwells contradict."""
    feeds = path.feeds_within(limits.feed)
    waits = dict(path.dwells)
    for name, feed, s in (("start_feed", feeds[0], 0.0), ("end_feed", feeds[-1], path.length)):
        wanted = getattr(limits, name)
        if wanted > feed:
            raise LimitsError(f"{name} is {wanted:g} mm/s; the path allows at most {feed:g} mm/s there")
        if wanted > 0.0 and s in waits:
            raise LimitsError(f"{name} is {wanted:g} mm/s; the path waits {waits[s]:g} s there, at rest")


def _check_start(path: Track, strategy: str, start: State) -> None:
    """Raise InputError for a start that is not on the path, or that the strategy cannot begin at."""
    if strategy == SEVEN_PHASE:
        raise InputError(f"start: the {strategy} strategy begins at the start of a path; choose {TIME_OPTIMAL}")
    if not start.s < path.length:
        raise InputError(f"start is {start}; the path ends at {path.length:.6g} mm")
    if start.feed > 0.0 and any(s == start.s for s, _ in path.dwells):
        raise InputError(f"start is {start}, where the path waits; begin there at rest")


def _check_path(path: Track) -> None:
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
