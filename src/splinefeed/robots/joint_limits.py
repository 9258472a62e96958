"""Limits of the joints of an arm, gathered from its URDF, MoveIt's joint_limits.yaml, or a mapping; none is guessed.

Sources: the URDF schema of urdfdom 1.2 (<limit>); MoveIt's tutorials and the package joint_limits of ros2_control for
the keys of joint_limits.yaml.
"""

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
#: Those that every joint must have.
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
#: Largest joint_limits.yaml, bytes.
MAX_BYTES = 2**17

Given = Mapping[str, Any] | str | Path | None


def joint_limits(
    moving: Sequence[JointDescription], known: Sequence[str], given: Given, *, torque: bool
) -> tuple[dict[str, Array], list[str]]:
    """Each of KINDS as an array (joints,), infinite where there is none, and notes of what was left out or changed.

    moving  joints of the arm;  known  all joints of the robot: limits of the others are passed over
    given   a joint_limits.yaml or a mapping; what it gives stands before what the URDF says

    Raises LimitsError naming every limit that is missing, and FormatError or LimitsError for what cannot be.
    """
    names = [joint.name for joint in moving]
    found = {kind: [_of_urdf(joint, kind) for joint in moving] for kind in KINDS}
    notes: list[str] = []
    if isinstance(given, str | Path):
        own, notes = _of_yaml(_read_yaml(given), names, known, moving, str(given))
    elif given is None:
        own = {}
    elif isinstance(given, Mapping) and "joint_limits" in given:
        own, notes = _of_yaml(given, names, known, moving, "limits")
    elif isinstance(given, Mapping):
        own = _of_mapping(given, names)
    else:
        raise LimitsError(
            f"limits are {reprlib.repr(given)}; give a joint_limits.yaml, or a mapping such as {{'jerk': 500.0}}"
        )
    for kind, values in own.items():
        found[kind] = [each if value is None else value for value, each in zip(values, found[kind], strict=True)]
    _refuse_missing(moving, found, torque)
    for kind, values in found.items():
        for joint, value in zip(moving, values, strict=True):
            if kind not in ("minimum", "maximum") and value is not None and value < LEAST:
                raise LimitsError(f"{joint.name}: {kind} is {value:g}; it must be at least {LEAST:g}")
    for joint, low, high in zip(moving, found["minimum"], found["maximum"], strict=True):
        if low is not None and high is not None and not low < high:
            raise LimitsError(f"{joint.name}: minimum is {low:g} and maximum is {high:g}; no travel is left")
    otherwise = {"minimum": -math.inf}
    arrays = {
        kind: np.array([otherwise.get(kind, math.inf) if value is None else value for value in values])
        for kind, values in found.items()
    }
    return arrays, notes


def _of_urdf(joint: JointDescription, kind: str) -> float | None:
    """A limit as <limit> has it, None where it says nothing: a velocity or an effort of 0 stands for none."""
    key = {"minimum": "lower", "maximum": "upper", "torque": "effort"}.get(kind, kind)
    value = joint.limits.get(key)
    if kind in ("minimum", "maximum"):
        return None if value is None or joint.kind == "continuous" else _unit(joint, kind) * value
    if kind == "acceleration" and value is not None:
        value = min(value, joint.limits.get("deceleration") or value)
    return None if value is None or not value > 0.0 else _unit(joint, kind) * value


def _unit(joint: JointDescription, kind: str) -> float:
    """What a value of a file in rad and m is taken times here: mm of what slides; forces stay N."""
    return MM if joint.kind == "prismatic" and not kind.startswith("torque") else 1.0


def _refuse_missing(
    moving: Sequence[JointDescription], found: Mapping[str, Sequence[float | None]], torque: bool
) -> None:
    missing: dict[str, list[str]] = {}
    for k, joint in enumerate(moving):
        ends = () if joint.kind == "continuous" else ("minimum", "maximum")
        own = [kind for kind in (*NEEDED, *ends, *(["torque"] if torque else [])) if found[kind][k] is None]
        for kind in own:
            missing.setdefault(kind, []).append(joint.name)
    if missing:
        all_of = len(moving)
        said = [
            f"{kind} of {', '.join(names) if len(names) < all_of else 'every joint'}" for kind, names in missing.items()
        ]
        otherwise = "; or torque=False" if "torque" in missing else ""
        first = next(iter(missing))
        raise LimitsError(
            f"no limit of {'; '.join(said)}: none is guessed; give limits={{{first!r}: ...}} as a number, a list in "
            f"the order of the joints or by name, or a joint_limits.yaml{otherwise}"
        )


