"""`splinefeed run MOTION.json --robot ROBOT.urdf`: from a shell, in units of joints, refused in one line."""

from __future__ import annotations

import json
import re
import shutil

import numpy as np
import pytest
from click.testing import CliRunner

import splinefeed as sf
from docs_pages import ROOT
from six_joints import LIMITS, START, urdf
from splinefeed.cli.main import command_line

FILE = str(ROOT / "tests/data/two-link.urdf")
WAYPOINTS = [[0, 0.5], [0.8, -0.4], [1.5, 0.9], [0, 0.5]]


def ran(*words):
    return CliRunner().invoke(command_line, ["run", *words])


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "six.urdf").write_text(urdf())
    return tmp_path


def test_waypoints_from_a_shell_and_no_joint_is_in_mm(folder):
    (folder / "arm.json").write_text(json.dumps({"waypoints": WAYPOINTS, "payload": 2.0}))
    found = ran("arm.json", "--robot", FILE, "--format", "csv", "--format", "hdf5")
    assert found.exit_code == 0, found.output
    assert not re.search(r"\bmm\b", found.stdout), found.stdout
    assert "rad/s^2" in found.stdout
    assert "N m" in found.stdout
    head = (folder / "splinefeed-arm/setpoints.csv").read_text().splitlines()[:3]
    assert head[2] == "t_s,curve,u,s_rad,feed_rad_s,shoulder_rad,elbow_rad"
    for name in ("setpoints.csv", "setpoints.h5"):
        again = sf.load(f"splinefeed-arm/{name}")
        assert again.axes == ("shoulder", "elbow")
    assert [axis.unit for axis in sf.load("splinefeed-arm/setpoints.csv").axes] == ["rad", "rad"]
    for name in ("motion.svg", "binding.svg", "report.html"):
        text = re.sub(r"<(script|style).*?</\1>", "", (folder / "splinefeed-arm" / name).read_text(), flags=re.DOTALL)
        assert name == "binding.svg" or "rad" in text
        text = re.sub(r">[xyz] \(mm\)[^<]*<", "", text)  # of the tip
        assert not re.findall(r">[^<]*\bmm\b[^<]*<", text), name


def test_a_curve_of_the_tip_from_a_shell(folder):
    place = sf.robot(urdf(), limits=LIMITS).forward(START)[0]
    net = place + np.array([[0, 0, 0], [0, 60, 0], [80, 60, 30], [80, -60, 0], [0, 0, 0]])
    curve = {"degree": 4, "knots": [0] * 5 + [1] * 5, "control_points": net.tolist()}
    along = {"curve": curve, "start": START, "feed": 200}
    (folder / "seam.json").write_text(json.dumps({"limits": LIMITS, "along": along}))
    found = ran("seam.json", "--robot", "six.urdf", "--json")
    assert found.exit_code == 0, found.output
    page = json.loads(found.stdout)
    assert page["ok"]
    assert page["unit"] == "mm"
    assert page["feed_max_mm_s"] <= 200 * (1 + 1e-9)
    assert page["limits"]["axis_jerk.elbow"]["unit"] == "rad/s^3"
    for kind, end in (("csv", "csv"), ("hdf5", "h5")):  # lengths of the tip are mm in files, too
        found = ran("seam.json", "--robot", "six.urdf", "--format", kind, "-o", kind)
        assert found.exit_code == 0, found.output
        checked = CliRunner().invoke(command_line, ["check", f"{kind}/setpoints.{end}", "--json"])
        assert json.loads(checked.stdout)["unit"] == "mm"
    assert "\nt_s,curve,u,s_mm,feed_mm_s,waist_rad," in (folder / "csv/setpoints.csv").read_text()


