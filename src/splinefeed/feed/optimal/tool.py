"""A tool path on a machine, planned as any other path: its joints are axes over the arc length of the tip."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.feed.optimal.plan import LOOK_AHEAD, MODES, TIME_OPTIMAL, check_limits, motion
from splinefeed.feed.optimal.setting import Setting
from splinefeed.feed.stretches import curve_feeds
from splinefeed.kinematics import JointPath
from splinefeed.records import AXIS_LIMITS, Array, Limits, TimeLaw

#: Names of the tip's own coordinates, which have no limits, before those of the joints.
TIP = ("tip.x", "tip.y", "tip.z")
#: Joints bend where the tip does not: time-optimal has cells half as long as on a path of linear axes.
TOOL_MODES = {TIME_OPTIMAL: replace(MODES[TIME_OPTIMAL], beat=0.1), LOOK_AHEAD: MODES[LOOK_AHEAD]}

#: Times that a chord error which is exceeded between setpoints is planned for less of it, and how much less than that.
CHORD_ROUNDS, OVER_CHORD = 4, 1.001
#: A duration within this of a tick, in periods, ends there; ticks that are looked at together.
ON_TICK, TOGETHER = 1e-6, 1 << 15


def plan_tool(path: JointPath, limits: Limits, period: float | None, strategy: str) -> TimeLaw:
    """The motion of a tool tip under limits of joints, tip feed and chord error; from rest to rest at each stop.

    Raises LimitsError for limits that leave acceleration and jerk free, and for steps of velocity at corners, where a
    tool stops; PlanError where no motion keeps the limits.
    """
    check_limits(limits, path.axes, strategy)
    if limits.axis_velocity_step is not None:
        raise LimitsError("axis_velocity_step: a tool stops at the corners of its path; leave it out")
    chord = limits.chord_error
    for _ in range(CHORD_ROUNDS):
        setting = tool_setting(path, replace(limits, chord_error=chord), period)
        with np.errstate(all="ignore"):  # what is no number is no motion to take
            law = motion(setting, strategy, TOOL_MODES[strategy])
        if limits.chord_error is None or chord is None or period is None:
            return law
        over = _chord_error(path, law, period) / limits.chord_error
        if over <= 1.0:
            return law
        chord /= over * OVER_CHORD
    raise PlanError(
        f"{path.name}: no motion was found that keeps every limit; a joint turns or bends too sharply for its limits: "
        "smooth the path, or keep the tool axis further from that of the last rotary joint"
    )


def _chord_error(path: JointPath, law: TimeLaw, period: float) -> float:
    """How far the tip is from its path in the middle between setpoints, at most, mm; joints move straight there."""
    ticks = np.minimum(np.arange(math.ceil(law.duration / period - ON_TICK) + 1) * period, law.duration)
    worst = 0.0
    for first in range(0, len(ticks) - 1, TOGETHER):
        s = np.clip(law(ticks[first : first + TOGETHER + 1]), 0.0, path.length)
        r = path(s)
        tip = path.kinematics.forward(0.5 * (r[1:] + r[:-1]))[0]
        d = path.derivatives(0.5 * (s[1:] + s[:-1]))[:, :2, :3]
        off, tangent = tip - d[:, 0], d[:, 1]
        off -= np.sum(off * tangent, axis=1)[:, None] * tangent
        worst = max(worst, float(np.max(np.linalg.norm(off, axis=1), initial=0.0)))
    return worst


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
