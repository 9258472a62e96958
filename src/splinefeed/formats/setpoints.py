"""Save and load any record; the suffix of the file's name says the format."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, overload

from splinefeed.errors import FormatError, InputError, expect
from splinefeed.files.atomic import atomic_write
from splinefeed.files.metadata import MAYBE, check_columns, described, naming, to_degrees, to_radians
from splinefeed.files.sizes import MAX_AXES, MAX_TICKS, MAX_TICKS_AT_ONCE, MAX_TICKS_IN_CHUNKS
from splinefeed.files.source import check_file
from splinefeed.formats import hdf5
from splinefeed.formats.setpoint_table import FORMATS
from splinefeed.records import Limits, Response, Setpoints, TimeLaw

if TYPE_CHECKING:
    from splinefeed.formats.bit_pattern import BitPattern

Record: TypeAlias = "Setpoints | TimeLaw | Limits | Response | BitPattern"
Kind = TypeVar("Kind", bound="Setpoints | TimeLaw | Limits | Response | BitPattern")


#: What all parts of a record have in common.
_ALIKE = ("axes", "period", "method")
#: Pulse words of a motion card as its driver takes them.
_BITS = ".bits"


def save(record: Record | Iterable[Setpoints] | Iterable[Response], path: str | os.PathLike[str]) -> None:
    """Save a record, whole or not at all.

    Parameters
    ----------
    record : Setpoints, Response, TimeLaw, Limits, BitPattern, or iterable of chunks
        Setpoints and responses may come as an iterable of chunks, of which HDF5, CSV, Parquet and halstreamer hold one
        at a time in memory.
    path : path
        File to write, whose suffix chooses the format: any record as HDF5 (.h5), setpoints in every one of FORMATS,
        pulse words as .bits.

    Raises
    ------
    FormatError
        For a name of no format, and a folder that cannot be written.
    InputError
        For numbers that are not finite, and chunks that do not belong together.

    Notes
    -----
    Lengths are in mm, times in s, rotary axes in rad or as the format has it in its heads.

    References
    ----------
    .. [1] docs/setpoint-files.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> run = sf.run(sf.Path.polyline([[0, 0], [10, 0]]), sf.Limits(feed=10, acceleration=100, jerk=1000))
    >>> sf.save(run.setpoints(), "setpoints.csv")
    """
    expect("save(record, file)", (record, object), (path, (str, os.PathLike)))
    if _suffix(path) == _BITS:
        import_module("splinefeed.formats.bit_pattern").write(record, path)
        return
    name = _format_of(path)
    whole = isinstance(record, TimeLaw | Limits)
    if name != "hdf5" and (whole or isinstance(record, Response)):
        raise FormatError(f"{path}: {type(record).__name__} is saved as HDF5 only; name the file .h5")
    if isinstance(record, TimeLaw | Limits):
        with atomic_write(path) as temporary, _sink(hdf5.write_hdf5(temporary)) as send:
            send(record)
        return
    with Writer(path) as writer:
        for part in record if isinstance(record, Iterable) else [record]:
            writer.feed(part)
        writer.finish()


@contextmanager
def _sink(sink: Any) -> Iterator[Callable[[Any], None]]:
    """What sends parts to a function that writes a file; at the end it hears that there are no more."""
    next(sink)
    try:
        yield sink.send
        with suppress(StopIteration):
            sink.send(None)
    finally:
        sink.close()


class Writer:
    """Write setpoints, or a response, to a file chunk by chunk as they come; the file appears whole or not at all.

    Parameters
    ----------
    path : path
        File to write, whose suffix chooses the format.

    Raises
    ------
    FormatError, InputError
        As `save`.

    Notes
    -----
    `feed` takes the next chunk, `finish` ends the file. As a context it removes what is not finished. Formats whose
    layout needs all ticks at once keep the chunks.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path, self._name = path, _format_of(path)
        self._form = FORMATS[self._name]
        hdf = self._name == "hdf5"
        self._most = MAX_TICKS_IN_CHUNKS if hdf else MAX_TICKS_AT_ONCE if self._form.at_once else MAX_TICKS
        self._kinds: Any = Setpoints | Response if hdf else Setpoints
        self._first: Any = None
        self._ticks = 0
        self._open, self._parts = ExitStack(), list[Setpoints]()
        self._send: Callable[[Any], None] | None = None

    def __enter__(self) -> Writer:
        return self

    def __exit__(self, *raised: Any) -> None:
        left = GeneratorExit()  # left without `finish`: what is open closes as behind an error
        self._open.__exit__(*(raised if raised[0] is not None else (GeneratorExit, left, None)))

    def feed(self, part: Any) -> None:
        """Write the next chunk.

        Parameters
        ----------
        part : Setpoints or Response
            Of the axes and the period of the first one.

        Raises
        ------
        InputError
            For a part that is not sound or not like the first.
        FormatError
            For more ticks than the format holds.
        """
        self._check(part)
        if not len(part):
            return
        if self._form.rotary == "deg":
            part = replace(part, position=to_degrees(part.position, part.axes))
        if self._form.at_once:
            self._parts.append(part)
            return
        if self._send is None:
            temporary = self._open.enter_context(atomic_write(self.path))
            self._send = self._open.enter_context(_sink(_function(self._name, "write")(temporary)))
        self._send(part)

    def finish(self) -> None:
        """End the file and put it in its place; FormatError where no chunk had ticks."""
        if self._ticks == 0:
            raise FormatError(f"{self.path}: there are no ticks to save")
        if self._form.at_once:
            with atomic_write(self.path) as temporary, naming(self.path):
                _function(self._name, "write")(Setpoints.joined(self._parts), temporary)
        self._open.close()

    def _check(self, part: Any) -> None:
        """InputError where a part is not sound or not like the first, FormatError for too many ticks."""
        path, ticks = self.path, self._ticks
        if not isinstance(part, self._kinds):
            raise InputError(f"{path}: setpoints are saved from Setpoints, got {type(part).__name__}")
        first = self._first = part if self._first is None else self._first
        for name in _ALIKE:
            here, there = getattr(part, name, None), getattr(first, name, None)
            if here != there:
                raise InputError(f"{path}: the chunk at tick {ticks} has {name} {here!r}, the first one {there!r}")
        if any((getattr(part, name, None) is None) != (getattr(first, name, None) is None) for name in MAYBE):
            raise InputError(f"{path}: the chunk at tick {ticks} has other columns than the first one")
        if len(part.axes) > MAX_AXES:
            raise InputError(f"{path}: there are {len(part.axes)} axes; at most {MAX_AXES} can be saved")
        check_columns(part)
        self._ticks += len(part)
        if self._ticks > self._most:
            raise FormatError(
                f"{path}: more than {self._most} ticks do not fit in this format; write HDF5 or several files"
            )


