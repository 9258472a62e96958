"""Where elements of SVG lie: lengths, transforms and view boxes. Source: W3C, SVG 1.1, chapter 7; CSS Transforms 1."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from splinefeed.numbers import within

#: Pixels of one unit of a length: CSS fixes the pixel at 1/96 inch.
PIXELS = {"": 1.0, "px": 1.0, "in": 96.0, "cm": 96.0 / 2.54, "mm": 96.0 / 25.4, "q": 24.0 / 25.4, "pt": 4.0 / 3.0,
          "pc": 16.0}  # fmt: skip
_SIDES = {"left": "0%", "top": "0%", "center": "50%", "right": "100%", "bottom": "100%"}
#: Possessive, and no number begins inside a row of digits: the time is in proportion to the length of a text.
_DIGITS = r"(?>[+-]?(?:(?<![0-9])[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][+-]?[0-9]++)?)"
_QUANTITY = re.compile(rf"({_DIGITS})\s*+([a-zA-Z]*+|%)")
_NUMBER = re.compile(rf"(?:(?<!\s)\s++|(?!\s)),?\s*+({_DIGITS})(?=[\s,+.-]|$)")
_FUNCTION = re.compile(r"(?:(?<!\s)\s++|(?!\s)),?\s*+(?<![a-zA-Z])([a-zA-Z]++)\s*+\(([^()]*+)\)")


class ShapeError(ValueError):
    """An attribute that cannot be read; its text says which and why."""


class Affine(NamedTuple):
    """Map x' = a x + c y + e, y' = b x + d y + f."""

    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 1.0
    e: float = 0.0
    f: float = 0.0

    def after(self, inner: Affine) -> Affine:
        """Return the map of what `inner` maps to."""
        a, b, c, d, e, f = self
        p, q, r, s, t, u = inner
        return Affine(a * p + c * q, b * p + d * q, a * r + c * s, b * r + d * s, a * t + c * u + e, b * t + d * u + f)


class View(NamedTuple):
    """What percentages are of, in user units: the nearest page's or view box's size; None if unknown."""

    width: float | None = None
    height: float | None = None

    def whole(self, name: str) -> float | None:
        """Return what 100% is for the attribute `name`: along x, along y, or for the radius of a circle both."""
        if name == "r" and self.width is not None and self.height is not None:
            return math.sqrt(0.5 * (self.width**2 + self.height**2))
        return self.height if "y" in name or name == "height" else self.width


def quantity(text: str, name: str, whole: float | None = None) -> float:
    """Return a length in px, or in % of the `whole`; ShapeError with the `name` for anything else."""
    match = _QUANTITY.fullmatch(text.strip())
    unit = match[2].lower() if match else "?"
    factor = whole / 100.0 if unit == "%" and whole is not None else PIXELS.get(unit, math.nan)
    value = float(match[1]) * factor if match else math.nan
    if not within(value):
        raise ShapeError(f"{name} is {text.strip()[:40]!r}; expected a number in {', '.join(filter(None, PIXELS))}")
    return value


def length(given: Mapping[str, str], name: str, view: View, otherwise: float = 0.0) -> float:
    """Return the attribute `name` in user units."""
    text = given.get(name, "").strip()
    return quantity(text, name, view.whole(name)) if text not in ("", "auto") else otherwise


def _one_blank(text: str) -> str:
    """`text` with one blank for each row of them: a search may begin at every one."""
    return " ".join(text.split())


def numbers(text: str, name: str) -> list[float]:
    """Return numbers between blanks, commas, or what can only begin the next one; ShapeError for anything else."""
    text = _one_blank(text)
    values = [float(word) for word in _NUMBER.findall(text)]
    rest = _NUMBER.sub(" ", text).split()
    if rest or text.startswith(",") or not all(map(within, values)):
        raise ShapeError(f"{name}: {rest[0][:40] if rest else text[:40]!r} is not a number")
    return values


def _rotation(degrees: float, x: float = 0.0, y: float = 0.0) -> Affine:
    cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    if degrees % 90.0 == 0.0:
        cosine, sine = round(cosine), round(sine)
    return Affine(e=x, f=y).after(Affine(cosine, sine, -sine, cosine)).after(Affine(e=-x, f=-y))


#: Functions of a transform: how many numbers there may be, and the map.
_FUNCTIONS: dict[str, tuple[tuple[int, ...], Callable[..., Affine]]] = {
    "matrix": ((6,), Affine),
    "translate": ((1, 2), lambda x, y=0.0: Affine(e=x, f=y)),
    "scale": ((1, 2), lambda x, y=None: Affine(a=x, d=x if y is None else y)),
    "rotate": ((1, 3), _rotation),
    "skewX": ((1,), lambda x: Affine(c=math.tan(math.radians(x)))),
    "skewY": ((1,), lambda y: Affine(b=math.tan(math.radians(y)))),
}


def transform(given: Mapping[str, str], view: View) -> Affine:
    """Return the transform of an element about its origin; ShapeError for properties that move it in other words."""
    for name in ("translate", "rotate", "scale"):
        if given.get(name, "none").strip().lower() not in ("none", ""):
            raise ShapeError(f"the property {name} is not supported; write it as transform")
    text, whole = _one_blank(given.get("transform", "")), Affine()
    if text.strip().lower() in ("", "none"):
        return whole
    if given.get("transform-box", "view-box").strip().lower() != "view-box":
        raise ShapeError(f"transform-box is {given['transform-box'][:40]!r}; only view-box is supported")
    if rest := _FUNCTION.sub(" ", text).strip():
        raise ShapeError(f"transform: expected functions such as translate(1 2), got {rest[:40]!r}")
    for kind, inside in _FUNCTION.findall(text):
        values = numbers(inside, f"transform: {kind}")
        counts, make = _FUNCTIONS.get(kind, ((), Affine))
        if len(values) not in counts:
            raise ShapeError(f"transform: {kind}({inside[:40]}) is not a function of SVG with as many numbers")
        whole = whole.after(make(*values))
    if about := given.get("transform-origin", "").lower().split():
        about = [*about, "center"][:2]
        if about[0] in ("top", "bottom") or about[1] in ("left", "right"):
            about.reverse()
        words = [_SIDES.get(word, word) for word in about]
        x, y = (quantity(word, "transform-origin", of) for word, of in zip(words, view, strict=True))
        return Affine(e=x, f=y).after(whole).after(Affine(e=-x, f=-y))
    return whole


def viewport(given: Mapping[str, str], view: View) -> tuple[Affine, View, View]:
    """Return the map from user units in a page, an inner svg or a symbol to those around.

    Parameters
    ----------
    given : mapping of str to str
        Attributes of the element.
    view : View
        Around it.

    Returns
    -------
    map : Affine
        To user units around.
    inside : View
        What 100% is in it.
    size : View
        Its own size.
    """
    sizes: list[float | None] = []
    for name, around in (("width", view.width), ("height", view.height)):
        text = given.get(name, "").strip()
        text = "100%" if text in ("", "auto") else text
        relative = text.endswith("%") and around is None
        sizes.append(None if relative else quantity(text, name, around))
        if sizes[-1] is not None and sizes[-1] <= 0.0:
            raise ShapeError("its width or height is not above 0")
    width, height = sizes
    box = numbers(given.get("viewBox", ""), "viewBox")
    if not box:
        return Affine(), View(width, height), View(width, height)
    if len(box) != 4 or not (box[2] > 0.0 and box[3] > 0.0):
        raise ShapeError(f"viewBox is {given['viewBox'][:40]!r}; expected x, y, and a width and height above 0")
    # a size that is not given follows from the other, or is that of the view box
    if width is None:
        width = box[2] if height is None else height * box[2] / box[3]
    if height is None:
        height = width * box[3] / box[2]
    scale_x, scale_y = width / box[2], height / box[3]
    shift_x = shift_y = 0.0
    aspect = given.get("preserveAspectRatio", "").strip() or "xMidYMid"
    if aspect != "none":
        match = re.fullmatch(r"(?:defer\s+)?x(Min|Mid|Max)Y(Min|Mid|Max)(?:\s+(meet|slice))?", aspect)
        if match is None:
            raise ShapeError(f"preserveAspectRatio is {aspect[:40]!r}; expected such as xMidYMid meet, or none")
        shares = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}
        chosen = max(scale_x, scale_y) if match[3] == "slice" else min(scale_x, scale_y)
        shift_x, shift_y = shares[match[1]] * (width - chosen * box[2]), shares[match[2]] * (height - chosen * box[3])
        scale_x = scale_y = chosen
    inner = Affine(a=scale_x, d=scale_y, e=shift_x - scale_x * box[0], f=shift_y - scale_y * box[1])
    return inner, View(box[2], box[3]), View(width, height)
