"""Machine files written: every quantity with its unit, read back as exactly the same machine."""

from __future__ import annotations

from dataclasses import MISSING, Field
from typing import TYPE_CHECKING, Any

from splinefeed.machine.control import values
from splinefeed.machine.describe import SECTIONS
from splinefeed.machine.quantities import write

if TYPE_CHECKING:
    from splinefeed.machine.machine import Machine
    from splinefeed.machine.parts import Axis


def to_text(machine: Machine) -> str:
    """The text of the machine file of `machine`; comments of the file that it came from are not kept."""
    import tomlkit

    content: dict[str, Any] = {}
    if machine.title:
        content["title"] = machine.title
    if machine.notes:
        content["notes"] = tomlkit.array().multiline(True)
        content["notes"].extend(machine.notes)
    if machine.kinematics is not None:
        parameters = machine.kinematics.parameters.items()
        lengths = {name: write(value, "position", False) for name, value in parameters}
        content["kinematics"] = {"type": machine.kinematics.kind, **lengths}
    if machine.control is not None:
        content["control"] = {}
        for name, one, value, rotary in sorted(values(machine.control), key=lambda each: "." in each[0]):
            *tables, key = name.split(".")
            table = content["control"]
            for each in tables:
                table = table.setdefault(each, {})
            table |= _text(one, key, value, rotary)
    if machine.axes:
        content["axis"] = {name: _sections(axis) for name, axis in machine.axes.items()}
    return tomlkit.dumps(content)


def _sections(axis: Axis) -> dict[str, dict[str, Any]]:
    """The sections of an axis, friction and limits only where they say something."""
    sections: dict[str, dict[str, Any]] = {}
    for name in SECTIONS:
        part = getattr(axis, name)
        if part is not None:
            sections[name] = {}
            for one, value, rotary in axis.said(part):
                sections[name] |= _text(one, one.name, value, rotary)
    return {name: said for name, said in sections.items() if said or name not in ("friction", "limits")}


def _text(one: Field[Any], key: str, value: Any, rotary: bool) -> dict[str, Any]:
    """A key and its value as a file has them; nothing for a default."""
    if one.default is not MISSING and value == one.default:
        return {}
    return {key: write(value, one.metadata.get("kind"), rotary)}
