"""Limits: what a motion must never exceed, on the path, on axes, on sums of axes, and on joint torques."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from splinefeed.errors import LimitsError
from splinefeed.limit_table import (
    AXIS_LIMITS,
    BOUNDED,
    BY_AXIS,
    IN_ORDER,
    ORDERS,
    ROTARY_AXES,
    TABLE,
    TRAVEL_ENDS,
    LimitFields,
    named,
    raised,
    shown_by,
    unit_of,
)
from splinefeed.numbers import LEAST
from splinefeed.records import view
from splinefeed.records.arrays import Array
from splinefeed.records.modelled import Modelled, axis_name, check_bounds
from splinefeed.records.torque import Torque

#: An axis that moves by no more roundings than this, of its positions, does not move.
MOVE_ROUNDINGS = 64.0


def check_axes(name: str, given: Iterable[str], axes: Sequence[str]) -> None:
    """Refuse a limit of an axis that a path does not have.

    Parameters
    ----------
    name : str
        Of the limit.
    given : iterable of str
        Axes that have it.
    axes : sequence of str
        Names of the path's axes.

    Raises
    ------
    LimitsError
        Names the axis.
    """
    for axis in given:
        if axis not in axes:
            raise LimitsError(f"{name}.{axis}: the path has no axis {axis!r}; its axes are {', '.join(axes)}")


def axes_without_limits(limits: Limits, axes: Sequence[str], low: Array, high: Array) -> list[str]:
    """Say which axes move without a limit that others have.

    Parameters
    ----------
    limits : Limits
        Of the motion.
    axes : sequence of str
        Names of the axes.
    low, high : (axes,) array
        Where each axis is at least and at most, mm or rad; what is rounding of these is no motion.

    Returns
    -------
    list of str
        A sentence for each kind of limit that some axes, or the path, have and others that move do not.
    """
    size = np.maximum(np.abs(low), np.abs(high))
    moves = high - low > MOVE_ROUNDINGS * np.finfo(float).eps * size
    linear = np.array([axis not in ROTARY_AXES for axis in axes])
    found, none = [], []
    for name in AXIS_LIMITS:
        bounded = np.isfinite(limits.of_axes(name, axes))
        free = np.array(axes)[moves & ~bounded].tolist()
        if free and bounded.any():
            verb = "moves" if len(free) == 1 else "move"
            found.append(f"{', '.join(free)} {verb} without {name}, which other axes have; give each axis its own")
        none += [] if bounded.any() else [name]
    others = np.array(axes)[moves & ~linear].tolist() if linear.any() else []
    if others and none:
        verb = "turns" if len(others) == 1 else "turn"
        why = "where linear axes move, limits along the path are theirs"
        found.append(f"{', '.join(others)} {verb} without {', '.join(none)}: {why}")
    return found


@dataclass(frozen=True, kw_only=True)
class Combination:
    """Bound w . r, a linear combination of axis positions: the motor on one side of a gantry, a tool axis.

    Parameters
    ----------
    weights : mapping of str to float
        By axis name: what 1 mm (rotary axes: 1 rad) of it counts.
    velocity, acceleration, jerk : float, optional
        Bounds of the derivatives of w . r, in mm/s, mm/s^2 and mm/s^3 for weights without unit; default none.

    Raises
    ------
    LimitsError
        For no weights, weights that are all 0 or not finite, and without any bound.

    References
    ----------
    .. [1] docs/math/planner.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> left = sf.records.Combination(weights={"y": 1.0, "c": 400.0}, acceleration=5000.0, jerk=100000.0)
    >>> sf.Limits(feed=200.0, axis_jerk=80000.0, combinations={"left": left}).as_dict()["combinations.left.jerk"]
    100000.0
    """

    weights: Mapping[str, float]
    velocity: float = math.inf
    acceleration: float = math.inf
    jerk: float = math.inf

    def __post_init__(self) -> None:
        weights = {str(axis): float(weight) for axis, weight in self.weights.items()}
        if not all(map(math.isfinite, weights.values())) or not any(weights.values()):
            raise LimitsError(f"the weights of a combination are {weights}; give finite ones, not all of them 0")
        object.__setattr__(self, "weights", MappingProxyType(weights))
        check_bounds("bounds of a combination", {name: float(getattr(self, name)) for name in BOUNDED})

    def on(self, axes: Sequence[str]) -> Array:
        """Give the weights of axes in their order.

        Parameters
        ----------
        axes : sequence of str
            Names of the axes of a path.

        Returns
        -------
        (axes,) array
            What 1 mm (rotary axes: 1 rad) of each counts.

        Raises
        ------
        LimitsError
            For a weight of an axis that is not among them.
        """
        check_axes("combinations", self.weights, axes)
        return np.array([self.weights.get(axis, 0.0) for axis in axes])


@dataclass(frozen=True, eq=False)
class AxisBounds:
    """Whatever has limits of velocity, acceleration and jerk on a path: its axes, then weighted sums of them.

    Parameters
    ----------
    names : three tuples of str
        Names of the limits of order 1 to 3, of axes + sums, as `check` has them.
    weights : (sums, axes) array
        The weights of each sum.
    bounds : (3, axes + sums) array
        mm/s^k or rad/s^k, infinite where there is none.
    """

    names: tuple[tuple[str, ...], ...]
    weights: Array
    bounds: Array

    def of(self, values: Array) -> Array:
        """Add weighted sums of the axes to their values.

        Parameters
        ----------
        values : (n, axes) array
            Positions or derivatives of the axes.

        Returns
        -------
        (n, axes + sums) array
            Those of axes and sums.
        """
        return np.concatenate([values, values @ self.weights.T], axis=1) if len(self.weights) else values


@dataclass(frozen=True, kw_only=True)
class Limits(LimitFields):
    """What a motion must never exceed; a limit that is left out is infinite.

    Parameters
    ----------
    feed : float, optional
        Along the path, mm/s.
    acceleration, deceleration : float, optional
        Along the path, mm/s^2; deceleration as acceleration by default.
    jerk, deceleration_jerk : float, optional
        Along the path, mm/s^3, while speeding up and while slowing down; the second as the first by default.
    start_feed, end_feed : float, optional
        At the ends of the path, mm/s; default 0.
    chord_error : float, optional
        Between the curve and the line from one setpoint to the next, mm.
    orientation_error : float, optional
        Between the tool axis and that of a tool path, from one setpoint to the next, rad.
    centripetal : float, optional
        Centripetal acceleration, mm/s^2.
    axis_velocity, axis_acceleration, axis_jerk : float, sequence or mapping, optional
        mm/s, mm/s^2, mm/s^3: a number for every linear axis; or one value per axis (rotary ones in rad), by name or as
        a list, tuple, array or Series in the path's order of axes.
    axis_velocity_step : float, sequence or mapping, optional
        How much the velocity of each axis may jump at a corner, mm/s, given likewise; without it the tool stops at
        every corner (exact stop).
    axis_minimum, axis_maximum : sequence or mapping, optional
        Ends of the travel of axes (soft limits), mm or rad, by name or in the path's order.
    combinations : mapping of str to Combination, optional
        Bounds on weighted sums of axes, by name.
    torque : Torque, optional
        The joint torques of a rigid-body model.
    modelled : sequence of Modelled, optional
        More limits that a model gives: a `TorqueRate`, a `VelocityByPosition`, an `Approach`.

    Raises
    ------
    LimitsError
        For a limit that is not a positive number, for an end feed outside [0, feed], for empty travel, and if neither
        feed nor axis_velocity is given.

    Notes
    -----
    A number in mm/s is none in rad/s: on a path of linear and rotary axes it is for the linear ones, and the notes of
    law and verdict name the others that move; a path of rotary axes alone refuses it. A Series whose index has names
    goes by these. Each list is as long as the path has axes.

    References
    ----------
    .. [1] docs/check.md defines each by the setpoints.

    Examples
    --------
    >>> import splinefeed as sf
    >>> limits = sf.Limits(feed=60, axis_acceleration={"x": 500, "y": 800}, axis_jerk=[20000, 30000])
    >>> limits.as_dict()["axis_acceleration.y"]
    800.0
    """

    combinations: Mapping[str, Combination] | None = None
    torque: Torque | None = None
    modelled: Sequence[Modelled] = ()

    def __post_init__(self) -> None:
        for name in ORDERS:
            value = getattr(self, name)
            if name in TRAVEL_ENDS or name.endswith("_feed"):
                value = _checked(value, name, number)
            elif not (isinstance(value, float) and value == math.inf):
                value = _checked(value, name, positive)
            object.__setattr__(self, name, value)
        for name, usual in (("deceleration", self.acceleration), ("deceleration_jerk", self.jerk)):
            if getattr(self, name) is None:
                object.__setattr__(self, name, usual)
        for name, each in (self.combinations or {}).items():
            if not isinstance(each, Combination) or "." in name:
                raise LimitsError(f"combinations.{name}: give a Combination under a name without a dot")
        combinations = MappingProxyType(dict(self.combinations)) if self.combinations else None
        object.__setattr__(self, "combinations", combinations)
        if self.torque is not None and not isinstance(self.torque, Torque):
            raise LimitsError("torque: give a Torque, a model with the largest torque of every joint")
        object.__setattr__(self, "modelled", tuple(self.modelled))
        if not all(isinstance(each, Modelled) for each in self.modelled):
            raise LimitsError("modelled: give a list of limits such as TorqueRate(model, most)")
        if self.feed == math.inf and self.axis_velocity is None:
            raise LimitsError("neither feed nor axis_velocity is given; one of them is needed")
        for name in ("start_feed", "end_feed"):
            value = getattr(self, name)
            if not 0.0 <= value <= self.feed:
                raise LimitsError(
                    f"{name} is {value:g} mm/s; it must lie between 0 and the feed limit of {self.feed:g} mm/s"
                )
        ends = [(name, _flat(name, getattr(self, name))) for name in TRAVEL_ENDS]
        low, high = ({key.removeprefix(name): value for key, value in end.items()} for name, end in ends)
        if set(low) != set(high):
            axes = ", ".join(sorted(axis.strip(".") for axis in set(low) ^ set(high)))
            raise LimitsError(f"axis_minimum and axis_maximum of {axes}: one is missing; give both ends of its travel")
        for axis in low:
            if not low[axis] < high[axis]:
                raise LimitsError(
                    f"axis_minimum{axis} is {low[axis]:g} and axis_maximum{axis} is {high[axis]:g}; no travel is left"
                )

    def given(self, bounds: str) -> dict[str, float]:
        """List the limits that are one number and bound the same, such as places.

        Parameters
        ----------
        bounds : str
            What they bound, a word of the table of limits: PLACES, TICKS, ...

        Returns
        -------
        dict of str to float
            Those that are finite, by name in the order of the table.
        """
        values = {each.name: getattr(self, each.name) for each in TABLE if each.bounds == bounds}
        return {name: value for name, value in values.items() if value is not None and value < math.inf}

    @property
    def models(self) -> tuple[Modelled, ...]:
        """All limits that a model gives, torques first."""
        return (*(() if self.torque is None else (self.torque,)), *self.modelled)

    @property
    def travel(self) -> dict[str, tuple[float, float]]:
        """Least and greatest position of each axis that has soft limits by name, mm or rad; see `travel_of`."""
        low, high = self.axis_minimum, self.axis_maximum
        if not (isinstance(low, Mapping) and isinstance(high, Mapping)):
            return {}
        return {axis: (least, high[axis]) for axis, least in low.items()}

    def travel_of(self, axes: Sequence[str]) -> dict[str, tuple[float, float]]:
        """List the travel of axes.

        Parameters
        ----------
        axes : sequence of str
            Names of the axes of a path.

        Returns
        -------
        dict of str to (float, float)
            Least and greatest position, mm or rad, of each of them that has soft limits.

        Raises
        ------
        LimitsError
            For the travel of an axis that is not among `axes`.
        """
        low, high = (by_name("travel", getattr(self, name), axes) for name in TRAVEL_ENDS)
        return {axis: (least, high[axis]) for axis, least in low.items()}

    def of_axes(self, name: str, axes: Sequence[str]) -> Array:
        """List one of the limits of axes.

        Parameters
        ----------
        name : str
            One of BY_AXIS, such as axis_jerk.
        axes : sequence of str
            Names of the axes of a path.

        Returns
        -------
        (axes,) array
            mm/s^k or rad/s^k, infinite where there is none.

        Raises
        ------
        LimitsError
            For a limit that does not fit the axes, as `by_name` has it.
        """
        found = by_name(name, getattr(self, name), axes)
        return np.array([found.get(axis, math.inf) for axis in axes])

    def axis_bounds(self, axes: Sequence[str]) -> AxisBounds:
        """Collect what has limits of velocity, acceleration and jerk: axes, and combinations of them.

        Parameters
        ----------
        axes : sequence of str
            Names of the axes of a path.

        Returns
        -------
        AxisBounds
            Names, weights and bounds.

        Raises
        ------
        LimitsError
            For a limit that does not fit the axes.
        """
        sums = self.combinations or {}
        names = tuple(
            (*(named(name, axis) for axis in axes), *(f"combinations.{label}.{kind}" for label in sums))
            for name, kind in zip(AXIS_LIMITS, BOUNDED, strict=True)
        )
        bounds = [
            [*self.of_axes(name, axes), *(getattr(each, kind) for each in sums.values())]
            for name, kind in zip(AXIS_LIMITS, BOUNDED, strict=True)
        ]
        weights = np.array([each.on(axes) for each in sums.values()]).reshape(len(sums), len(axes))
        return AxisBounds(names, weights, np.array(bounds))

    def on(self, axes: Sequence[str]) -> Limits:
        """Name the values of limits that are lists.

        Parameters
        ----------
        axes : sequence of str
            Names of the axes of a path, in its order.

        Returns
        -------
        Limits
            The same limits by the names of the axes.

        Raises
        ------
        LimitsError
            For a limit that does not fit the axes.
        """
        said = dict.fromkeys(TRAVEL_ENDS, "travel")
        given = {name: getattr(self, name) for name in (*BY_AXIS, *TRAVEL_ENDS)}
        found: dict[str, Any] = {name: by_name(said.get(name, name), value, axes) for name, value in given.items()}
        changed = {name: value for name, value in found.items() if isinstance(given[name], tuple)}
        return replace(self, **changed) if changed else self

    def as_dict(self) -> dict[str, float]:
        """Names and values in base units as files and reports write them, limits that are not there left out.

        A limit of one axis stands as "axis_jerk.x", one in the path's order as "axis_jerk[0]", one of a combination as
        "combinations.left.jerk".
        """
        flat: dict[str, float] = {}
        for name in ORDERS:
            flat |= _flat(name, getattr(self, name))
        for label, each in (self.combinations or {}).items():
            place = f"combinations.{label}"
            flat |= {f"{place}.weights.{axis}": weight for axis, weight in each.weights.items()}
            bounds = {f"{place}.{kind}": float(getattr(each, kind)) for kind in BOUNDED}
            flat |= {key: bound for key, bound in bounds.items() if bound < math.inf}
        for model in self.models:
            flat |= {named(model.kind, axis): most for axis, most in model.numbers().items()}
        return flat

    def _repr_html_(self) -> str:
        said = {name: value for name, value in self.as_dict().items() if value or not name.endswith("_feed")}  # at rest
        flat = {name: (shown_by(name, name.partition(".")[2]), value) for name, value in said.items()}
        return view.table({name: f"{unit * value:g} {raised(unit_of(name))}" for name, (unit, value) in flat.items()})

    @classmethod
    def from_dict(cls, flat: Mapping[str, float]) -> Limits:
        """Make the limits that `as_dict` wrote.

        Parameters
        ----------
        flat : mapping of str to float
            Names and values in base units: mm, s and rad.

        Returns
        -------
        Limits
            The same limits.

        Raises
        ------
        LimitsError
            For an unknown name.
        """
        values: dict[str, Any] = {}
        for key, value in flat.items():
            listed = IN_ORDER.fullmatch(key)
            if listed and listed[1] in (*BY_AXIS, *TRAVEL_ENDS):
                values.setdefault(listed[1], []).append(value)
                continue
            *tables, last = key.split(".")
            if (tables or [last])[0] not in (*ORDERS, "combinations"):  # a torque's model is a function
                raise LimitsError(f"{key!r} is not a limit that a file can hold; known are {', '.join(ORDERS)}")
            table = values
            for each in tables:
                table = table.setdefault(each, {})
                if not isinstance(table, dict):
                    raise LimitsError(f"{key!r}: {each} is one number and has one by axis, too; give one of these")
            table[last] = value
        try:
            combinations = {name: Combination(**own) for name, own in values.pop("combinations", {}).items()}
            return cls(**values, combinations=combinations)
        except TypeError as error:
            raise LimitsError(f"combinations: {error}; they have weights, {', '.join(BOUNDED)}") from None


def _checked(value: Any, name: str, check: Callable[[object, str], float]) -> Any:
    """A limit whose every number passes `check`: one, a tuple in the path's order, or by name; None for nothing."""
    if value is None:
        return None
    if name not in (*BY_AXIS, *TRAVEL_ENDS):
        return check(value, name)
    names = list(value.keys()) if hasattr(value, "keys") else []  # a Series of pandas has them too
    if isinstance(value, Mapping) or any(isinstance(each, str) for each in names):
        found = {axis_name(axis): check(each, f"{name}.{axis}") for axis, each in value.items()}
        return MappingProxyType(found) if found else None
    if isinstance(value, str) or (not np.ndim(value) and name not in TRAVEL_ENDS):
        return check(value, name)
    if np.ndim(value) != 1 or not len(value):
        raise LimitsError(f"{name} is {value!r}; give one value an axis, in the path's order or as {{'x': 500.0}}")
    return tuple(check(each, f"{name}[{k}]") for k, each in enumerate(value))


