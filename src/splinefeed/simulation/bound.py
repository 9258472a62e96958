"""A bound on stability margins, and a quick test of many gains on one axis against it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import InputError
from splinefeed.machine.parts import Axis
from splinefeed.records import Array
from splinefeed.simulation.linear import (
    Margins,
    controller_response,
    discrete_plant,
    frequencies,
    read_margins,
    spectral_radius,
)

#: A radius of the poles this far below 1 counts as one unit of slack.
RADIUS_SCALE = 0.01
#: More slack than this counts as this much.
MOST_SLACK = 3.0


@dataclass(frozen=True)
class Bound:
    """Least margins of a loop; all of them must hold, and the loop must be stable.

    gain_margin   factor by which the gain may rise, and fall where a fall can make it unstable; 2 is 6 dB
    phase_margin  deg
    sensitivity   largest |1 / (1 + L)|: 1 / sensitivity is the least distance of L from -1
    Source: docs/tune.md. Example: `sf.simulation.Bound().words`
    """

    gain_margin: float = 2.0
    phase_margin: float = 40.0
    sensitivity: float = 2.0

    def __post_init__(self) -> None:
        for name, least, most in (
            ("gain_margin", 1.0, math.inf),
            ("phase_margin", 0.0, 90.0),
            ("sensitivity", 1.0, math.inf),
        ):
            if not least < getattr(self, name) < most:
                raise InputError(f"{name} is {getattr(self, name)}; it must lie between {least:g} and {most:g}")

    def slacks(self, found: Margins) -> Array:
        """How far margins are within the bound, (5,): 0 or more, in natural logarithms of the ratios.

        Of gain margin, gain reduction, phase margin, sensitivity and poles.
        """
        over = (1.0 - found.spectral_radius) / RADIUS_SCALE
        slacks = (
            math.log(found.gain_margin / self.gain_margin),
            -math.log(found.gain_reduction * self.gain_margin) if found.gain_reduction > 0.0 else MOST_SLACK,
            abs(found.phase_margin) / self.phase_margin - 1.0,
            math.log(self.sensitivity / found.sensitivity),
            over if found.stable else over - RADIUS_SCALE,
        )
        out: Array = np.clip(np.array(slacks), -MOST_SLACK, MOST_SLACK)
        return out

    @property
    def words(self) -> str:
        """The bound in words."""
        return (
            f"gain margin at least {20.0 * math.log10(self.gain_margin):.3g} dB, phase margin at least "
            f"{self.phase_margin:g} deg, sensitivity at most {self.sensitivity:g}"
        )


class BoundTest:
    """The slacks of an axis with other gains, from one frequency response of its plant: half a millisecond each.

    Crossings are straight between the points of the grid, some 1e-4 off; `Bound.slacks` of `margins` is exact.
    """

    def __init__(self, axis: Axis, period: float, bound: Bound) -> None:
        self.period = period
        self.bound = bound
        self._grid = frequencies(period)
        self._plant = discrete_plant(axis, period).response(self._grid)

    def slacks(self, axis: Axis) -> Array:
        """The slacks, (5,), of this axis with any gains; see `Bound.slacks`."""
        forward, back = controller_response(axis.controller, self.period, self._grid)
        loop, radius = back * self._plant, spectral_radius(axis, self.period)
        closed = forward * self._plant / (1.0 + loop)
        return self.bound.slacks(read_margins(self._grid, loop, closed, radius)[0])
