"""`splinefeed run` on a machine: the paper's experiment, a SOURCE under a machine's limits, and axes that run away."""

from __future__ import annotations

import json
import shlex
from importlib.resources import files as resources

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.runs.comparison import PAPER_METHODS

QUIET = ("--no-figures", "--no-compare")


def page_of(result) -> dict:
    assert result.exit_code in (0, 1), result.output
    return json.loads(result.stdout)


def test_the_experiment_puts_the_paper_s_methods_side_by_side(splinefeed, folder):
    page = page_of(splinefeed("run", "--json", *QUIET))
    found = page["experiment"]
    assert page["machine"] == "xytheta"
    assert [each["method"] for each in found["methods"]] == list(PAPER_METHODS)
    assert found["paper_error_mm"] == 0.01218
    main = found["methods"][-1]
    assert page["contour_error_max_mm"] == main["contour_error_max_mm"]
    assert page["tracking_error_max"] == main["tracking_error_max"]
    # each is what the API gives for these setpoints
    path = sf.shapes.naca("0025", perimeter=33)
    law = sf.plan(path, sf.Limits(feed=60, acceleration=50, jerk=2000), period=1e-3)
    for each in found["methods"]:
        response = sf.runs.follow(
            sf.interpolate(path, law, method=each["method"]), sf.Machine.load("xytheta"), path=path
        )
        assert each["contour_error_max_mm"] == pytest.approx(np.max(response.contour_error), rel=1e-9)
    assert found["largest_error_mm"] == max(page["tracking_error_max"].values())
    # the digest: 85 to 107 um on X; Taylor-2 and Milne-Simpson move the contour error by less than a hundredth
    assert 0.085 < found["largest_error_mm"] < 0.107
    assert found["largest_error_axis"] == "x"
    assert found["spread_share"] < 0.01
    assert found["method_matters"] is False
    assert {"splinefeed-naca0025/setpoints.h5", "splinefeed-naca0025/response.h5"} <= set(page["files"])


def test_the_experiment_says_what_is_model_and_what_is_measurement(splinefeed, folder):
    text = splinefeed("run", *QUIET).stdout
    assert "the paper measured 0.01218 mm" in text
    words = " ".join(text.split())
    assert "model: xytheta, simulated; the paper gives gains" in words
    assert "measurement: the paper's 12.18 um" in words
    assert "finding: on this machine the choice of the interpolator is negligible next to the following error" in words


def test_with_3d_theta_follows_the_tangent(splinefeed, folder):
    page = page_of(splinefeed("run", "--3d", "--json", *QUIET, "-o", "out"))
    assert list(page["tracking_error_max"]) == ["x", "y", "theta"]
    assert page["tracking"]["theta"]["unit"] == "deg"
    assert "--3d" in shlex.split(page["command"])
    points = sf.load("out/setpoints.h5")
    assert points.axes == ("x", "y", "theta")
    middle = slice(100, -100)
    steps = np.gradient(points.position[:, :2], axis=0)[middle]
    turned = points.position[middle, 2] - np.arctan2(steps[:, 1], steps[:, 0])
    assert np.max(np.abs(np.sin(turned))) < 1e-3
    assert np.all(np.cos(turned) > 0.9)
    # the path is found again from what the setpoints say
    again = page_of(splinefeed("follow", "out/setpoints.h5", "--machine", "xytheta", "--json", "--no-figures"))
    assert again["contour_error_max_mm"] == page["contour_error_max_mm"]
    assert splinefeed("check", "out/setpoints.h5").exit_code == 0
    assert sf.load("out/response.h5").axes == ("x", "y", "theta")


