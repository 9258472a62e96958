"""`splinefeed check`: files of ours and of other programs, exit codes, JSON, certificate."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math

import numpy as np
import pytest
from click.testing import CliRunner

import motions
import splinefeed as sf
from splinefeed.cli.main import command_line
from splinefeed.formats import positions_csv

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000)


def invoke(*arguments: object):
    return CliRunner().invoke(command_line, ["check", *map(str, arguments)])


def page_of(result) -> dict:
    return json.loads(result.stdout)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A path, its setpoints in every form, its law, and limits."""
    folder = tmp_path_factory.mktemp("check")
    path = motions.smooth()
    law = sf.plan(path, LIMITS, period=1e-3)
    points = sf.interpolate(path, law)
    sf.write(path, folder / "path.json")
    sf.save(law, folder / "law.h5")
    for name in ("points.h5", "points.csv"):
        sf.save(points, folder / name)
    table = np.column_stack([points.t, points.position])
    np.savetxt(folder / "other.csv", table, fmt="%.17g", delimiter=",", header="t,x,y", comments="")
    source = {"text": "shape", "sha256": None}
    documented = dataclasses.replace(points, settings={**points.settings, "source": source})
    sf.save(documented, folder / "documented.h5")
    (folder / "limits.toml").write_text('feed = "3600mm/min"\nacceleration = 500\njerk = "20m/s^3"\n')
    return folder


@pytest.mark.parametrize("name", ["points.h5", "points.csv"])
def test_setpoints_of_ours_know_their_limits(folder, name):
    result = invoke(folder / name, "--path", folder / "path.json", "--law", folder / "law.h5", "--json")
    assert result.exit_code == 0, result.output
    page = page_of(result)
    assert page["ok"] is True
    assert page["problems"] == []
    assert set(page["limits"]) == {"feed", "acceleration", "deceleration", "jerk"}
    for key in ("duration_s", "length_mm", "ticks", "period_s", "method", "strategy", "ripple_max", "end_error_mm"):
        assert key in page
    assert {"limit", "worst", "share", "at_s", "floor", "axis", "by", "ok"} <= set(page["limits"]["feed"])


def test_a_limit_that_does_not_hold_is_exit_1_and_said_to_people(folder):
    result = invoke(folder / "points.h5", "--path", folder / "path.json", "--jerk", "19m/s^3", "--axis-jerk", "x=1e9")
    assert result.exit_code == 1
    assert "jerk" in result.stdout
    assert "OVER" in result.stdout
    assert "problem   jerk: 1" in result.stdout
    assert "NOT KEPT: 1 problem" in result.stdout


def test_setpoints_of_another_program(folder):
    common = ("--path", folder / "path.json", "--limits", folder / "limits.toml", "--json")
    good = invoke(folder / "other.csv", *common)
    assert good.exit_code == 0, good.output
    assert any("nearest point" in note for note in page_of(good)["notes"])
    lines = (folder / "other.csv").read_text().splitlines()
    words = lines[701].split(",")
    words[2] = repr(float(words[2]) + 1e-6)
    lines[701] = ",".join(words)
    (folder / "bad.csv").write_text("\n".join(lines))
    bad = invoke(folder / "bad.csv", *common)
    assert bad.exit_code == 1
    assert page_of(bad)["problems"][0].startswith("tick 700 (t = 0.7 s")
    lines[701] = words[0] + ",nan," + words[2]
    (folder / "nan.csv").write_text("\n".join(lines))
    assert page_of(invoke(folder / "nan.csv", *common))["problems"][0].endswith("x is nan")


def test_a_certificate_is_written(folder, tmp_path):
    file = tmp_path / "certificate.json"
    result = invoke(folder / "points.h5", "--path", folder / "path.json", "--certificate", file, "--json")
    assert result.exit_code == 0
    assert page_of(result)["files"] == [str(file)]
    page = json.loads(file.read_text())
    assert page["verdict"]["ok"] is True
    assert set(page["sha256"]) == {"setpoints", "path", "limits"}


def test_options_of_axes_and_travel(folder):
    path = ("--path", folder / "path.json", "--json")
    page = page_of(invoke(folder / "points.h5", *path, "--axis-jerk", "3e4", "--travel", "x=0:80,y=0:1mm"))
    assert set(page["limits"]) >= {"axis_jerk.x", "axis_jerk.y", "travel.x", "travel.y"}
    assert page["limits"]["travel.x"]["ok"] is True
    assert page["limits"]["travel.y"]["ok"] is False
    page = page_of(invoke(folder / "points.h5", *path, "--axis-velocity", "x=1m/s,y=100mm/min"))
    assert page["limits"]["axis_velocity.x"]["limit"] == 1000
    assert page["limits"]["axis_velocity.y"]["limit"] == pytest.approx(100 / 60)
    assert page["limits"]["axis_velocity.y"]["ok"] is False


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["points.h5"], "does not name its path; give --path"),
        (["no.h5", "--path", "path.json"], "no such file"),
        (["law.h5", "--path", "path.json"], "holds TimeLaw; expected Setpoints"),
        (["points.h5", "--path", "path.json", "--law", "points.h5"], "holds Setpoints; expected TimeLaw"),
        (["other.csv", "--path", "path.json"], "has no limits"),
        (["points.h5", "--path", "path.json", "--columns", "t,x,y"], "--columns: is for CSV files of other programs"),
        (["points.h5", "--path", "path.json", "--axis-jerk", "x=fast"], "--axis-jerk: 'fast' cannot be read"),
        (["points.h5", "--path", "path.json", "--travel", "x=3"], "--travel: "),
        (["points.h5", "--path", "path.json", "--axis-jerk", "q=3"], "has no axis 'q'"),
    ],
)
def test_bad_input_is_exit_2_and_one_line(folder, monkeypatch, arguments, message):
    monkeypatch.chdir(folder)
    result = invoke(*arguments)
    assert result.exit_code == 2
    last = result.stderr.strip().splitlines()[-1]
    assert last.startswith("splinefeed: ")
    assert message in last
    assert result.stdout == ""


