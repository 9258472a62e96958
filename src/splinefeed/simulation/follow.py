"""Setpoints through the axes of a machine: commands, positions, measured positions, and control output."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.kernels import mechanics, servo
from splinefeed.machine.machine import Machine
from splinefeed.machine.parts import Axis
from splinefeed.records import Array, Response, Setpoints, check_finite
from splinefeed.simulation import plant as plants

#: Ticks between two calls of `on_progress`.
CHUNK = 65_536
#: Most sub-steps of a period; more would only add rounding.
MOST_SUB_STEPS = 1000

Progress = Callable[[int, int], None]


@dataclass(eq=False)
class _AxisState:
    axis: Axis
    table: Array
    parameters: Array
    memory: Array = field(default_factory=lambda: np.zeros(mechanics.MEMORY))
    scratch: Array = field(default_factory=lambda: np.zeros(mechanics.SCRATCH))


class Follower:
    """A machine that follows setpoints chunk by chunk, in memory that does not grow; the same bits as in one run.

    machine, axes  the machine and the names of the axes that move, in the order of the setpoints
    period       servo period, s
    sub_steps    steps of the nonlinear model in a period; linear: without friction, backlash, counts, codes and limits
    """

    def __init__(
        self,
        machine: Machine,
        axes: tuple[str, ...],
        period: float,
        *,
        sub_steps: int = plants.SUB_STEPS,
        linear: bool = False,
    ) -> None:
        missing = [axis for axis in axes if axis not in machine.axes]
        if missing:
            raise InputError(
                f"machine {machine.name!r} has no axis {', '.join(missing)}; its axes are {', '.join(machine.axes)}"
            )
        if not (np.isfinite(period) and period > 0.0):
            raise InputError(f"period is {period} s; it must be greater than 0 and finite")
        if isinstance(sub_steps, bool) or not isinstance(sub_steps, int) or not 1 <= sub_steps <= MOST_SUB_STEPS:
            raise InputError(f"sub_steps is {sub_steps!r}; it must be a whole number from 1 to {MOST_SUB_STEPS}")
        self.machine = machine
        self.axes = tuple(axes)
        self.period = float(period)
        self.sub_steps = sub_steps
        self.linear = linear
        self.ticks = 0
        self.stopped: str | None = None
        self._states = [
            _AxisState(
                axis,
                plants.step_table(plants.plant(axis), self.period, sub_steps),
                plants.parameters(axis, self.period, sub_steps, linear=linear),
            )
            for axis in (machine.axes[name] for name in self.axes)
        ]

    @property
    def settings(self) -> Mapping[str, Any]:
        """The settings that repeat the response."""
        return {"machine": self.machine.name, "sub_steps": self.sub_steps, "linear": self.linear}

    def follow(self, setpoints: Setpoints) -> Response:
        """The response to the next setpoints; shorter than they are if an axis runs away, and empty from then on."""
        if setpoints.axes != self.axes:
            raise InputError(f"setpoints have axes {', '.join(setpoints.axes)}; expected {', '.join(self.axes)}")
        if setpoints.period != self.period:
            raise InputError(f"setpoints have a period of {setpoints.period} s; expected {self.period} s")
        check_finite(setpoints.position, "Setpoints.position")
        count = 0 if self.stopped is not None else len(setpoints)
        command = np.ascontiguousarray(setpoints.position.T[:, :count])  # (axes, n), one row an axis for the kernel
        found = np.empty((4, *command.shape))  # position, measured, output, saturated
        done = count
        for i, state in enumerate(self._states):
            run_axis = servo.run_axis.for_work(count)
            if self.ticks == 0 and count > 0:
                state.memory[[mechanics.MOTOR, mechanics.LOAD]] = command[i, 0]
            given = (command[i], state.table, state.parameters, state.memory, state.scratch)
            ticks = run_axis(servo.CLOSED, *given, *found[:, i])
            error = abs(command[i, ticks - 1] - found[1, i, ticks - 1]) if ticks else 0.0
            away = not error <= state.axis.controller.error_limit
            if away and (ticks < done or self.stopped is None):
                done = ticks
                self.stopped = _why(state.axis, float(setpoints.t[ticks - 1]), error)
        self.ticks += done
        position, measured, output, saturated = (np.ascontiguousarray(each[:, :done].T) for each in found)
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
            settings=self.settings,
        )


def _why(axis: Axis, time: float, error: float) -> str:
    unit, factor = ("deg", 180.0 / np.pi) if axis.rotary else ("mm", 1.0)
    return (
        f"axis {axis.name} ran away at {time:.6g} s: an error of {error * factor:.4g} {unit} is beyond its limit of "
        f"{axis.controller.error_limit * factor:.4g} {unit}; its loop may be unstable (splinefeed tune), or the feed "
        "too high"
    )


def slices(setpoints: Setpoints, size: int) -> Iterator[Setpoints]:
    """The setpoints in pieces of at most `size` ticks."""
    for start in range(0, len(setpoints), size):
        yield setpoints.part(start, start + size)


def join(parts: Sequence[Response]) -> Response:
    """One response from its pieces in order; the last one says whether it was stopped."""
    if len(parts) == 1:
        return parts[0]
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("t", "command", "position", "measured", "output", "saturated")
    }
    errors = [part.contour_error for part in parts if part.contour_error is not None]
    return replace(
        parts[0],
        **columns,
        contour_error=np.concatenate(errors) if len(errors) == len(parts) else None,
        stopped=parts[-1].stopped,
    )