@pytest.mark.parametrize(
    ("said", "words", "message"),
    [
        ({"waypoints": WAYPOINTS, "speed": 1}, (), 'arm.json: key "speed" is not known; known are along, base, '),
        ({"limits": {}}, (), "arm.json: has no motion; give either waypoints or along"),
        ({"waypoints": [[0, 0]]}, (), "arm.json: waypoints have shape (1, 2)"),
        ({"along": {"start": [0, 0]}}, (), "arm.json: along: curve is missing; needed are curve, start"),
        ({"waypoints": WAYPOINTS, "payload": -1}, (), "arm.json: payload: mass is -1 kg; it must not be negative"),
        ({"waypoints": WAYPOINTS, "tip": "nowhere"}, (), "two-link.urdf: there is no link 'nowhere'"),
        ({"waypoints": WAYPOINTS}, ("--jerk", "5"), "--jerk: an arm has its limits and motion from its own files"),
        ({"waypoints": WAYPOINTS}, ("--feed", "5"), "arm.json: waypoints: a path of joints has no feed in mm/s"),
        ([1], (), "arm.json: is not an object with tip, base, limits, "),
        ({"waypoints": WAYPOINTS, "tip": ["link"]}, (), "arm.json: tip: a list is not text"),
        ({"along": {"curve": {}, "start": [0, 0]}}, (), "arm.json: along: curve: degree is missing"),
        ({"along": {"curve": "a", "start": [0], "feed": "x"}}, (), 'arm.json: along: feed: "x" is not a number'),
    ],
)
def test_what_is_no_motion_is_refused_in_one_line(folder, said, words, message):
    (folder / "arm.json").write_text(json.dumps(said))
    found = ran("arm.json", "--robot", FILE, *words)
    assert found.exit_code == 2
    assert message in found.stderr
    assert len(found.stderr.strip().splitlines()) <= 2


def test_the_run_of_an_arm_is_reported_and_checked_again_from_its_own_files(folder):
    shutil.copy(FILE, "arm.urdf")
    (folder / "arm.json").write_text(json.dumps({"waypoints": WAYPOINTS}))
    assert ran("arm.json", "--robot", "arm.urdf", "-o", "out").exit_code == 0
    first = json.loads((folder / "out/run.json").read_text())
    found = CliRunner().invoke(command_line, ["report", "out", "--json"])
    assert found.exit_code == 0, found.stderr
    again = json.loads(found.stdout)
    assert again["limits"]["torque.elbow"] == first["limits"]["torque.elbow"]
    assert "torque (N m)" in (folder / "out/report.html").read_text()
    found = CliRunner().invoke(command_line, ["check", "out/setpoints.h5"])
    assert found.exit_code == 0, found.stderr
    assert "torque.shoulder" in found.stdout
    assert not re.search(r"\bmm\b", found.stdout), found.stdout
    found = CliRunner().invoke(command_line, ["check", "out/setpoints.h5", "--axis-velocity", "1"])
    assert found.exit_code == 2
    assert "is a motion of an arm, whose limits are in its own files; give no others" in found.stderr
    text = (folder / "arm.urdf").read_text()
    (folder / "arm.urdf").write_text(text + "\n")
    found = CliRunner().invoke(command_line, ["report", "out"])
    assert found.exit_code == 2
    assert "was made from arm.urdf, which has changed since or is gone; run it again" in found.stderr


def test_joints_keep_their_units_in_hdf5(folder):
    (folder / "arm.json").write_text(json.dumps({"waypoints": WAYPOINTS, "duration": 3.0}))
    found = ran("arm.json", "--robot", FILE, "-o", "out", "--json")
    assert found.exit_code == 0, found.output
    assert json.loads(found.stdout)["duration_s"] == 3.0
    points = sf.load("out/setpoints.h5")
    assert [axis.unit for axis in points.axes] == ["rad", "rad"]


def test_waypoints_are_drawn_as_the_arm_in_space():
    arm = sf.robot(FILE)
    run = sf.run(arm.through(WAYPOINTS), arm.limits, period=1e-3)
    tip, _ = arm.forward(run.kept.position)
    np.testing.assert_allclose(run.place, tip, atol=1e-9)
    _, poses = run.poses(7)
    assert len(poses) == 7
    np.testing.assert_allclose(poses[:, 0], 0.0)  # the base
    np.testing.assert_allclose(poses[0, -1], tip[0], atol=1e-9)
    assert [sf.plot.path(run).panels[0].x.label, sf.plot.path(run).panels[0].z] == ["x (mm)", "z (mm)"]
    torque = sf.plot.motion(run).panels[-1]
    assert torque.y.label == "torque (N m)"
    assert len(torque.marks) >= 4
