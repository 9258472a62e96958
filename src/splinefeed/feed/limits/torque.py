"""The torque of each joint, by a rigid-body model."""

from collections.abc import Iterator

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.feed.limits.rows import Linear, Places, Row
from splinefeed.feed.numbers import ALMOST
from splinefeed.records import Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """|a q'/2 + b q + c| <= tau, with a, b, c from three runs of the inverse dynamics f(q, q', q'').

    c = f(r, 0, 0)    a = f(r, 0, r') - c    b = f(r, r', r'') - c:    Pham, Pham, IEEE T-RO 34(3), 2018 (TOPP-RA),
    https://doi.org/10.1109/TRO.2018.2819195, section II. Raises LimitsError for a model with friction, which is not of
    this form, and PlanError where standing still takes more than the torque.
    """
    torque = limits.torque
    if torque is None or not len(at.s):
        return
    r, r1, r2, _ = np.moveaxis(at.d[:, :, torque.columns(at.axes)], 1, 0)
    none = np.zeros_like(r)
    c = torque.of(r, none, none)
    a, b = torque.of(r, none, r1) - c, torque.of(r, r1, r2) - c
    faster = torque.of(r, 2.0 * r1, 4.0 * r2) - c - 4.0 * b
    if np.max(np.abs(faster)) > ALMOST * np.max(np.abs(b) + np.abs(c)):
        raise LimitsError(
            "torque: at twice the velocity and four times the acceleration the model's torque is not four times what "
            "motion takes: it has friction; leave friction out of the model and lower `most` by it"
        )
    for k, (axis, limit) in enumerate(torque.most.items()):
        if np.isfinite(limit):
            still = int(np.argmax(np.abs(c[:, k])))
            if abs(c[still, k]) >= limit:
                raise PlanError(
                    f"at s = {at.s[still]:.6g} mm standing still takes {abs(c[still, k]):.6g} of {axis}, whose torque "
                    f"is at most {limit:.6g}: no motion along the path is possible"
                )
            low, high = (-limit - c[:, k]) / limit, (limit - c[:, k]) / limit
            yield Linear(f"torque.{axis}", b[:, k] / limit, 0.5 * a[:, k] / limit, low, high)
