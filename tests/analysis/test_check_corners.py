"""Corners in passing, as the check sees them by setpoints alone."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.analysis.check_corners import corner_feed, neighbours


def means_at(profile, share: float) -> tuple[np.ndarray, float]:
    """Mean feeds of three steps, the corner at `share` of the middle one, and the way to it, from feed by time."""
    t = np.linspace(-1 - share, 2 - share, 30001)
    feed = profile(t)
    s = np.concatenate([[0.0], np.cumsum(0.5 * (feed[1:] + feed[:-1]) * np.diff(t))])
    ticks = np.interp([-1 - share, -share, 1 - share, 2 - share, 0.0], t, s)
    return np.diff(ticks[:4]), float(ticks[4] - ticks[1])


@pytest.mark.parametrize("share", [0.0, 0.13, 0.5, 0.9, 1.0])
@pytest.mark.parametrize(
    ("before", "after", "jerk"),
    [(-0.3, 0.3, 0), (-0.1, 0.4, 0), (0.3, 0.1, 0), (0.1, 0.3, 0), (0.2, 0.2, 0), (-0.2, -0.3, 0), (0.1, 0.1, 0.05)],
)
def test_the_feed_at_a_corner_is_never_overstated(share, before, after, jerk):
    means, ahead = means_at(lambda t: 1.0 + np.where(t < 0, before, after) * t + 0.5 * jerk * t * t, share)
    found = corner_feed(means, ahead, 1.0)
    assert found <= 1.0 + 1e-6
    assert found > 1.0 - 0.5 * abs(after - before) - jerk - 1e-6
    if before == after and not jerk:
        assert found == pytest.approx(1.0, rel=1e-6)


def test_a_step_a_ppm_too_large_is_found_where_the_feed_is_steady():
    path = sf.Path([sf.NurbsCurve(1, [0, 0, 1, 2, 2], [[0, 0], [30, 0], [60, 4]])])
    x = 4 / np.hypot(30, 4)  # how much dy/ds jumps
    s = np.arange(0, 601) * path.length / 600
    position = path(s)
    points = sf.Setpoints(
        t=np.arange(601) * 1e-3, curve=np.zeros(601, dtype=int), u=np.full(601, np.nan), s=s, feed=np.zeros(601),
        position=position, axes=path.axes, period=1e-3, method="other",
    )  # fmt: skip
    feed = path.length / 0.6
    for share, ok in ((1 - 1e-6, False), (1 + 1e-6, True)):
        limits = sf.Limits(feed=2 * feed, axis_velocity_step={"y": share * feed * x}, start_feed=feed, end_feed=feed)
        verdict = sf.check(points, path, limits)
        assert verdict.limits["axis_velocity_step.y"].holds == ok
        assert verdict.limits["axis_velocity_step.y"].at_s == pytest.approx(30)


def test_only_neighbouring_stops_are_neighbours():
    rests = np.array([0.0, 1.0, 5.0])
    begin, end = np.array([0.0, 0.0, 1.0 + 1e-12, 0.5, 1.0]), np.array([1.0, 5.0, 5.0, 1.0, 4.9])
    assert neighbours(rests, begin, end, 1e-9).tolist() == [True, False, True, False, False]
