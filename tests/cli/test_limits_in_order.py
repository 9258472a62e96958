"""Limits in the path's order of axes: options, files of limits, sweeps and `check` mean the same."""

from __future__ import annotations

import json
import math

import pytest

MIXED = {
    "degree": 2,
    "knots": [0, 0, 0, 1, 1, 1],
    "control_points": [[0, 0, 0], [50, 80, 90], [100, 0, 45]],
    "axes": ["x", "y", "a"],
    "units": "mm",
}
SIX = {
    "degree": 2,
    "knots": [0, 0, 0, 1, 1, 1],
    "control_points": [[0] * 6, [50, 80, 90, 10, 20, 30], [100, 0, 45, 90, 90, 90]],
    "units": "mm",
}
RUN = ("--no-figures", "--json")
ACCELERATION, JERK = "500,400,90deg/s^2", "20000,15000,900"
NOTE = "a moves without axis_jerk, which other axes have; give each axis its own"


@pytest.fixture
def mixed(folder):
    (folder / "mixed.json").write_text(json.dumps(MIXED))
    return folder


def test_options_files_and_sweeps_take_lists_in_the_order_of_axes(splinefeed, mixed):
    words = ("--feed", "60", "--axis-accel", ACCELERATION, "--axis-jerk", JERK)
    by_options = json.loads(splinefeed("run", "mixed.json", *words, *RUN).stdout)
    found = {name: each["limit"] for name, each in by_options["limits"].items()}
    assert found == pytest.approx({
        "feed": 60, "axis_acceleration.x": 500, "axis_acceleration.y": 400, "axis_acceleration.a": 90,
        "axis_jerk.x": 20000, "axis_jerk.y": 15000, "axis_jerk.a": 900,
    })  # fmt: skip
    (mixed / "limits.toml").write_text(
        'feed = 60\naxis_acceleration = [500, "400mm/s^2", 90]\naxis_jerk = [20000, 15000, "900 deg/s^3"]\n'
    )
    by_file = json.loads(splinefeed("run", "mixed.json", "--limits", "limits.toml", *RUN).stdout)
    assert by_file["limits"] == by_options["limits"]
    (mixed / "sweep.toml").write_text(
        'sources = ["mixed.json"]\n[set]\n"limits.axis_acceleration" = [500, 400, 90]\n"limits.feed" = 60\n'
        '[grid]\n"limits.axis_jerk.x" = [20000]\n"limits.axis_jerk.y" = [15000]\n"limits.axis_jerk.a" = [900]\n'
    )
    swept = json.loads(splinefeed("sweep", "sweep.toml", "--workers", "0", "--json").stdout)
    assert swept["numbers"]["duration_s"]["least"] == by_options["duration_s"]
    checked = splinefeed("check", "splinefeed-mixed/setpoints.h5", "--axis-jerk", "20000,15000,10", "--json")
    assert checked.exit_code == 1
    assert json.loads(checked.stdout)["limits"]["axis_jerk.a"]["limit"] == pytest.approx(10)


def test_a_number_reaches_all_of_six_joints(splinefeed, folder):
    (folder / "six.json").write_text(json.dumps(SIX))
    words = ("--axis-velocity", "20", "--axis-accel", "500", "--axis-jerk", "20000")
    page = json.loads(splinefeed("run", "six.json", *words, *RUN).stdout)
    velocities = {name: each for name, each in page["limits"].items() if name.startswith("axis_velocity.")}
    assert list(velocities) == [f"axis_velocity.q{k}" for k in range(1, 7)]
    assert max(each["share"] for each in velocities.values()) == pytest.approx(1.0, abs=1e-3)


def test_the_axis_that_a_number_does_not_reach_is_named(splinefeed, mixed):
    words = ("--feed", "60", "--axis-accel", "500", "--axis-jerk", "20000")
    for command, more in (("run", RUN), ("plan", ("--json",))):
        assert NOTE in json.loads(splinefeed(command, "mixed.json", *words, *more).stdout)["notes"]
    streamed = splinefeed("stream", "mixed.json", *words, "--to", "stdout", "--period", "20ms")
    assert f"note: {NOTE}" in streamed.stderr
    alone = ("--feed", "60", "--accel", "500", "--jerk", "20000", "--json")
    kinds = "axis_velocity, axis_acceleration, axis_jerk"
    turns = f"a turns without {kinds}: where linear axes move, limits along the path are theirs"
    assert turns in json.loads(splinefeed("plan", "mixed.json", *alone).stdout)["notes"]


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--axis-accel", "500,400"), "axis_acceleration has 2 values for 3 axes; give one each, in the order x, y, a"),
        (("--axis-accel", "500,400,fast"), "--axis-accel: 'fast' cannot be read; expected an acceleration"),
        (("--axis-accel", "500,400,0"), "--axis-accel: '0' must be greater than 0"),
        (("--axis-accel", "500,90deg/s^2,500"), "axis_acceleration.y: '90deg/s^2' is an angular acceleration"),
        (("--limits", "limits.toml"), "axis_jerk has 4 values for 3 axes; give one each, in the order x, y, a"),
        (("--limits", "empty.toml"), "axis_jerk: is empty; give one value an axis, in the path's order"),
    ],
)
def test_a_list_that_does_not_fit_is_refused(splinefeed, mixed, words, why):
    (mixed / "limits.toml").write_text("feed = 60\naxis_jerk = [1, 2, 3, 4]\n")
    (mixed / "empty.toml").write_text("feed = 60\naxis_jerk = []\n")
    result = splinefeed("run", "mixed.json", *words)
    assert result.exit_code == 2
    assert why in result.stderr


def test_a_number_is_refused_where_every_axis_turns_with_a_machine_or_without(splinefeed, folder):
    turns = {**MIXED, "control_points": [[0], [50], [100]], "axes": ["theta"]}
    (folder / "turns.json").write_text(json.dumps(turns))
    why = "axis_velocity is one number, which is for linear axes, and theta turns; give one value each"
    limits = ("--accel", "500", "--jerk", "20000", "--axis-velocity", "60")
    for more in ((), ("--machine", "xytheta")):
        result = splinefeed("plan", "turns.json", *limits, *more)
        assert result.exit_code == 2
        assert why in result.stderr


def test_without_a_path_a_list_is_refused(splinefeed, folder):
    (folder / "limits.toml").write_text("axis_velocity = [50, 50, 50]\n")
    (folder / "part.nc").write_text("G21 G90 G1 X8 Y2 F1200\nM2\n")
    result = splinefeed("time", "part.nc", "--limits", "limits.toml")
    assert result.exit_code == 2
    assert "axis_velocity: is a list in the order of a path's axes, and there is no path here; name the axes" in (
        result.stderr
    )


def test_rotary_values_of_a_list_are_in_degrees():
    from splinefeed.machine import limits_toml

    text = 'axis_velocity = [60, 90]\naxis_jerk = ["1m/s^3", "2rad/s^3"]\n'
    limits = limits_toml.parse(text, axes=("x", "a"))
    assert limits.axis_velocity == {"x": 60.0, "a": math.pi / 2}
    assert limits.axis_jerk == {"x": 1000.0, "a": 2.0}
