"""Joints beside the axes of a path: exact derivatives, and limits that a plan keeps."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.kinematics import kinematics
from splinefeed.kinematics.with_joints import Joints
from splinefeed.planner.stream import LookAhead

PERIOD = 1e-3
TABLE = kinematics("xyzac-trt", y_offset=20.0, z_offset=-30.0)


def joints_of_the_table(r):
    return TABLE.slides((r[0], r[1], r[2]), (r[3], r[4]))


MOVED = Joints(("joint 0", "joint 1", "joint 2"), joints_of_the_table)
AXES = ("x", "y", "z", "a", "c")


def wavy() -> sf.Path:
    t = np.linspace(0.0, 1.0, 60)
    turns = np.radians(np.column_stack([-20 - 20 * np.sin(7 * t), 100 * t]))
    places = np.column_stack([40 * np.cos(6 * t), 30 * np.sin(5 * t), 10 * t, turns])
    return sf.smooth(sf.Path.polyline(places, axes=AXES), 0.01)


def test_derivatives_are_those_of_the_positions():
    track, h = MOVED.along(wavy()), 1e-4
    s = np.linspace(0.3, 0.7, 9) * track.length
    d = track.derivatives(s)
    np.testing.assert_allclose(track(s), d[:, 0], atol=1e-9)
    around = [track.derivatives(s + by)[:, :3] for by in (-h, h)]
    np.testing.assert_allclose((around[1] - around[0]) / (2.0 * h), d[:, 1:], atol=2e-5)
    np.testing.assert_allclose(track.positions(np.zeros(9, int), s, s, d[:, 0, :5]), d[:, 0], atol=1e-9)
    assert track.axes == (*AXES, *MOVED.names) and track.weights[5:].tolist() == [0.0, 0.0, 0.0]
    low, high = track.reach
    assert np.all(low <= high)


def places(path: sf.Path, blocks, end: float):
    """Where the motion is at each tick, mm."""
    s = np.zeros(round(end / PERIOD) + 1)
    for block in blocks:
        law, begin = block.law, block.tick * PERIOD + block.phase
        ticks = np.arange(np.ceil(begin / PERIOD - 1e-6), np.floor((begin + law.breaks[-1]) / PERIOD + 1e-6) + 1)
        ticks = ticks[ticks < len(s)].astype(int)
        at = np.clip(np.searchsorted(law.breaks, ticks * PERIOD - begin, side="right") - 1, 0, len(law.breaks) - 2)
        t = ticks * PERIOD - begin - law.breaks[at]
        own = sum(law.coefficients[at, k] * t**k for k in range(law.coefficients.shape[1]))
        s[ticks] = path.curve_starts[block.curve] + block.offset + own
    return np.clip(s, 0.0, path.length)


def test_a_plan_keeps_limits_of_joints_and_is_slower_for_them():
    path = wavy()
    size = dict.fromkeys("xyz", 60.0) | dict.fromkeys("ac", 1.5)
    times = []
    for moved in (None, MOVED):
        names = size if moved is None else size | dict.fromkeys(moved.names, 40.0)
        limits = sf.Limits(
            feed=80.0, axis_velocity=names,
            axis_acceleration={name: 15.0 * value for name, value in names.items()},
            axis_jerk={name: 700.0 * value for name, value in names.items()},
        )  # fmt: skip
        ahead = LookAhead(limits, PERIOD, path.axes, 60, joints=moved)
        blocks = [*ahead.push(path), *ahead.finish()]
        times.append(ahead.time)
        s = places(path, blocks, ahead.time)
        rows = MOVED.along(path)(s)[:, 5:]
        over = [np.abs(np.diff(rows, n=n, axis=0)).max() / PERIOD**n / (40.0 * by) for n, by in ((1, 1.0), (2, 15.0))]
        assert (max(over) <= 1.0 + 1e-6) == (moved is not None)
    assert times[1] > times[0]


def test_limits_name_joints_only_where_there_are_some():
    limits = sf.Limits(feed=80.0, axis_jerk={"x": 1e4, "joint 0": 1e4})
    with pytest.raises(sf.errors.LimitsError, match="joint 0"):
        LookAhead(limits, PERIOD, AXES, 60)
    LookAhead(limits, PERIOD, AXES, 60, joints=MOVED)


def test_a_whole_plan_keeps_limits_of_joints_at_its_ticks():
    path = Joints(("left", "right"), lambda r: (r[0] + r[1], r[0] - r[1])).along(sf.shapes.butterfly())
    limits = sf.Limits(
        feed=60, axis_acceleration=600, axis_jerk={**dict.fromkeys("xy", 4e4), "left": 2e4, "right": 2e4}
    )
    law = sf.plan(path, limits, period=PERIOD)
    setpoints = sf.interpolate(path, law)
    jerk = np.abs(np.diff(setpoints.position[:, 2:], n=3, axis=0)).max() / PERIOD**3
    assert 0.95 < jerk / 2e4 <= 1.0 + 1e-6
    verdict = sf.check(setpoints, path, limits, law=law)
    assert verdict.ok, verdict.problems
