"""Machines: TOML files read strictly, every error at once and each with its place."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from splinefeed.errors import FormatError, InputError, ProblemsError, UnitError, nearest
from splinefeed.files.atomic import write_text
from splinefeed.files.source import read_text, toml_of
from splinefeed.kinematics import KINDS, Kinematics, kinematics
from splinefeed.machine import parts, quantities
from splinefeed.machine.control import Control
from splinefeed.machine.limits_toml import KINDS as LIMITS
from splinefeed.records import ROTARY_AXES

#: Keys beside the axes at the top of a file.
_OWN = ("title", "notes", "clearance", "control")
_TOP = (*_OWN, "kinematics", "axis")
#: Sections that describe the servo loop of an axis, and those of them that it needs.
_SERVO_NEEDS = ("motor", "drive", "transmission", "load", "controller")
_SERVO = (*_SERVO_NEEDS, "friction", "encoder", "scale")
#: A machine file beyond this many bytes is none.
_LARGEST_FILE = 2**20


class MachineError(ProblemsError):
    """A machine file with errors: the first line names the file, each of `problems` its place and how to fix it."""


@dataclass(frozen=True, kw_only=True)
class Machine:
    """A machine: its axes by name, in order, the notes of its makers, and how its joints move tool and workpiece.

    Parameters
    ----------
    name : str
        Of the machine.
    axes : mapping of str to Axis
        An `Axis` where limits alone are known, a `ServoAxis` with motor, drive and controller where the servo loop is.
    title : str, optional
        What people read.
    notes : sequence of str, optional
        What its makers say of it.
    kinematics : Kinematics, optional
        Of a machine for tool paths, whose joints are among its axes.
    control : Control, optional
        How its control plans a program, for cycle times; a machine that has it needs no axes.
    clearance : float, optional
        z of the rapid moves between contours of a drawing, mm; None where a drawing has no rapid moves above it.

    Raises
    ------
    FormatError
        By `load`, `parse` and `save`. MachineError, which is one, has a line for each fault of a file.

    Notes
    -----
    Quantities are in mm, s, kg, V, N; of a rotary axis in rad and N*m.

    References
    ----------
    .. [1] docs/machines.md, which describes the file.

    Examples
    --------
    >>> import splinefeed as sf
    >>> machine = sf.Machine.load("router")
    >>> machine
    Machine('router', axes x y z)
    >>> machine.axes["x"].controller.kp  # V/mm
    0.5
    """

    name: str
    axes: Mapping[str, Any]  # Axis, or ServoAxis where more than limits is known
    title: str = parts.words()
    notes: Sequence[str] = parts.listed("must be a list of texts", lambda each: isinstance(each, str))
    kinematics: Kinematics | None = None
    control: Control | None = field(default=None, metadata=parts.part(Control))
    clearance: float | None = parts.quantity("position", "any", None)

    def __repr__(self) -> str:
        return f"Machine({self.name!r}, axes {' '.join(self.axes)})"

    @staticmethod
    def names() -> tuple[str, ...]:
        """Return the names of the machines that come with the package."""
        folder = files("splinefeed").joinpath("machines")
        return tuple(sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml")))

    @staticmethod
    def load(name: str | Path) -> Machine:
        """Load a machine of the package by its name, or any machine file by its path.

        Parameters
        ----------
        name : str or Path
            A name in `names()`, or the path of a TOML file.

        Returns
        -------
        Machine
            As the file describes it.

        Raises
        ------
        FormatError
            For a name that is no machine, and a file that cannot be read. MachineError, which is one, has everything
            that is wrong in the file.
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
        """Make a machine from the text of a machine file.

        Parameters
        ----------
        text : str
            TOML.
        name : str, optional
            Of the machine.
        source : str, optional
            What error messages call the text; by default the name.

        Returns
        -------
        Machine
            As the text describes it.

        Raises
        ------
        FormatError
            For limits of a motion in place of a machine. MachineError, which is one, has everything that is wrong.
        """
        source = name if source is None else source
        content = toml_of(text, source)
        problems: list[str] = []
        if "axis" not in content and "control" not in content and any(key in LIMITS for key in content):
            raise FormatError(f"{source}: holds limits of a motion, not a machine; give it by --limits {source}")
        _unknown_keys(content, _TOP, "", problems)
        given = _table(content.get("axis", {}), "axis", problems)
        if not given and "control" not in content and not problems:
            problems.append("axis: missing; a machine needs at least one [axis.NAME]")
        axes = {axis: _axis(axis, section, problems) for axis, section in given.items()}
        moves = _kinematics(content["kinematics"], given, problems) if "kinematics" in content else None
        own = {key: value for key, value in content.items() if key in _OWN}
        made: Machine | None = _part(own, Machine, "", problems, name=name, axes=axes, kinematics=moves)
        if "clearance" in own and "z" not in given:
            problems.append("clearance: is a height of the axis z, which the machine does not have; give an [axis.z]")
        if made is None or problems:
            raise MachineError(source, problems)
        return replace(made, notes=tuple(made.notes))

    def limits(self, axes: Iterable[str]) -> dict[str, dict[str, float]]:
        """Return limits of axes as `Limits(feed=..., **machine.limits(path.axes))` takes them.

        Parameters
        ----------
        axes : iterable of str
            Names; those that the machine does not have are left out.

        Returns
        -------
        dict of str to dict of str to float
            By name of the limit (axis_velocity, axis_acceleration, axis_jerk, axis_minimum, axis_maximum) and axis, in
            mm, s and rad; what the machine file does not limit is left out.
        """
        own = [(axis, self.axes[axis].limits) for axis in axes if axis in self.axes]
        found = {
            name: {axis: value for axis, limits in own if (value := getattr(limits, key)) is not None}
            for name, key in parts.LIMITS_OF_AXIS.items()
        }
        return {name: values for name, values in found.items() if values}

    def simulates(self, axes: Iterable[str]) -> bool:
        """Tell whether the servo loops of axes are described.

        Parameters
        ----------
        axes : iterable of str
            Names; those that the machine does not have are left out.

        Returns
        -------
        bool
            Whether each of them is a ServoAxis.
        """
        return all(isinstance(self.axes[axis], parts.ServoAxis) for axis in axes if axis in self.axes)

    def servo_axis(self, axis: str) -> parts.ServoAxis:
        """Return an axis with its servo loop.

        Parameters
        ----------
        axis : str
            Its name.

        Returns
        -------
        ServoAxis
            The axis.

        Raises
        ------
        InputError
            Where its limits alone are known, with what to add to the file.
        """
        found = self.axes[axis]
        if not isinstance(found, parts.ServoAxis):
            sections = [f"[axis.{axis}.{each}]" for each in _SERVO_NEEDS]
            raise InputError(
                f"{self.name}: axis {axis} has limits alone, and this needs its servo loop: add {', '.join(sections)} "
                f"and [axis.{axis}.encoder] or [axis.{axis}.scale], as splinefeed machine show router prints them"
            )
        return found

    def as_dict(self) -> dict[str, Any]:
        """Return the machine as `machine show --json` prints it: each quantity as its value and unit."""
        page: dict[str, Any] = {"name": self.name, "title": self.title}
        if self.clearance is not None:
            page["clearance"] = quantities.as_quantity(self.clearance, "position", False)
        if (moves := self.kinematics) is not None:
            lengths = {key: quantities.as_quantity(value, "position", False) for key, value in moves.parameters.items()}
            page["kinematics"] = {"type": moves.kind, "joints": list(moves.joints), **lengths}
        if self.control is not None:
            page["control"] = _numbers(parts.values(self.control))
        page["axes"] = {}
        for name, axis in self.axes.items():
            page["axes"][name] = {"motion": axis.motion, **_nested(_numbers(axis.values()))}
        return {**page, "notes": [*self.notes]}

    def to_text(self) -> str:
        """Return the text of the machine's file, without defaults and without comments of the file it came from."""
        import tomlkit

        content: dict[str, Any] = {}
        if self.title:
            content["title"] = self.title
        if self.notes:
            content["notes"] = tomlkit.array().multiline(True)
            content["notes"].extend(self.notes)
        if self.clearance is not None:
            content["clearance"] = quantities.write(self.clearance, "position", False)
        if (moves := self.kinematics) is not None:
            lengths = {name: quantities.write(value, "position", False) for name, value in moves.parameters.items()}
            content["kinematics"] = {"type": moves.kind, **lengths}
        if self.control is not None:
            content["control"] = _nested(_texts(parts.values(self.control)))
        axes = {name: _nested(_texts(axis.values())) for name, axis in self.axes.items()}
        return tomlkit.dumps({**content, **({"axis": axes} if axes else {})})

    def save(self, path: str | Path) -> None:
        """Write a machine file that loads again as the same machine, whole or not at all.

        Parameters
        ----------
        path : str or Path
            File that ends in .toml.

        Raises
        ------
        FormatError
            For another suffix, and a file that cannot be written.
        """
        if not str(path).endswith(".toml"):
            raise FormatError(f"{path}: a machine file is named .toml")
        write_text(path, self.to_text())

    def describe(self) -> str:
        """Return the machine as its file describes it, and what follows for each axis."""
        return "\n".join([self.name, "", self.to_text(), *(axis.describe() for axis in self.axes.values())])


