"""Quantities as people write them (`3600mm/min`, `1ms`, `0.5in`) to and from the base units mm, s and rad."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from splinefeed.errors import UnitError

if TYPE_CHECKING:
    import pint


@dataclass(frozen=True)
class Kind:
    """What a quantity is: its name with an article, its base unit, and how a user may write one."""

    title: str
    base: str
    example: str


#: Every kind that `parse` and `format_quantity` know, by name.
KINDS = {
    "length": Kind("a length", "mm", "12.5mm or 0.5in"),
    "time": Kind("a time", "s", "1ms or 0.001s"),
    "feed": Kind("a feed", "mm/s", "60mm/s or 3600mm/min"),
    "acceleration": Kind("an acceleration", "mm/s^2", "50mm/s^2 or 0.05m/s^2"),
    "jerk": Kind("a jerk", "mm/s^3", "2000mm/s^3 or 2m/s^3"),
    "angle": Kind("an angle", "rad", "15deg or 0.26rad"),
    "frequency": Kind("a frequency", "hz", "256khz or 256000hz"),
}

#: The units a user may write, in Pint's words; small letters, since case says nothing here (MM/MIN is mm/min).
_DEFINITIONS = """
mm = [length]
nm = 1e-6 * mm
um = 1e-3 * mm
cm = 10 * mm
m = 1000 * mm
in = 25.4 * mm = _ = inch = inches
thou = 0.0254 * mm = _ = mil
ft = 304.8 * mm = _ = foot = feet
s = [time] = _ = sec = second = seconds
us = 1e-6 * s
ms = 1e-3 * s
min = 60 * s = _ = minute = minutes
h = 3600 * s = _ = hour = hours
hz = 1 / s
khz = 1000 / s
ipm = 25.4 * mm / min
g = 9806.65 * mm / s ** 2
rad = [angle]
deg = 0.017453292519943295 * rad = _ = degree = degrees
rev = 6.283185307179586 * rad = _ = turn = turns
"""

#: Longer texts than this are no quantity that a person would write.
_LONGEST_TEXT = 64

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?"
_FACTOR = r"[a-z]+(?:\^-?[1-9])?"
_QUANTITY = re.compile(rf"({_NUMBER})\s*({_FACTOR}(?:\s*[*/\s]\s*{_FACTOR})*)?")
_SIGNS = str.maketrans({"µ": "u", "μ": "u", "²": "^2", "³": "^3", "°": "deg", '"': "in", "·": "*"})


def parse(quantity: str | float, kind: str) -> float:
    """The value of `quantity` in the base unit of its `kind` (see KINDS); a bare number is in that unit already.

    Raises UnitError for text that is no number, for an unknown unit or one of another kind, and for what is not finite.
    """
    wanted = _kind(kind)
    if not isinstance(quantity, str):
        return _finite(_as_float(quantity, wanted), quantity, wanted)
    if len(quantity) > _LONGEST_TEXT:
        raise _refusal(quantity, f"has {len(quantity)} characters", wanted)
    text = quantity.strip().lower().translate(_SIGNS).replace("**", "^")
    text = re.sub(r"([a-df-z])([0-9])", r"\1^\2", text)  # m/s2 is m/s^2; an e may belong to the number
    match = _QUANTITY.fullmatch(text)
    if match is None:
        hint = "uses a comma; write a decimal point" if re.fullmatch(r"[+-]?[0-9]+,[0-9].*", text) else "cannot be read"
        raise _refusal(quantity, hint, wanted)
    number, unit = float(match[1]), match[2]
    if unit is not None:
        number *= _factor(unit, quantity, number, wanted)
    return _finite(number, quantity, wanted)


def format_quantity(value: float, kind: str) -> str:
    """`value`, in the base unit of its `kind`, for people: six digits, short times in ms or us, angles in degrees."""
    unit = _kind(kind).base
    if kind == "angle":
        value, unit = math.degrees(value), "deg"
    elif kind == "time" and 0.0 < abs(value) < 1.0:
        value, unit = (value * 1e3, "ms") if abs(value) >= 1e-3 else (value * 1e6, "us")
    elif kind == "frequency":
        value, unit = (value * 1e-3, "kHz") if abs(value) >= 1e3 else (value, "Hz")
    return f"{value:.6g} {unit}"


def _kind(name: str) -> Kind:
    try:
        return KINDS[name]
    except KeyError:
        raise UnitError(f"no kind of quantity is called {name!r}; there are {', '.join(KINDS)}") from None


def _as_float(value: Any, wanted: Kind) -> float:
    if isinstance(value, bool):
        raise _refusal(value, "is no number", wanted)
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise _refusal(value, "is no number", wanted) from None


def _finite(value: float, quantity: object, wanted: Kind) -> float:
    if not math.isfinite(value):
        raise _refusal(quantity, "is not finite", wanted)
    return value


def _factor(unit: str, quantity: str, number: float, wanted: Kind) -> float:
    """What one `unit` is in the base unit of the wanted kind."""
    import pint

    registry = _registry()
    try:
        given = registry.Quantity(1.0, registry.parse_units(unit))
        if not given.is_compatible_with(wanted.base):
            raise _refusal(quantity, _other_kind(given, number), wanted)
        return float(given.m_as(wanted.base))
    except pint.UndefinedUnitError as error:
        names = error.unit_names if isinstance(error.unit_names, str) else ", ".join(error.unit_names)
        raise _refusal(quantity, f"has an unknown unit: {names}", wanted) from None


def _other_kind(given: pint.Quantity[float], number: float) -> str:
    """Say what a quantity of the wrong kind is, and, for a frequency, the period that was probably meant."""
    frequency = number * given.m_as("hz") if given.is_compatible_with("hz") else 0.0
    if 0.0 < frequency < math.inf:
        return f"is a frequency; its period is {format_quantity(1.0 / frequency, 'time')}"
    for kind in KINDS.values():
        if given.is_compatible_with(kind.base):
            return f"is {kind.title}"
    return "is of no kind that is known here"


def _refusal(quantity: object, what: str, wanted: Kind) -> UnitError:
    shown = repr(quantity)
    if len(shown) > _LONGEST_TEXT:
        shown = f"{shown[: _LONGEST_TEXT // 2]}..."
    return UnitError(f"{shown} {what}; expected {wanted.title} such as {wanted.example}")


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[float]:
    """Pint with the units above alone: made in 4 ms, where its full list takes a tenth of a second."""
    import pint

    registry: pint.UnitRegistry[float] = pint.UnitRegistry(None)
    registry.load_definitions(_DEFINITIONS.strip().splitlines())
    return registry
