"""Read and write paths: which format a file is, by its content and its name."""

from __future__ import annotations

import inspect
import os
import pathlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from splinefeed.errors import CurveError, FormatError, InputError
from splinefeed.formats import airfoil, json_curve
from splinefeed.formats.source import read_text
from splinefeed.geometry.path import Path


@dataclass(frozen=True)
class Format:
    """A kind of file that holds paths: its title, its suffixes, how it looks, and what reads it."""

    title: str
    suffixes: tuple[str, ...]
    holds: Callable[[str], bool]
    from_text: Callable[..., list[Path]]


FORMATS = (
    Format("JSON curve", (".json",), json_curve.holds, json_curve.from_text),
    Format("airfoil", (".dat", ".txt"), airfoil.holds, airfoil.from_text),
)
#: How many names of paths a message lists.
_LISTED = 4


def read(source: str | os.PathLike[str], *, path: str | int | None = None, **options: Any) -> Path:
    """The path in the file `source`; where there are several, the one whose name or number (from 1) is `path`.

    `options` are those of the format: `tolerance` for JSON curves; `chord`, `tolerance`, `degree` for airfoils.
    Raises FormatError, which names the file and the place, for what cannot be read.
    """
    paths = read_all(source, **options)
    if path is None and len(paths) == 1:
        return paths[0]
    names = [each.name for each in paths]
    listed = ", ".join(names[:_LISTED]) + (", ..." if len(names) > _LISTED else "")
    if path is None:
        raise FormatError(
            f"{source}: holds {len(paths)} paths that do not meet; choose one with path=1 to path={len(paths)} "
            f"or its name: {listed}"
        )
    if path in names:
        return paths[names.index(str(path))]
    number = str(path)
    if number.isascii() and number.isdigit() and len(number) < 10 and 1 <= int(number) <= len(paths):
        return paths[int(number) - 1]
    raise FormatError(f"{source}: has no path {number[:40]!r}; there are 1 to {len(paths)}, named {listed}")


def read_all(source: str | os.PathLike[str], **options: Any) -> list[Path]:
    """Every path in the file `source`, in the order of the file; see `read`."""
    text = read_text(source)
    found = _format_of(text, pathlib.Path(source))
    if found is None:
        titles = " nor ".join(f"{each.title} ({', '.join(each.suffixes)})" for each in FORMATS)
        raise FormatError(f"{source}: is neither {titles}")
    _check_options(found, options)
    try:
        paths = found.from_text(text, source, **options)
        for each in paths:
            _ = each.length  # a path without length is refused here, where its file can be named
    except CurveError as error:
        raise FormatError(f"{source}: {error}") from None
    return paths


def write(path: Path, target: str | os.PathLike[str]) -> None:
    """Write `path` to the file `target`, whole or not at all; the suffix says the format (.json)."""
    if pathlib.Path(target).suffix.lower() != ".json":
        raise FormatError(f"{target}: paths are written as JSON curves; name the file .json")
    json_curve.write(path, target)


def _format_of(text: str, file: pathlib.Path) -> Format | None:
    """The format that `text` looks like, or else the one that the name promises: its reader will say what is wrong."""
    for each in FORMATS:
        if each.holds(text):
            return each
    return next((each for each in FORMATS if file.suffix.lower() in each.suffixes), None)


def _check_options(found: Format, options: dict[str, Any]) -> None:
    parameters = inspect.signature(found.from_text).parameters.values()
    known = [parameter.name for parameter in parameters if parameter.kind is parameter.KEYWORD_ONLY]
    for name in options:
        if name not in known:
            raise InputError(f"option {name!r} is not one of a {found.title} file; there are path, {', '.join(known)}")
