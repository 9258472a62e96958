"""The table of limits, which use, override, reserve, report and files read: what each bounds, order, unit and words."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

#: Names of rotary axes: rad inside, degrees at the edges. Every other axis is linear.
ROTARY_AXES = ("a", "b", "c", "theta")


class Joint(str):
    """The name of a joint of an arm, which knows its unit: rad, or mm of one that slides. It is equal to its text.

    Names of axes (k,) that are Joints have figures, files and messages say that unit. Raises nothing.
    Source: docs/readers/robots.md.
    Example: `sf.records.Joint("elbow", "rad").unit`
    """

    unit: str

    def __new__(cls, name: str, unit: str) -> Joint:
        """A name and its unit."""
        found = super().__new__(cls, name)
        found.unit = unit
        return found

    def __reduce__(self) -> tuple[type[Joint], tuple[str, str]]:
        return Joint, (str(self), self.unit)


def named(kind: str, axis: str) -> str:
    """The name of a limit of one axis, axis_jerk.x; that of a joint knows its unit as the joint does."""
    text = f"{kind}.{axis}"
    return Joint(text, axis.unit) if isinstance(axis, Joint) else text


#: What a limit bounds: the motion along the path, its ends, what lies between two setpoints, each axis, each axis at
#: corners and over its travel, weighted sums of axes, and what a model gives of axes, such as torques.
PATH, ENDS, TICKS, AXES, CORNERS, TRAVEL, SUMS, MODELS = (
    "path", "ends", "ticks", "axes", "corners", "travel", "sums", "models",
)  # fmt: skip


@dataclass(frozen=True)
class LimitKind:
    """A row of the table.

    name    the field of Limits;  words  what people read for it
    bounds  PATH, ENDS, TICKS, AXES, CORNERS, TRAVEL, SUMS or MODELS: how a use of it is computed
    order   which derivative by time it bounds: 0 for lengths and angles, and where the names of single bounds say it
    power   what it bounds grows by k^power where a motion runs k times as fast; 0: not at all, by no power, or as the
            names of single bounds say
    held    whether an override keeps it;  share  how much of it a reserve leaves to the plan: a key of its shares
    angle   whether it is an angle of no axis: rad inside, degrees at the edges;  filed  whether files can hold it
    of_force  whether it is a torque or a force, and not a length or an angle
    """

    name: str
    words: str
    bounds: str
    order: int = 0
    power: int = 0
    held: bool = True
    share: str = ""
    angle: bool = False
    filed: bool = True
    of_force: bool = False


#: Every limit, in the order in which they are shown; a new one begins as a row here.
TABLE = (
    LimitKind("feed", "feed", PATH, 1, 1),
    LimitKind("acceleration", "acceleration", PATH, 2, 2, share="acceleration"),
    LimitKind("jerk", "jerk", PATH, 3, 3, share="jerk"),
    LimitKind("deceleration", "deceleration", PATH, 2, 2, share="acceleration"),
    LimitKind("deceleration_jerk", "deceleration jerk", PATH, 3, 3, share="jerk"),
    LimitKind("start_feed", "start feed", ENDS, 1),
    LimitKind("end_feed", "end feed", ENDS, 1),
    LimitKind("chord_error", "chord error", TICKS, 0, 2),
    LimitKind("orientation_error", "orientation error", TICKS, 0, 2, angle=True),
    LimitKind("centripetal", "centripetal", PATH, 2, 2),
    LimitKind("axis_velocity", "axis velocity", AXES, 1, 1),
    LimitKind("axis_acceleration", "axis acceleration", AXES, 2, 2, share="acceleration"),
    LimitKind("axis_jerk", "axis jerk", AXES, 3, 3, share="jerk"),
    LimitKind("axis_velocity_step", "axis velocity step", CORNERS, 1, 1, held=False),
    LimitKind("axis_minimum", "axis minimum", TRAVEL),
    LimitKind("axis_maximum", "axis maximum", TRAVEL),
    LimitKind("combinations", "combination", SUMS, filed=False),
    LimitKind("torque", "torque", MODELS, of_force=True, filed=False),
    LimitKind("torque_rate", "rate of torque", MODELS, 1, of_force=True, filed=False),
    LimitKind("axis_velocity_law", "axis velocity by position", MODELS, 1, filed=False),
    LimitKind("axis_approach", "axis approach", MODELS, 2, filed=False),
)
KINDS = {each.name: each for each in TABLE}
#: What of a combination is bounded, in the order of the derivatives.
BOUNDED = ("velocity", "acceleration", "jerk")

#: Limits of numbers by name, and which derivative by time each bounds; of order 0 are lengths, and angles.
ORDERS = {each.name: each.order for each in TABLE if each.filed}
#: Fields of Limits that bound the derivatives of each axis by time, of order 1, 2 and 3.
AXIS_LIMITS = tuple(each.name for each in TABLE if each.bounds == AXES)
#: Fields of Limits that may differ from axis to axis: those, and the step of velocity at a corner.
BY_AXIS = tuple(each.name for each in TABLE if each.bounds in (AXES, CORNERS))
#: Fields of Limits that say how far each axis may travel.
TRAVEL_ENDS = tuple(each.name for each in TABLE if each.bounds == TRAVEL)
#: Limits of an angle that are those of no axis: rad inside, degrees at the edges.
ANGLES = tuple(each.name for each in TABLE if each.angle)
#: What follows the unit of length or angle, by order.
_PER = ("", "/s", "/s^2", "/s^3")
#: Names of columns that nobody named, nor said whether they turn or slide.
UNSAID = re.compile(r"q\d{1,3}")
#: A limit in the path's order as `Limits.as_dict` writes it.
IN_ORDER = re.compile(r"(\w+)\[\d+\]")


def field_of(name: str) -> str:
    """The field of Limits that a name of `Limits.as_dict` belongs to: axis_jerk for axis_jerk.x and axis_jerk[0]."""
    return re.split(r"[.[]", name, maxsplit=1)[0]


def order_of(name: str) -> int:
    """Which derivative by time a limit bounds, by its name: 3 for axis_jerk.x and combinations.left.jerk."""
    kind, *rest = name.split(".")
    if kind == "combinations" and len(rest) == 2:  # not one of its weights
        return BOUNDED.index(rest[1]) + 1
    found = KINDS.get(field_of(name))
    return 0 if found is None else found.order


def words_of(name: str) -> str:
    """The name of a limit in words: axis jerk x for axis_jerk.x, combination left jerk for combinations.left.jerk."""
    kind, *rest = name.split(".")
    if kind == "travel":
        return f"travel {'.'.join(rest)}, from its middle"
    return " ".join([KINDS[kind].words if kind in KINDS else kind.replace("_", " "), *rest])


def unit_of_axis(axis: str) -> str:
    """Unit of an axis for people: deg of a rotary one, that of a joint, (mm or rad) of q1, q2, ..., else mm."""
    if isinstance(axis, Joint):
        return axis.unit
    return "deg" if axis in ROTARY_AXES else "(mm or rad)" if UNSAID.fullmatch(axis) else "mm"


def unit_along(axes: Iterable[str]) -> str:
    """Unit of arc length along a path of these axes, for people: "mm", or what all of them are in, "deg" or "rad".

    Where some joints turn and others slide, or nobody says what they do, it is (mm or rad).
    """
    found = list(dict.fromkeys(map(unit_of_axis, axes)))
    if len(found) <= 1:
        return found[0] if found else "deg"
    return "(mm or rad)" if {"rad", "(mm or rad)"} & set(found) else "mm"


def unit_of(name: str, along: str = "mm") -> str:
    """Unit of a limit by its name, for people: of a rotary axis in degrees, along a path in `along` and its like.

    Example: `unit_of("axis_jerk.theta")` is deg/s^3
    """
    kind, _, axis = name.partition(".")
    if kind in KINDS and KINDS[kind].of_force:
        return ("N m" if axis in ROTARY_AXES or _own_unit(name) == "rad" else "N") + _PER[order_of(name)]
    if IN_ORDER.fullmatch(name) or (UNSAID.fullmatch(axis) and not isinstance(name, Joint)):
        base = "(mm or rad)"
    elif axis in ROTARY_AXES or kind in ANGLES:
        base = "deg"
    elif isinstance(name, Joint):
        base = name.unit
    else:
        base = "mm" if axis or kind.startswith("axis_") else along
    return base + _PER[order_of(name)]


def _own_unit(name: str) -> str:
    return name.unit if isinstance(name, Joint) else ""


def shown_by(name: str, axis: str | None) -> float:
    """What a limit's values are taken times where people read them: degrees of what turns, torques as they are."""
    kind = KINDS.get(field_of(name))
    turns = name in ANGLES or (axis in ROTARY_AXES and not (kind is not None and kind.of_force))
    return 180.0 / math.pi if turns else 1.0


def raised(unit: str) -> str:
    """A unit with its powers as they are printed, mm/s² for mm/s^2."""
    return unit.replace("^2", "²").replace("^3", "³")
