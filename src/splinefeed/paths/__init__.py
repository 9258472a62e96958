"""Immutable NURBS curves and the paths made of them, without a clock."""

from __future__ import annotations

from splinefeed.lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
