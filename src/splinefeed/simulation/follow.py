"""Setpoints through the axes of a machine: commands, positions, measured positions, and control output."""

from __future__ import annotations

import numpy as np

from splinefeed.errors import InputError
from splinefeed.kernels import mechanics
from splinefeed.machine.machine import Machine
from splinefeed.machine.parts import ServoAxis
from splinefeed.records import Array, Response, Setpoints
from splinefeed.simulation.plant import parameters, plant, step_table


class AxisRun:
    """Simulate one axis under its controller from rest; the same bits in one run or chunk by chunk.

    Parameters
    ----------
    axis : ServoAxis
        The axis.
    period : float
        Of the servo, s.
    linear : bool, optional
        Whether friction, backlash, counts, codes and limits are left out.
    error_limit : float, optional
        Error at which the axis has run away, mm or rad; by default its own.

    Attributes
    ----------
    ran_away : float or None
        The last error, mm or rad, once it was beyond the limit.
    """

    def __init__(
        self, axis: ServoAxis, period: float, *, linear: bool = False, error_limit: float | None = None
    ) -> None:
        self._table, self._parameters = step_table(plant(axis), period), parameters(axis, period, linear=linear)
        if error_limit is not None:
            self._parameters[mechanics.ERROR_LIMIT] = error_limit
        self._memory, self._scratch = np.zeros(mechanics.MEMORY), np.zeros(mechanics.SCRATCH)
        self._begun = False
        #: The last |error|, mm or rad, once it was beyond the limit: the axis ran away there.
        self.ran_away: float | None = None

    def follow(self, command: Array) -> Array:
        """Simulate the next ticks.

        Parameters
        ----------
        command : (n,) array
            mm or rad.

        Returns
        -------
        (4, m) array
            Position and measured position, mm or rad, output, V, and whether it is at its limit, for m of n ticks:
            fewer if the axis runs away.
        """
        if not self._begun and len(command):
            self._memory[[mechanics.MOTOR, mechanics.LOAD]] = command[0]
            self._begun = True
        found, run = np.empty((4, len(command))), mechanics.run_axis.for_work(len(command))
        done = run(command, self._table, self._parameters, self._memory, self._scratch, *found)
        if done:
            error = abs(command[done - 1] - found[1, done - 1])
            self.ran_away = None if error <= self._parameters[mechanics.ERROR_LIMIT] else float(error)
        return found[:, :done]


class Follower:
    """Simulate a machine that follows setpoints chunk by chunk; the same bits as in one run.

    Parameters
    ----------
    machine : Machine
        The machine.
    axes : tuple of str
        Names of the axes that move, in the order of the setpoints.
    period : float
        Of the servo, s.
    linear : bool, optional
        Whether friction, backlash, counts, codes and limits are left out.

    Attributes
    ----------
    stopped : str or None
        Which axis ran away, and when, in a sentence.

    Raises
    ------
    InputError
        For an axis that the machine does not have or knows the limits of alone, and a period that is none.
    """

    def __init__(self, machine: Machine, axes: tuple[str, ...], period: float, *, linear: bool = False) -> None:
        missing = [axis for axis in axes if axis not in machine.axes]
        if missing:
            raise InputError(
                f"machine {machine.name!r} has no axis {', '.join(missing)}; its axes are {', '.join(machine.axes)}"
            )
        if not (np.isfinite(period) and period > 0.0):
            raise InputError(f"period is {period} s; it must be greater than 0 and finite")
        self.axes, self.period = tuple(axes), float(period)
        self.stopped: str | None = None
        self._settings = {"machine": machine.name, "linear": linear}
        followed = [machine.servo_axis(name) for name in axes]
        self._runs = [(axis, AxisRun(axis, period, linear=linear)) for axis in followed]

    def follow(self, setpoints: Setpoints) -> Response:
        """Simulate the next setpoints.

        Parameters
        ----------
        setpoints : Setpoints
            Of these axes at this period.

        Returns
        -------
        Response
            Shorter than the setpoints if an axis runs away, and empty from then on.

        Raises
        ------
        InputError
            For other axes or another period, and positions that are not finite.
        """
        if setpoints.axes != self.axes:
            raise InputError(f"setpoints have axes {', '.join(setpoints.axes)}; expected {', '.join(self.axes)}")
        if setpoints.period != self.period:
            raise InputError(f"setpoints have a period of {setpoints.period} s; expected {self.period} s")
        finite = np.isfinite(setpoints.position)
        if not finite.all():
            tick, column = np.unravel_index(int(np.argmin(finite)), finite.shape)
            value, when = setpoints.position[tick, column], setpoints.t[tick]
            raise InputError(f"at t = {when:.9g} s axis {self.axes[column]} is {value}; expected a finite number")
        count = len(setpoints) if self.stopped is None else 0
        command = np.ascontiguousarray(setpoints.position[:count].T)  # one row an axis for the kernel
        found = [run.follow(each) for (_, run), each in zip(self._runs, command, strict=True)]
        done = min(each.shape[1] for each in found)
        for (axis, run), each in zip(self._runs, found, strict=True):
            if run.ran_away is not None and each.shape[1] == done and self.stopped is None:
                self.stopped = _why(axis, float(setpoints.t[done - 1]), run.ran_away)
        position, measured, output, saturated = np.stack([each[:, :done] for each in found], axis=-1)
        return Response(
            t=setpoints.t[:done].copy(),
            command=setpoints.position[:done].copy(),
            position=position,
            measured=measured,
            output=output,
            saturated=saturated != 0.0,
            axes=self.axes,
            period=self.period,
            stopped=self.stopped,
            settings=self._settings,
        )


def _why(axis: ServoAxis, time: float, error: float) -> str:
    unit, factor = ("deg", 180.0 / np.pi) if axis.rotary else ("mm", 1.0)
    return (
        f"axis {axis.name} ran away at {time:.6g} s: an error of {error * factor:.4g} {unit} is beyond its limit of "
        f"{axis.controller.error_limit * factor:.4g} {unit}; its loop may be unstable (splinefeed tune), or the feed "
        "too high"
    )
