"""What a LinuxCNC machine allows, from its INI file: axes, units, limits of each axis and of the path."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.files.source import read_text
from splinefeed.live.linuxcnc_joints import LETTERS, MODULES, MovedJoints
from splinefeed.live.linuxcnc_wire import AXES, JOINTS
from splinefeed.machine.imports.linuxcnc import ANGULAR, LINEAR, TRIVIAL, Sections, axes_of, sections
from splinefeed.machine.imports.page import number, positive
from splinefeed.records import ROTARY_AXES, Array, IntArray, Limits

#: Jerk of an axis without MAX_JERK: so many times its acceleration, a second.
JERK_TIMES = 20.0
#: What external offsets may take of an axis at most; where they turn about, the joint's jerk is so many times
#: their acceleration over the period: LinuxCNC interpolates it over three ticks, 1/6, 4/6, 1/6.
MOST_OFFSETS, OFFSET_JERK = 0.9, 4.0 / 3.0
#: The plan keeps this share of an axis' jerk, whatever its offsets take.
KEPT_JERK = 0.5


@dataclass(frozen=True, eq=False)
class Mill:
    """The machine of an INI file.

    Parameters
    ----------
    axes : tuple of str
        Its axes, linear ones first.
    columns : array (axes,)
        Their places in a pose of LinuxCNC.
    units : array (9,)
        mm or rad of one unit of each axis of a pose.
    linear : float
        mm of a linear unit.
    velocity, acceleration, jerk : array (axes + joints,)
        Limits of each axis, and of each joint that is none, mm and rad.
    feed : float
        More than any path allows, mm/s.
    notes : list of str, optional
        What was assumed, one sentence each.
    moved : MovedJoints, optional
        The joints that are no axes, where there are some.
    """

    axes: tuple[str, ...]
    columns: Array
    units: Array
    linear: float
    velocity: Array
    acceleration: Array
    jerk: Array
    feed: float
    notes: list[str] = field(default_factory=list)
    moved: MovedJoints | None = None

    @property
    def limited(self) -> tuple[str, ...]:
        """Axes, and joints that are none."""
        return self.axes if self.moved is None else (*self.axes, *self.moved.names)

    @property
    def piece_columns(self) -> IntArray:
        """Where the player has each of `limited`, (axes + joints,)."""
        return np.append(self.columns, np.arange(AXES, AXES + len(self.limited) - len(self.axes)))

    @property
    def column_units(self) -> Array:
        """Of each of `limited` mm or rad of one of LinuxCNC's units, (axes + joints,)."""
        return np.append(self.units[self.columns], np.full(len(self.limited) - len(self.axes), self.linear))

    def limits(self, reserve: float) -> Limits:
        """Give the limits to plan under.

        Parameters
        ----------
        reserve : float
            For pause and override: a share of the acceleration, twice that of the jerk.

        Returns
        -------
        Limits
            Of axes, and of joints that are none.
        """
        names = self.limited
        return Limits(
            feed=self.feed,
            axis_velocity=dict(zip(names, self.velocity.tolist(), strict=True)),
            axis_acceleration=dict(zip(names, ((1.0 - reserve) * self.acceleration).tolist(), strict=True)),
            axis_jerk=dict(zip(names, ((1.0 - 2.0 * reserve) * self.jerk).tolist(), strict=True)),
        )


def mill_of(file: str) -> Mill:
    """Read the machine of an INI file.

    Parameters
    ----------
    file : str
        Of LinuxCNC.

    Returns
    -------
    Mill
        Axes, units and limits.

    Raises
    ------
    FormatError
        For what is missing, and for kinematics that cannot be planned.
    """
    text = read_text(Path(file), "a configuration")
    ini = sections(text, file)
    if "TRAJ" not in ini:
        raise FormatError(f"{file}: no section [TRAJ]; is it the INI file of a LinuxCNC machine?")
    traj, notes = ini["TRAJ"], []
    if traj.get("TPMOD", "").split() != ["splinefeed_tp"]:
        notes.append("[TRAJ]TPMOD is not splinefeed_tp: LinuxCNC plans itself until it is")
    name, *arguments = (ini.get("KINS", {}).get("KINEMATICS") or TRIVIAL).split()
    if name != TRIVIAL and name not in MODULES:
        known = ", ".join([TRIVIAL, *MODULES])
        raise FormatError(f"{file}: [KINS]KINEMATICS = {name}: it can plan {known}; leave TPMOD out")
    linear = _unit(traj.get("LINEAR_UNITS", "mm"), LINEAR, {"mm": 1.0, "in": 25.4}, f"{file}: [TRAJ]LINEAR_UNITS")
    degrees = {"deg": np.pi / 180.0, "rad": 1.0}
    angular = _unit(traj.get("ANGULAR_UNITS", "degree"), ANGULAR, degrees, f"{file}: [TRAJ]ANGULAR_UNITS")
    letters, joints = _joints_of(ini, name, arguments, file)
    axes = tuple(sorted(letters, key=lambda axis: (axis in ROTARY_AXES, LETTERS.index(axis))))
    units = np.array([angular if axis in ROTARY_AXES else linear for axis in LETTERS])
    columns = np.array([LETTERS.index(axis) for axis in axes])
    module = MODULES.get(name)
    own = "" if module is None else module.moved
    places = [
        [f"AXIS_{axis.upper()}", *(f"JOINT_{joint}" for joint in joints[axis] if axis not in own)] for axis in axes
    ]
    moved = None
    if module is not None:
        numbers = sorted((joint, axis) for axis in own for joint in joints[axis])
        if len(numbers) > JOINTS:
            raise FormatError(f"{file}: {len(numbers)} joints that are no axes; it can plan {JOINTS}")
        places += [[f"JOINT_{joint}"] for joint, _ in numbers]
        moved = MovedJoints(
            name, module, axes, tuple(axis for _, axis in numbers), tuple(joint for joint, _ in numbers),
        )  # fmt: skip
    found = np.array([_limits(ini, names, file, notes) for names in places]).T
    for k, axis in enumerate(axes):
        took = _for_offsets(ini, f"AXIS_{axis.upper()}", found[:, k], file, notes)
        if moved is not None and np.any(took):
            where = f"[AXIS_{axis.upper()}]OFFSET_AV_RATIO"
            raise FormatError(f"{file}: {where}: with {name} external offsets cannot be planned; leave it out")
        found[:, k] -= took
    found *= np.append(units[columns], np.full(len(places) - len(axes), linear))
    velocity = found[0, : len(axes)]
    rotary = np.array([axis in ROTARY_AXES for axis in axes])
    feed = float(np.linalg.norm(np.where(rotary, np.degrees(velocity), velocity)))  # no axis allows more
    return Mill(axes, columns, units, linear, found[0], found[1], found[2], feed, notes, moved)


