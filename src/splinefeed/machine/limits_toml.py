"""Limits to and from TOML: the fields of Limits by name, quantities with or without units, rotary axes in degrees."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from splinefeed import units
from splinefeed.errors import FormatError, LimitsError, ProblemsError, UnitError, nearest
from splinefeed.files.atomic import write_text
from splinefeed.files.source import read_text, toml_of
from splinefeed.limit_table import TURNING
from splinefeed.records import ANGLES, BY_AXIS, ROTARY_AXES, TABLE, TRAVEL_ENDS, Limits, by_name, order_of

#: Kind of quantity of each limit that stands by its name in a file.
KINDS = {each.name: each.quantity for each in TABLE if each.filed and each.name not in TRAVEL_ENDS}
#: Limits that may be 0.
_MAY_BE_ZERO = ("start_feed", "end_feed")


class LimitsFileError(ProblemsError):
    """A limits file with errors: the first line names the file, each of `problems` its key and the mend."""


def read(source: str | os.PathLike[str], axes: Sequence[str] | None = None) -> Limits:
    """Read the limits in a TOML file.

    Parameters
    ----------
    source : path
        The file.
    axes : sequence of str, optional
        Those of the path, in whose order lists are; without them a list is refused.

    Returns
    -------
    Limits
        In mm, s and rad.

    Raises
    ------
    FormatError
        For a file that cannot be read, and a machine in place of limits. LimitsFileError, which is one, has everything
        that is wrong, each with its key.
    """
    return parse(read_text(source), str(source), axes)


def parse(text: str, source: str = "limits", axes: Sequence[str] | None = None) -> Limits:
    """Make limits from the text of a file, soft limits from its table [travel].

    Parameters
    ----------
    text : str
        TOML.
    source : str, optional
        What messages call it.
    axes : sequence of str, optional
        Those of the path, in whose order lists are; without them a list is refused.

    Returns
    -------
    Limits
        In mm, s and rad.

    Raises
    ------
    FormatError
        For a file that cannot be read, and a machine in place of limits. LimitsFileError, which is one, has everything
        that is wrong, each with its key.
    """
    flat, problems = flat_of(toml_of(text, source), source), []
    for key, value in flat.items():
        if isinstance(value, list) and axes is None:
            problems.append(f"{key}: is a list in the order of a path's axes, and there is no path here; name the axes")
    if problems:
        raise LimitsFileError(source, problems)
    return Limits.from_dict(in_order(flat, axes or ()))


def flat_of(content: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return what a file of limits holds as `Limits.as_dict` has it; a list stays as it is, see `in_order`.

    Parameters
    ----------
    content : mapping
        Of the TOML file.
    source : str
        What messages call it.

    Returns
    -------
    dict
        Limits by name, in mm, s and rad.

    Raises
    ------
    FormatError
        For a machine in place of limits. LimitsFileError, which is one, has problems that each begin with the key.
    """
    if "axis" in content or "control" in content:
        raise FormatError(f"{source}: holds a machine, not limits of a motion; give it by --machine {source}")
    problems: list[str] = []
    values: dict[str, Any] = {}
    lists: dict[str, list[Any]] = {}
    for key, given in content.items():
        axes = given if isinstance(given, dict) and key in ("travel", *BY_AXIS) else {"": given}
        for axis, value in axes.items():
            try:
                if not axis and axes is given:
                    raise LimitsError("an axis has no name")
                if key == "travel":
                    for end, position in zip(TRAVEL_ENDS, travel_of(axis, value), strict=True):
                        values.setdefault(end, {})[axis] = position
                elif key not in KINDS:
                    raise LimitsError(f"unknown limit; {nearest(key, [*KINDS, 'travel'])}")
                elif axis:
                    values.setdefault(key, {})[axis] = axis_value(key, axis, value)
                elif isinstance(value, list) and key in BY_AXIS:
                    lists[key] = value
                    values[key] = _of_either(key, value)
                else:
                    values[key] = axis_value(key, "", value)
            except (UnitError, LimitsError) as error:
                problems.append(f"{key}{'.' * bool(axis)}{axis}: {error}")
    if not problems:
        try:
            return {**Limits(**values).as_dict(), **lists}
        except LimitsError as error:
            first, _, rest = str(error).partition(" ")
            problems.append(f"{first}: {rest}" if first in KINDS else str(error))
    raise LimitsFileError(source, problems)


def in_order(flat: Mapping[str, Any], axes: Sequence[str]) -> dict[str, float]:
    """Put lists of quantities in the order of axes.

    Parameters
    ----------
    flat : mapping
        Limits as `Limits.as_dict` has them, some as lists.
    axes : sequence of str
        Of the path; none where a command only looks whether limits can be read: a list counts as its first value then.

    Returns
    -------
    dict of str to float
        Limits by name, in mm, s and rad.

    Raises
    ------
    LimitsError, UnitError
        For a list that does not fit the axes.
    """
    out: dict[str, float] = {}
    for name, value in flat.items():
        if not isinstance(value, list):
            out[name] = value
        elif not axes:
            out[name] = _of_either(name, value)
        else:
            named = by_name(name, tuple(value), axes)
            for axis, each in named.items():
                try:
                    out[f"{name}.{axis}"] = axis_value(name, axis, each)
                except (UnitError, LimitsError) as error:
                    raise LimitsError(f"{name}.{axis}: {error}") from None
    return out


