"""Machine files made from the configuration of a control: LinuxCNC, grbl, Klipper, Marlin.

One file a control: `linuxcnc`, `grbl`, `klipper`, `marlin`; `included` finds files that a configuration names, `page`
writes the machine file with what was assumed.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from splinefeed.errors import InputError, nearest
from splinefeed.files.source import read_text
from splinefeed.machine.imports import grbl, klipper, linuxcnc, marlin
from splinefeed.machine.imports.page import Page
from splinefeed.machine.machine import Machine

#: What reads the configuration of each control, by the name of the command's ending.
READERS: dict[str, Callable[[str, str], Page]] = {
    "ini": linuxcnc.read,
    "grbl": grbl.read,
    "klipper": klipper.read,
    "marlin": marlin.read,
}
#: A configuration beyond this many bytes is none.
_LARGEST_FILE = 2**22


def imported(kind: str, file: str | os.PathLike[str]) -> tuple[Machine, Page]:
    """Make the machine that a configuration describes.

    Parameters
    ----------
    kind : str
        One of READERS.
    file : path
        The configuration.

    Returns
    -------
    machine : Machine
        As its file describes it.
    page : Page
        Of the machine file.

    Raises
    ------
    FormatError
        With the file and what it lacks.
    """
    if kind not in READERS:
        raise InputError(f"configuration {kind!r} is not known; {nearest(kind, READERS)}")
    page = READERS[kind](read_text(file, "a configuration", _LARGEST_FILE), os.fspath(file))
    return Machine.parse(page.text(), Path(file).stem, f"what is made of {file}"), page
