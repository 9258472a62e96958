"""Divided differences of setpoints: what a drive sees of velocity, acceleration and jerk."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from splinefeed.records import Array

#: A tick that is early or late by less than this, in periods, is on time.
ON_TIME = 1e-6


def divided(steps: Array, dt: Array, join: Callable[[Array, Array], Array] = np.subtract) -> tuple[Array, Array, Array]:
    """Compute divided differences times k!.

    Parameters
    ----------
    steps : (k, n) array
        mm or rad.
    dt : (n,) array
        What they take, s.
    join : callable, optional
        With np.add, of the rounding of the steps: what that makes of each.

    Returns
    -------
    v, a, j : (k, n), (k, n - 1) and (k, n - 2) array
        mm or rad by s, s^2 and s^3.

    Notes
    -----
    They are

        v = step / dt,  a = 2 (v2 - v1) / (dt1 + dt2),  j = 3 (a2 - a1) / (dt1 + dt2 + dt3)
    """
    with np.errstate(invalid="ignore"):
        v = steps / dt
        a = join(v[:, 1:], v[:, :-1]) / (0.5 * (dt[1:] + dt[:-1]))
        j = join(a[:, 1:], a[:, :-1]) / ((dt[2:] + dt[1:-1] + dt[:-2]) / 3.0)
    return v, a, j
