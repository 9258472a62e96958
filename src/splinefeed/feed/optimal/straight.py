"""Straight stretches: limits of the axes are limits along the path, and the seven-phase profile is the exact answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from splinefeed.feed.optimal.law import Pieces
from splinefeed.feed.optimal.limits import Places
from splinefeed.feed.optimal.setting import INSIDE, Setting
from splinefeed.feed.optimal.stretch import REST, Plan, State
from splinefeed.feed.optimal.track import SAME
from splinefeed.feed.seven_phase import SevenPhase
from splinefeed.kernels.profile import lasting_jerk
from splinefeed.records import Array, Limits

#: A tangent that turns by less than this, rad, over a whole stretch is that of a straight line.
STRAIGHT = 1e-12
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
