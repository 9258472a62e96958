"""Rows of numbers and texts to and from Parquet (extra `parquet`): one file a part, the schema said beforehand."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from splinefeed.errors import InputError
from splinefeed.files.atomic import atomic_write
from splinefeed.files.native_process import ask

#: Kinds of columns, as pyarrow calls their types.
KINDS = {"number": "float64", "whole": "int64", "text": "string"}
#: Most that the rows of one file unpack to, bytes.
MOST_BYTES = 64 * 2**20


def write(rows: Sequence[Mapping[str, Any]], columns: Mapping[str, str], path: str | os.PathLike[str]) -> None:
    """Write rows, whole or not at all; equal rows give equal files.

    Parameters
    ----------
    rows : sequence of mapping
        Values by column.
    columns : mapping of str to str
        Kind of each column, a name in KINDS.
    path : path
        The file.

    Raises
    ------
    InputError
        Where the library is not installed.
    """
    pyarrow, parquet = libraries()
    schema = pyarrow.schema([(name, KINDS[kind]) for name, kind in columns.items()])
    table = pyarrow.table({name: [row.get(name) for row in rows] for name in columns}, schema=schema)
    with atomic_write(path) as temporary:
        parquet.write_table(table, temporary, compression="zstd")


def read(path: str | os.PathLike[str], most: int) -> dict[str, list[Any]]:
    """Read the columns of a file, in a process of its own.

    Parameters
    ----------
    path : path
        The file.
    most : int
        Rows that it may have.

    Returns
    -------
    dict of str to list
        Values by column.

    Raises
    ------
    FormatError
        For what is no such file.
    """
    columns: dict[str, list[Any]] = ask("formats.rows_parquet", "contents", path, most=most)[0]
    return columns


def contents(file: Path, most: int) -> tuple[dict[str, list[Any]], dict[str, Any]]:
    """Return the columns of a file; runs in the process that may die over a damaged one."""
    _, parquet = libraries()
    with parquet.ParquetFile(file) as source:
        if source.metadata.num_rows > most:
            raise InputError(f"has {source.metadata.num_rows} rows; at most {most} stand in one file")
        table = source.read()
    if table.nbytes > MOST_BYTES:
        raise InputError(f"unpacks to more than {MOST_BYTES // 2**20} MB; that is not {most} rows of a sweep")
    return table.to_pydict(), {}


def libraries() -> tuple[Any, Any]:
    """Return pyarrow and its part for Parquet; InputError with the mend where they are not installed."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise InputError("Parquet needs pyarrow: pip install 'splinefeed[parquet]'") from None
    return pyarrow, parquet
