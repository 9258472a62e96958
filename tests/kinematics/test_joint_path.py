"""Tool paths on machines: joints that lead back to tip and axis, exact derivatives, winding, poles and travel."""

from __future__ import annotations

import math
import pickle
from itertools import pairwise
from pathlib import Path as File

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import CurveError, InputError, LimitsError
from splinefeed.kinematics import kinematics
from splinefeed.records import Array
from tool_paths import MACHINES, flank, random_tool_path

LINE = sf.NurbsCurve(1, [0, 0, 1, 1], [[0, 0, 0], [100, 0, 0]])


def leaning(*vectors: tuple[float, float, float]) -> sf.ToolPath:
    """A straight tip and a tool axis that goes from vector to vector."""
    knots = [0.0, *np.linspace(0.0, 1.0, len(vectors)), 1.0]
    return sf.ToolPath(LINE, sf.NurbsCurve(1, knots, vectors), kind="vectors")


@pytest.mark.parametrize("machine", MACHINES, ids=lambda machine: machine.kind)
def test_joints_lead_back_to_tip_and_axis(machine: sf.kinematics.Kinematics, data_dir: File) -> None:
    for tool in (flank(data_dir), random_tool_path(3), random_tool_path(4)):
        path = sf.kinematics.JointPath(tool, machine)
        s = np.linspace(0.0, tool.length, 501)
        tip, axis = machine.forward(path(s))
        curve, u = tool.locate(s)
        wanted = tool.orientation(curve, u)[:, 0]
        assert np.max(np.abs(tip - tool(s))) <= 1e-12 * 500.0
        assert np.max(np.abs(axis - wanted / np.linalg.norm(wanted, axis=1)[:, None])) <= 1e-14
        assert np.max(np.abs(np.diff(path(s)[:, 3:], axis=0))) < 0.5  # no jump of whole turns


@pytest.mark.parametrize("machine", MACHINES, ids=lambda machine: machine.kind)
def test_derivatives_are_those_of_the_joints(machine: sf.kinematics.Kinematics, data_dir: File) -> None:
    path = sf.kinematics.JointPath(flank(data_dir), machine)
    s, errors = np.linspace(1.0, 29.0, 57), []
    exact = path.derivatives(s)
    joints = len(path.axes)
    assert np.array_equal(exact[:, 0, :joints], path(s))
    assert np.allclose(exact[:, 0, path.tip_columns], path.tool(s), rtol=0.0, atol=1e-12)
    for h in (2e-3, 1e-3):
        numeric = (path.derivatives(s + h)[:, :3] - path.derivatives(s - h)[:, :3]) / (2.0 * h)
        errors.append(np.max(np.abs(numeric - exact[:, 1:]), axis=0)[:, :joints])
    scale = np.max(np.abs(exact[:, 1:]), axis=0)[:, :joints]
    assert np.all(errors[1] <= 1e-6 * scale)
    assert np.all(errors[1][2] <= 0.3 * errors[0][2] + 1e-10 * scale[2])  # of second order, as central differences are


def test_angles_are_taken_as_they_are_programmed() -> None:
    turns = sf.NurbsCurve(1, [0, 0, 1, 1], [[0.3, -1.0], [0.3, 9.0]])
    machine = kinematics("xyzac-trt")
    path = sf.kinematics.JointPath(sf.ToolPath(LINE, turns, kind="angles"), machine)
    assert np.allclose(path(path.length)[3:], [0.3, 9.0], atol=1e-12)
    with pytest.raises(CurveError, match=r"gives 2 rotary angle\(s\), xy-theta has 1"):
        sf.kinematics.JointPath(sf.ToolPath(LINE, turns, kind="angles"), kinematics("xy-theta"))


def test_the_table_turns_about_its_own_centre() -> None:
    turn = sf.NurbsCurve(1, [0, 0, 1, 1], [[0.0], [0.5 * math.pi]])
    machine = kinematics("xy-theta", x_rot_point=50.0, y_rot_point=10.0)
    path = sf.kinematics.JointPath(sf.ToolPath(LINE, turn, kind="angles"), machine)
    # (50, -10) from the centre, turned by a quarter of a turn
    assert np.allclose(path(path.length), [60.0, 60.0, 0.0, 0.5 * math.pi], atol=1e-12)


