"""Pictures of an arm: its poses in space, as the figure draws them and the report moves them."""

from __future__ import annotations

import base64
import re

import numpy as np
import pytest

import splinefeed as sf
from docs_pages import ROOT
from six_joints import LIMITS, START, urdf
from splinefeed.reports import interactive, theme
from splinefeed.reports.figure import Coloured
from splinefeed.runs import run as runs

FILE = ROOT / "tests/data/two-link.urdf"


def carried_out(along):
    if not along:
        arm = sf.robot(FILE, torque=False)
        return sf.run(arm.through([[0, 0.5], [0.8, -0.4], [1.5, 0.9]]), arm.limits, period=1e-3)
    arm = sf.robot(urdf(), limits=LIMITS, torque=False)
    place, _ = arm.forward(START)
    curve = sf.NurbsCurve.bezier(place + np.array([[0, 0, 0], [0, 60, 0], [80, 60, 30]]))
    return sf.run(arm.along(curve, start=START), arm.limits, period=1e-3)


@pytest.mark.parametrize("along", [False, True], ids=["waypoints", "tip"])
def test_the_page_has_the_arm_at_times_and_its_tip_is_on_the_path(along):
    run = carried_out(along)
    t, poses = run.poses(60)
    assert (t[0], t[-1]) == (0.0, run.kept.t[-1])
    np.testing.assert_allclose(poses[:, -1], run.place[np.searchsorted(run.kept.t, t)], atol=1e-9)
    plain = interactive.to_plain(sf.plot.path(run))["arm"]
    assert plain["points"] == len(run.axes) + 2
    read = {name: np.frombuffer(base64.b64decode(plain[name]["bdata"]), "<f4") for name in "txyz"}
    assert len(read["x"]) == len(read["t"]) * plain["points"]
    tips = np.stack([read[name].reshape(-1, plain["points"])[:, -1] for name in "xyz"], axis=1)
    np.testing.assert_allclose(tips[[0, -1]], run.place[[0, -1]], atol=1e-3)


@pytest.mark.parametrize("along", [False, True], ids=["waypoints", "tip"])
def test_where_ticks_are_left_out_the_tip_is_a_line_through_all_of_its_way(along, monkeypatch):
    whole = carried_out(along)
    monkeypatch.setattr(runs, "LONG", 300)
    monkeypatch.setattr(runs, "MOST_KEPT", 200)
    long = carried_out(along)
    assert whole.whole and not long.whole
    (mark,) = sf.plot.path(long).panels[0].of(Coloured)
    assert mark.joined
    np.testing.assert_allclose(mark.track[1][[0, -1]], whole.place[[0, -1]], atol=1e-9)
    reached = [np.interp(whole.kept.t, mark.track[0], column) for column in mark.track[1].T]
    np.testing.assert_allclose(np.transpose(reached), whole.place, atol=1e-3 * np.ptp(whole.place))


@pytest.mark.parametrize("along", [False, True], ids=["waypoints", "tip"])
def test_the_figure_draws_first_and_last_pose_stronger_with_a_dot_at_each_joint(along):
    run = carried_out(along)
    text = sf.plot.path(run)._repr_svg_()
    joints = len(run.axes) + 1  # and the base
    assert len(re.findall("<circle", text)) == 2 * joints + 2  # and both ends of the path
    widths = re.findall(r'stroke-width="(\d\.\d)"', text)
    assert widths.count("1.8") == 2


def test_a_run_of_an_arm_says_its_joints_and_a_figure_is_a_line():
    run = carried_out(True)
    assert all(f" {joint}" in repr(run) for joint in run.axes)
    assert repr(sf.plot.joints(run)).startswith("Figure('path: axes over time, time-optimal', 4 panels;")
    assert len(repr(sf.plot.joints(run))) < 200


def test_no_two_of_fourteen_joints_have_one_colour_and_one_dash():
    """Colours that colour-blind readers may take for each other run in other dashes."""
    styles = [(theme.colour(k), theme.dash(k)) for k in range(16)]
    assert len(set(styles)) == 16
    like = ({theme.COLOURS[0], theme.COLOURS[6]}, {theme.COLOURS[1], theme.COLOURS[4]})
    for pair in like:
        dashes = [{dash for colour, dash in styles[:7] if colour == each} for each in pair]
        assert not dashes[0] & dashes[1]
    run = carried_out(True)
    lines = re.findall(r'<path [^>]*stroke-width="1\.4"[^>]*/>', sf.plot.joints(run)._repr_svg_())
    assert ['stroke-dasharray="5 3"' in each for each in lines[:6]] == [False, False, False, False, True, True]


def test_a_limit_that_all_joints_share_is_in_the_colour_of_none():
    arm = sf.robot(FILE, torque=False, limits={"velocity": [2, 3], "acceleration": 15, "jerk": 500})
    run = sf.run(arm.through([[0, 0.5], [0.8, -0.4], [1.5, 0.9]]), arm.limits, period=1e-3)
    _, velocity, acceleration, jerk = sf.plot.joints(run).panels
    assert {level.colour for level in (*acceleration.levels(), *jerk.levels())} == {theme.FAINT}
    assert {level.colour for level in velocity.levels()} <= {theme.colour(0), theme.colour(1)}
