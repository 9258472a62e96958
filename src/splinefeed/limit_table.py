"""The table of limits, which all rooms read: what each bounds, its order, unit and words. It needs no NumPy."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: Limits of axes: a number for every linear one, values in the path's order, or by name.
OfAxes: TypeAlias = "float | Sequence[float] | NDArray[np.float64] | Mapping[str, float] | None"

#: Names of rotary axes: rad inside, degrees at the edges. Every other axis is linear.
ROTARY_AXES = ("a", "b", "c", "theta")


class Joint(str):
    """Name a joint of an arm, which knows its unit: rad, or mm of one that slides; it is equal to its text.

    Parameters
    ----------
    name : str
        Of the joint.
    unit : str
        "rad" or "mm": names of axes (k,) that are Joints have figures, files and messages say it.

    References
    ----------
    .. [1] docs/readers/robots.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.records.Joint("elbow", "rad").unit
    'rad'
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
    """Make the name of a limit of one axis, axis_jerk.x; that of a joint knows its unit as the joint does.

    Parameters
    ----------
    kind : str
        Field of Limits.
    axis : str
        Name of the axis.

    Returns
    -------
    str
        The name.
    """
    text = f"{kind}.{axis}"
    return Joint(text, axis.unit) if isinstance(axis, Joint) else text


#: Kinds of quantities by the order of the derivative that they are, of what slides and of what turns.
SLIDING = ("length", "feed", "acceleration", "jerk")
TURNING = ("angle", "angular velocity", "angular acceleration", "angular jerk")

#: What a limit bounds: the motion along the path, its ends, what a place of the path and the feed there make, what lies
#: between two setpoints, each axis, each axis at corners and over its travel, weighted sums of axes, and what a model
#: gives of axes, such as torques.
PATH, ENDS, PLACES, TICKS, AXES, CORNERS, TRAVEL, SUMS, MODELS = (
    "path", "ends", "places", "ticks", "axes", "corners", "travel", "sums", "models",
)  # fmt: skip


