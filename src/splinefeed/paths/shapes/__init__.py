"""Ready-made paths: lines and conics, airfoils, the butterfly, a figure-eight, a helix; by call or by text.

`curves` and `airfoil` make them, `text` reads what a user types, such as `naca:0025?perimeter=33`.
"""

from __future__ import annotations

from splinefeed.paths.shapes.airfoil import naca
from splinefeed.paths.shapes.curves import butterfly, circle, ellipse, figure_eight, helix, line
from splinefeed.paths.shapes.text import describe, from_text, is_shape, names

__all__ = [
    "butterfly",
    "circle",
    "describe",
    "ellipse",
    "figure_eight",
    "from_text",
    "helix",
    "is_shape",
    "line",
    "naca",
    "names",
]


def __dir__() -> list[str]:
    return __all__
