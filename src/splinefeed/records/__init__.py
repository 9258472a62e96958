"""The records that rooms hand to each other: Limits, TimeLaw, Setpoints, Response, Verdict (NumPy only, frozen).

`limits` is Limits, whose fields, their units and words are lines of `splinefeed.limit_table`, where a new one begins;
`modelled` is what limits of models share: `torque`, `torque_rate`, `velocity_law`. `motion` has TimeLaw, Setpoints and
Response, `state` how a motion moves at a place, `verdict` the Verdict; `arrays` checks and freezes arrays, `view` shows
a record in a notebook.
"""

from __future__ import annotations

from splinefeed.limit_table import ANGLES as ANGLES
from splinefeed.limit_table import AXIS_LIMITS as AXIS_LIMITS
from splinefeed.limit_table import BOUNDED as BOUNDED
from splinefeed.limit_table import BY_AXIS as BY_AXIS
from splinefeed.limit_table import ORDERS as ORDERS
from splinefeed.limit_table import ROTARY_AXES as ROTARY_AXES
from splinefeed.limit_table import TABLE as TABLE
from splinefeed.limit_table import TRAVEL_ENDS as TRAVEL_ENDS
from splinefeed.limit_table import Joint as Joint
from splinefeed.limit_table import field_of as field_of
from splinefeed.limit_table import named as named
from splinefeed.limit_table import order_of as order_of
from splinefeed.limit_table import raised as raised
from splinefeed.limit_table import shown_by as shown_by
from splinefeed.limit_table import unit_along as unit_along
from splinefeed.limit_table import unit_of as unit_of
from splinefeed.limit_table import unit_of_axis as unit_of_axis
from splinefeed.limit_table import words_of as words_of
from splinefeed.records.arrays import Array as Array
from splinefeed.records.arrays import BoolArray as BoolArray
from splinefeed.records.arrays import IntArray as IntArray
from splinefeed.records.arrays import Points as Points
from splinefeed.records.arrays import check_finite as check_finite
from splinefeed.records.arrays import frozen_array as frozen_array
from splinefeed.records.limits import AxisBounds as AxisBounds
from splinefeed.records.limits import Combination as Combination
from splinefeed.records.limits import Limits as Limits
from splinefeed.records.limits import axes_without_limits as axes_without_limits
from splinefeed.records.limits import by_name as by_name
from splinefeed.records.limits import number as number
from splinefeed.records.limits import positive as positive
from splinefeed.records.limits import refuse_orientation as refuse_orientation
from splinefeed.records.modelled import Modelled as Modelled
from splinefeed.records.motion import LAW_COEFFICIENTS as LAW_COEFFICIENTS
from splinefeed.records.motion import STREAM_COLUMNS as STREAM_COLUMNS
from splinefeed.records.motion import Response as Response
from splinefeed.records.motion import Setpoints as Setpoints
from splinefeed.records.motion import TimeLaw as TimeLaw
from splinefeed.records.state import REST as REST
from splinefeed.records.state import State as State
from splinefeed.records.torque import Torque as Torque
from splinefeed.records.torque_rate import TorqueRate as TorqueRate
from splinefeed.records.velocity_law import Approach as Approach
from splinefeed.records.velocity_law import VelocityByPosition as VelocityByPosition
from splinefeed.records.verdict import KEPT as KEPT
from splinefeed.records.verdict import LimitResult as LimitResult
from splinefeed.records.verdict import Verdict as Verdict
