"""Setpoints to and from NumPy's .npz: one array a column, bit for bit, rotary axes in rad; nothing is pickled.

`numpy.load` reads it: `t`, `curve`, `u`, `s`, `feed` (n,), `position` (n, axes), and `metadata`, a JSON text with
units, axes, period, method and settings.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.formats.metadata import COLUMNS, description
from splinefeed.records import Setpoints


def write(points: Setpoints, file: Path) -> None:
    """Write setpoints."""
    columns = {name: getattr(points, name) for name in (*COLUMNS, "position")}
    with file.open("wb") as stream:
        np.savez(stream, **columns, metadata=np.array(json.dumps(description(points, "rad"))))


def read(file: Path) -> tuple[dict[str, Any], Any]:
    """Columns and description of a file that `write` wrote."""
    with file.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
        if any(member.compress_type for member in archive.zip.infolist()):  # few bytes could fill the memory
            raise InputError("is packed; splinefeed writes its columns as they are")
        return {name: archive[name] for name in (*COLUMNS, "position")}, json.loads(str(archive["metadata"]))
