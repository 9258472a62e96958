"""Setpoints as a PVT table: for every step how long it takes, how far each axis goes, and how fast it is at its end.

The form is that of Newport's XPS controllers, which PVT interpreters of other makers take with little or no change:
one line a step, `dt, dx, vx, dy, vy, ...`, nothing else in the file. dt in s; dx the way from the tick before, vx the
velocity at the end of the step, in mm and mm/s, rotary axes in degrees and degrees/s. The table starts where the first
tick is, at rest or with the velocity that the planned feed has there.

The velocity is the derivative of the polynomial of degree 4 through five neighbouring ticks, with an error of
T^4 q^(5) / 30 at most in the middle, and 0 where the planned feed is 0. Source of the weights: Fornberg, Math. Comp. 51
(1988), 699-706, doi:10.1090/S0025-5718-1988-0935077-0, here by Lagrange's formula.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from splinefeed.errors import InputError
from splinefeed.formats.metadata import write_rows
from splinefeed.records import Array, IntArray, Setpoints

#: Ticks that one velocity is taken from.
STENCIL = 5
#: Steps that are worked on at once.
_STEPS = 2**16


def write(points: Setpoints, file: Path) -> None:
    """Write the steps between setpoints; InputError for fewer than two, or ticks that do not follow each other."""
    if len(points) < 2:
        raise InputError("one tick is no step; a PVT table needs at least two ticks")
    if not np.all(np.diff(points.t) > 0.0):
        raise InputError("t does not grow from tick to tick; a PVT table needs steps longer than 0")
    with file.open("w", encoding="ascii", newline="\n") as stream:
        for start in range(1, len(points), _STEPS):
            places = np.arange(start, min(start + _STEPS, len(points)))
            way = points.position[places] - points.position[places - 1]
            pairs = np.stack([way, _velocity(points, places)], axis=2).reshape(len(places), -1)
            write_rows(stream, [points.t[places] - points.t[places - 1], *pairs.T], ", ")


def _velocity(ticks: Setpoints, places: IntArray) -> Array:
    """Velocity (n, axes) at the ticks `places` (n,): sum_j q_j L_j'(t) over the nearest STENCIL ticks."""
    count = min(STENCIL, len(ticks.t))
    left = np.clip(places - count // 2, 0, len(ticks.t) - count)
    index = left[:, None] + np.arange(count)
    t = ticks.t[index]  # (n, count)
    # about the tick itself, so that the differences of positions keep their digits
    position = ticks.position[index] - ticks.position[places][:, None]
    at = ticks.t[places]
    weights = np.zeros_like(t)
    for j in range(count):
        others = [m for m in range(count) if m != j]
        denominator = np.prod(t[:, [j]] - t[:, others], axis=1)
        for left_out in others:
            rest = [m for m in others if m != left_out]
            weights[:, j] += np.prod(at[:, None] - t[:, rest], axis=1) / denominator
    velocity: Array = np.einsum("nj,nja->na", weights, position)
    velocity[ticks.feed[places] == 0.0] = 0.0  # q' = (dq/ds) feed
    return velocity