@dataclass(frozen=True)
class LimitKind:
    """A row of the table.

    Parameters
    ----------
    name : str
        The field of Limits.
    words : str
        What people read for it.
    bounds : str
        PATH, ENDS, PLACES, TICKS, AXES, CORNERS, TRAVEL, SUMS or MODELS: how a use of it is computed.
    order : int
        Which derivative by time it bounds: 0 for lengths and angles, and where the names of single bounds say it.
    power : int
        What it bounds grows by k^power where a motion runs k times as fast; 0: not at all, by no power, or as the names
        of single bounds say.
    held : bool
        Whether an override keeps it.
    share : str
        How much of it a reserve leaves to the plan: a key of its shares.
    angle : bool
        Whether it is an angle of no axis: rad inside, degrees at the edges.
    filed : bool
        Whether files and options can hold it.
    unit : (str, str)
        Of what a model gives: its unit for people of axes that slide, and of those that turn. Values of these are in
        deg where that begins so, else as they are.
    says : str
        Help of its option.
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
    unit: tuple[str, str] | None = None
    says: str = ""

    def __post_init__(self) -> None:
        if self.bounds == MODELS and self.unit is None:
            raise ValueError(f'{self.name}: say its unit, of axes that slide and that turn, as unit=("N", "N m")')

    @property
    def quantity(self) -> str:
        """The kind of quantity that it is along a path or of a linear axis, as `units` has it."""
        return (TURNING if self.angle else SLIDING)[self.order]


def limit(usual: float | None, words: str, bounds: str, order: int = 0, power: int = 0, **more: Any) -> Any:
    """Return a field of Limits with the value that it has where none is given, and its row: see `LimitKind`."""
    return field(default=usual, metadata={"kind": LimitKind("", words, bounds, order, power, **more)})


@dataclass(frozen=True, kw_only=True)
class LimitFields:
    """The limits that are numbers, in the order in which they are shown: a new one begins as a line here.

    Along the path such a line is one of PLACES: its rows are made by `planner/path_rows.py`, and it is judged by
    `checks/path_limits.py`. All else reads it here.
    """

    feed: float = limit(
        math.inf, "feed", PATH, 1, 1,
        says="Feed limit along the path; rapid moves are as fast as the velocities of the axes allow, where all axes "
        "have one.",
    )  # fmt: skip
    acceleration: float = limit(
        math.inf, "acceleration", PATH, 2, 2, share="acceleration", says="Acceleration limit along the path."
    )
    jerk: float = limit(math.inf, "jerk", PATH, 3, 3, share="jerk", says="Jerk limit along the path, speeding up.")
    deceleration: float | None = limit(
        None, "deceleration", PATH, 2, 2, share="acceleration", says="Deceleration limit along the path."
    )
    deceleration_jerk: float | None = limit(
        None, "deceleration jerk", PATH, 3, 3, share="jerk", says="Jerk limit along the path, slowing down."
    )
    start_feed: float = limit(0.0, "start feed", ENDS, 1, says="Feed at the start of the path.")
    end_feed: float = limit(0.0, "end feed", ENDS, 1, says="Feed at the end of the path.")
    chord_error: float | None = limit(None, "chord error", TICKS, 0, 2, says="Chord error (sag) between two setpoints.")
    orientation_error: float | None = limit(
        None, "orientation error", TICKS, 0, 2, angle=True,
        says="How far the tool axis may be off between two setpoints.",
    )  # fmt: skip
    centripetal: float | None = limit(None, "centripetal", PLACES, 2, 2, says="Centripetal acceleration limit.")
    axis_velocity: OfAxes = limit(
        None, "axis velocity", AXES, 1, 1,
        says="Limit of each linear axis: 60; of all, in the path's order: 60,50,90deg/s; or by name: "
        "x=60,theta=90deg/s.",
    )  # fmt: skip
    axis_acceleration: OfAxes = limit(
        None, "axis acceleration", AXES, 2, 2, share="acceleration",
        says="Limit of each linear axis: 500, of all: 500,300, or x=500.",
    )  # fmt: skip
    axis_jerk: OfAxes = limit(
        None, "axis jerk", AXES, 3, 3, share="jerk",
        says="Limit of each linear axis: 20000, of all: 20000,15000, or x=20000,y=15000.",
    )  # fmt: skip
    axis_velocity_step: OfAxes = limit(
        None, "axis velocity step", CORNERS, 1, 1, held=False,
        says="Junction velocity: largest velocity step of each axis at a corner; without it corners are exact stops.",
    )  # fmt: skip
    axis_minimum: OfAxes = limit(None, "axis minimum", TRAVEL)
    axis_maximum: OfAxes = limit(None, "axis maximum", TRAVEL)


#: Every limit, in the order in which they are shown.
TABLE: tuple[LimitKind, ...] = (
    *(replace(each.metadata["kind"], name=each.name) for each in fields(LimitFields)),
    LimitKind("combinations", "combination", SUMS, filed=False),
    LimitKind("torque", "torque", MODELS, unit=("N", "N m"), filed=False),
    LimitKind("torque_rate", "rate of torque", MODELS, 1, unit=("N/s", "N m/s"), filed=False),
    LimitKind("axis_velocity_law", "axis velocity by position", MODELS, 1, unit=("mm/s", "deg/s"), filed=False),
    LimitKind("axis_approach", "axis approach", MODELS, 2, unit=("mm/s^2", "deg/s^2"), filed=False),
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
    """Find the field of Limits that a name of `Limits.as_dict` belongs to.

    Parameters
    ----------
    name : str
        Such as axis_jerk.x.

    Returns
    -------
    str
        The field.

    Examples
    --------
    >>> from splinefeed.limit_table import field_of
    >>> field_of("axis_jerk.x"), field_of("axis_jerk[0]")
    ('axis_jerk', 'axis_jerk')
    """
    return re.split(r"[.[]", name, maxsplit=1)[0]


def order_of(name: str) -> int:
    """Find which derivative by time a limit bounds, by its name.

    Parameters
    ----------
    name : str
        As `Limits.as_dict` has it.

    Returns
    -------
    int
        0 for lengths and angles.

    Examples
    --------
    >>> from splinefeed.limit_table import order_of
    >>> order_of("axis_jerk.x"), order_of("combinations.left.jerk")
    (3, 3)
    """
    kind, *rest = name.split(".")
    if kind == "combinations" and len(rest) == 2:  # not one of its weights
        return BOUNDED.index(rest[1]) + 1
    found = KINDS.get(field_of(name))
    return 0 if found is None else found.order


def words_of(name: str) -> str:
    """Write the name of a limit in words.

    Parameters
    ----------
    name : str
        As `Limits.as_dict` has it.

    Returns
    -------
    str
        For people.

    Examples
    --------
    >>> from splinefeed.limit_table import words_of
    >>> words_of("axis_jerk.x"), words_of("combinations.left.jerk")
    ('axis jerk x', 'combination left jerk')
    """
    kind, *rest = name.split(".")
    if kind == "travel":
        return f"travel {'.'.join(rest)}, from its middle"
    return " ".join([KINDS[kind].words if kind in KINDS else kind.replace("_", " "), *rest])


def unit_of_axis(axis: str) -> str:
    """Find the unit of an axis for people.

    Parameters
    ----------
    axis : str
        Its name.

    Returns
    -------
    str
        deg of a rotary one, that of a joint, (mm or rad) of q1, q2, ..., else mm.
    """
    if isinstance(axis, Joint):
        return axis.unit
    return "deg" if axis in ROTARY_AXES else "(mm or rad)" if UNSAID.fullmatch(axis) else "mm"


def unit_along(axes: Iterable[str]) -> str:
    """Find the unit of arc length along a path of these axes, for people.

    Parameters
    ----------
    axes : iterable of str
        Names of axes, or Joints.

    Returns
    -------
    str
        "mm", or what all of them are in, "deg" or "rad". Where some joints turn and others slide, or nobody says what
        they do, it is (mm or rad).
    """
    found = list(dict.fromkeys(map(unit_of_axis, axes)))
    if len(found) <= 1:
        return found[0] if found else "deg"
    return "(mm or rad)" if {"rad", "(mm or rad)"} & set(found) else "mm"


def unit_of(name: str, along: str = "mm") -> str:
    """Find the unit of a limit by its name, for people.

    Parameters
    ----------
    name : str
        As `Limits.as_dict` has it.
    along : str, optional
        Unit of length along the path.

    Returns
    -------
    str
        Of a rotary axis in degrees.

    Examples
    --------
    >>> from splinefeed.limit_table import unit_of
    >>> unit_of("axis_jerk.theta"), unit_of("feed")
    ('deg/s^3', 'mm/s')
    """
    kind, _, axis = name.partition(".")
    if kind in KINDS and (unit := KINDS[kind].unit) is not None:
        slides, turns = unit
        joint = name.unit if isinstance(name, Joint) else unit_of_axis(axis)
        plain = turns.replace("deg", "rad")
        return {"mm": slides, "deg": turns, "rad": plain}.get(joint, f"({slides} or {plain})")
    if IN_ORDER.fullmatch(name) or (UNSAID.fullmatch(axis) and not isinstance(name, Joint)):
        base = "(mm or rad)"
    elif axis in ROTARY_AXES or kind in ANGLES:
        base = "deg"
    elif isinstance(name, Joint):
        base = name.unit
    else:
        base = "mm" if axis or kind.startswith("axis_") else along
    return base + _PER[order_of(name)]


def shown_by(name: str, axis: str | None) -> float:
    """Find what a limit's values are taken times where people read them: degrees of what turns, torques as they are.

    Parameters
    ----------
    name : str
        Of the limit.
    axis : str or None
        Whose it is.

    Returns
    -------
    float
        The factor.
    """
    kind = KINDS.get(field_of(name))
    plain = kind is not None and kind.unit is not None and not kind.unit[1].startswith("deg")
    return 180.0 / math.pi if name in ANGLES or (axis in ROTARY_AXES and not plain) else 1.0


def raised(unit: str) -> str:
    """Write a unit with its powers as they are printed, mm/s² for mm/s^2.

    Parameters
    ----------
    unit : str
        The unit.

    Returns
    -------
    str
        As printed.
    """
    return unit.replace("^2", "²").replace("^3", "³")
