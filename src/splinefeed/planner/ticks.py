"""Whether the setpoints of a motion keep the limits of the axes, by differences at ticks; slower where they do not."""

from __future__ import annotations

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.paths.track import Track
from splinefeed.planner.constants import HOPELESS, ROUNDINGS, ROUNDS, SAME, TOGETHER
from splinefeed.planner.shared import stretched
from splinefeed.records import Array, IntArray, Limits, TimeLaw
from splinefeed.records.verdict import KEPT

#: Ticks that are looked at in all, at most: eleven days at 1 ms.
MOST_TICKS = 1e9
#: What a chord is over its limit is noted as if it were an axis of this number.
CHORD = -1


class MovingEndError(PlanError):
    """Setpoints next to an end in motion are over a limit, and such motion cannot be slowed down."""


def held_at_ticks(law: TimeLaw, path: Track, limits: Limits, first: IntArray, passed: Array, breaks: Array) -> TimeLaw:
    """Slow a law down from one rest to the next where differences of its setpoints are over a limit.

    Parameters
    ----------
    law : TimeLaw
        The law.
    path : Track
        Its path.
    limits : Limits
        Of the motion.
    first : (m,) array of int
        The first piece of each stretch between rests.
    passed : (k,) array
        Arc lengths of corners that are passed in motion, mm, across which differences are no derivatives.
    breaks : (n,) array
        Arc lengths where derivatives jump or the path bends sharply, mm.

    Returns
    -------
    TimeLaw
        The law, slower.

    Raises
    ------
    PlanError
        For what no feed mends.
    MovingEndError
        Next to an end in motion.

    Notes
    -----
    For the setpoints r at the ticks of the period T, k = 1 to 3, torques and chords, but for the rounding of r,

        |D^k r| / T^k <= limit (1 + KEPT)
    """
    if law.period is None:
        return law
    if law.duration > MOST_TICKS * law.period:
        raise PlanError(
            f"the motion would take {law.duration:.3g} s, which is more than {MOST_TICKS:.0e} setpoints, the "
            "most that are held to limits; raise the feed or the period"
        )
    moving = np.zeros(len(first), dtype=bool)
    at_ends = law.feed([0.0, law.duration]) > KEPT * np.max(law.coefficients[:, 1])
    moving[0] = at_ends[0]
    moving[-1] |= at_ends[1]
    for _ in range(ROUNDS):
        over, worst = _over(law, path, limits, law.breaks[first], passed, breaks)
        if not np.any(over > 1.0):
            return law
        if np.any(over > np.where(moving, 1.0, HOPELESS)):
            break
        seconds = np.diff(law.breaks[np.append(first, len(law.coefficients))])
        ticks = np.floor(seconds * (np.sqrt(over) - 1.0) / law.period) + 1.0
        law = stretched(law, first, np.where(over > 1.0, ticks, 0.0) * law.period)
    k = int(np.argmax(np.where(moving & (over > 1.0), np.inf, over)))
    s, axis = float(path.tip_length(worst[k, 0])), int(worst[k, 1])
    name = path.axes[axis] if 0 <= axis < len(path.axes) else "axes"
    what = "chords are over their limit" if axis == CHORD else f"the setpoints of {name} are over its limits"
    if moving[k]:
        raise MovingEndError(
            f"at s = {s:.6g} mm {what}, and next to an end in motion nothing can be slowed down; end at rest there, "
            "lower the feed, or leave out the limits of that axis"
        )
    raise PlanError(
        f"at s = {s:.6g} mm {what} by {100.0 * (over[k] - 1.0):.3g} % however slow it is; smooth the path there"
    )


