"""Setpoints to and from a MATLAB .mat file: one struct `setpoints`, rotary axes in degrees."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import numpy as np

import splinefeed
from splinefeed.errors import FormatError
from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.metadata import (
    COLUMNS,
    SCHEMA,
    axis_units,
    check_all_finite,
    check_schema,
    checked_chunks,
    settings_from_json,
    settings_to_json,
    sound_file,
    to_degrees,
    to_radians,
)
from splinefeed.formats.sizes import MAX_MATLAB_TICKS
from splinefeed.formats.source import check_file
from splinefeed.records import Setpoints, positive

_NAME = "setpoints"


def save(record: Setpoints | Iterable[Setpoints], path: str | os.PathLike[str]) -> None:
    """Write setpoints; chunks are gathered first, since the format needs the length of all before the first number."""
    import scipy.io

    chunks = list(checked_chunks(record, path, MAX_MATLAB_TICKS))
    first = chunks[0]
    columns: dict[str, Any] = {name: np.concatenate([getattr(chunk, name) for chunk in chunks]) for name in COLUMNS}
    struct = {
        "record": "Setpoints",
        "schema": SCHEMA,
        "program": f"splinefeed {splinefeed.__version__}",
        **columns,
        "position": to_degrees(np.concatenate([chunk.position for chunk in chunks]), first.axes),
        "axes": np.array(first.axes, dtype=object),
        "units": {**COLUMNS, "position": np.array(axis_units(first.axes, rotary="deg"), dtype=object), "period": "s"},
        "period": first.period,
        "method": first.method,
        "settings": settings_to_json(first.settings),
    }
    with atomic_write(path) as temporary, temporary.open("wb") as stream:
        scipy.io.savemat(stream, {_NAME: struct}, do_compression=True, oned_as="column")


def load(path: str | os.PathLike[str]) -> Setpoints:
    """Read setpoints that `save` wrote; FormatError for a file that is cut off, changed, or something else."""
    import scipy.io

    file = check_file(path)
    with sound_file(path, "MATLAB file"):
        with file.open("rb") as stream:
            struct = scipy.io.loadmat(stream, variable_names=[_NAME], simplify_cells=True).get(_NAME)
        if not isinstance(struct, dict) or struct.get("record") != "Setpoints":
            raise FormatError(f"{path}: has no struct {_NAME}; was this written by splinefeed?")
        check_schema(struct.get("schema"), path)
        axes = tuple(str(axis) for axis in np.atleast_1d(struct["axes"]))
        columns = {name: np.atleast_1d(struct[name]) for name in COLUMNS}
        points = Setpoints(
            **columns,
            position=to_radians(np.reshape(struct["position"], (len(columns["t"]), len(axes))), axes),
            axes=axes,
            period=positive(struct["period"], "period"),
            method=str(struct["method"]),
            settings=settings_from_json(str(struct["settings"]), path),
        )
        check_all_finite(points)
    return points
