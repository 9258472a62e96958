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
    """What the control lets one axis do.

    Parameters
    ----------
    rapid : float, optional
        Velocity, mm/s or rad/s.
    acceleration : float, optional
        mm/s^2 or rad/s^2.
    jerk : float, optional
        mm/s^3 or rad/s^3.
    velocity_step : float, optional
        Largest step of its velocity at a corner, mm/s or rad/s, in place of the control's, for model "marlin".
    """

    rapid: float | None = quantity("velocity", default=None)
    acceleration: float | None = quantity("acceleration", default=None)
    jerk: float | None = quantity("jerk", default=None)
    velocity_step: float | None = quantity("velocity", default=None)


@dataclass(frozen=True, kw_only=True)
class SpindleControl(_Part):
    """How long a program waits for the spindle.

    Parameters
    ----------
    top_speed : float
        rad/s.
    start, stop : float, optional
        From 0 to `top_speed` and back, s.
    growth : str, optional
        "square": the time grows with the square of the speed, "ramp": with the speed.
    """

    top_speed: float = quantity("speed", motor=True)
    start: float = quantity("time", "not negative", 0.0)
    stop: float = quantity("time", "not negative", 0.0)
    growth: str = choice("square", "ramp", default="square")

    def wait(self, full: float, before: float, after: float) -> float:
        """Return the time from one speed to another.

        Parameters
        ----------
        full : float
            What 0 to `top_speed` takes, s.
        before, after : float
            Speeds, rad/s.

        Returns
        -------
        float
            s.
        """
        power = 2 if self.growth == "square" else 1
        return full * abs((after / self.top_speed) ** power - (before / self.top_speed) ** power)


@dataclass(frozen=True, kw_only=True)
class Place(_Part):
    """Places of axes in the coordinates of the program.

    Parameters
    ----------
    x, y, z : float, optional
        mm; None where an axis does not go there.
    """

    x: float | None = quantity("position", "any", None)
    y: float | None = quantity("position", "any", None)
    z: float | None = quantity("position", "any", None)


@dataclass(frozen=True, kw_only=True)
class ControlFit(_Part):
    """How well the numbers of a control are known, from the runs that they were fitted to.

    Parameters
    ----------
    spread : float, optional
        Of times that the fit leaves, as a share: the miss of its own operations, and repeats of a program.
    numbers : sequence of str
        Their names in the file, n of them.
    deviation : sequence of float
        Standard deviation of the logarithm of each, of itself for PLAIN, (n,).
    correlation : sequence of sequences of float
        Of each two of them, (n, n).

    Raises
    ------
    InputError
        For values that do not belong together.
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
    """How a control plans blocks; None means no limit.

    Parameters
    ----------
    model : str, optional
        "general", or the open firmware whose rules hold: one of MODELS.
    mode : str, optional
        "exact stop" stops at the end of each block, "blending" passes corners.
    junction_deviation : float, optional
        Of grbl and Marlin, mm.
    corner_velocity : float, optional
        Klipper's square corner velocity, mm/s.
    cruise_ratio : float, optional
        Klipper's minimum_cruise_ratio.
    arc_tolerance, arc_segment : float, optional
        How arcs are cut as chords: within a distance, or of a length, mm.
    velocity : float, optional
        Along the path, of feed and rapid moves, mm/s.
    acceleration, jerk : float, optional
        Along the path at feed, mm/s^2 and mm/s^3.
    rapid_acceleration, rapid_jerk : float, optional
        At rapid; those at feed if None.
    velocity_step : float, optional
        Largest step of an axis's velocity at a corner that is passed, mm/s.
    tolerance : float, optional
        How far from a corner the path may pass, mm, unless G64 P gives it.
    arc_acceleration : float, optional
        Centripetal acceleration on a radius of 1 mm, mm/s^2.
    arc_growth : float, optional
        That grows with radius^arc_growth.
    arc_kink : float, optional
        An arc whose radii differ by d begins and ends with a turn of arc_kink sqrt(2 d / r).
    stop_time : float, optional
        At each exact stop, s: between rapid and feed, and at markers.
    block_time : float, optional
        Least time of a block at feed, s.
    look_ahead : int, optional
        Blocks in which it must be able to stop; 0 for all.
    tool_change : float, optional
        Time of M6 without its moves, s.
    start_time : float, optional
        From the start button to the first block, s.
    source : str, optional
        Where the numbers are from.
    spindle : SpindleControl, optional
        How long a program waits for it.
    home, change_place : Place, optional
        Where G28 leads, and where tools are changed.
    fit : ControlFit, optional
        How well the numbers are known.
    axes : mapping of str to AxisControl, optional
        What it lets each axis do.

    Notes
    -----
    docs/cycle-time.md has what each number does to the time of a program.
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
    """Return a control with other values.

    Parameters
    ----------
    control : Control
        The old one.
    new : mapping
        Values by their names in the file, such as `spindle.start`.

    Returns
    -------
    Control
        The new one.
    """
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
