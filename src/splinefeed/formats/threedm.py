"""3DM, the files of Rhino from version 2 on: curves of all kinds and blocks, read by rhino3dm.

One path an object, named as the object; a polycurve is one curve as Rhino makes it, with its joints as knots of full
multiplicity. Blocks are put where their references have them. `layer` names the layers to read.
"""

from __future__ import annotations

import pathlib
from collections.abc import Sequence

from splinefeed.errors import FormatError
from splinefeed.formats import cad_process
from splinefeed.formats.contents import Contents
from splinefeed.formats.drawing import join_tolerance, layers_from
from splinefeed.formats.source import read_bytes
from splinefeed.geometry.path import JOIN_TOLERANCE

START = b"3D Geometry File Format "
_RHINO = cad_process.Library("3dm", "rhino3dm", "rhino3dm")
#: From this version on sizes in the file have 8 bytes.
_LONG_SIZES = 50
_END_MARK = b"\xff\x7f\0\0"


def holds(head: bytes) -> bool:
    """Whether `head` looks like this format."""
    return head.startswith(START)


def from_file(
    file: pathlib.Path,
    *,
    edges: bool = False,
    layer: str | Sequence[str] | None = None,
    tolerance: float | str = JOIN_TOLERANCE,
    repair: bool = False,
) -> Contents:
    """The paths in `file`; `edges` adds the edges of surfaces and solids.

    All layers are read unless `layer` names some (a list, or names between commas).
    Curves whose ends meet within `tolerance`, mm, make one path.
    """
    allowed = join_tolerance(tolerance)
    chosen = layers_from(layer)
    findings = check(read_bytes(file), file, repair=repair)
    return cad_process.read(file, _RHINO, findings, tolerance=allowed, repair=repair, edges=edges, layers=chosen)


def check(content: bytes, file: pathlib.Path, *, repair: bool) -> list[str]:
    """Raise FormatError for a file that is cut off; with `repair` that is a finding instead.

    The last record of a file is a mark and the size of the file, which must be the size that it has.
    """
    version = content[len(START) : len(START) + 8].strip()
    if not holds(content) or not version.isdigit():
        raise FormatError(f"{file}: does not begin with {START.decode().strip()!r} and a version; is it 3DM?")
    if int(version) < 2:
        raise FormatError(f"{file}: is of version {int(version)}; versions 2 to 8 can be read")
    size = 8 if int(version) >= _LONG_SIZES else 4
    record = content[-(4 + 2 * size) :]
    said = int.from_bytes(record[-size:], "little")
    if record.startswith(_END_MARK) and said == len(content):
        return []
    fault = f"the record that ends it is missing at byte {len(content)}; is the file cut off?"
    if not repair:
        raise FormatError(f"{file}: {fault}")
    return [fault]