def _flat(name: str, value: Any) -> dict[str, float]:
    """A limit as `Limits.as_dict` writes it; nothing where there is none."""
    if value is None or value == math.inf:
        return {}
    if isinstance(value, Mapping):
        return {named(name, axis): limit for axis, limit in value.items()}
    return {f"{name}[{k}]": each for k, each in enumerate(value)} if isinstance(value, tuple) else {name: value}


def by_name(name: str, given: Any, axes: Sequence[str]) -> dict[str, Any]:
    """Read what is given for a limit of axes: the one place that knows its forms.

    Parameters
    ----------
    name : str
        Of the limit.
    given : float, sequence, mapping or None
        By name, X for x too; one value each in the order of `axes`; a number for every linear axis; or None.
    axes : sequence of str
        Names of the axes of a path.

    Returns
    -------
    dict of str to float
        Values by name, in the order of `axes`.

    Raises
    ------
    LimitsError
        For an axis that is not there, another number of values, and a number where no axis is linear.
    """
    if given is None:
        return {}
    if isinstance(given, Mapping):
        small = {axis.lower(): axis for axis in axes if axis not in given}
        given = {axis if axis in axes else small.get(axis.lower(), axis): value for axis, value in given.items()}
        check_axes(name, given, axes)
        return {axis: given[axis] for axis in axes if axis in given}
    if isinstance(given, tuple):
        if len(given) != len(axes):
            raise LimitsError(
                f"{name} has {len(given)} values for {len(axes)} axes; give one each, in the order {', '.join(axes)}"
            )
        return dict(zip(axes, given, strict=True))
    linear = [axis for axis in axes if axis not in ROTARY_AXES]
    if not linear:
        raise LimitsError(
            f"{name} is one number, which is for linear axes, and {', '.join(axes)} "
            f"turn{'s' * (len(axes) == 1)}; give one value each, in this order or by name"
        )
    return dict.fromkeys(linear, given)


