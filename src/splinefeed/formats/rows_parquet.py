"""Rows of numbers and texts to and from Parquet (extra `parquet`): one file a part, the schema said beforehand."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from splinefeed.errors import FormatError, InputError
from splinefeed.files.atomic import atomic_write

#: Kinds of columns, as pyarrow calls their types.
KINDS = {"number": "float64", "whole": "int64", "text": "string"}


def write(rows: Sequence[Mapping[str, Any]], columns: Mapping[str, str], path: str | os.PathLike[str]) -> None:
    """Write rows under `columns` (name -> kind), whole or not at all; equal rows give equal files."""
    pyarrow, parquet = libraries()
    schema = pyarrow.schema([(name, KINDS[kind]) for name, kind in columns.items()])
    table = pyarrow.table({name: [row.get(name) for row in rows] for name in columns}, schema=schema)
    with atomic_write(path) as temporary:
        parquet.write_table(table, temporary, compression="zstd")


def read(paths: Sequence[str | os.PathLike[str]]) -> dict[str, list[Any]]:
    """Columns of all files, one after the other; FormatError for a file that is cut off or no Parquet."""
    pyarrow, parquet = libraries()
    tables = []
    for path in paths:
        try:
            tables.append(parquet.read_table(path))
        except (OSError, pyarrow.ArrowException) as error:
            raise FormatError(f"{path}: cannot be read as Parquet: {str(error).splitlines()[0]}") from None
    if not tables:
        return {}
    whole: dict[str, list[Any]] = pyarrow.concat_tables(tables).to_pydict()
    return whole


def libraries() -> tuple[Any, Any]:
    """pyarrow and its part for Parquet; InputError with the mend where they are not installed."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise InputError("Parquet needs pyarrow: pip install 'splinefeed[parquet]'") from None
    return pyarrow, parquet
