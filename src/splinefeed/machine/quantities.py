"""Quantities of machine files: forces, inertias, gains and the rest, each with its unit, for linear and rotary axes."""

from __future__ import annotations

import math

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
#: Kinds of which one hertz is 2 pi.
_ANGULAR = ("frequency", "position loop gain")


def parse(text: object, kind: str, rotary: bool) -> float:
    """The value of `text`, a number and its unit, in the base unit of `kind` for linear or rotary motion.

    Frequencies come back in rad/s. Raises UnitError for any other quantity, and for a bare number: a machine
    file says its units.
    """
    value = read(text, KINDS[kind][rotary], None)
    return value * 2.0 * math.pi if kind in _ANGULAR and "hz" in str(text).lower() else value


def show(value: float, kind: str, rotary: bool) -> str:
    """`value`, in the base unit of its kind, for people; frequencies in Hz, rotary positions in degrees."""
    if kind == "frequency":
        return f"{value / (2.0 * math.pi):.6g} Hz"
    if kind == "time":
        return f"{value * 1e3:.6g} ms"
    if rotary and kind in TURNING:
        return f"{math.degrees(value):.6g} {unit_shown(kind, rotary)}"
    if kind == "position":
        return f"{value * 1e3:.6g} um" if abs(value) < 0.1 else f"{value:.6g} mm"
    if kind == "lead":
        return f"{value * 2.0 * math.pi:.6g} mm/rev"
    if kind == "speed" and rotary:
        return f"{value * 30.0 / math.pi:.6g} rpm"
    return f"{value:.6g} {KINDS[kind][rotary].base}"


def unit_shown(kind: str, rotary: bool) -> str:
    """The unit in which `shown` gives a quantity of that kind: its base unit, but Hz, and degrees where it turns."""
    base = "Hz" if kind == "frequency" else KINDS[kind][rotary].base
    return base.replace("rad", "deg") if rotary and kind in TURNING else base


def shown(value: float, kind: str, rotary: bool) -> float:
    """`value`, in the base unit of its kind, in the unit that `unit_shown` names."""
    if kind == "frequency":
        return value / (2.0 * math.pi)
    return math.degrees(value) if rotary and kind in TURNING else value


def as_quantity(value: object, kind: str | None, rotary: bool) -> object:
    """`value` for programs: a quantity as its value and unit, anything else as it is."""
    if kind not in KINDS or not isinstance(value, int | float):
        return value
    return {"value": shown(value, kind, rotary), "unit": unit_shown(kind, rotary)}


def written(value: object, kind: str | None, rotary: bool) -> object:
    """`value` for a machine file: a quantity with its unit, anything else as it is."""
    return write(value, kind, rotary) if kind in KINDS and isinstance(value, int | float) else value


#: Units beside the base unit in which a person would rather read a quantity.
_READABLE = {
    "time": (("ms",), ("ms",)),
    "frequency": (("Hz",), ("Hz",)),
    "lead": (("mm/rev",), ("mm/rev",)),
    "position": (("um",), ("deg",)),
    "speed": ((), ("rpm",)),
    "velocity": ((), ("deg/s",)),
    "acceleration": ((), ("deg/s^2",)),
    "jerk": ((), ("deg/s^3",)),
}


def write(value: float, kind: str, rotary: bool) -> str:
    """The shortest text that `parse` reads as exactly `value`, in the base unit of `kind` or one that reads better."""
    texts = [f"{_digits(value)}{KINDS[kind][rotary].base.removeprefix('1')}"]
    for unit in _READABLE.get(kind, ((), ()))[rotary]:
        guess = value / parse(f"1{unit}", kind, rotary)
        texts += [text for digits in (6, 12, 17) if parse(text := f"{guess:.{digits}g}{unit}", kind, rotary) == value]
    return min(texts, key=len)


def _digits(value: float) -> str:
    """The shortest decimal that is exactly this float, without a trailing .0."""
    text = repr(float(value))
    return text.removesuffix(".0")
