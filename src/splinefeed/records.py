"""The records that rooms hand to each other: Limits, TimeLaw, Setpoints (numpy only, frozen)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splinefeed.errors import InputError, LimitsError

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

#: Names of rotary axes: rad inside, degrees at the edges. Every other axis is linear.
ROTARY_AXES = ("a", "b", "c", "theta")

#: Fields of Limits that bound the derivatives of each axis by time, of order 1, 2 and 3.
AXIS_LIMITS = ("axis_velocity", "axis_acceleration", "axis_jerk")
#: Fields of Limits that may differ from axis to axis: those, and the step of velocity at a corner.
BY_AXIS = (*AXIS_LIMITS, "axis_velocity_step")
#: Fields of Limits that say how far each axis may travel.
TRAVEL_ENDS = ("axis_minimum", "axis_maximum")

#: Fields of Response that only streams have.
STREAM_COLUMNS = ("row", "depth", "underruns")

#: Number of coefficients of a time-law piece: quintic in t, the highest degree that a strategy makes.
LAW_COEFFICIENTS = 6

#: A limit counts as kept up to this, relative: the rounding of a plan that rides on it.
KEPT = 1e-9


def frozen_array(values: ArrayLike, name: str, ndim: int) -> Array:
    """Copy to a read-only contiguous float64 array of `ndim` dimensions; InputError names what is wrong."""
    try:
        array = np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{name}: expected numbers in {ndim} dimension(s), got {type(values).__name__} ({error})"
        ) from None
    if array.ndim != ndim:
        raise InputError(f"{name}: expected {ndim} dimension(s), got shape {array.shape}")
    array.setflags(write=False)
    return array


def check_finite(array: Array, name: str) -> None:
    """Raise InputError naming the first element of `array` that is NaN or infinite."""
    finite = np.isfinite(array)
    if not finite.all():
        place = np.unravel_index(int(np.argmin(finite)), array.shape)
        index = ", ".join(str(int(i)) for i in place)
        raise InputError(f"{name}[{index}] is {array[place]}; every value must be finite")


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What a motion must never exceed; whatever is left out does not limit.

    feed  mm/s; acceleration, deceleration  mm/s^2 and jerk (while speeding up), deceleration_jerk (while slowing
    down)  mm/s^3, along the path; deceleration and its jerk follow acceleration and jerk unless given
    start_feed, end_feed  mm/s at the ends of the path
    chord_error   mm between the curve and the line from one setpoint to the next; centripetal  mm/s^2
    axis_velocity, axis_acceleration, axis_jerk  mm/s, mm/s^2, mm/s^3 for every linear axis, or a mapping from axis
                  names (rotary ones in rad)
    axis_velocity_step  how much the velocity of each axis may jump at a corner, mm/s, given likewise; without it the
                  tool stops at every corner (exact stop)
    axis_minimum, axis_maximum  ends of the travel of axes (soft limits), mm or rad: mappings from axis names

    Raises LimitsError for a limit that is not a positive number, for an end feed outside [0, feed], for travel that is
    none, and if neither feed nor axis_velocity is given.
    """

    feed: float = math.inf
    acceleration: float = math.inf
    jerk: float = math.inf
    deceleration: float | None = None
    deceleration_jerk: float | None = None
    start_feed: float = 0.0
    end_feed: float = 0.0
    chord_error: float | None = None
    centripetal: float | None = None
    axis_velocity: float | Mapping[str, float] | None = None
    axis_acceleration: float | Mapping[str, float] | None = None
    axis_jerk: float | Mapping[str, float] | None = None
    axis_velocity_step: float | Mapping[str, float] | None = None
    axis_minimum: Mapping[str, float] | None = None
    axis_maximum: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        for name in ("feed", "acceleration", "jerk"):
            value = getattr(self, name)
            if not (isinstance(value, float) and value == math.inf):
                object.__setattr__(self, name, positive(value, name))
        for name in ("deceleration", "deceleration_jerk", "chord_error", "centripetal"):
            value = getattr(self, name)
            if value is not None and value != math.inf:
                object.__setattr__(self, name, positive(value, name))
        if self.deceleration is None:
            object.__setattr__(self, "deceleration", self.acceleration)
        if self.deceleration_jerk is None:
            object.__setattr__(self, "deceleration_jerk", self.jerk)
        for name in BY_AXIS:
            value = getattr(self, name)
            if isinstance(value, Mapping):
                checked = {str(axis): positive(limit, f"{name}.{axis}") for axis, limit in value.items()}
                object.__setattr__(self, name, MappingProxyType(checked) if checked else None)
            elif value is not None:
                object.__setattr__(self, name, positive(value, name))
        for name in TRAVEL_ENDS:
            value = getattr(self, name)
            if value is not None and not isinstance(value, Mapping):
                raise LimitsError(f"{name} is {value!r}; give one position an axis, such as {{'x': 0.0}}")
            ends = {str(axis): number(end, f"{name}.{axis}") for axis, end in (value or {}).items()}
            object.__setattr__(self, name, MappingProxyType(ends) if ends else None)
        low_ends, high_ends = self.axis_minimum or {}, self.axis_maximum or {}
        for axis in {**low_ends, **high_ends}:
            if axis not in low_ends or axis not in high_ends:
                raise LimitsError(
                    f"axis_minimum and axis_maximum of {axis}: one is missing; give both ends of its travel"
                )
        for axis, (low, high) in self.travel.items():
            if not low < high:
                raise LimitsError(
                    f"axis_minimum.{axis} is {low:g} and axis_maximum.{axis} is {high:g}; no travel is left"
                )
        if self.feed == math.inf and self.axis_velocity is None:
            raise LimitsError("neither feed nor axis_velocity is given; one of them is needed")
        for name in ("start_feed", "end_feed"):
            value = number(getattr(self, name), name)
            if not 0.0 <= value <= self.feed:
                raise LimitsError(
                    f"{name} is {value:g} mm/s; it must lie between 0 and the feed limit of {self.feed:g} mm/s"
                )
            object.__setattr__(self, name, value)

    @property
    def travel(self) -> dict[str, tuple[float, float]]:
        """Least and greatest position of each axis that has soft limits, mm or rad."""
        return {axis: (low, (self.axis_maximum or {})[axis]) for axis, low in (self.axis_minimum or {}).items()}

    def travel_of(self, axes: Sequence[str]) -> dict[str, tuple[float, float]]:
        """`travel`; LimitsError for the travel of an axis that is not among `axes`."""
        for axis in self.travel:
            if axis not in axes:
                raise LimitsError(f"travel.{axis}: the path has no axis {axis!r}; its axes are {', '.join(axes)}")
        return self.travel

    def of_axes(self, name: str, axes: Sequence[str]) -> Array:
        """One of BY_AXIS for each of `axes`, (axes,), infinite where there is none.

        Raises LimitsError for a limit on an axis that is not there.
        """
        given = getattr(self, name)
        if given is None:
            return np.full(len(axes), np.inf)
        if not isinstance(given, Mapping):
            return np.array([math.inf if axis in ROTARY_AXES else given for axis in axes])
        for axis in given:
            if axis not in axes:
                raise LimitsError(f"{name}.{axis}: the path has no axis {axis!r}; its axes are {', '.join(axes)}")
        return np.array([given.get(axis, math.inf) for axis in axes])

    def as_dict(self) -> dict[str, float]:
        """Names and values in base units as files and reports write them, limits that are not there left out.

        A limit of one axis stands as "axis_jerk.x".
        """
        flat: dict[str, float] = {}
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, Mapping):
                flat |= {f"{f.name}.{axis}": limit for axis, limit in value.items()}
            elif value is not None and value != math.inf:
                flat[f.name] = float(value)
        return flat

    @classmethod
    def from_dict(cls, flat: Mapping[str, float]) -> Limits:
        """The limits that `as_dict` wrote; LimitsError for a name that is none."""
        known = {f.name for f in fields(cls)}
        values: dict[str, Any] = {}
        for key, value in flat.items():
            name, _, axis = key.partition(".")
            if name not in known or (axis and name not in (*BY_AXIS, *TRAVEL_ENDS)):
                raise LimitsError(f"{key!r} is no limit; known are {', '.join(sorted(known))}")
            if axis:
                values.setdefault(name, {})[axis] = value
            else:
                values[name] = value
        return cls(**values)