def _numbers(said: Iterable[parts.Said]) -> dict[str, Any]:
    """What is said by its name, quantities as value and unit."""
    return {name: quantities.as_quantity(value, one.metadata.get("kind"), rotary) for name, one, value, rotary in said}


def _texts(said: Iterable[parts.Said]) -> dict[str, Any]:
    """What differs from the default by its name, as a file says it."""
    return {
        name: quantities.write(value, one.metadata.get("kind"), rotary)
        for name, one, value, rotary in said
        if one.default is MISSING or value != one.default
    }


def _nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    """Tables within tables by names such as `spindle.start`."""
    content: dict[str, Any] = {}
    for name, value in flat.items():
        *tables, key = name.split(".")
        table = content
        for each in tables:
            table = table.setdefault(each, {})
        table[key] = value
    return content


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
    if kind not in KINDS:
        problems.append(f"kinematics.type: {kind!r}; must be one of {', '.join(KINDS)}")
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


def _axis(name: str, content: Any, problems: list[str]) -> Any:
    """One axis of the file, or None after adding what is wrong with it to `problems`."""
    motion = "rotary" if name in ROTARY_AXES else "linear"
    motor = "rotary"
    record: type[parts.Axis] = parts.ServoAxis
    if isinstance(content, dict):
        if isinstance(content.get("motor"), dict):
            motor = content["motor"].get("motion", motor)
        content = dict(content)
        if (given := content.pop("motion", motion)) != motion:
            problems.append(f"axis.{name}.motion: {given!r}; must be {motion}: rotary are {', '.join(ROTARY_AXES)}")
        known = [one.name for one in fields(parts.ServoAxis) if one.metadata]
        _unknown_keys(content, known, f"axis.{name}.", problems)
        content = {key: value for key, value in content.items() if key in known}
        if not any(key in content for key in _SERVO):
            record = parts.Axis
            if not content.get("limits"):
                problems.append(f"axis.{name}.limits: missing; give at least velocity and acceleration")
    turns = (motion == "rotary", motor != "linear")
    return _part(content, record, f"axis.{name}", problems, turns, name=name, motion=motion)


