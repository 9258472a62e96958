"""Formulas: values joined by operators, of which some bind more tightly than others, as the languages have them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import ClassVar

from splinefeed.numbers import within
from splinefeed.programs.gcode.faults import LineError

#: Most brackets, functions and signs within each other.
MAX_DEPTH = 40
#: What operators of arithmetic make of two values, and functions of one; angles are in degrees.
ARITHMETIC: dict[str, Callable[[float, float], float]] = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b,
}  # fmt: skip
FUNCTIONS: dict[str, Callable[[float], float]] = {
    "SIN": lambda v: math.sin(math.radians(v)), "COS": lambda v: math.cos(math.radians(v)),
    "TAN": lambda v: math.tan(math.radians(v)), "ASIN": lambda v: math.degrees(math.asin(v)),
    "ACOS": lambda v: math.degrees(math.acos(v)), "SQRT": math.sqrt, "ABS": abs, "LN": math.log, "EXP": math.exp,
}  # fmt: skip
#: What is said of two operators of rank 0 beside each other.
BESIDE = "comparisons beside each other: AND and OR bind tighter than they do; put each in brackets"
Operations = Mapping[str, tuple[int, Callable[[float, float], float]]]


class Formula:
    """A reader of formulas, from a place of a text on; a language says what a value is.

    Attributes
    ----------
    at : int
        The place reached.
    operations : mapping of str to tuple
        What each operator makes of two values, behind its rank: the higher, the tighter it binds. Those of one rank
        count from left to right; of those of rank 0 there is one between two brackets.
    operator, token : pattern
        The next operator, and the next token, as group 1.
    """

    operations: ClassVar[Operations]
    operator: ClassVar[re.Pattern[str]]
    token: ClassVar[re.Pattern[str]]

    def __init__(self, text: str, at: int = 0) -> None:
        self.text, self.at = text, at
        self._depth = 0

    def peek(self) -> str:
        """The next token, or the letter in its place, or nothing."""
        found = self.token.match(self.text, self.at)
        return found[1] if found else self.text[self.at :].strip()[:1]

    def take(self, wanted: str = "", reason: str = "") -> str:
        """Pass over the next token, which is `wanted` if that is said; LineError, with the reason, for another one."""
        found = self.token.match(self.text, self.at)
        if found is None or (wanted and found[1] != wanted):
            rest = self.text[self.at :].strip()[:20]
            where = f"before {rest!r}" if rest else "at the end of the line"
            raise LineError(reason or f"{wanted or 'a value'} is missing {where}")
        self.at = found.end()
        return found[1]

    def chain(self, least: int = 0) -> float:
        """Values joined by operators of at least the rank `least`."""
        left, before = self.value(), -1
        while (found := self.operator.match(self.text, self.at)) is not None:
            rank = self.operations[found[1]][0]
            if rank < least:
                break
            if rank == before == 0:
                raise LineError(BESIDE)
            self.at, before = found.end(), rank
            left = self.joined(found[1], left, self.chain(rank + 1))
        return left

    def joined(self, name: str, left: float, right: float) -> float:
        """What an operator makes of two values."""
        return computed(f"{{:g}} {name} {{:g}}", self.operations[name][1], left, right)

    def value(self) -> float:
        """A value without operators."""
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise LineError(f"more than {MAX_DEPTH} brackets within brackets")
        value = self._one()
        self._depth -= 1
        return value

    def _one(self) -> float:
        raise NotImplementedError


def computed(said: str, compute: Callable[..., float], *values: float) -> float:
    """Compute what a function makes of values.

    Parameters
    ----------
    said : str
        What computes, as a format of the values.
    compute : callable
        The function.
    *values : float
        Its arguments.

    Returns
    -------
    float
        Finite.

    Raises
    ------
    LineError
        Where that is no number, or too large a one.
    """
    try:
        value = float(compute(*values))
    except (ArithmeticError, ValueError):
        value = math.nan
    if not within(value):
        raise LineError(f"{said.format(*values)} {'has no value' if math.isnan(value) else 'is too large'}")
    return value
