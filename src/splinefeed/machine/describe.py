"""A machine described in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

from splinefeed.kinematics import Kinematics
from splinefeed.machine.control import Control, values
from splinefeed.machine.parts import Axis
from splinefeed.machine.quantities import KINDS, show, shown, unit_shown

#: Sections in the order in which force and signal run.
_ORDER = ("controller", "drive", "motor", "transmission", "load", "friction", "encoder", "scale", "limits")


def describe_table(
    name: str,
    title: str,
    axes: Iterable[Axis],
    notes: Iterable[str],
    kinematics: Kinematics | None = None,
    control: Control | None = None,
) -> str:
    """Name, kinematics, control, axes and notes of a machine, one line a part, with units."""
    lines = [f"{name}: {title}" if title else name]
    if kinematics is not None:
        words = [f"{key} {show(value, 'position', False)}" for key, value in kinematics.parameters.items()]
        lines += ["", ", ".join([f"Kinematics {kinematics.kind}, joints {' '.join(kinematics.joints)}", *words])]
    if control is not None:
        lines += ["", *_describe_control(control)]
    for axis in axes:
        lines += ["", *_describe_axis(axis)]
    remarks = [f"- {note}" for note in notes]
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
    for one in fields(part):
        value = getattr(part, one.name)
        if one.name == "source" or value is None or value == "" or (value == 0.0 and one.default == 0.0):
            continue
        name = one.name.replace("_", " ")
        kind = one.metadata.get("kind")
        if kind in KINDS:
            rotary = axis.motor.motion == "rotary" if one.metadata["motor"] else axis.rotary
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


def table_numbers(
    name: str,
    title: str,
    axes: Iterable[Axis],
    notes: Iterable[str],
    kinematics: Kinematics | None = None,
    control: Control | None = None,
) -> dict[str, Any]:
    """A machine for programs: sections as in the file, each quantity as its value and unit."""
    return {
        "name": name,
        "title": title,
        **({} if kinematics is None else {"kinematics": _kinematics_numbers(kinematics)}),
        **({} if control is None else {"control": control_numbers(control)}),
        "axes": {axis.name: _axis_numbers(axis) for axis in axes},
        "notes": list(notes),
    }


def control_numbers(control: Control) -> dict[str, Any]:
    """A control for programs: by the names of the file, each quantity as its value and unit."""
    found: dict[str, Any] = {}
    for name, one, value, rotary in values(control):
        kind = one.metadata.get("kind")
        quantity = {"value": shown(value, kind, rotary), "unit": unit_shown(kind, rotary)} if kind in KINDS else value
        found[name] = quantity
    return found


def _kinematics_numbers(kinematics: Kinematics) -> dict[str, Any]:
    values = {key: {"value": value, "unit": "mm"} for key, value in kinematics.parameters.items()}
    return {"type": kinematics.kind, "joints": list(kinematics.joints), **values}


def _axis_numbers(axis: Axis) -> dict[str, Any]:
    sections: dict[str, Any] = {"motion": axis.motion}
    for section in _ORDER:
        part = getattr(axis, section)
        if part is None:
            continue
        values = {one.name: _number(getattr(part, one.name), one.metadata, axis) for one in fields(part)}
        sections[section] = {key: value for key, value in values.items() if value is not None and value != ""}
    return sections


def _number(value: Any, metadata: Mapping[str, Any], axis: Axis) -> Any:
    kind = metadata.get("kind")
    if value is None or kind not in KINDS:
        return value
    rotary = axis.motor.motion == "rotary" if metadata["motor"] else axis.rotary
    return {"value": shown(value, kind, rotary), "unit": unit_shown(kind, rotary)}
