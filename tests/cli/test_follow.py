"""`splinefeed follow`: files of ours and of other programs, exit codes, JSON, files, and bad input."""

from __future__ import annotations

import json

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.machine.machine import Machine

LIMITS = ["--feed", "60", "--accel", "500", "--jerk", "20000", "--no-figures"]


@pytest.fixture
def setpoints(splinefeed, folder):
    assert splinefeed("run", "smooth.json", *LIMITS, "-o", "made").exit_code == 0
    return folder / "made/setpoints.h5"


def machine_with(folder, old: str, new: str) -> str:
    from importlib.resources import files

    text = files("splinefeed").joinpath("machines/xytheta.toml").read_text()
    assert old in text
    (folder / "mine.toml").write_text(text.replace(old, new))
    return "mine.toml"


def test_json_is_the_api(splinefeed, folder, setpoints):
    result = splinefeed("follow", setpoints, "--machine", "xytheta", "--json", "--no-figures")
    assert result.exit_code == 0, result.output
    page = json.loads(result.stdout)
    points = sf.load(setpoints)
    response = sf.runs.follow(points, Machine.load("xytheta"), path=sf.read("smooth.json"))
    assert page["contour_error_max_mm"] == np.max(response.contour_error)
    assert page["tracking_error_max"] == {
        axis: np.max(np.abs(response.tracking_error[:, i])) for i, axis in enumerate(response.axes)
    }
    assert page["ok"] is True
    assert page["stopped"] is None
    assert page["files"] == ["splinefeed-smooth-on-xytheta/response.h5", "splinefeed-smooth-on-xytheta/follow.json"]
    np.testing.assert_array_equal(sf.load(page["files"][0]).position, response.position)


def test_what_people_read_and_what_is_left(splinefeed, folder, setpoints):
    result = splinefeed("follow", setpoints, "--machine", "xytheta", "-o", "made")
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert lines[0].startswith("smooth on xytheta: ")
    heads = [line.split()[0] for line in lines if line]
    assert heads[:5] == ["smooth", "note", "error", "x", "y"]
    assert "contour" in heads
    # the files of the run in the same folder stay
    assert {each.name for each in (folder / "made").iterdir()} >= {
        "contour.svg", "errors.svg",
        "follow.json", "response.h5", "run.json", "setpoints.h5",
    }  # fmt: skip
    again = splinefeed("follow", setpoints, "--machine", "lintable", "-o", "made", "--no-figures", "--linear")
    assert again.exit_code == 0
    assert "(linear model)" in again.stdout
    assert not (folder / "made/errors.svg").exists()
    assert (folder / "made/setpoints.h5").exists()


def test_setpoints_of_another_program(splinefeed, folder, setpoints):
    points = sf.load(setpoints)
    table = np.column_stack([points.t, points.position])
    np.savetxt(folder / "other.csv", table, fmt="%.17g", delimiter=",", header="t,x,y", comments="")
    words = ["follow", "other.csv", "--machine", "xytheta", "--no-figures", "--json"]
    page = json.loads(splinefeed(*words, "--path", "smooth.json").stdout)
    ours = json.loads(splinefeed("follow", setpoints, "--machine", "xytheta", "--no-figures", "--json").stdout)
    assert page["contour_error_max_mm"] == pytest.approx(ours["contour_error_max_mm"], rel=1e-9)
    assert page["tracking_error_max"] == ours["tracking_error_max"]
    blind = json.loads(splinefeed(*words).stdout)
    assert blind["contour_error_max_mm"] is None
    assert any("the path is not known" in note for note in blind["notes"])


def test_a_run_away_is_said_and_what_there_is_is_written(splinefeed, folder, setpoints):
    machine = machine_with(folder, 'kd = "0.1862V*s/mm"', 'kd = "200V*s/mm"')
    result = splinefeed("follow", setpoints, "--machine", machine)
    assert result.exit_code == 1, result.output
    assert "STOPPED: axis x ran away at 0." in result.stdout
    assert "its loop may be unstable" in result.stdout
    response = sf.load("splinefeed-smooth-on-mine/response.h5")
    assert 0 < len(response) < len(sf.load(setpoints))
    assert response.stopped is not None
    assert (folder / "splinefeed-smooth-on-mine/errors.svg").is_file()


def test_bad_input(refused, folder, setpoints):
    def follow(*words):
        return refused("follow", *words)

    assert follow(setpoints, "--machine", "xyteta") == (
        f"xyteta: no machine of this name; there are {', '.join(Machine.names())}; did you mean 'xytheta'?"
    )
    assert follow("nothing.h5", "--machine", "xytheta").startswith("nothing.h5: no such file")
    assert follow(setpoints) == "Missing option '--machine'; see splinefeed follow --help"
    assert follow("smooth.json", "--machine", "xytheta").startswith("smooth.json: a record's file is named")
    points = sf.load(setpoints)
    rows = np.column_stack([points.t, points.position, points.position[:, 0]])
    header = {"fmt": "%.9f", "delimiter": ",", "comments": ""}
    np.savetxt(folder / "z.csv", rows, header="t,x,y,z", **header)
    assert follow("z.csv", "--machine", "xytheta").startswith("z.csv: the setpoints move axis z by ")
    rows[70, 2] = np.nan
    np.savetxt(folder / "nan.csv", rows[:, :3], header="t,x,y", **header)
    line = follow("nan.csv", "--machine", "xytheta")
    assert line == "nan.csv: at t = 0.07 s axis y is nan; expected a finite number"
    machine = machine_with(folder, "[axis.x.encoder]", "[axis.x.encodr]")
    line = follow(setpoints, "--machine", machine)
    assert "axis.x.encodr: unknown key; did you mean 'encoder'?" in line
