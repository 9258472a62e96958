"""Whether the setpoints of a motion keep the limits of the axes, by differences at ticks; slower where they do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.feed.stretches import lasting, on_tick
from splinefeed.geometry.path import Path
from splinefeed.records import LAW_COEFFICIENTS, Array, IntArray, Limits, TimeLaw

#: Ticks that are looked at together.
TOGETHER = 1 << 16
#: Of longer motions, half an hour at 1 ms, ticks are looked at beside breaks and in so many places in between.
MOST_TICKS, EVENLY = 2_000_000, 100_000
#: Setpoints of rotary axes with limits, at most: eleven days at 1 ms.
MOST_ROTARY = 1e9
#: A difference may be over a limit by this share, and by so many roundings of a position.
KEPT, ROUNDINGS = 1e-9, 8.0
#: Rounds of slowing down; what is over a limit by this factor on q is no matter of feed.
ROUNDS, FAR = 6, 2.0
#: How much slower than what is over a limit asks for: the next ticks fall elsewhere.
SLOWER = 1e-6


def held_at_ticks(law: TimeLaw, path: Path, limits: Limits, first: IntArray, passed: Array, breaks: Array) -> TimeLaw:
    """The law, slower from one rest to the next where differences of its setpoints are over a limit of an axis.

    |D^k r| / T^k <= limit for the setpoints r at the ticks of the period T, k = 1, 2, 3, and their chords.
    first (m,)   the first piece of each stretch between rests
    passed (k,)  arc lengths of corners that are passed in motion, mm, across which differences are no derivatives
    breaks (n,)  arc lengths where derivatives jump or the path bends sharply, mm
    Raises PlanError for what no feed mends: next to an end in motion, and where arc length is rounded too much for a
    rotary axis.
    """
    rotary = [limits.of_axes(name, path.axes)[path.linear :] for name in BOUNDS]
    if law.period is not None and np.any(np.isfinite(rotary)) and law.duration > MOST_ROTARY * law.period:
        raise PlanError(
            f"the motion would take {law.duration:.3g} s, which is more than the {MOST_ROTARY:.0e} setpoints that are "
            "held to the limits of rotary axes; ask for more feed or a longer period, or leave those limits out"
        )
    for _ in range(ROUNDS):
        over, worst = _over(law, path, limits, law.breaks[first], passed, breaks)
        moving = np.zeros(len(first), dtype=bool)
        moving[0] = limits.start_feed > 0.0
        moving[-1] |= limits.end_feed > 0.0
        if not np.any(over > 1.0):
            return law
        if np.any(over > np.where(moving, 1.0, FAR)):
            break
        law = _slower(law, first, over)
    k = int(np.argmax(np.where(moving & (over > 1.0), np.inf, over)))
    s, axis = worst[k]
    what = (
        f"the setpoints of {path.axes[int(axis)]} are over its limits" if axis >= 0 else "chords are over their limit"
    )
    where = f"at s = {s:.6g} mm {what}"
    if moving[k]:
        raise PlanError(
            f"{where}, and next to an end in motion nothing can be slowed down; ask for rest there or for less feed, "
            "or leave the limits of that axis out"
        )
    if axis >= path.linear:
        raise PlanError(
            f"{where} at any feed: it turns so far within so little of the path that the rounding of arc length shows, "
            f"{np.spacing(path.length):.3g} mm; split the path there, let the linear axes stand exactly, or leave the "
            "limits of that axis out"
        )
    raise PlanError(f"{where} by {100.0 * (over[k] - 1.0):.3g} % however slow it is; smooth the path there")


BOUNDS = ("axis_velocity", "axis_acceleration", "axis_jerk")


def kept_at_ticks(law: TimeLaw, path: Path, limits: Limits, passed: Array, breaks: Array) -> bool:
    """Whether the setpoints of a law keep the limits of the axes and their chords; see `held_at_ticks`."""
    over, _ = _over(law, path, limits, law.breaks[:1], passed, breaks)
    return bool(np.max(over) <= 1.0)


def _over(law: TimeLaw, path: Path, limits: Limits, begins: Array, passed: Array, breaks: Array) -> tuple[Array, Array]:
    """By how much q of each stretch (m,) must come down for its ticks, and where and in which axis that is, (m, 2).

    begins (m,): when they begin, s; axis -1 stands for a chord.
    """
    over, worst = np.zeros(len(begins)), np.zeros((len(begins), 2))
    bounds = [limits.of_axes(name, path.axes) for name in BOUNDS]
    period = law.period
    if period is None or (limits.chord_error is None and not np.any(np.isfinite(bounds))):
        return over, worst

    def note(share: Array, t: Array, s: Array, axis: IntArray) -> None:
        """Take note of shares (n,) above 1, factors on q, over steps that begin at t, s, and s, mm."""
        more = np.flatnonzero(share > 1.0)
        owner = np.clip(np.searchsorted(begins, t[more] + 0.5 * period, side="right") - 1, 0, None)
        for k, i in zip(owner.tolist(), more.tolist(), strict=True):
            if share[i] > over[k]:
                over[k], worst[k] = share[i], (s[i], axis[i])

    for ticks in _looked_at(law, breaks):
        t = np.asarray(ticks * period, dtype=np.float64)
        s = np.clip(law(np.clip(t, 0.0, law.duration)), 0.0, path.length)
        s[t >= law.duration * (1.0 - 1e-12)] = path.length  # where setpoints end, to the bit
        r = path(s)
        size = np.max(np.abs(r), axis=0)
        size[: path.linear] = np.maximum(size[: path.linear], path.length)  # of arc length, too
        rounding = ROUNDINGS * np.spacing(size)
        for order, bound in enumerate(bounds, start=1):
            if len(ticks) <= order:
                continue
            seen = np.abs(np.diff(r, n=order, axis=0)) - 2.0**order * rounding
            shares = seen / (bound * (1.0 + KEPT) * period**order)
            crosses = np.searchsorted(passed, s[:-order]) != np.searchsorted(passed, s[order:], side="right")
            crosses |= ticks[order:] - ticks[:-order] != order
            axis = np.argmax(shares, axis=1)
            share = np.where(crosses, 0.0, np.max(shares, axis=1, initial=0.0)) ** (2.0 / order)
            note(share, t[:-order], s, axis)
        if limits.chord_error is not None:
            at, share = _chords(path, s, r, breaks, limits.chord_error)
            share = np.where(np.diff(ticks)[at] == 1, share, 0.0)
            note(share, t[at], s[at], np.full(len(at), -1))
    return over, worst


def _looked_at(law: TimeLaw, breaks: Array) -> list[IntArray]:
    """Numbers of the ticks that are looked at, in parts: all of them, or those beside breaks and some in between.

    Between breaks a difference is a mean of the derivative, which the audit holds.
    """
    assert law.period is not None
    top = float(np.max(law.coefficients[:, 1]))
    rest = law.coefficients[-1, 1] == 0.0 or abs(float(law.feed(law.duration))) <= 1e-9 * top
    periods = law.duration / law.period
    last = int(np.ceil(periods * (1.0 - 1e-12)) if rest else np.floor(periods * (1.0 + 1e-12)))  # no short one
    begin, end = -3 * int(law.coefficients[0, 1] == 0.0), last + 1 + 3 * int(rest)
    if last <= MOST_TICKS:
        return [np.arange(max(k - 3, begin), min(k + TOGETHER, end)) for k in range(begin, end, TOGETHER)]
    times = law.breaks[np.clip(np.searchsorted(law.coefficients[:, 0], breaks), 0, len(law.breaks) - 1)]
    around = np.concatenate([np.floor(times / law.period).astype(int), np.linspace(begin, end, EVENLY).astype(int)])
    ticks = np.sort(np.clip(around[:, None] + np.arange(-4, 5), begin, end - 1).ravel())
    ticks = ticks[np.diff(ticks, prepend=begin - 1) > 0]
    return [ticks[max(k - 3, 0) : k + TOGETHER] for k in range(0, len(ticks), TOGETHER)]


def _slower(law: TimeLaw, first: IntArray, over: Array) -> TimeLaw:
    """The law whose stretches, from pieces first (m,) on, last whole periods longer, enough for q by over (m,) less."""
    assert law.period is not None
    period, edges = law.period, np.append(first, len(law.coefficients))
    seconds = np.diff(law.breaks[edges])
    ticks = np.where(over > 1.0, np.ceil(seconds * ((1.0 + SLOWER) * np.sqrt(over) - 1.0) / period), 0.0)
    factor = np.repeat(1.0 + ticks * period / seconds, np.diff(edges))
    shift = np.concatenate([[0.0], np.cumsum(ticks) * period])
    breaks = np.empty(len(law.breaks))
    for i in np.arange(len(first)).tolist():
        begin, end = edges[i], edges[i + 1]
        start = on_tick(float(law.breaks[begin]) + shift[i], period)
        breaks[begin:end] = start + (law.breaks[begin:end] - law.breaks[begin]) * factor[begin]
    breaks[-1] = on_tick(float(law.breaks[-1]) + shift[-1], period)
    breaks, coefficients = lasting(breaks, law.coefficients / factor[:, None] ** np.arange(LAW_COEFFICIENTS))
    return replace(law, breaks=breaks, coefficients=coefficients)


def _chords(path: Path, s: Array, r: Array, breaks: Array, limit: float) -> tuple[IntArray, Array]:
    """Chords (n,) between setpoints r (k, axes) at s (k,), and the share of `limit`, mm, by which the path leaves them.

    It is looked at in three places of every chord, and where its derivatives jump or it bends sharply.
    """
    inside = breaks[(breaks > s[0]) & (breaks < s[-1])]
    at = np.concatenate([inside, *((1.0 - share) * s[:-1] + share * s[1:] for share in (0.25, 0.5, 0.75))])
    first = np.clip(np.searchsorted(s, at, side="right") - 1, 0, len(s) - 2)
    begin, chord = r[first, : path.linear], np.diff(r[:, : path.linear], axis=0)[first]
    away = path(at)[:, : path.linear] - begin
    square = np.maximum(np.sum(chord * chord, axis=1), 1e-300)
    along = np.clip(np.sum(away * chord, axis=1) / square, 0.0, 1.0)
    distance = np.linalg.norm(away - along[:, None] * chord, axis=1)
    return first, (distance - ROUNDINGS * np.spacing(np.max(np.abs(r)))) / (limit * (1.0 + KEPT))
