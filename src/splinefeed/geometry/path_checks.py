"""Requirements on the curves of a path and their data: axes, joints, and numbers one a curve."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import CurveError, InputError
from splinefeed.geometry.curve import MAX_AXES
from splinefeed.geometry.curves import Flat
from splinefeed.records import ROTARY_AXES, Array, BoolArray, frozen_array

#: Linear axes that move by no more roundings than this, on a curve that turns rotary ones, do not move.
STILL_ROUNDINGS = 8.0


def checked_axes(axes: Sequence[str], count: int) -> int:
    """How many of `axes` are linear; CurveError unless they name `count` axes, the linear ones first."""
    if len(axes) != count or len(set(axes)) != count or count > MAX_AXES:
        raise CurveError(f"axes {axes} for curves of {count} axes; expected one distinct name each")
    rotary = [axis in ROTARY_AXES for axis in axes]
    if rotary != sorted(rotary):
        raise CurveError(f"axes {axes}: put the linear axes first and the rotary ones ({', '.join(ROTARY_AXES)}) last")
    return count - sum(rotary)


def check_still(flat: Flat, linear: int) -> None:
    """Refuse a curve whose linear axes move by rounding only while rotary ones turn: s would be rounding."""
    moved, turned = flat.sizes(slice(linear)), flat.sizes(slice(linear, None))
    first, last = flat.point_starts[:-1], flat.points[:, :linear]
    largest = np.max(np.maximum.reduceat(np.abs(last), first), axis=1)
    rounding = (moved > 0.0) & (moved <= STILL_ROUNDINGS * np.finfo(float).eps * largest) & (turned > moved)
    if rounding.any():
        i = int(np.argmax(rounding))
        raise CurveError(
            f"curve {i} turns its rotary axes by {math.degrees(turned[i]):.6g} deg while the linear ones move by "
            f"{moved[i]:.3g} mm, which is rounding; give its linear axes one position"
        )


def check_joints(ends: Array, tolerance: float) -> None:
    """Refuse a gap above `tolerance`, mm, between first and last points (curves, 2, axes) of neighbours."""
    gaps = np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=1)
    if np.any(gaps > tolerance):
        i = int(np.argmax(gaps > tolerance))
        raise CurveError(
            f"gap of {gaps[i]:.6g} mm between the end of curve {i} and the start of curve {i + 1}; "
            f"join them, or allow it with tolerance="
        )


def of_curves(
    given: ArrayLike | None, count: int, name: str, wanted: str, fits: Callable[[Array], BoolArray]
) -> Array | None:
    """One number a curve, (count,), read-only; InputError for a number that does not fit."""
    if given is None:
        return None
    values = frozen_array(given, name, 1)
    if len(values) != count:
        raise InputError(f"{name} has {len(values)} numbers for {count} curves; give one each")
    wrong = ~fits(values)
    if np.any(wrong):
        i = int(np.argmax(wrong))
        raise InputError(f"{name}[{i}] is {values[i]:g}; it must be {wanted}")
    return values
