"""What all models of controls share: bounds of axes, and speeds that can be reached from block to block."""

from __future__ import annotations

import numpy as np

from splinefeed.machine.control import Control
from splinefeed.machine.machine import Machine
from splinefeed.programs.gcode.moves import AXES, LETTERS
from splinefeed.records import Array


def axis_bounds(control: Control, key: str, machine: Machine | None = None, limit: str = "") -> Array:
    """Gather what a control, or else the machine, says of each axis.

    Parameters
    ----------
    control : Control
        Whose word counts.
    key : str
        What it calls the bound.
    machine : Machine, optional
        Whose axes count where the control says nothing.
    limit : str, optional
        What the machine calls the bound.

    Returns
    -------
    array (9,)
        mm or rad, and s; inf where neither says it.
    """
    bounds = np.full(AXES, np.inf)
    for axis, name in enumerate(LETTERS.lower()):
        value = getattr(control.axes.get(name), key, None)
        if value is None and machine is not None and name in machine.axes:
            value = getattr(machine.axes[name].limits, limit)
        bounds[axis] = np.inf if value is None else value
    return bounds


def reached(energy: Array, gain: Array) -> Array:
    """Lower squares of speeds to what can be reached from block to block.

    Parameters
    ----------
    energy : array (n + 1,)
        Squares of speeds at the ends of blocks.
    gain : array (n,)
        What they may grow by.

    Returns
    -------
    array (n + 1,)
        At most `energy`, each at most the one before plus `gain`.
    """
    found = energy.tolist()
    here = found[0]
    for k, more in enumerate(gain.tolist(), 1):
        here += more
        if found[k] > here:
            found[k] = here
        here = found[k]
    return np.array(found)