def friction_of(given: Mapping[str, Any] | None, names: Sequence[str]) -> dict[str, dict[str, float]]:
    """Coulomb and viscous friction by joint from a mapping of FRICTION; LimitsError for what cannot be."""
    if given is not None and not isinstance(given, Mapping):
        raise LimitsError(f"friction is {given!r}; give a mapping such as {{'coulomb': 2.0, 'viscous': 1.0}}")
    found = _of_mapping(given or {}, names, FRICTION, "friction")
    return {
        kind: {name: each for name, each in zip(names, values, strict=True) if each is not None}
        for kind, values in found.items()
    }


def _of_mapping(
    given: Mapping[str, Any], names: Sequence[str], kinds: Sequence[str] = KINDS, what: str = "limits"
) -> dict[str, list[float | None]]:
    """Limits by kind: one number for every joint, a list in their order, or a mapping by name."""
    found: dict[str, list[float | None]] = {}
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
        found[kind] = [
            None if each is None else _checked(each, kind, f"{what}: {kind} of {name}")
            for each, name in zip(values, names, strict=True)
        ]
    return found


def _checked(value: object, kind: str, place: str) -> float:
    try:
        number = finite(value, place)
    except InputError as error:
        raise LimitsError(str(error)) from None
    if kind not in ("minimum", "maximum") and number <= 0.0:
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
        return _plain(yaml.compose(content, Loader=yaml.SafeLoader), set())
    except _AliasError as error:
        raise FormatError(
            f"{file}: line {error.args[0]}: an alias repeats this value; write it out where it is needed"
        ) from None
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        place = f"line {mark.line + 1}: " if mark else ""
        problem = getattr(error, "problem", None) or "cannot be parsed"
        raise FormatError(f"{file}: {place}is not YAML: {problem}") from None


class _AliasError(Exception):
    """A value of YAML that stands for another one: a few letters may stand for any number of values."""


def _plain(node: Any, seen: set[int]) -> Any:
    """A node of YAML as tables, lists, truth values and texts; numbers stay texts, which `finite` reads."""
    if node is None:
        return None
    if id(node) in seen:
        raise _AliasError(node.start_mark.line + 1)
    seen.add(id(node))
    if node.id == "mapping":
        return {str(_plain(key, seen)): _plain(value, seen) for key, value in node.value}
    if node.id == "sequence":
        return [_plain(each, seen) for each in node.value]
    if node.tag == "tag:yaml.org,2002:bool":
        return node.value.lower() in ("true", "yes", "on")
    return node.value


def _of_yaml(
    content: Any, names: Sequence[str], known: Sequence[str], moving: Sequence[JointDescription], file: str
) -> tuple[dict[str, list[float | None]], list[str]]:
    """Limits of a joint_limits.yaml: a value counts where its has_... is not false."""
    table = content.get("joint_limits") if isinstance(content, Mapping) else None
    if not isinstance(table, Mapping):
        raise FormatError(f"{file}: there is no joint_limits with a table for each joint; is it a joint_limits.yaml?")
    notes = [
        f"{file}: {key} {str(content[key])[:40]} is not applied"
        for key in ("default_velocity_scaling_factor", "default_acceleration_scaling_factor")
        if content.get(key) not in (None, 1, 1.0, "1", "1.0")
    ]
    found: dict[str, list[float | None]] = {kind: [None] * len(names) for kind in KINDS}
    for name, own in table.items():
        place = f"{file}: joint_limits.{name}"
        if name not in known:
            raise FormatError(f"{place}: the robot has no such joint; {nearest(name, known)}")
        if not isinstance(own, Mapping):
            raise FormatError(f"{place} is {reprlib.repr(own)}; expected a table such as max_velocity: 2.0")
        switches = {switch for _, switch in _YAML.values()}
        for key, value in own.items():
            if key not in (*_YAML, *switches, *_SILENT):
                raise FormatError(f"{place}.{key} is not known; {nearest(key, (*_YAML, *switches))}")
            if key in switches and not isinstance(value, bool):
                raise FormatError(f"{place}.{key} is {reprlib.repr(value)}; expected true or false")
        if name not in names:
            continue
        k = names.index(name)
        for key, value in own.items():
            kind, switch = _YAML.get(key, ("", ""))
            if not kind or not own.get(switch, True):
                continue
            number = _checked(value, "minimum" if kind in ("minimum", "maximum") else "velocity", f"{place}.{key}")
            number *= _unit(moving[k], kind)
            if kind == "deceleration":
                kind, number = "acceleration", min(number, found["acceleration"][k] or number)
            elif kind == "acceleration":
                number = min(number, found["acceleration"][k] or number)
            found[kind][k] = number
    return found, notes
