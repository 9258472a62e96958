"""Machine files written: every quantity with its unit, read back as exactly the same machine."""

from __future__ import annotations

import os
from dataclasses import MISSING
from typing import TYPE_CHECKING, Any

from splinefeed.errors import FormatError
from splinefeed.formats.atomic import atomic_write
from splinefeed.machine import quantities
from splinefeed.machine.control import Control, values

if TYPE_CHECKING:
    from splinefeed.machine.machine import Machine
    from splinefeed.machine.parts import Axis

#: Sections in the order in which the package's own files have them.
_ORDER = ("motor", "drive", "transmission", "load", "friction", "encoder", "scale", "limits", "controller")
#: ... and those that are not written when they are empty.
_MAY_BE_LEFT_OUT = ("friction", "limits")


def save(machine: Machine, path: str | os.PathLike[str]) -> None:
    """Write a machine file, whole or not at all; comments of the file that the machine came from are not kept.

    Raises FormatError for a name that does not end in .toml, and for a file that cannot be written.
    """
    if not str(path).endswith(".toml"):
        raise FormatError(f"{path}: a machine file is named .toml")
    text = to_text(machine)
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def to_text(machine: Machine) -> str:
    """The text of the machine file of `machine`."""
    import tomlkit

    content: dict[str, Any] = {}
    if machine.title:
        content["title"] = machine.title
    if machine.notes:
        content["notes"] = tomlkit.array().multiline(True)
        content["notes"].extend(machine.notes)
    if machine.kinematics is not None:
        parameters = machine.kinematics.parameters.items()
        lengths = {name: quantities.write(value, "position", False) for name, value in parameters}
        content["kinematics"] = {"type": machine.kinematics.kind, **lengths}
    if machine.control is not None:
        content["control"] = _control(machine.control)
    if machine.axes:
        content["axis"] = {name: _sections(axis) for name, axis in machine.axes.items()}
    return tomlkit.dumps(content)


def _control(control: Control) -> dict[str, Any]:
    """The section [control]: what differs from the default, the tables last."""
    content: dict[str, Any] = {}
    for name, one, value, rotary in sorted(values(control), key=lambda each: "." in each[0]):
        if one.default is not MISSING and value == one.default:
            continue
        table = content
        *sections, key = name.split(".")
        for section in sections:
            table = table.setdefault(section, {})
        table[key] = quantities.written(value, one.metadata.get("kind"), rotary)
    return content


def _sections(axis: Axis) -> dict[str, dict[str, Any]]:
    sections = {name: _values(part, axis) for name in _ORDER if (part := getattr(axis, name)) is not None}
    return {name: values for name, values in sections.items() if values or name not in _MAY_BE_LEFT_OUT}


def _values(part: Any, axis: Axis) -> dict[str, Any]:
    """What differs from the default, the source last."""
    return {
        one.name: quantities.written(value, one.metadata.get("kind"), rotary)
        for one, value, rotary in axis.said(part)
        if one.default is MISSING or value != one.default
    }
