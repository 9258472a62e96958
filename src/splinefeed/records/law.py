"""TimeLaw: arc length over time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import InputError
from splinefeed.records import view
from splinefeed.records.arrays import Array, check_finite, frozen_array

#: Number of coefficients of a time-law piece: quintic in t, the highest degree that a strategy makes.
LAW_COEFFICIENTS = 6
#: Instants at which a notebook's view samples the feed.
SAMPLES = 2001


@dataclass(frozen=True, eq=False, kw_only=True)
class TimeLaw:
    """Arc length of the tool along the path over time: s(t), polynomial between breaks.

    breaks        (m+1,)  s, from 0, increasing
    coefficients  (m, 6)  s(t) = sum_k coefficients[i, k] (t - breaks[i])^k  mm, in mm/s^k
    period        servo period that the law was brought to, s; None if it was not
    notes         what the planner had to relax, one sentence each
    settings      what it was planned with, for the records of a run
    Raises InputError for arrays of other shapes, that are not finite, or breaks that do not begin at 0 and increase.
    Source: docs/math/planner.md. Example: `law.feed(np.linspace(0, law.duration, 100))`
    """

    breaks: Array
    coefficients: Array
    strategy: str
    period: float | None = None
    notes: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "breaks", frozen_array(self.breaks, "TimeLaw.breaks", 1))
        object.__setattr__(self, "coefficients", frozen_array(self.coefficients, "TimeLaw.coefficients", 2))
        check_finite(self.breaks, "TimeLaw.breaks")
        check_finite(self.coefficients, "TimeLaw.coefficients")
        if self.coefficients.shape != (len(self.breaks) - 1, LAW_COEFFICIENTS) or len(self.breaks) < 2:
            raise InputError(
                f"TimeLaw: {len(self.breaks)} breaks need coefficients of shape "
                f"({len(self.breaks) - 1}, {LAW_COEFFICIENTS}), got {self.coefficients.shape}"
            )
        if self.breaks[0] != 0.0 or not np.all(np.diff(self.breaks) > 0.0):
            raise InputError("TimeLaw.breaks must begin at 0 and increase")

    @property
    def duration(self) -> float:
        """Time from the first point to the last, s."""
        return float(self.breaks[-1])

    @property
    def length(self) -> float:
        """Arc length at the end of the law, mm."""
        return float(self(self.duration))

    def __call__(self, t: ArrayLike) -> Array:
        """Arc length s(t), mm; t in s, any shape, clamped to [0, duration]."""
        return self._derivative(t, 0)

    def feed(self, t: ArrayLike) -> Array:
        """Feed ds/dt, mm/s; t in s, any shape, clamped to [0, duration]."""
        return self._derivative(t, 1)

    def acceleration(self, t: ArrayLike) -> Array:
        """Tangential acceleration, mm/s^2; t in s, any shape, clamped to [0, duration]."""
        return self._derivative(t, 2)

    def jerk(self, t: ArrayLike) -> Array:
        """Tangential jerk, mm/s^3, from the right at breaks; t in s, any shape, clamped to [0, duration]."""
        return self._derivative(t, 3)

    def __repr__(self) -> str:
        return f"TimeLaw({self.strategy!r}, {self.length:.6g} mm in {self.duration:.6g} s)"

    def _repr_html_(self) -> str:
        feed = self.feed(np.linspace(0.0, self.duration, SAMPLES))
        return view.table({"time law": f"{self!r}"}, view.sparkline(feed, "feed over time"))

    def _derivative(self, t: ArrayLike, order: int) -> Array:
        time = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        piece = np.clip(np.searchsorted(self.breaks, time, side="right") - 1, 0, len(self.coefficients) - 1)
        tau = time - self.breaks[piece]
        value = np.zeros_like(tau)
        for k in range(LAW_COEFFICIENTS - 1, order - 1, -1):  # Horner: planners end a piece at its feed to the bit
            value = value * tau + self.coefficients[piece, k] * float(math.perm(k, order))
        return value


def polynomial(c: Array, tau: Array, order: int) -> list[Array]:
    """sum_k c_k tau^k and its derivatives over k! to `order`, (..., n) each, at tau (..., n); c (n, 6)."""
    out = [c[..., 5] + np.zeros(tau.shape), *(np.zeros(tau.shape) for _ in range(order))]
    for k in range(4, -1, -1):
        for j in range(order, 0, -1):
            out[j] = out[j] * tau + out[j - 1]
        out[0] = out[0] * tau + c[..., k]
    return out
