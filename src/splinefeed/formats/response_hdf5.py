"""Responses of a machine to and from HDF5, chunk by chunk, bit for bit; rotary axes in rad."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from splinefeed.errors import FormatError, InputError
from splinefeed.formats import hdf5
from splinefeed.formats.metadata import axis_units, settings_from_json, settings_to_json
from splinefeed.records import STREAM_COLUMNS, Response, check_finite, positive

#: Datasets (n, axes) and their units; None: that of the axis.
_BY_AXIS = {"command": None, "position": None, "measured": None, "output": "V", "saturated": "1"}
#: Datasets (n,) that are not in every response.
_MAYBE = {"contour_error": "mm", **dict.fromkeys(STREAM_COLUMNS, "1")}


def save(record: Response | Iterable[Response], path: str | os.PathLike[str]) -> None:
    """Write a response, whole or as an iterable of pieces of which only one is in memory at a time."""
    with hdf5.create(path, "Response") as (file, check):
        datasets: dict[str, Any] = {}
        ticks = 0
        stopped = None
        for part in [record] if isinstance(record, Response) else record:
            for name in ("t", "command", "position", "measured", "output"):
                check_finite(getattr(part, name), f"Response.{name}")
            if not datasets:
                datasets = _create(file, part)
            elif part.axes != tuple(file.attrs["axes"]) or any(
                (getattr(part, name) is None) == (name in file) for name in _MAYBE
            ):
                raise InputError(f"{path}: the piece at tick {ticks} has other columns than the first one")
            hdf5.append(datasets, part, ticks)
            ticks += len(part)
            stopped = part.stopped
            check()
        if ticks == 0:
            raise FormatError(f"{path}: there are no ticks to save")
        if stopped is not None:
            file.attrs["stopped"] = stopped


def read(file: Any, path: Path) -> Response:
    """The response in an open HDF5 file."""
    columns = {name: hdf5.array(file, name, path, 2) for name in _BY_AXIS}
    response = Response(
        t=hdf5.array(file, "t", path, 1),
        **{**columns, "saturated": columns["saturated"] != 0},
        axes=hdf5.axes_of(file, path),
        period=positive(file.attrs["period"], "period"),
        **{name: hdf5.array(file, name, path, 1) for name in _MAYBE if name in file},
        stopped=hdf5.text_attribute(file, "stopped", path) if "stopped" in file.attrs else None,
        settings=settings_from_json(hdf5.text_attribute(file, "settings", path), path),
    )
    for name in ("t", "command", "position", "measured", "output"):
        check_finite(getattr(response, name), f"Response.{name}")
    return response


def _create(file: Any, first: Response) -> dict[str, Any]:
    file.attrs["axes"] = list(first.axes)
    file.attrs["period"] = first.period
    file.attrs["period_units"] = "s"
    file.attrs["settings"] = settings_to_json(first.settings)
    units: dict[str, Any] = {"t": "s"}
    units |= {name: axis_units(first.axes, rotary="rad") if unit is None else unit for name, unit in _BY_AXIS.items()}
    units |= {name: unit for name, unit in _MAYBE.items() if getattr(first, name) is not None}
    return hdf5.growing(file, first, units)
