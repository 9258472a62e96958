"""Straight stretches: limits of the axes are limits along the path, and the seven-phase profile is the exact answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from splinefeed.feed.law import Pieces
from splinefeed.feed.limits import Places
from splinefeed.feed.setting import INSIDE, Setting
from splinefeed.feed.seven_phase import SevenPhase
from splinefeed.feed.track import SAME
from splinefeed.feed.window import REST, Plan, State
from splinefeed.kernels.profile import UNSEEN, lasting_jerk
from splinefeed.records import LAW_COEFFICIENTS, Array, BoolArray, Limits

#: A tangent that turns by less than this, rad, over a whole stretch is that of a straight line.
STRAIGHT = 1e-12
#: Stretches that are looked at together, so that memory stays small; phases of a profile.
TOGETHER, PHASES = 1 << 15, 7
#: Newton steps to the feed of a short stretch: from the right power of it one halves what is too much at least.
NEWTON = 60
#: Places of each span of a stretch that are looked at.
LOOKED = np.clip(np.linspace(0.0, 1.0, 4), INSIDE, 1.0 - INSIDE)


def plan_straight(setting: Setting, low: float, high: float, start: State, stop: State) -> Plan | None:
    """The exact profile of a straight stretch at one feed limit; None if it is not straight, or not bounded so.

    With an end in motion it lasts whole periods, if a lower top feed can make it. Raises PlanError where it is too
    short for its change of feed.
    """
    inner = setting.inside(low, high)
    if start.acceleration or stop.acceleration or np.any(np.isin(inner, setting.passed[0])):
        return None
    edges = np.concatenate([[low], inner, [high]])
    places = setting.places((edges[:-1, None] + np.diff(edges)[:, None] * LOOKED).ravel())
    tangent, feed, top = _along(setting, places, 1)
    return _profile(setting, low, high, start, stop, tangent[0], float(feed[0]), float(top[0]))


def plan_straights(setting: Setting, marks: Array) -> list[Plan | None]:
    """`plan_straight` between neighbouring marks (m + 1,), mm, from rest to rest: all of one span in one go."""
    same = SAME * setting.track.length
    first, last = (np.searchsorted(setting.breaks, s) for s in (marks[:-1] + same, marks[1:] - same))
    single = np.flatnonzero(first >= last)
    found: list[Plan | None] = [None] * (len(marks) - 1)
    for k in np.flatnonzero(first < last).tolist():
        found[k] = plan_straight(setting, float(marks[k]), float(marks[k + 1]), REST, REST)
    if len(single):
        low, high = marks[single], marks[single + 1]
        places = setting.places((low[:, None] + (high - low)[:, None] * LOOKED).ravel())
        columns = _along(setting, places, len(single))
        for k, a, b, tangent, feed, top in zip(single.tolist(), low.tolist(), high.tolist(), *columns, strict=True):
            found[k] = _profile(setting, a, b, REST, REST, tangent, float(feed), float(top))
    return found


def _along(setting: Setting, places: Places, count: int) -> tuple[Array, Array, Array]:
    """Tangents (count, axes), feed that the path asks for and the least top of q (count,) of so many stretches.

    NaN where a stretch is not straight, or asks for several feeds.
    """
    d = places.d.reshape(count, -1, *places.d.shape[1:])
    feeds = np.minimum(places.feed, 1e300).reshape(count, -1)
    length = np.ptp(places.s.reshape(count, -1), axis=1)
    bent = np.max(np.abs(d[:, :, 2]), axis=(1, 2)) * length > STRAIGHT
    turned = np.max(np.ptp(d[:, :, 1], axis=1), axis=1) > STRAIGHT
    top = np.min(setting.rows(places).top.reshape(count, -1), axis=1)
    feed = np.where(bent | turned | (np.ptp(feeds, axis=1) > 0.0), np.nan, places.feed.reshape(count, -1)[:, 0])
    return d[:, 0, 1], feed, top


def _profile(
    setting: Setting, low: float, high: float, start: State, stop: State, tangent: Array, feed: float, top: float
) -> Plan | None:
    """The profile along a tangent (axes,) under a feed, mm/s, where q may be no more than `top`; None for no feed."""
    along = None if np.isnan(feed) else limits_along(setting, tangent, feed, start.feed, stop.feed)
    if along is None or top < (1.0 - STRAIGHT) * along.feed**2:
        return None
    profile = SevenPhase.solve(high - low, along)
    rounding = float(np.spacing(profile.duration))
    calm = (
        lasting_jerk.for_work(1)(along.acceleration, along.jerk, rounding),
        lasting_jerk.for_work(1)(float(along.deceleration or 0.0), float(along.deceleration_jerk or 0.0), rounding),
    )
    if calm != (along.jerk, along.deceleration_jerk):  # acceleration that builds up within the rounding of an instant
        profile = SevenPhase.solve(high - low, replace(along, jerk=calm[0], deceleration_jerk=calm[1]))
    least = profile.duration
    if max(start.feed, stop.feed) > 0.0 and setting.period is not None:
        profile = profile.to_period(setting.period)
    law = profile.law()
    coefficients: Array = law.coefficients.copy()
    coefficients[:, 0] += low
    return Plan(Pieces(np.diff(law.breaks), coefficients), least, 0.0, True)  # exact: nothing is over by any rounding


def straight_rests(setting: Setting, marks: Array) -> tuple[BoolArray, Array, Array]:
    """Which stretches (m,) between rests at marks (m + 1,), mm, are straight in one span, and their exact motions.

    Times of their seven phases (m, 7), s, and coefficients (m, 7, 6); 0 where a stretch is not straight.
    """
    m, limits = len(marks) - 1, setting.limits
    straight = np.zeros(m, dtype=bool)
    along = np.ones((6, m))  # length, feed, acceleration, deceleration, jerk, deceleration jerk
    along[0] = np.diff(marks)
    inner = np.searchsorted(setting.breaks, marks[1:]) - np.searchsorted(setting.breaks, marks[:-1], side="right")
    for first in range(0, m, TOGETHER):
        block = np.arange(first, min(first + TOGETHER, m))
        block = block[inner[block] == 0]
        if not len(block):
            continue
        s = marks[block, None] + along[0, block, None] * LOOKED
        places = setting.places(s.ravel(), alone=True)
        d = places.d.reshape(*s.shape, *places.d.shape[1:])
        feed = places.feed.reshape(s.shape)
        tangent = np.abs(d[:, 0, 1])
        with np.errstate(divide="ignore"):
            velocity, acceleration, jerk = (
                np.min(limits.of_axes(name, setting.axes) / tangent, axis=1)
                for name in ("axis_velocity", "axis_acceleration", "axis_jerk")
            )
        top = np.minimum.reduce([np.full(len(block), limits.feed), feed[:, 0], velocity])
        down = np.inf if limits.deceleration is None else limits.deceleration
        falling = np.inf if limits.deceleration_jerk is None else limits.deceleration_jerk
        along[1, block] = top
        along[2, block], along[3, block] = np.minimum(acceleration, limits.acceleration), np.minimum(acceleration, down)
        along[4, block], along[5, block] = np.minimum(jerk, limits.jerk), np.minimum(jerk, falling)
        bent = np.max(np.abs(d[:, :, 2]), axis=(1, 2)) * along[0, block] > STRAIGHT
        bent |= np.max(np.ptp(d[:, :, 1], axis=1), axis=1) > STRAIGHT
        slower = np.min(setting.rows(places).top.reshape(s.shape), axis=1) < (1.0 - STRAIGHT) * top**2
        bounded = np.all(np.isfinite(along[:, block]), axis=0)
        straight[block] = ~bent & ~slower & bounded & (np.ptp(np.minimum(feed, 1e300), axis=1) == 0.0)
    spans, coefficients = np.zeros((m, PHASES)), np.zeros((m, PHASES, LAW_COEFFICIENTS))
    if np.any(straight):
        found, shapes = seven_phases(*along[:, straight])
        shapes[:, :, 0] += marks[:-1][straight, None]
        spans[straight], coefficients[straight] = found, shapes
    return straight, spans, coefficients


def seven_phases(
    length: Array, feed: Array, acceleration: Array, deceleration: Array, jerk: Array, deceleration_jerk: Array
) -> tuple[Array, Array]:
    """Profiles from rest to rest, as `SevenPhase` makes one: times (n, 7), s, and coefficients of s in t (n, 7, 6)."""
    rounding = 0.0
    for _ in range(2):  # the second time with the rounding of instants known
        up, down = (_lasting(a, j, rounding) for a, j in ((acceleration, jerk), (deceleration, deceleration_jerk)))
        peak = _peaks(length, feed, (acceleration, up), (deceleration, down))
        rise, fall = _ramp(peak, acceleration, up), _ramp(peak, deceleration, down)
        ways = 0.5 * peak * (2.0 * (rise[0] + fall[0]) + rise[1] + fall[1])
        cruise = np.where(peak == feed, np.maximum(length - ways, 0.0) / peak, 0.0)
        spans = np.stack([rise[0], rise[1], rise[0], cruise, fall[0], fall[1], fall[0]], axis=1)
        rounding = float(np.spacing(np.sum(spans)))
    c = np.zeros((len(length), PHASES, LAW_COEFFICIENTS))
    for (edge, middle, reached), j, way in ((rise, up, 1.0), (fall, down, -1.0)):
        # feeds and ways from rest, at the ends of the first two phases
        v1 = 0.5 * reached * edge
        v2 = v1 + reached * middle
        s1 = v1 * edge / 3.0
        s2 = s1 + middle * (v1 + 0.5 * reached * middle)
        s3 = s2 + edge * (v2 + reached * edge / 3.0)
        if way > 0.0:
            places, feeds, rows = (0.0 * s1, s1, s2), (0.0 * v1, v1, v2), (0, 1, 2)
            accelerations, jerks = (0.0 * v1, reached, reached), (j, 0.0 * j, -j)
            c[:, 3, 0], c[:, 3, 1] = s3, peak
        else:
            places, feeds, rows = (length - s3, length - s2, length - s1), (peak, v2, v1), (4, 5, 6)
            accelerations, jerks = (0.0 * v1, -reached, -reached), (-j, 0.0 * j, j)
        for k, *values in zip(rows, places, feeds, accelerations, jerks, strict=True):
            for order, (value, factorial) in enumerate(zip(values, (1.0, 1.0, 2.0, 6.0), strict=True)):
                c[:, k, order] = value / factorial
    return spans, c


def _ramp(rise: Array, acceleration: Array, jerk: Array) -> tuple[Array, Array, Array]:
    """Time of each jerk phase, time between them, and acceleration reached; see `kernels.profile.ramp`."""
    full = acceleration / jerk
    flat = rise >= acceleration * full
    reached = np.where(flat, acceleration, np.minimum(np.sqrt(jerk * rise), acceleration))
    return np.where(flat, full, reached / jerk), np.where(flat, rise / acceleration - full, 0.0), reached


def _peaks(length: Array, feed: Array, up: tuple[Array, Array], down: tuple[Array, Array]) -> Array:
    """The highest feed at which both ramps, of an acceleration and a jerk each, leave room: v/2 (Tu + Td) <= length.

    The way grows with v and is convex. A ramp takes 2 sqrt(v / J) at least, so that this bounds v from above, and
    Newton's steps come down to it.
    """
    highest = (length / (up[1] ** -0.5 + down[1] ** -0.5)) ** (2.0 / 3.0)
    peak = np.minimum(highest, feed)
    for _ in range(NEWTON):
        times = slopes = np.zeros(len(length))
        for a, j in (up, down):
            edge, middle, reached = _ramp(peak, a, j)
            times = times + 2.0 * edge + middle
            slopes = slopes + 1.0 / reached
        over = 0.5 * peak * times - length
        peak = np.where(over > 0.0, peak - over / (0.5 * (times + peak * slopes)), peak)
    return np.asarray(peak)


def _lasting(acceleration: Array, jerk: Array, rounding: float) -> Array:
    """`kernels.profile.lasting_jerk` for many: jerk with which the acceleration does not build up within a rounding."""
    share = rounding * jerk / acceleration
    calm = np.minimum(2.0 * jerk / (1.0 + np.sqrt(1.0 + 4.0 * share)), 0.25 * acceleration / max(rounding, 1e-300))
    return np.asarray(np.where(share > UNSEEN, calm, jerk))


def limits_along(setting: Setting, tangent: Array, feed: float, start: float, stop: float) -> Limits | None:
    """All limits as limits along a line of this tangent (axes,); None where one of the path's derivatives is free."""
    limits = setting.limits
    with np.errstate(divide="ignore"):
        velocity, acceleration, jerk = (
            float(np.min(limits.of_axes(name, setting.axes) / np.abs(tangent)))
            for name in ("axis_velocity", "axis_acceleration", "axis_jerk")
        )
    top = min(limits.feed, feed, velocity)
    down = np.inf if limits.deceleration is None else limits.deceleration
    falling = np.inf if limits.deceleration_jerk is None else limits.deceleration_jerk
    values = [
        min(limits.acceleration, acceleration), min(down, acceleration), min(limits.jerk, jerk), min(falling, jerk),
    ]  # fmt: skip
    if not np.all(np.isfinite(values)) or max(start, stop) > top:
        return None
    return Limits(
        feed=top,
        acceleration=values[0],
        deceleration=values[1],
        jerk=values[2],
        deceleration_jerk=values[3],
        start_feed=start,
        end_feed=stop,
    )
