"""How a machine's control plans a program: speeds, accelerations, corners, stops, tool changes and spindle waits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from splinefeed.errors import InputError
from splinefeed.machine.parts import _finite, _Part, choice, count, listed, number, part, quantity, words

#: How a control is modelled: in general, fitted to runs, or by the published rules of open firmware.
MODELS = ("general", "grbl", "klipper", "linuxcnc", "marlin")


@dataclass(frozen=True, kw_only=True)
class AxisControl(_Part):
    """What the control lets one axis do: rapid velocity mm/s, acceleration mm/s^2, jerk mm/s^3 (rad on rotary axes).

    velocity_step  largest step of its velocity at a corner, mm/s, in place of the control's, for model "marlin"
    """

    rapid: float | None = quantity("velocity", default=None)
    acceleration: float | None = quantity("acceleration", default=None)
    jerk: float | None = quantity("jerk", default=None)
    velocity_step: float | None = quantity("velocity", default=None)


@dataclass(frozen=True, kw_only=True)
class SpindleControl(_Part):
    """How long a program waits for the spindle.

    start, stop  s from 0 to `top_speed` and back; growth "square": with the square of the speed, "ramp": with the speed
    """

    top_speed: float = quantity("speed", motor=True)
    start: float = quantity("time", "not negative", 0.0)
    stop: float = quantity("time", "not negative", 0.0)
    growth: str = choice("square", "ramp", default="square")

    def wait(self, full: float, before: float, after: float) -> float:
        """Seconds from one speed to another, rad/s, where `full` is what 0 to `top_speed` takes."""
        power = 2 if self.growth == "square" else 1
        return full * abs((after / self.top_speed) ** power - (before / self.top_speed) ** power)


@dataclass(frozen=True, kw_only=True)
class Place(_Part):
    """Places of axes in the coordinates of the program, mm; None where an axis does not go there."""

    x: float | None = quantity("position", "any", None)
    y: float | None = quantity("position", "any", None)
    z: float | None = quantity("position", "any", None)


@dataclass(frozen=True, kw_only=True)
class ControlFit(_Part):
    """How well the numbers of a control are known, from the runs that they were fitted to.

    spread       of times that the fit leaves, as a share: the miss of its own operations, and repeats of a program
    numbers      their names in the file; deviation  standard deviation of the logarithm of each, of itself for PLAIN
    correlation  of each two of them, a row each
    """

    spread: float = number("not negative", 0.0)
    numbers: Sequence[str] = listed("must be a list of names", lambda each: isinstance(each, str))
    deviation: Sequence[float] = listed("must be a list of numbers", _finite)
    correlation: Sequence[Sequence[float]] = listed(
        "must be a list of rows", lambda row: isinstance(row, list | tuple) and all(map(_finite, row))
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        count = len(self.numbers)
        if len(self.deviation) != count or [len(row) for row in self.correlation] != [count] * count:
            raise InputError("control.fit: numbers, deviation and correlation must be of one length")


#: A tolerance, mm, that is none: LinuxCNC's G64 without P blends corners as far as blocks allow.
WIDE = 1000.0
#: Numbers of a control that may be 0 or negative: fitted, and uncertain, as they are; all others by their logarithm.
PLAIN = ("arc_growth", "home.x", "home.y", "home.z", "change_place.x", "change_place.y", "change_place.z")


@dataclass(frozen=True, kw_only=True)
class Control(_Part):
    """How a control plans blocks; None means no limit. mm, s.

    model                 "general", or the open firmware whose rules hold: MODELS
    junction_deviation    of grbl and Marlin, mm; corner_velocity  Klipper's square corner velocity, mm/s
    cruise_ratio          Klipper's minimum_cruise_ratio; arc_tolerance, arc_segment  how arcs are cut as chords: within
                          a distance, or of a length, mm
    velocity              along the path, of feed and rapid moves
    mode                  "exact stop" stops at the end of each block, "blending" passes corners
    acceleration, jerk    along the path at feed; rapid_acceleration, rapid_jerk at rapid, those at feed if None
    velocity_step         largest step of an axis's velocity at a corner that is passed
    tolerance             how far from a corner the path may pass, unless G64 P gives it
    arc_acceleration      centripetal acceleration on a radius of 1 mm; it grows with radius^arc_growth
    arc_kink              an arc whose radii differ by d begins and ends with a turn of arc_kink sqrt(2 d / r)
    stop_time             at each exact stop: between rapid and feed, and at markers
    block_time            least time of a block at feed; look_ahead  blocks in which it must be able to stop (0: all)
    tool_change           time of M6 without its moves; start_time  from the start button to the first block
    home, change_place    where G28 leads, and where tools are changed
    """

    model: str = choice(*MODELS, default="general")
    mode: str = choice("exact stop", "blending", default="blending")
    junction_deviation: float | None = quantity("position", "not negative", None)
    corner_velocity: float | None = quantity("velocity", "not negative", None)
    cruise_ratio: float = number("not negative", 0.0)
    arc_tolerance: float | None = quantity("position", default=None)
    arc_segment: float | None = quantity("position", default=None)
    velocity: float | None = quantity("velocity", default=None)
    acceleration: float | None = quantity("acceleration", default=None)
    jerk: float | None = quantity("jerk", default=None)
    rapid_acceleration: float | None = quantity("acceleration", default=None)
    rapid_jerk: float | None = quantity("jerk", default=None)
    velocity_step: float | None = quantity("velocity", default=None)
    tolerance: float | None = quantity("position", "not negative", None)
    arc_acceleration: float | None = quantity("acceleration", default=None)
    arc_growth: float = number("any", 0.0)
    arc_kink: float = number("not negative", 0.0)
    stop_time: float = quantity("time", "not negative", 0.0)
    block_time: float = quantity("time", "not negative", 0.0)
    look_ahead: int = count(0, 1_000_000, 0)
    tool_change: float = quantity("time", "not negative", 0.0)
    start_time: float = quantity("time", "not negative", 0.0)
    source: str = words()
    spindle: SpindleControl | None = field(default=None, metadata=part(SpindleControl))
    home: Place = field(default_factory=Place, metadata=part(Place))
    change_place: Place = field(default_factory=Place, metadata=part(Place))
    fit: ControlFit | None = field(default=None, metadata=part(ControlFit))
    axes: Mapping[str, AxisControl] = field(default_factory=dict, metadata=part(AxisControl, "axis"))

    @property
    def passing(self) -> str:
        """How it passes corners, in words; empty where it stops at them."""
        if self.mode == "exact stop":
            return ""
        if self.model == "linuxcnc":
            wide = self.tolerance is not None and self.tolerance >= WIDE
            return "G64" if wide else f"G64 P{self.tolerance:g}" if self.tolerance else ""
        if self.model != "general":
            return f"by the rules of {self.model}"
        step = None if self.velocity_step is None else f"velocity steps of {self.velocity_step:.4g} mm/s"
        return step or (f"within {self.tolerance:.4g} mm" if self.tolerance else "")


def changed(control: Control, new: Mapping[str, Any]) -> Control:
    """`control` with other values, by their names in the file."""
    for name, value in new.items():
        section, _, key = name.rpartition(".")
        if not section:
            control = replace(control, **{key: value})
        elif section.startswith("axis."):
            axis = section.removeprefix("axis.")
            one = replace(control.axes.get(axis, AxisControl()), **{key: value})
            control = replace(control, axes={**control.axes, axis: one})
        else:
            control = replace(control, **{section: replace(getattr(control, section), **{key: value})})
    return control
