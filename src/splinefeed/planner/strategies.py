"""The strategies `time-optimal` and `look-ahead`: two modes of one planner."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.paths.path import Path
from splinefeed.paths.track import Track
from splinefeed.planner.audit import worst_shares
from splinefeed.planner.conditions import Conditions
from splinefeed.planner.constants import ALMOST, HOPELESS, KEPT, SAME
from splinefeed.planner.horizon import Plan, SolverSettings, plan_window
from splinefeed.planner.law import MotionPieces, joined
from splinefeed.planner.openings import allowed_at
from splinefeed.planner.profiles import SHORTEST, lay_out
from splinefeed.planner.receding import OutOfReachError, RecedingHorizon, plan_stretch
from splinefeed.planner.shared import on_tick, with_dwells
from splinefeed.planner.straight import straights
from splinefeed.planner.ticks import MovingEndError, held_at_ticks
from splinefeed.records import LAW_COEFFICIENTS, REST, Array, BoolArray, Limits, State, TimeLaw
from splinefeed.telling import tell
from splinefeed.workers import spread

#: What the modes are called.
TIME_OPTIMAL, LOOK_AHEAD = "time-optimal", "look-ahead"
MODES = {
    TIME_OPTIMAL: SolverSettings(cell=0.2, tolerance=2e-4, cells=4000, open=1 / 16),
    LOOK_AHEAD: SolverSettings(cell=0.5, tolerance=5e-3, cells=400, open=1 / 4),
}
#: A motion over a limit is slowed down as a whole: a note says so where that is by more than this, as a factor on q.
POOR = 1.2
#: Shares of the limits, as factors on q, that are left to slow a motion down by less than a period.
SPARES = (1e-4, 1e-3, 1e-2)
#: So much less than the nearest state that cells allow is tried, as a factor on q, until a plan is made from there.
LESS = (1e-3, 1e-2, 0.1, 0.5, 1.0)
#: A corner is passed where that allows at least this share of the feed that a ramp at rest soon reaches; else it is a
#: stop, as a feed next to nothing is.
WORTH_PASSING = 0.02
#: A corner that turns back by less than this, rad, is no corner to pass but a cusp.
SHARPEST = np.pi - 1e-3


def passed_corners(path: Path, limits: Limits, period: float | None) -> tuple[Array, Array]:
    """Find the corners that are passed, and the largest feed there.

    Parameters
    ----------
    path : Path
        The path.
    limits : Limits
        Of the motion.
    period : float or None
        Servo period T, s.

    Returns
    -------
    s, feed : (k,) array
        Arc lengths, mm, and feeds, mm/s; none without a step.

    Notes
    -----
    With |r' behind - r' before| of each axis,

        feed |r' behind - r' before| <= axis_velocity_step

    With a chord error the setpoints on both sides of a corner of angle phi, v T apart, leave it by v T / 2 sin(phi / 2)
    at most.
    """
    corners = path.corners
    stopped = [float(path.curve_starts[marker.before]) for marker in path.markers if marker.stop]
    passing = corners.stop & (corners.angle <= SHARPEST) & np.isfinite(corners.curvature_jump)
    passing &= ~np.isin(corners.s, stopped) & (corners.s > 0.0) & (corners.s < path.length)
    if limits.axis_velocity_step is None or not np.any(passing):
        return np.zeros(0), np.zeros(0)
    s, curve, u, angle = (each[passing] for each in (corners.s, corners.curve, corners.u, corners.angle))
    domains = path.flat.domains
    joint = (u >= domains[curve, 1]) & (curve + 1 < len(path.curves))
    after = curve + joint
    before = path.by_length(curve.astype(np.int64), u.astype(np.float64), side="left")[:, 1]
    behind = path.by_length(after, np.where(joint, domains[after, 0], u))[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = limits.of_axes("axis_velocity_step", path.axes) / np.abs(behind - before)
        feed = np.fmin.reduce(steps, axis=1)
        if limits.chord_error is not None and period is not None:
            feed = np.minimum(feed, 2.0 * limits.chord_error / (period * np.sin(0.5 * angle)))
    passed = feed > _worth(path, limits)
    return np.asarray(s, dtype=np.float64)[passed], feed[passed]


def _worth(path: Path, limits: Limits) -> float:
    """Feed in mm/s below which passing a corner is no better than a stop."""
    top, push, twist = (
        min(float(along), float(np.min(limits.of_axes(name, path.axes))))
        for along, name in (
            (limits.feed, "axis_velocity"), (limits.acceleration, "axis_acceleration"), (limits.jerk, "axis_jerk"),
        )
    )  # fmt: skip
    return WORTH_PASSING * (min(push * push / twist, top) if np.isfinite(push / twist) else top)


def conditions_of(path: Track, limits: Limits, period: float | None, paces: Array | None = None) -> Conditions:
    """Collect what a motion along a path is planned under.

    Parameters
    ----------
    path : Track
        Of the motion.
    limits : Limits
        Of the motion.
    period : float or None
        Servo period, s.
    paces : (curves,) array, optional
        Share of the limits that the motion may use on each curve, as a factor on q.

    Returns
    -------
    Conditions
        From which rows are made at any places.
    """
    path.check_limits(limits)
    curves = path.tip_path
    passed = passed_corners(curves, limits, period)
    feeds = curves.feeds_within(limits.feed)
    changes = np.flatnonzero(feeds[1:] != feeds[:-1]) + 1  # between rapid moves without a feed, too
    steps = curves.curve_starts[changes], feeds[np.concatenate([[0], changes])]
    stops = np.array([*path.stops, *(s for s, _ in path.dwells)])
    rests = np.unique(stops[(stops > 0.0) & (stops < path.length) & ~np.isin(stops, passed[0])])
    if paces is None:
        return Conditions(path, limits, period, steps, passed, rests)
    slower = np.flatnonzero(np.diff(paces) != 0.0) + 1
    return Conditions(
        path, limits, period, steps, passed, rests, (curves.curve_starts[slower], paces[np.append(0, slower)])
    )


def plan_in_mode(
    path: Track,
    limits: Limits,
    period: float | None,
    start: State | None = None,
    *,
    strategy: str,
    bound: bool = False,
    paces: Array | None = None,
    back: bool = False,
) -> TimeLaw:
    """Plan the motion in one of MODES: with a window that moves, or as fast as can be.

    Parameters
    ----------
    path : Track
        Of the motion, which rests at its stops.
    limits : Limits
        Of the motion.
    period : float or None
        Servo period, s: each stretch between stops lasts whole periods.
    start : State, optional
        Where the motion begins, in the law too, or with `back` what it passes, at `settings["start_s"]`.
    strategy : str
        A name in MODES.
    bound : bool, optional
        Whether the law has a lower bound of its time.
    paces : (curves,) array, optional
        Share of the limits that the motion may use on each curve, see `conditions_of`.
    back : bool, optional
        Whether the motion begins at the start of the path, with a `start` that it passes.

    Returns
    -------
    TimeLaw
        The law.

    Raises
    ------
    LimitsError
        For limits that leave acceleration and jerk free, and for curvature jumps under an axis jerk without a period.
    PlanError
        For ends in motion that the limits do not allow, with the nearest that they do, and for places where no motion
        within them was found.
    """
    check_limits(limits, path.axes, strategy)
    mode = replace(MODES[strategy], bounded=bound)
    _check_jumps(path, limits, period)
    if not path.carries_tip:
        mode = replace(mode, cell=0.5 * mode.cell)  # joints bend where the tip does not
    with np.errstate(all="ignore"):  # what is not a number is not a motion to take
        conditions = conditions_of(path, limits, period, paces)
        begin = State(conditions.speed_at(0.0, limits.start_feed)) if start is None else start
        law = _held(path, limits, conditions, (strategy, mode), begin)
        if not back or begin.s == 0.0:
            return law
        try:
            before = _held(path, limits, conditions, (strategy, replace(mode, bounded=False)), State(), begin)
        except PlanError as error:
            raise PlanError(f"back: {error}; or leave out back") from None
        return _behind(before, law)


def _held(
    path: Track,
    limits: Limits,
    conditions: Conditions,
    how: tuple[str, SolverSettings],
    begin: State,
    goal: State | None = None,
) -> TimeLaw:
    """The motion between two states with what the path waits, held to the limits at ticks.

    What cannot be slowed down there, next to an end in motion, is planned again with a share of the limits to spare.
    """
    strategy, mode = how
    to = np.inf if goal is None else goal.s - SAME * path.length  # what waits there waits in the law behind it
    waits = [(s, wait) for s, wait in path.dwells if begin.s <= s < to]
    refused: MovingEndError | None = None
    for spare in (mode.spare, *SPARES):
        try:
            law = with_dwells(motion(conditions, strategy, replace(mode, spare=spare), begin, goal), waits, path.length)
            at_rest = np.unique(np.append(0, np.flatnonzero(law.coefficients[:, 1] == 0.0)))
            return held_at_ticks(law, path, limits, at_rest, conditions.passed[0], conditions.breaks)
        except MovingEndError as error:
            refused = refused or error
        except PlanError as error:
            raise refused or error from None
    assert refused is not None
    raise refused


def _behind(before: TimeLaw, law: TimeLaw) -> TimeLaw:
    """Both laws as one."""
    begin = before.duration
    breaks = np.concatenate([before.breaks, begin + law.breaks[1:]])
    if law.period is not None:
        breaks[-1] = on_tick(float(breaks[-1]), law.period)
    return replace(
        law,
        breaks=breaks,
        coefficients=np.concatenate([before.coefficients, law.coefficients]),
        notes=tuple(dict.fromkeys((*before.notes, *law.notes))),
        settings={**law.settings, "start_s": begin},
    )


def motion(
    conditions: Conditions, strategy: str, mode: SolverSettings, begin: State | None = None, goal: State | None = None
) -> TimeLaw:
    """Plan from one state to another, by default from end to end of a path, as `plan_in_mode`.

    Parameters
    ----------
    conditions : Conditions
        What the motion must keep.
    strategy : str
        A name in MODES.
    mode : SolverSettings
        How closely to plan.
    begin, goal : State, optional
        How the motion is at both ends.

    Returns
    -------
    TimeLaw
        The law.

    Raises
    ------
    PlanError
        Where no motion was found.
    """
    limits, period, length = conditions.limits, conditions.period, conditions.track.length
    begin = State(conditions.speed_at(0.0, limits.start_feed)) if begin is None else begin
    goal = State(conditions.speed_at(length, limits.end_feed), 0.0, length) if goal is None else goal
    rests = conditions.rests
    marks = np.concatenate([[begin.s], rests[(rests > begin.s) & (rests < goal.s)], [goal.s]])
    instants, rows, notes = [np.zeros(1)], [], _assumed(conditions)
    bound, tick = 0.0, 0
    exact, profiles = straights(conditions, marks)
    rank = np.append(0, np.cumsum(exact))
    exact[0] &= begin.feed == 0.0
    exact[-1] &= goal.feed == 0.0
    others = [_stretch((begin, goal), *marks[k : k + 2].tolist()) for k in np.flatnonzero(~exact).tolist()]
    plans = spread(_in_ticks, (conditions, mode), others)
    for first, last in _runs(exact):
        if exact[first]:
            profile = profiles.part(slice(rank[first], rank[last]))
            ramps = profile.durations[::2]
            raised = (ramps > 0.0) & (ramps <= SHORTEST * (1.0 + ALMOST))  # they may take longer than jerk asks for
            bound += float(np.sum(profile.duration)) - SHORTEST * int(np.sum(raised))
            times, laid = lay_out(profile, marks[first : last + 1], period, float(instants[-1][-1]))
            instants.append(times[1:])
            rows.append(laid)
            tick = tick if period is None else round(times[-1] / period)
            continue
        low, high = marks[first : first + 2].tolist()
        plan, ticks = next(plans)
        if not plan.over <= HOPELESS:
            raise _not_found(conditions, plan, low, high)
        if plan.over > POOR:
            notes.append(
                f"{conditions.between(low, high)} the motion is {plan.over**0.5:.3g} times slower than "
                "it might be: no better one within the limits was found"
            )
        tell("planning", high, length)
        bound = bound + plan.bound if plan.bound > 0.0 else -np.inf  # one that is not known leaves none of the whole
        rows.append(plan.pieces.coefficients)
        instants.append(float(instants[-1][-1]) + np.cumsum(plan.pieces.spans))
        tick += ticks
        if ticks > 0:
            instants[-1][-1] = tick * float(period or 0.0)
        elif period is not None and instants[-1][-1] % period > ALMOST * period:
            notes.append(
                f"the last period is short, {instants[-1][-1] % period:.6g} s of {period:g} s: the motion begins and "
                "ends at a feed, and so cannot wait for a tick"
            )
    times, coefficients = np.concatenate(instants), np.concatenate(rows)
    lasts = np.diff(times) > 0.0  # phases of profiles, and waits, that take no time
    return TimeLaw(
        breaks=np.append(times[0], times[1:][lasts]),
        coefficients=coefficients[lasts],
        strategy=strategy,
        period=period,
        notes=tuple(notes),
        settings={"lower_bound_s": bound} if mode.bounded and bound > 0.0 else {},
    )


def _assumed(conditions: Conditions) -> list[str]:
    """What is taken for the limits of axes that have none."""
    names = conditions.at.assumed
    if not names:
        return []
    have = "has" if len(names) == 1 else "have"
    k = conditions.at.names.index(names[0])
    bounds = ((conditions.at.a[k], 2), (conditions.at.j[k], 3))
    taken = " and ".join(f"{value:.6g} rad/s^{order}" for value, order in bounds if value < np.inf)
    return [
        f"{', '.join(names)} {have} no limit of acceleration or jerk: the plan takes {taken} (mm where linear), the "
        "least of the others', 1 rad for 1 mm"
    ]


def _runs(exact: BoolArray) -> list[tuple[int, int]]:
    """First and behind the last of stretches (m,) that go together: exact ones in a row, others one by one."""
    begin = np.flatnonzero(np.append(True, ~(exact[1:] & exact[:-1])))
    return list(pairwise([*begin.tolist(), len(exact)]))


def _stretch(ends: tuple[State, State], low: float, high: float) -> tuple[float, float, State, State]:
    """A stretch between two marks, mm, and the states at its ends: rest but at the ends of the motion."""
    begin, last = ends
    return low, high, begin if low == begin.s else State(s=low), replace(last, s=0.0) if high == last.s else State()


@np.errstate(all="ignore")  # in other processes, too
def _in_ticks(given: tuple[Conditions, SolverSettings], stretch: tuple[float, float, State, State]) -> tuple[Plan, int]:
    """A stretch, see `_stretch`, that lasts whole periods if it can, and how many.

    From rest to rest it is slowed down as a whole, by k: feeds by k, accelerations by k^2, jerks by k^3. With one end
    in motion it waits at the other one, with both it is slowed down between them.
    """
    (conditions, mode), (low, high, start, stop) = given, stretch
    period = conditions.period
    if max(start.feed, stop.feed) == 0.0:
        plan = plan_stretch(conditions, low, high, start, stop, replace(mode, spare=0.0))
        if not plan.over <= HOPELESS:
            return plan, 0
        pieces = plan.pieces.stretched(math.sqrt(plan.over)) if plan.over > 1.0 else plan.pieces
        if period is None:
            return replace(plan, pieces=pieces), 0
        ticks = max(math.ceil(pieces.duration / period * (1.0 - SAME) - SAME), 1)
        return replace(plan, pieces=pieces.stretched(ticks * period / pieces.duration)), ticks

    with suppress(OutOfReachError):
        plan = plan_stretch(conditions, low, high, start, stop, mode)
        if plan.over <= 1.0 + KEPT:
            if period is None:
                return plan, 0
            if min(start.feed, stop.feed) == 0.0:
                return _waiting(plan, high, stop, period)
            return _slowed(plan, conditions, stretch, mode, period)
    raise _out_of_reach(conditions, low, high, start, stop, mode)


def _waiting(plan: Plan, high: float, stop: State, period: float) -> tuple[Plan, int]:
    """Motion that ends at `high`, mm, and waits less than a period where it rests, so that it lasts whole periods."""
    ticks = math.ceil(plan.pieces.duration / period * (1.0 - SAME))
    place = high if stop.feed == 0.0 else float(plan.pieces.coefficients[0, 0])
    still = MotionPieces(
        np.array([max(ticks * period - plan.pieces.duration, 0.0)]), np.eye(1, LAW_COEFFICIENTS) * place
    )
    return replace(plan, pieces=joined([plan.pieces, still] if stop.feed == 0.0 else [still, plan.pieces])), ticks


def _slowed(
    plan: Plan, conditions: Conditions, stretch: tuple[float, float, State, State], mode: SolverSettings, period: float
) -> tuple[Plan, int]:
    """Motion slowed down by less than a period between its ends, so that it lasts whole ones; as it is if none can.

    That takes of the limits at some places, so that motions that leave a share of them, up to a hundredth, are tried,
    too: those last longer by up to half of that share.
    """
    tried = plan
    for spare in (*SPARES, None):
        ticks = max(math.ceil(tried.pieces.duration / period * (1.0 - SAME) - SAME), 1)
        slower = tried.pieces.slowed_between(ticks * period)
        if np.max(worst_shares(conditions, slower, stretch[1])[0]) <= 1.0 + KEPT:
            return replace(plan, pieces=slower), ticks
        if spare is not None:
            with suppress(PlanError):
                found = plan_stretch(conditions, *stretch, replace(mode, spare=spare))
                tried = found if found.over <= 1.0 + KEPT else tried
    return plan, 0


def _not_found(conditions: Conditions, plan: Plan, low: float, high: float) -> PlanError:
    """The error for a stretch whose best motion is over a limit: where, by how much, and what mends it."""
    with np.errstate(all="ignore"):
        over = np.max(worst_shares(conditions, plan.pieces, high)[0], axis=0)
    k = int(np.argmax(over))
    much = f"{100.0 * (over[k] - 1.0):.3g} % over a limit" if over[k] < np.inf else "no motion"
    place = conditions.place(float(plan.pieces.coefficients[k, 0]))
    return PlanError(
        f"{conditions.between(low, high)} no motion within the limits was found: at s = {place:.6g} mm the best one is "
        f"{much}; smooth or split the path there, or leave out the limits of an axis that turns or bends there while "
        "the path hardly moves"
    )


def _out_of_reach(
    conditions: Conditions, low: float, high: float, start: State, stop: State, mode: SolverSettings
) -> OutOfReachError:
    """The error for feeds at the ends that the limits do not allow: which, and the nearest that they do allow.

    The nearest is that of the same motion slower, with no more acceleration than is allowed where it is, found in a
    short window; a plan was made from it. If each end alone is too fast each is named, with the other one at rest.
    """
    near = RecedingHorizon(low).reach(conditions, MODES[LOOK_AHEAD], high)  # what lies behind does not matter
    length = near - low

    def planned(first: State, last: State) -> Plan:
        begin, end = (low, near) if last.feed == 0.0 or near == high else (high - length, high)
        first, last = (first if begin == low else REST), (last if end == high else REST)
        return plan_window(conditions, begin, end, first, last, replace(mode, bounded=False))

    def nearest(given: State, other: State, at_end: bool) -> State:
        allowed = allowed_at(conditions, given.s, given)
        share = 0.0
        with suppress(PlanError):
            share = planned(*((other, allowed) if at_end else (allowed, other))).share
        for less in LESS:
            slower = share * (1.0 - less)
            feed, acceleration = (
                float(f"{each:.6g}") for each in (slower**0.5 * allowed.feed, slower * allowed.acceleration)
            )
            found = State(feed, acceleration if feed > 0.0 else 0.0, given.s)
            with suppress(PlanError):
                ends = (other, found) if at_end else (found, other)
                if feed == 0.0 or planned(*ends).over <= 1.0 + KEPT:
                    break
        return found

    def sentence(given: State, found: State, at_end: bool) -> str:
        if given.acceleration != 0.0 or (at_end and high < conditions.track.length):
            up_to = f"up to s = {conditions.place(high if at_end else near):.6g} mm"
            return f"the limits {up_to} do not allow {given}; the nearest state they allow is {found}"
        name, by_feed = "end_feed" if at_end else "start_feed", conditions.speed_at(given.s, 1.0)
        return (
            f"{name} is {given.feed / by_feed:.6g} mm/s; the limits {conditions.between(low, high)} "
            f"allow at most {found.feed / by_feed:.6g} mm/s there; lower it"
        )

    start, stop = replace(start, s=low), replace(stop, s=high)
    at_start = start.feed > 0.0 and (stop.feed == 0.0 or planned(start, REST).over > 1.0 + KEPT)
    at_end = stop.feed > 0.0 and (start.feed == 0.0 or not at_start or planned(REST, stop).over > 1.0 + KEPT)
    sentences = []
    if at_start:
        sentences.append(sentence(start, nearest(start, REST if at_end else stop, False), False))
    if at_end:
        sentences.append(sentence(stop, nearest(stop, REST if at_start else start, True), True))
    return OutOfReachError("; and ".join(sentences))


def check_limits(limits: Limits, axes: tuple[str, ...], strategy: str) -> None:
    """Raise LimitsError for limits that leave acceleration and jerk free."""
    sums = (limits.combinations or {}).values()
    bounded = [limits.acceleration, limits.jerk, *(each.acceleration for each in sums), *(each.jerk for each in sums)]
    bounded += [most for model in limits.models for most in model.numbers().values()]
    for name in ("axis_acceleration", "axis_jerk"):
        bounded += limits.of_axes(name, axes).tolist()
    if not np.any(np.isfinite(bounded)):
        raise LimitsError(
            f"the {strategy} strategy needs a limit on acceleration or jerk, of the path or of its axes; none is given"
        )


def _check_jumps(path: Track, limits: Limits, period: float | None) -> None:
    """Raise LimitsError for curvature that jumps under an axis jerk without a period."""
    jerks = [*limits.of_axes("axis_jerk", path.axes), *(each.jerk for each in (limits.combinations or {}).values())]
    if period is None and np.any(np.isfinite(jerks)):
        jumps = path.jumps
        if len(jumps):
            place = float(path.tip_length(jumps[0]))
            raise LimitsError(
                f"the curvature jumps at s = {place:.6g} mm, where axis jerk is infinite at any feed; "
                "give the servo period, over which a drive sees it"
            )
