"""Joints of machines along a tool path, with exact derivatives: from tip and tool axis to joints and back.

`chains` has the machines with both directions, written once for numbers and for `jets`, truncated Taylor series;
`joint_path` is the path of joints along a ToolPath, which planner and interpolation take; `with_joints` has joints
beside the axes of a path.
"""

from __future__ import annotations

from splinefeed.kinematics.chains import KINDS as KINDS
from splinefeed.kinematics.chains import Kinematics as Kinematics
from splinefeed.kinematics.chains import kinematics as kinematics
from splinefeed.kinematics.joint_path import JointPath as JointPath