def number(value: object, name: str) -> float:
    """`value` as a finite float; LimitsError names it otherwise."""
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise LimitsError(f"{name} is {value!r}; a number is needed") from None
    if not math.isfinite(result):
        raise LimitsError(f"{name} is {result}; it must be finite")
    return result


def positive(value: object, name: str) -> float:
    """`value` as a finite float > 0; LimitsError names it otherwise."""
    result = number(value, name)
    if result <= 0.0:
        raise LimitsError(f"{name} is {result:g}; it must be greater than 0")
    return result


@dataclass(frozen=True, eq=False, kw_only=True)
class TimeLaw:
    """How far along the path the tool is by when: s(t), polynomial between breaks.

    breaks        (m+1,)  s, from 0, increasing
    coefficients  (m, 6)  s(t) = sum_k coefficients[i, k] (t - breaks[i])^k  mm, in mm/s^k
    period        servo period that the law was brought to, s; None if it was not
    notes         what the planner had to give way in, one sentence each
    settings      what it was planned with, for the records of a run
    """

    breaks: Array
    coefficients: Array
    strategy: str
    period: float | None = None
    notes: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "breaks", frozen_array(self.breaks, "TimeLaw.breaks", 1))
        object.__setattr__(self, "coefficients", frozen_array(self.coefficients, "TimeLaw.coefficients", 2))
        check_finite(self.breaks, "TimeLaw.breaks")
        check_finite(self.coefficients, "TimeLaw.coefficients")
        if self.coefficients.shape != (len(self.breaks) - 1, LAW_COEFFICIENTS) or len(self.breaks) < 2:
            raise InputError(
                f"TimeLaw: {len(self.breaks)} breaks need coefficients of shape "
                f"({len(self.breaks) - 1}, {LAW_COEFFICIENTS}), got {self.coefficients.shape}"
            )
        if self.breaks[0] != 0.0 or not np.all(np.diff(self.breaks) > 0.0):
            raise InputError("TimeLaw.breaks must begin at 0 and increase")

    @property
    def duration(self) -> float:
        """Time from the first point to the last, s."""
        return float(self.breaks[-1])

    @property
    def length(self) -> float:
        """Arc length at the end of the law, mm."""
        return float(self(self.duration))

    def __call__(self, t: ArrayLike) -> Array:
        """Arc length s(t), mm; t in s, any shape, clamped to [0, duration]."""
        return self._derivative(t, 0)

    def feed(self, t: ArrayLike) -> Array:
        """Feed ds/dt, mm/s; t in s, any shape, clamped to [0, duration]."""
        return self._derivative(t, 1)

    def acceleration(self, t: ArrayLike) -> Array:
        """Tangential acceleration, mm/s^2; t in s, any shape, clamped to [0, duration]."""
        return self._derivative(t, 2)

    def jerk(self, t: ArrayLike) -> Array:
        """Tangential jerk, mm/s^3, from the right at breaks; t in s, any shape, clamped to [0, duration]."""
        return self._derivative(t, 3)

    def _derivative(self, t: ArrayLike, order: int) -> Array:
        time = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        piece = np.clip(np.searchsorted(self.breaks, time, side="right") - 1, 0, len(self.coefficients) - 1)
        tau = time - self.breaks[piece]
        value = np.zeros_like(tau)
        for k in range(LAW_COEFFICIENTS - 1, order - 1, -1):  # Horner on the order-th derivative
            value = value * tau + self.coefficients[piece, k] * float(math.perm(k, order))
        return value


