"""Setpoints through a machine, with the contour error where the path is known; in pieces, in memory that stays flat."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from splinefeed.analysis.bands import Band
from splinefeed.analysis.following import ContourMeter, ErrorTally
from splinefeed.analysis.thinning import Kept
from splinefeed.checks.place import Placer
from splinefeed.errors import InputError, expect
from splinefeed.machine.machine import Machine
from splinefeed.paths.path import Path
from splinefeed.records import ROTARY_AXES, Array, Response, Setpoints, TimeLaw
from splinefeed.simulation.follow import Follower
from splinefeed.simulation.linear import margins

#: Samples of a response of any length that are kept at the most; a figure has some hundred columns of pixels.
MOST_SAMPLES = 40_000


@dataclass(frozen=True, eq=False)
class Deviation:
    """Samples of a response over two linear axes of a path.

    Parameters
    ----------
    path : Path
        That was commanded.
    foot : array (n, 2)
        On the path, mm.
    offset : array (n, 2)
        Of the machine from there, mm.
    error : array (n,)
        The contour error, mm.
    """

    path: Path
    foot: Array
    offset: Array
    error: Array


class Servo:
    """A machine that follows setpoints piece by piece, and the tally of its errors; the same bits as in one run.

    Parameters
    ----------
    machine : Machine
        Whose axes follow.
    first : Setpoints
        The first ones: they have the axes, the period, and the places of axes that rest.
    path : Path, optional
        The contour error is measured against it, near the commanded points; without it there is none.
    law : TimeLaw, optional
        How far setpoints are off it is measured, too: `off_law`, mm over the linear axes.
    linear : bool, optional
        As `simulation.follow.Follower` takes it.
    keep : Kept, optional
        Keeps the response for `response` and `deviation`: all of it, or the samples with its peaks.

    Attributes
    ----------
    tally : ErrorTally
        The largest errors so far, where, and root mean squares.
    notes : list of str
        What is left out, one sentence each.

    Raises
    ------
    InputError
        For no setpoints, a linear axis of the path that they lack, and an axis that moves and that the machine lacks;
        one that does not move is left out.
    """

    def __init__(
        self, machine: Machine, first: Setpoints, path: Path | None = None, *, law: TimeLaw | None = None,
        linear: bool = False, keep: Kept | None = None,
    ) -> None:  # fmt: skip
        if not len(first):
            raise InputError("no setpoints; at least one is needed")
        moved = first.axes
        axes = tuple(axis for axis in moved if axis in machine.axes)
        if not axes:
            raise InputError(
                f"machine {machine.name!r} has none of the axes {', '.join(moved)}; "
                f"its axes are {', '.join(machine.axes) or 'none, only a control for cycle times'}"
            )
        lacking = [] if path is None else [axis for axis in path.axes[: path.linear] if axis not in moved]
        if lacking:
            raise InputError(f"the path has an axis {lacking[0]}; the setpoints have only {', '.join(moved)}")
        self.machine, self.path, self.law, self.method, self.axes = machine, path, law, first.method, moved
        self.off_law = 0.0
        self.tally = ErrorTally(axes)
        self._keep, self._whole = keep, True
        self._rests = {axis: place for axis, place in zip(moved, first.position[0], strict=True) if axis not in axes}
        self._follower = Follower(machine, axes, first.period, linear=linear)
        self._placer = None if path is None else Placer(path)
        self._meter = None if path is None or not path.linear else ContourMeter(path)
        self.notes = [f"axis {axis} does not move and {machine.name} has none: left out" for axis in self._rests]
        self.notes += [
            f"{axis}: no setpoints; this axis of {machine.name} holds its position"
            for axis in machine.axes
            if axis not in moved
        ]
        self.notes += [
            f"axis {axis} is not on the path: the contour error leaves it out"
            for axis in axes
            if path is not None and axis not in path.axes and axis not in ROTARY_AXES
        ]
        loops = ((axis, margins(machine.servo_axis(axis), first.period)) for axis in axes)
        self.notes += [f"axis {axis}: gains {loop.verdict}" for axis, loop in loops if loop.close or not loop.stable]

    def go_on(self, path: Path, law: TimeLaw) -> None:
        """The next setpoints are on this part of the path, by this law; nothing happens where that is so already."""
        if path is not self.path:
            self.path, self._placer, self._whole = path, Placer(path), False
            self._meter = ContourMeter(path) if path.linear else None
        self.law = law

    @property
    def stopped(self) -> str | None:
        """Why an axis ran away and when, or None."""
        return self._follower.stopped

    @property
    def off_path(self) -> float:
        """How far setpoints without arc length lay from the path at the most, mm, or rad where no axis is linear."""
        return 0.0 if self._placer is None else self._placer.apart

    def follow(self, setpoints: Setpoints, on_path: Setpoints | None = None) -> Response:
        """Follow the next setpoints.

        Parameters
        ----------
        setpoints : Setpoints
            The next ones.
        on_path : Setpoints, optional
            The same with t, s and curve from the start of the part of the path that they lie on, where it is one.

        Returns
        -------
        Response
            Shorter than the setpoints if an axis runs away.

        Raises
        ------
        InputError
            For other axes than the first setpoints have, and for one that moves and that the machine lacks.
        """
        here = on_path or setpoints
        if setpoints.axes != self.axes:
            raise InputError(f"setpoints have axes {', '.join(setpoints.axes)}; expected {', '.join(self.axes)}")
        commanded = dict(zip(self.axes, setpoints.position.T, strict=True))
        for axis, rest in self._rests.items():
            away = float(np.max(np.abs(commanded[axis] - rest), initial=0.0))
            if away != 0.0:
                travel = f"{np.rad2deg(away):.4g} deg" if axis in ROTARY_AXES else f"{away:.4g} mm"
                raise InputError(
                    f"the setpoints move axis {axis} by {travel}, and machine {self.machine.name!r} has no such axis; "
                    f"its axes are {', '.join(self.machine.axes)}"
                )
        axes = self._follower.axes
        response = self._follower.follow(
            setpoints
            if not self._rests
            else replace(setpoints, axes=axes, position=np.column_stack([commanded[axis] for axis in axes]))
        )
        count = len(response)
        more: dict[str, Array] = {}
        s = setpoints.s[:count] if np.isfinite(setpoints.s).all() else None
        ahead = 0.0 if here is setpoints or s is None else s - here.s[:count]
        if self.path is not None and self._placer is not None:
            along = self._placer.place(here)[:count]
            s = self.path.tip_length(along) + ahead
            if self._meter is not None:  # linear axes that the machine lacks are at their setpoints
                sides = {axis: column[:count] for axis, column in commanded.items()}
                sides |= dict(zip(axes, response.position.T, strict=True))
                at = np.column_stack([sides[axis] for axis in self.path.axes[: self.path.linear]])
                found = self._meter.measure(at, s_hint=along)
                response, more = replace(response, contour_error=found.error), {"foot": found.s}
            if self.law is not None:
                wanted = self.path(np.clip(self.law(here.t), 0.0, self.path.length))
                away = np.linalg.norm((setpoints.position - wanted)[:, : self.path.linear], axis=1)
                self.off_law = max(self.off_law, float(np.max(away, initial=0.0)))
        self.tally.see(response, s)
        if self._keep is not None and count:
            errors = {"tracking_error": response.tracking_error, "saturated": response.saturated.astype(np.float64)}
            errors |= {} if response.contour_error is None else {"contour_error": response.contour_error}
            self._keep.see(response.columns | more, errors)
        self._last = response
        return response

    @property
    def response(self) -> Response:
        """The samples of the response that are kept, all or those with its peaks."""
        assert self._keep is not None
        columns: dict[str, Any] = {name: self._keep.column(name) for name in self._last.columns}
        return replace(self._last, **columns) if len(columns["t"]) else self._last

    @cached_property
    def bands(self) -> dict[str, Band]:
        """The bands of the errors over time, by axis, where samples of the response are left out; else empty."""
        return {} if self._keep is None else self._keep.bands()

    def deviation(self) -> Deviation | None:
        """Where the machine was beside the first two linear axes of the path.

        None if one of its linear axes lacks, and where the path came in parts.
        """
        path, response = self.path, self.response
        if path is None or not self._whole or path.linear < 2 or response.contour_error is None:
            return None
        linear = path.axes[: path.linear]
        if any(axis not in response.axes for axis in linear):
            return None
        assert self._keep is not None
        position = response.position[:, [response.axes.index(axis) for axis in linear[:2]]]
        foot = path(np.clip(self._keep.column("foot"), 0.0, path.length))[:, :2]
        return Deviation(path, foot, position - foot, response.contour_error)

    def numbers(self) -> dict[str, Any]:
        """What `--json` prints of one method among others."""
        return {"method": self.method, "setpoints_off_law_mm": self.off_law, **self.tally.numbers()}


def follow(setpoints: Setpoints, machine: Machine | str, *, path: Path | None = None, linear: bool = False) -> Response:
    """Simulate the axes of a machine as they follow setpoints, from rest at the first one.

    Parameters
    ----------
    setpoints : Setpoints
        To be followed.
    machine : Machine or str
        A Machine or its name.
    path : Path, optional
        The contour error is measured against it: the distance over its linear axes from the nearest point near the
        commanded one (`analysis.following`); where the setpoints have no arc length it is found first.
    linear : bool, optional
        Whether friction, backlash, counts, converter codes and limits are left out.

    Returns
    -------
    Response
        Of n ticks, (n, axes): mm, rotary axes rad, V. If an axis runs away it ends there, with the reason in `stopped`.

    Raises
    ------
    InputError
        For no setpoints, ones that are not finite, and axes that machine or setpoints lack (see `Servo`).

    Notes
    -----
    For jobs that do not fit in memory there is `splinefeed.runs.following.follow_chunks`.

    References
    ----------
    .. [1] docs/machines.md has the model.

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.circle(radius=10)
    >>> setpoints = sf.interpolate(path, sf.plan(path, sf.Limits(feed=20, acceleration=200, jerk=5000), period=1e-3))
    >>> response = sf.runs.follow(setpoints, "xytheta", path=path)
    >>> response.stopped is None, 0.0 < response.contour_error_max < 0.1
    (True, True)
    """
    machine = Machine.load(machine) if isinstance(machine, str) else machine
    expect("follow(setpoints, machine)", (setpoints, Setpoints), (machine, Machine))
    return Servo(machine, setpoints, path, linear=linear).follow(setpoints)


def serve(path: Path, law: TimeLaw, setpoints: Setpoints, machine: Machine) -> Servo:
    """Let a machine follow all setpoints of a motion, and keep the response.

    Parameters
    ----------
    path, law : Path, TimeLaw
        The motion.
    setpoints : Setpoints
        Made from them.
    machine : Machine
        That follows.

    Returns
    -------
    Servo
        With the response and its errors.
    """
    servo = Servo(machine, setpoints, path, law=law, keep=Kept())
    servo.follow(setpoints)
    return servo


def follow_chunks(chunks: Iterable[Setpoints], servo: Servo) -> Iterator[Response]:
    """Follow setpoints chunk by chunk, for jobs that do not fit in memory.

    Parameters
    ----------
    chunks : iterable of Setpoints
        That follow each other.
    servo : Servo
        The machine that follows them.

    Yields
    ------
    Response
        To each chunk; the last one is that in which an axis runs away.
    """
    for setpoints in chunks:
        yield servo.follow(setpoints)
        if servo.stopped is not None:
            return
