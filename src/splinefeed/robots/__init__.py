"""Robot arms: from a URDF to joints along waypoints or a TCP curve, with exact derivatives and rigid-body torque."""

from __future__ import annotations

from splinefeed.lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
