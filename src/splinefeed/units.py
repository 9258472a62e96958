"""Quantities as people write them (`3600mm/min`, `1ms`, `20N/mm`) to and from the base units mm, s, rad, kg and V."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from splinefeed.errors import UnitError

#: Powers of length, time, angle, mass and voltage.
Dimensions = tuple[int, ...]


@dataclass(frozen=True)
class Kind:
    """What a quantity is.

    Parameters
    ----------
    title : str
        Its name with an article.
    base : str
        Its base unit.
    example : str
        How a user may write one.
    """

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
    "angular velocity": Kind("an angular velocity", "rad/s", "90deg/s or 15rpm"),
    "angular acceleration": Kind("an angular acceleration", "rad/s^2", "90deg/s^2"),
    "angular jerk": Kind("an angular jerk", "rad/s^3", "90deg/s^3"),
}

#: Units of length, time, angle, mass and voltage, and of what is made of them: powers of these, and the size of each.
_BY_DIMENSIONS: dict[Dimensions, dict[str, float]] = {
    (1, 0, 0, 0, 0): {
        **{"mm": 1.0, "nm": 1e-6, "um": 1e-3, "cm": 10.0, "m": 1000.0},
        **{"in": 25.4, "thou": 0.0254, "ft": 304.8},
    },
    (0, 1, 0, 0, 0): {"s": 1.0, "us": 1e-6, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    (0, -1, 0, 0, 0): {"hz": 1.0, "khz": 1000.0},
    (1, -1, 0, 0, 0): {"ipm": 25.4 / 60.0},
    (1, -2, 0, 0, 0): {"g": 9806.65},
    (0, 0, 1, 0, 0): {
        **{"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0, "rev": 2.0 * math.pi},
        **{"arcmin": math.pi / 10800.0, "arcsec": math.pi / 648000.0},
    },
    (0, -1, 1, 0, 0): {"rpm": math.pi / 30.0},
    (0, 0, 0, 1, 0): {"kg": 1.0},
    (1, -2, 0, 1, 0): {"n": 1000.0, "kn": 1e6},
    (0, 0, 0, 0, 1): {"v": 1.0, "mv": 1e-3},
}
#: The units a user may write, in small letters, since case says nothing here (MM/MIN is mm/min).
UNITS = {name: (size, powers) for powers, sizes in _BY_DIMENSIONS.items() for name, size in sizes.items()}
#: What two of them mean where the quantity wanted says so: a gram where a mass is wanted, N*m where a torque is.
OTHERWISE: dict[str, tuple[float, Dimensions]] = {"g": (1e-3, (0, 0, 0, 1, 0)), "nm": (1e6, (2, -2, 0, 1, 0))}
#: Other words for them.
WORDS = {
    **{"inch": "in", "inches": "in", "mil": "thou", "foot": "ft", "feet": "ft", "degree": "deg", "degrees": "deg"},
    **{"sec": "s", "second": "s", "seconds": "s", "minute": "min", "minutes": "min", "hour": "h", "hours": "h"},
    **{"turn": "rev", "turns": "rev"},
}

#: Longer texts than this are no quantity that a person would write.
_LONGEST_TEXT = 64

_NUMBER = r"[+-]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:e[+-]?[0-9]++)?"
_FACTOR = r"[a-z]++(?:\^-?[1-9])?"
_TERM = re.compile(r"([*/]?)(?<!\s)\s*+([a-z]++)(?:\^(-?[1-9]))?")
_QUANTITY = re.compile(rf"({_NUMBER})\s*+((?:1?\s*+/\s*+)?{_FACTOR}(?:(?:\s*+[*/]\s*+|\s++){_FACTOR})*)?")
_SIGNS = str.maketrans({"µ": "u", "μ": "u", "²": "^2", "³": "^3", "°": "deg", '"': "in", "·": "*"})


def parse(quantity: str | float, kind: str, bare: str | None = None) -> float:
    """Convert a quantity to the base unit of its kind.

    Parameters
    ----------
    quantity : str or float
        Such as "3600mm/min", or a bare number.
    kind : str
        A name of KINDS.
    bare : str, optional
        Unit of a bare number, the base unit by default.

    Returns
    -------
    float
        In the base unit: mm, s or rad, and what is made of them.

    Raises
    ------
    UnitError
        For text that is not a finite number, and for an unknown unit or one of another kind.

    Examples
    --------
    >>> from splinefeed import units
    >>> units.parse("3600mm/min", "feed"), units.parse(0.5, "length", "in")
    (60.0, 12.7)
    """
    return read(quantity, KINDS[kind], bare or KINDS[kind].base)


def read(quantity: object, wanted: Kind, bare: str | None) -> float:
    """Convert a quantity to the base unit of a kind that may have no name.

    Parameters
    ----------
    quantity : object
        Text, or a number.
    wanted : Kind
        What it must be.
    bare : str or None
        Unit of a bare number; None refuses it.

    Returns
    -------
    float
        In the base unit of `wanted`.

    Raises
    ------
    UnitError
        As `parse` raises it, and for a bare number that is refused.
    """
    try:
        return _value(quantity, wanted, bare)
    except _QuantityError as why:
        shown = repr(quantity)
        if len(shown) > _LONGEST_TEXT:
            shown = f"{shown[: _LONGEST_TEXT // 2]}..."
        raise UnitError(f"{shown} {why}; expected {wanted.title} such as {wanted.example}") from None


class _QuantityError(Exception):
    """Why a quantity is none."""


def _value(quantity: Any, wanted: Kind, bare: str | None) -> float:
    unit = bare
    if isinstance(quantity, str):
        if len(quantity) > _LONGEST_TEXT:
            raise _QuantityError(f"has {len(quantity)} characters")
        text = quantity.strip().lower().translate(_SIGNS).replace("**", "^")
        text = re.sub(r"([a-df-z])([0-9])", r"\1^\2", text)  # m/s2 is m/s^2; an e may belong to the number
        match = _QUANTITY.fullmatch(text)
        if match is None:
            comma = re.fullmatch(r"[+-]?[0-9]+,[0-9].*", text)
            raise _QuantityError("uses a comma; write a decimal point" if comma else "cannot be read")
        number, unit = float(match[1]), match[2] or bare
    else:
        try:
            number = float("no" if isinstance(quantity, bool) else quantity)
        except (TypeError, ValueError, OverflowError):
            raise _QuantityError("is not a number") from None
    if unit is None:
        raise _QuantityError("has no unit")
    number *= _factor(unit, wanted)
    if not math.isfinite(number):
        raise _QuantityError("is not finite")
    return number


def format_quantity(value: float, kind: str) -> str:
    """Write a value for people: six digits, short times in ms or us.

    Parameters
    ----------
    value : float
        In the base unit of its kind.
    kind : str
        A name of KINDS.

    Returns
    -------
    str
        With its unit.

    Examples
    --------
    >>> from splinefeed import units
    >>> units.format_quantity(1e-3, "time"), units.format_quantity(60.0, "feed")
    ('1 ms', '60 mm/s')
    """
    unit = KINDS[kind].base
    if kind == "time" and 0.0 < abs(value) < 1.0:
        value, unit = (value * 1e3, "ms") if abs(value) >= 1e-3 else (value * 1e6, "us")
    elif kind == "frequency":
        value, unit = (value * 1e-3, "kHz") if abs(value) >= 1e3 else (value, "Hz")
    return f"{value:.6g} {unit}"


def _factor(unit: str, wanted: Kind) -> float:
    """What one `unit` is in the base unit of the wanted kind."""
    base, dimensions = _size(wanted.base)
    for units in (UNITS, UNITS | OTHERWISE):
        factor, given = _size(unit, units)
        if given == dimensions:
            return factor / base
    given = _size(unit)[1]
    title = next((kind.title for kind in KINDS.values() if given == _size(kind.base)[1]), "of another kind")
    raise _QuantityError(f"is {title}")


def _size(unit: str, units: Mapping[str, tuple[float, Dimensions]] = UNITS) -> tuple[float, Dimensions]:
    """Size and dimensions of a product of units such as mm/s^2: from left to right, a blank between two multiplies."""
    factor = 1.0
    powers: Dimensions = (0, 0, 0, 0, 0)
    for sign, name, power in _TERM.findall(unit.lower()):
        one = units.get(WORDS.get(name, name))
        if one is None:
            raise _QuantityError(f"has an unknown unit: {name}")
        times = int(power or 1) * (-1 if sign == "/" else 1)
        factor *= one[0] ** times
        powers = tuple(so_far + times * each for so_far, each in zip(powers, one[1], strict=True))
    return factor, powers
