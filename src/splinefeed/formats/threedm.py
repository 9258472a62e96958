"""3DM, the files of Rhino from version 2 on: curves of all kinds and blocks, read by rhino3dm.

One path an object, named as the object; see docs/cad-files.md.
"""

from __future__ import annotations

import pathlib
from collections.abc import Sequence

from splinefeed.files.source import read_bytes
from splinefeed.formats import cad_process
from splinefeed.formats.drawing import Drawing
from splinefeed.paths.contents import Contents
from splinefeed.paths.path import JOIN_TOLERANCE

START = b"3D Geometry File Format "
_END_MARK = b"\xff\x7f\0\0"


def holds(head: bytes) -> bool:
    """Tell whether the first bytes of a file, `head`, look like this format."""
    return head.startswith(START)


def from_file(
    file: pathlib.Path,
    *,
    edges: bool = False,
    layer: str | Sequence[str] | None = None,
    tolerance: float | str = JOIN_TOLERANCE,
    hidden: bool = False,
    repair: bool = False,
) -> Contents:
    """Read the paths in a 3DM file.

    Parameters
    ----------
    file : path
        The file.
    edges : bool, optional
        Whether the edges of surfaces and solids are read, too.
    layer : str or sequence of str, optional
        Reads these layers only, shown or not: a list, or names between commas.
    tolerance : float or str, optional
        Curves whose ends meet within it make one path, mm.
    hidden : bool, optional
        Whether what the author's program does not show is read, too.
    repair : bool, optional
        Whether faults are repaired where that is safe, each a finding.

    Returns
    -------
    Contents
        Paths in the order of the file, mm, and its units.

    Raises
    ------
    FormatError, InputError
        For what cannot be read, with its place.

    Notes
    -----
    Of a file that is cut off rhino3dm gives what is there.
    """
    content, faults = read_bytes(file), []
    # the last record is a mark and two sizes, of 4 or 8 bytes, the second of which is that of the file
    if not any(
        content[-4 - 2 * size :].startswith(_END_MARK) and int.from_bytes(content[-size:], "little") == len(content)
        for size in (4, 8)
    ):
        faults.append(f"the record that ends it is missing at byte {len(content)}; is it 3DM, and not cut off?")
    return cad_process.read(Drawing(file, tolerance, repair, layer, hidden), "3dm", faults, edges=edges)
