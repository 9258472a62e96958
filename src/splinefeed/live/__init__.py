"""Setpoints to a running controller: a look-ahead buffer, override, hold and stop; one small file a sink."""

from __future__ import annotations

from splinefeed.lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
