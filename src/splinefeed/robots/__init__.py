"""Robot arms: from a URDF to joints along waypoints or a curve of the tip, with exact derivatives and torques.

In comes a URDF; out comes an Arm (`arm`). `description` reads the file, `frames` say where links are, `dynamics` has
torques, `joint_limits` gathers limits. `waypoint_path` is the path through waypoints of joints, `arm_path` that along a
curve of the tip, by `inverse` and `orientation`; `motion_file` reads motions for the command line, `trajectory`
writes JointTrajectory.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
