"""Machines: TOML files read strictly, every error at once and each with its place."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from splinefeed.errors import FormatError, InputError, ProblemsError, UnitError, nearest
from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.source import read_text
from splinefeed.kinematics import Kinematics, kinds, kinematics
from splinefeed.machine import parts, quantities, writing
from splinefeed.machine.control import PARTS, AxisControl, Control
from splinefeed.records import ROTARY_AXES

#: Keys beside the axes at the top of a file.
_TOP = ("title", "notes", "kinematics", "control", "axis")
#: A machine file beyond this many bytes is none.
_LARGEST_FILE = 2**20


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
        return Machine.parse(read_text(path, "a machine file", _LARGEST_FILE), path.stem, str(name))

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
        title, notes = content.get("title", ""), content.get("notes", [])
        if not isinstance(notes, list) or not all(isinstance(each, str) for each in (title, *notes)):
            problems.append("title, notes: must be text and a list of texts")
        given = _table(content.get("axis", {}), "axis", problems)
        if not given and "control" not in content and not problems:
            problems.append("axis: missing; a machine needs at least one [axis.NAME]")
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
        return writing.numbers(self)

    def save(self, path: str | Path) -> None:
        """Write a machine file that loads again as the same machine, whole or not at all.

        Raises FormatError for a name that does not end in .toml, and for a file that cannot be written.
        """
        if not str(path).endswith(".toml"):
            raise FormatError(f"{path}: a machine file is named .toml")
        text = writing.to_text(self)
        with atomic_write(path) as temporary:
            temporary.write_text(text, encoding="utf-8")

    def describe(self) -> str:
        """The machine as its file says it, and what follows for each axis."""
        return writing.describe(self)


@cache
def _packaged(name: str) -> Machine:
    return Machine.parse(files("splinefeed").joinpath("machines", f"{name}.toml").read_text(encoding="utf-8"), name)


def _table(content: Any, place: str, problems: list[str]) -> dict[str, Any]:
    """`content`, or an empty table after adding to `problems` that it is none."""
    if isinstance(content, dict):
        return content
    problems.append(f"{place}: must be a table")
    return {}


def _unknown_keys(given: Mapping[str, Any], known: Iterable[str], place: str, problems: list[str]) -> None:
    """Add a problem for every key of `given` that is not `known`, with the nearest that is."""
    known = tuple(known)
    for key in given:
        if key not in known:
            problems.append(f"{place}{key}: unknown key; {nearest(key, known)}")


def _kinematics(content: Any, axes: Mapping[str, Any], problems: list[str]) -> Kinematics | None:
    """The kinematics of the file, or None after adding what is wrong with them to `problems`."""
    content = _table(content, "kinematics", problems)
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
    content = _table(content, "control", problems)
    made = {
        section: _part(content[section], part, f"control.{section}", (False, True), problems)
        for section, part in PARTS.items()
        if section in content
    }
    axes = _table(content.get("axis", {}), "control.axis", problems)
    made["axes"] = {
        name: _part(each, AxisControl, f"control.axis.{name}", (name in ROTARY_AXES, True), problems)
        for name, each in axes.items()
    }
    plain = {key: value for key, value in content.items() if key not in PARTS and key != "axis"}
    found: Control | None = _part(plain, Control, "control", (False, True), problems, made)
    return found


def _axis(name: str, content: Any, problems: list[str]) -> parts.Axis | None:
    """One axis of the file, or None after adding what is wrong with it to `problems`."""
    place = f"axis.{name}"
    before = len(problems)
    content = _table(content, place, problems)
    if len(problems) > before:
        return None
    _unknown_keys(content, ("motion", *parts.SECTIONS), f"{place}.", problems)
    motion = "rotary" if name in ROTARY_AXES else "linear"
    if content.get("motion", motion) != motion:
        problems.append(f"{place}.motion: {content['motion']!r}; must be {motion}: rotary are {', '.join(ROTARY_AXES)}")
    motor = content.get("motor")
    turns = (motion == "rotary", not (isinstance(motor, dict) and motor.get("motion") == "linear"))
    made: dict[str, Any] = {}
    for section, part in parts.SECTIONS.items():
        if section in content:
            made[section] = _part(content[section], part, f"{place}.{section}", turns, problems)
        elif section not in parts.OPTIONAL:
            problems.append(f"{place}.{section}: missing")
    if len(problems) > before:
        return None
    try:
        return parts.Axis(name=name, motion=motion, **made)
    except InputError as error:
        problems.extend(str(error).splitlines())
        return None


def _part(
    content: Any, part: type[Any], place: str, turns: tuple[bool, bool], problems: list[str], made: Any = None
) -> Any:
    """One table as its record, or None after adding what is wrong with it to `problems`.

    turns  whether the axis turns and whether the motor does;  made  values that are there already
    """
    before = len(problems)
    content = _table(content, place, problems)
    described = {each.name: each for each in fields(part) if each.metadata}
    _unknown_keys(content, [each.name for each in fields(part)], f"{place}.", problems)
    values: dict[str, Any] = dict(made or {})
    for key, one in described.items():
        kind, rotary = one.metadata.get("kind"), turns[bool(one.metadata.get("motor"))]
        if key not in content:
            if one.default is MISSING:
                wanted = f"; such as {quantities.KINDS[kind][rotary].example}" if kind in quantities.KINDS else ""
                problems.append(f"{place}.{key}: missing{wanted}")
            continue
        given = value = content[key]
        try:
            values[key] = value = quantities.parse(given, kind, rotary) if kind in quantities.KINDS else given
        except UnitError as error:
            problems.append(f"{place}.{key}: {error}")
            continue
        if (rule := parts.rule_broken(one, value)) is not None:
            problems.append(f"{place}.{key}: {given if kind else repr(given)}; {rule}")
    return part(**values) if len(problems) == before else None
