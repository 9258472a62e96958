"""A recorded stream, as a Response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.formats.metadata import to_radians
from splinefeed.records import Array, Response


def response_of(samples: Array, axes: tuple[str, ...], period: float, settings: Mapping[str, Any]) -> Response:
    """What HAL sampled at its servo ticks, from the last one before the stream's first row on.

    samples (n, columns)  sample number, row, rows in the FIFO, commands, positions, underruns; rotary axes in degrees.
    Positions are the measured ones; the control output is unknown, 0.
    Raises InputError where no row was taken.
    """
    row = samples[:, 1].astype(np.int64) if len(samples) else np.zeros(0, dtype=np.int64)
    changes = np.flatnonzero(np.diff(row))
    if not len(changes):
        raise InputError("nothing was recorded: the controller took no row")
    first = int(changes[0])
    kept, count = samples[first:], len(axes)
    command, measured = (to_radians(kept[:, k : k + count], axes) for k in (3, 3 + count))
    shape = command.shape
    lost = int(np.sum(np.diff(kept[:, 0]) - 1.0))
    before = int(row[first + 1]) - 1
    return Response(
        t=(kept[:, 0] - kept[0, 0]) * period,
        command=command,
        position=measured,
        measured=measured,
        output=np.zeros(shape),
        saturated=np.zeros(shape, dtype=np.bool_),
        axes=axes,
        period=period,
        row=np.maximum(row[first:] - before, 0) * (np.arange(len(kept)) > 0),
        depth=kept[:, 2].astype(np.int64),
        underruns=(kept[:, -1] - kept[0, -1]).astype(np.int64),
        settings={**settings, "samples_lost": lost, "output": "not recorded"},
    )