def test_a_source_is_planned_for_the_axes_of_its_machine(splinefeed, folder):
    page = page_of(splinefeed("run", "smooth.json", "--machine", "xytheta", "--json", *QUIET, "-o", "out"))
    assert page["strategy"] == "time-optimal"
    assert page["limits"]["axis_acceleration.x"]["limit"] == 2000.0
    assert page["limits"]["travel.x"]["ok"]
    assert "experiment" not in page
    assert page["contour_error_max_mm"] > 0.0
    text = splinefeed("run", "smooth.json", "--machine", "xytheta", *QUIET, "-o", "out").stdout
    assert "on xytheta:" in text
    own = page_of(
        splinefeed("run", "smooth.json", "--machine", "xytheta", "--axis-accel", "300", "--json", *QUIET, "-o", "out")
    )
    assert own["limits"]["axis_acceleration.x"]["limit"] == 300.0
    assert own["limits"]["axis_jerk.x"]["limit"] == 100000.0
    plan = page_of(splinefeed("plan", "smooth.json", "--machine", "xytheta", "--axis-accel", "300", "--json"))
    assert plan["duration_s"] == own["duration_s"]
    words = ["run", "smooth.json", "--machine", "xytheta", "--strategy", "seven-phase", *QUIET, "-o", "seven"]
    refused = splinefeed(*words, "--accel", "50", "--jerk", "2000")
    assert refused.exit_code == 2
    assert "axis_velocity, axis_acceleration, axis_jerk: the seven-phase strategy cannot hold them" in refused.stderr
    assert not (folder / "seven").exists()


def test_one_number_for_all_axes_leaves_theta_its_own(splinefeed, folder):
    words = ["plan", "circle?radius=10&tangential=true", "--machine", "xytheta", "--axis-accel", "300", "--json"]
    assert page_of(splinefeed(*words))["strategy"] == "time-optimal"
    from splinefeed.machine.machine import Machine
    from splinefeed.runs.settings import completed

    flat = completed({"axis_acceleration": 300.0}, Machine.load("xytheta"), ("x", "y", "theta")).as_dict()
    assert flat["axis_acceleration.x"] == 300.0
    assert flat["axis_acceleration.theta"] == pytest.approx(np.radians(100000.0))


def test_a_run_away_is_exit_code_1_and_all_files_are_there(splinefeed, folder):
    text = resources("splinefeed").joinpath("machines/xytheta.toml").read_text()
    (folder / "wild.toml").write_text(text.replace('kd = "0.1862V*s/mm"', 'kd = "200V*s/mm"'))
    result = splinefeed("run", "smooth.json", "--machine", "wild.toml", "-o", "out")
    assert result.exit_code == 1, result.output
    assert "STOPPED: axis x ran away at 0." in result.stdout
    assert "NOT KEPT: an axis ran away" in result.stdout
    assert "axis x: gains unstable" in result.stdout
    assert sf.load("out/response.h5").stopped is not None
    assert {"errors.svg", "contour.svg", "setpoints.h5", "run.json"} <= {
        each.name for each in (folder / "out").iterdir()
    }


def test_bad_input(refused, folder):
    assert refused("run", "--machine", "xyteta").endswith("did you mean 'xytheta'?")
    assert refused("plan", "smooth.json", "--machine", "no.toml").startswith("no.toml: no such file")
    line = refused("run", "smooth.json", "--machine", "xytheta", "--feed", "0")
    assert line == "feed is 0; it must be greater than 0"
    curve = json.loads((folder / "smooth.json").read_text())
    curve["control_points"] = [[*point, i] for i, point in enumerate(curve["control_points"])]
    (folder / "space.json").write_text(json.dumps(curve))
    line = refused("run", "space.json", "--machine", "xytheta", *QUIET)
    assert line.startswith("the setpoints move axis z by ")
    line = refused("run", "space.json", "--3d")
    assert line.startswith("the path has axes x y z; theta follows a path of two linear axes")


