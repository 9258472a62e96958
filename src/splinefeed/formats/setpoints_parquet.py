"""Setpoints to and from Parquet (extra `parquet`): columns named as in CSV, bit for bit, rotary axes in rad.

The schema's metadata holds under `splinefeed` a JSON text with units, axes, period, method and settings, and every
column its `unit`.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.metadata import (
    COLUMNS,
    axis_units,
    check_all_finite,
    checked_chunks,
    column_names,
    description,
    read_description,
    sound_file,
)
from splinefeed.formats.sizes import MAX_AXES, MAX_TICKS
from splinefeed.formats.source import check_file
from splinefeed.records import Setpoints

_KEY = b"splinefeed"
#: Rows that are packed together at the most; readers work group by group.
ROW_GROUP = 2**17


def save(record: Setpoints | Iterable[Setpoints], path: str | os.PathLike[str]) -> None:
    """Write setpoints, whole or as an iterable of chunks of which only one is in memory at a time."""
    pyarrow, parquet = _libraries(path)
    with atomic_write(path) as temporary, temporary.open("wb") as stream:
        writer: Any = None
        try:
            for chunk in checked_chunks(record, path):
                if writer is None:
                    schema = _schema(pyarrow, chunk)
                    # doubles of a smooth motion share their upper bytes: split by byte they pack to about a half
                    writer = parquet.ParquetWriter(
                        stream,
                        schema,
                        compression="zstd",
                        use_dictionary=False,
                        column_encoding={
                            field.name: "BYTE_STREAM_SPLIT" for field in schema if field.type == pyarrow.float64()
                        },
                    )
                columns = [getattr(chunk, name) for name in COLUMNS] + list(chunk.position.T)
                table = pyarrow.table([pyarrow.array(np.ascontiguousarray(each)) for each in columns], schema=schema)
                writer.write_table(table, row_group_size=ROW_GROUP)
        finally:
            if writer is not None:
                writer.close()


def load(path: str | os.PathLike[str]) -> Setpoints:
    """Read setpoints that `save` wrote; FormatError for a file that is cut off, changed, or something else."""
    file = check_file(path)
    _, parquet = _libraries(path)
    with sound_file(path, "Parquet file"):
        with parquet.ParquetFile(file) as source:
            metadata = (source.schema_arrow.metadata or {}).get(_KEY)
            if metadata is None:
                raise FormatError(f"{path}: has no metadata of splinefeed; was this written by it?")
            said = read_description(metadata, f"{path}: metadata")
            axes = said["axes"]
            names = column_names(axes, "rad")
            if source.schema_arrow.names != names or len(axes) > MAX_AXES:
                raise FormatError(f"{path}: expected the columns {', '.join(names)}")
            if source.metadata.num_rows > MAX_TICKS:
                raise FormatError(f"{path}: has {source.metadata.num_rows} rows; at most {MAX_TICKS} can be read")
            table = source.read()
        values = [table.column(name).to_numpy() for name in names]
        columns = dict(zip(COLUMNS, values, strict=False))
        points = Setpoints(**columns, position=np.column_stack(values[len(COLUMNS) :]), **said)
        check_all_finite(points)
    return points


def _schema(pyarrow: Any, first: Setpoints) -> Any:
    units = [*COLUMNS.values(), *axis_units(first.axes, "rad")]
    kinds = [pyarrow.int64() if name == "curve" else pyarrow.float64() for name in COLUMNS]
    kinds += [pyarrow.float64()] * len(first.axes)
    fields = [
        pyarrow.field(name, kind, nullable=False, metadata={"unit": unit})
        for name, kind, unit in zip(column_names(first.axes, "rad"), kinds, units, strict=True)
    ]
    return pyarrow.schema(fields, metadata={_KEY: json.dumps(description(first, "rad"))})


def _libraries(path: str | os.PathLike[str]) -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise FormatError(
            f"{Path(path)}: Parquet needs pyarrow, which is not installed; run: pip install 'splinefeed[parquet]'"
        ) from None
    return pyarrow, pyarrow.parquet
