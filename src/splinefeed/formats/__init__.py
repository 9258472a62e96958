"""One file a format, in and out: drawings, CAD, G-code, curves and tables of points; records as HDF5 and others."""

from __future__ import annotations

from typing import TYPE_CHECKING

from splinefeed.lazy import lazily

_HOMES = {
    "BitPattern": "formats.bit_pattern",
    "PathParts": "formats.path_parts",
    "read_parts": "formats.path_parts",
}

__all__ = [*_HOMES]  # pyright: ignore[reportUnsupportedDunderAll]

if TYPE_CHECKING:
    from splinefeed.formats.bit_pattern import BitPattern as BitPattern
    from splinefeed.formats.path_parts import PathParts as PathParts
    from splinefeed.formats.path_parts import read_parts as read_parts
else:
    __getattr__, __dir__ = lazily(__name__, _HOMES)
