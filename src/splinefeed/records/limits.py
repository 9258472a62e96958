"""Limits: what a motion must never exceed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from splinefeed.errors import LimitsError
from splinefeed.records import view
from splinefeed.records.arrays import Array
from splinefeed.records.drives import BOUNDED, Combination, Torque, check_axes

#: Names of rotary axes: rad inside, degrees at the edges. Every other axis is linear.
ROTARY_AXES = ("a", "b", "c", "theta")


def unit_along(axes: Iterable[str]) -> str:
    """Unit of arc length along a path of these axes, for people: "mm", or "deg" where all of them are rotary."""
    return "deg" if all(axis in ROTARY_AXES for axis in axes) else "mm"


#: Limits of numbers by name, and which derivative by time each bounds; of order 0 are lengths, and angles.
ORDERS = {
    **{"feed": 1, "acceleration": 2, "jerk": 3, "deceleration": 2, "deceleration_jerk": 3},
    **{"start_feed": 1, "end_feed": 1, "chord_error": 0, "orientation_error": 0, "centripetal": 2},
    **{"axis_velocity": 1, "axis_acceleration": 2, "axis_jerk": 3, "axis_velocity_step": 1},
    **{"axis_minimum": 0, "axis_maximum": 0},
}
#: Fields of Limits that bound the derivatives of each axis by time, of order 1, 2 and 3.
AXIS_LIMITS = ("axis_velocity", "axis_acceleration", "axis_jerk")
#: Fields of Limits that may differ from axis to axis: those, and the step of velocity at a corner.
BY_AXIS = (*AXIS_LIMITS, "axis_velocity_step")
#: Fields of Limits that say how far each axis may travel.
TRAVEL_ENDS = ("axis_minimum", "axis_maximum")
#: Limits of an angle that are those of no axis: rad inside, degrees at the edges.
ANGLES = ("orientation_error",)
#: What follows the unit of length or angle, by order.
_PER = ("", "/s", "/s^2", "/s^3")


def unit_of(name: str, along: str = "mm") -> str:
    """Unit of a limit by its name, for people: of a rotary axis in degrees, along a path in `along` and its like.

    Example: `unit_of("axis_jerk.theta")` is deg/s^3
    """
    kind, _, axis = name.partition(".")
    if kind == "torque":
        return "N m" if axis in ROTARY_AXES else "N"
    if kind == "combinations":
        kind = f"axis_{name.rpartition('.')[2]}"
    turns = axis in ROTARY_AXES or kind in ANGLES
    base = "deg" if turns else "mm" if axis or kind.startswith("axis_") else along
    return base + _PER[ORDERS.get(kind, ORDERS.get(f"axis_{kind}", 0))]


def raised(unit: str) -> str:
    """A unit with its powers as they are printed, mm/s² for mm/s^2."""
    return unit.replace("^2", "²").replace("^3", "³")


#: A limit of each axis: by name, or in the order of the path's axes.
ByAxis: TypeAlias = Mapping[str, float] | Sequence[float] | NDArray[Any]


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What a motion must never exceed; a limit that is left out is infinite.

    feed  mm/s; acceleration, deceleration  mm/s^2 and jerk (while speeding up), deceleration_jerk (while slowing
    down)  mm/s^3, along the path; deceleration and its jerk follow acceleration and jerk by default
    start_feed, end_feed  mm/s at the ends of the path
    chord_error   mm between the curve and the line from one setpoint to the next; centripetal  mm/s^2
    orientation_error  rad between the tool axis and that of a tool path, from one setpoint to the next
    axis_velocity, axis_acceleration, axis_jerk  mm/s, mm/s^2, mm/s^3 for every linear axis; or one value per axis
                  (rotary ones in rad): a mapping from axis names, or an array (axes,) in the order of the path's axes,
                  infinite for no limit, which `plan` and `check` resolve against the path
    axis_velocity_step  how much the velocity of each axis may jump at a corner, mm/s, given likewise; without it the
                  tool stops at every corner (exact stop)
    axis_minimum, axis_maximum  ends of the travel of axes (soft limits), mm or rad: one value per axis, given likewise
    combinations  a `Combination` by name: bounds on weighted sums of axes
    torque        a `Torque`: the joint torques of a rigid-body model

    Raises LimitsError for a limit that is not a positive number, for an end feed outside [0, feed], for empty travel,
    and if neither feed nor axis_velocity is given.
    Source: docs/check.md defines each by the setpoints.
    Example: `sf.Limits(feed=60, axis_acceleration=[500, 800], axis_jerk=20000)`
    """

    feed: float = math.inf
    acceleration: float = math.inf
    jerk: float = math.inf
    deceleration: float | None = None
    deceleration_jerk: float | None = None
    start_feed: float = 0.0
    end_feed: float = 0.0
    chord_error: float | None = None
    orientation_error: float | None = None
    centripetal: float | None = None
    axis_velocity: float | ByAxis | None = None
    axis_acceleration: float | ByAxis | None = None
    axis_jerk: float | ByAxis | None = None
    axis_velocity_step: float | ByAxis | None = None
    axis_minimum: ByAxis | None = None
    axis_maximum: ByAxis | None = None
    combinations: Mapping[str, Combination] | None = None
    torque: Torque | None = None

    def __post_init__(self) -> None:
        for name in ORDERS:
            value = getattr(self, name)
            if name in TRAVEL_ENDS or name.endswith("_feed"):
                value = _checked(value, name, number)
            elif not (isinstance(value, float) and value == math.inf):
                value = _checked(value, name, positive)
            if isinstance(value, float) and name in TRAVEL_ENDS:
                raise LimitsError(f"{name} is {value!r}; give one position an axis, such as {{'x': 0.0}}")
            object.__setattr__(self, name, value)
        if self.deceleration is None:
            object.__setattr__(self, "deceleration", self.acceleration)
        if self.deceleration_jerk is None:
            object.__setattr__(self, "deceleration_jerk", self.jerk)
        self._check_travel()
        for name, each in (self.combinations or {}).items():
            if not isinstance(each, Combination) or "." in name:
                raise LimitsError(f"combinations.{name}: give a Combination under a name without a dot")
        combinations = MappingProxyType(dict(self.combinations)) if self.combinations else None
        object.__setattr__(self, "combinations", combinations)
        if self.torque is not None and not isinstance(self.torque, Torque):
            raise LimitsError("torque: give a Torque, a model with the largest torque of every joint")
        if self.feed == math.inf and self.axis_velocity is None:
            raise LimitsError("neither feed nor axis_velocity is given; one of them is needed")
        for name in ("start_feed", "end_feed"):
            value = getattr(self, name)
            if not 0.0 <= value <= self.feed:
                raise LimitsError(
                    f"{name} is {value:g} mm/s; it must lie between 0 and the feed limit of {self.feed:g} mm/s"
                )

    def _check_travel(self) -> None:
        """LimitsError where an end of the travel is missing, or no travel is left."""
        ends: list[dict[Any, float]] = []
        for name in TRAVEL_ENDS:
            value = getattr(self, name)
            ends.append(dict(enumerate(value)) if isinstance(value, tuple) else dict(value or {}))
        low, high = ends
        if set(low) != set(high):
            axes = ", ".join(sorted(map(str, set(low) ^ set(high))))
            raise LimitsError(f"axis_minimum and axis_maximum of {axes}: one is missing; give both ends of its travel")
        for axis in low:
            if not low[axis] < high[axis]:
                raise LimitsError(
                    f"axis_minimum.{axis} is {low[axis]:g} and axis_maximum.{axis} is {high[axis]:g}; no travel is left"
                )

    def for_axes(self, axes: Sequence[str]) -> Limits:
        """These limits with the names of `axes` for values that were given in order, as an array (axes,).

        Raises LimitsError for another number of values than axes. Example: `limits.for_axes(path.axes).as_dict()`
        """
        named: dict[str, Any] = {}
        for name in (*BY_AXIS, *TRAVEL_ENDS):
            values = getattr(self, name)
            if isinstance(values, tuple):
                if len(values) != len(axes):
                    raise LimitsError(
                        f"{name} has the shape ({len(values)},); give one value for each axis of the path, in the "
                        f"order {', '.join(axes)}"
                    )
                named[name] = {axis: value for axis, value in zip(axes, values, strict=True) if value != math.inf}
        return replace(self, **named) if named else self

    def _named(self, name: str) -> Mapping[str, float]:
        """Values by axis, none where nothing is given; LimitsError for values in order, whose axes are not known."""
        value = getattr(self, name)
        if isinstance(value, tuple):
            raise LimitsError(f"{name} has values in the order of axes; name them first: limits.for_axes(path.axes)")
        return value or {}

    @property
    def travel(self) -> dict[str, tuple[float, float]]:
        """Least and greatest position of each axis that has soft limits, mm or rad."""
        high = self._named("axis_maximum")
        return {axis: (low, high[axis]) for axis, low in self._named("axis_minimum").items()}

    def travel_of(self, axes: Sequence[str]) -> dict[str, tuple[float, float]]:
        """`travel`; LimitsError for the travel of an axis that is not among `axes`."""
        travel = self.for_axes(axes).travel
        check_axes("travel", travel, axes)
        return travel

    def of_axes(self, name: str, axes: Sequence[str]) -> Array:
        """One of BY_AXIS for each of `axes`, (axes,), infinite where there is none.

        Raises LimitsError for a limit on an axis that is not there.
        """
        given = getattr(self.for_axes(axes), name)
        if given is None:
            return np.full(len(axes), np.inf)
        if not isinstance(given, Mapping):
            return np.array([math.inf if axis in ROTARY_AXES else given for axis in axes])
        check_axes(name, given, axes)
        return np.array([given.get(axis, math.inf) for axis in axes])

    def as_dict(self) -> dict[str, float]:
        """Names and values in base units as files and reports write them, limits that are not there left out.

        A limit of one axis stands as "axis_jerk.x", one of a combination as "combinations.left.jerk".
        Raises LimitsError for values in order: see `for_axes`.
        """
        for name in ORDERS:
            if isinstance(getattr(self, name), tuple):
                self._named(name)
        return self._values()

    def _values(self) -> dict[str, Any]:
        """`as_dict`, with values in order as they are."""
        flat: dict[str, Any] = {}
        for name in ORDERS:
            value = getattr(self, name)
            if isinstance(value, Mapping):
                flat |= {f"{name}.{axis}": limit for axis, limit in value.items()}
            elif value is not None and value != math.inf:
                flat[name] = value
        for label, each in (self.combinations or {}).items():
            place = f"combinations.{label}"
            flat |= {f"{place}.weights.{axis}": weight for axis, weight in each.weights.items()}
            bounds = {f"{place}.{kind}": float(getattr(each, kind)) for kind in BOUNDED}
            flat |= {key: bound for key, bound in bounds.items() if bound < math.inf}
        return flat | {f"torque.{axis}": most for axis, most in (self.torque.most if self.torque else {}).items()}

    def _repr_html_(self) -> str:
        rows: dict[str, str] = {}
        for name, value in self._values().items():
            kind, _, axis = name.partition(".")
            factor = 180.0 / math.pi if (axis in ROTARY_AXES and kind in ORDERS) or name in ANGLES else 1.0
            shown = ", ".join(f"{factor * each:g}" for each in (value if isinstance(value, tuple) else (value,)))
            rows[name] = f"{shown} {raised(unit_of(name))}"
        return view.table(rows)

    @classmethod
    def from_dict(cls, flat: Mapping[str, float]) -> Limits:
        """The limits that `as_dict` wrote; LimitsError for an unknown name."""
        values: dict[str, Any] = {}
        for key, value in flat.items():
            *tables, last = key.split(".")
            if (tables or [last])[0] not in (*ORDERS, "combinations"):  # a torque's model is a function
                raise LimitsError(f"{key!r} is not a limit that a file can hold; known are {', '.join(ORDERS)}")
            table = values
            for each in tables:
                table = table.setdefault(each, {})
            table[last] = value
        try:
            combinations = {name: Combination(**own) for name, own in values.pop("combinations", {}).items()}
            return cls(**values, combinations=combinations)
        except TypeError as error:
            raise LimitsError(f"combinations: {error}; they have weights, {', '.join(BOUNDED)}") from None


