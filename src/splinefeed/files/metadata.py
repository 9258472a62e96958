"""What a file of setpoints says beside the numbers, and checks that all formats of records share."""

from __future__ import annotations

import json
from collections.abc import Collection, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TextIO, TypeAlias, TypeVar

import numpy as np

import splinefeed
from splinefeed.errors import FormatError, InputError, SplinefeedError
from splinefeed.files.plain import plain
from splinefeed.files.sizes import MAX_COORDINATE
from splinefeed.files.source import in_brief
from splinefeed.numbers import MOST
from splinefeed.records import (
    ROTARY_AXES,
    STREAM_COLUMNS,
    Array,
    IntArray,
    Joint,
    Response,
    Setpoints,
    TimeLaw,
    check_finite,
    positive,
    unit_along,
    unit_of_axis,
)

#: Raised by one when a file written by this version could no longer be read by the one before.
SCHEMA = 1
#: Columns of Setpoints beside the position, with their units; "1" is the unit of what has none.
COLUMNS = {"t": "s", "curve": "1", "u": "1", "s": "mm", "feed": "mm/s"}
Part = TypeVar("Part")
#: What writes a file: it is sent one part after the other, and None behind the last.
Sink: TypeAlias = Generator[None, Part | None, None]
#: Columns that not every response has.
MAYBE = ("contour_error", *STREAM_COLUMNS)
_FINITE = ("t", "u", "s", "feed", "position", "command", "measured", "output", "breaks", "coefficients")
_PLACES = ("position", "command", "measured")
#: Shortest and longest period of setpoints, s.
PERIODS = (1e-9, 1e6)
#: Rows that are turned into text by one formatting call: about twice as fast as numpy.savetxt, which goes row by row.
_ROWS_AT_ONCE = 2000


def axis_units(axes: Iterable[str], rotary: str) -> list[str]:
    """Give the unit of each axis.

    Parameters
    ----------
    axes : iterable of str
        Their names, or Joints.
    rotary : str
        Of those that turn, "rad" or "deg".

    Returns
    -------
    list of str
        One an axis.
    """
    return [rotary if axis in ROTARY_AXES else unit_of_axis(axis) for axis in axes]


def to_degrees(position: Array, axes: Sequence[str]) -> Array:
    """Convert the rotary axes of positions to degrees.

    Parameters
    ----------
    position : array (n, axes)
        mm, rotary axes rad.
    axes : sequence of str
        Their names.

    Returns
    -------
    array (n, axes)
        A copy; the same array where there are no rotary axes.
    """
    return _convert_rotary(position, axes, np.rad2deg)


def to_radians(position: Array, axes: Sequence[str]) -> Array:
    """Convert the rotary axes of positions from degrees to rad.

    Parameters
    ----------
    position : array (n, axes)
        mm, rotary axes degrees.
    axes : sequence of str
        Their names.

    Returns
    -------
    array (n, axes)
        A copy; the same array where there are no rotary axes.
    """
    return _convert_rotary(position, axes, np.deg2rad)


def _convert_rotary(position: Array, axes: Sequence[str], convert: np.ufunc) -> Array:
    rotary = [column for column, axis in enumerate(axes) if axis in ROTARY_AXES]
    if not rotary:
        return position
    converted = np.array(position)
    converted[:, rotary] = convert(converted[:, rotary])
    return converted


@contextmanager
def naming(path: object, kind: str | None = None) -> Iterator[None]:
    """Let errors inside the context name a file.

    Parameters
    ----------
    path : object
        The file.
    kind : str, optional
        What it is read as; then all that a library raises is an error of the file, too. Else a note of it names the
        file.

    Raises
    ------
    FormatError
        In place of errors inside.
    """
    try:
        yield
    except FormatError:
        raise
    except SplinefeedError as error:
        raise FormatError(f"{path}: {error}") from None
    except Exception as error:
        if kind is None:
            error.add_note(f"at {path}")
            raise
        raise FormatError(f"{path}: is not a valid {kind}: {in_brief(error)}") from None


