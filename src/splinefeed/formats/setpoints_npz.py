"""Setpoints to and from NumPy's .npz: one array a column, bit for bit, rotary axes in rad; nothing is pickled.

`numpy.load` reads it: `t`, `curve`, `u`, `s`, `feed` (n,), `position` (n, axes), and `metadata`, a JSON text with
units, axes, period, method and settings.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import zipfile
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from splinefeed.errors import FormatError
from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.metadata import (
    COLUMNS,
    check_all_finite,
    checked_chunks,
    description,
    read_description,
    sound_file,
)
from splinefeed.formats.sizes import MAX_AXES, MAX_TICKS
from splinefeed.formats.source import check_file
from splinefeed.records import Setpoints

_NAMES = (*COLUMNS, "position")
_METADATA = "metadata"
#: Longest text of metadata that is read, bytes.
MAX_METADATA_BYTES = 64 * 2**20
#: A .npy begins with a few lines on what is in it; more is none.
_LONGEST_HEADER = 4096


def save(record: Setpoints | Iterable[Setpoints], path: str | os.PathLike[str]) -> None:
    """Write setpoints, whole or as an iterable of chunks of which only one is in memory at a time.

    The format wants every column in one piece and its length before its numbers, so that each column waits in a
    nameless file of its own, beside the target, until the last chunk has come.
    """
    with atomic_write(path) as temporary, ExitStack() as stack:
        columns = {name: stack.enter_context(TemporaryFile(dir=temporary.parent)) for name in _NAMES}
        first: Setpoints | None = None
        ticks = 0
        for chunk in checked_chunks(record, path):
            if first is None:
                first = chunk
                metadata = json.dumps(description(chunk, "rad"))
            for name, stream in columns.items():
                stream.write(getattr(chunk, name).tobytes())
            ticks += len(chunk)
        assert first is not None  # checked_chunks refuses to give none
        with zipfile.ZipFile(temporary, "w") as archive:
            for name, stream in columns.items():
                values = getattr(first, name)
                stream.seek(0)
                with _member(archive, name, values.dtype, (ticks, *values.shape[1:])) as member:
                    shutil.copyfileobj(stream, member, 2**20)
            text = np.array(metadata)
            with _member(archive, _METADATA, text.dtype, ()) as member:
                member.write(text.tobytes())


def load(path: str | os.PathLike[str]) -> Setpoints:
    """Read setpoints that `save` wrote; FormatError for a file that is cut off, changed, or something else."""
    file = check_file(path)
    with sound_file(path, "NumPy archive"):
        with zipfile.ZipFile(file) as archive:
            text = _array(archive, _METADATA, path)
            if text.dtype.kind != "U" or text.ndim != 0:
                raise FormatError(f"{path}: {_METADATA}: is not text")
            said = read_description(str(text[()]), f"{path}: {_METADATA}")
            columns: dict[str, Any] = {name: _array(archive, name, path) for name in _NAMES}
        points = Setpoints(**columns, **said)
        check_all_finite(points)
    return points


def _member(archive: zipfile.ZipFile, name: str, dtype: np.dtype[Any], shape: tuple[int, ...]) -> IO[bytes]:
    """The open file `name`.npy in `archive`, its header written."""
    member = archive.open(f"{name}.npy", "w", force_zip64=True)
    header = {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(member, header)
    return member


def _array(archive: zipfile.ZipFile, name: str, path: str | os.PathLike[str]) -> NDArray[Any]:
    """The array `name`, whose header must agree with the bytes that are there, before memory is allocated for them."""
    place = f"{Path(path)}: {name}"
    try:
        info = archive.getinfo(f"{name}.npy")
    except KeyError:
        raise FormatError(f"{place}: is missing; was this written by splinefeed?") from None
    if info.compress_type != zipfile.ZIP_STORED:
        raise FormatError(f"{place}: is packed; splinefeed writes its columns as they are")
    with archive.open(info) as member:
        version = np.lib.format.read_magic(member)
        if version != (1, 0):
            raise FormatError(f"{place}: is of .npy version {version}; expected (1, 0)")
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(member, max_header_size=_LONGEST_HEADER)
        size = math.prod(shape) * dtype.itemsize
        most = MAX_METADATA_BYTES if name == _METADATA else MAX_TICKS * MAX_AXES * 8
        if fortran or dtype.hasobject or dtype.kind not in "fiU" or size > most:
            raise FormatError(f"{place}: has shape {shape} of {dtype}; this is not a column of setpoints")
        if size != info.file_size - member.tell():
            raise FormatError(f"{place}: says {size} bytes, but {info.file_size - member.tell()} are there")
        return np.frombuffer(member.read(), dtype=dtype).reshape(shape)
