"""The parameter at each servo tick: one function a published method, one shared loop, one registry.

In come a path and a TimeLaw; out come Setpoints. `interpolator` is the entry, `registry` knows the methods, `stepping`
holds the published ones over the loop of `loop`, `arc_length` the exact one over arrays.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