def to_json(value: Any) -> str:
    """Write a value as one line of JSON.

    Parameters
    ----------
    value : object
        Tuples become lists, NumPy's numbers and arrays become Python's.

    Returns
    -------
    str
        The line.

    Raises
    ------
    InputError
        For what JSON cannot hold.
    """
    try:
        return json.dumps(plain(value), allow_nan=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise InputError(f"settings: cannot be written as JSON: {error}") from None


def check_schema(schema: object) -> None:
    """Check that this version reads a schema.

    Parameters
    ----------
    schema : object
        As a file says it.

    Raises
    ------
    InputError
        For what is no schema, or a newer one.
    """
    if not isinstance(schema, int | np.integer) or schema < 1:
        raise InputError(f"schema: {schema!r} is not a schema of splinefeed")
    if schema > SCHEMA:
        raise InputError(f"schema: {schema} is newer than the {SCHEMA} known here; update splinefeed")


def description(first: Setpoints, rotary: str) -> dict[str, Any]:
    """Describe setpoints for a file, beside their columns.

    Parameters
    ----------
    first : Setpoints
        The first ones of the file.
    rotary : str
        Unit of the axes that turn, "rad" or "deg".

    Returns
    -------
    dict of str to object
        Ready for JSON.
    """
    return {
        "record": "Setpoints",
        "schema": SCHEMA,
        "program": f"splinefeed {splinefeed.__version__}",
        "method": first.method,
        "period_s": first.period,
        "axes": first.axes,
        "units": {**units_of(first.axes, first.settings), "position": axis_units(first.axes, rotary)},
        "settings": json.loads(to_json(first.settings)),
    }


def described(columns: Mapping[str, Any], said: Any) -> Setpoints:
    """Make setpoints of the columns and the description of a file.

    Parameters
    ----------
    columns : mapping of str to array
        By name, (n,) and (n, axes).
    said : object
        What `description` gave.

    Returns
    -------
    Setpoints
        mm, rotary axes rad.

    Raises
    ------
    InputError
        For what does not fit.
    """
    if not isinstance(said, dict) or said.get("record") != "Setpoints":
        raise InputError("does not describe setpoints; was this written by splinefeed?")
    check_schema(said.get("schema"))
    for name, kind in (("axes", list), ("method", str), ("settings", dict)):
        if not isinstance(said.get(name), kind):
            raise InputError(f"{name}: is missing or of the wrong type")
    points = Setpoints(
        **columns,
        axes=axes_of(said),
        period=positive(said.get("period_s"), "period"),
        method=said["method"],
        settings=said["settings"],
    )
    check_columns(points)
    return points


def units_of(axes: Sequence[str], settings: Mapping[str, Any]) -> dict[str, str]:
    """Give the units of the columns of setpoints.

    Parameters
    ----------
    axes : sequence of str
        Of the path.
    settings : mapping of str to object
        Of the setpoints: `unit`, of lengths along the path, if it says it.

    Returns
    -------
    dict of str to str
        COLUMNS, lengths in the unit of joints, or of the tip that they carry.
    """
    along = str(settings.get("unit") or unit_along(axes))
    along = along if any(isinstance(axis, Joint) for axis in axes) else "mm"
    return {**COLUMNS, "s": along, "feed": f"{along}/s"}


def settings_of(said: Mapping[str, Any]) -> Mapping[str, Any]:
    """The settings of a description, if they are any."""
    found = said.get("settings")
    return found if isinstance(found, Mapping) else {}


def axes_of(said: Mapping[str, Any]) -> tuple[str, ...]:
    """Find the axes that a description names.

    Parameters
    ----------
    said : mapping of str to object
        What `description` gave.

    Returns
    -------
    tuple of str
        One in rad that is no rotary axis is a Joint, as are all beside it.
    """
    names = tuple(map(str, said["axes"]))
    units = said.get("units")
    own = units.get("position") if isinstance(units, dict) else None
    if not isinstance(own, list) or len(own) != len(names):
        return names
    arm = any(unit == "rad" and name not in ROTARY_AXES for name, unit in zip(names, own, strict=True))
    return tuple(Joint(name, str(unit)) if arm else name for name, unit in zip(names, own, strict=True))


def column_names(axes: Sequence[str], rotary: str, settings: Mapping[str, Any]) -> list[str]:
    """Name the columns of a table, each with its unit.

    Parameters
    ----------
    axes : sequence of str
        Of the setpoints.
    rotary : str
        Of those that turn, "rad" or "deg".
    settings : mapping of str to object
        Of the setpoints.

    Returns
    -------
    list of str
        Such as t_s and x_mm.
    """
    positions = [f"{axis}_{unit}" for axis, unit in zip(axes, axis_units(axes, rotary), strict=True)]
    along = units_of(axes, settings)["s"].strip("()").replace(" ", "_")
    return ["t_s", "curve", "u", f"s_{along}", f"feed_{along}_s", *positions]


def columns_of(points: Setpoints) -> list[Array | IntArray]:
    """The columns (n,) of a table."""
    return [*(getattr(points, name) for name in COLUMNS), *points.position.T]


def by_name(columns: Sequence[Any]) -> dict[str, Any]:
    """The columns (n,) of a table as those of setpoints."""
    return {**dict(zip(COLUMNS, columns, strict=False)), "position": np.column_stack(columns[len(COLUMNS) :])}


def write_rows(stream: TextIO, columns: Sequence[Array | IntArray], between: str, whole: Collection[int] = ()) -> None:
    """Write columns as rows of text, 17 digits a number.

    Parameters
    ----------
    stream : text stream
        That takes them.
    columns : sequence of array (n,)
        Of the table.
    between : str
        What stands between two numbers.
    whole : collection of int, optional
        Places of the columns that are whole numbers.
    """
    row = between.join("%d" if k in whole else "%.17g" for k in range(len(columns))) + "\n"
    for start in range(0, len(columns[0]), _ROWS_AT_ONCE):
        part = np.column_stack([column[start : start + _ROWS_AT_ONCE] for column in columns])
        stream.write(row * len(part) % tuple(part.ravel().tolist()))


def check_columns(part: Setpoints | Response | TimeLaw) -> None:
    """Check the values and the period of a record.

    Parameters
    ----------
    part : Setpoints, Response or TimeLaw
        The record, or a part of it.

    Raises
    ------
    InputError
        Naming the first value that is NaN, infinite or too large, and for a period that no control has.
    """
    kind = type(part).__name__
    for name in (*_FINITE, "contour_error"):
        values = vars(part).get(name)
        if values is None:
            continue
        if name in _FINITE:
            check_finite(values, f"{kind}.{name}")
        most, unit = (MAX_COORDINATE, " mm or rad") if name in _PLACES else (MOST, "")
        if np.any(np.abs(values) > most):
            raise InputError(f"{kind}.{name}: goes beyond {most:g}{unit}; is the unit right?")
    if (period := getattr(part, "period", None)) is not None:  # a law may have none
        check_period(period)


def check_period(period: float) -> None:
    """Check that a control may have a period.

    Parameters
    ----------
    period : float
        s.

    Raises
    ------
    InputError
        For one that is not within PERIODS.
    """
    if not PERIODS[0] <= period <= PERIODS[1]:
        raise InputError(f"period: {period:g} s is not from {PERIODS[0]:g} to {PERIODS[1]:g} s")
