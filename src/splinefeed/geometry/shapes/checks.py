"""The checks of a shape's sizes."""

from __future__ import annotations

import math
from collections.abc import Sequence

from splinefeed.errors import InputError
from splinefeed.records import Array, check_finite, frozen_array

#: Largest size of a shape, mm: a thousand kilometres is not a workpiece.
MAX_SIZE = 1e9


def number(value: object, name: str, unit: str = " mm") -> float:
    """`value` as a finite float not beyond 1e9; InputError names it otherwise."""
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} is {value!r}; expected a number") from None
    if not math.isfinite(result):
        raise InputError(f"{name} is {result}; it must be finite")
    if abs(result) > MAX_SIZE:
        raise InputError(f"{name} is {result:g}{unit}; at most {MAX_SIZE:g}{unit} is possible")
    return result


def positive(value: object, name: str, unit: str = " mm") -> float:
    """`value` as a finite float above 0; InputError names it otherwise."""
    result = number(value, name, unit)
    if result <= 0.0:
        raise InputError(f"{name} is {result:g}{unit}; it must be greater than 0")
    return result


def point(value: Sequence[float], name: str, axes: int | None = None) -> Array:
    """`value` as coordinates (axes,), mm; InputError if they are of another number or not finite."""
    result = frozen_array(value, name, 1)
    check_finite(result, name)
    if axes is not None and len(result) != axes:
        raise InputError(f"{name} has {len(result)} coordinates; {axes} are needed")
    for coordinate in result:
        number(coordinate, name)
    return result
