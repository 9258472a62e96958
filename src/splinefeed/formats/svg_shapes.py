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
        rx, ry = value("rx", "x", -1.0), value("ry", "y", -1.0)
        rx, ry = (ry if rx < 0.0 else rx), (rx if ry < 0.0 else ry)  # one that is not given is as the other
    _not_negative("radius", min(rx, ry) if tag == "circle" or "rx" in given or "ry" in given else 0.0)
    if rx <= 0.0 or ry <= 0.0:
        return []
    center = complex(value("cx", "x"), value("cy", "y"))
    right, left = center + rx, center - rx
    halves = [svg_paths.elliptical(a, b, rx, ry, 0.0, False, True) for a, b in ((right, left), (left, right))]
    return [Subpath([_joined([piece for piece in halves if piece is not None])])]


def _rectangle(given: Mapping[str, str], value: Callable[..., float]) -> list[Subpath]:
    width, height = value("width", "x"), value("height", "y")
    _not_negative("width", width)
    _not_negative("height", height)
    if width == 0.0 or height == 0.0:
        return []
    x, y = value("x", "x"), value("y", "y")
    rx, ry = value("rx", "x", -1.0), value("ry", "y", -1.0)
    rx, ry = (ry if rx < 0.0 else rx), (rx if ry < 0.0 else ry)
    rx, ry = min(max(rx, 0.0), 0.5 * width), min(max(ry, 0.0), 0.5 * height)
    rx, ry = (rx, ry) if rx > 0.0 and ry > 0.0 else (0.0, 0.0)
    low, high = complex(x, y), complex(x + width, y + height)
    corners = [
        (complex(high.real - rx, low.imag), complex(high.real, low.imag + ry)),
        (complex(high.real, high.imag - ry), complex(high.real - rx, high.imag)),
        (complex(low.real + rx, high.imag), complex(low.real, high.imag - ry)),
        (complex(low.real, low.imag + ry), complex(low.real + rx, low.imag)),
    ]
    here = start = complex(low.real + rx, low.imag)
    pieces = []
    for before, after in corners:
        if here != before:
            pieces.append(Piece([here, before]))
        corner = svg_paths.elliptical(before, after, rx, ry, 0.0, False, True)
        if corner is not None:
            pieces.append(corner)
        here = after
    if here != start:
        pieces.append(Piece([here, start]))
    return [Subpath(pieces)]


def _not_negative(name: str, value: float) -> None:
    if value < 0.0:
        raise ShapeError(f"{name} is {value:g}; expected 0 or more")


def _joined(halves: list[Piece]) -> Piece:
    """Two arcs of half a turn as one piece of four spans."""
    first, second = halves
    full = arc(np.zeros(2), np.array([1.0, 0.0]), np.array([0.0, 1.0]), 0.0, 2.0 * math.pi)
    return Piece([*first.points, *second.points[1:]], full.weights, full.knots)
