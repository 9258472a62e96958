"""Numbers from records and paths: the verdict on every limit, ripple, drift, chord and contour error, spectra."""

from __future__ import annotations

from typing import TYPE_CHECKING

from splinefeed.lazy import lazily

_HOMES = {
    "AxisMotion": "analysis.motion",
    "Contour": "analysis.contour",
    "LimitUse": "analysis.binding",
    "Ripple": "analysis.ripple",
    "feed_ripple": "analysis.ripple",
}

__all__ = [*_HOMES]  # pyright: ignore[reportUnsupportedDunderAll]

if TYPE_CHECKING:
    from splinefeed.analysis.binding import LimitUse as LimitUse
    from splinefeed.analysis.contour import Contour as Contour
    from splinefeed.analysis.motion import AxisMotion as AxisMotion
    from splinefeed.analysis.ripple import Ripple as Ripple
    from splinefeed.analysis.ripple import feed_ripple as feed_ripple
else:
    __getattr__, __dir__ = lazily(__name__, _HOMES)
