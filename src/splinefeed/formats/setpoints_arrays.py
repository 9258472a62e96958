"""Setpoints as arrays by name, bit for bit: NumPy's .npz, MATLAB's .mat and Parquet (extra `parquet`)."""

from __future__ import annotations

import json
import struct
import zlib
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.files.metadata import (
    COLUMNS,
    Sink,
    axes_of,
    axis_units,
    by_name,
    column_names,
    columns_of,
    description,
    settings_of,
    units_of,
)
from splinefeed.files.native_process import ask
from splinefeed.files.sizes import MAX_AXES, MAX_TICKS
from splinefeed.files.source import check_size
from splinefeed.formats.rows_parquet import libraries
from splinefeed.records import Setpoints

_ARRAYS = (*COLUMNS, "position")
_KINDS = {name: np.int64 if name == "curve" else np.float64 for name in COLUMNS}
#: Largest .mat file that is read, bytes: all its ticks are in memory at once.
MAX_MAT_BYTES = 2**30
#: The struct of a .mat file, and the key of the description in Parquet's schema.
_STRUCT, _KEY = "setpoints", b"splinefeed"
#: Type of packed data in a .mat file.
_PACKED = 15
#: What smooth columns pack to, rounded up generously: what claims to unpack to more holds nothing.
MOST_UNPACKED, NO_HARM_BYTES = 50, 2**26
#: Rows of Parquet that are packed together at the most; readers work group by group.
ROW_GROUP = 2**17


def write_npz(points: Setpoints, file: Path) -> None:
    """Write setpoints as `t`, `curve`, `u`, `s`, `feed` (n,), `position` (n, axes) and `metadata`, a JSON text."""
    metadata = np.array(json.dumps(description(points, "rad")))
    with file.open("wb") as stream:
        np.savez(stream, metadata=metadata, **{name: getattr(points, name) for name in _ARRAYS})


def read_npz(file: Path) -> tuple[dict[str, Any], Any]:
    """Read columns and description of a .npz file; nothing in it is unpickled."""
    with file.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
        if any(member.compress_type for member in archive.zip.infolist()):  # few bytes could fill the memory
            raise InputError("is packed; splinefeed writes its columns as they are")
        return {name: archive[name] for name in _ARRAYS}, json.loads(str(archive["metadata"]))


def write_mat(points: Setpoints, file: Path) -> None:
    """Write setpoints as one struct, texts in cells, settings as a JSON text."""
    import scipy.io

    said = description(points, "deg")
    units = {**said["units"], "position": np.array(said["units"]["position"], dtype=object), "period": "s"}
    struct = {
        **{"period" if name == "period_s" else name: value for name, value in said.items()},
        **{name: getattr(points, name) for name in _ARRAYS},
        "axes": np.array([str(axis) for axis in points.axes], dtype=object),  # of a Joint SciPy makes a struct
        "units": units,
        "settings": json.dumps(said["settings"]),
    }
    with file.open("wb") as stream:
        scipy.io.savemat(stream, {_STRUCT: struct}, do_compression=True, oned_as="column")


def read_mat(file: Path) -> tuple[dict[str, Any], Any]:
    """Read columns and description of a .mat file, by SciPy in a process of its own."""
    check_size(file, MAX_MAT_BYTES)
    said, columns = ask("formats.setpoints_arrays", "mat_contents", file)
    return columns, said


def mat_contents(file: Path) -> tuple[Any, dict[str, Any]]:
    """Return description and columns of a .mat file; runs in the process that may die over a damaged file."""
    import scipy.io

    _check_unpacked(file.read_bytes())
    found = scipy.io.loadmat(file, variable_names=[_STRUCT], simplify_cells=True).get(_STRUCT)
    fields = (*_ARRAYS, "record", "schema", "method", "period", "axes", "settings")
    missing = fields if not isinstance(found, dict) else [name for name in fields if name not in found]
    if missing:
        raise InputError(f"has no struct {_STRUCT} with a field {missing[0]}; was this written by splinefeed?")
    axes = [str(axis) for axis in np.atleast_1d(found["axes"])]
    columns = {name: np.atleast_1d(found[name]).astype(kind) for name, kind in _KINDS.items()}
    position = np.asarray(found["position"], dtype=np.float64).reshape(-1, len(axes))
    said = {
        "record": found["record"], "method": found["method"], "axes": axes,
        "schema": int(found["schema"]), "period_s": float(found["period"]),
        "settings": json.loads(str(found["settings"])),
    }  # fmt: skip
    return said, {**columns, "position": np.ascontiguousarray(position)}


