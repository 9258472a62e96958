"""HDF5 files of records: how they are opened, marked, and read with suspicion."""

from __future__ import annotations

import mmap
import os
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from io import FileIO, RawIOBase
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import splinefeed
from splinefeed.errors import FormatError
from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.metadata import SCHEMA, check_schema, sound_file
from splinefeed.formats.sizes import MAX_AXES, MAX_TICKS
from splinefeed.formats.source import check_file

T = TypeVar("T")

#: Rows of a chunk on disk and how it is packed: the best of size by speed among gzip 1, 4, 6 and lzf, with and without
#: shuffling the bytes, on a million ticks; gzip is in every build of HDF5, MATLAB's too.
CHUNK_ROWS = 8192
PACKING: dict[str, Any] = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
#: What gzip reaches at the most (1032 to 1), rounded up: a dataset that claims more than that holds nothing, and
#: reading it would fill the memory with zeros.
MOST_PACKED = 1100
_NO_HARM_BYTES = 2**20
#: How a collection of the global heap begins, and the header of an object in it: index, uses, nothing, size.
_TEXTS, _TEXT = b"GCOL\1\0\0\0", struct.Struct("<HHIQ")
#: How a local heap, of names, begins; behind it size, first free block, address. A free block: the next, 1 for none.
_NAMES, _NAMES_HEAD, _LAST_FREE = b"HEAP\0\0\0\0", struct.Struct("<QQQ"), 1


class _Output(RawIOBase):
    """The file that HDF5 writes to: it keeps the first error and lets what follows go nowhere.

    HDF5 cannot bear a write that fails (on a full disk, say): it tries again in closing, fails again, and crashes
    Python at its end. So the error waits here until `check` is called, and HDF5 closes in peace.
    """

    def __init__(self, stream: FileIO) -> None:
        self._stream = stream
        self._error: BaseException | None = None

    def check(self) -> None:
        """Raise what went wrong since the beginning, if anything did."""
        if self._error is not None:
            raise self._error

    def _attempt(self, action: Callable[..., Any], argument: Any, otherwise: Any) -> Any:
        if self._error is None:
            try:
                return action(argument)
            except BaseException as error:  # Ctrl-C too: it must not pass through HDF5
                self._error = error
        return otherwise

    def _write_all(self, content: memoryview) -> int:
        done = 0
        while done < len(content):
            done += self._stream.write(content[done:])
        return done

    # What h5py asks of a file:

    def write(self, content: Any) -> Any:
        return self._attempt(self._write_all, memoryview(content).cast("B"), len(content))

    def readinto(self, content: Any) -> Any:
        return self._attempt(self._stream.readinto, content, 0)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> Any:
        return self._attempt(lambda place: self._stream.seek(place, whence), offset, offset)

    def tell(self) -> int:
        return self._stream.tell()

    def truncate(self, size: int | None = None, /) -> int:
        return int(self._attempt(self._stream.truncate, size, size or 0))

    def flush(self) -> None:
        """Nothing is held back here."""


@contextmanager
def create(path: str | os.PathLike[str], record: str) -> Iterator[tuple[Any, Callable[[], None]]]:
    """A new HDF5 file marked with the name of its `record`, which appears at `path` when all went well.

    Beside it a function to call now and then: it raises what the disk refused so far.
    """
    import h5py

    with atomic_write(path) as temporary, FileIO(temporary, "r+") as stream:
        output = _Output(stream)
        with h5py.File(output, "w") as file:
            file.attrs["record"] = record
            file.attrs["schema"] = SCHEMA
            file.attrs["program"] = f"splinefeed {splinefeed.__version__}"
            yield file, output.check
        output.check()


def growing(file: Any, first: Any, units: Mapping[str, Any]) -> dict[str, Any]:
    """Empty datasets for the columns of records such as `first`, by name, with their units; see `append`."""
    datasets = {}
    for name, unit in units.items():
        values = getattr(first, name)
        datasets[name] = file.create_dataset(
            name,
            shape=(0, *values.shape[1:]),
            maxshape=(None, *values.shape[1:]),
            chunks=(CHUNK_ROWS, *values.shape[1:]),
            dtype=np.uint8 if values.dtype == np.bool_ else values.dtype,
            **PACKING,
        )
        datasets[name].attrs["units"] = unit
    return datasets


def append(datasets: Mapping[str, Any], part: Any, rows: int) -> None:
    """Write the columns of `part` behind the `rows` that the datasets hold."""
    for name, dataset in datasets.items():
        dataset.resize(rows + len(part), axis=0)
        dataset[rows:] = getattr(part, name)


def sound(path: Path) -> Any:
    """The HDF5 file at `path`, open for reading; FormatError for one that the library would read for ever or crash on.

    Texts of attributes lie in global heaps, one object behind the other. The library (seen with 2.0) steps from each to
    the next by its size alone, also if that is 0; and it follows the free blocks of a heap of names also in a circle
    (HDF5 File Format Specification 3.0, III.D, III.E). An attribute that is a list of variable length, as one changed
    byte makes of a text, ends it by a segmentation fault.
    """
    import h5py

    with path.open("rb") as stream:
        # an empty file cannot be mapped, and is none of HDF5's
        if os.fstat(stream.fileno()).st_size > len(_TEXTS):
            with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
                _check_texts(content, path)
                _check_names(content, path)
    file = h5py.File(path, "r")
    try:
        _check_attributes(file, path)
    except BaseException:
        file.close()
        raise
    return file


