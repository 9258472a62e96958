"""Numbers from records and paths: the verdict on every limit, ripple, drift, chord and contour error, spectra."""

from __future__ import annotations

from splinefeed.lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
