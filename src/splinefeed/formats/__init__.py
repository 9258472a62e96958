"""One file a format, in and out: drawings, CAD, G-code, curves and tables of points; records as HDF5 and others."""

from __future__ import annotations

from splinefeed.lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