def test_both_drives_of_a_gantry_move_as_one() -> None:
    path = sf.kinematics.JointPath(sf.ToolPath(LINE.transformed(np.eye(3)[[1, 0, 2]])), kinematics("gantry", skew=0.25))
    assert np.allclose(path(40.0), [0.0, 40.0, 0.0, 40.25], atol=1e-12)


def around(turns: float, count: int = 200) -> Array:
    phi = np.linspace(0.0, 2.0 * math.pi * turns, count)
    return np.column_stack([0.4 * np.cos(phi), 0.4 * np.sin(phi), np.ones(count)])


def test_a_joint_winds_on_over_several_turns() -> None:
    path = sf.kinematics.JointPath(leaning(*map(tuple, around(3.0))), kinematics("xyzac-trt"))
    turned = path(path.length)[4] - path(0.0)[4]
    assert abs(abs(turned) - 6.0 * math.pi) < 1e-9


def test_turns_are_chosen_inside_the_travel_and_near_the_start() -> None:
    tool = leaning((0.3, 0.1, 1.0), (0.3, 0.4, 1.0))
    machine = kinematics("xyzac-trt")
    free = sf.kinematics.JointPath(tool, machine)
    assert free(0.0)[3] > 0.0
    tilted = sf.kinematics.JointPath(tool, machine, travel={"a": (-1.0, 0.0)})
    assert np.all(tilted(np.linspace(0.0, 100.0, 50))[:, 3] < 0.0)
    turned = sf.kinematics.JointPath(tool, machine, travel={"c": (20.0, 30.0)})
    assert np.all(turned(np.linspace(0.0, 100.0, 50))[:, 4] >= 20.0)
    near = sf.kinematics.JointPath(tool, machine, start={"c": 100.0})
    assert abs(near(0.0)[4] - 100.0) <= math.pi
    for other in (tilted, turned, near):
        for path in (free, other):
            assert np.allclose(machine.forward(path(50.0))[0], tool(50.0), atol=1e-12)


def test_the_travel_of_linear_joints_counts_where_the_way_to_turn_is_chosen() -> None:
    tool = leaning((0.3, 0.1, 1.0), (0.3, 0.4, 1.0))
    machine, s = kinematics("xyzac-trt", z_rot_point=-50.0), np.linspace(0.0, 100.0, 50)
    free = sf.kinematics.JointPath(tool, machine)(s)
    low, high = float(np.min(free[:, 1])), float(np.max(free[:, 1]))
    other = sf.kinematics.JointPath(tool, machine, travel={"y": (-high - 1.0, -low + 1.0)})
    assert np.all((other(s)[:, 1] >= -high - 1.0) & (other(s)[:, 1] <= -low + 1.0))
    assert np.all(np.sign(other(s)[:, 3]) == -np.sign(free[:, 3]))  # it tilts to the other side
    assert np.allclose(machine.forward(other(s))[0], tool(s), atol=1e-12)
    with pytest.raises(
        LimitsError, match=r"travel\.y: the path takes joint y from .* mm, most at s = .* mm; its travel"
    ):
        sf.kinematics.JointPath(tool, machine, travel={"y": (high + 1e3, high + 2e3)})


def test_travel_that_is_left_is_refused_with_joint_and_mend() -> None:
    machine = kinematics("xyzac-trt")
    said = (
        r"travel\.c: the path takes joint c from .* deg, most at s = .* mm; its travel is -180 to 180 deg; mount the "
        "workpiece elsewhere"
    )
    with pytest.raises(LimitsError, match=said):
        sf.kinematics.JointPath(leaning(*map(tuple, around(1.2))), machine, travel={"c": (-math.pi, math.pi)})
    with pytest.raises(LimitsError, match=r"travel\.x: the path takes joint x .* mm, most at s = .* mm"):
        sf.kinematics.JointPath(leaning((0.1, 0.0, 1.0), (0.1, 0.1, 1.0)), machine, travel={"x": (-10.0, 10.0)})
    with pytest.raises(InputError, match="w: xyzac-trt has no such joint; it has x, y, z, a, c"):
        sf.kinematics.JointPath(leaning((0.1, 0.0, 1.0), (0.1, 0.1, 1.0)), machine, travel={"w": (0.0, 1.0)})


def bending(*vectors: tuple[float, float, float]) -> sf.ToolPath:
    """A straight tip and a tool axis along a Bezier curve of vectors."""
    knots = [0.0] * len(vectors) + [1.0] * len(vectors)
    return sf.ToolPath(LINE, sf.NurbsCurve(len(vectors) - 1, knots, vectors), kind="vectors")


