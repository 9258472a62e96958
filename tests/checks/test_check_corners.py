"""Corners in passing, outliers of a few roundings, and rotary axes alone, as the check sees them by setpoints alone."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.checks.bounds import corner_feed, hidden_dip, neighbours


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


@pytest.mark.parametrize("share", [0.02, 0.3, 0.5, 0.98])
@pytest.mark.parametrize("rates", [(40.0, 40.0), (300.0, 8.0), (2.0, 60.0)])
@pytest.mark.parametrize("depth", [0.05, 0.4, 0.9])  # 0.05 may be no more than what shows anyway
def test_a_dip_at_a_corner_between_two_ticks_is_allowed_for(share, rates, depth):
    slow, quick = rates  # as far as the means show it: from 1.0 down to the corner, and up to 1.2
    t = np.linspace(-2 - share, 3 - share, 50001)
    feed = np.where(t < 0, np.minimum(1.0, 1 - depth - slow * t), np.minimum(1.2, 1 - depth + quick * t))
    s = np.concatenate([[0.0], np.cumsum(0.5 * (feed[1:] + feed[:-1]) * np.diff(t))])
    ticks = np.interp(np.arange(-2, 4) - share, t, s)
    ahead = float(np.interp(0.0, t, s) - ticks[2])
    seen = corner_feed(np.diff(ticks)[1:4], ahead, 1.0)
    for limits in ((np.array(rates), np.full(2, np.inf)), (np.full(2, np.inf), np.array(rates) ** 2 / (2 * depth))):
        assert seen - hidden_dip(np.diff(ticks), 0.0, 1.0, *limits) <= 1 - depth + 1e-3
    assert seen > 1 - depth or depth == 0.05


def test_an_even_feed_hides_no_dip_and_a_slow_change_hardly_one():
    limits = np.full(2, 500.0), np.full(2, 20000.0)
    assert hidden_dip(np.full(5, 60.0) + 1e-13, 1e-12, 1e-3, *limits) == 0
    means = 60 - 0.5 * 20000 * (np.arange(5) * 1e-3) ** 2  # jerk up to the limit
    assert hidden_dip(means, 1e-12, 1e-3, *limits) < 2e-3 * 60
    free = np.full(2, np.inf)
    assert hidden_dip(np.array([60, 60, 59, 60, 60.0]), 0.0, 1e-3, free, free) == 0


@pytest.mark.parametrize("more", [{}, {"acceleration": 500, "axis_jerk": 20000}, {"axis_acceleration": 500}])
def test_a_step_a_ppm_too_large_is_found_where_the_feed_is_steady(more):
    path = sf.Path([sf.NurbsCurve(1, [0, 0, 1, 2, 2], [[0, 0], [30, 0], [60, 4]])])
    x = 4 / np.hypot(30, 4)  # how much dy/ds jumps
    s = np.arange(0, 601) * path.length / 600
    position = path(s)
    points = sf.Setpoints(
        t=np.arange(601) * 1e-3, curve=np.zeros(601, dtype=int), u=np.full(601, np.nan), s=s, feed=np.zeros(601),
        position=position, axes=path.axes, period=1e-3, method="other",
    )  # fmt: skip
    feed = path.length / 0.6
    for share, ok in ((1 - 2e-6, False), (1 + 1e-6, True)):
        limits = sf.Limits(
            feed=2 * feed, axis_velocity_step={"y": share * feed * x}, start_feed=feed, end_feed=feed, **more
        )
        verdict = sf.check(points, path, limits)
        assert verdict.limits["axis_velocity_step.y"].holds == ok
        assert verdict.limits["axis_velocity_step.y"].at_s == pytest.approx(30)


def test_only_neighbouring_stops_are_neighbours():
    rests = np.array([0.0, 1.0, 5.0])
    begin, end = np.array([0.0, 0.0, 1.0 + 1e-12, 0.5, 1.0]), np.array([1.0, 5.0, 5.0, 1.0, 4.9])
    assert neighbours(rests, begin, end, 1e-9).tolist() == [True, False, True, False, False]


@pytest.mark.parametrize("tick", [1, 2, 250, 498, 499])
@pytest.mark.parametrize("axis", [0, 1])
def test_an_outlier_of_a_few_roundings_is_found_where_it_is(tick, axis):
    path = sf.Path([sf.NurbsCurve(1, [0, 0, 1, 1], [[0, 0], [30, 40]])])
    s = np.arange(501) * path.length / 500
    limits = sf.Limits(
        feed=1e6, axis_jerk=1e-12, start_feed=path.length / 0.5, end_feed=path.length / 0.5, acceleration=1e9
    )
    position = path(s)
    position[tick, axis] += 5 * np.finfo(float).eps * (path.length + np.max(np.abs(position[:, axis])))
    nothing = np.full(501, np.nan)
    points = sf.Setpoints(
        t=np.arange(501) * 1e-3, curve=np.zeros(501, dtype=int), u=nothing, s=nothing, feed=nothing,
        position=position, axes=path.axes, period=1e-3, method="other",
    )  # fmt: skip
    verdict = sf.check(points, path, limits)
    name = f"axis_jerk.{'xy'[axis]}"
    assert [n for n, result in verdict.limits.items() if not result.holds] == [name]
    assert abs(verdict.limits[name].at_t - tick * 1e-3) < 2.5e-3


def test_moves_of_rotary_axes_alone_are_said_to_be_in_degrees():
    move = sf.NurbsCurve(1, [0, 0, 1, 1], [[0, 0], [10, 0]])
    turn = sf.NurbsCurve(1, [0, 0, 1, 1], [[10, 0], [10, 1]])
    limits = sf.Limits(feed=60, acceleration=500, jerk=20000)
    for curves, note in (([move, turn], "on 1 of 2 curves, the first from s = 10 mm"), ([move], None)):
        path = sf.Path(curves, axes=("x", "a"))
        points = sf.interpolate(path, sf.plan(path, limits, period=1e-3))
        notes = sf.check(points, path, limits).notes
        assert (len(notes) == 0) if note is None else notes[0].startswith(note)
