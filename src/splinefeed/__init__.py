"""From a NURBS curve and a machine's limits to where every axis must be at each servo tick."""

from __future__ import annotations

from splinefeed.lazy import lazily

__version__ = "0.1.0"

#: Names that were here: each has one home now. They warn, for one release.
_MOVED = {
    "LookAhead": "splinefeed.live.LookAhead",
    "Smoother": "splinefeed.geometry.Smoother",
    "Table": "splinefeed.Machine",
    "feed_ripple": "splinefeed.analysis.feed_ripple",
    "read_parts": "splinefeed.formats.read_parts",
    "smooth_stream": "splinefeed.geometry.smooth_stream",
    "stream_setpoints": "splinefeed.live.stream_setpoints",
    "tune_on_path": "splinefeed.simulation.tune_on_path",
}

# what is public, and where it lives, stands in __init__.pyi
__getattr__, __dir__, _public = lazily(__name__, _MOVED)
__all__ = ["__version__", *_public]  # pyright: ignore[reportUnsupportedDunderAll]
