"""From a path and a time law to setpoints: all at once, in chunks, or one tick at a time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any, overload

import numpy as np

from splinefeed.errors import InputError, LimitsError, MethodError, expect
from splinefeed.interpolation import registry
from splinefeed.interpolation.arc_length import of_tip
from splinefeed.interpolation.loop import OVERRUN, REPLACED, STATE_FLOATS, STATE_INTEGERS
from splinefeed.interpolation.registry import DEFAULT_METHOD
from splinefeed.paths.path import Path
from splinefeed.paths.track import Track
from splinefeed.records import Array, Setpoints, TimeLaw, positive

#: A law whose length differs from the path's by more than this, relative, belongs to another path.
LENGTH_TOLERANCE = 1e-9
#: A duration within this of a whole number of periods, in periods, is one.
WHOLE_PERIODS = 1e-6
#: Ticks that `Interpolator.step` makes at once, where no tick needs the one before.
AHEAD = 256
#: Most passes of a corrector.
MAX_CORRECTIONS = 100


class Interpolator:
    """Make the setpoints of one motion in order, one or many at a time, with memory that does not grow.

    Parameters
    ----------
    path : Track
        To move along. Of a `JointPath` the setpoints are joints.
    law : TimeLaw
        Planned for this path.
    period : float, optional
        Servo period T, s; by default that of the law.
    method : str, optional
        Name of a registered method, see `methods`.
    corrections : int, optional
        Passes of a corrector, 0 to 100.
    tolerance : float, optional
        Change of the parameter u that ends the passes early, in the unit of u.
    compiled : bool, optional
        Whether the loop of a method that steps is compiled before the first tick. By default it is compiled once that
        is worth its time; the setpoints are the same, bit for bit.

    Attributes
    ----------
    ticks : int
        Setpoints of the whole motion, the first one at t = 0 included.
    tick : int
        The next tick.
    settings : dict
        Those of the law, and path, period, method, corrections and tolerance.

    Raises
    ------
    MethodError
        For an unknown method, and for one other than "arc-length" on a JointPath.
    LimitsError
        For a period that is not positive or longer than the motion, and where neither law nor call has one.
    InputError
        For a law of another path, and for corrections or a tolerance out of range.

    References
    ----------
    .. [1] docs/math/interpolators.md, which names the paper of each method.

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.Path.polyline([[0, 0], [10, 0]])
    >>> law = sf.plan(path, sf.Limits(feed=10, acceleration=100, jerk=1000), period=1e-3)
    >>> source = sf.interpolation.Interpolator(path, law)
    >>> source.step()
    array([0., 0.])
    >>> len(source.block(100)), source.tick
    (100, 101)
    """

    def __init__(
        self,
        path: Track,
        law: TimeLaw,
        *,
        period: float | None = None,
        method: str = DEFAULT_METHOD,
        corrections: int = 1,
        tolerance: float = 0.0,
        compiled: bool = False,
    ) -> None:
        self._method = registry.method(method)
        if path.kinematics is not None and self._method.fill is None:
            raise MethodError(f"method {method!r} steps along one curve; joints of a tool path need {DEFAULT_METHOD!r}")
        if period is None:
            period = law.period
        if period is None:
            raise LimitsError("no period: the law was planned without one; give period= in s")
        self.period = positive(period, "period")
        if self.period > law.duration * (1.0 + WHOLE_PERIODS):
            raise LimitsError(f"the period of {self.period:g} s is longer than the whole motion of {law.duration:g} s")
        if isinstance(corrections, bool) or int(corrections) != corrections or not 0 <= corrections <= MAX_CORRECTIONS:
            raise InputError(f"corrections is {corrections!r}; expected a whole number from 0 to {MAX_CORRECTIONS}")
        if not tolerance >= 0.0:
            raise InputError(f"tolerance is {tolerance!r}; expected 0 or more")
        if abs(law.length - path.length) > LENGTH_TOLERANCE * path.length:
            raise InputError(
                f"the law runs over {law.length:.9g} mm but the path is {path.length:.9g} mm long; "
                "plan the law for this path"
            )
        self.path = path
        self.curves = path.tip_path
        self.law = law
        #: Number of setpoints of the whole motion, the first one at t = 0 included.
        self.ticks = math.ceil(law.duration / self.period - WHOLE_PERIODS) + 1
        #: The next tick.
        self.tick = 0
        self.settings: dict[str, Any] = {
            **law.settings,
            "path": path.name,
            "period": self.period,
            "method": method,
            "corrections": int(corrections),
            "tolerance": float(tolerance),
        }
        self._compiled = compiled
        self._integers, self._floats = np.zeros(STATE_INTEGERS, dtype=np.int64), np.zeros(STATE_FLOATS)
        self._corrections = int(corrections), float(tolerance)
        self._ahead, self._ahead_of = np.empty((0, 0)), 0

    @cached_property
    def _loop(self) -> Callable[..., None]:
        loop = self._method.loop(self.curves.shape)
        return loop.compiled if self._compiled else loop.for_work(self.ticks)

    @property
    def replaced(self) -> int:
        """Steps so far in which the method gave no finite number and were replaced by arc length."""
        return int(self._integers[REPLACED])

    @property
    def overrun(self) -> float:
        """How far the method's steps would have gone beyond the end of the path so far, mm: it is held at the end."""
        return float(self._floats[OVERRUN])

    def step(self) -> Array:
        """Return the position at the next tick.

        Returns
        -------
        (axes,) array
            Position, mm, rotary axes rad.

        Raises
        ------
        StopIteration
            After the last tick.

        Notes
        -----
        A method whose ticks do not need each other makes AHEAD of them at once, so that one call of so many takes some
        tenths of a millisecond.
        """
        if self.tick >= self.ticks:
            raise StopIteration
        if not self._ahead_of <= self.tick < self._ahead_of + len(self._ahead):
            count = 1 if self._method.fill is None else min(AHEAD, self.ticks - self.tick)
            *_, self._ahead = self._filled(count)
            self._ahead_of = self.tick
        position: Array = self._ahead[self.tick - self._ahead_of]
        self.tick += 1
        return position

    def _filled(self, count: int) -> tuple[Any, Array, Array, Array, Array]:
        """Curve, u, s, feed and position of the next `count` ticks."""
        law, curves, method = self.law, self.curves, self._method
        if method.fill is not None:
            return method.fill(self.path, law, self._times(count))
        u, s, feed = np.empty((3, count))
        room = np.empty(count, dtype=np.int64), u, s, feed, np.empty((count, len(self.path.axes)))
        motion = (law.breaks, law.coefficients, curves.table, curves.curve_rows, self.path.length)
        wanted = (method.history, method.half, method.anchor, *self._corrections)
        self._loop(*motion, self.period, self.tick, self._integers, self._floats, *wanted, *room)
        return room[0], u, *of_tip(self.curves, s, feed, room[4])

    def _times(self, count: int) -> Array:
        out: Array = np.minimum(np.arange(self.tick, self.tick + count) * self.period, self.law.duration)
        return out

    def block(self, count: int | None = None) -> Setpoints:
        """Return the next setpoints.

        Parameters
        ----------
        count : int, optional
            How many ticks; by default all that are left.

        Returns
        -------
        Setpoints
            Of `count` ticks; fewer, or none, at the end.
        """
        left = self.ticks - self.tick
        count = left if count is None else max(0, min(count, left))
        curve, u, s, feed, position = self._filled(count)
        found = Setpoints(
            t=self._times(count),
            curve=curve,
            u=u,
            s=s,
            feed=feed,
            position=position,
            axes=self.path.axes,
            period=self.period,
            method=self.settings["method"],
            settings=self.settings,
        )
        self.tick += count
        return found


