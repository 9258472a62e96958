"""Setpoints through a machine, with the contour error where the path is known; in pieces, in memory that stays flat."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from splinefeed.analysis.contour import ContourMeter
from splinefeed.analysis.place import Placer
from splinefeed.analysis.tally import ErrorTally
from splinefeed.errors import InputError, expect
from splinefeed.geometry.path import Path
from splinefeed.machine.machine import Machine
from splinefeed.records import ROTARY_AXES, Array, Response, Setpoints, TimeLaw
from splinefeed.simulation.follow import CHUNK, Follower, Progress, join, slices
from splinefeed.simulation.linear import margins
from splinefeed.simulation.plant import SUB_STEPS


@dataclass(frozen=True, eq=False)
class Served:
    """Setpoints of one method, the machine's response, the tally of its errors, and what was left out.

    off_law  largest distance of a setpoint from where the law wants it, mm over the linear axes
    """

    setpoints: Setpoints
    response: Response
    tally: ErrorTally
    notes: tuple[str, ...]
    off_law: float

    def numbers(self) -> dict[str, Any]:
        """What `--json` prints."""
        return {"method": self.setpoints.method, "setpoints_off_law_mm": self.off_law, **self.tally.numbers()}


class Servo:
    """A machine that follows setpoints piece by piece, and the tally of its errors; the same bits as in one run.

    path     the contour error is measured against it, near the commanded points; without it there is none
    law      how far setpoints are off it along the path is measured, too
    tally    the largest errors so far, where, and root mean squares; `stopped` says why it ended early, or None
    notes    what is left out, one sentence each
    sub_steps, linear  as `simulation.follow.Follower` takes them

    An axis of the setpoints that the machine lacks is left out as long as it does not move; one that moves is an
    InputError, and so is a linear axis of the path that the setpoints lack.
    """

    def __init__(
        self, machine: Machine, path: Path | None = None, *, law: TimeLaw | None = None, sub_steps: int = SUB_STEPS,
        linear: bool = False,
    ) -> None:  # fmt: skip
        self.machine, self.path, self.law = machine, path, law
        self.notes: list[str] = []
        self._options: dict[str, Any] = {"sub_steps": sub_steps, "linear": linear}
        self._follower: Follower | None = None
        self._tally: ErrorTally | None = None
        self._axes: tuple[str, ...] = ()
        self._rests: dict[str, float] = {}
        self._meter = None if path is None or not path.linear else ContourMeter(path)
        self._placer = None if path is None else Placer(path)
        self._off_law = 0.0
        #: Commanded arc length of the ticks followed last, mm; empty where it is not known.
        self.commanded: Array = np.zeros(0)

    @property
    def tally(self) -> ErrorTally:
        """The errors of all that was followed so far; InputError before the first setpoints."""
        if self._tally is None:
            raise InputError("no setpoints; at least one is needed")
        return self._tally

    @property
    def stopped(self) -> str | None:
        """Why an axis ran away and when, or None."""
        return None if self._follower is None else self._follower.stopped

    @property
    def off_path(self) -> float:
        """How far setpoints without arc length lay from the path at the most, mm."""
        return 0.0 if self._placer is None else self._placer.apart

    def follow(self, setpoints: Setpoints) -> Response:
        """The response to the next setpoints; shorter than they are if an axis runs away."""
        finite = np.isfinite(setpoints.position)
        if not finite.all():
            tick, column = (int(k) for k in np.unravel_index(int(np.argmin(finite)), finite.shape))
            axis, value = setpoints.axes[column], setpoints.position[tick, column]
            raise InputError(f"at t = {setpoints.t[tick]:.9g} s axis {axis} is {value}; expected a finite number")
        if self._follower is None or self._tally is None:
            self._begin(setpoints)
        assert self._follower is not None
        assert self._tally is not None
        if setpoints.axes != self._axes:
            raise InputError(f"setpoints have axes {', '.join(setpoints.axes)}; expected {', '.join(self._axes)}")
        self._check_rests(setpoints)
        moved = setpoints
        if self._rests:
            kept = [setpoints.axes.index(axis) for axis in self._follower.axes]
            moved = replace(setpoints, axes=self._follower.axes, position=setpoints.position[:, kept])
        response = self._follower.follow(moved)
        s = None
        if self._placer is not None:
            s = self._placer.place(setpoints)[: len(response)]
            if self._meter is not None:
                found = self._meter.measure(self._position(response, setpoints), s_hint=s)
                response = replace(response, contour_error=found.error)
        elif np.isfinite(setpoints.s).all():
            s = setpoints.s[: len(response)]
        self.commanded = np.zeros(0) if s is None else s
        if self.law is not None and self.path is not None:
            wanted = self.path(np.clip(self.law(setpoints.t), 0.0, self.path.length))
            away = np.linalg.norm((setpoints.position - wanted)[:, : self.path.linear], axis=1)
            self._off_law = max(self._off_law, float(np.max(away, initial=0.0)))
        self._tally.see(response, s)
        return response

    def served(self, setpoints: Setpoints, response: Response) -> Served:
        """The result, with the setpoints and the response that are kept."""
        return Served(setpoints, response, self.tally, tuple(self.notes), self._off_law)

    def _begin(self, setpoints: Setpoints) -> None:
        machine, path, moved = self.machine, self.path, setpoints.axes
        axes = tuple(axis for axis in moved if axis in machine.axes)
        self._axes = moved
        self._rests = {a: float(setpoints.position[0, i]) for i, a in enumerate(moved) if a not in axes}
        if not axes:
            raise InputError(
                f"machine {machine.name!r} has none of the axes {', '.join(moved)}; "
                f"its axes are {', '.join(machine.axes) or 'none, only a control for cycle times'}"
            )
        lacking = [] if path is None else [axis for axis in path.axes[: path.linear] if axis not in moved]
        if lacking:
            raise InputError(f"the path has an axis {lacking[0]}; the setpoints have only {', '.join(moved)}")
        self.notes += [f"axis {axis} does not move and {machine.name} has none: left out" for axis in self._rests]
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
        for axis in axes:
            found = margins(machine.axes[axis], setpoints.period)
            if found.close or not found.stable:
                self.notes.append(f"axis {axis}: gains {found.verdict}")
        self._follower = Follower(machine, axes, setpoints.period, **self._options)
        self._tally = ErrorTally(axes, setpoints.period)

    def _check_rests(self, setpoints: Setpoints) -> None:
        for axis, rest in self._rests.items():
            away = float(np.max(np.abs(setpoints.position[:, setpoints.axes.index(axis)] - rest), initial=0.0))
            if away > 0.0:
                travel = f"{np.rad2deg(away):.4g} deg" if axis in ROTARY_AXES else f"{away:.4g} mm"
                raise InputError(
                    f"the setpoints move axis {axis} by {travel}, and machine {self.machine.name!r} has no such axis; "
                    f"its axes are {', '.join(self.machine.axes)}"
                )

    def _position(self, response: Response, setpoints: Setpoints) -> Array:
        """Where the linear axes of the path were, (n, linear); those that the machine lacks are at their setpoints."""
        assert self.path is not None
        sides = {axis: setpoints.position[: len(response), i] for i, axis in enumerate(setpoints.axes)}
        sides |= {axis: response.position[:, i] for i, axis in enumerate(response.axes)}
        return np.column_stack([sides[axis] for axis in self.path.axes[: self.path.linear]])


def follow(
    setpoints: Setpoints, machine: Machine | str, *, path: Path | None = None, on_progress: Progress | None = None,
    sub_steps: int = SUB_STEPS, linear: bool = False,
) -> Response:  # fmt: skip
    """Simulate the axes of `machine` as they follow `setpoints`, from rest at the first one.

    machine  a Machine or its name
    path  the contour error is measured against it: the distance over its linear axes from the nearest point near the
          commanded one (`analysis.contour`); where the setpoints have no arc length it is found first
    on_progress(done, total) is called from time to time; sub_steps, linear: see `simulation.follow.Follower`

    If an axis runs away the response ends there, with the reason in `stopped`. Raises InputError for no setpoints, ones
    that are not finite, and axes that machine or setpoints lack (see `Servo`). For jobs that do not fit in memory there
    is `follow_chunks`.
    Returns a Response of n ticks, (n, axes): mm, rotary axes rad, V. Source: docs/machines.md has the model.
    Example: `sf.follow(setpoints, machine, path=path).tracking_error`
    """
    machine = Machine.load(machine) if isinstance(machine, str) else machine
    expect("follow(setpoints, machine)", (setpoints, Setpoints), (machine, Machine))
    servo = Servo(machine, path, sub_steps=sub_steps, linear=linear)
    parts: list[Response] = []
    done = 0
    for response in follow_chunks(slices(setpoints, CHUNK), servo):
        parts.append(response)
        done += len(response)
        if on_progress is not None:
            on_progress(done, len(setpoints))
    if not parts:
        raise InputError("no setpoints; at least one is needed")
    return join(parts)


def serve(path: Path, law: TimeLaw, setpoints: Setpoints, machine: Machine) -> Served:
    """Let the axes of `machine` follow all setpoints of a motion along `path`."""
    servo = Servo(machine, path, law=law)
    return servo.served(setpoints, servo.follow(setpoints))


def follow_chunks(chunks: Iterable[Setpoints], servo: Servo) -> Iterator[Response]:
    """The response piece by piece, for jobs that do not fit in memory; ends with the piece that has a run-away."""
    for setpoints in chunks:
        yield servo.follow(setpoints)
        if servo.stopped is not None:
            return
