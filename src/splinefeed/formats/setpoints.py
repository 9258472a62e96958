"""Save and load any record; the suffix of the file's name says the format."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from splinefeed.errors import FormatError
from splinefeed.formats import hdf5, plans_hdf5, setpoints_csv, setpoints_hdf5, setpoints_mat
from splinefeed.records import Limits, Setpoints, TimeLaw

Record = Setpoints | TimeLaw | Limits

_HDF5_READERS: dict[str, Callable[[Any, Path], Record]] = {
    "Setpoints": setpoints_hdf5.read,
    "TimeLaw": plans_hdf5.read_law,
    "Limits": plans_hdf5.read_limits,
}
_HDF5 = (".h5", ".hdf5")


def save(record: Record | Iterable[Setpoints], path: str | os.PathLike[str]) -> None:
    """Save a record: any as HDF5 (.h5, .hdf5), setpoints as .csv and .mat too; whole or not at all.

    Setpoints may come as an iterable of chunks, of which HDF5 and CSV hold one at a time in memory.
    """
    suffix = _suffix(path)
    if isinstance(record, TimeLaw | Limits) and suffix not in _HDF5:
        raise FormatError(f"{path}: {type(record).__name__} is saved as HDF5 alone; name the file .h5")
    if isinstance(record, TimeLaw):
        plans_hdf5.save_law(record, path)
    elif isinstance(record, Limits):
        plans_hdf5.save_limits(record, path)
    elif suffix == ".csv":
        setpoints_csv.save(record, path)
    elif suffix == ".mat":
        setpoints_mat.save(record, path)
    else:
        setpoints_hdf5.save(record, path)


def load(path: str | os.PathLike[str]) -> Record:
    """Load a record that `save` wrote; a tuple in its settings comes back as a list, for JSON knows no other."""
    suffix = _suffix(path)
    if suffix == ".csv":
        return setpoints_csv.load(path)
    if suffix == ".mat":
        return setpoints_mat.load(path)
    return hdf5.read(path, _HDF5_READERS)


def _suffix(path: str | os.PathLike[str]) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in (*_HDF5, ".csv", ".mat"):
        raise FormatError(f"{path}: a record's file is named .h5, .hdf5, .csv or .mat")
    return suffix