@pytest.mark.parametrize("machine", MACHINES, ids=lambda machine: machine.kind)
@pytest.mark.parametrize(
    "tool",
    [
        leaning((0.2, 0.1, 1.0), (-0.3, -0.15, 1.0)),
        bending((0.3, 0.1, 1.0), (0.0, -0.05, 1.0), (-0.3, 0.0, 1.0)).reversed(),
        bending((-0.2, 0.2, 1.0), (-0.1, 0.0, 1.0), (0.1, -0.0, 1.0), (0.2, -0.2, 1.0)),
        bending((0.0, 0.0, 1.0), (0.2, 0.0, 1.0), (0.3, 0.3, 1.0)),
        leaning((0.2, 0.1, 1.0), (0.0, 0.0, 1.0)),
    ],
    ids=["straight", "beside", "curved", "from the pole", "to the pole"],
)
def test_a_path_straight_through_the_pole_tilts_on(machine: sf.kinematics.Kinematics, tool: sf.ToolPath) -> None:
    path = sf.kinematics.JointPath(tool, machine)
    s = np.linspace(0.0, 100.0, 4001)
    tip, axis = machine.forward(path(s))
    wanted = tool.orientation(*tool.locate(s))[:, 0]
    assert np.max(np.abs(tip - tool(s))) <= 1e-12 * 500.0
    assert np.max(np.abs(axis - wanted / np.linalg.norm(wanted, axis=1)[:, None])) <= 2e-10
    middle = np.linspace(0.1, 99.9, 501)
    exact = path.derivatives(middle)
    numeric = (path.derivatives(middle + 1e-3)[:, :3] - path.derivatives(middle - 1e-3)[:, :3]) / 2e-3
    rotary = slice(3, 5)
    off = np.max(np.abs(numeric - exact[:, 1:])[:, :, rotary])
    assert off <= 1e-6 * max(1.0, float(np.max(np.abs(exact[:, 1:, rotary]))))


def test_turning_off_at_the_pole_is_refused_and_a_path_beside_it_turns_fast() -> None:
    machine = kinematics("xyzac-trt")
    for tool in (
        leaning((0.2, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, 0.2, 1.0)),
        leaning((0.2, 0.0, 1.0), (0.0, 1e-6, 1.0), (0.0, 0.2, 1.0)),
        leaning((5e-6, 0.0, 1.0), (0.0, 5e-6, 1.0)),
    ):
        with pytest.raises(CurveError, match=r"at s = .* mm the tool axis is that of joint c .*; tilt the workpiece"):
            sf.kinematics.JointPath(tool, machine)
    path = sf.kinematics.JointPath(leaning((0.2, 1e-3, 1.0), (-0.2, 1e-3, 1.0)), machine)
    d = path.derivatives(np.array([1.0, 50.0]))
    assert abs(d[1, 1, 4]) > 1000.0 * abs(d[0, 1, 4])
    assert np.min(np.abs(path.breaks - 50.0)) < 1e-6  # the planner looks at it


KNOTS = [0, 0, 0, 0, 0.5, 1, 1, 1, 1]
TIP = sf.NurbsCurve(3, KNOTS, [[0, 0, 0], [20, 25, 0], [40, -15, 2], [60, 10, 2], [80, 0, 0]])


