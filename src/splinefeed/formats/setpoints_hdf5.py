"""Setpoints to and from HDF5, chunk by chunk, bit for bit; rotary axes in rad."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats import hdf5
from splinefeed.formats.metadata import (
    COLUMNS,
    axis_units,
    check_all_finite,
    checked_chunks,
    settings_from_json,
    settings_to_json,
)
from splinefeed.formats.sizes import MAX_TICKS, MAX_TICKS_IN_CHUNKS
from splinefeed.records import Setpoints, positive


def save(record: Setpoints | Iterable[Setpoints], path: str | os.PathLike[str]) -> None:
    """Write setpoints, whole or as an iterable of chunks of which only one is in memory at a time."""
    with hdf5.create(path, "Setpoints") as (file, check):
        datasets: dict[str, Any] = {}
        ticks = 0
        for chunk in checked_chunks(record, path, MAX_TICKS_IN_CHUNKS):
            datasets = datasets or _create_datasets(file, chunk)
            hdf5.append(datasets, chunk, ticks)
            ticks += len(chunk)
            check()


def read(file: Any, path: Path) -> Setpoints:
    """The setpoints in an open HDF5 file."""
    return _read(_datasets(file, path), file, path, slice(None))


def read_chunks(file: Any, path: Path, rows: int) -> Iterator[Setpoints]:
    """The setpoints in an open HDF5 file, `rows` ticks at a time, one chunk in memory."""
    datasets = _datasets(file, path, MAX_TICKS_IN_CHUNKS)
    ticks = len(datasets["t"])
    for name, dataset in datasets.items():
        if len(dataset) != ticks:
            raise FormatError(f"{path}: dataset {name}: has {len(dataset)} ticks, t has {ticks}")
    for start in range(0, ticks, rows):
        yield _read(datasets, file, path, slice(start, start + rows))


def _datasets(file: Any, path: Path, most: int = MAX_TICKS) -> dict[str, Any]:
    datasets = {name: hdf5.dataset(file, name, path, 1, most) for name in COLUMNS}
    return {**datasets, "position": hdf5.dataset(file, "position", path, 2, most)}


def _read(datasets: Mapping[str, Any], file: Any, path: Path, part: slice) -> Setpoints:
    points = Setpoints(
        **{name: np.asarray(dataset[part]) for name, dataset in datasets.items()},
        axes=hdf5.axes_of(file, path),
        period=positive(file.attrs["period"], "period"),
        method=hdf5.text_attribute(file, "method", path),
        settings=settings_from_json(hdf5.text_attribute(file, "settings", path), path),
    )
    check_all_finite(points)
    return points


def _create_datasets(file: Any, first: Setpoints) -> dict[str, Any]:
    file.attrs["axes"] = list(first.axes)
    file.attrs["period"] = first.period
    file.attrs["period_units"] = "s"
    file.attrs["method"] = first.method
    file.attrs["settings"] = settings_to_json(first.settings)
    return hdf5.growing(file, first, {**COLUMNS, "position": axis_units(first.axes, rotary="rad")})