def _of_either(name: str, values: Sequence[Any]) -> float:
    """The first of values, each of a linear or of a rotary axis; UnitError or LimitsError for one that is neither."""
    if not values:
        raise LimitsError("is empty; give one value an axis, in the path's order")
    found = []
    for each in values:
        try:
            found.append(axis_value(name, "x", each))
        except UnitError as error:
            try:
                found.append(axis_value(name, ROTARY_AXES[0], each))
            except UnitError:
                raise error from None
    return found[0]


def axis_value(name: str, axis: str, value: Any) -> float:
    """Read a limit of one axis, or of the path.

    Parameters
    ----------
    name : str
        Of the limit.
    axis : str
        Of the axis; "" for the path.
    value : object
        A number, or a quantity with its unit; an angle without a unit is in degrees.

    Returns
    -------
    float
        mm, s and rad.

    Raises
    ------
    UnitError
        For what is no such quantity.
    LimitsError
        For one that is not positive.
    """
    if isinstance(value, list | dict):
        what = (
            "a number, a list of them in the path's order, or a table with one number an axis"
            if name in BY_AXIS
            else "one number"
        )
        raise LimitsError(f"must be {what}, such as {units.KINDS[KINDS[name]].example.split(' or ')[0]}")
    turns = axis in ROTARY_AXES or name in ANGLES
    number = turning(value, order_of(name)) if turns else units.parse(value, KINDS[name])
    if not (number > 0.0 or (number == 0.0 and name in _MAY_BE_ZERO)):
        raise LimitsError(f"{value!r} must be greater than 0")
    return number


def by_axis(text: str) -> list[tuple[str, str]]:
    """Return axis and quantity of each part of `x=2000,theta=90deg/s^3`; X=2000, as programs have it, is x."""
    pairs = (each.partition("=") for each in text.split(","))
    return [(letter(axis.strip()), value.strip()) for axis, _, value in pairs]


def letter(axis: str) -> str:
    """Return the name of an axis; that of one letter is small."""
    return axis.lower() if len(axis) == 1 else axis


def turning(value: Any, order: int) -> float:
    """Return an angle, or its derivative by time of order 1 to 3, rad/s^order; a bare number is in degrees."""
    return units.parse(value, TURNING[order], units.KINDS[TURNING[order]].base.replace("rad", "deg"))


def travel_of(axis: str, value: Any) -> tuple[float, float]:
    """Return least and greatest position of an axis.

    Parameters
    ----------
    axis : str
        Its name.
    value : list of 2
        Quantities; those of rotary axes without a unit are in degrees.

    Returns
    -------
    (float, float)
        mm or rad.

    Raises
    ------
    LimitsError
        For what is no list of two that rises.
    UnitError
        For a value that is no length, or angle.
    """
    if not axis or not isinstance(value, list) or len(value) != 2:
        raise LimitsError(f"{value!r}; write least and greatest position of each axis, such as [travel] x = [0, 500]")
    low, high = (turning(each, 0) if axis in ROTARY_AXES else units.parse(each, "length") for each in value)
    if not low < high:
        raise LimitsError(f"runs from {value[0]} to {value[1]}; the first must be the smaller one")
    return low, high


def write(limits: Limits, target: str | os.PathLike[str]) -> None:
    """Write limits as TOML, whole or not at all; `read` gives the same numbers back.

    Parameters
    ----------
    limits : Limits
        By name of each axis.
    target : path
        The file.

    Raises
    ------
    LimitsError
        For limits in the order of a path's axes.
    """
    write_text(target, to_text(limits))


def to_text(limits: Limits) -> str:
    """Return the limits as the text of a TOML file, numbers to their last digit, the unit beside each.

    Parameters
    ----------
    limits : Limits
        By name of each axis.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    LimitsError
        For limits in the order of a path's axes.
    """
    import tomlkit

    def said(value: float | Sequence[float], unit: str, axis: str = "") -> Any:
        ends = np.atleast_1d(value).tolist()
        if axis in ROTARY_AXES:
            ends, unit = [_degrees(each) for each in ends], unit.replace("mm", "deg")
        return tomlkit.item(ends if np.ndim(value) else ends[0]).comment(unit)

    document = tomlkit.document()
    document.add(tomlkit.comment("limits of a motion for splinefeed"))
    for name, kind in KINDS.items():
        value, unit = getattr(limits, name), units.KINDS[kind].base
        if isinstance(value, tuple):
            raise LimitsError(f"{name}: is in the order of a path's axes; write limits.on(path.axes), which names them")
        if isinstance(value, Mapping):
            document[name] = {axis: said(limit, unit, axis) for axis, limit in value.items()}
        elif value is not None and value != math.inf:
            document[name] = said(value, unit)
    if limits.travel:
        document["travel"] = {axis: said(ends, "mm", axis) for axis, ends in limits.travel.items()}
    return tomlkit.dumps(document)


def _degrees(angle: float) -> float:
    """Degrees that `math.radians` turns into `angle` again, if there are such."""
    degrees = math.degrees(angle)
    near = (degrees, math.nextafter(degrees, math.inf), math.nextafter(degrees, -math.inf))
    return next((each for each in near if math.radians(each) == angle), degrees)
