"""A built-in shape from one line of text, such as `naca:0025?perimeter=33`."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from splinefeed.errors import InputError
from splinefeed.geometry.path import DEFAULT_AXES, Path
from splinefeed.geometry.shapes.airfoil import naca
from splinefeed.geometry.shapes.conics import circle, ellipse, figure_eight, line
from splinefeed.geometry.shapes.freeform import butterfly, helix
from splinefeed.records import ROTARY_AXES

#: Longer texts than this name no shape.
MAX_TEXT = 500
#: The option of every shape: a third axis theta that follows the tangent.
TANGENTIAL = "tangential"
_WORDS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


@dataclass(frozen=True)
class _Shape:
    """How a shape is made, what it is, an example, the kind of each option, and what stands behind its colon."""

    make: Callable[..., Path]
    what: str
    example: str
    options: Mapping[str, str]
    argument: str | None = None


def _line(
    start: Sequence[float] | None = None,
    end: Sequence[float] | None = None,
    length: float | None = None,
    angle: float = 0.0,
) -> Path:
    """A line by its ends, or in the plane by its start, length and angle; 100 mm along x if nothing is said."""
    if end is not None:
        if length is not None or angle:
            raise InputError("line: end is given, so that length and angle follow; leave them out")
        return line((0.0,) * len(end) if start is None else start, end)
    first = (0.0, 0.0) if start is None else start
    if len(first) != 2:
        raise InputError("line: a line by length and angle lies in the plane; give end= for other axes")
    run = 100.0 if length is None else length
    return line(first, (first[0] + run * math.cos(angle), first[1] + run * math.sin(angle)))


_SHAPES = {
    "naca": _Shape(
        naca,
        "NACA 4-digit section; symmetric ones exact",
        "naca:0025?perimeter=33",
        {"chord": "length", "perimeter": "length", "degree": "whole", "tolerance": "length"},
        argument="code",
    ),
    "butterfly": _Shape(butterfly, "the butterfly of the literature", "butterfly?scale=2", {"scale": "number"}),
    "circle": _Shape(circle, "a full circle", "circle?radius=10", {"radius": "length", "center": "point"}),
    "ellipse": _Shape(
        ellipse,
        "a full ellipse by its half axes",
        "ellipse?a=20&b=10&angle=30deg",
        {"a": "length", "b": "length", "angle": "angle", "center": "point"},
    ),
    "figure-eight": _Shape(
        figure_eight,
        "a closed curve that crosses itself",
        "figure-eight?width=60",
        {"width": "length", "height": "length", "center": "point"},
    ),
    "helix": _Shape(
        helix,
        "a helix about z",
        "helix?radius=10&pitch=5&turns=3",
        {"radius": "length", "pitch": "length", "turns": "number", "tolerance": "length", "degree": "whole"},
    ),
    "line": _Shape(
        _line,
        "a straight line, 1 to 9 axes",
        "line?start=0,0&end=100,50",
        {"start": "point", "end": "point", "length": "length", "angle": "angle"},
    ),
}


def names() -> tuple[str, ...]:
    """Names of the built-in shapes."""
    return tuple(_SHAPES)


def describe() -> tuple[tuple[str, str, str], ...]:
    """Name, description and an example of every shape."""
    return tuple((name, shape.what, shape.example) for name, shape in _SHAPES.items())


def is_shape(text: str) -> bool:
    """Whether `text` begins with the name of a built-in shape, as "circle" or "naca:0025?..." do."""
    return isinstance(text, str) and _split(text)[0] in _SHAPES


def from_text(text: str) -> Path:
    """The path that a text such as "naca:0025?perimeter=33" means: a name, for naca a colon and its code, then options.

    Values may carry units ("circle?radius=0.5in"); bare numbers are mm, and rad for angles; points are x,y. Every shape
    has `tangential=true`, for a third axis theta that follows the tangent.
    Raises InputError for an unknown shape or option, naming the nearest and the known ones, and for a bad value.
    """
    if not isinstance(text, str) or not text.strip():
        raise InputError(f"shape is {text!r}; expected a text such as {_SHAPES['naca'].example!r}")
    if len(text) > MAX_TEXT:
        raise InputError(f"a shape's text has {len(text)} characters; at most {MAX_TEXT} are read")
    name, argument, query = _split(text)
    if name not in _SHAPES:
        raise InputError(f"{text}: there is no shape {name!r}; {_nearest(name, _SHAPES)}")
    shape = _SHAPES[name]
    values: dict[str, Any] = {}
    if shape.argument is not None:
        if not argument:
            raise InputError(f"{text}: {name} needs its {shape.argument} after a colon, as in {shape.example!r}")
        values[shape.argument] = argument
    elif argument is not None:
        raise InputError(f"{text}: {name} takes nothing after a colon; write options as in {shape.example!r}")
    known = {**shape.options, TANGENTIAL: "word"}
    for part in [] if query is None else query.split("&"):
        option, equals, value = (word.strip() for word in part.partition("="))
        if option not in known:
            raise InputError(f"{text}: {name} has no option {option!r}; {_nearest(option, known)}")
        if not equals or not value:
            raise InputError(f"{text}: {option} has no value; write {option}=...")
        if option in values:
            raise InputError(f"{text}: {option} appears twice; leave one of them out")
        try:
            values[option] = _value(value, known[option])
        except InputError as error:
            raise InputError(f"{text}: {option}: {error}") from None
    follow = values.pop(TANGENTIAL, False)
    path = shape.make(**values)
    if follow:
        from splinefeed.geometry.tangential import tangential

        path = tangential(path)
    return path


def _split(text: str) -> tuple[str, str | None, str | None]:
    """Name, what stands behind its colon, and the options of a shape's text; None for what is not there."""
    head, question, query = text.strip().partition("?")
    name, colon, argument = head.partition(":")
    return name.strip().lower().replace("_", "-"), argument.strip() if colon else None, query if question else None


def _nearest(name: str, known: Mapping[str, object]) -> str:
    close = difflib.get_close_matches(name, list(known), n=1)
    return (f"did you mean {close[0]!r}? " if close else "") + f"known are {', '.join(known)}"


def _value(text: str, kind: str) -> Any:
    from splinefeed import units

    if kind == "word":
        if text.lower() not in _WORDS:
            raise InputError(f"{text!r} is neither true nor false")
        return _WORDS[text.lower()]
    if kind == "point":
        parts = text.split(",")
        if len(parts) > len(DEFAULT_AXES):
            raise InputError(f"{len(parts)} coordinates; at most {len(DEFAULT_AXES)} are possible")
        kinds = ["angle" if axis in ROTARY_AXES else "length" for axis in DEFAULT_AXES]
        return tuple(units.parse(part, of) for part, of in zip(parts, kinds, strict=False))
    if kind in ("number", "whole"):
        try:
            return int(text) if kind == "whole" else float(text)
        except ValueError:
            raise InputError(f"{text!r} is not a {'whole number' if kind == 'whole' else 'number'}") from None
    return units.parse(text, kind)
