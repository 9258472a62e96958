"""Five-axis programs: tool centre point control of three controls, vectors, inverse time, and joints as they are."""

from __future__ import annotations

import math
import pickle
import re
from pathlib import Path as File
from typing import Any

import numpy as np
import pytest

import splinefeed as sf
from gcode_programs import detect, program, refusal
from splinefeed.errors import CurveError, InputError, LimitsError
from splinefeed.kinematics import JointPath, kinematics
from splinefeed.programs.gcode import from_file
from splinefeed.records import Array

TRUNNION = kinematics("xyzac-trt", y_offset=4.0, z_offset=-15.0, tool_offset=60.0)
#: mm, and 1 for tool axes: block ends on the joints and on planned setpoints.
SAME, AT_REST = 1e-9, 1e-6


def words(file: File, begin: str, end: str) -> list[dict[str, float]]:
    """Places at the ends of the blocks between two words, by letter, read by nothing of the reader's."""
    text = file.read_text()
    place: dict[str, float] = {}
    found = []
    for line in text[text.index(begin) : text.index(end, text.index(begin))].splitlines():
        plain = re.sub(r"\([^)]*\)|^N\d+", "", line)
        said = {key: float(value) for key, value in re.findall(r"([ABC]3=|[XYZAC])(-?[0-9.]+)", plain)}
        if said and "G43.4" not in plain:
            place |= said
            found.append(dict(place))
    return found


def read(folder: File, *lines: str, **options: Any) -> sf.Path:
    """The path of a program whose start is not known."""
    return sf.read(program(folder, *lines), **options)


def of_angles(rows: list[dict[str, float]]) -> tuple[Array, Array]:
    """Tips and tool axes (n, 3) on a table that tilts by A and turns by C: k = Rz(-C) Rx(-A) z."""
    a, c = (np.radians([row[letter] for row in rows]) for letter in "AC")
    up = np.column_stack([np.zeros(len(rows)), np.sin(a), np.cos(a)])
    axis = np.column_stack([np.cos(c) * up[:, 0] + np.sin(c) * up[:, 1], np.cos(c) * up[:, 1], up[:, 2]])
    return np.array([[row[letter] for letter in "XYZ"] for row in rows]), axis


def of_vectors(rows: list[dict[str, float]]) -> tuple[Array, Array]:
    axis = np.array([[row[f"{letter}3="] for letter in "ABC"] for row in rows])
    tip = np.array([[row[letter] for letter in "XYZ"] for row in rows])
    return tip, axis / np.linalg.norm(axis, axis=1)[:, None]


PROGRAMS = {
    "fanuc_g434.nc": ("fanuc", "N60", "N160", of_angles),
    "siemens_traori.mpf": ("siemens", "N60", "N160", of_vectors),
    "linuxcnc_g93.ngc": ("linuxcnc", "M428\n", "M429\n", of_angles),
}


def tool_path(data_dir: File, name: str) -> sf.ToolPath:
    path = sf.read(data_dir / "five-axis" / name, **({"path": 1} if "g93" in name else {}))
    assert isinstance(path, sf.ToolPath)
    return path


@pytest.mark.parametrize("name", PROGRAMS)
def test_joints_lead_back_to_what_is_programmed(data_dir: File, name: str) -> None:
    file = data_dir / "five-axis" / name
    dialect, begin, end, meant = PROGRAMS[name]
    assert detect(file.read_bytes()).name == dialect
    path = tool_path(data_dir, name)
    tips, axes = meant(words(file, begin, end))
    joints = JointPath(path, TRUNNION)
    tip, axis = TRUNNION.forward(joints(path.curve_starts))
    assert tip.shape == tips.shape
    assert np.max(np.abs(tip - tips)) <= SAME
    assert np.max(np.abs(axis - axes)) <= SAME


