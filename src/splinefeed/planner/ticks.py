"""Whether the setpoints of a motion keep the limits of the axes, by differences at ticks; slower where they do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.kinematics import JointPath
from splinefeed.paths.path import Path
from splinefeed.planner.constants import HOPELESS, ROUNDINGS, ROUNDS, SAME, TOGETHER
from splinefeed.planner.shared import on_tick
from splinefeed.records import AXIS_LIMITS, BOUNDED, LAW_COEFFICIENTS, Array, IntArray, Limits, TimeLaw
from splinefeed.records.verdict import KEPT

#: Ticks that are looked at in all, at most: eleven days at 1 ms.
MOST_TICKS = 1e9
#: Slopes of joints count where the tip moves by more than this share of its longest step.
MOVING = 0.01
#: What a chord is over its limit is noted as if it were an axis of this number.
CHORD = -1


def held_at_ticks(
    law: TimeLaw, path: Path | JointPath, limits: Limits, first: IntArray, passed: Array, breaks: Array
) -> TimeLaw:
    """The law, slower from one rest to the next where differences of its setpoints are over a limit.

    |D^k r| / T^k <= limit (1 + KEPT), and the rounding of r, for the setpoints r at the ticks of the period T, k = 1 to
    3, torques and chords.
    first (m,)   the first piece of each stretch between rests
    passed (k,)  arc lengths of corners that are passed in motion, mm, across which differences are no derivatives
    breaks (n,)  arc lengths where derivatives jump or the path bends sharply, mm
    Raises PlanError for what no feed mends, and next to an end in motion.
    """
    if law.period is None:
        return law
    if law.duration > MOST_TICKS * law.period:
        raise PlanError(
            f"the motion would take {law.duration:.3g} s, which is more than {MOST_TICKS:.0e} setpoints, the "
            "most that are held to limits; raise the feed or the period"
        )
    moving = np.zeros(len(first), dtype=bool)
    moving[0], moving[-1] = (
        limits.start_feed > 0.0,
        limits.end_feed > 0.0 or (len(first) == 1 and limits.start_feed > 0),
    )
    for _ in range(ROUNDS):
        over, worst = _over(law, path, limits, law.breaks[first], passed, breaks)
        if not np.any(over > 1.0):
            return law
        if np.any(over > np.where(moving, 1.0, HOPELESS)):
            break
        law = _slower(law, first, over)
    k = int(np.argmax(np.where(moving & (over > 1.0), np.inf, over)))
    s, axis = float(path.tip_length(worst[k, 0])), int(worst[k, 1])
    name = path.axes[axis] if 0 <= axis < len(path.axes) else "axes"
    what = "chords are over their limit" if axis == CHORD else f"the setpoints of {name} are over its limits"
    if moving[k]:
        raise PlanError(
            f"at s = {s:.6g} mm {what}, and next to an end in motion nothing can be slowed down; end at rest there, "
            "lower the feed, or leave out the limits of that axis"
        )
    raise PlanError(
        f"at s = {s:.6g} mm {what} by {100.0 * (over[k] - 1.0):.3g} % however slow it is; smooth the path there"
    )


def _over(
    law: TimeLaw, path: Path | JointPath, limits: Limits, begins: Array, passed: Array, breaks: Array
) -> tuple[Array, Array]:
    """By how much q of each stretch (m,) must come down for its ticks, and where and in which axis that is, (m, 2).

    begins (m,): when they begin, s
    """
    over, worst = np.zeros(len(begins)), np.zeros((len(begins), 2))
    axes, sums, models = path.axes, list((limits.combinations or {}).values()), limits.models
    weights = np.vstack([np.eye(len(axes)), *(each.on(axes) for each in sums)])
    bounds = [
        np.append(limits.of_axes(name, axes), [getattr(each, kind) for each in sums])
        for name, kind in zip(AXIS_LIMITS, BOUNDED, strict=True)
    ]
    moved, curves = path.joint_path, path.tip_path
    mixed = moved is None and curves.mixed  # then the tip's arc length is one more coordinate
    if mixed:
        slowing, slowing_jerk = limits.deceleration or 0.0, limits.deceleration_jerk or 0.0
        along = (np.inf, max(limits.acceleration, slowing), max(limits.jerk, slowing_jerk))
        bounds = [np.append(each, bound) for each, bound in zip(bounds, along, strict=True)]
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
    for k in range(begin, end, TOGETHER):
        t = np.arange(max(k - 3, begin), min(k + TOGETHER, end)).astype(np.float64) * period
        s = np.clip(law(np.clip(t, 0.0, law.duration)), 0.0, path.length)
        s[t >= law.duration * (1.0 - SAME)] = path.length  # where setpoints end, to the bit
        own = path(s)
        rounding = _rounding(path, s, own)
        r, rounded = own @ weights.T, np.abs(weights) @ rounding
        if mixed:
            r = np.column_stack([r, curves.tip_length(s)])
            rounded = np.append(rounded, ROUNDINGS * np.spacing(path.length))
        for order, bound in enumerate(bounds, start=1):
            if len(t) <= order:
                continue
            seen = np.abs(np.diff(r, n=order, axis=0)) - 2.0**order * rounded
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
            floor, before = model.rounding(joints, period, rounding[columns]), (span - 1) // 2
            at_tick = slice(before, before + len(found))
            still = model.still(joints[at_tick])
            room = most * (1.0 + KEPT) - np.sign(found - still) * still
            by_model = np.maximum((np.abs(found - still) - floor) / room, 0.0) ** (2.0 / model.power)
            worst_axis = np.array(columns)[np.argmax(by_model, axis=1)]
            note(np.max(by_model, axis=1), t[at_tick], s[at_tick], worst_axis)
        if limits.orientation_error is not None and moved is not None and len(t) > 1:
            tilted = _tips(moved, s, own)[1] / (limits.orientation_error * (1.0 + KEPT))
            note(tilted, t[:-1], s[:-1], np.full(len(tilted), CHORD))
        if limits.chord_error is not None and len(t) > 1:
            if moved is None:
                at, away = _chords(curves, s, own, breaks)
            else:
                at, away = np.arange(len(t) - 1), _tips(moved, s, own)[0]
            away = (away - ROUNDINGS * np.spacing(np.max(np.abs(own)))) / (limits.chord_error * (1.0 + KEPT))
            note(away, t[at], s[at], np.full(len(at), CHORD))
    return over, worst


def _rounding(path: Path | JointPath, s: Array, r: Array) -> Array:
    """How far rounding can move setpoints r (n, axes) at s (n,) on each axis, (axes,); joints eps (|q| + |dq/ds| L)."""
    size = np.max(np.abs(r), axis=0)
    if path.joint_path is None:
        linear = path.tip_path.linear
        size[:linear] = np.maximum(size[:linear], path.length)
        return np.asarray(ROUNDINGS * np.spacing(size))
    moved = np.diff(s)
    moving = moved > MOVING * np.max(moved, initial=0.0)
    steep = np.max(np.abs(np.diff(r, axis=0)[moving]) / moved[moving, None], axis=0, initial=0.0)
    return np.asarray(ROUNDINGS * np.finfo(float).eps * (size + steep * path.length))


def _slower(law: TimeLaw, first: IntArray, over: Array) -> TimeLaw:
    """The law whose stretches, from pieces first (m,) on, last whole periods longer, enough for q by over (m,) less."""
    assert law.period is not None
    period, edges = law.period, np.append(first, len(law.coefficients))
    seconds = np.diff(law.breaks[edges])
    ticks = np.where(over > 1.0, np.floor(seconds * (np.sqrt(over) - 1.0) / period) + 1.0, 0.0)
    factor = np.repeat(1.0 + ticks * period / seconds, np.diff(edges))
    shift = np.concatenate([[0.0], np.cumsum(ticks) * period])
    breaks = np.empty(len(law.breaks))
    for i in np.arange(len(first)).tolist():
        begin, end = edges[i], edges[i + 1]
        start = on_tick(float(law.breaks[begin]) + shift[i], period)
        breaks[begin:end] = start + (law.breaks[begin:end] - law.breaks[begin]) * factor[begin]
    breaks[-1] = on_tick(float(law.breaks[-1]) + shift[-1], period)
    return replace(law, breaks=breaks, coefficients=law.coefficients / factor[:, None] ** np.arange(LAW_COEFFICIENTS))


def _chords(path: Path, s: Array, r: Array, breaks: Array) -> tuple[IntArray, Array]:
    """Chords (n,) between setpoints r (k, axes) at s (k,), and how far the path leaves them, mm.

    It is looked at in three places of every chord, and where its derivatives jump or it bends sharply.
    """
    inside = breaks[(breaks > s[0]) & (breaks < s[-1])]
    at = np.concatenate([inside, *((1.0 - share) * s[:-1] + share * s[1:] for share in (0.25, 0.5, 0.75))])
    first = np.clip(np.searchsorted(s, at, side="right") - 1, 0, len(s) - 2)
    begin, chord = r[first, : path.linear], np.diff(r[:, : path.linear], axis=0)[first]
    away = path(at)[:, : path.linear] - begin
    square = np.maximum(np.sum(chord * chord, axis=1), 1e-300)
    along = np.clip(np.sum(away * chord, axis=1) / square, 0.0, 1.0)
    return first, np.linalg.norm(away - along[:, None] * chord, axis=1)


def _tips(path: JointPath, s: Array, r: Array) -> tuple[Array, Array]:
    """How far tip, mm, and tool axis, rad, leave their path halfway in steps (n,) of joints r (n + 1, joints) at s."""
    tip, axis = path.kinematics.forward(0.5 * (r[1:] + r[:-1]))
    middle = 0.5 * (s[1:] + s[:-1])
    d = path.tool.evaluate(*path.tool.locate(middle), 1)
    away, tangent = tip - d[:, 0], d[:, 1] / np.linalg.norm(d[:, 1], axis=1)[:, None]
    ahead = np.sum(away * tangent, axis=1)
    _, wanted = path.kinematics.forward(path(np.clip(middle + ahead, 0.0, path.length)))
    return np.linalg.norm(away - ahead[:, None] * tangent, axis=1), np.linalg.norm(axis - wanted, axis=1)