@pytest.mark.parametrize("machine", [each for each in MACHINES if each.rotary == 2], ids=lambda machine: machine.kind)
@pytest.mark.parametrize(
    "tool",
    [
        leaning((0.0, 0.0, 1.0), (0.0, 0.0, 2.0), (0.2, 0.1, 1.0)),
        leaning((0.2, 0.1, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, 2.0), (0.2, 0.1, 1.0), (0.2, 0.3, 1.0)),
        leaning((0.2, 0.1, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, 2.0), (-0.4, -0.2, 1.0), (0.0, 0.0, 1.0)),
        leaning((0.2, 0.1, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, 2.0), (-0.2, 0.3, 1.0)),
        sf.ToolPath(
            [LINE, sf.NurbsCurve(1, [0, 0, 1, 1], [[100, 0, 0], [100, 10, 0]])],
            [
                sf.NurbsCurve(1, [0, 0, 0.5, 1, 1], [[0.3, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]),
                sf.NurbsCurve(1, [0, 0, 0.5, 1, 1], [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.3, 1.0]]),
            ],
            kind="vectors",
        ),
        sf.ToolPath(TIP, sf.NurbsCurve(3, KNOTS, [*[(0.0, 0.0, 1.0)] * 4, (0.3, 0.2, 1.0)]), kind="vectors"),
        sf.ToolPath(TIP, sf.NurbsCurve(3, KNOTS, [(0.3, 0.2, -1.0), *[(0.0, 0.0, -1.0)] * 4]), kind="vectors"),
    ],
    ids=["begins", "stays", "tilts on", "turns meanwhile", "over two curves", "leaves slowly", "upside down"],
)
def test_a_tool_may_stay_at_the_pole(machine: sf.kinematics.Kinematics, tool: sf.ToolPath) -> None:
    path = sf.kinematics.JointPath(tool, machine)
    s = np.linspace(0.0, tool.length, 5001)
    joints = path(s)
    tip, axis = machine.forward(joints)
    wanted = tool.orientation(*tool.locate(s))[:, 0]
    assert np.max(np.abs(tip - tool(s))) <= 1e-10
    assert np.max(np.abs(axis - wanted / np.linalg.norm(wanted, axis=1)[:, None])) <= 1e-9
    assert np.max(np.abs(np.diff(joints[:, 4]))) < 0.01
    assert len(path.breaks) < 10


def test_an_upright_tool_leaves_the_rotary_joints_where_they_are() -> None:
    machine = kinematics("xyzac-trt")
    for tool in (leaning((0.0, 0.0, 1.0), (0.0, 0.0, 2.0)), sf.ToolPath(LINE)):
        path = sf.kinematics.JointPath(tool, machine, start={"c": 1.0})
        assert np.allclose(path(50.0)[3:], [0.0, 1.0])
    with pytest.raises(CurveError, match=r"tilts by 5\.71 deg at s = 100 mm; gantry cannot tilt the tool"):
        sf.kinematics.JointPath(leaning((0.0, 0.0, 1.0), (0.1, 0.0, 1.0)), kinematics("gantry"))
    with pytest.raises(LimitsError, match=r"travel\.a: the path takes joint a from 0 to 0 deg"):
        sf.kinematics.JointPath(sf.ToolPath(LINE), machine, travel={"a": (0.1, 1.0)})


@pytest.mark.parametrize("machine", [each for each in MACHINES if each.rotary == 2], ids=lambda machine: machine.kind)
def test_a_tool_that_stands_upside_down_is_half_a_turn_away(machine: sf.kinematics.Kinematics) -> None:
    tool, tilting = sf.ToolPath(LINE, [0.0, 0.0, -2.0], kind="vectors"), machine.joints[3]
    for travel, tilt in ((4.0, math.pi), (3.0, -math.pi)):
        path = sf.kinematics.JointPath(tool, machine, travel={tilting: (-4.0, travel)}, start={"c": 1.0})
        assert np.allclose(path(50.0)[3:], [tilt, 1.0])
        tip, axis = machine.forward(path(np.array([0.0, 50.0])))
        assert np.allclose(axis, [0.0, 0.0, -1.0]) and np.allclose(tip[1], [50.0, 0.0, 0.0])
    with pytest.raises(LimitsError, match=f"travel.{tilting}: the path takes joint {tilting} from -180 to -180 deg"):
        sf.kinematics.JointPath(tool, machine, travel={tilting: (-2.0, 2.0)})
    with pytest.raises(CurveError, match="tilts by 180 deg at s = 0 mm; gantry cannot tilt the tool"):
        sf.kinematics.JointPath(tool, kinematics("gantry"))


def test_a_kink_of_the_tool_axis_is_a_stop() -> None:
    path = sf.kinematics.JointPath(leaning((0.1, 0.1, 1.0), (0.3, 0.1, 1.0), (0.3, 0.4, 1.0)), kinematics("xyzbc-trt"))
    assert path.stops == pytest.approx((50.0,))


