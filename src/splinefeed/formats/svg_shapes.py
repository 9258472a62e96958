"""Lengths, transforms, view boxes and basic shapes of SVG. Source: W3C, SVG 1.1, chapters 7 and 9."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from splinefeed.formats import svg_paths
from splinefeed.formats.svg_paths import Piece, Subpath
from splinefeed.geometry.arcs import arc

#: CSS fixes the pixel at 1/96 inch.
PIXELS = {"": 1.0, "px": 1.0, "in": 96.0, "cm": 96.0 / 2.54, "mm": 96.0 / 25.4, "q": 24.0 / 25.4, "pt": 4.0 / 3.0,
          "pc": 16.0}  # fmt: skip
_LENGTH = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([a-zA-Z]*|%)\s*")
_FUNCTION = re.compile(r"\s*,?\s*([a-zA-Z]+)\s*\(([^()]*)\)")
_SPLIT = re.compile(r"\s*,\s*|\s+")
_COUNTS = {"matrix": (6,), "translate": (1, 2), "scale": (1, 2), "rotate": (1, 3), "skewX": (1,), "skewY": (1,)}


class ShapeError(ValueError):
    """An attribute that cannot be read; its text says which and why."""


class Affine(NamedTuple):
    """x' = a x + c y + e, y' = b x + d y + f."""

    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 1.0
    e: float = 0.0
    f: float = 0.0

    def after(self, inner: Affine) -> Affine:
        """This map of what `inner` maps to."""
        a, b, c, d, e, f = self
        p, q, r, s, t, u = inner
        return Affine(a * p + c * q, b * p + d * q, a * r + c * s, b * r + d * s, a * t + c * u + e, b * t + d * u + f)


class Viewport(NamedTuple):
    """Width and height, in user units, of the nearest view box or page: what percentages are of; None if unknown."""

    width: float | None
    height: float | None

    def share(self, of: str) -> float | None:
        """What 100% is along "x", along "y", or for what has no direction ("o")."""
        if of == "x":
            return self.width
        if of == "y":
            return self.height
        if self.width is None or self.height is None:
            return None
        return math.sqrt(0.5 * (self.width**2 + self.height**2))


def length(text: str, name: str, view: Viewport, of: str) -> float:
    """A length in user units; `name` and `of` (see `Viewport.share`) for messages and percentages."""
    match = _LENGTH.fullmatch(text)
    unit = match.group(2).lower() if match else ""
    if match is None or (unit != "%" and unit not in PIXELS):
        hint = "; units of the font's size are not known here" if unit in ("em", "ex", "rem", "ch") else ""
        raise ShapeError(f"{name} is {text.strip()[:40]!r}; expected a length{hint}")
    value = float(match.group(1))
    if unit == "%":
        whole = view.share(of)
        if whole is None:
            raise ShapeError(f"{name} is {text.strip()[:40]!r} of a page whose size is not given")
        value *= whole / 100.0
    else:
        value *= PIXELS[unit]
    if not math.isfinite(value):
        raise ShapeError(f"{name} is {text.strip()[:40]!r}; expected a finite length")
    return value


def numbers(text: str, name: str) -> list[float]:
    """Numbers between blanks or commas; ShapeError for anything else."""
    words = _SPLIT.split(text.strip()) if text.strip() else []
    values = []
    for word in words:
        match = _LENGTH.fullmatch(word)
        value = float(match.group(1)) if match and not match.group(2) else math.nan
        if not math.isfinite(value):
            raise ShapeError(f"{name}: {word[:40]!r} is no number")
        values.append(value)
    return values


def transform(text: str) -> Affine:
    """The value of a transform attribute."""
    whole = Affine()
    at = 0
    while text[at:].strip():
        match = _FUNCTION.match(text, at)
        if match is None:
            raise ShapeError(f"transform: expected a function such as translate(1 2) at {text[at:].strip()[:40]!r}")
        kind, values = match.group(1), numbers(match.group(2), f"transform: {match.group(1)[:20]}")
        if len(values) not in _COUNTS.get(kind, ()):
            raise ShapeError(f"transform: {match.group(0).strip()[:40]!r} is no function of SVG with as many numbers")
        whole = whole.after(_one(kind, values))
        at = match.end()
    return whole


def _one(kind: str, values: list[float]) -> Affine:
    if kind == "matrix":
        return Affine(*values)
    if kind == "translate":
        return Affine(e=values[0], f=values[1] if len(values) > 1 else 0.0)
    if kind == "scale":
        return Affine(a=values[0], d=values[-1])
    slope = math.tan(math.radians(values[0]))
    if kind == "skewX":
        return Affine(c=slope)
    if kind == "skewY":
        return Affine(b=slope)
    cosine, sine = math.cos(math.radians(values[0])), math.sin(math.radians(values[0]))
    if values[0] % 90.0 == 0.0:
        cosine, sine = round(cosine), round(sine)
    turn = Affine(cosine, sine, -sine, cosine)
    if len(values) == 1:
        return turn
    x, y = values[1:]
    return Affine(e=x, f=y).after(turn).after(Affine(e=-x, f=-y))


def fit_view_box(box: list[float], width: float, height: float, aspect: str) -> Affine:
    """From the coordinates of a view box (x, y, width, height) to those of the viewport that it fills."""
    scale_x, scale_y = width / box[2], height / box[3]
    words = aspect.split()
    words = words[1:] if words[:1] == ["defer"] else words
    align = words[0] if words else "xMidYMid"
    shift_x = shift_y = 0.0
    if align != "none":
        chosen = max(scale_x, scale_y) if words[1:] == ["slice"] else min(scale_x, scale_y)
        shares = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}
        if not re.fullmatch(r"x(Min|Mid|Max)Y(Min|Mid|Max)", align) or words[1:] not in ([], ["meet"], ["slice"]):
            raise ShapeError(f"preserveAspectRatio is {aspect[:40]!r}; expected such as xMidYMid meet, or none")
        shift_x = shares[align[1:4]] * (width - chosen * box[2])
        shift_y = shares[align[5:8]] * (height - chosen * box[3])
        scale_x = scale_y = chosen
    return Affine(a=scale_x, d=scale_y, e=shift_x - scale_x * box[0], f=shift_y - scale_y * box[1])


def subpaths(tag: str, given: dict[str, str], view: Viewport) -> list[Subpath]:
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


def _rectangle(given: dict[str, str], value: Callable[..., float]) -> list[Subpath]:
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
