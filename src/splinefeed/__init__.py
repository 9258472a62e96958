"""From a NURBS curve and a machine's limits to where every axis must be at each servo tick."""

from __future__ import annotations

import lazy_loader

__version__ = "0.1.0"

# what is public, and where it lives, stands in __init__.pyi
__getattr__, __dir__, _public = lazy_loader.attach_stub(__name__, __file__)
__all__ = ["__version__", *_public]  # pyright: ignore[reportUnsupportedDunderAll]