def test_many_curves_are_evaluated_together() -> None:
    corner = [[0, 0, 0], [30, 0, 0], [30, 20, 0], [0, 25, 8]]
    lean = [[0.1, 0.2, 1.0], [0.3, 0.2, 1.0], [0.2, 0.5, 1.0], [0.0, 0.4, 1.0]]
    lines = [[sf.NurbsCurve(1, [0, 0, 1, 1], [a, b]) for a, b in pairwise(rows)] for rows in (corner, lean)]
    tool = sf.ToolPath(lines[0], lines[1], kind="vectors")
    s = np.linspace(0.0, tool.length, 61)
    curve, u = tool.locate(s)
    single = np.array([lines[1][i].derivatives(np.array([x]), 2)[0] for i, x in zip(curve, u, strict=True)])
    assert np.allclose(tool.orientation(curve, u, 2), single, atol=1e-15)
    for machine in MACHINES:
        path = sf.kinematics.JointPath(tool, machine)
        assert path.stops == pytest.approx((30.0, 50.0))
        assert np.allclose(machine.forward(path(s))[0], tool(s), atol=1e-11)
    with pytest.raises(CurveError, match=r"the tool axis jumps by .* deg between curves 1 and 2, at s = 50 mm"):
        sf.ToolPath(lines[0], [lines[1][0], lines[1][1], lines[1][1]], kind="vectors")


def test_bad_tool_paths_are_refused() -> None:
    with pytest.raises(CurveError, match=r"the tool axis has no length at s = 50 mm \(curve 0, u = 0\.5\)"):
        leaning((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    other = sf.NurbsCurve(1, [0, 0, 2, 2], [[0, 0, 1], [0, 1, 1]])
    with pytest.raises(CurveError, match=r"runs over u = 0 to 2, its tip over 0 to 1"):
        sf.ToolPath(LINE, other)
    with pytest.raises(CurveError, match=r"the tool axis has 2 curves and the tip has 1"):
        sf.ToolPath(LINE, [other, other])
    with pytest.raises(CurveError, match=r"2 axes; a tool tip has 3"):
        sf.ToolPath(sf.NurbsCurve(1, [0, 0, 1, 1], [[0, 0], [1, 0]]))
    with pytest.raises(CurveError, match=r"columns; vectors have 3"):
        sf.ToolPath(LINE, sf.NurbsCurve(1, [0, 0, 1, 1], [[0], [1]]), kind="vectors")
    with pytest.raises(InputError, match=r"kind is 'quaternions'; choose"):
        sf.ToolPath(LINE, other, kind="quaternions")
    with pytest.raises(InputError, match="a JointPath needs a ToolPath"):
        sf.kinematics.JointPath(sf.Path([LINE]), kinematics("gantry"))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="a path with a tool axis cannot be transformed"):
        leaning((0.0, 0.0, 1.0), (0.1, 0.0, 1.0)).transformed(np.eye(3))


def test_bad_machines_are_refused() -> None:
    with pytest.raises(InputError, match=r"kinematics\.type: 'hexapod' is not known; write one of xyzac-trt, "):
        kinematics("hexapod")
    with pytest.raises(InputError, match=r"kinematics\.pivot-length: missing; 5axiskins needs it"):
        kinematics("5axiskins")
    with pytest.raises(InputError, match=r"kinematics\.y-offset: unknown parameter; xyzbc-trt has x-rot-point, "):
        kinematics("xyzbc-trt", y_offset=1.0)
    with pytest.raises(InputError, match=r"kinematics\.pivot-length is nan; expected a finite length in mm"):
        kinematics("head-table", pivot_length=math.nan)


def test_a_tool_path_can_be_copied_and_turned_round(data_dir: File) -> None:
    tool = flank(data_dir)
    copy = pickle.loads(pickle.dumps(tool))
    back = tool.reversed().reversed()
    s = np.linspace(0.0, tool.length, 20)
    machine = kinematics("xyzac-trt")
    for other in (copy, back, tool.with_findings("said")):
        assert np.allclose(
            sf.kinematics.JointPath(other, machine)(s), sf.kinematics.JointPath(tool, machine)(s), atol=1e-10
        )


def test_a_long_path_that_bends_all_along_has_no_stops() -> None:
    s = np.arange(1203.0)
    tip = np.stack([s, np.zeros_like(s), 0.02 * np.cos(s)], axis=1)
    lean = 0.4 + 0.05 * np.sin(2.0 * np.pi * s / 8.0)
    knots = np.concatenate([[0.0] * 3, np.arange(1201.0), [1200.0] * 3])
    axis = np.stack([np.sin(lean), 0.2 + np.zeros_like(s), np.cos(lean)], axis=1)
    tool = sf.ToolPath(sf.NurbsCurve(3, knots, tip), sf.NurbsCurve(3, knots, axis), kind="vectors")
    assert sf.kinematics.JointPath(tool, MACHINES[0]).stops == ()