@overload
def interpolate(
    path: Track,
    law: TimeLaw,
    *,
    period: float | None = ...,
    method: str = ...,
    corrections: int = ...,
    tolerance: float = ...,
    chunk: None = ...,
) -> Setpoints: ...


@overload
def interpolate(
    path: Track,
    law: TimeLaw,
    *,
    period: float | None = ...,
    method: str = ...,
    corrections: int = ...,
    tolerance: float = ...,
    chunk: int,
) -> Iterator[Setpoints]: ...


def interpolate(
    path: Track,
    law: TimeLaw,
    *,
    period: float | None = None,
    method: str = DEFAULT_METHOD,
    corrections: int = 1,
    tolerance: float = 0.0,
    chunk: int | None = None,
) -> Setpoints | Iterator[Setpoints]:
    """Compute where every axis must be at each tick k T, from t = 0 to the end of the law.

    Parameters
    ----------
    path : Track
        To move along. Of a `JointPath` the setpoints are joints.
    law : TimeLaw
        Planned for this path.
    period : float, optional
        Servo period T, s; by default that of the law.
    method : str, optional
        Name of a registered method, see `methods`.
    corrections : int, optional
        Passes of a corrector, 0 to 100.
    tolerance : float, optional
        Change of the parameter u that ends the passes early, in the unit of u.
    chunk : int, optional
        Ticks of each record where the motion comes in several, for jobs that do not fit in memory. The ticks are the
        same, bit for bit.

    Returns
    -------
    Setpoints or iterator of Setpoints
        Of n ticks: t, u, s and feed (n,), position (n, axes), mm, rotary axes rad. With `chunk` an iterator of parts.

    Raises
    ------
    InputError
        For a chunk that is no whole number from 1 up; and what `Interpolator` raises.

    Notes
    -----
    The default method solves S(u) = l(t) at each tick, S the arc length of the path and l the law.

    References
    ----------
    .. [1] docs/math/interpolators.md, which names the paper of each method.

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.Path.polyline([[0, 0], [10, 0]])
    >>> law = sf.plan(path, sf.Limits(feed=10, acceleration=100, jerk=1000), period=1e-3)
    >>> sf.interpolate(path, law, method="milne-simpson").position.shape
    (1201, 2)
    >>> [len(part) for part in sf.interpolate(path, law, chunk=500)]
    [500, 500, 201]
    """
    expect("interpolate(path, law)", (path, (Path, Track)), (law, TimeLaw))
    source = Interpolator(path, law, period=period, method=method, corrections=corrections, tolerance=tolerance)
    if chunk is None:
        return source.block()
    if isinstance(chunk, bool) or int(chunk) != chunk or chunk < 1:
        raise InputError(f"chunk is {chunk!r}; expected a whole number of ticks from 1 up")
    return _blocks(source, int(chunk))


def _blocks(source: Interpolator, chunk: int) -> Iterator[Setpoints]:
    while source.tick < source.ticks:
        yield source.block(chunk)
