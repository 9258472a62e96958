"""What all models of controls share: bounds of axes, and speeds that can be reached from block to block."""

from __future__ import annotations

import numpy as np

from splinefeed.machine.control import Control
from splinefeed.machine.machine import Machine
from splinefeed.programs.gcode.moves import AXES, LETTERS
from splinefeed.records import Array


def axis_bounds(control: Control, key: str, machine: Machine | None = None, limit: str = "") -> Array:
    """What the control calls `key` of each axis (9,), else the `limit` of the machine's axis; inf where neither is."""
    bounds = np.full(AXES, np.inf)
    for axis, name in enumerate(LETTERS.lower()):
        value = getattr(control.axes.get(name), key, None)
        if value is None and machine is not None and name in machine.axes:
            value = getattr(machine.axes[name].limits, limit)
        bounds[axis] = np.inf if value is None else value
    return bounds


def reached(energy: Array, gain: Array) -> Array:
    """Squares of speeds at the ends of blocks (n + 1,), lowered to what they may grow by, one behind the other."""
    found = energy.tolist()
    here = found[0]
    for k, more in enumerate(gain.tolist(), 1):
        here += more
        if found[k] > here:
            found[k] = here
        here = found[k]
    return np.array(found)
