"""Robot arms: from a URDF to joints along waypoints or a TCP curve, with exact derivatives and rigid-body torque."""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
