"""A machine described: in words, and in numbers for programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from splinefeed.machine.control import Control, values
from splinefeed.machine.parts import Axis
from splinefeed.machine.quantities import KINDS, as_quantity, show

if TYPE_CHECKING:
    from splinefeed.machine.machine import Machine

#: Sections of an axis in the order in which force and signal run.
SECTIONS = ("controller", "drive", "motor", "transmission", "load", "friction", "encoder", "scale", "limits")


def describe(machine: Machine) -> str:
    """Name, kinematics, control, axes and notes of a machine, one line a part, with units."""
    lines = [f"{machine.name}: {machine.title}" if machine.title else machine.name]
    if (moves := machine.kinematics) is not None:
        words = [f"{key} {show(value, 'position', False)}" for key, value in moves.parameters.items()]
        lines += ["", ", ".join([f"Kinematics {moves.kind}, joints {' '.join(moves.joints)}", *words])]
    if (control := machine.control) is not None:
        lines += ["", f"Control, {control.mode}"]
        for name, one, value, rotary in values(control):
            if name not in ("mode", "source") and value != 0.0:
                lines.append(f"  {name + ':':<20} {_words(value, one.metadata.get('kind'), rotary)}")
        lines += [f"  ({control.source})"] if control.source else []
    for axis in machine.axes.values():
        lines += ["", *_of_axis(axis)]
    if machine.notes:
        lines += ["", "Notes", *(f"- {note}" for note in machine.notes)]
    return "\n".join(lines)


def _of_axis(axis: Axis) -> list[str]:
    lines = [f"Axis {axis.name} ({axis.motion}), closed over the {axis.controller.feedback}"]
    for section in SECTIONS:
        part = getattr(axis, section)
        words = [] if part is None else _of_part(part, axis)
        if words:
            lines.append(f"  {section + ':':<13} {', '.join(words)}")
            lines += [f"  {'':<13} ({part.source})"] if part.source else []
    unit, factor = ("kg*m^2", 1.0) if axis.rotary else ("kg", 1000.0)
    lines.append(
        f"  at the axis:  {factor * axis.motor_inertia:.4g} {unit} of motor and transmission beside "
        f"{factor * axis.load_inertia:.4g} {unit} of load; "
        f"peak {show(axis.motor.peak_force * axis.force_per_motor_force, 'force', axis.rotary)}"
    )
    if axis.encoder is not None:
        lines.append(f"  {'':<13} one encoder count is {show(axis.encoder_resolution, 'position', axis.rotary)}")
    return lines


def _of_part(part: Any, axis: Axis) -> list[str]:
    """The fields of a part that are set, as `name value unit`."""
    found = []
    for one, value, rotary in axis.said(part):
        if one.name != "source" and not (value == 0.0 and one.default == 0.0):
            kind = one.metadata.get("kind")
            name = one.name.replace("_", " ")
            name = name.replace("force", "torque") if rotary and str(kind).startswith("force") else name
            found.append(f"{name} {_words(value, kind, rotary)}")
    return found


def _words(value: Any, kind: str | None, rotary: bool) -> str:
    if kind in KINDS:
        return show(value, kind, rotary)
    return f"{value:g}" if kind == "number" else str(value)


def numbers(machine: Machine) -> dict[str, Any]:
    """A machine for programs: sections as in the file, each quantity as its value and unit."""
    page: dict[str, Any] = {"name": machine.name, "title": machine.title}
    if (moves := machine.kinematics) is not None:
        lengths = {key: as_quantity(value, "position", False) for key, value in moves.parameters.items()}
        page["kinematics"] = {"type": moves.kind, "joints": list(moves.joints), **lengths}
    if machine.control is not None:
        page["control"] = control_numbers(machine.control)
    page["axes"] = {name: {"motion": axis.motion} for name, axis in machine.axes.items()}
    for name, axis in machine.axes.items():
        for section in SECTIONS:
            if (part := getattr(axis, section)) is not None:
                page["axes"][name][section] = {
                    one.name: as_quantity(value, one.metadata.get("kind"), rotary)
                    for one, value, rotary in axis.said(part)
                }
    return {**page, "notes": [*machine.notes]}


def control_numbers(control: Control) -> dict[str, Any]:
    """A control for programs: by the names of the file, each quantity as its value and unit."""
    return {name: as_quantity(value, one.metadata.get("kind"), rotary) for name, one, value, rotary in values(control)}
