"""Kinematics: from tool tip and tool axis to the joints of a machine and back, with derivatives along a path."""

from __future__ import annotations

from splinefeed.kinematics.chains import KINDS as KINDS
from splinefeed.kinematics.chains import Kinematics as Kinematics
from splinefeed.kinematics.chains import kinematics as kinematics
from splinefeed.kinematics.joint_path import JointPath as JointPath
