"""A built-in shape from one line of text, such as `naca:0025?perimeter=33`."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from splinefeed.errors import InputError
from splinefeed.numbers import finite, whole
from splinefeed.paths.each_curve import DEFAULT_AXES
from splinefeed.paths.path import Path
from splinefeed.paths.shapes.airfoil import naca
from splinefeed.paths.shapes.curves import butterfly, circle, ellipse, figure_eight, helix, line
from splinefeed.records import ROTARY_AXES

#: Longer texts than this name no shape.
MAX_TEXT = 500
#: The option of every shape: a third axis theta that follows the tangent.
TANGENTIAL = "tangential"
_WORDS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


#: Every shape: what makes it, what it is, and an example.
_SHAPES: dict[str, tuple[Callable[..., Path], str, str]] = {
    "naca": (naca, "NACA 4-digit section; symmetric ones exact", "naca:0025?perimeter=33"),
    "butterfly": (butterfly, "the butterfly of the literature", "butterfly?scale=2"),
    "circle": (circle, "a full circle", "circle?radius=10"),
    "ellipse": (ellipse, "a full ellipse by its half axes", "ellipse?a=20&b=10&angle=30deg"),
    "figure-eight": (figure_eight, "a closed curve that crosses itself", "figure-eight?width=60"),
    "helix": (helix, "a helix about z", "helix?radius=10&pitch=5&turns=3"),
    "line": (line, "a straight line, 1 to 16 axes", "line?start=0,0&end=100,50"),
}
#: Kinds of the arguments of shapes; those that are not here are lengths.
_KINDS = {
    **dict.fromkeys(("center", "start", "end"), "point"),
    **dict.fromkeys(("scale", "turns"), "number"),
    "degree": "whole",
    "angle": "angle",
    TANGENTIAL: "word",
}


def names() -> tuple[str, ...]:
    """Names of the built-in shapes."""
    return tuple(_SHAPES)


def describe() -> tuple[tuple[str, str, str], ...]:
    """Name, description and an example of every shape."""
    return tuple((name, what, example) for name, (_, what, example) in _SHAPES.items())


def is_shape(text: str) -> bool:
    """Tell whether a text begins with the name of a built-in shape, as "circle" or "naca:0025?..." do.

    Parameters
    ----------
    text : str
        What a user typed.

    Returns
    -------
    bool
        Whether it does.
    """
    return isinstance(text, str) and _split(text)[0] in _SHAPES


def from_text(text: str) -> Path:
    """Make the path that a text such as "naca:0025?perimeter=33" means.

    Parameters
    ----------
    text : str
        A name, for naca a colon and its code, then options. Values may carry units ("circle?radius=0.5in"); bare
        numbers are mm, and rad for angles; points are x,y. Every shape has `tangential=true`, for a third axis theta
        that follows the tangent.

    Returns
    -------
    Path
        The shape.

    Raises
    ------
    InputError
        For an unknown shape or option, naming the known ones, and for a bad value.

    References
    ----------
    .. [1] docs/start.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.shapes.from_text("circle?radius=0.5in").bounding_box()[1]
    array([12.7, 12.7])
    """
    if not isinstance(text, str) or not text.strip():
        raise InputError(f"shape is {text!r}; expected a text such as {_SHAPES['naca'][2]!r}")
    if len(text) > MAX_TEXT:
        raise InputError(f"a shape's text has {len(text)} characters; at most {MAX_TEXT} are read")
    name, argument, query = _split(text)
    if name not in _SHAPES:
        raise InputError(f"{text}: there is no shape {name!r}; known are {', '.join(_SHAPES)}")
    make, _, example = _SHAPES[name]
    known = [*inspect.signature(make).parameters, TANGENTIAL]
    values: dict[str, Any] = {}
    if name == "naca":
        known.remove("code")
        values["code"] = argument
    if bool(argument) != (name == "naca"):
        wanted = "needs its code after a colon" if name == "naca" else "takes nothing after a colon"
        raise InputError(f"{text}: {name} {wanted}, as in {example!r}")
    for part in [] if query is None else query.split("&"):
        option, equals, value = (word.strip() for word in part.partition("="))
        if option not in known:
            raise InputError(f"{text}: {name} has no option {option!r}; known are {', '.join(known)}")
        if not equals or not value:
            raise InputError(f"{text}: {option} has no value; write {option}=...")
        if option in values:
            raise InputError(f"{text}: {option} appears twice; leave one of them out")
        try:
            values[option] = _value(value, _KINDS.get(option, "length"))
        except InputError as error:
            raise InputError(f"{text}: {option}: {error}") from None
    follow = values.pop(TANGENTIAL, False)
    path = make(**values)
    if follow:
        from splinefeed.paths.tangent_axis import tangential

        path = tangential(path)
    return path


def _split(text: str) -> tuple[str, str | None, str | None]:
    head, question, query = text.strip().partition("?")
    name, colon, argument = head.partition(":")
    return name.strip().lower().replace("_", "-"), argument.strip() if colon else None, query if question else None


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
            return whole(text) if kind == "whole" else finite(text)
        except InputError:
            raise InputError(f"{text[:40]!r} is not a {'whole number' if kind == 'whole' else 'number'}") from None
    return units.parse(text, kind)
