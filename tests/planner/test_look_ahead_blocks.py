"""What a controller's planner needs of the look-ahead: blocks as they are made, the stop behind them, other feeds."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.paths import Smoother
from splinefeed.paths.smoothing import smoothed
from splinefeed.planner import LookAhead

PERIOD = 1e-3
LIMITS = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)


def zigzag(count: int, step: float = 0.4) -> sf.Path:
    points = np.column_stack([step * np.arange(count + 1), 2.0 * np.sin(0.15 * np.arange(count + 1))])
    return sf.Path.polyline(points, feeds=[40.0] * count, tolerances=[0.01] * count)


def smooth(path: sf.Path) -> sf.Path:
    return smoothed(path, "program", corners="round")


def test_blocks_come_one_by_one_and_are_those_of_push():
    path = smooth(zigzag(400))
    one, other = (LookAhead(LIMITS, PERIOD, path.axes, 40) for _ in range(2))
    pushed = one.push(path)
    other.take(path)
    came = other.blocks()
    assert other.time == 0.0
    first = next(came)
    assert other.time == pytest.approx(first.law.duration)
    for a, b in zip(pushed, [first, *came], strict=True):
        np.testing.assert_array_equal(a.law.coefficients, b.law.coefficients)
    assert len(pushed) > 1


def test_the_stop_behind_a_block_goes_on_from_it_and_rests_within_the_limits():
    path = smooth(zigzag(400))
    planner = LookAhead(LIMITS, PERIOD, path.axes, 40)
    assert planner.stop is None
    planner.take(path)
    for block in planner.blocks():
        stop = planner.stop
        assert stop is not None
        begin, end = path.curve_starts[stop.curve] + stop.offset, path.curve_starts[block.curve] + block.offset
        assert begin == pytest.approx(end + block.law.length, abs=1e-9)
        assert stop.law.feed(0.0) == pytest.approx(block.law.feed(block.law.duration), rel=1e-9)
        assert stop.law.feed(stop.law.duration) == pytest.approx(0.0, abs=1e-9)
        t = np.arange(0.0, stop.law.duration, PERIOD)
        rows = path(begin + np.minimum(stop.law(t), stop.law.length))
        assert np.abs(np.diff(rows, n=3, axis=0)).max(initial=0.0) / PERIOD**3 <= 20000 * (1 + 1e-6) + 1e-3
    planner.finish()
    assert planner.stop is None


def test_a_long_line_does_not_starve_what_follows():
    line = sf.Path.polyline([[-300.0, 0.0], [0.0, 0.0]], feeds=[60.0])
    planner = LookAhead(LIMITS, PERIOD, ("x", "y"), 40)
    path = smooth(zigzag(400))
    blocks = planner.push(line)
    for k in range(len(path.curves)):
        blocks += planner.push(sf.Path(path.curves[k : k + 1], feeds=path.feeds[k : k + 1]))
        if blocks:
            break
    known = path.curve_starts[k]
    assert known < 60.0


def test_a_path_under_other_feeds_is_the_same_path():
    path = zigzag(20)
    table = path.table
    slow = path.with_feeds([7.0] * 20)
    assert slow.table is table and slow.feeds is not None and slow.feeds.tolist() == [7.0] * 20
    assert path.feeds is not None and path.feeds[0] == 40.0
    assert sf.plan(slow, LIMITS, period=PERIOD).duration > 1.1 * slow.length / 7.0 * 0.99
    with pytest.raises(sf.errors.InputError, match="feeds has 3 numbers for 20 curves"):
        path.with_feeds([1.0, 2.0, 3.0])


def test_smooth_curves_know_which_curves_they_stand_for():
    lines = zigzag(60)
    corner = sf.Path.polyline(
        np.array([lines.ends[-1, 1], lines.ends[-1, 1] + [30, 0], lines.ends[-1, 1] + [30, 30]]),
        feeds=[20.0, 30.0],
        tolerances=[0.01, 0.01],
    )
    smoother = Smoother("program", ("x", "y"), corners="round", window=16)
    paths, origins = [], []
    for part in (lines, corner):
        paths += smoother.push(part)
        origins += smoother.origins
    paths += smoother.finish()
    origins += smoother.origins
    first = np.concatenate(origins)
    assert len(first) == sum(len(path.curves) for path in paths)
    assert first[0] == 0 and first[-1] == 61 and np.all(np.diff(first) >= 0)
    feeds = np.concatenate([path.feeds for path in paths])
    np.testing.assert_array_equal(feeds, np.r_[[40.0] * 60, 20.0, 30.0][first])


def test_motion_that_cannot_wait_is_planned_early_and_goes_on_as_more_comes():
    points = np.column_stack([np.arange(61), 2.0 * np.sin(0.4 * np.arange(61))])
    path = smoothed(sf.Path.polyline(points, feeds=[40.0] * 60), 0.02, corners="round")
    half = len(path.curves) // 2
    parts = [sf.Path(path.curves[a:b], feeds=path.feeds[a:b]) for a, b in ((0, half), (half, len(path.curves)))]
    planner = LookAhead(LIMITS, PERIOD, path.axes, 400)
    planner.take(parts[0])
    assert list(planner.blocks()) == []
    early = list(planner.blocks(early=True))
    assert len(early) == 1 and planner.stop is not None
    assert early[0].law.feed(early[0].law.duration) > 1.0
    planner.take(parts[1])
    rest = list(planner.blocks(whole=True))
    length = sum(block.law.length for block in [*early, *rest])
    assert length == pytest.approx(path.length, rel=1e-9)