def _check_attributes(node: Any, path: Path) -> None:
    """Raise FormatError for an attribute of a file or dataset that is neither text nor a number."""
    from h5py import h5a, h5t

    for index in range(h5a.get_num_attrs(node.id)):
        attribute = h5a.open(node.id, index=index)
        if attribute.get_type().get_class() not in (h5t.STRING, h5t.INTEGER, h5t.FLOAT, h5t.ENUM):
            name = attribute.get_name().decode(errors="replace")[:40]
            raise FormatError(f"{path}: attribute {name!r}: is neither text nor a number; the file is damaged")


def _places(content: mmap.mmap, signature: bytes) -> Iterator[int]:
    """Where the signature stands, and what is behind it begins."""
    begin = content.find(signature)
    while begin >= 0:
        yield begin + len(signature)
        begin = content.find(signature, begin + len(signature))


def _check_texts(content: mmap.mmap, path: Path) -> None:
    """Raise FormatError for a global heap in which an object does not end behind its beginning, within the heap."""
    for begin in _places(content, _TEXTS):
        at, size = begin + 8, int.from_bytes(content[begin : begin + 8], "little")
        end = min(begin - len(_TEXTS) + size, len(content))
        while at + _TEXT.size <= end:
            index, _, _, size = _TEXT.unpack_from(content, at)
            step = size if index == 0 else _TEXT.size + (size + 7) // 8 * 8
            if not 0 < step <= end - at:
                raise FormatError(f"{path}: the heap of texts at byte {begin - len(_TEXTS)} is damaged at byte {at}")
            at += step


def _check_names(content: mmap.mmap, path: Path) -> None:
    """Raise FormatError for a local heap with more free blocks than it has room for: they go in a circle."""
    for begin in _places(content, _NAMES):
        if begin + _NAMES_HEAD.size > len(content):
            return
        size, free, address = _NAMES_HEAD.unpack_from(content, begin)
        size = min(size, len(content) - address)
        left = size // 16
        while free != _LAST_FREE and free + 16 <= size:
            if left == 0:
                raise FormatError(f"{path}: the free blocks of the heap of names at byte {begin} go in a circle")
            left -= 1
            free = int.from_bytes(content[address + free : address + free + 8], "little")


@contextmanager
def opened(path: str | os.PathLike[str], known: Iterable[str]) -> Iterator[tuple[Any, str, Path]]:
    """The open HDF5 file at `path`, the name of its record, one of those `known`, and the checked path.

    Raises FormatError for all that is not sound, also while the file is being read.
    """
    checked = check_file(path)
    with sound_file(path, "HDF5 file"), sound(checked) as file:
        record = text_attribute(file, "record", checked)
        if record not in known:
            raise FormatError(f"{path}: holds a record {record[:40]!r}; known are {', '.join(known)}")
        check_schema(file.attrs.get("schema"), checked)
        yield file, record, checked


def read(path: str | os.PathLike[str], readers: dict[str, Callable[[Any, Path], T]]) -> T:
    """Read the record at `path` with the reader that its name asks for; FormatError for all that is not sound."""
    with opened(path, readers) as (file, record, checked):
        return readers[record](file, checked)


def text_attribute(node: Any, name: str, path: Path) -> str:
    """The attribute `name` of a file or dataset, which must be text."""
    value = node.attrs.get(name)
    if not isinstance(value, str):
        raise FormatError(f"{path}: attribute {name}: is missing or not text; was this written by splinefeed?")
    return value


def axes_of(file: Any, path: Path) -> tuple[str, ...]:
    """The names of the axes, attribute `axes` of the file."""
    axes = tuple(file.attrs["axes"])
    if not axes or not all(isinstance(axis, str) for axis in axes):
        raise FormatError(f"{path}: attribute axes: is not a list of names")
    return axes


def dataset(file: Any, name: str, path: Path, ndim: int, most: int = MAX_TICKS) -> Any:
    """The dataset `name`, unread: in this file itself, numbers of `ndim` dimensions, of `most` ticks at most."""
    import h5py

    link = file.get(name, getlink=True)
    if not isinstance(link, h5py.HardLink):  # a link could make the reader open other files of the user
        raise FormatError(f"{path}: dataset {name}: is missing or lies in another file")
    found = file[name]
    if not isinstance(found, h5py.Dataset) or found.external or found.is_virtual:
        raise FormatError(f"{path}: dataset {name}: is not a dataset of this file")
    _check_attributes(found, path)
    words = f"{path}: dataset {name}: has shape {found.shape} of {found.dtype}"
    if found.ndim != ndim or found.dtype.kind not in "fiu" or found.dtype.itemsize > 8:
        raise FormatError(f"{words}; expected numbers in {ndim} dimension(s)")
    if found.size > most * MAX_AXES:
        raise FormatError(f"{words}; at most {most} ticks can be read")
    if found.nbytes > MOST_PACKED * found.id.get_storage_size() + _NO_HARM_BYTES:
        raise FormatError(f"{words}, but far fewer bytes on disk than that packs into; the file is damaged")
    return found


def array(file: Any, name: str, path: Path, ndim: int) -> Any:
    """The numbers of the dataset `name`; see `dataset`."""
    return np.asarray(dataset(file, name, path, ndim)[()])