def _over(
    law: TimeLaw, path: Track, limits: Limits, begins: Array, passed: Array, breaks: Array
) -> tuple[Array, Array]:
    """By how much q of each stretch (m,) must come down for its ticks, and where and in which axis that is, (m, 2).

    begins (m,): when they begin, s
    """
    over, worst = np.zeros(len(begins)), np.zeros((len(begins), 2))
    axes, models, bounded = path.axes, limits.models, limits.axis_bounds(path.axes)
    weights, bounds = np.vstack([np.eye(len(axes)), bounded.weights]), bounded.bounds
    if path.mixed:  # the tip's arc length is one more coordinate
        slowing, slowing_jerk = limits.deceleration or 0.0, limits.deceleration_jerk or 0.0
        along = (np.inf, max(limits.acceleration, slowing), max(limits.jerk, slowing_jerk))
        bounds = np.column_stack([bounds, along])
    period = float(law.period or 0.0)
    between = limits.chord_error is not None or limits.orientation_error is not None
    if not between and not models and not np.any(np.isfinite(bounds)):
        return over, worst

    def note(share: Array, t: Array, s: Array, axis: IntArray) -> None:
        """Take note of shares (n,) above 1, factors on q, over steps that begin at t, s, and s, mm."""
        more = np.flatnonzero(share > 1.0)
        owner = np.clip(np.searchsorted(begins, t[more] + 0.5 * period, side="right") - 1, 0, None)
        for k, i in zip(owner.tolist(), more.tolist(), strict=True):
            if share[i] > over[k]:
                over[k], worst[k] = share[i], (s[i], axis[i])

    top = float(np.max(law.coefficients[:, 1]))
    rest = law.coefficients[-1, 1] == 0.0 or abs(float(law.feed(law.duration))) <= KEPT * top
    periods = law.duration / period
    last = int(np.ceil(periods * (1.0 - SAME)) if rest else np.floor(periods * (1.0 + SAME)))  # no short one
    begin, end = -3 * int(law.coefficients[0, 1] == 0.0), last + 1 + 3 * int(rest)
    final = path.length if law.length > path.length * (1.0 - SAME) else law.length  # where setpoints end, to the bit
    for k in range(begin, end, TOGETHER):
        t = np.arange(max(k - 3, begin), min(k + TOGETHER, end)).astype(np.float64) * period
        s = np.clip(law(np.clip(t, 0.0, law.duration)), 0.0, path.length)
        s[t >= law.duration * (1.0 - SAME)] = final
        own = path(s)
        rounding = np.broadcast_to(path.rounding(s, own), own.shape)
        r, rounded = own @ weights.T, rounding @ np.abs(weights).T
        if path.mixed:
            r = np.column_stack([r, path.tip_length(s)])
            rounded = np.column_stack([rounded, np.full(len(s), ROUNDINGS * np.spacing(path.length))])
        for order, bound in enumerate(bounds, start=1):
            if len(t) <= order:
                continue
            seen = np.abs(np.diff(r, n=order, axis=0)) - 2.0**order * rounded[order:]
            shares = seen / (bound * (1.0 + KEPT) * period**order)
            crosses = np.searchsorted(passed, s[:-order]) != np.searchsorted(passed, s[order:], side="right")
            share = np.where(crosses, 0.0, np.max(shares, axis=1, initial=0.0)) ** (2.0 / order)
            note(share, t[:-order], s, np.argmax(shares, axis=1))
        for model in models:
            span, columns = model.span, model.columns(axes)
            if len(t) < span:
                continue
            joints = own[:, columns]
            found, most = model.seen(joints, period)
            floor, before = model.rounding(joints, period, np.max(rounding[:, columns], axis=0)), (span - 1) // 2
            at_tick = slice(before, before + len(found))
            still = model.still(joints[at_tick])
            room = most * (1.0 + KEPT) - np.sign(found - still) * still
            by_model = np.maximum((np.abs(found - still) - floor) / room, 0.0) ** (2.0 / model.power)
            worst_axis = np.array(columns)[np.argmax(by_model, axis=1)]
            note(np.max(by_model, axis=1), t[at_tick], s[at_tick], worst_axis)
        if between and len(t) > 1:
            at, away, tilted = path.chords(s, own, breaks)
            away = away - ROUNDINGS * np.spacing(np.max(np.abs(own)))
            for off, allowed in ((tilted, limits.orientation_error), (away, limits.chord_error)):
                if off is not None and allowed is not None:
                    note(off / (allowed * (1.0 + KEPT)), t[at], s[at], np.full(len(at), CHORD))
    return over, worst
