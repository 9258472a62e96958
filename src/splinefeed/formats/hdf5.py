"""Records to and from HDF5, bit for bit, long ones chunk by chunk: datasets with units, the rest as attributes.

Files are written in the layout of HDF5 1.8 with texts of fixed length: so all that says what is where is covered by
checksums of the library, and a damaged file is refused.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

import splinefeed
from splinefeed.errors import InputError, LimitsError
from splinefeed.files.metadata import (
    COLUMNS,
    MAYBE,
    SCHEMA,
    Sink,
    axes_of,
    axis_units,
    check_columns,
    check_schema,
    naming,
    to_json,
    units_of,
)
from splinefeed.files.native_process import ask
from splinefeed.files.sizes import MAX_AXES, MAX_TICKS, MAX_TICKS_IN_CHUNKS
from splinefeed.records import ORDERS, STREAM_COLUMNS, Limits, Response, Setpoints, TimeLaw, field_of, positive, unit_of

#: Records of columns, by name.
RECORDS: dict[str, type[Any]] = {each.__name__: each for each in (Setpoints, Response, TimeLaw)}
#: Their columns with the dimensions and the unit of each, None: that of the axis. All else of a record is an attribute.
DATASETS: dict[str, tuple[int, str | None]] = {
    **{name: (1, unit) for name, unit in COLUMNS.items()},
    **dict.fromkeys(("position", "command", "measured"), (2, None)),
    "output": (2, "V"),
    "saturated": (2, "1"),
    "contour_error": (1, "mm"),
    **dict.fromkeys(STREAM_COLUMNS, (1, "1")),
    "breaks": (1, "s"),
    "coefficients": (2, "mm/s^k in column k"),
}
#: Attributes that are written as JSON.
_AS_JSON = ("settings", "notes")
#: What attributes must be.
_KINDS = {"axes": tuple, "method": str, "strategy": str, "stopped": str, "settings": dict, "notes": list}
#: Rows of a chunk on disk and how it is packed: the best of size by speed among gzip 1, 4, 6 and lzf, with and without
#: shuffling the bytes, on a million ticks; gzip is in every build of HDF5, MATLAB's too.
CHUNK_ROWS = 8192
PACKING: dict[str, Any] = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
#: What gzip reaches at the most (1032 to 1), rounded up: a dataset that claims more than that holds nothing, and
#: reading it would fill the memory with zeros.
MOST_PACKED = 1100
#: Most limits of one file, those of single axes counted each.
MOST_LIMITS = 1000
_NO_HARM_BYTES = 2**20


class _Output:
    """The file that HDF5 writes to: it keeps the first error and lets what follows go nowhere.

    HDF5 cannot bear a write that fails (on a full disk, say): it tries again in closing, fails again, and crashes
    Python at its end. So the error waits here, and HDF5 closes in peace.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self.stream = stream
        self.error: BaseException | None = None

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def attempt(*given: Any) -> Any:
            try:
                return getattr(self.stream, name)(*given) if self.error is None else 0
            except BaseException as error:  # Ctrl-C too: it must not pass through HDF5
                self.error = error
                return 0

        return attempt

    def check(self) -> None:
        """Raise what went wrong since the beginning, if anything did."""
        if self.error is not None:
            raise self.error


def write_hdf5(file: Path) -> Sink[Any]:
    """Write a record that comes in parts, of which one is in memory at a time."""
    import h5py

    with file.open("r+b") as stream:
        output = _Output(stream)
        with h5py.File(output, "w", libver=("v108", "v108")) as made:
            datasets: dict[str, Any] = {}  # open all along: a chunk is packed when it is full
            while (given := (yield)) is not None:
                part = given
                if isinstance(part, Limits):
                    _write_limits(made, part)
                    continue
                datasets = datasets or _create(made, part)
                for name, dataset in datasets.items():
                    values = getattr(part, name)
                    dataset.resize(len(dataset) + len(values), axis=0)
                    dataset[len(dataset) - len(values) :] = values
                output.check()
            _say(made, part)
        output.check()


def _columns(kind: Any) -> list[str]:
    return [each.name for each in fields(kind) if each.name in DATASETS]


