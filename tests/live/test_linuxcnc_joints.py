"""A five-axis part in LinuxCNC's HAL: by its own kinematics the joints that arrive are on the tool path."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path as File

import numpy as np
import pytest
from benchmarks.hal_session import hal_session
from scipy.spatial import cKDTree

import splinefeed as sf
from linuxcnc_kinematics import asked
from splinefeed.feed.reserve import with_reserve
from splinefeed.geometry.differential import by_arc_length
from splinefeed.kinematics import kinematics
from splinefeed.live.hal_files import HalAxis, hal_text
from splinefeed.live.linuxcnc_sink import LinuxcncSink, installed
from splinefeed.live.motion import along, approach
from splinefeed.live.operator import Operator
from splinefeed.live.stream import play
from splinefeed.records import Array
from tool_paths import FLANK, FLANK_PERIOD, flank

pytestmark = [
    pytest.mark.slow,
    pytest.mark.linuxcnc,
    pytest.mark.skipif(not installed(), reason="no LinuxCNC; on Debian 12: apt-get install linuxcnc-uspace"),
]
#: What the issue asks for, mm.
TIP_ERROR = 1e-6


def test_joints_in_hal_lead_to_the_tool_path_by_linuxcnc_s_kinematics(data_dir: File) -> None:
    path = sf.JointPath(flank(data_dir), kinematics("xyzac-trt"))
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
    assert np.max(off(path.tool, tip)) <= TIP_ERROR


def off(tool: sf.ToolPath, tip: Array) -> Array:
    """Distance of tips (n, 3) from the path, mm: the nearest of many points, and Newton steps from there."""
    s = np.linspace(0.0, tool.length, 20001)
    s = s[cKDTree(tool(s)).query(tip)[1]]
    for _ in range(5):
        r = by_arc_length(tool.evaluate(*tool.locate(s), 3), 3)
        away = r[:, 0] - tip
        s = np.clip(s - np.sum(away * r[:, 1], axis=1) / (1.0 + np.sum(away * r[:, 2], axis=1)), 0.0, tool.length)
    return np.asarray(np.linalg.norm(tool(s) - tip, axis=1))


def first_of(commands: Array, start: Array) -> int:
    """The last tick at which the joints stand where the path begins (deg)."""
    there = np.max(np.abs(commands - np.concatenate([start[:3], np.degrees(start[3:])])), axis=1) < 1e-9
    return int(np.flatnonzero(there)[-1])