@dataclass(frozen=True, eq=False, kw_only=True)
class Setpoints:
    """Where every axis must be at each servo tick.

    t         (n,)       time of the tick, s
    curve     (n,)       index of the curve in its path
    u         (n,)       parameter on that curve
    s         (n,)       arc length of the point along the path, mm
    feed      (n,)       planned feed at the tick, mm/s
    position  (n, axes)  mm, rotary axes rad
    axes      names of the axes; period in s; method as registered
    settings  all that is needed to make these points again
    """

    t: Array
    curve: IntArray
    u: Array
    s: Array
    feed: Array
    position: Array
    axes: tuple[str, ...]
    period: float
    method: str
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("t", "u", "s", "feed", "position"):
            array = np.ascontiguousarray(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, _read_only(array))
        object.__setattr__(self, "curve", _read_only(np.ascontiguousarray(self.curve, dtype=np.int64)))
        object.__setattr__(self, "axes", tuple(self.axes))
        n = len(self.t)
        for name in ("t", "curve", "u", "s", "feed"):
            if getattr(self, name).shape != (n,):
                raise InputError(f"Setpoints.{name} has shape {getattr(self, name).shape}; expected ({n},)")
        if self.position.shape != (n, len(self.axes)):
            raise InputError(f"Setpoints.position has shape {self.position.shape}; expected ({n}, {len(self.axes)})")

    def part(self, start: int, stop: int) -> Setpoints:
        """Setpoints start ... stop - 1, as views of these."""
        columns = {name: getattr(self, name)[start:stop] for name in ("t", "curve", "u", "s", "feed", "position")}
        return replace(self, **columns)

    def __len__(self) -> int:
        return len(self.t)