def _attributes(kind: Any) -> list[str]:
    return [each.name for each in fields(kind) if each.name not in DATASETS]


def _create(file: Any, first: Any) -> dict[str, Any]:
    """Empty datasets for the columns of parts such as `first`, with their units."""
    datasets, units = {}, {name: unit for name, (_, unit) in DATASETS.items()}
    units |= units_of(first.axes, getattr(first, "settings", {})) if hasattr(first, "axes") else {}
    for name in _columns(first):
        if (values := getattr(first, name)) is not None:
            wide, unit = values.shape[1:], units[name]
            kind = np.uint8 if values.dtype == np.bool_ else values.dtype
            datasets[name] = file.create_dataset(
                name, shape=(0, *wide), maxshape=(None, *wide), chunks=(CHUNK_ROWS, *wide), dtype=kind, **PACKING
            )
            datasets[name].attrs["units"] = _text(axis_units(first.axes, "rad") if unit is None else unit)
    return datasets


def _write_limits(file: Any, limits: Limits) -> None:
    """Each limit as a number with its unit; LimitsError for those that only Python can say."""
    for name, value in limits.as_dict().items():
        if field_of(name) not in ORDERS:
            raise LimitsError(f"{name}: a file holds no limits of combinations of axes and no torques; leave it out")
        file.create_dataset(name, data=value).attrs["units"] = _text(unit_of(name).replace("deg", "rad"))


def _say(file: Any, record: Any) -> None:
    """All of a record that is no column, as attributes of the file."""
    said = {"record": type(record).__name__, "program": f"splinefeed {splinefeed.__version__}"}
    if not isinstance(record, Limits):
        values = {name: getattr(record, name) for name in _attributes(record)}
        said |= {name: to_json(value) if name in _AS_JSON else value for name, value in values.items()}
    file.attrs["schema"] = SCHEMA
    for name, value in said.items():
        if isinstance(value, float):
            file.attrs[name] = value
            file.attrs[f"{name}_units"] = _text("s")
        elif value is not None:
            file.attrs[name] = _text(value)


def _text(words: Any) -> Any:
    """One text or several, of fixed length."""
    import h5py

    encoded = np.char.encode(np.asarray(words, dtype=str), "utf-8")
    return encoded.astype(h5py.string_dtype("utf-8", max(encoded.dtype.itemsize, 1)))


# --- back -------------------------------------------------------------------------------------------------------------


def load(path: str | os.PathLike[str]) -> Any:
    """Load the record in the HDF5 file at `path`; FormatError for all that is not sound."""
    (record,) = _records(path, (*RECORDS, "Limits"))
    return record


def load_chunks(path: str | os.PathLike[str], rows: int) -> Iterator[Setpoints]:
    """Load the setpoints in the HDF5 file at `path`, `rows` ticks at a time, one chunk in memory."""
    return _records(path, ("Setpoints",), rows)


def _records(path: str | os.PathLike[str], known: Sequence[str], rows: int | None = None) -> Iterator[Any]:
    """The record in a file, one of those `known`: whole, or `rows` ticks at a time.

    The library works in a process of its own, which opens the file again for each chunk.
    """
    start = 0
    while True:
        said, columns = ask("formats.hdf5", "contents", path, known=list(known), start=start, rows=rows)
        with naming(path, "HDF5 file"):
            if said["record"] == "Limits":
                made: Any = Limits.from_dict(said["limits"])
            else:
                own = said["own"]
                own |= {name: tuple(own[name]) for name in ("axes", "notes") if name in own}
                if "axes" in own:
                    own["axes"] = axes_of({"axes": own["axes"], "units": {"position": said["units"]}})
                made = RECORDS[said["record"]](**columns, **own)
                check_columns(made)
        yield made
        start += rows or 0
        if rows is None or start >= said["ticks"]:
            return


