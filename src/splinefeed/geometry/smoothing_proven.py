"""Smoothing that is proven afterwards, and repeated with a smaller tolerance where new self-crossings appear."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from splinefeed.errors import CurveError
from splinefeed.geometry.path import Path
from splinefeed.geometry.smoothing_order import Order, order
from splinefeed.geometry.smoothing_stream import ANGULAR_TOLERANCE, PROGRAM, UNBOUNDED_TOLERANCE
from splinefeed.records import Array

#: The proof gives the distance from the original to this share of the tolerance.
PRECISION = 0.02
#: Rounds of smoothing more closely, each with half the tolerance, before the curves concerned stay exact.
ROUNDS = 6


@dataclass(frozen=True, eq=False)
class Proof:
    """The proof of a smoothed path, by means that the smoothing does not share.

    path        the result, with its findings
    order       how far both are apart when they are traversed side by side, and which self-crossings are new
    tolerance   mm, the largest that was allowed; angular_tolerance  rad
    closer      curves of the original that were smoothed with less, so that there is no new self-crossing
    """

    path: Path
    order: Order
    tolerance: float
    angular_tolerance: float
    closer: int

    @property
    def holds(self) -> bool:
        """Whether every distance is within its tolerance, in order, and no crossing is new."""
        most = (1.0 + PRECISION) * self.tolerance
        turned = self.order.largest_angle <= (1.0 + PRECISION) * self.angular_tolerance
        return self.order.largest <= most and turned and not len(self.order.crossings)

    @property
    def sentence(self) -> str:
        """The proof as a sentence, for findings."""
        found = (
            f"at most {self.order.largest:.4g} mm from the original, both ways, side by side in the same order "
            f"(tolerance {self.tolerance:g} mm)"
        )
        if self.path.linear < len(self.path.axes):
            found += f" and {math.degrees(self.order.largest_angle):.4g} deg"
        found += ", and no new self-crossing" if not len(self.order.crossings) else (
            f", and {len(self.order.crossings)} place(s) where it crosses itself and the original does not, "
            f"the first at {self.order.crossings[0, 0]:.6g} mm"
        )  # fmt: skip
        if self.order.unclear:
            found += f" ({self.order.unclear} place(s) too small to tell)"
        if self.closer:
            found += f"; {self.closer} curve(s) smoothed with less for that"
        return found


def proven(
    path: Path, tolerance: float | str, *, angular_tolerance: float = ANGULAR_TOLERANCE, **how: float | str
) -> Proof:
    """The path smoothed as by `smoothed`, with the same arguments, and the proof of it.

    Where the original nearly touches itself, a result within the tolerance may cross itself: there it is smoothed again
    with half the tolerance, and finally not smoothed.
    Raises CurveError if it is over its tolerance nevertheless, which is not known to happen, and InputError as
    `smoothed`.
    """
    from splinefeed.geometry.smoothing import smoothed

    share, largest = np.ones(len(path.flat)), _largest(path, tolerance)
    for attempt in range(ROUNDS + 2):
        result = smoothed(path, tolerance, angular_tolerance=angular_tolerance, share=share, **how)  # type: ignore[arg-type]
        if result is path:
            zeros = np.zeros(len(share))
            same = Order(zeros, zeros, np.empty((0, 2)), np.empty((0, 2), dtype=np.int64), 0)
            return Proof(path, same, largest, angular_tolerance, 0)
        found = order(path, result, largest, angular_tolerance, PRECISION)
        if not len(found.crossings) or attempt > ROUNDS:
            break
        closer = np.zeros(len(share), dtype=bool)
        for low, high in found.concerned:
            closer[low : high + 1] = True
        share[closer] *= 0.5 if attempt < ROUNDS else 0.0
    proof = Proof(result, found, largest, angular_tolerance, int(np.count_nonzero(share < 1.0)))
    if not proof.holds and not len(found.crossings):
        raise CurveError(f"{path.name}: smoothed, but {proof.sentence}; please report it")
    return replace(proof, path=result.with_findings(*result.findings, proof.sentence))


def _largest(path: Path, tolerance: float | str) -> float:
    """The largest tolerance of any curve, mm."""
    if tolerance != PROGRAM:
        return float(tolerance)
    if path.tolerances is None or not path.tolerances.any():
        return UNBOUNDED_TOLERANCE
    said: Array = np.where(np.isfinite(path.tolerances), path.tolerances, UNBOUNDED_TOLERANCE)
    return float(said.max())