def _joints_of(ini: Sections, name: str, arguments: list[str], file: str) -> tuple[list[str], dict[str, list[int]]]:
    """Letters of the axes, and the numbers of the joints of each; FormatError where a module lacks an axis."""
    if name == TRIVIAL:
        return axes_of(ini, arguments, file)
    module = MODULES[name]
    letters, _ = axes_of(ini, [], file)
    order = next((each.partition("=")[2].lower() for each in arguments if each.lower().startswith("coordinates=")), "")
    order = order if order and module.free else module.order
    for axis in {*module.needs, *letters}:
        if axis not in letters or axis not in order:
            where = "[TRAJ]COORDINATES" if axis not in letters else f"[KINS]KINEMATICS = {name}"
            raise FormatError(f"{file}: {where} has no {axis.upper()}: {name} has joints for {order.upper()}")
    return letters, {axis: [k for k, each in enumerate(order) if each == axis] for axis in letters}


def _limits(ini: Sections, names: list[str], file: str, notes: list[str]) -> list[float]:
    """Velocity, acceleration and jerk of an axis or a joint, in the file's units: the least of its sections."""
    found: list[float] = []
    for key in ("MAX_VELOCITY", "MAX_ACCELERATION", "MAX_JERK"):
        said = [positive(ini[n][key], file, f"[{n}]{key}")[1] for n in names if key in ini.get(n, {})]
        if said:
            found.append(min(said))
        elif key == "MAX_JERK":
            found.append(JERK_TIMES * found[1])
            notes.append(
                f"[{names[0]}]MAX_JERK is missing: {found[-1]:g}, {JERK_TIMES:g} times the acceleration a second"
            )
        else:
            kind, _, number = names[0].lower().partition("_")
            raise FormatError(f"{file}: {key} of {kind} {number.upper()} is missing; add it to [{names[0]}]")
    return found


def _for_offsets(ini: Sections, name: str, limits: Array, file: str, notes: list[str]) -> Array:
    """What external offsets take of the velocity, acceleration and jerk of an axis, (3,), in its units."""
    ratio = float(number(ini.get(name, {}).get("OFFSET_AV_RATIO", "0"), file, f"[{name}]OFFSET_AV_RATIO")[1])
    if not 0.0 <= ratio <= MOST_OFFSETS:
        raise FormatError(f"{file}: [{name}]OFFSET_AV_RATIO is {ratio:g}; give 0 to {MOST_OFFSETS:g}")
    if not ratio:
        return np.zeros(3)
    period = 1e-9 * positive(ini.get("EMCMOT", {}).get("SERVO_PERIOD", "1000000"), file, "[EMCMOT]SERVO_PERIOD")[1]
    own = np.array([positive(ini[name][key], file, f"[{name}]{key}")[1] if key in ini[name] else limit
                    for key, limit in zip(("MAX_VELOCITY", "MAX_ACCELERATION"), limits[:2], strict=True)])  # fmt: skip
    took = np.append(ratio * own, OFFSET_JERK * ratio * own[1] / period)
    if np.any(took[:2] >= limits[:2]):
        raise FormatError(f"{file}: [{name}]OFFSET_AV_RATIO leaves no motion to the joints of the axis; lower it")
    said = f"[{name}]OFFSET_AV_RATIO: {100.0 * ratio:g} % of velocity and acceleration are kept for external offsets"
    most = (1.0 - KEPT_JERK) * limits[2]
    if took[2] <= most:
        notes.append(f"{said}, and {took[2]:g} of a jerk of {limits[2]:g}")
    else:
        notes.append(
            f"{said}; LinuxCNC moves them without a limit of jerk, at up to {took[2]:g}: while an offset changes the "
            f"sum is beyond the jerk of {limits[2]:g} (OFFSET_AV_RATIO of at most {ratio * most / took[2]:.3g} "
            "keeps it)"
        )
    return np.append(took[:2], min(took[2], most))


def _unit(text: str, known: dict[str, tuple[str, float]], size: dict[str, float], where: str) -> float:
    name = text.split()[0].lower() if text.split() else ""
    if name not in known:
        raise FormatError(f"{where} is {text!r}; give one of {', '.join(known)}")
    base, count = known[name]
    return size[base] * count
