"""A table of points of any length as parts of the path of straight lines between them."""

from __future__ import annotations

import pathlib
from collections.abc import Iterator

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats import points
from splinefeed.formats.path_parts import PathParts
from splinefeed.formats.source import check_file, check_size, head_text, read_head
from splinefeed.geometry.path import Path
from splinefeed.records import Array

#: Points of one part, and the largest table, bytes.
PART = 4096
MAX_BYTES = 2 * 2**30
_BLOCK = 2**20


def in_parts(file: pathlib.Path) -> PathParts:
    """The points in `file`, joined by straight lines, read part by part."""
    check_size(check_file(file), MAX_BYTES)
    points.check_no_setpoints(head_text(read_head(file, _BLOCK)), file)
    axes, _, findings = next(_blocks(file))
    return PathParts(
        name=file.stem, axes=axes, count=_lines(file), unit="lines", make=lambda: _paths(file), findings=tuple(findings)
    )


def _lines(file: pathlib.Path) -> int:
    with file.open("rb") as stream:
        return sum(block.count(b"\n") for block in iter(lambda: stream.read(_BLOCK), b""))


def _blocks(file: pathlib.Path) -> Iterator[tuple[tuple[str, ...], Array, list[str]]]:
    """Axes, points (n, axes), mm and rad, and findings, PART points at a time."""
    table = points.Table(file)
    count = kept = 0  # points that were given, and whether the first of the table's rows, which stays, is one of them

    def block() -> tuple[tuple[str, ...], Array, list[str]]:
        nonlocal count, kept
        if not kept:
            table.check()
        axes, places, findings = points.chosen(table)
        places = places[kept:]
        del table.rows[1:], table.lines[1:]  # the first one says how many numbers a line has
        count, kept = count + len(places), 1
        return axes, places, findings

    try:
        with file.open(encoding="utf-8-sig", errors="replace") as stream:
            for number, line in enumerate(stream, start=1):
                if stripped := line.strip():
                    table.add(number, stripped)
                if len(table.rows) > PART:
                    yield block()
    except OSError as error:
        raise FormatError(f"{file}: cannot be read: {error.strerror or error}") from None
    if len(table.rows) > kept or not kept:
        yield block()
    table.check_count(count)


def _paths(file: pathlib.Path) -> Iterator[Path]:
    """Parts of the path; points that are the same as the one before are left out."""
    before: Array | None = None
    made = False
    for axes, places, _ in _blocks(file):
        joined = places if before is None else np.concatenate([before, places])
        moved = np.append(True, np.any(np.diff(joined, axis=0) != 0.0, axis=1))
        joined = joined[moved]
        before = joined[-1:].copy()
        if len(joined) > 1:
            made = True
            yield Path.polyline(joined, axes, name=file.stem)
    if not made:
        raise FormatError(f"{file}: holds one point only; a path needs two")
