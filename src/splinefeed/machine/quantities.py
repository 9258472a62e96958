"""Quantities of machine files: forces, inertias, gains and the rest, each with its unit, for linear and rotary axes."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from splinefeed.errors import UnitError

#: Powers of mass, length, time, angle and voltage.
Dimensions = tuple[int, int, int, int, int]

#: Each unit that a machine file may use: its size in kg, mm, s, rad and V, and the powers of these.
UNITS: dict[str, tuple[float, Dimensions]] = {
    "kg": (1.0, (1, 0, 0, 0, 0)),
    "g": (1e-3, (1, 0, 0, 0, 0)),
    "nm": (1e-6, (0, 1, 0, 0, 0)),
    "um": (1e-3, (0, 1, 0, 0, 0)),
    "mm": (1.0, (0, 1, 0, 0, 0)),
    "cm": (10.0, (0, 1, 0, 0, 0)),
    "m": (1000.0, (0, 1, 0, 0, 0)),
    "in": (25.4, (0, 1, 0, 0, 0)),
    "us": (1e-6, (0, 0, 1, 0, 0)),
    "ms": (1e-3, (0, 0, 1, 0, 0)),
    "s": (1.0, (0, 0, 1, 0, 0)),
    "min": (60.0, (0, 0, 1, 0, 0)),
    "Hz": (2.0 * math.pi, (0, 0, -1, 0, 0)),
    "kHz": (2000.0 * math.pi, (0, 0, -1, 0, 0)),
    "rad": (1.0, (0, 0, 0, 1, 0)),
    "mrad": (1e-3, (0, 0, 0, 1, 0)),
    "deg": (math.pi / 180.0, (0, 0, 0, 1, 0)),
    "arcmin": (math.pi / 10800.0, (0, 0, 0, 1, 0)),
    "arcsec": (math.pi / 648000.0, (0, 0, 0, 1, 0)),
    "rev": (2.0 * math.pi, (0, 0, 0, 1, 0)),
    "rpm": (math.pi / 30.0, (0, 0, -1, 1, 0)),
    "N": (1000.0, (1, 1, -2, 0, 0)),
    "kN": (1e6, (1, 1, -2, 0, 0)),
    "Nm": (1e6, (1, 2, -2, 0, 0)),
    "V": (1.0, (0, 0, 0, 0, 1)),
    "mV": (1e-3, (0, 0, 0, 0, 1)),
}


@dataclass(frozen=True)
class Kind:
    """What a quantity is: its name with an article, and base unit and example for linear and for rotary motion."""

    title: str
    bases: tuple[str, str]
    examples: tuple[str, str]


#: Every kind of quantity in a machine file. A kind that is the same for both sorts of motion says it twice.
KINDS = {
    "position": Kind("a position", ("mm", "rad"), ("0.01mm", "0.01deg")),
    "speed": Kind("a speed", ("mm/s", "rad/s"), ("2mm/s", "3000rpm")),
    "velocity": Kind("a velocity", ("mm/s", "rad/s"), ("200mm/s", "360deg/s")),
    "acceleration": Kind("an acceleration", ("mm/s^2", "rad/s^2"), ("2000mm/s^2", "5000deg/s^2")),
    "jerk": Kind("a jerk", ("mm/s^3", "rad/s^3"), ("50000mm/s^3", "500000deg/s^3")),
    "force": Kind("a force or torque", ("N", "N*m"), ("20N", "1.27N*m")),
    "inertia": Kind("a mass or inertia", ("kg", "kg*m^2"), ("20kg", "0.00002kg*m^2")),
    "stiffness": Kind("a stiffness", ("N/mm", "N*m/rad"), ("50000N/mm", "1000N*m/rad")),
    "damping": Kind("a viscous damping", ("N*s/mm", "N*m*s/rad"), ("0.1N*s/mm", "0.01N*m*s/rad")),
    "lead": Kind("a lead", ("mm/rad", "mm/rad"), ("5mm/rev", "5mm/rev")),
    "speed per volt": Kind("a speed per volt", ("mm/s/V", "rad/s/V"), ("25mm/s/V", "6rad/s/V")),
    "force per volt": Kind("a force or torque per volt", ("N/V", "N*m/V"), ("50N/V", "0.4N*m/V")),
    "gain": Kind("a gain", ("V/mm", "V/rad"), ("20V/mm", "3V/rad")),
    "integral gain": Kind("an integral gain", ("V/mm/s", "V/rad/s"), ("200V/mm/s", "20V/rad/s")),
    "derivative gain": Kind("a derivative gain", ("V*s/mm", "V*s/rad"), ("0.2V*s/mm", "0.5V*s/rad")),
    "acceleration gain": Kind("an acceleration gain", ("V*s^2/mm", "V*s^2/rad"), ("0.001V*s^2/mm", "0.001V*s^2/rad")),
    "position loop gain": Kind("a position loop gain", ("1/s", "1/s"), ("30/s", "30/s")),
    "rotary inertia": Kind("a moment of inertia", ("kg*m^2", "kg*m^2"), ("0.00002kg*m^2", "0.00002kg*m^2")),
    "time": Kind("a time", ("s", "s"), ("1ms", "1ms")),
    "frequency": Kind("a frequency", ("1/s", "1/s"), ("60Hz", "60Hz")),
    "voltage": Kind("a voltage", ("V", "V"), ("10V", "10V")),
}

#: Kinds that are told in degrees of a rotary axis.
TURNING = ("position", "velocity", "acceleration", "jerk")

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.DOTALL)
_FACTOR = re.compile(r"([A-Za-z]+|1)(?:\^(-?[1-9]))?")
#: Longer texts than this are no quantity that a person would write.
_LONGEST_TEXT = 64


def parse(text: object, kind: str, rotary: bool) -> float:
    """The value of `text`, a number and its unit, in the base unit of `kind` for linear or rotary motion.

    Frequencies come back in rad/s. Raises UnitError for what is no such quantity, and for a bare number: a machine
    file says its units.
    """
    wanted = KINDS[kind]
    example = wanted.examples[rotary]
    ending = f"; expected {wanted.title} such as {example}"
    if isinstance(text, int | float) and not isinstance(text, bool):
        raise UnitError(f"{text!r} has no unit{ending}")
    if not isinstance(text, str) or len(text) > _LONGEST_TEXT:
        shown = repr(text) if len(repr(text)) <= _LONGEST_TEXT else repr(text)[: _LONGEST_TEXT // 2] + "..."
        raise UnitError(f"{shown} cannot be read{ending}")
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise UnitError(f"{text!r} cannot be read{ending}")
    if not match[2]:
        raise UnitError(f"{text!r} has no unit{ending}")
    size, dimensions = _unit(match[2], text, ending)
    base_size, base_dimensions = _unit(wanted.bases[rotary], text, ending)
    if dimensions != base_dimensions:
        raise UnitError(f"{text!r} is of another kind{ending}")
    value = float(match[1]) * (size / base_size)  # in the base unit itself exactly what is written
    if not math.isfinite(value):
        raise UnitError(f"{text!r} is not finite{ending}")
    return value


def _unit(unit: str, text: str, ending: str) -> tuple[float, Dimensions]:
    """Size and dimensions of a product of units such as `V*s^2/mm`; each unit behind a / divides."""
    size = 1.0
    powers = [0, 0, 0, 0, 0]
    sign = 1
    pieces = re.split(r"([*/])", unit.replace("·", "*").replace("²", "^2").replace("µ", "u"))
    if not pieces[0].strip():
        pieces[0] = "1"  # "30/s" begins with a division
    for piece in pieces:
        if piece in ("*", "/"):
            sign = 1 if piece == "*" else -1
            continue
        match = _FACTOR.fullmatch(piece.strip())
        if match is None:
            raise UnitError(f"{text!r} has a unit that cannot be read{ending}")
        if match[1] == "1":
            continue
        known = UNITS.get(match[1]) or {name.lower(): value for name, value in UNITS.items()}.get(match[1].lower())
        if known is None:
            raise UnitError(f"{text!r} has an unknown unit: {match[1]}{ending}")
        exponent = sign * int(match[2] or 1)
        size *= known[0] ** exponent
        powers = [power + exponent * own for power, own in zip(powers, known[1], strict=True)]
    return size, (powers[0], powers[1], powers[2], powers[3], powers[4])


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
    return f"{value:.6g} {KINDS[kind].bases[rotary]}"


def unit_shown(kind: str, rotary: bool) -> str:
    """The unit in which `shown` gives a quantity of that kind: its base unit, but Hz, and degrees where it turns."""
    base = "Hz" if kind == "frequency" else KINDS[kind].bases[rotary]
    return base.replace("rad", "deg") if rotary and kind in TURNING else base


def shown(value: float, kind: str, rotary: bool) -> float:
    """`value`, in the base unit of its kind, in the unit that `unit_shown` names."""
    if kind == "frequency":
        return value / (2.0 * math.pi)
    return math.degrees(value) if rotary and kind in TURNING else value


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
    bases = KINDS[kind].bases
    texts = [f"{_digits(value)}{bases[rotary].removeprefix('1') or '/s'}"]
    for unit in _READABLE.get(kind, ((), ()))[rotary]:
        guess = value / parse(f"1{unit}", kind, rotary)
        texts += [text for digits in (6, 12, 17) if parse(text := f"{guess:.{digits}g}{unit}", kind, rotary) == value]
    return min(texts, key=len)


def _digits(value: float) -> str:
    """The shortest decimal that is exactly this float, without a trailing .0."""
    text = repr(float(value))
    return text.removesuffix(".0")