MILL = """
[axis.x.limits]
velocity = "3m/min"
acceleration = "500mm/s^2"
[axis.y.limits]
velocity = "3m/min"
acceleration = "500mm/s^2"
[axis.z.limits]
velocity = "2m/min"
acceleration = "300mm/s^2"
"""
PROGRAM = "G21 G90 G17 G94\nG0 X10 Y10 Z5\nG1 Z-1 F300\nX30 F1200\nG2 X30 Y30 R10\nG0 Z5\nM30\n"


def test_a_machine_of_limits_runs_times_and_streams(splinefeed, refused, folder):
    """Every command that needs limits alone takes the file; the others name what to add."""
    (folder / "mill.toml").write_text(MILL)
    (folder / "part.nc").write_text(PROGRAM)
    page = json.loads(
        splinefeed("run", "part.nc", "--machine", "mill.toml", "-o", "r", "--no-figures", "--json").stdout
    )
    assert page["ok"] and page["limits"]["axis_velocity.z"]["limit"] == pytest.approx(2000.0 / 60.0)
    assert "axes of mill have limits alone: what their servo loops do is not simulated" in page["notes"]
    assert "machine" not in page or page.get("tracking_error_max") is None
    planned = json.loads(splinefeed("plan", "part.nc", "--machine", "mill.toml", "--json").stdout)
    assert planned["duration_s"] == pytest.approx(page["duration_s"])
    time = json.loads(splinefeed("time", "part.nc", "--machine", "mill.toml", "--no-saves", "--json").stdout)
    assert time["total_s"] > page["duration_s"] - 0.1  # exact stops, and the first rapid move
    assert splinefeed("linuxcnc", "init", "--machine", "mill.toml").exit_code == 0
    assert "MAX_VELOCITY = 50\n" in (folder / "splinefeed.ini").read_text()
    assert splinefeed("stream", "part.nc", "--machine", "mill.toml", "--to", "file", "-o", "rows.txt").exit_code == 0
    assert (folder / "rows.txt").stat().st_size > 0
    for command in (["follow", "r/setpoints.h5"], ["tune-feed", "part.nc", "--contour-tolerance", "0.1"]):
        assert refused(*command, "--machine", "mill.toml").startswith("mill: axis x has limits alone, and this needs")
    assert refused("tune", "mill.toml").startswith("mill: axis x has limits alone, and this needs")


def test_a_file_of_limits_is_taken_where_a_machine_is(splinefeed, refused, folder):
    (folder / "limits.toml").write_text("axis_velocity = 50\naxis_acceleration = 400\nchord_error = 0.01\n")
    (folder / "part.nc").write_text(PROGRAM)
    page = json.loads(splinefeed("time", "part.nc", "--limits", "limits.toml", "--no-saves", "--json").stdout)
    assert "limits.toml: chord_error: not used here" in page["notes"]
    (folder / "mill.toml").write_text(MILL)
    both = ("time", "part.nc", "--limits", "limits.toml", "--machine", "mill.toml", "--no-saves", "--json")
    assert json.loads(splinefeed(*both).stdout)["total_s"] == pytest.approx(page["total_s"])
    made = splinefeed("linuxcnc", "init", "--limits", "limits.toml")
    assert "splinefeed stream SOURCE --limits limits.toml --to linuxcnc" in made.stdout
    assert refused("linuxcnc", "init", "--machine", "hurco-02").startswith("hurco-02: has a control but no axes")


def test_an_axis_that_a_machine_of_limits_lacks_is_refused(refused, folder):
    (folder / "flat.toml").write_text(MILL.partition("[axis.z")[0])
    (folder / "part.nc").write_text(PROGRAM)
    assert refused("run", "part.nc", "--machine", "flat.toml", "-o", "r", "--no-figures") == (
        "part: moves axis z, which flat does not have; its axes are x, y: add [axis.z.limits]"
    )
    assert refused("time", "part.nc", "--machine", "flat.toml") == (
        'flat: the velocity of axis z is not known; add the lines [axis.z.limits], velocity = "200mm/s", '
        'acceleration = "2000mm/s^2"'
    )
