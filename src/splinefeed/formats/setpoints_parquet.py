"""Setpoints to and from Parquet (extra `parquet`): columns named as in CSV, bit for bit, rotary axes in rad.

The schema's metadata holds under `splinefeed` a JSON text with units, axes, period, method and settings, and every
column its `unit`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.formats.metadata import COLUMNS, axis_units, column_names, description
from splinefeed.formats.rows_parquet import libraries
from splinefeed.formats.sizes import MAX_AXES, MAX_TICKS
from splinefeed.records import Setpoints

_KEY = b"splinefeed"
#: Rows that are packed together at the most; readers work group by group.
ROW_GROUP = 2**17


def write(chunks: Iterable[Setpoints], file: Path) -> None:
    """Write chunks of setpoints."""
    pyarrow, parquet = libraries()
    with file.open("wb") as stream, ExitStack() as stack:
        writer: Any = None
        for chunk in chunks:
            if writer is None:
                schema = _schema(pyarrow, chunk)
                # doubles of a smooth motion share their upper bytes: split by byte they pack to about a half
                split = {each.name: "BYTE_STREAM_SPLIT" for each in schema if each.type == pyarrow.float64()}
                writer = parquet.ParquetWriter(
                    stream, schema, compression="zstd", use_dictionary=False, column_encoding=split
                )
                stack.enter_context(writer)
            columns = [getattr(chunk, name) for name in COLUMNS] + list(chunk.position.T)
            table = pyarrow.table([pyarrow.array(np.ascontiguousarray(each)) for each in columns], schema=schema)
            writer.write_table(table, row_group_size=ROW_GROUP)


def read(file: Path) -> tuple[dict[str, Any], Any]:
    """Columns and description of a file that `write` wrote."""
    _, parquet = libraries()
    with parquet.ParquetFile(file) as source:
        metadata = (source.schema_arrow.metadata or {}).get(_KEY)
        if metadata is None:
            raise InputError("has no metadata of splinefeed; was this written by it?")
        said = json.loads(metadata)
        names = column_names(said["axes"], "rad")
        if source.schema_arrow.names != names or len(said["axes"]) > MAX_AXES:
            raise InputError(f"expected the columns {', '.join(names)}")
        if source.metadata.num_rows > MAX_TICKS:
            raise InputError(f"has {source.metadata.num_rows} rows; at most {MAX_TICKS} can be read")
        table = source.read()
    values = [table.column(name).to_numpy() for name in names]
    return {**dict(zip(COLUMNS, values, strict=False)), "position": np.column_stack(values[len(COLUMNS) :])}, said


def _schema(pyarrow: Any, first: Setpoints) -> Any:
    units = [*COLUMNS.values(), *axis_units(first.axes, "rad")]
    fields = [
        pyarrow.field(
            name, pyarrow.int64() if name == "curve" else pyarrow.float64(), nullable=False, metadata={"unit": unit}
        )
        for name, unit in zip(column_names(first.axes, "rad"), units, strict=True)
    ]
    return pyarrow.schema(fields, metadata={_KEY: json.dumps(description(first, "rad"))})
