"""Robot arms: from a URDF to joints along waypoints or a TCP curve, with exact derivatives and rigid-body torque."""

from splinefeed.records.limit_table import Joint as Joint
from splinefeed.robots.arm import Arm as Arm
from splinefeed.robots.dynamics import Payload as Payload
from splinefeed.robots.trajectory import JointTrajectory as JointTrajectory
from splinefeed.robots.trajectory import joint_trajectory as joint_trajectory
from splinefeed.robots.trajectory import motion_at as motion_at
