"""A tool path on a machine, planned as any other path: its joints are axes over the arc length of the tip."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.feed.modes import LOOK_AHEAD, MODES, TIME_OPTIMAL, check_limits, motion
from splinefeed.feed.setting import Setting
from splinefeed.feed.stretches import curve_feeds
from splinefeed.kinematics import JointPath
from splinefeed.records import AXIS_LIMITS, Array, Limits, TimeLaw

#: Names of the tip's own coordinates, which have no limits, before those of the joints.
TIP = ("tip.x", "tip.y", "tip.z")
#: Joints bend where the tip does not: time-optimal has cells half as long as on a path of linear axes.
TOOL_MODES = {TIME_OPTIMAL: replace(MODES[TIME_OPTIMAL], beat=0.1), LOOK_AHEAD: MODES[LOOK_AHEAD]}

#: Times that a motion is planned anew, slower or for less chord error, where its setpoints are over a limit; and by how
#: much more than that.
ROUNDS, HAIR, OVER_CHORD = 5, 1e-6, 1.001
#: A duration within this of a tick, in periods, ends there; ticks that are looked at together.
ON_TICK, TOGETHER = 1e-6, 1 << 15
#: Roundings of a joint; slopes count where the tip moves by more than this share of its longest step.
ROUNDINGS, MOVING = 8.0, 0.01


def plan_tool(path: JointPath, limits: Limits, period: float | None, strategy: str) -> TimeLaw:
    """The motion of a tool tip under limits of joints, tip feed and chord error; from rest to rest at each stop.

    Raises LimitsError for limits that leave acceleration and jerk free, and for steps of velocity at corners, where a
    tool stops; PlanError where no motion keeps the limits.
    """
    check_limits(limits, path.axes, strategy)
    if limits.axis_velocity_step is not None:
        raise LimitsError("axis_velocity_step: a tool stops at the corners of its path; leave it out")
    slower, chord = 1.0, limits.chord_error
    for _ in range(ROUNDS):
        setting = tool_setting(path, _slowed(limits, slower, chord), period)
        with np.errstate(all="ignore"):  # what is not a number is not a motion to take
            law = motion(setting, strategy, TOOL_MODES[strategy])
        if period is None:
            return law
        late, off = _at_ticks(path, law, limits, period)
        if late <= 1.0 and off <= (limits.chord_error or np.inf):
            return law
        slower *= max(late * (1.0 + HAIR), 1.0)
        if chord is not None and limits.chord_error is not None:
            chord *= min(limits.chord_error / max(off * OVER_CHORD, 1e-300), 1.0)
    raise PlanError(
        f"{path.name}: no motion was found that keeps every limit; a joint turns or bends too sharply for its limits: "
        "smooth the path, or keep the tool axis further from that of the last rotary joint"
    )


def _slowed(limits: Limits, k: float, chord: float | None) -> Limits:
    """Limits under which the same motion takes k times as long: velocities by k, accelerations by k^2, jerks by k^3."""
    if k == 1.0:
        return replace(limits, chord_error=chord)
    power = {"feed": 1, "acceleration": 2, "deceleration": 2, "jerk": 3, "deceleration_jerk": 3, "centripetal": 2}
    power |= {name: order for order, name in enumerate(AXIS_LIMITS, start=1)}
    changes: dict[str, Any] = {}
    for name, order in power.items():
        value = getattr(limits, name)
        if isinstance(value, Mapping):
            changes[name] = {axis: each / k**order for axis, each in value.items()}
        elif value is not None and value < math.inf:
            changes[name] = value / k**order
    return replace(limits, chord_error=chord, **changes)


def _at_ticks(path: JointPath, law: TimeLaw, limits: Limits, period: float) -> tuple[float, float]:
    """By what factor setpoints are too fast for the limits of joints, and how far the tip is off between them, mm.

    The audit looks at places of each piece, and a peak between them may be higher than a parabola says. A joint is
    known to ROUNDINGS eps (|q| + |dq/ds| L).
    """
    count = math.ceil(law.duration / period - ON_TICK) + 1
    bounds = [limits.of_axes(name, path.axes) for name in AXIS_LIMITS]
    late, off = 0.0, 0.0
    for first in range(0, count - 1, TOGETHER):
        low, high = (-3 if limits.start_feed == 0.0 else 0), count + (3 if limits.end_feed == 0.0 else 0)
        ticks = np.arange(max(first - 3, low), min(first + TOGETHER + 4, high)) * period
        s = np.clip(law(np.clip(ticks, 0.0, law.duration)), 0.0, path.length)
        s[ticks >= law.duration] = path.length
        r = path(s)
        steps, moved = np.diff(r, axis=0), np.diff(s)
        moving = moved > MOVING * np.max(moved)
        steep = np.max(np.abs(steps[moving]) / moved[moving, None], axis=0, initial=0.0)
        rounding = ROUNDINGS * np.finfo(float).eps * (np.max(np.abs(r), axis=0) + steep * path.length)
        for order, bound in enumerate(bounds, start=1):
            seen = np.max(np.abs(np.diff(r, n=order, axis=0)), axis=0) / period**order
            share = float(np.max((seen - 2.0**order * rounding / period**order) / bound))
            late = max(late, max(share, 0.0) ** (1.0 / order))
        if limits.chord_error is not None:
            tip = path.kinematics.forward(0.5 * (r[1:] + r[:-1]))[0]
            d = path.tool.evaluate(*path.tool.locate(0.5 * (s[1:] + s[:-1])), 1)
            away, tangent = tip - d[:, 0], d[:, 1] / np.linalg.norm(d[:, 1], axis=1)[:, None]
            away -= np.sum(away * tangent, axis=1)[:, None] * tangent
            off = max(off, float(np.max(np.linalg.norm(away, axis=1))))
    return late, off


def tool_setting(path: JointPath, limits: Limits, period: float | None) -> Setting:
    """What a motion along the path is planned under."""
    feeds = curve_feeds(path.tool, limits)
    changes = np.flatnonzero(np.diff(feeds) != 0.0) + 1
    none = np.zeros(0)
    return Setting(
        path,
        of_joints(limits, path),
        (*TIP, *path.axes),
        len(TIP),
        period,
        (path.tool.curve_starts[changes], feeds[np.concatenate([[0], changes])]),
        (none, none),
        _rests(path),
    )


def _rests(path: JointPath) -> Array:
    """Arc lengths (k,) strictly inside at which the motion rests, mm: stops and dwells."""
    places = np.unique([*path.stops, *(s for s, _ in path.dwells)])
    return np.asarray(places[(places > 0.0) & (places < path.length)])


def of_joints(limits: Limits, path: JointPath) -> Limits:
    """The limits with one number for all linear joints written as one for each of them."""
    changes: dict[str, Any] = {}
    for name in AXIS_LIMITS:
        given = getattr(limits, name)
        if given is not None and not isinstance(given, Mapping):
            changes[name] = dict.fromkeys(path.axes[: path.linear], given)
        limits.of_axes(name, path.axes)  # refuses limits of joints that are not there
    return replace(limits, **changes) if changes else limits
