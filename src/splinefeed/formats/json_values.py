"""Values of JSON files, checked: rows of points, lists of numbers, units and keys, each refused with its place."""

from __future__ import annotations

import json
import math
import os
from typing import Any

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats.sizes import MAX_AXES
from splinefeed.records import Array

_MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}


def points(rows: object, place: str) -> Array:
    """The control points (n, axes) as they stand in the file."""
    if not isinstance(rows, list) or not rows:
        raise FormatError(f"{place}: is not a list of points")
    width = len(rows[0]) if isinstance(rows[0], list) else 0
    if not 1 <= width <= MAX_AXES:
        raise FormatError(f"{place}[0]: expected a list of 1 to {MAX_AXES} numbers")
    points = np.empty((len(rows), width))
    for i, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != width:
            raise FormatError(f"{place}[{i}]: expected {width} numbers as in the first point")
        points[i] = numbers(row, f"{place}[{i}]")
    return points


def numbers(values: object, place: str) -> list[float]:
    """`values` as finite floats; booleans, texts and numbers too large for a float are none."""
    if not isinstance(values, list):
        raise FormatError(f"{place}: is not a list of numbers")
    for i, value in enumerate(values):
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise FormatError(f"{place}[{i}]: {shown(value)} is not a number")
        try:
            finite = math.isfinite(value)
        except OverflowError:
            finite = False
        if not finite:
            raise FormatError(f"{place}[{i}]: is too large for a number")
    return values


def degree(item: dict[str, Any], place: str) -> int:
    """The key `degree` of a curve, a whole number."""
    value = item["degree"]
    if isinstance(value, bool) or not isinstance(value, int):
        raise FormatError(f"{place}degree: {shown(value)} is not a whole number")
    return value


def name(item: dict[str, Any], place: str | os.PathLike[str]) -> str:
    """The key `name`; "" without one."""
    value = item.get("name", "")
    if not isinstance(value, str):
        raise FormatError(f"{place}: name: {shown(value)} is not text")
    return value


def scale(unit: object, place: str, findings: list[str]) -> float:
    """How many mm one `unit` of the file is."""
    if unit is None:
        finding = "no units are given; read as mm"
        if finding not in findings:
            findings.append(finding)
        return 1.0
    if not isinstance(unit, str) or unit not in _MILLIMETRES:
        raise FormatError(f"{place}: {shown(unit)} is not known; write one of {', '.join(_MILLIMETRES)}")
    return _MILLIMETRES[unit]


def check_keys(item: dict[str, Any], known: set[str], place: str | os.PathLike[str]) -> None:
    """FormatError for a key of `item` that is not `known`."""
    for key in item:
        if key not in known:
            raise FormatError(f"{place}: key {shown(key)} is not known; known are {', '.join(sorted(known))}")


def shown(value: object) -> str:
    """`value` for a message: never more than a few words of it."""
    text = json.dumps(value) if isinstance(value, str | int | float | None) else f"a {type(value).__name__}"
    return text if len(text) <= 40 else f"{text[:37]}..."
