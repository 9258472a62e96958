"""The records that rooms hand to each other: Limits, TimeLaw, Setpoints, Response, Verdict (numpy only, frozen)."""

from __future__ import annotations

from splinefeed.records.arrays import Array, BoolArray, IntArray, Points, check_finite, frozen_array
from splinefeed.records.limits import (
    ANGLES,
    AXIS_LIMITS,
    BOUNDED,
    BY_AXIS,
    ORDERS,
    ROTARY_AXES,
    TRAVEL_ENDS,
    Combination,
    Limits,
    Torque,
    number,
    positive,
    raised,
    refuse_orientation,
    shown_by,
    unit_along,
    unit_of,
)
from splinefeed.records.motion import LAW_COEFFICIENTS, STREAM_COLUMNS, Response, Setpoints, TimeLaw
from splinefeed.records.verdict import KEPT, LimitResult, Verdict

__all__ = [
    "ANGLES",
    "AXIS_LIMITS",
    "BOUNDED",
    "BY_AXIS",
    "KEPT",
    "LAW_COEFFICIENTS",
    "ORDERS",
    "ROTARY_AXES",
    "STREAM_COLUMNS",
    "TRAVEL_ENDS",
    "Array",
    "BoolArray",
    "Combination",
    "IntArray",
    "LimitResult",
    "Limits",
    "Points",
    "Response",
    "Setpoints",
    "TimeLaw",
    "Torque",
    "Verdict",
    "check_finite",
    "frozen_array",
    "number",
    "positive",
    "raised",
    "refuse_orientation",
    "shown_by",
    "unit_along",
    "unit_of",
]
