"""A machine written: as a file that reads back as exactly the same machine, in words, and in numbers for programs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import MISSING, Field
from typing import TYPE_CHECKING, Any

from splinefeed.machine.control import values
from splinefeed.machine.parts import Axis
from splinefeed.machine.quantities import as_quantity, show, write

if TYPE_CHECKING:
    from splinefeed.machine.machine import Machine


def to_text(machine: Machine) -> str:
    """The text of the machine file of `machine`; comments of the file that it came from are not kept."""
    import tomlkit

    content: dict[str, Any] = {}
    if machine.title:
        content["title"] = machine.title
    if machine.notes:
        content["notes"] = tomlkit.array().multiline(True)
        content["notes"].extend(machine.notes)
    if (moves := machine.kinematics) is not None:
        lengths = {name: write(value, "position", False) for name, value in moves.parameters.items()}
        content["kinematics"] = {"type": moves.kind, **lengths}
    if machine.control is not None:
        said = sorted(values(machine.control), key=lambda each: "." in each[0])
        content["control"] = _tables(said)
    axes = {}
    for name, axis in machine.axes.items():
        needed: dict[str, Any] = {"motor": {}, "drive": {}, "transmission": {}, "load": {}}
        said_of = ((f"{section}.{one.name}", one, value, rotary) for section, one, value, rotary in axis.said())
        axes[name] = needed | _tables(said_of)
    return tomlkit.dumps({**content, **({"axis": axes} if axes else {})})


def _tables(said: Iterable[tuple[str, Field[Any], Any, bool]]) -> dict[str, Any]:
    """Tables of what differs from the default, by names such as `spindle.start`."""
    content: dict[str, Any] = {}
    for name, one, value, rotary in said:
        if one.default is MISSING or value != one.default:
            *tables, key = name.split(".")
            table = content
            for each in tables:
                table = table.setdefault(each, {})
            table[key] = write(value, one.metadata.get("kind"), rotary)
    return content


def describe(machine: Machine) -> str:
    """What its file says, and what follows for each axis."""
    lines = [machine.name, "", to_text(machine)]
    return "\n".join(lines + [_of_axis(axis) for axis in machine.axes.values()])


def _of_axis(axis: Axis) -> str:
    unit, factor = ("kg*m^2", 1.0) if axis.rotary else ("kg", 1000.0)
    peak = show(axis.motor.peak_force * axis.force_per_motor_force, "force", axis.rotary)
    count = f", one encoder count {show(axis.encoder_resolution, 'position', axis.rotary)}" if axis.encoder else ""
    return (
        f"Axis {axis.name}: {factor * axis.motor_inertia:.4g} {unit} of motor and transmission beside "
        f"{factor * axis.load_inertia:.4g} {unit} of load, peak {peak}{count}"
    )


def numbers(machine: Machine) -> dict[str, Any]:
    """A machine for programs: sections as in the file, each quantity as its value and unit."""
    page: dict[str, Any] = {"name": machine.name, "title": machine.title}
    if (moves := machine.kinematics) is not None:
        lengths = {key: as_quantity(value, "position", False) for key, value in moves.parameters.items()}
        page["kinematics"] = {"type": moves.kind, "joints": list(moves.joints), **lengths}
    if machine.control is not None:
        said = values(machine.control)
        page["control"] = {
            name: as_quantity(value, one.metadata.get("kind"), turns) for name, one, value, turns in said
        }
    page["axes"] = {}
    for name, axis in machine.axes.items():
        sections: dict[str, Any] = {"motion": axis.motion}
        for section, one, value, rotary in axis.said():
            sections.setdefault(section, {})[one.name] = as_quantity(value, one.metadata.get("kind"), rotary)
        page["axes"][name] = sections
    return {**page, "notes": [*machine.notes]}
