"""Limits of the joints of an arm, gathered from its URDF, MoveIt's joint_limits.yaml, or a mapping; none is guessed."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import FormatError, InputError, LimitsError, nearest
from splinefeed.files.source import read_bytes
from splinefeed.numbers import LEAST, finite
from splinefeed.records import Array
from splinefeed.robots.description import JointDescription
from splinefeed.robots.frames import MM

#: Kinds of limits of a joint; in rad (sliding joints: mm), s, and N m (N). Kinds of its friction.
KINDS = ("minimum", "maximum", "velocity", "acceleration", "jerk", "torque", "torque_rate")
FRICTION = ("coulomb", "viscous")
#: Ends of the travel, and those that every joint must have.
ENDS = ("minimum", "maximum")
NEEDED = ("velocity", "acceleration", "jerk")
#: What joint_limits.yaml calls them, with the key that switches each on.
_YAML = {
    "min_position": ("minimum", "has_position_limits"),
    "max_position": ("maximum", "has_position_limits"),
    "max_velocity": ("velocity", "has_velocity_limits"),
    "max_acceleration": ("acceleration", "has_acceleration_limits"),
    "max_deceleration": ("deceleration", "has_deceleration_limits"),
    "max_jerk": ("jerk", "has_jerk_limits"),
    "max_effort": ("torque", "has_effort_limits"),
}
#: Keys of joint_limits.yaml that limit nothing here: ends that wrap, and the springs of soft limits.
_SILENT = ("angle_wraparound", "has_soft_limits", "k_position", "k_velocity", "soft_lower_limit", "soft_upper_limit")
#: What switches on and off in YAML 1.1.
_ON, _OFF = ("true", "yes", "on"), ("false", "no", "off")
#: Largest joint_limits.yaml, bytes.
MAX_BYTES = 2**17

Given = Mapping[str, Any] | str | Path | None


def joint_limits(
    moving: Sequence[JointDescription], known: Sequence[str], given: Given, *, torque: bool
) -> tuple[dict[str, Array], list[str]]:
    """Gather the limits of an arm's joints.

    Parameters
    ----------
    moving : sequence of JointDescription
        Joints of the arm.
    known : sequence of str
        All joints of the robot: limits of the others are passed over.
    given : mapping, str, Path or None
        A joint_limits.yaml or a mapping; what it gives stands before what the URDF says.
    torque : bool
        Whether limits of torque are needed.

    Returns
    -------
    limits : dict of str to array (joints,)
        Each of KINDS, rad (sliding joints: mm), s, N m (N), infinite where there is none.
    notes : list of str
        What was left out or changed.

    Raises
    ------
    LimitsError
        Naming every limit that is missing, and for a value that cannot be.
    FormatError
        For a joint_limits.yaml that cannot be read.

    References
    ----------
    .. [1] urdfdom 1.2, the URDF schema, <limit>.
    .. [2] MoveIt's tutorials, and the package joint_limits of ros2_control: the keys of joint_limits.yaml.
    """
    names = [joint.name for joint in moving]
    found = {kind: np.array([_of_urdf(joint, kind) for joint in moving]) for kind in KINDS}  # NaN where there is none
    notes: list[str] = []
    if isinstance(given, str | Path):
        own, notes = _of_yaml(_read_yaml(given), names, known, moving, str(given))
    elif isinstance(given, Mapping) and "joint_limits" in given:
        own, notes = _of_yaml(given, names, known, moving, "limits")
    elif given is None or isinstance(given, Mapping):
        own = _of_mapping(given or {}, names)
    else:
        raise LimitsError(
            f"limits are {reprlib.repr(given)}; give a joint_limits.yaml, or a mapping such as {{'jerk': 500.0}}"
        )
    for kind, values in own.items():
        found[kind] = np.where(np.isnan(values), found[kind], values)
    _refuse_missing(moving, found, torque)
    for kind in KINDS:
        for joint, value in zip(moving, found[kind].tolist(), strict=True):
            if kind not in ENDS and value < LEAST:
                raise LimitsError(f"{joint.name}: {kind} is {value:g}; it must be at least {LEAST:g}")
    for joint, low, high in zip(moving, *(found[end].tolist() for end in ENDS), strict=True):
        if low >= high:
            raise LimitsError(f"{joint.name}: minimum is {low:g} and maximum is {high:g}; no travel is left")
    none = {"minimum": -math.inf}
    return {kind: np.where(np.isnan(each), none.get(kind, math.inf), each) for kind, each in found.items()}, notes


def _of_urdf(joint: JointDescription, kind: str) -> float:
    """A limit as <limit> has it, NaN where it says nothing: a velocity or an effort of 0 stands for none."""
    key = {"minimum": "lower", "maximum": "upper", "torque": "effort"}.get(kind, kind)
    value = joint.limits.get(key, math.nan)
    if kind == "acceleration":
        value = min(value, joint.limits.get("deceleration") or value)
    limited = joint.kind != "continuous" if kind in ENDS else value > 0.0
    return _unit(joint, kind) * value if limited else math.nan


def _unit(joint: JointDescription, kind: str) -> float:
    """What a value of a file in rad and m is taken times here: mm of what slides; forces stay N."""
    return MM if joint.kind == "prismatic" and not kind.startswith("torque") else 1.0


def _refuse_missing(moving: Sequence[JointDescription], found: Mapping[str, Array], torque: bool) -> None:
    missing = {}
    for kind in (*NEEDED, *ENDS, *(["torque"] if torque else [])):
        names = [
            joint.name
            for joint, value in zip(moving, found[kind].tolist(), strict=True)
            if math.isnan(value) and not (kind in ENDS and joint.kind == "continuous")
        ]
        if names:
            missing[kind] = "every joint" if len(names) == len(moving) else ", ".join(names)
    if missing:
        otherwise = "; or torque=False" if "torque" in missing else ""
        first = next(iter(missing))
        raise LimitsError(
            f"no limit of {'; '.join(f'{kind} of {names}' for kind, names in missing.items())}: none is guessed; give "
            f"limits={{{first!r}: ...}} as a number, a list in the order of the joints or by name, or a "
            f"joint_limits.yaml{otherwise}"
        )


def friction_of(given: Mapping[str, Any] | None, names: Sequence[str]) -> dict[str, dict[str, float]]:
    """Coulomb and viscous friction by joint from a mapping of FRICTION; LimitsError for what cannot be."""
    if given is not None and not isinstance(given, Mapping):
        raise LimitsError(f"friction is {given!r}; give a mapping such as {{'coulomb': 2.0, 'viscous': 1.0}}")
    found = _of_mapping(given or {}, names, FRICTION, "friction")
    return {
        kind: {name: each for name, each in zip(names, values.tolist(), strict=True) if not math.isnan(each)}
        for kind, values in found.items()
    }


def _of_mapping(
    given: Mapping[str, Any], names: Sequence[str], kinds: Sequence[str] = KINDS, what: str = "limits"
) -> dict[str, Array]:
    """Limits by kind, NaN for none: one number for every joint, a list in their order, or a mapping by name."""
    found: dict[str, Array] = {}
    for kind, value in given.items():
        if kind not in kinds:
            raise LimitsError(f"{what}: {kind!r} is not known; {nearest(kind, kinds)}")
        if isinstance(value, Mapping):
            for name in value:
                if name not in names:
                    raise LimitsError(f"{what}: {kind}.{name}: the arm has no such joint; {nearest(name, names)}")
            values = [value.get(name) for name in names]
        elif np.ndim(value) == 0:
            values = [value] * len(names)
        else:
            values = list(value)
            if len(values) != len(names):
                raise LimitsError(f"{what}: {kind} has {len(values)} values; the arm has {len(names)} joints")
        checked = [
            math.nan if each is None else _checked(each, kind, f"{what}: {kind} of {name}")
            for each, name in zip(values, names, strict=True)
        ]
        found[kind] = np.array(checked)
    return found


def _checked(value: object, kind: str, place: str) -> float:
    try:
        number = finite(value, place)
    except InputError as error:
        raise LimitsError(str(error)) from None
    if kind not in ENDS and number <= 0.0:
        raise LimitsError(f"{place} is {number:g}; expected a finite number greater than 0")
    return number


def _read_yaml(file: str | Path) -> Any:
    """What a YAML file holds; FormatError where it cannot be read."""
    try:
        import yaml
    except ImportError:
        raise InputError(f'{file}: reading YAML needs PyYAML: pip install "splinefeed[robots]"') from None
    content = read_bytes(file, MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise FormatError(f"{file}: is larger than {MAX_BYTES // 2**10} kB; that is no joint_limits.yaml")
    try:
        return yaml.load(content, Loader=yaml.BaseLoader)  # tables, lists and texts: `finite` reads numbers
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        place = f"line {mark.line + 1}: " if mark else ""
        problem = getattr(error, "problem", None) or "cannot be parsed"
        raise FormatError(f"{file}: {place}is not YAML: {problem}") from None


def _of_yaml(
    content: Any, names: Sequence[str], known: Sequence[str], moving: Sequence[JointDescription], file: str
) -> tuple[dict[str, Array], list[str]]:
    """Limits of a joint_limits.yaml, NaN where there is none: a value counts where its has_... is not false."""
    table = content.get("joint_limits") if isinstance(content, Mapping) else None
    if not isinstance(table, Mapping):
        raise FormatError(f"{file}: there is no joint_limits with a table for each joint; is it a joint_limits.yaml?")
    notes = []
    for key in ("default_velocity_scaling_factor", "default_acceleration_scaling_factor"):
        if content.get(key) not in (None, 1, 1.0, "1", "1.0"):
            notes.append(f"{file}: {key} {finite(content[key], f'{file}: {key}'):g} is not applied")
    found = {kind: np.full(len(names), math.nan) for kind in KINDS}
    for name, own in table.items():
        place = f"{file}: joint_limits.{name}"
        if name not in known:
            raise FormatError(f"{place}: the robot has no such joint; {nearest(name, known)}")
        if not isinstance(own, Mapping):
            raise FormatError(f"{place} is {reprlib.repr(own)[:80]}; expected a table such as max_velocity: 2.0")
        switches = {switch: str(own.get(switch, "true")).lower() for _, switch in _YAML.values()}
        for key in own:
            if key not in (*_YAML, *switches, *_SILENT):
                raise FormatError(f"{place}.{key} is not known; {nearest(key, (*_YAML, *switches))}")
            if key in switches and switches[key] not in (*_ON, *_OFF):
                raise FormatError(f"{place}.{key} is {reprlib.repr(own[key])}; expected true or false")
        if name not in names:
            continue
        k = names.index(name)
        for key, value in own.items():
            kind, switch = _YAML.get(key, ("", ""))
            if not kind or switches[switch] in _OFF:
                continue
            number = _checked(value, kind, f"{place}.{key}") * _unit(moving[k], kind)
            kind = "acceleration" if kind == "deceleration" else kind
            found[kind][k] = np.fmin(found[kind][k], number)
    return found, notes
