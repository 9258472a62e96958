"""Basic shapes of SVG as pieces of curves. Source: W3C, SVG 1.1, chapter 9."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import pairwise

import numpy as np

from splinefeed.formats import svg_paths
from splinefeed.formats.svg_paths import Piece, Subpath
from splinefeed.formats.svg_places import ShapeError, Viewport, length, numbers
from splinefeed.geometry.arcs import arc


def subpaths(tag: str, given: Mapping[str, str], view: Viewport) -> list[Subpath]:
    """The outline of a basic shape; empty where its size is 0."""

    def value(name: str, of: str, otherwise: float = 0.0) -> float:
        text = given.get(name, "")
        return length(text, name, view, of) if text.strip() and text.strip() != "auto" else otherwise

    if tag == "line":
        ends = complex(value("x1", "x"), value("y1", "y")), complex(value("x2", "x"), value("y2", "y"))
        return [] if ends[0] == ends[1] else [Subpath([Piece(list(ends))])]
    if tag in ("polyline", "polygon"):
        listed = numbers(given.get("points", ""), "points")
        if len(listed) % 2:
            raise ShapeError(f"points: {len(listed)} numbers; expected pairs")
        points = [complex(x, y) for x, y in zip(listed[0::2], listed[1::2], strict=True)]
        points += points[:1] if tag == "polygon" else []
        pieces = [Piece([a, b]) for a, b in pairwise(points) if a != b]
        return [Subpath(pieces)] if pieces else []
    if tag == "rect":
        return _rectangle(given, value)
    if tag == "circle":
        rx = ry = value("r", "o")
    else:
        rx, ry = _radii(value)
    _not_negative("radius", min(rx, ry) if tag == "circle" or "rx" in given or "ry" in given else 0.0)
    if rx <= 0.0 or ry <= 0.0:
        return []
    center = np.array([value("cx", "x"), value("cy", "y")])
    whole = arc(center, np.array([rx, 0.0]), np.array([0.0, ry]), 0.0, 2.0 * math.pi)
    return [Subpath([Piece(whole.control_points.view(np.complex128).ravel().tolist(), whole.weights, whole.knots)])]


def _rectangle(given: Mapping[str, str], value: Callable[..., float]) -> list[Subpath]:
    width, height = value("width", "x"), value("height", "y")
    _not_negative("width", width)
    _not_negative("height", height)
    if width == 0.0 or height == 0.0:
        return []
    x, y = value("x", "x"), value("y", "y")
    rx, ry = _radii(value)
    rx, ry = min(max(rx, 0.0), 0.5 * width), min(max(ry, 0.0), 0.5 * height)
    rx, ry = (rx, ry) if rx > 0.0 and ry > 0.0 else (0.0, 0.0)
    right, low = x + width, y + height
    corner = f"A{rx!r} {ry!r} 0 0 1"
    return svg_paths.parse(
        f"M{x + rx!r} {y!r}H{right - rx!r}{corner}{right!r} {y + ry!r}V{low - ry!r}{corner}{right - rx!r} {low!r}"
        f"H{x + rx!r}{corner}{x!r} {low - ry!r}V{y + ry!r}{corner}{x + rx!r} {y!r}Z"
    )[0]


def _radii(value: Callable[..., float]) -> tuple[float, float]:
    """The radii along x and y; one that is not given is as the other."""
    rx, ry = value("rx", "x", -1.0), value("ry", "y", -1.0)
    return (ry if rx < 0.0 else rx), (rx if ry < 0.0 else ry)


def _not_negative(name: str, value: float) -> None:
    if value < 0.0:
        raise ShapeError(f"{name} is {value:g}; expected 0 or more")
