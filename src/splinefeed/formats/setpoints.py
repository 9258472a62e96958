"""Save and load any record; the suffix of the file's name says the format."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, overload

from splinefeed.errors import FormatError, expect
from splinefeed.formats import hdf5, records_hdf5
from splinefeed.records import Limits, Response, Setpoints, TimeLaw

if TYPE_CHECKING:
    from splinefeed.formats.bit_pattern import BitPattern

Record: TypeAlias = "Setpoints | TimeLaw | Limits | Response | BitPattern"
Kind = TypeVar("Kind", bound="Setpoints | TimeLaw | Limits | Response | BitPattern")


@dataclass(frozen=True)
class SetpointFormat:
    """A kind of file for setpoints: its suffixes, the module that writes it, and whether it can be loaded again."""

    suffixes: tuple[str, ...]
    module: str
    loads: bool = True


#: Every format of setpoints by the name that `--format` takes; the first suffix is the one that files get.
FORMATS = {
    "hdf5": SetpointFormat((".h5", ".hdf5"), "records_hdf5"),
    "csv": SetpointFormat((".csv",), "setpoints_csv"),
    "mat": SetpointFormat((".mat",), "setpoints_mat"),
    "npz": SetpointFormat((".npz",), "setpoints_npz"),
    "parquet": SetpointFormat((".parquet",), "setpoints_parquet"),
    "halstreamer": SetpointFormat((".halstream",), "setpoints_halstreamer", loads=False),
    "pvt": SetpointFormat((".pvt",), "setpoints_pvt", loads=False),
}
#: Pulse words of a motion card as its driver takes them.
_BITS = ".bits"


def _read_pattern(file: Any, path: Path) -> BitPattern:
    from splinefeed.formats import bit_pattern

    return bit_pattern.read(path)


_HDF5_READERS: dict[str, Callable[[Any, Path], Record]] = {
    "Setpoints": records_hdf5.read_setpoints,
    "TimeLaw": records_hdf5.read_law,
    "Limits": records_hdf5.read_limits,
    "Response": records_hdf5.read_response,
    "BitPattern": _read_pattern,
}


def save(record: Record | Iterable[Setpoints], path: str | os.PathLike[str]) -> None:
    """Save a record, whole or not at all: any as HDF5 (.h5), setpoints in every one of FORMATS, pulse words as .bits.

    Setpoints may come as an iterable of chunks, of which all formats but .mat hold one at a time in memory.
    Lengths in mm, rotary axes rad or as the format says in its heads. Raises FormatError for a name of no format, a
    folder that cannot be written, or numbers that are not finite. Source: docs/setpoint-files.md.
    Example: `sf.save(setpoints, "setpoints.csv")`
    """
    expect("save(record, file)", (record, object), (path, (str, os.PathLike)))
    if _is_pattern(record):
        _pattern_module(path).write(record, path)
        return
    name = _format_of(path)
    if isinstance(record, TimeLaw | Limits | Response) and name != "hdf5":
        raise FormatError(f"{path}: {type(record).__name__} is saved as HDF5 only; name the file .h5")
    _module(name).save(record, path)


@overload
def load(path: str | os.PathLike[str]) -> Record: ...
@overload
def load(path: str | os.PathLike[str], kind: type[Kind]) -> Kind: ...
def load(path: str | os.PathLike[str], kind: type[Any] | None = None) -> Any:
    """Load a record that `save` wrote; a tuple in its settings comes back as a list, as JSON has no tuples.

    kind  the record that must be in the file, such as `sf.Setpoints`; None takes any
    Lengths in mm, times in s, angles in rad. Raises FormatError that names the file, for one that cannot be read and
    for a record of another kind. Source: docs/setpoint-files.md.
    Example: `sf.save(law, "law.h5"); sf.load("law.h5", sf.TimeLaw).duration`
    """
    found = _load(path)
    if kind is not None and not isinstance(found, kind):
        raise FormatError(f"{path}: holds {type(found).__name__}; expected {kind.__name__}")
    return found


def _load(path: str | os.PathLike[str]) -> Record:
    if Path(path).suffix.lower() == _BITS:
        pattern: BitPattern = _pattern_module(path).read(path)
        return pattern
    name = _format_of(path)
    if name == "hdf5":
        return hdf5.read(path, _HDF5_READERS)
    if not FORMATS[name].loads:
        raise FormatError(f"{path}: {name} files are for controllers and cannot be loaded; keep an .h5 beside")
    points: Setpoints = _module(name).load(path)
    return points


def load_chunks(path: str | os.PathLike[str], rows: int) -> Iterator[Setpoints]:
    """Setpoints that `save` wrote, in pieces of at most `rows` ticks, of which HDF5 holds one at a time in memory."""
    if _format_of(path) == "hdf5":
        with hdf5.opened(path, ("Setpoints",)) as (file, _, checked):
            yield from records_hdf5.read_chunks(file, checked, rows)
        return
    points = load(path)
    assert isinstance(points, Setpoints)
    for start in range(0, len(points), rows):
        yield points.part(start, start + rows)


def _is_pattern(record: object) -> bool:
    """Whether it is pulse words; their module, which needs a compiler, is not imported to find out."""
    module = sys.modules.get("splinefeed.formats.bit_pattern")
    return module is not None and isinstance(record, module.BitPattern)


def _pattern_module(path: str | os.PathLike[str]) -> ModuleType:
    raw = Path(path).suffix.lower() == _BITS
    return import_module(f"splinefeed.formats.bit_pattern{'_raw' if raw else ''}")


def _module(name: str) -> ModuleType:
    return import_module(f"splinefeed.formats.{FORMATS[name].module}")


def _format_of(path: str | os.PathLike[str]) -> str:
    suffix = Path(path).suffix.lower()
    for name, each in FORMATS.items():
        if suffix in each.suffixes:
            return name
    if Path(path).is_dir():
        raise FormatError(f"{path}: is a folder; name a file in it, such as setpoints.h5")
    *known, last = (suffix for each in FORMATS.values() for suffix in each.suffixes)
    raise FormatError(f"{path}: a record's file is named {', '.join(known)} or {last}")
