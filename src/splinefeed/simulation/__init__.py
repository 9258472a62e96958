"""The servo loop over setpoints, and the rules that tune it.

In come Setpoints and a Machine; out comes a Response (`follow`). `plant` makes matrices of an axis for the kernels,
`linear` is its loop without friction and rounding: margins, poles, bounds. `tuning` has the rules, `shaping` gains
from margins, `curves` what figures of a tuned axis show.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
