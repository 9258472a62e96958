"""The machine that LinuxCNC's planner plans for, as its INI file has it."""

from __future__ import annotations

from pathlib import Path as File

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.live.linuxcnc_limits import mill_of

INI = """\
[TRAJ]
TPMOD = splinefeed_tp
COORDINATES = X Z A
LINEAR_UNITS = inch
ANGULAR_UNITS = degree
[KINS]
KINEMATICS = trivkins coordinates=XZA
[AXIS_X]
MAX_VELOCITY = 2
MAX_ACCELERATION = 20
[JOINT_0]
MAX_VELOCITY = 1.5
MAX_JERK = 700
[AXIS_Z]
MAX_VELOCITY = 1
MAX_ACCELERATION = 10
[AXIS_A]
MAX_VELOCITY = 90
MAX_ACCELERATION = 900
MAX_JERK = 9000
"""


def test_the_machine_comes_from_the_ini_file(tmp_path: File):
    file = tmp_path / "mill.ini"
    file.write_text(INI)
    found = mill_of(str(file))
    assert found.axes == ("x", "z", "a") and found.columns.tolist() == [0, 2, 3]
    np.testing.assert_allclose(found.velocity, [1.5 * 25.4, 25.4, np.pi / 2])
    np.testing.assert_allclose(found.acceleration, [20 * 25.4, 254.0, 5 * np.pi])
    np.testing.assert_allclose(found.jerk, [700 * 25.4, 20 * 254.0, 50 * np.pi])
    assert found.notes == ["[AXIS_Z]MAX_JERK is missing: 200, 20 times the acceleration a second"]


TRUNNION = """\
[TRAJ]
TPMOD = splinefeed_tp
COORDINATES = XYZAC
[KINS]
KINEMATICS = xyzac-trt-kins coordinates=XYZACY
"""


def test_joints_that_are_no_axes_have_their_own_limits(tmp_path: File):
    limits = "MAX_VELOCITY = {}\nMAX_ACCELERATION = 100\nMAX_JERK = 2000\n"
    text = TRUNNION + "".join(f"[AXIS_{axis}]\n{limits.format(50)}" for axis in "XYZAC")
    text += "".join(f"[JOINT_{k}]\n{limits.format(20 + k)}" for k in range(6))
    file = tmp_path / "mill.ini"
    file.write_text(text)
    found = mill_of(str(file))
    assert found.limited == ("x", "y", "z", "a", "c", "joint 0", "joint 1", "joint 2", "joint 5")
    turns = np.radians([23.0, 24.0])  # a rotary joint is its axis
    np.testing.assert_allclose(found.velocity, [50.0, 50.0, 50.0, *turns, 20.0, 21.0, 22.0, 25.0])
    assert found.moved is not None and found.moved.letters == ("x", "y", "z", "y")
    assert found.piece_columns.tolist() == [0, 1, 2, 3, 5, 9, 10, 11, 12]
    file.write_text(text.replace("COORDINATES = XYZAC\n", "COORDINATES = XYZ\n"))
    with pytest.raises(sf.errors.FormatError, match=r"\[TRAJ\]COORDINATES has no [AC]: xyzac-trt-kins has joints for"):
        mill_of(str(file))
    file.write_text(text.partition("[JOINT_5]")[0])
    with pytest.raises(sf.errors.FormatError, match=r"MAX_VELOCITY of joint 5 is missing; add it to \[JOINT_5\]"):
        mill_of(str(file))


@pytest.mark.parametrize(
    ("ratio", "left", "said"),
    [
        # a jerk of 4/3 * ratio * 10 / 0.001 in 200, of which offsets take half at most
        (0.005, 200.0 - 66.666667, "0.5 % of velocity and acceleration are kept for external offsets, and 66.6667 of"),
        (0.2, 100.0, "the sum is beyond the jerk of 200 (OFFSET_AV_RATIO of at most 0.0075 keeps it)"),
    ],
)
def test_external_offsets_take_their_share_of_an_axis(ratio: float, left: float, said: str, tmp_path: File):
    file = tmp_path / "mill.ini"
    file.write_text(INI.replace("[AXIS_Z]", f"[AXIS_Z]\nOFFSET_AV_RATIO = {ratio}"), encoding="utf-8")
    found = mill_of(str(file))
    k = found.axes.index("z")
    np.testing.assert_allclose(found.velocity[k], 25.4 * (1.0 - ratio))
    np.testing.assert_allclose(found.acceleration[k], 254.0 * (1.0 - ratio))
    np.testing.assert_allclose(found.jerk[k], 25.4 * left)
    assert said in found.notes[-1]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("trivkins coordinates=XZA", "genserkins", r"KINEMATICS = genserkins: it can plan trivkins, corexykins"),
        ("MAX_ACCELERATION = 10\n", "", r"MAX_ACCELERATION of axis Z is missing; add it to \[AXIS_Z\]"),
        ("LINEAR_UNITS = inch", "LINEAR_UNITS = furlong", r"\[TRAJ\]LINEAR_UNITS is 'furlong'"),
        ("MAX_JERK = 700", "MAX_JERK = -700", r"\[JOINT_0\]MAX_JERK: -700; must be greater than 0"),
        ("[TRAJ]", "[TRAY]", r"no section \[TRAJ\]"),
        ("[AXIS_X]", "[AXIS_X]\nOFFSET_AV_RATIO = 1", r"\[AXIS_X\]OFFSET_AV_RATIO is 1; give 0 to 0.9"),
    ],
)
def test_an_ini_file_that_cannot_be_planned_is_one_line(tmp_path: File, old: str, new: str, said: str):
    file = tmp_path / "mill.ini"
    file.write_text(INI.replace(old, new))
    with pytest.raises(sf.errors.FormatError, match=said):
        mill_of(str(file))