def _check_unpacked(content: bytes) -> None:
    """Refuse packed data that is far more than it packs to: reading it would fill the memory with nothing.

    References
    ----------
    .. [1] The MathWorks, "MAT-File Format", chapter 1 (level 5).
    """
    order, left, at = "<" if content[126:128] == b"IM" else ">", MOST_UNPACKED * len(content) + NO_HARM_BYTES, 128
    while at + 8 <= len(content):
        kind, size = struct.unpack_from(f"{order}II", content, at)
        if kind == _PACKED:
            packed = zlib.decompressobj()
            left -= len(packed.decompress(memoryview(content)[at + 8 : at + 8 + size], left))
            if packed.unconsumed_tail or left <= 0:
                raise InputError("unpacks to far more than it packs; it is damaged")
        at += 8 + size


def write_parquet(file: Path) -> Sink[Setpoints]:
    """Write chunks of setpoints under the names that columns of a CSV have, and the description as JSON."""
    pyarrow, parquet = libraries()
    with file.open("wb") as stream, ExitStack() as stack:
        writer: Any = None
        while (chunk := (yield)) is not None:
            if writer is None:
                names, units = (
                    column_names(chunk.axes, "rad", chunk.settings),
                    [*units_of(chunk.axes, chunk.settings).values(), *axis_units(chunk.axes, "rad")],
                )
                kinds = [pyarrow.int64() if name == "curve" else pyarrow.float64() for name in names]
                fields = [
                    pyarrow.field(name, kind, nullable=False, metadata={"unit": unit})
                    for name, kind, unit in zip(names, kinds, units, strict=True)
                ]
                schema = pyarrow.schema(fields, metadata={_KEY: json.dumps(description(chunk, "rad"))})
                # doubles of a smooth motion share their upper bytes: split by byte they pack to about a half
                split = {each.name: "BYTE_STREAM_SPLIT" for each in schema if each.type == pyarrow.float64()}
                writer = parquet.ParquetWriter(
                    stream, schema, compression="zstd", use_dictionary=False, column_encoding=split
                )
                stack.enter_context(writer)
            columns = [pyarrow.array(np.ascontiguousarray(each)) for each in columns_of(chunk)]
            writer.write_table(pyarrow.table(columns, schema=schema), row_group_size=ROW_GROUP)


def read_parquet(file: Path) -> tuple[dict[str, Any], Any]:
    """Read columns and description of a Parquet file, by its library in a process of its own."""
    said, columns = ask("formats.setpoints_arrays", "parquet_contents", file)
    return by_name(list(columns.values())), said


def parquet_contents(file: Path) -> tuple[Any, dict[str, Any]]:
    """Return description and columns (n,) of a Parquet file; runs in the process that may die over a damaged file."""
    _, parquet = libraries()
    with parquet.ParquetFile(file) as source:
        metadata = (source.schema_arrow.metadata or {}).get(_KEY)
        if metadata is None:
            raise InputError("has no metadata of splinefeed; was this written by it?")
        said = json.loads(metadata)
        names = column_names(axes_of(said), "rad", settings_of(said))
        if source.schema_arrow.names != names or len(said["axes"]) > MAX_AXES:
            raise InputError(f"expected the columns {', '.join(names)}")
        if source.metadata.num_rows > MAX_TICKS:
            raise InputError(f"has {source.metadata.num_rows} rows; at most {MAX_TICKS} can be read")
        if 8 * source.metadata.num_rows * len(names) > MOST_UNPACKED * file.stat().st_size + NO_HARM_BYTES:
            raise InputError(f"has {source.metadata.num_rows} rows in far fewer bytes than they pack to; it is damaged")
        table = source.read()
    return said, {name: np.ascontiguousarray(table.column(name).to_numpy()) for name in names}
