"""Numbers from records and paths: ripple, drift, chord and contour error, spectra.

In come Setpoints or a Response and their path; out come numbers and curves. `measures` looks at setpoints, `following`
at what a machine did, `thinning` takes the points of a figure, `bands` the least and greatest of blocks of ticks.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
