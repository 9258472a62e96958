"""Setpoints to and from a MATLAB .mat file: one struct `setpoints`, rotary axes in degrees."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.formats.metadata import COLUMNS, description
from splinefeed.records import Setpoints

_NAME = "setpoints"


def write(points: Setpoints, file: Path) -> None:
    """Write setpoints."""
    import scipy.io

    said = description(points, "deg")
    cells = {"position": np.array(said["units"]["position"], dtype=object), "period": "s"}
    struct = {
        **said,
        **{name: getattr(points, name) for name in (*COLUMNS, "position")},
        "axes": np.array(points.axes, dtype=object),
        "units": {**said["units"], **cells},
        "period": said.pop("period_s"),
        "settings": json.dumps(said["settings"]),
    }
    del struct["period_s"]
    with file.open("wb") as stream:
        scipy.io.savemat(stream, {_NAME: struct}, do_compression=True, oned_as="column")


def read(file: Path) -> tuple[dict[str, Any], Any]:
    """Columns and description of a file that `write` wrote."""
    import scipy.io

    with file.open("rb") as stream:
        struct = scipy.io.loadmat(stream, variable_names=[_NAME], simplify_cells=True).get(_NAME)
    if not isinstance(struct, dict):
        raise InputError(f"has no struct {_NAME}; was this written by splinefeed?")
    axes = np.atleast_1d(struct["axes"]).tolist()
    columns = {name: np.atleast_1d(struct[name]) for name in COLUMNS}
    position = np.reshape(struct["position"], (len(columns["t"]), len(axes)))
    said = {**struct, "axes": axes, "period_s": struct["period"], "settings": json.loads(struct["settings"])}
    return {**columns, "position": position}, said
