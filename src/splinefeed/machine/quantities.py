"""Quantities of machine files: forces, inertias, gains and the rest, each with its unit, for linear and rotary axes."""

from __future__ import annotations

import math
from typing import Any

from splinefeed.units import Kind, read

#: Every kind of quantity in a machine file: of linear and of rotary motion.
KINDS = {
    name: (Kind(title, *linear), Kind(title, *rotary))
    for name, title, linear, rotary in (
        ("position", "a position", ("mm", "0.01mm"), ("rad", "0.01deg")),
        ("speed", "a speed", ("mm/s", "2mm/s"), ("rad/s", "3000rpm")),
        ("velocity", "a velocity", ("mm/s", "200mm/s"), ("rad/s", "360deg/s")),
        ("acceleration", "an acceleration", ("mm/s^2", "2000mm/s^2"), ("rad/s^2", "5000deg/s^2")),
        ("jerk", "a jerk", ("mm/s^3", "50000mm/s^3"), ("rad/s^3", "500000deg/s^3")),
        ("force", "a force or torque", ("N", "20N"), ("N*m", "1.27N*m")),
        ("inertia", "a mass or inertia", ("kg", "20kg"), ("kg*m^2", "0.00002kg*m^2")),
        ("stiffness", "a stiffness", ("N/mm", "50000N/mm"), ("N*m/rad", "1000N*m/rad")),
        ("damping", "a viscous damping", ("N*s/mm", "0.1N*s/mm"), ("N*m*s/rad", "0.01N*m*s/rad")),
        ("lead", "a lead", ("mm/rad", "5mm/rev"), ("mm/rad", "5mm/rev")),
        ("speed per volt", "a speed per volt", ("mm/s/V", "25mm/s/V"), ("rad/s/V", "6rad/s/V")),
        ("force per volt", "a force or torque per volt", ("N/V", "50N/V"), ("N*m/V", "0.4N*m/V")),
        ("gain", "a gain", ("V/mm", "20V/mm"), ("V/rad", "3V/rad")),
        ("integral gain", "an integral gain", ("V/mm/s", "200V/mm/s"), ("V/rad/s", "20V/rad/s")),
        ("derivative gain", "a derivative gain", ("V*s/mm", "0.2V*s/mm"), ("V*s/rad", "0.5V*s/rad")),
        ("acceleration gain", "an acceleration gain", ("V*s^2/mm", "0.001V*s^2/mm"), ("V*s^2/rad", "0.001V*s^2/rad")),
        ("position loop gain", "a position loop gain", ("1/s", "30/s"), ("1/s", "30/s")),
        ("rotary inertia", "a moment of inertia", ("kg*m^2", "0.00002kg*m^2"), ("kg*m^2", "0.00002kg*m^2")),
        ("time", "a time", ("s", "1ms"), ("s", "1ms")),
        ("frequency", "a frequency", ("1/s", "60Hz"), ("1/s", "60Hz")),
        ("voltage", "a voltage", ("V", "10V"), ("V", "10V")),
    )
}

#: Kinds that people read in degrees of a rotary axis.
TURNING = ("position", "velocity", "acceleration", "jerk")
#: Letters beyond which a quantity in base units is long, and units of shops that may be shorter then, by kind.
_LONG = 14
_SHOP = {
    "position": ("in",),
    "velocity": ("m/min", "mm/min", "in/min", "in/s"),
    "acceleration": ("in/s^2",),
    "jerk": ("in/s^3",),
}
#: Kinds of which one hertz is 2 pi.
_ANGULAR = ("frequency", "position loop gain")


def parse(text: object, kind: str, rotary: bool) -> float:
    """Read a quantity of a machine file.

    Parameters
    ----------
    text : object
        A number and its unit.
    kind : str
        A name in KINDS.
    rotary : bool
        Whether it is of rotary motion.

    Returns
    -------
    float
        In the base unit of its kind; frequencies in rad/s.

    Raises
    ------
    UnitError
        For any other quantity, and for a bare number: a machine file has its units.
    """
    value = read(text, KINDS[kind][rotary], None)
    return value * 2.0 * math.pi if kind in _ANGULAR and "hz" in str(text).lower() else value


def _readable(kind: str, rotary: bool) -> tuple[str, float]:
    """The unit in which people read a quantity of a kind, that of its example, and its size."""
    wanted = KINDS[kind][rotary]
    unit = "um" if kind == "position" and not rotary else wanted.example.lstrip("0123456789.")
    size = parse(f"1{unit}", kind, rotary)
    return (wanted.base, 1.0) if size == 1.0 else (unit, size)


def show(value: float, kind: str, rotary: bool) -> str:
    """Return `value`, in the base unit of its kind, as people read it."""
    unit, size = _readable(kind, rotary)
    if unit == "um" and abs(value) >= 0.1:
        unit, size = "mm", 1.0
    return f"{value / size:.6g} {unit}"


def as_quantity(value: object, kind: str | None, rotary: bool) -> object:
    """Return `value` for programs: a quantity as value and unit (base units, but Hz, and degrees), else as it is."""
    if kind not in KINDS or not isinstance(value, int | float):
        return value
    turns = rotary and kind in TURNING
    unit, size = _readable(kind, rotary) if turns or kind == "frequency" else (KINDS[kind][rotary].base, 1.0)
    return {"value": value / size, "unit": unit}


def write(value: Any, kind: str | None, rotary: bool) -> Any:
    """Return the shortest text that `parse` reads as exactly `value`, in the base unit or one that reads better.

    What is no quantity stays as it is.
    """
    if kind not in KINDS or not isinstance(value, int | float):
        return value
    texts = [f"{float(value)!r}".removesuffix(".0") + KINDS[kind][rotary].base.removeprefix("1")]
    shop = () if rotary else _SHOP.get(kind, ())
    for unit, size in (_readable(kind, rotary), *((each, parse(f"1{each}", kind, rotary)) for each in shop)):
        if size == 1.0 or (unit in shop and len(min(texts, key=len)) <= _LONG):
            continue
        guesses = (f"{value / size:.{digits}g}{unit}" for digits in (6, 12, 17))
        texts += [text for text in guesses if parse(text, kind, rotary) == value]
    return min(texts, key=len)
