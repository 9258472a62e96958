"""A five-axis part in LinuxCNC's HAL: by its own kinematics the joints that arrive are on the tool path."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path as File

import numpy as np
import pytest
from benchmarks.hal_session import hal_session
from benchmarks.linuxcnc_planner import PERIOD
from benchmarks.tool_controller import off, streamed

import splinefeed as sf
from linuxcnc_kinematics import asked
from splinefeed.kinematics import kinematics
from splinefeed.live.hal_files import HalAxis, hal_text
from splinefeed.live.linuxcnc_sink import LinuxcncSink, installed
from splinefeed.live.motion import along, approach
from splinefeed.live.operator import Operator
from splinefeed.live.stream import play
from splinefeed.planner.override.reserve import with_reserve
from splinefeed.records import Array
from tool_paths import FLANK, FLANK_PERIOD, flank

pytestmark = [
    pytest.mark.slow,
    pytest.mark.linuxcnc,
    pytest.mark.skipif(not installed(), reason="no LinuxCNC; on Debian 12: apt-get install linuxcnc-uspace"),
]
#: What the issue asks for, mm.
TIP_ERROR = 1e-6
#: The simulated trunnion that LinuxCNC brings, with its own offsets, and programs for it.
TRUNNION = File("/usr/share/doc/linuxcnc/examples/sample-configs/sim/axis/vismach/5axis/table-rotary-tilting")
needs_trunnion = pytest.mark.skipif(not TRUNNION.is_dir(), reason="LinuxCNC is here without its sample configurations")


def test_joints_in_hal_lead_to_the_tool_path_by_linuxcnc_s_kinematics(data_dir: File) -> None:
    path = sf.kinematics.JointPath(flank(data_dir), kinematics("xyzac-trt"))
    law = sf.plan(path, with_reserve(FLANK), period=FLANK_PERIOD)
    axes = path.axes
    text = hal_text(tuple(HalAxis(axis) for axis in axes), FLANK_PERIOD)
    with hal_session(text):
        sink = LinuxcncSink(1500, record=True, settle=0.1)
        state = play(
            along(path, law, FLANK, highest=1.0),
            sink,
            Operator(),
            1500,
            approach=partial(approach, axes=axes, limits=replace(FLANK, chord_error=None), period=FLANK_PERIOD),
        )
    assert state.done
    assert state.underruns == 0
    commands = sink.samples[:, 3:8]
    seen = commands[first_of(commands, path(0.0)) :]
    assert np.allclose(seen[-1, :3], path(path.length)[:3], atol=1e-9)
    rows = [{"pins": {}, "inverse": False, "rows": seen.tolist()}]
    tip = np.array(asked("xyzac-trt-kins", rows)[0])[:, :3]
    assert np.max(off(path.tool, tip)[0]) <= TIP_ERROR


def test_linuxcnc_s_motion_controller_sees_the_tip_on_the_path(data_dir: File) -> None:
    """All of LinuxCNC on xyzac-trt, its joints streamed: what its own forward kinematics say at every servo tick."""
    path = sf.kinematics.JointPath(flank(data_dir), kinematics("xyzac-trt"))
    joints, poses = streamed(path, replace(FLANK, chord_error=None))
    assert np.allclose(poses[-1], np.append(path.tool(path.length), np.degrees(path(path.length)[3:])), atol=1e-9)
    assert len(poses) >= 8.0 / PERIOD
    assert np.max(off(path.tool, poses[:, :3])[0]) <= TIP_ERROR
    shares = [np.max(np.abs(np.diff(joints, n, axis=0)), axis=0) / PERIOD**n for n in (1, 2, 3)]
    for name, seen in zip(("axis_velocity", "axis_acceleration", "axis_jerk"), shares, strict=True):
        assert np.max(seen / FLANK.of_axes(name, path.axes)) <= 1.0 + 1e-6, name


@needs_trunnion
def test_the_trunnion_that_linuxcnc_brings_sees_the_tip_on_the_path(data_dir: File) -> None:
    """Its xyzac-trt.ini as it comes, but for the screen: its kinematics, its offsets, its joints."""
    ini = TRUNNION / "xyzac-trt.ini"
    said = dict(re.findall(r"sets :(y-offset|z-offset) +(\S+)", ini.read_text(encoding="utf-8")))
    y, z = float(said["y-offset"]), float(said["z-offset"])
    assert y and z
    path = sf.kinematics.JointPath(flank(data_dir), kinematics("xyzac-trt", y_offset=y, z_offset=z))
    _, poses = streamed(path, replace(FLANK, chord_error=None), ini)
    assert len(poses) >= 8.0 / PERIOD
    assert np.max(off(path.tool, poses[:, :3])[0]) <= TIP_ERROR


def first_of(commands: Array, start: Array) -> int:
    """The last tick at which the joints stand where the path begins (deg)."""
    there = np.max(np.abs(commands - np.concatenate([start[:3], np.degrees(start[3:])])), axis=1) < 1e-9
    return int(np.flatnonzero(there)[-1])