@pytest.mark.slow
@pytest.mark.parametrize("name", PROGRAMS)
def test_setpoints_at_block_ends_are_what_is_programmed(data_dir: File, name: str) -> None:
    _, begin, end, meant = PROGRAMS[name]
    path = tool_path(data_dir, name)
    run = sf.run(
        path,
        sf.Limits(feed=15, axis_acceleration=dict.fromkeys("xyz", 500) | dict.fromkeys("ac", 2),
                  axis_jerk=dict.fromkeys("xyz", 3000) | dict.fromkeys("ac", 10)),
        machine="trunnion", period=4e-3, strategy="look-ahead",
    )  # fmt: skip
    assert run.verdict.ok and run.joints is not None
    tip, axis = run.joints.kinematics.forward(run.points.position)
    for place, direction in zip(*meant(words(data_dir / "five-axis" / name, begin, end)), strict=True):
        nearest = int(np.argmin(np.linalg.norm(tip - place, axis=1)))
        assert np.max(np.abs(tip[nearest] - place)) <= AT_REST
        assert np.max(np.abs(axis[nearest] - direction)) <= AT_REST


def test_feeds_lines_and_findings_go_with_the_curves(data_dir: File) -> None:
    path = tool_path(data_dir, "fanuc_g434.nc")
    assert path.kind == "angles" and path.rotary == ("a", "c") and path.tool_length is None
    assert path.lines is not None and path.lines.tolist() == [*range(11, 18), 18]
    assert path.feeds is not None and path.feeds.tolist() == [20.0, *[800 / 60] * 6, math.inf]
    assert any("line 9: G43.4" in finding for finding in path.findings)
    assert any("left out: line 8, 20" in finding for finding in path.findings)
    assert path.place(1.0) == "s = 1 mm (line 11)" and path.place(path.length).endswith("(line 18)")
    again = pickle.loads(pickle.dumps(path))
    assert again.rotary == path.rotary and again.lines.tolist() == path.lines.tolist()
    back = path.reversed()
    assert isinstance(back, sf.ToolPath) and back.lines is not None and back.lines.tolist() == path.lines[::-1].tolist()


def test_inverse_time_is_a_duration_per_block(data_dir: File) -> None:
    path = tool_path(data_dir, "linuxcnc_g93.ngc")
    assert path.feeds is not None
    seconds = np.diff(path.curve_starts)[:3] / path.feeds[:3]
    np.testing.assert_allclose(seconds, [2.0, 2.4, 3.0], rtol=1e-12)
    assert path.feeds[3] == 10.0
    joints = sf.read(data_dir / "five-axis" / "linuxcnc_g93.ngc", path=2)
    # rotary axes alone: s counts degrees, and the block of F10 takes 6 s
    assert joints.feeds is not None and not isinstance(joints, sf.ToolPath)
    assert joints.length / joints.feeds[0] == pytest.approx(6.0) and joints.length == pytest.approx(math.hypot(20, 15))


def test_without_control_of_the_tip_words_are_joints(data_dir: File) -> None:
    path = sf.read(data_dir / "five-axis" / "linuxcnc_joints.ngc")
    assert path.axes == ("x", "y", "z", "a", "c") and not isinstance(path, sf.ToolPath)
    ends = np.array([curve.ends[1] for curve in path.curves])
    np.testing.assert_allclose(ends[2], [20, 0, 17, *np.radians([20, 50])], atol=1e-12)
    # F counts X Y Z where they move, rotary axes where these move alone
    assert path.feeds is not None
    np.testing.assert_allclose(path.feeds, np.array([600, 600, 400, 500, 900, 300]) / 60.0)


def test_f_counts_x_y_z_alone_where_u_moves_too(tmp_path: File) -> None:
    path = read(tmp_path, "G0 X0 U0", "G1 X3 U4 F60", "U8", "M2")
    assert path.feeds is not None and path.length == 9.0
    np.testing.assert_allclose(np.diff(path.curve_starts) / path.feeds, [3.0, 4.0])  # seconds, as in LinuxCNC


def test_tool_length_and_work_offsets_go_through_the_kinematics(tmp_path: File) -> None:
    table = tmp_path / "tools.tbl"
    table.write_text("T1 P1 Z80 D6\nT2 P2 Z95 D6\n")
    lines = ["G43.4 H2", "G0 X0 Y0 Z5 A-30 C20", "G1 X10 F600", "G49"]
    path = read(tmp_path, *lines, tools=table, offsets="G54=7,8,-9,1,0,2")
    assert isinstance(path, sf.ToolPath) and path.tool_length == 95.0
    joints = JointPath(path, TRUNNION)
    assert joints.kinematics.parameters["tool-offset"] == 95.0
    # X, Y, Z of G54 are on the workpiece, A and C are added to those of the joints
    np.testing.assert_allclose(joints.kinematics.forward(joints(0.0))[0], [7.0, 8.0, -4.0], atol=1e-12)
    np.testing.assert_allclose(joints(0.0)[3:], np.radians([-29.0, 22.0]), atol=1e-12)
    # LinuxCNC says the length by G43; G49 does not end its kinematics
    lines = ["G43 H1", "M428", "G0 X0 Y0 Z5 A0 C9", "G1 X10 F600", "G43 H1", "G1 X20", "G49", "G1 X30", "M429"]
    paths = from_file(program(tmp_path, *lines), tools=table)
    assert [each.tool_length for each in paths if isinstance(each, sf.ToolPath)] == [80.0, 0.0]
    assert [each.length for each in paths] == [20.0, 10.0]


