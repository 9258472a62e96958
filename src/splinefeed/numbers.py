"""Text and values of strangers as numbers: finite, within bounds, in a time in proportion to the text."""

from __future__ import annotations

import re
from numbers import Real

from splinefeed.errors import InputError

#: Largest size of a number in a file or an option: cubes of it, and products of three, are still finite.
MOST = 1e100
#: Least size of a limit, a period or a tolerance, in its unit: what is divided by powers of it is still finite.
LEAST = 1e-30
#: Largest whole number: what an int64 holds.
MOST_WHOLE = 2**63 - 1
#: No whole number is written with more digits; Python converts thousands of them in quadratic time, or refuses.
_MOST_DIGITS = 40
_NUMBER = re.compile(r"[+-]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][+-]?[0-9]++)?")
_SHOWN = 40


def finite(given: object, name: str = "") -> float:
    """Read a text or a number as a float.

    Parameters
    ----------
    given : object
        Digits with a sign, a point and an exponent at most, blanks around them; or a number, but no truth value.
    name : str, optional
        What the message calls it.

    Returns
    -------
    float
        At most MOST in size.

    Raises
    ------
    InputError
        For anything else: it names the value and says what is expected.

    Examples
    --------
    >>> from splinefeed import numbers
    >>> numbers.finite(" -1.5e3 ")
    -1500.0
    """
    text = given.strip() if isinstance(given, str) else ""
    value = _real(text if _NUMBER.fullmatch(text) else None) if isinstance(given, str) else _real(given)
    if value is None:
        raise InputError(f"{_named(name, given)}; expected a number")
    if not within(value):  # NaN, too
        raise InputError(f"{_named(name, given)}; expected a number of at most {MOST:g} in size")
    return value


def whole(given: object, name: str = "", least: int = -MOST_WHOLE, most: int = MOST_WHOLE) -> int:
    """Read a text or a number as a whole number.

    Parameters
    ----------
    given : object
        Digits with a sign at most, blanks around them; or a whole number, but no truth value.
    name : str, optional
        What the message calls it.
    least, most : int, optional
        Its bounds.

    Returns
    -------
    int
        From `least` to `most`.

    Raises
    ------
    InputError
        For anything else: it names the value and says what is expected.
    """
    if isinstance(given, str):
        text = given.strip()
        digits = text.removeprefix("-").removeprefix("+")
        good = len(text) <= _MOST_DIGITS and len(digits) >= len(text) - 1 and digits.isascii() and digits.isdigit()
        value = int(text) if good else None
    else:
        value = given if isinstance(given, int) and not isinstance(given, bool) else None
    if value is None or not least <= value <= most:
        raise InputError(f"{_named(name, given)}; expected a whole number from {least} to {most}")
    return value


def within(value: float) -> bool:
    """Tell whether a number is finite and of at most MOST.

    Parameters
    ----------
    value : float
        That was computed, or read where its digits were found.

    Returns
    -------
    bool
        False for NaN, too.
    """
    return -MOST <= value <= MOST


def _real(given: object) -> float | None:
    if isinstance(given, bool) or not isinstance(given, str | Real):
        return None
    try:
        return float(given)
    except OverflowError:  # a whole number of hundreds of digits
        return float("inf")


def _named(name: str, given: object) -> str:
    if isinstance(given, int) and abs(given) > MOST_WHOLE:  # Python does not turn thousands of digits into text
        shown = "a whole number of too many digits"
    else:
        shown = repr(given)
        shown = shown if len(shown) <= _SHOWN else f"{shown[: _SHOWN - 3]}..."
    return f"{name} is {shown}" if name else shown