@dataclass(frozen=True, eq=False, kw_only=True)
class Response:
    """What the axes of a machine did when they were given setpoints.

    t          (n,)       time of the tick, s
    command    (n, axes)  where each axis was told to be, mm, rotary axes rad
    position   (n, axes)  where it was
    measured   (n, axes)  where its encoder or scale said it was
    output     (n, axes)  control output, V
    saturated  (n, axes)  whether the output was at its limit
    contour_error  (n,)   distance of `position` from the true path over the linear axes, mm; None if no path was given
    row, depth, underruns  (n,)  of a stream to a controller: number of its row, rows that it still had, and periods in
                           which it had none so far; None where nothing was streamed
    stopped    why the run ended early, or None; settings  all that is needed to make it again
    """

    t: Array
    command: Array
    position: Array
    measured: Array
    output: Array
    saturated: BoolArray
    axes: tuple[str, ...]
    period: float
    contour_error: Array | None = None
    row: IntArray | None = None
    depth: IntArray | None = None
    underruns: IntArray | None = None
    stopped: str | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "axes", tuple(self.axes))
        n = len(self.t)
        object.__setattr__(self, "t", _read_only(np.ascontiguousarray(self.t, dtype=np.float64)))
        for name in ("command", "position", "measured", "output", "saturated"):
            dtype = np.bool_ if name == "saturated" else np.float64
            array = _read_only(np.ascontiguousarray(getattr(self, name), dtype=dtype))
            if array.shape != (n, len(self.axes)):
                raise InputError(f"Response.{name} has shape {array.shape}; expected ({n}, {len(self.axes)})")
            object.__setattr__(self, name, array)
        if self.contour_error is not None:
            error = _read_only(np.ascontiguousarray(self.contour_error, dtype=np.float64))
            if error.shape != (n,):
                raise InputError(f"Response.contour_error has shape {error.shape}; expected ({n},)")
            object.__setattr__(self, "contour_error", error)
        for name in STREAM_COLUMNS:
            if (given := getattr(self, name)) is not None:
                counts = _read_only(np.ascontiguousarray(given, dtype=np.int64))
                if counts.shape != (n,):
                    raise InputError(f"Response.{name} has shape {counts.shape}; expected ({n},)")
                object.__setattr__(self, name, counts)

    @property
    def tracking_error(self) -> Array:
        """command - position of each axis, (n, axes), mm, rotary axes rad."""
        return self.command - self.position

    def __len__(self) -> int:
        return len(self.t)


def _read_only(array: Any) -> Any:
    view = array.view()
    view.setflags(write=False)
    return view


@dataclass(frozen=True, kw_only=True)
class LimitResult:
    """How one limit fares; mm, s and rad.

    limit, worst  in the same unit; at_s  mm along the path and at_t  s, where the worst is; axis  whose it is, if one's
    floor   what the rounding of the setpoints alone makes of this difference; 0 where the law itself is the worst
    by      "setpoints" (their differences) or "law" (exact derivatives)
    over    how many ticks, or instants of the law, are over the limit
    """

    limit: float
    worst: float
    at_s: float
    at_t: float
    floor: float = 0.0
    axis: str | None = None
    by: str = "setpoints"
    over: int = 0

    @property
    def share(self) -> float:
        """worst / limit."""
        return self.worst / self.limit

    @property
    def holds(self) -> bool:
        """worst <= limit (1 + 1e-9) + floor."""
        return self.worst <= self.limit * (1.0 + KEPT) + self.floor


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What a check of setpoints found.

    limits    by name: feed, acceleration, deceleration, jerk, chord_error, centripetal, axis_jerk.x, ..., travel.x
    problems  one sentence each: what, how much, where; none if all is well
    notes     what was allowed for, and what decides where exact derivatives cannot, one sentence each
    numbers   what was measured besides: duration_s, length_mm, ticks, period_s, method, end_error_mm, ...
    """

    limits: Mapping[str, LimitResult]
    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether every limit and every other check holds."""
        return not self.problems and all(result.holds for result in self.limits.values())

    def as_dict(self) -> dict[str, Any]:
        """The keys of `--json`; limits of rotary axes in degrees."""
        limits = {}
        for name, result in self.limits.items():
            unit = 180.0 / math.pi if result.axis in ROTARY_AXES else 1.0
            limits[name] = {
                "limit": unit * result.limit,
                "worst": unit * result.worst,
                "share": result.share,
                "at_s": result.at_s,
                "at_t_s": result.at_t,
                "axis": result.axis,
                "floor": unit * result.floor,
                "by": result.by,
                "over": result.over,
                "ok": result.holds,
            }
        return {
            "ok": self.ok,
            **self.numbers,
            "limits": limits,
            "problems": list(self.problems),
            "notes": list(self.notes),
        }
