"""Time laws and limits to and from HDF5."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from splinefeed.errors import FormatError, LimitsError
from splinefeed.formats import hdf5
from splinefeed.formats.limits_toml import KINDS, unit_of
from splinefeed.formats.metadata import settings_from_json, settings_to_json
from splinefeed.records import ROTARY_AXES, Limits, TimeLaw, positive


def _unit_of(limit: str) -> str | None:
    """The unit of a limit as `Limits.as_dict` names it; None for what is not a limit."""
    name, _, axis = limit.partition(".")
    unit = unit_of(name)
    return unit.replace("mm", "rad") if unit and axis in ROTARY_AXES else unit


def save_law(law: TimeLaw, path: str | os.PathLike[str]) -> None:
    """Write a time law, bit for bit."""
    with hdf5.create(path, "TimeLaw") as (file, _):
        for name, unit in (("breaks", "s"), ("coefficients", "mm/s^k in column k")):
            file.create_dataset(name, data=getattr(law, name)).attrs["units"] = unit
        file.attrs["strategy"] = law.strategy
        if law.period is not None:
            file.attrs["period"] = law.period
            file.attrs["period_units"] = "s"
        file.attrs["notes"] = json.dumps(law.notes)
        file.attrs["settings"] = settings_to_json(law.settings)


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
        settings=settings_from_json(hdf5.text_attribute(file, "settings", path), path),
    )


def save_limits(limits: Limits, path: str | os.PathLike[str]) -> None:
    """Write limits, each as a number with its unit; LimitsError for those that only Python can say."""
    for name in limits.as_dict():
        if _unit_of(name) is None:
            raise LimitsError(f"{name}: a file holds no limits of combinations of axes and no torques; leave it out")
    with hdf5.create(path, "Limits") as (file, _):
        for name, value in limits.as_dict().items():
            file.create_dataset(name, data=value).attrs["units"] = _unit_of(name)


def read_limits(file: Any, path: Path) -> Limits:
    """The limits in an open HDF5 file."""
    unknown = sorted(name for name in file if _unit_of(name) is None)
    if unknown:
        raise FormatError(f"{path}: dataset {unknown[0]}: is not a limit known here; known are {', '.join(KINDS)}")
    return Limits.from_dict({name: float(hdf5.array(file, name, path, 0)) for name in file})