def _part(
    content: Any, record: type[Any], place: str, problems: list[str], turns: tuple[bool, bool] = (False, True),
    **made: Any,
) -> Any:  # fmt: skip
    """Return one table as its record, or None after adding what is wrong with it to `problems`.

    Parameters
    ----------
    content : object
        The table.
    record : type
        A dataclass of fields as `parts` makes them.
    place : str
        Of the table in the file, for messages.
    problems : list of str
        Gets a line for each fault.
    turns : (bool, bool), optional
        Whether the axis turns and whether the motor does.
    **made
        Values that are there already.
    """
    before = len(problems)
    content = _table(content, place, problems)
    if len(problems) > before:
        return None
    described = {one.metadata.get("key") or one.name: one for one in fields(record) if one.metadata}
    _unknown_keys(content, described, f"{place}.", problems)
    for key, one in described.items():
        kind, rotary = one.metadata.get("kind"), turns[bool(one.metadata.get("motor"))]
        part, where = one.metadata.get("part"), f"{place}.{key}".removeprefix(".")
        if key not in content:
            if one.default is MISSING and one.default_factory is MISSING:
                wanted = f"; such as {quantities.KINDS[kind][rotary].example}" if kind in quantities.KINDS else ""
                problems.append(f"{where}: missing{wanted}")
            continue
        given = value = content[key]
        if part is not None and not one.metadata["key"]:
            made[key] = _part(given, part, where, problems, turns)
        elif part is not None:
            made[one.name] = {
                axis: _part(each, part, f"{where}.{axis}", problems, (axis in ROTARY_AXES, True))
                for axis, each in _table(given, where, problems).items()
            }
        else:
            try:
                made[key] = value = quantities.parse(given, kind, rotary) if kind in quantities.KINDS else given
            except UnitError as error:
                problems.append(f"{where}: {error}")
                continue
            if (rule := parts.rule_broken(one, value)) is not None:
                problems.append(f"{where}: {given if kind else repr(given)}; {rule}")
    if len(problems) > before:
        return None
    try:
        return record(**made)
    except InputError as error:
        problems += str(error).splitlines()
        return None
