"""A bound on stability margins, and a quick test of many gains on one axis against it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import InputError
from splinefeed.machine.parts import Axis
from splinefeed.records import Array
from splinefeed.simulation.linear import (
    GRID,
    LOWEST_SHARE,
    ComplexArray,
    Margins,
    controller_response,
    discrete_plant,
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
        for name, value, least in (
            ("gain_margin", self.gain_margin, 1.0),
            ("phase_margin", self.phase_margin, 0.0),
            ("sensitivity", self.sensitivity, 1.0),
        ):
            if not (math.isfinite(value) and value > least):
                raise InputError(f"{name} is {value}; it must be greater than {least:g} and finite")
        if self.phase_margin >= 90.0:
            raise InputError(f"phase_margin is {self.phase_margin:g} deg; it must be less than 90")

    def slack(self, margins: Margins) -> float:
        """How far margins are within the bound: 0 or more if they are, in natural logarithms of the ratios."""
        found = (margins.gain_margin, margins.gain_reduction, margins.phase_margin, margins.sensitivity)
        return float(np.min(self.slacks(*found, margins.spectral_radius)))

    def slacks(self, gain: float, reduction: float, phase: float, sensitivity: float, radius: float) -> Array:
        """The five slacks, (5,): gain margin, gain reduction, phase margin, sensitivity, poles."""
        found = (
            math.log(gain / self.gain_margin) if math.isfinite(gain) else MOST_SLACK,
            -math.log(reduction * self.gain_margin) if reduction > 0.0 else MOST_SLACK,
            phase / self.phase_margin - 1.0 if math.isfinite(phase) else MOST_SLACK,
            math.log(self.sensitivity / sensitivity),
            (1.0 - radius) / RADIUS_SCALE if radius < 1.0 else (1.0 - radius) / RADIUS_SCALE - RADIUS_SCALE,
        )
        out: Array = np.clip(np.array(found), -MOST_SLACK, MOST_SLACK)
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

    Crossings are straight between the points of the grid, some 1e-4 off; `Bound.slack` of `margins` is exact.
    """

    def __init__(self, axis: Axis, period: float, bound: Bound) -> None:
        self.period = period
        self.bound = bound
        top = math.pi / period
        self._grid = np.geomspace(LOWEST_SHARE * top, top * (1.0 - 1e-9), GRID)
        self._plant = discrete_plant(axis, period).response(self._grid)

    def slacks(self, axis: Axis) -> Array:
        """The slacks, (5,), of this axis with any gains; see `Bound.slacks`."""
        loop = controller_response(axis.controller, self.period, self._grid)[1] * self._plant
        return self.bound.slacks(*grid_margins(loop), spectral_radius(axis, self.period))


def grid_margins(loop: ComplexArray) -> tuple[float, float, float, float]:
    """Gain margin, gain reduction, phase margin in deg, and sensitivity of a loop over a fine grid of frequencies."""
    imaginary = loop.imag
    at = np.flatnonzero((imaginary[:-1] < 0.0) != (imaginary[1:] < 0.0))  # also where one of them is 0
    share = imaginary[at] / (imaginary[at] - imaginary[at + 1])
    real = loop.real[at] + share * (loop.real[at + 1] - loop.real[at])
    factors = -1.0 / np.append(real[real < 0.0], min(loop.real[-1], -1e-300))
    excess = np.abs(loop) - 1.0
    at = np.flatnonzero((excess[:-1] < 0.0) != (excess[1:] < 0.0))
    share = excess[at] / (excess[at] - excess[at + 1])
    phases = np.degrees(np.abs(np.angle(-(loop[at] + share * (loop[at + 1] - loop[at])))))
    return (
        float(np.min(factors[factors > 1.0], initial=np.inf)),
        float(np.max(factors[factors < 1.0], initial=0.0)),
        float(np.min(phases, initial=np.inf)),
        float(1.0 / np.min(np.abs(1.0 + loop))),
    )
