"""Which corners of a path are passed in motion, and how fast."""

from __future__ import annotations

import numpy as np

from splinefeed.paths.path import Path
from splinefeed.records import Array, Limits

#: A corner is passed where that allows at least this share of the feed that a ramp at rest soon reaches; else it is a
#: stop, as a feed next to nothing is.
WORTH_PASSING = 0.02
#: A corner that turns back by less than this, rad, is no corner to pass but a cusp.
SHARPEST = np.pi - 1e-3


def passed_corners(path: Path, limits: Limits, period: float | None) -> tuple[Array, Array]:
    """Arc lengths (k,) of the corners that are passed, mm, and the largest feed there, mm/s; none without a step.

    feed |r' behind - r' before| <= axis_velocity_step of each axis; with a chord error the setpoints on both sides of a
    corner of angle phi, v T apart, leave it by v T / 2 sin(phi / 2) at most.
    """
    corners = path.corners
    asked = [float(path.curve_starts[marker.before]) for marker in path.markers if marker.stop]
    passing = corners.stop & (corners.angle <= SHARPEST) & np.isfinite(corners.curvature_jump)
    passing &= ~np.isin(corners.s, asked) & (corners.s > 0.0) & (corners.s < path.length)
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
