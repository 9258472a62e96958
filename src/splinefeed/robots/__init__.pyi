"""Robot arms: from a URDF to joints along waypoints or a TCP curve, with exact derivatives and rigid-body torque."""

from splinefeed.robots.arm import Arm as Arm
from splinefeed.robots.dynamics import Payload as Payload
