"""Records to and from HDF5, bit for bit, long ones chunk by chunk; rotary axes in rad."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import FormatError, InputError, LimitsError
from splinefeed.formats import hdf5
from splinefeed.formats.limits_toml import KINDS, unit_of
from splinefeed.formats.metadata import (
    COLUMNS,
    axis_units,
    check_all_finite,
    checked_chunks,
    settings_from_json,
    settings_to_json,
)
from splinefeed.formats.sizes import MAX_TICKS, MAX_TICKS_IN_CHUNKS
from splinefeed.records import (
    ROTARY_AXES,
    STREAM_COLUMNS,
    Limits,
    Response,
    Setpoints,
    TimeLaw,
    check_finite,
    positive,
)

#: Datasets (n, axes) of a response and their units, None: that of the axis; and (n,) those that not every one has.
_BY_AXIS = {"command": None, "position": None, "measured": None, "output": "V", "saturated": "1"}
_MAYBE = {"contour_error": "mm", **dict.fromkeys(STREAM_COLUMNS, "1")}
_FINITE = ("t", "command", "position", "measured", "output")


def save(record: Any, path: str | os.PathLike[str]) -> None:
    """Write a record, or setpoints or a response as an iterable of chunks of which one is in memory at a time."""
    if isinstance(record, TimeLaw):
        _save_law(record, path)
    elif isinstance(record, Limits):
        _save_limits(record, path)
    elif isinstance(record, Response):
        save_response(record, path)
    else:
        _save_parts("Setpoints", checked_chunks(record, path, MAX_TICKS_IN_CHUNKS), path)


def save_response(record: Response | Iterable[Response], path: str | os.PathLike[str]) -> None:
    """Write a response, whole or as an iterable of pieces of which only one is in memory at a time."""
    _save_parts("Response", _alike([record] if isinstance(record, Response) else record, path), path)


def _save_parts(kind: str, parts: Iterable[Any], path: str | os.PathLike[str]) -> None:
    with hdf5.create(path, kind) as (file, check):
        datasets: dict[str, Any] = {}
        ticks = 0
        for part in parts:
            if not datasets:
                _say(file, part)
                datasets = hdf5.growing(file, part, _units(part))
            hdf5.append(datasets, part, ticks)
            ticks += len(part)
            check()
        if getattr(part, "stopped", None) is not None:
            file.attrs["stopped"] = part.stopped


def _alike(parts: Iterable[Response], path: object) -> Iterator[Response]:
    """The pieces of a response, each finite and of the columns of the first; FormatError for none."""
    first: Response | None = None
    ticks = 0
    for part in parts:
        _check_finite(part)
        first = part if first is None else first
        if part.axes != first.axes or any((getattr(part, x) is None) != (getattr(first, x) is None) for x in _MAYBE):
            raise InputError(f"{path}: the piece at tick {ticks} has other columns than the first one")
        ticks += len(part)
        yield part
    if ticks == 0:
        raise FormatError(f"{path}: there are no ticks to save")


def _check_finite(response: Response) -> None:
    for name in _FINITE:
        check_finite(getattr(response, name), f"Response.{name}")


def _units(part: Setpoints | Response) -> dict[str, Any]:
    places = axis_units(part.axes, rotary="rad")
    if isinstance(part, Setpoints):
        return {**COLUMNS, "position": places}
    units = {name: places if unit is None else unit for name, unit in _BY_AXIS.items()}
    return {"t": "s", **units, **{name: unit for name, unit in _MAYBE.items() if getattr(part, name) is not None}}


def _save_law(law: TimeLaw, path: str | os.PathLike[str]) -> None:
    with hdf5.create(path, "TimeLaw") as (file, _):
        for name, unit in (("breaks", "s"), ("coefficients", "mm/s^k in column k")):
            file.create_dataset(name, data=getattr(law, name)).attrs["units"] = unit
        _say(file, law)
        file.attrs["notes"] = json.dumps(law.notes)


def _save_limits(limits: Limits, path: str | os.PathLike[str]) -> None:
    """Each as a number with its unit; LimitsError for those that only Python can say."""
    for name in limits.as_dict():
        if _unit_of(name) is None:
            raise LimitsError(f"{name}: a file holds no limits of combinations of axes and no torques; leave it out")
    with hdf5.create(path, "Limits") as (file, _):
        for name, value in limits.as_dict().items():
            file.create_dataset(name, data=value).attrs["units"] = _unit_of(name)


def _say(file: Any, record: Any) -> None:
    """The attributes of a record beside its columns."""
    for name in ("axes", "method", "strategy"):
        if hasattr(record, name):
            value = getattr(record, name)
            file.attrs[name] = value if isinstance(value, str) else list(value)
    if record.period is not None:
        file.attrs["period"] = record.period
        file.attrs["period_units"] = "s"
    file.attrs["settings"] = settings_to_json(record.settings)


def _unit_of(limit: str) -> str | None:
    """The unit of a limit as `Limits.as_dict` names it; None for what is not a limit."""
    name, _, axis = limit.partition(".")
    unit = unit_of(name)
    return unit.replace("mm", "rad") if unit and axis in ROTARY_AXES else unit


# --- back -------------------------------------------------------------------------------------------------------------


def read_setpoints(file: Any, path: Path) -> Setpoints:
    """The setpoints in an open HDF5 file."""
    return _setpoints(_datasets(file, path), file, path, slice(None))


def read_chunks(file: Any, path: Path, rows: int) -> Iterator[Setpoints]:
    """The setpoints in an open HDF5 file, `rows` ticks at a time, one chunk in memory."""
    datasets = _datasets(file, path, MAX_TICKS_IN_CHUNKS)
    ticks = len(datasets["t"])
    for name, dataset in datasets.items():
        if len(dataset) != ticks:
            raise FormatError(f"{path}: dataset {name}: has {len(dataset)} ticks, t has {ticks}")
    for start in range(0, ticks, rows):
        yield _setpoints(datasets, file, path, slice(start, start + rows))


def _datasets(file: Any, path: Path, most: int = MAX_TICKS) -> dict[str, Any]:
    datasets = {name: hdf5.dataset(file, name, path, 1, most) for name in COLUMNS}
    return {**datasets, "position": hdf5.dataset(file, "position", path, 2, most)}


def _setpoints(datasets: Mapping[str, Any], file: Any, path: Path, part: slice) -> Setpoints:
    columns: dict[str, Any] = {name: np.asarray(dataset[part]) for name, dataset in datasets.items()}
    points = Setpoints(
        **columns,
        **_stream(file, path),
        method=hdf5.text_attribute(file, "method", path),
        settings=_settings(file, path),
    )
    check_all_finite(points)
    return points


def read_response(file: Any, path: Path) -> Response:
    """The response in an open HDF5 file."""
    columns = {name: hdf5.array(file, name, path, 2) for name in _BY_AXIS}
    response = Response(
        t=hdf5.array(file, "t", path, 1),
        **{**columns, "saturated": columns["saturated"] != 0},
        **_stream(file, path),
        **{name: hdf5.array(file, name, path, 1) for name in _MAYBE if name in file},
        stopped=hdf5.text_attribute(file, "stopped", path) if "stopped" in file.attrs else None,
        settings=_settings(file, path),
    )
    _check_finite(response)
    return response


def read_law(file: Any, path: Path) -> TimeLaw:
    """The time law in an open HDF5 file."""
    notes = json.loads(hdf5.text_attribute(file, "notes", path))
    if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
        raise FormatError(f"{path}: attribute notes: is not a list of sentences")
    period = file.attrs.get("period")
    return TimeLaw(
        breaks=hdf5.array(file, "breaks", path, 1),
        coefficients=hdf5.array(file, "coefficients", path, 2),
        strategy=hdf5.text_attribute(file, "strategy", path),
        period=None if period is None else positive(period, "period"),
        notes=tuple(notes),
        settings=_settings(file, path),
    )


def read_limits(file: Any, path: Path) -> Limits:
    """The limits in an open HDF5 file."""
    unknown = sorted(name for name in file if _unit_of(name) is None)
    if unknown:
        raise FormatError(f"{path}: dataset {unknown[0]}: is not a limit known here; known are {', '.join(KINDS)}")
    return Limits.from_dict({name: float(hdf5.array(file, name, path, 0)) for name in file})


def _stream(file: Any, path: Path) -> dict[str, Any]:
    return {"axes": hdf5.axes_of(file, path), "period": positive(file.attrs["period"], "period")}


def _settings(file: Any, path: Path) -> dict[str, Any]:
    return settings_from_json(hdf5.text_attribute(file, "settings", path), path)