def refuse_orientation(limits: Limits, name: str) -> None:
    """Refuse an orientation error on a path that has no tool axis.

    Parameters
    ----------
    limits : Limits
        Of the motion.
    name : str
        Of the path.

    Raises
    ------
    LimitsError
        Where `limits` has an orientation error.
    """
    if limits.orientation_error is not None:
        raise LimitsError(f"orientation_error: {name} has no tool axis; leave it out")


def number(value: object, name: str) -> float:
    """Read a value as a finite number.

    Parameters
    ----------
    value : object
        What was given.
    name : str
        What it is, for the message.

    Returns
    -------
    float
        The number.

    Raises
    ------
    LimitsError
        For anything else.
    """
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise LimitsError(f"{name} is {value!r}; expected a number") from None
    if not math.isfinite(result):
        raise LimitsError(f"{name} is {result}; it must be finite")
    return result


def positive(value: object, name: str, at_least: float = LEAST) -> float:
    """Read a value as a positive number.

    Parameters
    ----------
    value : object
        What was given.
    name : str
        What it is, for the message.
    at_least : float, optional
        The least that it may be.

    Returns
    -------
    float
        The number.

    Raises
    ------
    LimitsError
        For a value that is not finite or less than `at_least`.
    """
    result = number(value, name)
    if result < at_least:
        least = "greater than 0" if result <= 0.0 else f"at least {at_least:g}"
        raise LimitsError(f"{name} is {result:g}; it must be {least}")
    return result
