"""Machines: TOML files read strictly, every error at once and each with its place."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from splinefeed.errors import FormatError, InputError, ProblemsError, UnitError, nearest
from splinefeed.kinematics import Kinematics, kinds, kinematics
from splinefeed.machine import describe, parts, quantities
from splinefeed.machine.control import PARTS, AxisControl, Control
from splinefeed.records import ROTARY_AXES

#: Sections of an axis and the record that each becomes.
SECTIONS: dict[str, type[Any]] = {
    "motor": parts.Motor,
    "drive": parts.Drive,
    "transmission": parts.Transmission,
    "load": parts.Load,
    "friction": parts.Friction,
    "encoder": parts.Encoder,
    "scale": parts.Scale,
    "controller": parts.Controller,
    "limits": parts.AxisLimits,
}
#: Sections that an axis may do without.
OPTIONAL = ("friction", "encoder", "scale", "limits")
#: Keys beside the axes at the top of a file.
_TOP = ("title", "notes", "kinematics", "control", "axis")
#: A machine file beyond this many bytes is none.
_LARGEST_FILE = 1_000_000


class MachineError(ProblemsError):
    """A machine file with errors: the first line names the file, each of `problems` its place and how to fix it."""


@dataclass(frozen=True, kw_only=True)
class Machine:
    """A machine: its axes by name, in order, the notes of its makers, and how its joints move tool and workpiece.

    kinematics  of a machine for tool paths, whose joints are among its axes; else None
    control     how its control plans a program, for cycle times; a machine that has it needs no axes
    Quantities in mm, s, kg, V, N; with a rotary axis rad and N*m. `load` and `parse` raise MachineError, one line
    per problem. Source: docs/machines.md. Example: `sf.Machine.load("router").axes["x"].controller.kp`
    """

    name: str
    axes: Mapping[str, parts.Axis]
    title: str = ""
    notes: tuple[str, ...] = field(default=())
    kinematics: Kinematics | None = None
    control: Control | None = None

    def __repr__(self) -> str:
        return f"Machine({self.name!r}, axes {' '.join(self.axes)})"

    @staticmethod
    def names() -> tuple[str, ...]:
        """Names of the machines that come with the package."""
        folder = files("splinefeed").joinpath("machines")
        return tuple(sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml")))

    @staticmethod
    def load(name: str | Path) -> Machine:
        """A machine of the package by its name, or any machine file by its path.

        Raises MachineError with everything that is wrong in the file, and FormatError if there is no such machine.
        """
        if isinstance(name, str) and name in Machine.names():
            return _packaged(name)
        path = Path(name)
        if path.suffix != ".toml" and not path.exists():
            mend = nearest(name, Machine.names(), "give a name or the path of a .toml file")
            raise FormatError(f"{name}: no machine of this name; there are {', '.join(Machine.names())}; {mend}")
        try:
            if path.stat().st_size > _LARGEST_FILE:
                raise FormatError(f"{name}: {path.stat().st_size} bytes; a machine file has at most {_LARGEST_FILE}")
            text = path.read_text(encoding="utf-8")
        except OSError as error:
            raise FormatError(
                f"{name}: cannot be read ({error.strerror or error}); check the name and the folder"
            ) from None
        except UnicodeDecodeError:
            raise FormatError(f"{name}: is not UTF-8 text") from None
        return Machine.parse(text, path.stem, str(name))

    @staticmethod
    def parse(text: str, name: str = "machine", source: str | None = None) -> Machine:
        """A machine from the text of a machine file; `source` is what error messages call it."""
        source = name if source is None else source
        try:
            content = tomllib.loads(text)
        except (tomllib.TOMLDecodeError, RecursionError) as error:
            raise FormatError(f"{source}: is not TOML: {error}") from None
        problems: list[str] = []
        _unknown_keys(content, _TOP, "", problems)
        title = _text(content.get("title", ""), "title", problems)
        notes = content.get("notes", [])
        if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
            problems.append("notes: must be a list of texts")
        given = content.get("axis", {})
        if not isinstance(given, dict) or not (given or "control" in content):
            problems.append("axis: missing; a machine needs at least one [axis.NAME]")
            given = {}
        axes = {axis: _axis(axis, section, problems) for axis, section in given.items()}
        moves = _kinematics(content["kinematics"], given, problems) if "kinematics" in content else None
        plans = _control(content["control"], problems) if "control" in content else None
        if problems:
            raise MachineError(source, problems)
        made = {key: axis for key, axis in axes.items() if axis is not None}
        return Machine(name=name, axes=made, title=title, notes=tuple(notes), kinematics=moves, control=plans)

    def limits(self, axes: Iterable[str]) -> dict[str, dict[str, float]]:
        """Limits of those `axes` that the machine has, as `Limits(feed=..., **machine.limits(path.axes))` takes them.

        By name of the limit (axis_velocity, axis_acceleration, axis_jerk, axis_minimum, axis_maximum) and axis, in mm,
        s and rad; what the machine file does not limit is left out.
        """
        found: dict[str, dict[str, float]] = {}
        for axis in axes:
            if axis in self.axes:
                for name in ("velocity", "acceleration", "jerk", "minimum", "maximum"):
                    value = getattr(self.axes[axis].limits, name)
                    if value is not None:
                        found.setdefault(f"axis_{name}", {})[axis] = value
        return found

    def as_dict(self) -> dict[str, Any]:
        """The machine as `machine show --json` prints it: each quantity as its value and unit."""
        return describe.numbers(self)

    def save(self, path: str | Path) -> None:
        """Write a machine file that loads again as the same machine; see `machine.writing`."""
        from splinefeed.machine import writing

        writing.save(self, path)

    def describe(self) -> str:
        """The machine in words, a paragraph an axis."""
        return describe.describe(self)


@cache
def _packaged(name: str) -> Machine:
    return Machine.parse(files("splinefeed").joinpath("machines", f"{name}.toml").read_text(encoding="utf-8"), name)


def _text(value: object, place: str, problems: list[str]) -> str:
    if not isinstance(value, str):
        problems.append(f"{place}: {value!r}; must be text")
        return ""
    return value


def _unknown_keys(given: Mapping[str, Any], known: Iterable[str], place: str, problems: list[str]) -> None:
    """Add a problem for every key of `given` that is not `known`, with the nearest that is."""
    known = tuple(known)
    for key in given:
        if key not in known:
            problems.append(f"{place}{key}: unknown key; {nearest(key, known)}")


def _kinematics(content: Any, axes: Mapping[str, Any], problems: list[str]) -> Kinematics | None:
    """The kinematics of the file, or None after adding what is wrong with them to `problems`."""
    if not isinstance(content, dict):
        problems.append("kinematics: must be a table")
        return None
    kind = content.get("type")
    if kind not in kinds():
        problems.append(f"kinematics.type: {kind!r}; must be one of {', '.join(kinds())}")
        return None
    parameters = {}
    for name, value in content.items():
        if name in ("type", "source"):
            continue
        try:
            parameters[name] = quantities.parse(value, "position", False)
        except UnitError as error:
            problems.append(f"kinematics.{name}: {error}")
            return None
    try:
        found = kinematics(kind, **parameters)
    except InputError as error:
        problems.append(str(error))
        return None
    missing = [joint for joint in found.joints if joint not in axes]
    if missing:
        problems.append(f"kinematics.type: {kind} moves the joint {missing[0]}; give an [axis.{missing[0]}]")
    return found


def _control(content: Any, problems: list[str]) -> Control | None:
    """The section [control], or None after adding what is wrong with it to `problems`."""
    if not isinstance(content, dict):
        problems.append("control: must be a table")
        return None
    made: dict[str, Any] = {}
    axes = content.get("axis", {})
    for section, part in PARTS.items():
        if section in content:
            made[section] = _part(content[section], part, f"control.{section}", False, problems)
    if not isinstance(axes, dict):
        problems.append("control.axis: must be a table")
        axes = {}
    made["axes"] = {
        name: _part(each, AxisControl, f"control.axis.{name}", name in ROTARY_AXES, problems)
        for name, each in axes.items()
    }
    plain = {key: value for key, value in content.items() if key not in PARTS and key != "axis"}
    values = _section(plain, Control, "control.", False, True, problems, sections=(*PARTS, "axis"))
    return None if values is None or problems else Control(**values, **made)


def _part(content: Any, part: type[Any], place: str, rotary: bool, problems: list[str]) -> Any:
    """One table as its record, or None after adding what is wrong with it to `problems`."""
    if not isinstance(content, dict):
        problems.append(f"{place}: must be a table")
        return None
    values = _section(content, part, f"{place}.", rotary, True, problems)
    return None if values is None else part(**values)


def _axis(name: str, content: Any, problems: list[str]) -> parts.Axis | None:
    """One axis of the file, or None after adding what is wrong with it to `problems`."""
    place = f"axis.{name}."
    if not isinstance(content, dict):
        problems.append(f"axis.{name}: must be a table")
        return None
    before = len(problems)
    _unknown_keys(content, ("motion", *SECTIONS), place, problems)
    usual = "rotary" if name in ROTARY_AXES else "linear"
    motion = content.get("motion", usual)
    if motion not in ("linear", "rotary"):
        problems.append(f"{place}motion: {motion!r}; must be one of linear, rotary")
    elif motion != usual:
        why = (
            f"{name} is {'a rotary' if usual == 'rotary' else 'not a rotary'} axis; rotary are {', '.join(ROTARY_AXES)}"
        )
        problems.append(f"{place}motion: {motion!r}; {why}")
    rotary = motion == "rotary"
    motor = content.get("motor")
    motor_rotary = not (isinstance(motor, dict) and motor.get("motion") == "linear")
    made: dict[str, Any] = {}
    for section, part in SECTIONS.items():
        if section not in content:
            if section not in OPTIONAL:
                problems.append(f"{place}{section}: missing")
            continue
        if not isinstance(content[section], dict):
            problems.append(f"{place}{section}: must be a table")
            continue
        values = _section(content[section], part, f"{place}{section}.", rotary, motor_rotary, problems)
        if values is not None:
            made[section] = part(**values)
    if len(problems) > before:
        return None
    try:
        return parts.Axis(name=name, motion=motion, **made)
    except InputError as error:
        problems.extend(str(error).splitlines())
        return None


def _section(
    content: Mapping[str, Any],
    part: type[Any],
    place: str,
    rotary: bool,
    motor_rotary: bool,
    problems: list[str],
    sections: Iterable[str] = (),
) -> dict[str, Any] | None:
    """The values of one section in base units, or None after adding what is wrong to `problems`.

    sections  also known, for they stand within this one
    """
    before = len(problems)
    described = {f.name: f for f in fields(part) if f.metadata}
    _unknown_keys(content, (*described, *sections), place, problems)
    values: dict[str, Any] = {}
    for key, one in described.items():
        if key not in content:
            if one.default is MISSING:
                problems.append(f"{place}{key}: missing{_expected(one, motor_rotary if _motors(one) else rotary)}")
            continue
        value = content[key]
        kind = one.metadata.get("kind")
        if kind is not None and kind != "number":
            try:
                value = quantities.parse(value, kind, motor_rotary if _motors(one) else rotary)
            except UnitError as error:
                problems.append(f"{place}{key}: {error}")
                continue
        problem = parts.value_problem(one, value)
        if problem is not None:
            shown = f"{content[key]}; {problem.split('; ', 1)[-1]}" if isinstance(content[key], str) else problem
            problems.append(f"{place}{key}: {shown if kind else problem}")
            continue
        values[key] = value
    return values if len(problems) == before else None


def _motors(described: Field[Any]) -> bool:
    return bool(described.metadata.get("motor"))


def _expected(described: Field[Any], rotary: bool) -> str:
    """What a missing key should hold, for the end of a message."""
    kind = described.metadata.get("kind")
    if kind in quantities.KINDS:
        wanted = quantities.KINDS[kind][rotary]
        return f"; expected {wanted.title} such as {wanted.example}"
    if "choices" in described.metadata:
        return f"; must be one of {', '.join(described.metadata['choices'])}"
    return ""
