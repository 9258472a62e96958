"""Immutable NURBS curves and the paths made of them, without a clock."""

from __future__ import annotations

from typing import TYPE_CHECKING

from splinefeed.lazy import lazily

_HOMES = {
    "Fit": "geometry.fitting.points",
    "Smoother": "geometry.smoothing_stream",
    "smooth_stream": "geometry.smoothing_stream",
}

__all__ = [*_HOMES]  # pyright: ignore[reportUnsupportedDunderAll]

if TYPE_CHECKING:
    from splinefeed.geometry.fitting.points import Fit as Fit
    from splinefeed.geometry.smoothing_stream import Smoother as Smoother
    from splinefeed.geometry.smoothing_stream import smooth_stream as smooth_stream
else:
    __getattr__, __dir__ = lazily(__name__, _HOMES)
