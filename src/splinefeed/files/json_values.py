"""Objects of JSON files read strictly, by a description of their keys: every value is checked and refused by its place.

A description gives each key a check, `check(value, place)`, which returns the value or raises FormatError.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.files.sizes import MAX_AXES, MAX_CURVES, MAX_POINTS
from splinefeed.records import Array

Check: TypeAlias = Callable[[Any, str], Any]
_MANY_DIGITS = re.compile(r"[0-9]{1000}")
_MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}


def parse(text: str, source: object) -> Any:
    """Read JSON, refusing what Python's reader lets through: NaN, infinities, and a key said twice.

    Parameters
    ----------
    text : str
        Of the file.
    source : object
        What the message calls it.

    Returns
    -------
    object
        The value.

    Raises
    ------
    FormatError
        With the place.
    """

    def refuse_constant(token: str) -> None:
        raise FormatError(f"{source}: {token} is not a number that JSON has")

    def refuse_twice(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        unique = dict(pairs)
        if len(unique) < len(pairs):
            seen: set[str] = set()
            twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
            raise FormatError(f"{source}: key {shown(twice)} appears twice in one object; leave one of them out")
        return unique

    try:
        return json.loads(text, parse_constant=refuse_constant, object_pairs_hook=refuse_twice)
    except FormatError:
        raise
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise FormatError(f"{source}: {place}: {error.msg}; is the file complete, and is it JSON?") from None
    except RecursionError:
        raise FormatError(f"{source}: is nested too deeply to be a curve") from None
    except ValueError:  # Python does not turn thousands of digits into a whole number
        found = _MANY_DIGITS.search(text)
        place, digits = ("", "a number") if found is None else (_line_of(text, found), f"{found[0][:20]!r}...")
        raise FormatError(f"{source}: {place}{digits} is too large for a number") from None


def _line_of(text: str, found: re.Match[str]) -> str:
    return f"line {text.count(chr(10), 0, found.start()) + 1}: "


def fields(item: object, place: str, known: Mapping[str, Check], needed: Sequence[str] = ()) -> dict[str, Any]:
    """Check the values of an object.

    Parameters
    ----------
    item : object
        Of the file.
    place : str
        What the message calls it.
    known : mapping of str to callable
        Checks by key.
    needed : sequence of str, optional
        Keys that must be there.

    Returns
    -------
    dict of str to object
        What the checks give.

    Raises
    ------
    FormatError
        For a key that is not `known`, without one that is needed, and by the checks.
    """
    if not isinstance(item, dict):
        raise FormatError(f"{place}: is not an object with {', '.join(needed or known)}")
    for key in item:
        if key not in known:
            raise FormatError(f"{place}: key {shown(key)} is not known; known are {', '.join(sorted(known))}")
    for key in needed:
        if key not in item:
            raise FormatError(f"{place}: {key} is missing; needed are {', '.join(needed)}")
    return {key: known[key](value, f"{place}: {key}") for key, value in item.items()}


def listed(
    document: dict[str, Any], place: str, shared: Mapping[str, Check], item: Mapping[str, Check], needed: Sequence[str]
) -> tuple[dict[str, Any], list[tuple[str, dict[str, Any]]]]:
    """Check a document that is a curve, or has a list `curves`.

    Parameters
    ----------
    document : dict
        Of the file.
    place : str
        What the message calls it.
    shared, item : mapping of str to callable
        Checks by key: of what is said of all curves, and of each.
    needed : sequence of str
        Keys that each curve must have.

    Returns
    -------
    said : dict of str to object
        What the document says of all its curves.
    curves : list of tuple
        Place and values of each.

    Raises
    ------
    FormatError
        As of `fields`, and for no curves or more than MAX_CURVES.
    """
    if "curves" not in document:
        said = fields(document, place, {**item, **shared}, needed)
        return said, [(place, said)]
    curves = document["curves"]
    if not isinstance(curves, list) or not 0 < len(curves) <= MAX_CURVES:
        raise FormatError(f"{place}: curves: is not a list of 1 to {MAX_CURVES} curves")
    said = fields(document, place, {"curves": anything, **shared})
    places = [f"{place}: curves[{i}]" for i in range(len(curves))]
    return said, [(at, fields(curve, at, item, needed)) for at, curve in zip(places, curves, strict=True)]


def anything(value: Any, place: str) -> Any:
    """What people may write as they like."""
    return value


def _of(what: str, *kinds: type) -> Check:
    """The check of a value of one of some `kinds`, for people `what`; to JSON true and false are no numbers."""

    def check(value: Any, place: str) -> Any:
        if not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds):
            raise FormatError(f"{place}: {shown(value)} is not {what}")
        return value

    return check


text = _of("text", str)
truth = _of("true or false", bool)
whole = _of("a whole number", int)
_numeric = _of("a number", int, float)


def number(value: Any, place: str) -> float:
    """Check a number that a float can hold.

    Parameters
    ----------
    value : object
        Of the file.
    place : str
        What the message calls it.

    Returns
    -------
    float
        As it stands in the file.

    Raises
    ------
    FormatError
        For anything else.
    """
    if not abs(_numeric(value, place)) <= sys.float_info.max:
        raise FormatError(f"{place}: is too large for a number")
    return value  # type: ignore[no-any-return]


def each(check: Check, what: str, most: int | None = None) -> Check:
    """Make the check of a list.

    Parameters
    ----------
    check : callable
        That every entry has to pass.
    what : str
        What the entries are, for the message.
    most : int, optional
        How many there may be.

    Returns
    -------
    callable
        The check.
    """

    def check_all(value: Any, place: str) -> list[Any]:
        if not isinstance(value, list) or (most is not None and len(value) > most):
            raise FormatError(f"{place}: is not a list of {'' if most is None else f'at most {most} '}{what}")
        return [check(entry, f"{place}[{i}]") for i, entry in enumerate(value)]

    return check_all


def or_none(check: Check) -> Check:
    """Make the check of a value that may be null.

    Parameters
    ----------
    check : callable
        That any other value has to pass.

    Returns
    -------
    callable
        The check.
    """
    return lambda value, place: None if value is None else check(value, place)


numbers = each(number, "numbers")
names = each(text, "names")


def points(rows: Any, place: str) -> Array:
    """Check a list of points.

    Parameters
    ----------
    rows : object
        Of the file.
    place : str
        What the message calls it.

    Returns
    -------
    array (n, axes)
        As they stand in the file.

    Raises
    ------
    FormatError
        With the place of what is none.
    """
    if not isinstance(rows, list) or not 0 < len(rows) <= MAX_POINTS:
        raise FormatError(f"{place}: is not a list of 1 to {MAX_POINTS} points")
    width = len(rows[0]) if isinstance(rows[0], list) else 0
    if not 1 <= width <= MAX_AXES:
        raise FormatError(f"{place}[0]: expected a list of 1 to {MAX_AXES} numbers")
    for i, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != width:
            raise FormatError(f"{place}[{i}]: expected {width} numbers as in the first point")
        numbers(row, f"{place}[{i}]")
    return np.array(rows, dtype=np.float64)


def unit(value: Any, place: str) -> float:
    """Check a unit of length.

    Parameters
    ----------
    value : object
        Of the file.
    place : str
        What the message calls it.

    Returns
    -------
    float
        How many mm it is.

    Raises
    ------
    FormatError
        For another one than mm, cm, m and in.
    """
    if not isinstance(value, str) or value not in _MILLIMETRES:
        raise FormatError(f"{place}: {shown(value)} is not known; write one of {', '.join(_MILLIMETRES)}")
    return _MILLIMETRES[value]


def shown(value: object) -> str:
    """`value` for a message: never more than a few words of it."""
    text = json.dumps(value) if isinstance(value, str | int | float | None) else f"a {type(value).__name__}"
    return text if len(text) <= 40 else f"{text[:37]}..."