@overload
def load(path: str | os.PathLike[str]) -> Record: ...
@overload
def load(path: str | os.PathLike[str], kind: type[Kind]) -> Kind: ...
def load(path: str | os.PathLike[str], kind: type[Any] | None = None) -> Any:
    """Load a record that `save` wrote.

    Parameters
    ----------
    path : path
        File that `save` wrote.
    kind : type, optional
        The record that must be in the file, such as `sf.Setpoints`; by default any.

    Returns
    -------
    Setpoints, Response, TimeLaw, Limits or BitPattern
        Lengths in mm, times in s, angles in rad.

    Raises
    ------
    FormatError
        For a file that cannot be read, and for a record of another kind.

    Notes
    -----
    A tuple in its settings comes back as a list, as JSON has no tuples.

    References
    ----------
    .. [1] docs/setpoint-files.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.save(sf.plan(sf.Path.polyline([[0, 0], [10, 0]]), sf.Limits(feed=10, acceleration=100, jerk=1000)), "law.h5")
    >>> sf.load("law.h5", sf.TimeLaw)
    TimeLaw('seven-phase', 10 mm in 1.2 s)
    """
    suffix = _suffix(path)
    name = "" if suffix == _BITS else _format_of(path)
    if suffix == _BITS:
        found = import_module("splinefeed.formats.bit_pattern").read(path)
    elif name == "hdf5":
        found = hdf5.load(path)
    elif read := _function(name, "read"):
        file = check_file(path)
        with naming(path, f"{suffix} file of setpoints"):
            columns, said = read(file)
            if FORMATS[name].rotary == "deg":
                columns["position"] = to_radians(columns["position"], said["axes"])
            found = described(columns, said)
    else:
        raise FormatError(f"{path}: {suffix} files are for controllers and cannot be loaded; keep an .h5 beside")
    if kind is not None and not isinstance(found, kind):
        raise FormatError(f"{path}: holds {type(found).__name__}; expected {kind.__name__}")
    return found


def load_chunks(path: str | os.PathLike[str], rows: int) -> Iterator[Setpoints]:
    """Load setpoints in pieces, of which HDF5 holds one at a time in memory.

    Parameters
    ----------
    path : path
        File that `save` wrote.
    rows : int
        Ticks of a piece, at most.

    Yields
    ------
    Setpoints
        The next piece.

    Raises
    ------
    FormatError
        As `load`.
    """
    if _format_of(path) == "hdf5":
        yield from hdf5.load_chunks(path, rows)
        return
    points = load(path, Setpoints)
    for start in range(0, len(points), rows):
        yield points.part(start, start + rows)


def _function(name: str, action: str) -> Any:
    return getattr(import_module(f"splinefeed.formats.{FORMATS[name].module}"), f"{action}_{name}", None)


def _suffix(path: str | os.PathLike[str]) -> str:
    return Path(path).suffix.lower()


def _format_of(path: str | os.PathLike[str]) -> str:
    found = next((name for name, each in FORMATS.items() if _suffix(path) in each.suffixes), None)
    if found is None and Path(path).is_dir():
        raise FormatError(f"{path}: is a folder; name a file in it, such as setpoints.h5")
    if found is None:
        *known, last = (suffix for each in FORMATS.values() for suffix in each.suffixes)
        raise FormatError(f"{path}: a record's file is named {', '.join(known)} or {last}; sf.write writes a path")
    return found
