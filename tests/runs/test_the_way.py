"""The way of a path from `sf.run` to its setpoints: how many files a reader of it meets, and how often one again."""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path as File
from types import FrameType
from typing import Any

import pytest

import splinefeed as sf

ROOT = File(sf.__file__).parent
#: Rooms whose files the way goes through: what a path is, and how it is measured, is not on it.
ROOMS = ("runs", "planner", "interpolation")
ALONG_PATH = sf.Limits(feed=60.0, acceleration=500.0, jerk=20000.0)
OF_AXES = sf.Limits(
    feed=60.0,
    axis_velocity={"x": 50.0, "y": 50.0},
    axis_acceleration={"x": 500.0, "y": 500.0},
    axis_jerk={"x": 20000.0, "y": 20000.0},
)


def files_that_get(path: sf.Path, limits: sf.Limits) -> list[str]:
    """Files of the functions that are given the path, in order of their calls, up to the first setpoints."""
    files: list[str] = []
    made = False

    def called(frame: FrameType, event: str, arg: Any) -> None:
        nonlocal made
        code = frame.f_code
        if event != "call" or made or not File(code.co_filename).is_relative_to(ROOT):
            return
        file = File(code.co_filename).relative_to(ROOT)
        made = made or isinstance(frame.f_locals.get("self"), sf.Setpoints)
        given = [frame.f_locals.get(name) for name in code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]]
        if file.parts[0] in ROOMS and any(each is path for each in given) and str(file) not in files[-1:]:
            files.append(str(file))

    before = sys.getprofile()
    sys.setprofile(called)
    try:
        sf.run(path, limits)
    finally:
        sys.setprofile(before)
    assert made
    return files


@pytest.mark.parametrize("limits", [ALONG_PATH, OF_AXES], ids=["along the path", "of axes"])
def test_a_path_meets_eight_files_on_its_way_to_setpoints(limits: sf.Limits) -> None:
    files = files_that_get(sf.shapes.butterfly(), limits)
    assert {"runs/run.py", "planner/planning.py", "interpolation/arc_length.py"} <= set(files)
    assert len(set(files)) <= 8, files


@pytest.mark.parametrize("limits", [ALONG_PATH, OF_AXES], ids=["along the path", "of axes"])
def test_a_path_comes_back_to_three_files_at_most(limits: sf.Limits) -> None:
    files = files_that_get(sf.shapes.butterfly(), limits)
    again = {(before, file) for k, (before, file) in enumerate(pairwise(files)) if file in files[: k + 1]}
    assert len(again) <= 3, (files, again)
