"""The machine that commands take where none is named: the one that the user chose, else a plain one."""

from __future__ import annotations

from pathlib import Path

import platformdirs

from splinefeed.errors import FormatError, SplinefeedError
from splinefeed.files.atomic import write_text
from splinefeed.machine.machine import Machine

#: The machine where nobody chose one.
PLAIN = "plain-mill"


def _file() -> Path:
    return platformdirs.user_config_path("splinefeed", appauthor=False) / "machine"


def chosen() -> str | None:
    """Return the name or file of the machine that the user chose, or None."""
    try:
        return _file().read_text(encoding="utf-8").strip() or None
    except (OSError, UnicodeDecodeError):
        return None


def choose(name: str | None) -> str | None:
    """Keep a machine as the usual one.

    Parameters
    ----------
    name : str or None
        Name or file of the machine; None forgets the usual one.

    Returns
    -------
    str or None
        What is kept now, a file by its whole path.

    Raises
    ------
    FormatError
        As `Machine.load`, and where the choice cannot be kept.
    """
    if name is None:
        try:
            _file().unlink(missing_ok=True)
        except OSError as error:
            raise FormatError(f"{_file()}: cannot be removed: {error.strerror}") from None
        return None
    Machine.load(name)
    kept = name if name in Machine.names() else str(Path(name).resolve())
    try:
        _file().parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FormatError(f"{_file().parent}: cannot be made: {error.strerror}") from None
    write_text(_file(), f"{kept}\n")
    return kept


def usual() -> tuple[Machine, str]:
    """Return the usual machine: the one that the user chose, else a plain one.

    Returns
    -------
    machine : Machine
        The one that commands take where none is named.
    words : str
        A sentence with its name, and how to name another.

    Raises
    ------
    FormatError
        For one that was chosen and is not there, or not sound.
    """
    name = chosen()
    if name is None:
        words = f"no machine is named: {PLAIN}, round limits of a small machining centre"
        return Machine.load(PLAIN), f"{words}; name yours: --machine NAME|FILE, or once: splinefeed machine use FILE"
    try:
        return Machine.load(name), f"no machine is named: {name}, as splinefeed machine use says"
    except SplinefeedError as error:
        raise FormatError(f"{error}; it is the usual machine, splinefeed machine use FILE chooses another") from None
