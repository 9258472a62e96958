"""Two arms of seven joints are one motion: planned, checked, saved, drawn and exported."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

import splinefeed as sf

PERIOD = 1e-3


def test_fourteen_joints_are_one_motion(tmp_path):
    points = np.random.default_rng(3).uniform(-1, 1, (6, 14))
    spline = make_interp_spline(np.linspace(0, 1, 6), points, 5)
    joints = tuple(sf.records.Joint(f"{side}_{k}", "rad") for side in ("left", "right") for k in range(1, 8))
    path = sf.Path([sf.NurbsCurve(5, spline.t, spline.c)], axes=joints, name="two arms")
    limits = sf.Limits(axis_velocity=[2.0] * 14, axis_acceleration=[10.0] * 14, axis_jerk=[500.0] * 14)
    run = sf.run(path, limits, period=PERIOD)
    assert run.ok
    q = run.points.position
    whole = np.concatenate([np.ones((3, 1)) * q[0], q, np.ones((3, 1)) * q[-1]])
    shares = [np.abs(np.diff(whole, k, axis=0)).max() / PERIOD**k / most for k, most in ((1, 2), (2, 10), (3, 500))]
    assert 0.99 < max(shares) <= 1 + 1e-6
    for name in ("move.csv", "move.h5", "move.npz"):
        sf.save(run.points, tmp_path / name)
        np.testing.assert_array_equal(sf.load(tmp_path / name).position, q)
    assert len(sf.robots.joint_trajectory(run).as_dict()["joint_names"]) == 14
    with pytest.raises(sf.errors.CurveError, match="1 to 16 are possible"):
        sf.NurbsCurve(1, [0, 0, 1, 1], np.zeros((2, 17)))
