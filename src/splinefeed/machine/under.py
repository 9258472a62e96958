"""A machine under the limits of a file of limits: its axes with those limits, or a machine made of them alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from splinefeed.errors import LimitsError
from splinefeed.machine.control import Control, changed
from splinefeed.machine.machine import Machine
from splinefeed.machine.parts import LIMITS_OF_AXIS, Axis
from splinefeed.records import ROTARY_AXES, Limits, by_name, field_of

#: Limits that are those of a control.
_PATH = ("acceleration", "deceleration", "jerk", "deceleration_jerk", "centripetal", "axis_velocity_step")
#: Axes that a limit for every linear axis is for, where no machine says which it has.
_LINEAR = ("x", "y", "z")


def under(limits: Limits, machine: Machine | None = None, name: str = "limits") -> tuple[Machine, tuple[str, ...]]:
    """Make a machine that keeps limits.

    Parameters
    ----------
    limits : Limits
        Those along the path become those of its control, as do centripetal acceleration and velocity steps at corners.
    machine : Machine, optional
        Whose limits hold where these have none; without it, a machine of the axes that the limits name, or of x, y and
        z where they are for every linear axis.
    name : str, optional
        Of a machine that is made.

    Returns
    -------
    machine : Machine
        With these limits.
    unused : tuple of str
        Names of limits that mean nothing to a machine.

    Raises
    ------
    LimitsError
        For limits in the order of a path's axes.
    """
    base = Machine(name=name, axes={}) if machine is None else machine
    given = {each: value for each in LIMITS_OF_AXIS if (value := getattr(limits, each)) is not None}
    named = {axis for value in given.values() if isinstance(value, Mapping) for axis in value}
    every = any(not isinstance(value, Mapping) for value in given.values())
    for each, value in given.items():
        if isinstance(value, tuple):
            raise LimitsError(f"{each}: is in the order of a path's axes, and there is no path here; name the axes")
    axes, control = dict(base.axes), base.control
    more = [*(_LINEAR if every and not axes else ()), *sorted(named)]
    names = tuple(dict.fromkeys([*axes, *more]))
    tables = {LIMITS_OF_AXIS[each]: by_name(each, value, names) for each, value in given.items()}
    for axis in names:
        new = {key: table[axis] for key, table in tables.items() if axis in table}
        old = axes.get(axis, Axis(name=axis, motion="rotary" if axis in ROTARY_AXES else "linear"))
        axes[axis] = replace(old, limits=replace(old.limits, **new) if new else old.limits)
        if control is not None and axis in control.axes:
            own = {key: value for key, value in new.items() if key in ("acceleration", "jerk")}
            own |= {"rapid": new["velocity"]} if "velocity" in new else {}
            control = replace(control, axes={**control.axes, axis: replace(control.axes[axis], **own)})
    along = _along(limits)
    if along:
        control = changed(control or Control(), along)
    used = {*LIMITS_OF_AXIS, *_PATH}
    unused = [field_of(each) for each, value in limits.as_dict().items() if value and field_of(each) not in used]
    return replace(base, axes=axes, control=control), tuple(dict.fromkeys(unused))


def _along(limits: Limits) -> dict[str, float]:
    """Limits along the path as numbers of a control; the smaller of speeding up and slowing down."""
    step = limits.axis_velocity_step
    steps = [] if step is None else list(step.values()) if isinstance(step, Mapping) else np.atleast_1d(step).tolist()
    found = {
        "acceleration": min(limits.acceleration, limits.deceleration or math.inf),
        "jerk": min(limits.jerk, limits.deceleration_jerk or math.inf),
        "arc_acceleration": limits.centripetal,
        "velocity_step": min(steps, default=None),
    }
    return {name: value for name, value in found.items() if value is not None and math.isfinite(value)}
