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
    """The name or file of the machine that the user chose, or None."""
    try:
        return _file().read_text(encoding="utf-8").strip() or None
    except (OSError, UnicodeDecodeError):
        return None


def choose(name: str | None) -> str | None:
    """Keep a machine as the usual one, a file by its whole path; None forgets it. What is kept now.

    Raises what `Machine.load` raises for a machine that is none, FormatError where it cannot be kept.
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
    """The usual machine, and a sentence that says which and how to name another."""
    name = chosen()
    if name is None:
        words = f"no machine is named: {PLAIN}, round limits of a small machining centre"
        return Machine.load(PLAIN), f"{words}; name yours: --machine NAME|FILE, or once: splinefeed machine use FILE"
    try:
        return Machine.load(name), f"no machine is named: {name}, as splinefeed machine use says"
    except SplinefeedError as error:
        raise FormatError(f"{error}; it is the usual machine, splinefeed machine use FILE chooses another") from None
