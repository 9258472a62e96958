"""Paths: curves joined end to end with axes, feeds and markers, without a clock.

In come curves; out comes a Path (`path`; where it is at a length says `joined_curves`, what is said of each of its
curves `each_curve`), of a tool's tip and axis a ToolPath (`tool_path`), of several contours a Job (`jobs`), of points a
curve through them (`waypoints`): all of them are a `track`; of a long file PathParts (`path_parts`). `resolution` and
`gaps` decide once what is too small to be geometry, `corners` finds corners, `parts` cuts and joins, `chaining` makes
paths of pieces; `fitting/` makes curves of points, `smoothing*` continuous curvature of short lines with proof,
`tangent_axis` a rotary axis along the tangent, `meetings` finds where lines cross, `contents` is what a reader returns,
`shapes/` what the paper and the examples drive.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
