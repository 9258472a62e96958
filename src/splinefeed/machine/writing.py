"""Machine files written: every quantity with its unit, read back as exactly the same machine."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from dataclasses import MISSING, fields
from typing import TYPE_CHECKING, Any

from splinefeed.errors import FormatError
from splinefeed.formats.atomic import atomic_write
from splinefeed.machine import quantities

if TYPE_CHECKING:
    from splinefeed.machine.parts import Axis
    from splinefeed.machine.table import Table

#: Sections in the order in which the package's own files have them.
_ORDER = ("motor", "drive", "transmission", "load", "friction", "encoder", "scale", "limits", "controller")
#: ... and those that are not written when they say nothing.
_MAY_BE_LEFT_OUT = ("friction", "limits")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def save(table: Table, path: str | os.PathLike[str]) -> None:
    """Write a machine file, whole or not at all; comments of the file that the machine came from are not kept.

    Raises FormatError for a name that does not end in .toml, and for a file that cannot be written.
    """
    if not str(path).endswith(".toml"):
        raise FormatError(f"{path}: a machine file is named .toml")
    text = to_text(table)
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def to_text(table: Table) -> str:
    """The text of the machine file of `table`."""
    lines = []
    if table.title:
        lines.append(f"title = {_quoted(table.title)}")
    if table.notes:
        lines += ["notes = [", *(f"    {_quoted(note)}," for note in table.notes), "]"]
    if table.kinematics is not None:
        lines += ["", "[kinematics]", f"type = {_quoted(table.kinematics.kind)}"]
        for parameter, value in table.kinematics.parameters.items():
            lines.append(f"{parameter} = {_quoted(quantities.write(value, 'position', False))}")
    for name, axis in table.axes.items():
        lines += ["", *_axis(name, axis)]
    return "\n".join(lines).lstrip("\n") + "\n"


def _axis(name: str, axis: Axis) -> Iterator[str]:
    place = f"axis.{name if _BARE_KEY.fullmatch(name) else _quoted(name)}"
    first = True
    for section in _ORDER:
        part = getattr(axis, section)
        if part is None:
            continue
        rows = list(_rows(part, axis))
        if rows or section not in _MAY_BE_LEFT_OUT:
            yield from ([] if first else [""])
            first = False
            yield f"[{place}.{section}]"
            yield from rows


def _rows(part: Any, axis: Axis) -> Iterator[str]:
    """`key = value` of what differs from the default, the source last."""
    for one in fields(part):
        value = getattr(part, one.name)
        if one.default is not MISSING and value == one.default:
            continue
        kind = one.metadata.get("kind")
        if kind in quantities.KINDS:
            rotary = axis.motor.motion == "rotary" if one.metadata["motor"] else axis.rotary
            value = quantities.write(value, kind, rotary)
        yield f"{one.name} = {_quoted(value) if isinstance(value, str) else repr(value)}"


def _quoted(text: str) -> str:
    """A TOML basic string: JSON's escapes are TOML's, but for DEL, which JSON lets stand."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
