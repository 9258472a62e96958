"""A machine described in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from splinefeed.machine.control import Control, values
from splinefeed.machine.parts import Axis
from splinefeed.machine.quantities import KINDS, as_quantity, show

if TYPE_CHECKING:
    from splinefeed.machine.machine import Machine

#: Sections in the order in which force and signal run.
_ORDER = ("controller", "drive", "motor", "transmission", "load", "friction", "encoder", "scale", "limits")


def describe(machine: Machine) -> str:
    """Name, kinematics, control, axes and notes of a machine, one line a part, with units."""
    lines = [f"{machine.name}: {machine.title}" if machine.title else machine.name]
    if (moves := machine.kinematics) is not None:
        words = [f"{key} {show(value, 'position', False)}" for key, value in moves.parameters.items()]
        lines += ["", ", ".join([f"Kinematics {moves.kind}, joints {' '.join(moves.joints)}", *words])]
    if machine.control is not None:
        lines += ["", *_describe_control(machine.control)]
    for axis in machine.axes.values():
        lines += ["", *_describe_axis(axis)]
    remarks = [f"- {note}" for note in machine.notes]
    if remarks:
        lines += ["", "Notes", *remarks]
    return "\n".join(lines)


def _describe_control(control: Control) -> list[str]:
    lines = [f"Control, {control.mode}"]
    for name, one, value, rotary in values(control):
        if name not in ("mode", "source") and value != 0.0:
            kind = one.metadata.get("kind")
            lines.append(f"  {name + ':':<20} {show(value, kind, rotary) if kind in KINDS else value}")
    return lines + ([f"  ({control.source})"] if control.source else [])


def _describe_axis(axis: Axis) -> list[str]:
    lines = [f"Axis {axis.name} ({axis.motion}), closed over the {axis.controller.feedback}"]
    for section in _ORDER:
        part = getattr(axis, section)
        words = "" if part is None else _describe_part(part, axis)
        if part is not None and words:
            lines.append(f"  {section + ':':<13} {words}")
            if part.source:
                lines.append(f"  {'':<13} ({part.source})")
    unit = "kg*m^2" if axis.rotary else "kg"
    factor = 1.0 if axis.rotary else 1000.0
    lines.append(
        f"  at the axis:  {factor * axis.motor_inertia:.4g} {unit} of motor and transmission beside "
        f"{factor * axis.load_inertia:.4g} {unit} of load; "
        f"peak {show(axis.motor.peak_force * axis.force_per_motor_force, 'force', axis.rotary)}"
    )
    if axis.encoder is not None:
        lines.append(f"  {'':<13} one encoder count is {show(axis.encoder_resolution, 'position', axis.rotary)}")
    return lines


def _describe_part(part: Any, axis: Axis) -> str:
    """The fields of a part that are set, as `name value unit`."""
    words = []
    for one, value, rotary in axis.said(part):
        if one.name == "source" or (value == 0.0 and one.default == 0.0):
            continue
        name, kind = one.name.replace("_", " "), one.metadata.get("kind")
        if kind in KINDS:
            force = "torque" if rotary and kind.startswith("force") else "force"
            words.append(
                f"{name.replace('force', force) if kind.startswith('force') else name} {show(value, kind, rotary)}"
            )
        elif kind == "number":
            words.append(f"{name} {value:g}")
        elif one.name in ("kind", "mode", "model"):
            words.insert(0, str(value))
        else:
            words.append(f"{name} {value}")
    return ", ".join(words)


def numbers(machine: Machine) -> dict[str, Any]:
    """A machine for programs: sections as in the file, each quantity as its value and unit."""
    page: dict[str, Any] = {"name": machine.name, "title": machine.title}
    if (moves := machine.kinematics) is not None:
        lengths = {key: as_quantity(value, "position", False) for key, value in moves.parameters.items()}
        page["kinematics"] = {"type": moves.kind, "joints": list(moves.joints), **lengths}
    if machine.control is not None:
        page["control"] = control_numbers(machine.control)
    return {
        **page,
        "axes": {name: _axis_numbers(axis) for name, axis in machine.axes.items()},
        "notes": [*machine.notes],
    }


def control_numbers(control: Control) -> dict[str, Any]:
    """A control for programs: by the names of the file, each quantity as its value and unit."""
    return {name: as_quantity(value, one.metadata.get("kind"), rotary) for name, one, value, rotary in values(control)}


def _axis_numbers(axis: Axis) -> dict[str, Any]:
    parts = {section: part for section in _ORDER if (part := getattr(axis, section)) is not None}
    sections = {
        section: {
            one.name: as_quantity(value, one.metadata.get("kind"), rotary) for one, value, rotary in axis.said(part)
        }
        for section, part in parts.items()
    }
    return {"motion": axis.motion, **sections}
