"""What a file of setpoints says beside the numbers: units, settings, and checks that all its formats share."""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TextIO

import numpy as np

import splinefeed
from splinefeed.errors import FormatError, InputError, SplinefeedError
from splinefeed.formats.sizes import MAX_TICKS
from splinefeed.formats.source import in_brief
from splinefeed.records import ROTARY_AXES, Array, IntArray, Setpoints, check_finite, positive

#: Raised by one when a file written by this version could no longer be read by the one before.
SCHEMA = 1
#: Columns of Setpoints beside the position, with their units; "1" is the unit of what has none.
COLUMNS = {"t": "s", "curve": "1", "u": "1", "s": "mm", "feed": "mm/s"}
#: Rows that are turned into text by one formatting call: about twice as fast as numpy.savetxt, which goes row by row.
_ROWS_AT_ONCE = 2000


def axis_units(axes: Iterable[str], rotary: str) -> list[str]:
    """The unit of each axis, with `rotary` ("rad" or "deg") for those that turn."""
    return [rotary if axis in ROTARY_AXES else "mm" for axis in axes]


def to_degrees(position: Array, axes: tuple[str, ...]) -> Array:
    """A copy of position (n, axes) with the rotary axes in degrees; the same array where there are none."""
    return _convert_rotary(position, axes, np.rad2deg)


def to_radians(position: Array, axes: tuple[str, ...]) -> Array:
    """A copy of position (n, axes), rotary axes given in degrees, with them in rad."""
    return _convert_rotary(position, axes, np.deg2rad)


def _convert_rotary(position: Array, axes: tuple[str, ...], convert: np.ufunc) -> Array:
    rotary = [column for column, axis in enumerate(axes) if axis in ROTARY_AXES]
    if not rotary:
        return position
    converted = np.array(position)
    converted[:, rotary] = convert(converted[:, rotary])
    return converted


@contextmanager
def sound_file(path: object, kind: str) -> Iterator[None]:
    """Whatever is raised in reading a damaged file, nearly anything, becomes a FormatError that names it."""
    try:
        yield
    except FormatError:
        raise
    except SplinefeedError as error:
        raise FormatError(f"{path}: {error}") from None
    except Exception as error:
        raise FormatError(f"{path}: is not a valid {kind}: {in_brief(error)}") from None


def settings_to_json(settings: Mapping[str, Any]) -> str:
    """`settings` as one line of JSON; tuples become lists, NumPy's numbers and arrays become Python's."""
    try:
        return json.dumps(settings, default=_as_plain, allow_nan=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise InputError(f"settings: cannot be written as JSON: {error}") from None


def _as_plain(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"an object of type {type(value).__name__} has no form in JSON")


def settings_from_json(text: str, path: object) -> dict[str, Any]:
    """The settings that `settings_to_json` wrote; FormatError names the file `path`."""
    try:
        settings = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{path}: settings: are not JSON: {error}") from None
    if not isinstance(settings, dict):
        raise FormatError(f"{path}: settings: are not a JSON object")
    return settings


def check_schema(schema: object, path: object) -> None:
    """FormatError if `schema`, as the file at `path` says it, is not one that this version reads."""
    if not isinstance(schema, int | np.integer) or schema < 1:
        raise FormatError(f"{path}: schema: {schema!r} is not a schema of splinefeed")
    if schema > SCHEMA:
        raise FormatError(f"{path}: schema: {schema} is newer than the {SCHEMA} known here; update splinefeed")


def description(first: Setpoints, rotary: str) -> dict[str, Any]:
    """All that a file says beside its columns, ready for JSON; `rotary` is the unit of the axes that turn."""
    return {
        "record": "Setpoints",
        "schema": SCHEMA,
        "program": f"splinefeed {splinefeed.__version__}",
        "method": first.method,
        "period_s": first.period,
        "axes": first.axes,
        "units": {**COLUMNS, "position": axis_units(first.axes, rotary)},
        "settings": json.loads(settings_to_json(first.settings)),
    }


def read_description(text: str | bytes, place: str) -> dict[str, Any]:
    """What `description` gave, as the arguments of Setpoints that are no columns; FormatError names the `place`."""
    try:
        said = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{place}: is not JSON: {error}") from None
    if not isinstance(said, dict) or said.get("record") != "Setpoints":
        raise FormatError(f"{place}: does not describe setpoints")
    check_schema(said.get("schema"), place)
    axes, method, settings = said.get("axes"), said.get("method"), said.get("settings")
    if not isinstance(settings, dict) or not isinstance(method, str):
        raise FormatError(f"{place}: method or settings are of the wrong type")
    if not isinstance(axes, list) or not all(isinstance(axis, str) for axis in axes):
        raise FormatError(f"{place}: axes is not a list of names")
    period = positive(said.get("period_s"), "period")
    return {"axes": tuple(axes), "period": period, "method": method, "settings": settings}


def column_names(axes: tuple[str, ...], rotary: str) -> list[str]:
    """Names of the columns of a table, each with its unit."""
    positions = [f"{axis}_{unit}" for axis, unit in zip(axes, axis_units(axes, rotary), strict=True)]
    return ["t_s", "curve", "u", "s_mm", "feed_mm_s", *positions]


def write_rows(stream: TextIO, columns: Sequence[Array | IntArray], between: str, whole: Collection[int] = ()) -> None:
    """Write columns (n,) as rows of text, 17 digits a number; those whose places are in `whole` are whole numbers."""
    row = between.join("%d" if k in whole else "%.17g" for k in range(len(columns))) + "\n"
    for start in range(0, len(columns[0]), _ROWS_AT_ONCE):
        part = np.column_stack([column[start : start + _ROWS_AT_ONCE] for column in columns])
        stream.write(row * len(part) % tuple(part.ravel().tolist()))


def checked_chunks(record: Setpoints | Iterable[Setpoints], path: object, most: int = MAX_TICKS) -> Iterator[Setpoints]:
    """The chunks of `record`, one at a time, each finite and of the same axes, period and method as the first.

    Raises InputError for a chunk that is not, and FormatError for none at all or more than `most` ticks.
    """
    first: Setpoints | None = None
    ticks = 0
    for chunk in [record] if isinstance(record, Setpoints) else record:
        if not isinstance(chunk, Setpoints):
            raise InputError(f"{path}: setpoints are saved from Setpoints, got {type(chunk).__name__}")
        first = first or chunk
        for name in ("axes", "period", "method"):
            here, there = getattr(chunk, name), getattr(first, name)
            if here != there:
                raise InputError(f"{path}: the chunk at tick {ticks} has {name} {here!r}, the first one {there!r}")
        check_all_finite(chunk)
        ticks += len(chunk)
        if ticks > most:
            raise FormatError(f"{path}: more than {most} ticks do not fit in this format; write HDF5 or several files")
        yield chunk
    if ticks == 0:
        raise FormatError(f"{path}: there are no ticks to save")


def check_all_finite(points: Setpoints) -> None:
    """InputError naming the first value of `points` that is NaN or infinite."""
    for name in ("t", "u", "s", "feed", "position"):
        check_finite(getattr(points, name), f"Setpoints.{name}")