def contents(
    file: Path, known: Sequence[str], start: int = 0, rows: int | None = None
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return what an HDF5 file holds; runs in the process that may die over a damaged file, see `native_process`.

    Parameters
    ----------
    file : path
        The file.
    known : sequence of str
        Names of records, one of which it must hold.
    start : int, optional
        The first tick.
    rows : int, optional
        How many; by default all.

    Returns
    -------
    description, columns : dict
        Of the record.
    """
    import h5py

    with naming(file, "HDF5 file"), h5py.File(file, "r") as opened:
        record = str(_attribute(opened, "record"))
        if record not in known:
            raise InputError(f"holds a record {record[:40]!r}; known are {', '.join(known)}")
        check_schema(_attribute(opened, "schema"))
        if record == "Limits":
            if len(opened) > MOST_LIMITS:
                raise InputError(f"holds more than {MOST_LIMITS} limits")
            return {"record": record, "limits": {name: float(_dataset(opened, name, 0)[()]) for name in opened}}, {}
        kind, most = RECORDS[record], MAX_TICKS if rows is None else MAX_TICKS_IN_CHUNKS
        names = [name for name in _columns(kind) if name in opened or name not in MAYBE]
        datasets = {name: _dataset(opened, name, DATASETS[name][0], most) for name in names}
        own = _said(opened, kind)
        ticks = {name: len(dataset) for name, dataset in datasets.items()}
        if rows is not None and len(set(ticks.values())) > 1:
            raise InputError(f"the datasets have different numbers of ticks: {ticks}")
        part = slice(start, None if rows is None else start + rows)
        position = datasets.get("position")
        unitless = position is None or "units" not in position.attrs
        units = [] if unitless else np.atleast_1d(_attribute(position, "units")).astype(str).tolist()
        said = {"record": record, "own": own, "ticks": max(ticks.values(), default=0), "units": units}
        return said, {name: dataset[part] for name, dataset in datasets.items()}


def _dataset(file: Any, name: str, ndim: int, most: int = MAX_TICKS) -> Any:
    """The dataset `name`, unread: in this file itself, numbers of `ndim` dimensions, of `most` ticks at most."""
    import h5py

    link = file.get(name, getlink=True)
    found = file[name] if isinstance(link, h5py.HardLink) else None  # other links could open other files of the user
    if not isinstance(found, h5py.Dataset) or found.external or found.is_virtual:
        raise InputError(f"dataset {name}: is missing or not a dataset of this file")
    words = f"dataset {name}: has shape {found.shape} of {found.dtype}"
    if found.ndim != ndim or found.dtype.kind not in "fiu" or found.dtype.itemsize > 8:
        raise InputError(f"{words}; expected numbers in {ndim} dimension(s)")
    if found.size > most * MAX_AXES:
        raise InputError(f"{words}; at most {most} ticks can be read")
    if found.nbytes > MOST_PACKED * found.id.get_storage_size() + _NO_HARM_BYTES:
        raise InputError(f"{words}, but far fewer bytes on disk than that packs into; the file is damaged")
    return found


def _said(file: Any, kind: type[Any]) -> dict[str, Any]:
    """The attributes of a record; what the file does not say has its default."""
    said: dict[str, Any] = {}
    for name in (name for name in _attributes(kind) if name in file.attrs):
        value = _attribute(file, name)
        value = json.loads(value) if name in _AS_JSON else value
        if not isinstance(value, _KINDS.get(name, object)):
            raise InputError(f"attribute {name}: is of the wrong type")
        said[name] = positive(value, name) if name == "period" else value
    return said | ({"notes": tuple(map(str, said["notes"]))} if "notes" in said else {})


def _attribute(file: Any, name: str) -> Any:
    """The attribute `name` of the file, a text, several, or a number."""
    from h5py import h5t

    if name not in file.attrs:
        raise InputError(f"attribute {name}: is missing; was this written by splinefeed?")
    # h5py reads a list of variable length, as a changed byte makes of a text, by a segmentation fault
    if file.attrs.get_id(name).get_type().get_class() not in (h5t.STRING, h5t.INTEGER, h5t.FLOAT):
        raise InputError(f"attribute {name}: is neither text nor a number; the file is damaged")
    value = file.attrs[name]
    texts = np.vectorize(lambda each: each.decode() if isinstance(each, bytes) else each, otypes=[object])(value)
    return tuple(texts.tolist()) if texts.ndim else texts.item()
