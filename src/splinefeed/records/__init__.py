"""The records that rooms hand to each other: Limits, TimeLaw, Setpoints, Response, Verdict (numpy only, frozen)."""

from __future__ import annotations

from splinefeed.records.arrays import Array, BoolArray, IntArray, Points, check_finite, frozen_array
from splinefeed.records.drives import BOUNDED, Combination, Torque
from splinefeed.records.law import LAW_COEFFICIENTS, TimeLaw
from splinefeed.records.limits import (
    ANGLES,
    AXIS_LIMITS,
    BY_AXIS,
    ORDERS,
    ROTARY_AXES,
    TRAVEL_ENDS,
    Limits,
    number,
    positive,
    raised,
    refuse_orientation,
    unit_along,
    unit_of,
)
from splinefeed.records.response import STREAM_COLUMNS, Response
from splinefeed.records.setpoints import Setpoints
from splinefeed.records.verdict import KEPT, LimitResult, Verdict, shown_by

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
