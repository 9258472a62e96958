"""Where elements of SVG lie: lengths, transforms and view boxes. Source: W3C, SVG 1.1, chapter 7; CSS Transforms 1."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import NamedTuple

#: CSS fixes the pixel at 1/96 inch.
PIXELS = {"": 1.0, "px": 1.0, "in": 96.0, "cm": 96.0 / 2.54, "mm": 96.0 / 25.4, "q": 24.0 / 25.4, "pt": 4.0 / 3.0,
          "pc": 16.0}  # fmt: skip
_LENGTH = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*([a-zA-Z]*|%)\s*")
_NUMBER = re.compile(r"\s*,?\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)(?=[\s,+.-]|$)")
_FUNCTION = re.compile(r"\s*,?\s*([a-zA-Z]+[a-zA-Z0-9]*)\s*\(([^()]*)\)")
_SPLIT = re.compile(r"\s*,\s*|\s+")
#: How many numbers each function of a transform takes; names as in CSS, where capitals mean nothing.
_COUNTS = {"matrix": (6,), "translate": (1, 2), "translatex": (1,), "translatey": (1,), "scale": (1, 2), "scalex": (1,),
           "scaley": (1,), "rotate": (1, 3), "skew": (1, 2), "skewx": (1,), "skewy": (1,)}  # fmt: skip
#: Degrees of one unit of an angle in CSS, and mm a pixel for lengths are in PIXELS; a bare number is degrees or px.
_ANGLES = {"": 1.0, "deg": 1.0, "grad": 0.9, "rad": 180.0 / math.pi, "turn": 360.0}
#: Size of letters unless the drawing says otherwise, px, by its name too, and heights of the letter x in it.
MEDIUM = 16.0
FONT_SIZES = {"xx-small": 0.5625, "x-small": 0.625, "small": 0.8125, "medium": 1.0, "large": 1.125, "x-large": 1.5,
              "xx-large": 2.0, "xxx-large": 3.0}  # fmt: skip
#: ex and ch are half an em where the font is not known, says CSS.
_LETTERS = {"em": 1.0, "ex": 0.5, "ch": 0.5}


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
    """Width and height, in user units, of the nearest view box or page: what percentages are of; None if unknown.

    font and root  sizes of letters here and in the root element, px: what em and rem are
    """

    width: float | None
    height: float | None
    font: float = MEDIUM
    root: float = MEDIUM

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
    if match is None or (unit not in ("%", "rem") and unit not in PIXELS and unit not in _LETTERS):
        raise ShapeError(f"{name} is {text.strip()[:40]!r}; expected a length")
    value = float(match.group(1))
    if unit == "%":
        whole = view.share(of)
        if whole is None:
            raise ShapeError(f"{name} is {text.strip()[:40]!r} of a page whose size is not given")
        value *= whole / 100.0
    elif unit == "rem":
        value *= view.root
    else:
        value *= _LETTERS[unit] * view.font if unit in _LETTERS else PIXELS[unit]
    if not math.isfinite(value):
        raise ShapeError(f"{name} is {text.strip()[:40]!r}; expected a finite length")
    return value


def numbers(text: str, name: str) -> list[float]:
    """Numbers between blanks, commas, or what can only begin the next one; ShapeError for anything else."""
    values, at = [], 0
    while text[at:].strip():
        match = _NUMBER.match(text, at)
        value = float(match[1]) if match else math.nan
        if match is None or not math.isfinite(value):
            raise ShapeError(f"{name}: {_SPLIT.split(text[at:].strip())[0][:40]!r} is not a number")
        values.append(value)
        at = match.end()
    return values


def font_size(text: str, view: Viewport) -> float:
    """The size of letters, px, that `font-size` or the shorthand `font` says, within letters of `view`."""
    for word in text.lower().replace("/", " ").split():
        if word in FONT_SIZES:
            return MEDIUM * FONT_SIZES[word]
        if word in ("smaller", "larger"):
            return view.font * (1.2 if word == "larger" else 1.0 / 1.2)
        if word[0] in "0123456789.+" and not (word.isdigit() and int(word) % 100 == 0 and len(text.split()) > 1):
            size = length(word, "font-size", view._replace(width=view.font), "x")
            if size >= 0.0:
                return size
    return view.font


def transform(text: str, view: Viewport = Viewport(None, None)) -> Affine:  # noqa: B008 - it cannot be changed
    """The value of a transform attribute or property; lengths in it may have units, angles too."""
    whole = Affine()
    at = 0
    if text.strip().lower() == "none":
        return whole
    while text[at:].strip():
        match = _FUNCTION.match(text, at)
        if match is None:
            raise ShapeError(f"transform: expected a function such as translate(1 2) at {text[at:].strip()[:40]!r}")
        kind, words = match.group(1).lower(), _SPLIT.split(match.group(2).strip())
        if len(words) not in _COUNTS.get(kind, ()) or not words[0]:
            raise ShapeError(f"transform: {match.group(0).strip()[:40]!r} is not an SVG function with as many numbers")
        whole = whole.after(_one(kind, [_argument(kind, k, word, view) for k, word in enumerate(words)]))
        at = match.end()
    return whole


def _argument(kind: str, k: int, word: str, view: Viewport) -> float:
    """Number k of a function of a transform: a length in px, an angle in degrees, or a plain number."""
    name = f"transform: {kind[:20]}"
    if kind.startswith("translate") or (kind == "rotate" and k):
        of = "y" if kind.endswith("y") or (k == 1 and kind == "translate") else "x"
        return length(word, name, view, of)
    match = _LENGTH.fullmatch(word)
    unit = match.group(2).lower() if match else "?"
    factors = _ANGLES if kind.startswith(("skew", "rotate")) else {"": 1.0}
    value = float(match.group(1)) * factors[unit] if match and unit in factors else math.nan
    if not math.isfinite(value):
        raise ShapeError(f"{name}: {word[:40]!r} is not a number")
    return value


def _one(kind: str, values: list[float]) -> Affine:
    if kind == "matrix":
        return Affine(*values)
    if kind.startswith("translate"):
        x, y = (0.0, values[0]) if kind.endswith("y") else (values[0], values[1] if len(values) > 1 else 0.0)
        return Affine(e=x, f=y)
    if kind.startswith("scale"):
        return Affine(a=1.0 if kind.endswith("y") else values[0], d=1.0 if kind.endswith("x") else values[-1])
    slope = math.tan(math.radians(values[0]))
    if kind in ("skew", "skewx"):
        return Affine(b=math.tan(math.radians(values[1])) if len(values) > 1 else 0.0, c=slope)
    if kind == "skewy":
        return Affine(b=slope)
    turn = _turn(values[0])
    if len(values) == 1:
        return turn
    x, y = values[1:]
    return Affine(e=x, f=y).after(turn).after(Affine(e=-x, f=-y))


def _turn(degrees: float) -> Affine:
    cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    if degrees % 90.0 == 0.0:
        cosine, sine = round(cosine), round(sine)
    return Affine(cosine, sine, -sine, cosine)


def origin(text: str, view: Viewport) -> Affine:
    """The shift to the place that `transform-origin` says, in the user units of `view`, whose corner is 0, 0."""
    words = text.lower().split()[:2]
    sides = {"left": "0%", "top": "0%", "center": "50%", "right": "100%", "bottom": "100%"}
    if len(words) == 1:
        words = ["center", words[0]] if words[0] in ("top", "bottom") else [words[0], "center"]
    elif words[0] in ("top", "bottom") or words[1] in ("left", "right"):
        words = words[::-1]
    x, y = (length(sides.get(word, word), "transform-origin", view, of) for word, of in zip(words, "xy", strict=True))
    return Affine(e=x, f=y)


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


def placing(given: Mapping[str, str], view: Viewport) -> Affine:
    """The transform of an element about its origin; ShapeError for properties that move it in other words."""
    for name in ("translate", "rotate", "scale"):
        if name in given and given[name].strip().lower() != "none":
            raise ShapeError(f"the property {name} is not supported; write it as transform")
    text = given.get("transform", "")
    if text.strip().lower() in ("", "none"):
        return Affine()
    if given.get("transform-box", "view-box").strip().lower() != "view-box":
        raise ShapeError(f"transform-box is {given['transform-box'][:40]!r}; only view-box is supported")
    inner = transform(text, view)
    about = given.get("transform-origin", "").strip()
    if not about:
        return inner
    place = origin(about, view)
    return place.after(inner).after(Affine(e=-place.e, f=-place.f))


def nested(given: Mapping[str, str], place: Affine, view: Viewport) -> tuple[Affine, Viewport]:
    """Where the contents of an inner svg or a symbol lie, from its x, y, width, height and view box."""
    x, y = (length(given.get(name) or "0", name, view, name) for name in ("x", "y"))
    sizes = ((name, given.get(name, "100%").strip(), of) for name, of in (("width", "x"), ("height", "y")))
    width, height = (
        None if text in ("100%", "auto") and view.share(of) is None
        else length("100%" if text == "auto" else text, name, view, of)
        for name, text, of in sizes
    )  # fmt: skip
    place = place.after(Affine(e=x, f=y))
    if any(size is not None and size <= 0.0 for size in (width, height)):
        raise ShapeError("its width or height is not above 0")
    box = view_box(given)
    if box is None:
        return place, view._replace(width=width, height=height)
    if width is None or height is None:
        raise ShapeError("its view box fills a page whose size is not given")
    aspect = given.get("preserveAspectRatio", "")
    place = place.after(fit_view_box(box, width, height, aspect))
    return place, view._replace(width=box[2], height=box[3])


def view_box(given: Mapping[str, str]) -> list[float] | None:
    """The attribute viewBox: x, y, width and height; None without one, ShapeError for what is none."""
    text = given.get("viewBox", "").strip()
    if not text:
        return None
    box = numbers(text, "viewBox")
    if len(box) != 4:
        raise ShapeError(f"viewBox has {len(box)} numbers; expected x, y, width and height")
    if not (box[2] > 0.0 and box[3] > 0.0):
        raise ShapeError(f"viewBox is {text[:40]!r}; its width and height must be above 0")
    return box