def test_a_path_that_a_run_read_and_that_has_changed(folder, tmp_path):
    points = sf.load(folder / "points.h5")
    source = {"text": str(folder / "path.json"), "sha256": "0" * 64}
    settings = {**points.settings, "source": source, "command": "splinefeed run path.json --path 1"}
    sf.save(dataclasses.replace(points, settings=settings), tmp_path / "points.h5")
    result = invoke(tmp_path / "points.h5")
    assert result.exit_code == 2
    assert "has changed since or is gone; give --path" in result.stderr
    source["sha256"] = hashlib.sha256((folder / "path.json").read_bytes()).hexdigest()
    sf.save(dataclasses.replace(points, settings=settings), tmp_path / "points.h5")
    assert invoke(tmp_path / "points.h5").exit_code == 0


# --- the reader of other programs' files ----------------------------------------------------------------------------


def read(tmp_path, text, **options):
    file = tmp_path / "recorded.csv"
    file.write_text(text)
    assert positions_csv.is_foreign(file)
    return positions_csv.read(file, **options)


@pytest.mark.parametrize(
    "text",
    [
        "t,x,theta\n0,0,0\n0.001,25.4,90\n0.002,50.8,180\n",
        "# a recording\ntime;theta;other;X\nms;deg;-;in\n0;0;7;0\n1;90;7;1\n2;180;7;2\n",
        "t_ms\tx [in]\ttheta(rad)\n0\t0\t0\n1\t1\t1.5707963267948966\n2\t2\t3.141592653589793\n",
        "Time_s x_mm theta_deg\n0 0 0\n1e-3 25.4 90\n2.0e-3 50.8 180\n",
    ],
    ids=["commas", "units below", "units behind", "blanks"],
)
def test_names_and_units_of_columns(tmp_path, text):
    points, _ = read(tmp_path, text)
    assert points.axes == ("x", "theta")
    assert points.period == pytest.approx(1e-3, rel=1e-12)
    assert points.t == pytest.approx([0, 1e-3, 2e-3], rel=1e-12)
    assert points.position[:, 0] == pytest.approx([0, 25.4, 50.8], rel=1e-14)
    assert points.position[:, 1] == pytest.approx([0, math.pi / 2, math.pi], rel=1e-14)
    assert np.isnan(points.u).all()


def test_columns_that_the_file_does_not_name(tmp_path):
    points, _ = read(tmp_path, "0 1 2\n1 2 3\n", columns=("t_ms", "y", "x"))
    assert points.axes == ("x", "y")
    assert points.position[1].tolist() == [3, 2]


def test_a_blank_line_among_the_numbers_costs_no_row(tmp_path):
    points, _ = read(tmp_path, "t,x\n0,1\n\n1,2\n2,3\n\n")
    assert points.position[:, 0].tolist() == [1, 2, 3]


def test_times_with_few_digits_are_the_even_ones_rounded(tmp_path):
    rows = "".join(f"{k / 3000:.4f},{k}\n" for k in range(3001))
    points, notes = read(tmp_path, "t,x\n" + rows)
    assert points.period == pytest.approx(1 / 3000, rel=1e-8)
    assert np.diff(points.t) == pytest.approx(np.full(3000, 1 / 3000), rel=1e-6)
    assert any("0 decimals" in note for note in notes)
    late = rows.replace("0.5000,1500", "0.5003,1500")
    assert read(tmp_path, "t,x\n" + late, period=1 / 3000)[0].t[1500] == 0.5003


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2\n3,4\n", "no line above the numbers names 2 columns"),
        ("t,q\n1,2\n3,4\n", "needs columns t and at least one of"),
        ("t,x,x_pos\n1,2,3\n3,4,5\n", "two columns are called x"),
        ("t,x_kg\n1,2\n3,4\n", "column x: "),
        ("t,x\n0,1\n", "a single setpoint gives no period"),
        ("t,x\n0,1\n0,2\n", "does not increase"),
        ("t,x\n0,1\nzero,2\n", "could not convert string 'zero' to float64 at row 1, column 1"),
        ("t,x\n0,1\n1,2,3\n", "is not a valid table"),
        ("nothing here\n", "holds no numbers"),
    ],
)
def test_refused_recordings(tmp_path, text, message):
    with pytest.raises(sf.errors.FormatError, match=r"recorded\.csv: ") as caught:
        read(tmp_path, text)
    assert message in str(caught.value)
