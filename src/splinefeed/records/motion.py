"""Motion in time: TimeLaw, arc length over time; Setpoints, where axes must be; Response, what they did."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splinefeed.errors import InputError
from splinefeed.records import view
from splinefeed.records.arrays import Array, BoolArray, IntArray, check_finite, frozen_array, read_only

#: Number of coefficients of a time-law piece: quintic in t, the highest degree that a strategy makes.
LAW_COEFFICIENTS = 6
#: Instants at which a notebook's view samples the feed.
SAMPLES = 2001
#: Fields of Response that only streams have.
STREAM_COLUMNS = ("row", "depth", "underruns")


@dataclass(frozen=True, eq=False, kw_only=True)
class TimeLaw:
    """The length along the path over time: s(t), polynomial between breaks.

    Parameters
    ----------
    breaks : (m + 1,) array
        Times, s, from 0, increasing.
    coefficients : (m, 6) array
        s(t) = sum_k coefficients[i, k] (t - breaks[i])^k, mm, in mm/s^k.
    strategy : str
        Name of the planner's strategy that made it.
    period : float, optional
        Servo period that the law was brought to, s; None if it was not.
    notes : tuple of str, optional
        What the planner had to relax, one sentence each.
    settings : mapping, optional
        What it was planned with, for the records of a run.

    Raises
    ------
    InputError
        For arrays of other shapes, that are not finite, or breaks that do not begin at 0 and increase.

    Notes
    -----
    Where linear and rotary axes move, the length counts both, see `Path`; `Path.of_tip` makes the tip's feed of it.

    References
    ----------
    .. [1] docs/math/planner.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.Path.polyline([[0, 0], [30, 0]])
    >>> law = sf.plan(path, sf.Limits(feed=10, acceleration=100, jerk=1000))
    >>> print(f"{law.duration:.3f} s, {law.feed(1.0):.1f} mm/s")
    3.200 s, 10.0 mm/s
    """

    breaks: Array
    coefficients: Array
    strategy: str
    period: float | None = None
    notes: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, ndim in (("breaks", 1), ("coefficients", 2)):
            object.__setattr__(self, name, frozen_array(getattr(self, name), f"TimeLaw.{name}", ndim))
            check_finite(getattr(self, name), f"TimeLaw.{name}")
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
        """Compute the length s(t).

        Parameters
        ----------
        t : array_like
            Times (...), s, clamped to [0, duration].

        Returns
        -------
        (...) array
            Arc length, mm.
        """
        return self._derivative(t, 0)

    def feed(self, t: ArrayLike) -> Array:
        """Compute the feed ds/dt.

        Parameters
        ----------
        t : array_like
            Times (...), s, clamped to [0, duration].

        Returns
        -------
        (...) array
            mm/s.
        """
        return self._derivative(t, 1)

    def acceleration(self, t: ArrayLike) -> Array:
        """Compute the tangential acceleration.

        Parameters
        ----------
        t : array_like
            Times (...), s, clamped to [0, duration].

        Returns
        -------
        (...) array
            mm/s^2.
        """
        return self._derivative(t, 2)

    def jerk(self, t: ArrayLike) -> Array:
        """Compute the tangential jerk; at breaks that from the right.

        Parameters
        ----------
        t : array_like
            Times (...), s, clamped to [0, duration].

        Returns
        -------
        (...) array
            mm/s^3.
        """
        return self._derivative(t, 3)

    def __repr__(self) -> str:
        unit = self.settings.get("unit", "mm")
        return f"TimeLaw({self.strategy!r}, {self.length:.6g} {unit} in {self.duration:.6g} s)"

    def _repr_html_(self) -> str:
        feed = self.feed(np.linspace(0.0, self.duration, SAMPLES))
        return view.table({"time law": f"{self!r}"}, view.sparkline(feed, "feed over time"))

    def _derivative(self, t: ArrayLike, order: int) -> Array:
        time = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        piece = np.clip(np.searchsorted(self.breaks, time, side="right") - 1, 0, len(self.coefficients) - 1)
        return derivative(self.coefficients[piece], time - self.breaks[piece], order)


def derivative(c: Array, tau: Array, order: int) -> Array:
    """Evaluate a derivative of the polynomials sum_k c_k tau^k.

    Parameters
    ----------
    c : (n, 6) array
        Their coefficients.
    tau : (..., n) array
        Where.
    order : int
        Of the derivative, from 0.

    Returns
    -------
    (..., n) array
        Its values.
    """
    value = np.zeros_like(tau)
    for k in range(LAW_COEFFICIENTS - 1, order - 1, -1):  # Horner: planners end a piece at its feed to the bit
        value *= tau
        value += c[..., k] * float(math.perm(k, order)) if order else c[..., k]
    return value


class _Columns:
    """A record of ticks: flat columns (ticks,) and wide ones (ticks, axes) are read-only arrays of these dtypes."""

    _flat: ClassVar[Mapping[str, type]]
    _wide: ClassVar[Mapping[str, type]]
    t: Array
    axes: tuple[str, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "axes", tuple(self.axes))
        ticks, axes = len(self.t), len(self.axes)
        for columns, shape in ((self._flat, (ticks,)), (self._wide, (ticks, axes))):
            for name, dtype in columns.items():
                if (given := getattr(self, name)) is not None:
                    array: NDArray[Any] = np.ascontiguousarray(given, dtype=dtype)
                    if array.shape != shape:
                        raise InputError(f"{type(self).__name__}.{name} has shape {array.shape}; expected {shape}")
                    object.__setattr__(self, name, read_only(array))

    @property
    def columns(self) -> dict[str, Any]:
        """All columns that it has, by name."""
        found = {name: getattr(self, name) for name in (*self._flat, *self._wide)}
        return {name: values for name, values in found.items() if values is not None}

    def as_columns(self) -> dict[str, Any]:
        """Give columns (ticks,) by name, one an axis: x where positions are all that it has of axes, else position.x.

        Examples
        --------
        >>> import splinefeed as sf
        >>> run = sf.run(sf.Path.polyline([[0, 0], [30, 0]]), sf.Limits(feed=10, acceleration=100, jerk=1000))
        >>> sorted(run.points.as_columns())[:3]
        ['curve', 'feed', 's']
        """
        found: dict[str, Any] = {}
        for name, values in self.columns.items():
            if name in self._flat:
                found[name] = values
            else:
                alone = len(self._wide) == 1
                found |= {axis if alone else f"{name}.{axis}": values[:, k] for k, axis in enumerate(self.axes)}
        return found

    def __len__(self) -> int:
        return len(self.t)


@dataclass(frozen=True, eq=False, kw_only=True)
class Setpoints(_Columns):
    """Where every axis must be at each servo tick.

    Parameters
    ----------
    t : (n,) array
        Time of the tick, s.
    curve : (n,) array of int
        Index of the curve in its path.
    u : (n,) array
        Parameter on that curve; NaN where only positions are known.
    s : (n,) array
        Arc length of the tip at the point, mm; of rotary axes alone in degrees.
    feed : (n,) array
        Planned feed at the tick, mm/s.
    position : (n, axes) array
        mm, rotary axes rad.
    axes : tuple of str
        Names of the axes.
    period : float
        Servo period, s.
    method : str
        The method that made them, as registered.
    settings : mapping, optional
        All that is needed to repeat them.

    Raises
    ------
    InputError
        For arrays of other shapes.

    References
    ----------
    .. [1] docs/setpoint-files.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.Path.polyline([[0, 0], [30, 0]])
    >>> law = sf.plan(path, sf.Limits(feed=10, acceleration=100, jerk=1000), period=1e-3)
    >>> setpoints = sf.interpolate(path, law)
    >>> setpoints.position.shape, setpoints.axes, setpoints.period
    ((3201, 2), ('x', 'y'), 0.001)
    """

    _flat: ClassVar[Mapping[str, type]] = {"t": float, "curve": np.int64, "u": float, "s": float, "feed": float}
    _wide: ClassVar[Mapping[str, type]] = {"position": float}

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

    def part(self, start: int, stop: int) -> Setpoints:
        """Take some of the setpoints, without a copy.

        Parameters
        ----------
        start, stop : int
            Numbers of the first one, and of the one behind the last.

        Returns
        -------
        Setpoints
            Views of these.
        """
        return replace(self, **{name: values[start:stop] for name, values in self.columns.items()})

    @staticmethod
    def joined(parts: Sequence[Setpoints]) -> Setpoints:
        """Join setpoints that follow each other.

        Parameters
        ----------
        parts : sequence of Setpoints
            At least one.

        Returns
        -------
        Setpoints
            All in one record.
        """
        if len(parts) == 1:
            return parts[0]
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(each, name) for each in parts]) for name in parts[0].columns
        }
        return replace(parts[-1], **columns)

    def __repr__(self) -> str:
        return f"Setpoints({len(self)}, one every {self.period:g} s, axes {' '.join(self.axes)}, {self.method!r})"

    def _repr_html_(self) -> str:
        return view.table({"setpoints": f"{self!r}"}, view.sparkline(self.feed, "feed over time"))


@dataclass(frozen=True, eq=False, kw_only=True)
class Response(_Columns):
    """How a machine's axes moved as they followed setpoints.

    Parameters
    ----------
    t : (n,) array
        Time of the tick, s.
    command : (n, axes) array
        Commanded position of each axis, mm, rotary axes rad.
    position : (n, axes) array
        Where it was.
    measured : (n, axes) array
        What its encoder or scale measured.
    output : (n, axes) array
        Control output, V.
    saturated : (n, axes) array of bool
        Whether the output was at its limit.
    axes : tuple of str
        Names of the axes.
    period : float
        Servo period, s.
    contour_error : (n,) array, optional
        Distance of `position` from the true path over the linear axes, mm; None if no path was given.
    row, depth, underruns : (n,) array of int, optional
        Of a stream to a controller: number of its row, rows that it still had, and periods in which it had none so far;
        None where nothing was streamed.
    stopped : str, optional
        Why the run ended early.
    settings : mapping, optional
        All that is needed to repeat it.

    Raises
    ------
    InputError
        For arrays of other shapes.

    References
    ----------
    .. [1] docs/machines.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.Path.polyline([[0, 0], [5, 0]])
    >>> law = sf.plan(path, sf.Limits(feed=10, acceleration=100, jerk=1000), period=1e-3)
    >>> response = sf.runs.follow(sf.interpolate(path, law), "router", path=path)
    >>> response.axes, response.contour_error.shape == response.t.shape
    (('x', 'y'), True)
    """

    _flat: ClassVar[Mapping[str, type]] = {
        "t": float,
        "contour_error": float,
        **dict.fromkeys(STREAM_COLUMNS, np.int64),
    }
    _wide: ClassVar[Mapping[str, type]] = {
        **dict.fromkeys(("command", "position", "measured", "output"), float),
        "saturated": bool,
    }

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

    @property
    def tracking_error(self) -> Array:
        """command - position of each axis, (n, axes), mm, rotary axes rad."""
        return self.command - self.position

    @property
    def contour_error_max(self) -> float:
        """Largest contour error, mm; InputError where no path was given."""
        if self.contour_error is None:
            raise InputError("no contour error without the path; give it: follow(setpoints, machine, path=path)")
        return float(np.max(self.contour_error, initial=0.0))

    def __repr__(self) -> str:
        return f"Response({len(self)} ticks of {self.period:g} s, axes {' '.join(self.axes)})"

    def _repr_html_(self) -> str:
        rows = {"response": f"{self!r}", **({"stopped": self.stopped} if self.stopped else {})}
        if self.contour_error is None:
            error = np.max(np.abs(self.tracking_error), axis=1, initial=0.0)
            return view.table(rows, view.sparkline(error, "largest following error over time"))
        rows["contour error"] = f"at most {self.contour_error_max:.4g} mm"
        return view.table(rows, view.sparkline(self.contour_error, "contour error over time"))
