"""Joints of a tool path under a feedrate override: on the path, within the limits of joints, whatever the rate does."""

from __future__ import annotations

from pathlib import Path as File

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.interpolation.arc_length import fill
from splinefeed.live.motion import along
from splinefeed.planner.override.reserve import with_reserve
from tool_paths import FLANK, FLANK_PERIOD, MACHINES, flank, random_limits, random_tool_path


@pytest.mark.parametrize("seed", [0, 1, 2, 4])  # 4: lines, with stops at which joints turn off
def test_joints_keep_their_limits_at_any_rate(seed: int, data_dir: File) -> None:
    random = np.random.default_rng(seed)
    machine = MACHINES[0]
    limits, period = (FLANK, FLANK_PERIOD) if seed == 0 else random_limits(seed, machine.joints)
    tool = flank(data_dir) if seed == 0 else random_tool_path(seed)
    path = sf.kinematics.JointPath(tool, machine)
    law = sf.plan(path, with_reserve(limits), period=period, strategy="look-ahead")
    motion = along(path, law, limits)
    rows = []
    while not motion.done and len(rows) < 400:
        wanted = float(random.choice([1.0, 2.0, 0.0, 0.4])) if len(rows) < 200 else 1.0
        rows.append(motion.take(60, wanted))
    position = np.concatenate(rows)
    assert motion.done
    tip, _ = machine.forward(position)
    s = fill(path, law, np.array([motion.tau_of(row) for row in range(1, motion.rows + 1)]))[2]
    assert np.max(np.linalg.norm(tip - tool(s), axis=1)) < 1e-10
    for order, name in enumerate(("axis_velocity", "axis_acceleration", "axis_jerk"), start=1):
        seen = np.max(np.abs(np.diff(position, n=order, axis=0)), axis=0) / period**order
        assert np.max(seen / limits.of_axes(name, path.axes)) <= 1.0 + 1e-6, name
