"""A five-axis part from the command line: file to setpoints, report and check on a machine with kinematics."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

from splinefeed.machine import Machine

FLANK = str(Path(__file__).parents[1] / "data" / "five-axis" / "flank_milling_2022.json")
RUN = ("run", FLANK, "--machine", "trunnion", "--feed", "100", "--period", "2ms")
GIVEN = (
    *("--axis-velocity", "x=100,y=100,z=100,a=0.4rad/s,c=0.8rad/s"),
    *("--axis-acceleration", "x=500,y=500,z=500,a=0.5rad/s^2,c=0.5rad/s^2"),
    *("--axis-jerk", "x=3000,y=3000,z=3000,a=1.5rad/s^3,c=1.5rad/s^3", "--chord-error", "0.125um"),
)


def test_the_paper_s_part_runs_from_a_shell(splinefeed: Callable[..., Result], folder: Path) -> None:
    done = splinefeed(*RUN, *GIVEN, "-o", "flank", "--json", "--tip", "--orientation-error", "0.001deg")
    page = json.loads(done.stdout)
    assert done.exit_code == 0
    assert page["ok"]
    assert page["duration_s"] <= 1.005 * 8.0310
    assert list(page["axes"]) == ["x", "y", "z", "a", "c"]
    assert page["limits"]["axis_jerk.c"]["share"] == pytest.approx(1.0, abs=1e-3)
    assert page["limits"]["orientation_error"]["limit"] == pytest.approx(0.001)
    assert "--orientation-error 1.745" in page["command"]
    assert "rad --axis" in page["command"]
    rows = np.loadtxt(folder / "flank" / "tip.csv", delimiter=",", skiprows=1)
    assert rows.shape == (page["ticks"], 8)
    assert np.allclose(rows[[0, -1], 2:5], [[5.0, 0.0, 0.0], [55.0, 0.0, 0.0]], atol=1e-12)
    assert np.allclose(np.linalg.norm(rows[:, 5:], axis=1), 1.0, atol=1e-12)
    assert (folder / "flank" / "report.html").is_file()
    assert "--machine trunnion" in page["command"]
    checked = splinefeed("check", "flank/setpoints.h5", "--json")
    assert checked.exit_code == 0
    assert json.loads(checked.stdout)["off_curve_max_mm"] < 1e-12
    again = splinefeed("report", "flank", "-o", "again.html", "--json")
    assert again.exit_code == 0
    assert json.loads(again.stdout)["duration_s"] == page["duration_s"]


def test_what_a_tool_path_needs_is_said_in_one_line(splinefeed: Callable[..., Result]) -> None:
    for words, said in (
        (("run", FLANK), "has a tool axis, which only a machine can follow; give a machine"),
        (("run", FLANK, "--machine", "router"), "router: has no [kinematics], which a tool path needs"),
        ((*RUN, "--axis-jerk", "b=3"), "axis_jerk.b: the path has no axis 'b'"),
        ((*RUN, "--travel", "a=0deg:10deg"), "travel.a: the path takes joint a from"),
        ((*RUN, "--method", "taylor-2"), "joints of a tool path need 'arc-length'"),
    ):
        done = splinefeed(*words)
        assert done.exit_code == 2, words
        assert said in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1


def test_a_machine_file_with_other_kinematics_is_taken(splinefeed: Callable[..., Result], folder: Path) -> None:
    text = Machine.load("trunnion").to_text()
    shifted = text.replace('type = "xyzac-trt"', 'type = "xyzac-trt"\ny-offset = "5mm"\nz-rot-point = "-20mm"')
    (folder / "mine.toml").write_text(shifted)
    done = splinefeed("run", FLANK, "--machine", "mine.toml", "--strategy", "look-ahead", "--no-figures", "--json")
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout)["ok"]