def _checked(value: Any, name: str, check: Callable[[object, str], float]) -> Any:
    """A limit whose every number passes `check`: one, by axis, or in the order of axes; None for nothing."""
    by_axis = name in (*BY_AXIS, *TRAVEL_ENDS)
    if value is None:
        return None
    if by_axis and isinstance(value, Mapping):
        named = {str(axis): check(each, f"{name}.{axis}") for axis, each in value.items()}
        return MappingProxyType(named) if named else None
    if not by_axis or isinstance(value, str):
        return check(value, name)
    try:
        values = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise LimitsError(f"{name} is {value!r}; give numbers, one per axis") from None
    if values.ndim == 0:
        return check(value, name)
    if values.ndim != 1 or not values.size:
        raise LimitsError(f"{name} has shape {values.shape}; expected (axes,), one value per axis")
    free = math.inf if check is positive else math.nan
    return tuple(each if each == free else check(each, f"{name}[{k}]") for k, each in enumerate(values.tolist()))


def refuse_orientation(limits: Limits, name: str) -> None:
    """LimitsError for an orientation error on a path, of this name, that has no tool axis."""
    if limits.orientation_error is not None:
        raise LimitsError(f"orientation_error: {name} has no tool axis; leave it out")


def number(value: object, name: str) -> float:
    """`value` as a finite float; LimitsError names it otherwise."""
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise LimitsError(f"{name} is {value!r}; expected a number") from None
    if not math.isfinite(result):
        raise LimitsError(f"{name} is {result}; it must be finite")
    return result


def positive(value: object, name: str) -> float:
    """`value` as a finite float > 0; LimitsError names it otherwise."""
    result = number(value, name)
    if result <= 0.0:
        raise LimitsError(f"{name} is {result:g}; it must be greater than 0")
    return result