def test_a_tool_change_and_a_turn_at_rest_part_the_path(tmp_path: File) -> None:
    file = program(
        tmp_path, "G43.4 H1", "G0 X0 Y0 Z5 A0 C0", "G1 X10 A-10 F600", "A-20", "X20 A-25", "G49", "G1 X0 A0", "M30"
    )
    paths = from_file(file)
    assert [path.name for path in paths] == ["part-1", "part-2", "part-3"]
    assert [isinstance(path, sf.ToolPath) for path in paths] == [True, True, False]
    assert any(
        "the tool turns while its tip stands still" in finding and "line 4" in finding for finding in paths[0].findings
    )
    np.testing.assert_allclose([path.tip_end for path in paths], [10.0, 10.0, 20.0])


def test_vectors_of_i_j_k(tmp_path: File) -> None:
    path = read(tmp_path, "G43.5 H1", "G0 X0 Y0 Z5 I0 J0 K1", "G1 X10 I1 K2 F600", "X20", "G49")
    assert isinstance(path, sf.ToolPath) and path.kind == "vectors"
    ends = path.orientation(np.array([0, 0, 1, 1]), np.array([0.0, 1.0, 0.0, 1.0]))[:, 0]
    np.testing.assert_allclose(ends[[0, 1, 3]], [[0, 0, 1], *[[0.2**0.5, 0, 0.8**0.5]] * 2], atol=1e-12)


REFUSED = {
    "line 2: the tool axis 0 0 0 has no direction": ["TRAORI", "G0 X0 Y0 Z0 A3=0 B3=0 C3=0"],
    "line 1: a tool axis (A3= B3= C3=) has no TRAORI": ["G1 X1 A3=0 B3=0 C3=1 F100"],
    "line 3: a tool axis is given with an arc": ["TRAORI", "G0 X0 Y0 Z0 C3=1", "G2 X2 Y0 I1 J0 A3=1 F100"],
    "line 3: a rotary axis is programmed, and line 2 gives": ["TRAORI", "G0 X0 Y0 Z0 C3=1", "G1 X2 A=10 F100"],
    "the tool axis has no length at s = 5 mm (line 3)": ["TRAORI", "G0 X0 Y0 Z0 C3=1", "G1 X10 C3=-1 F100"],
}


@pytest.mark.parametrize("message", REFUSED)
def test_refused(tmp_path: File, message: str) -> None:
    assert refusal(tmp_path, *REFUSED[message], dialect="siemens").startswith(message)


def test_what_the_machine_cannot_is_told_with_line_and_axis(tmp_path: File) -> None:
    start = ["G43.4 H1", "G0 X0 Y0 Z5 B0 C0"]
    path = read(tmp_path, *start, "G1 X10 B-10 F600", "G49")
    with pytest.raises(CurveError, match=r"\(line 3\) the tool path turns B, a rotary axis .* it has A, C: choose"):
        JointPath(path, TRUNNION)
    path = read(tmp_path, "G43.4 H1", "G0 X0 Y0 Z5 A0 C0", "G1 X10 A-20 F600", "X20 A-150", "G49")
    with pytest.raises(LimitsError, match=r"travel\.a: .* \(line 4\); its travel is"):
        JointPath(path, TRUNNION, travel={"a": (-2.0, 2.0)})
    with pytest.raises(InputError, match=r"no \[kinematics\], which a tool path needs \(line 3\); add"):
        sf.run(path, machine="router")
    assert refusal(tmp_path, "G43.4 H1", "G41.1 D4", "G1 X9 F9").startswith(
        "line 2: G41.1 needs the end of tool centre"
    )
