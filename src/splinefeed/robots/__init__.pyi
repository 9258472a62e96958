"""Robot arms: from a URDF to joints along waypoints or a TCP curve, with exact derivatives and rigid-body torque."""

from .arm import Arm as Arm
from .dynamics import Payload as Payload
from .trajectory import JointTrajectory as JointTrajectory
from .trajectory import joint_trajectory as joint_trajectory
from .trajectory import motion_at as motion_at
