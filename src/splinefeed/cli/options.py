"""Options that several commands share, and quantities with units as their values."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from splinefeed.records import Limits

F = TypeVar("F", bound=Callable[..., Any])

#: Said at the end of every help text in which quantities occur.
UNITS_NOTE = "Quantities may carry a unit (3600mm/min, 50mm/s^2, 1ms); bare numbers are mm and s."


class Quantity(click.ParamType):  # type: ignore[type-arg]  # only newer versions of click have it
    """A number with or without a unit, as `units.parse` reads it; `kind` is one of its kinds."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.name = kind

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The value in mm, s and rad."""
        from splinefeed import units
        from splinefeed.errors import UnitError

        try:
            return units.parse(value, self.kind)
        except UnitError as error:
            raise click.BadParameter(str(error), ctx, param) from None


class Names(click.ParamType):  # type: ignore[type-arg]
    """A list of names between commas."""

    name = "name,name"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, ...]:
        """The names, in the order given, each once."""
        if not isinstance(value, str):
            return tuple(value)
        names = tuple(dict.fromkeys(name.strip() for name in value.split(",") if name.strip()))
        if not names:
            raise click.BadParameter("no name is given; write for example taylor-2,milne-simpson", ctx, param)
        return names


class AxisQuantities(click.ParamType):  # type: ignore[type-arg]
    """A limit of every linear axis, `2000`, or of single axes, `x=2000,theta=90deg/s^3`."""

    def __init__(self, limit: str) -> None:
        self.limit = limit
        self.name = limit

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> dict[str, float]:
        """Limit by name as `Limits.as_dict` writes it."""
        from splinefeed.errors import InputError
        from splinefeed.formats import limits_toml

        try:
            if "=" not in value:
                return {self.limit: limits_toml.axis_value(self.limit, "x", value)}
            pairs = [each.partition("=") for each in value.split(",")]
            return {
                f"{self.limit}.{axis.strip()}": limits_toml.axis_value(self.limit, axis.strip(), text)
                for axis, _, text in pairs
            }
        except InputError as error:
            raise click.BadParameter(str(error), ctx, param) from None


def _axis_limit(name: str, limit: str, text: str) -> Callable[[F], F]:
    return click.option(name, limit, type=AxisQuantities(limit), metavar="LIMIT", help=text)


def _all(*decorators: Callable[[F], F]) -> Callable[[F], F]:
    """Apply `decorators` so that the help lists them in this order."""

    def decorate(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


def _quantity(*names: str, kind: str, text: str) -> Callable[[F], F]:
    return click.option(*names, type=Quantity(kind), metavar=kind.upper(), help=text)


as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object, and nothing else, on stdout.")

#: How a SOURCE is read.
reading = _all(
    click.option("--path", "which", metavar="NAME|NUMBER", help="Which path of a file that holds several (from 1)."),
    _quantity("--chord", kind="length", text="Airfoil .dat: length of one unit of the file.  [default: 100 mm]"),
    _quantity(
        "--tolerance",
        kind="length",
        text="Airfoil .dat: largest distance of the fit from the points.  [default: 0.001 mm]  "
        "JSON: gap between curves that is still none.  [default: 1e-6 mm]",
    ),
    click.option("--repair", is_flag=True, help="Mend what is safe to mend in a faulty file, and say so as findings."),
)

#: What the motion along the path must never exceed; the paper's values stand in for what is not said.
limits = _all(
    _quantity("--feed", kind="feed", text="Highest feed.  [default: 60 mm/s]"),
    _quantity("--accel", "--acceleration", kind="acceleration", text="Highest acceleration.  [default: 50 mm/s^2]"),
    _quantity("--decel", "--deceleration", kind="acceleration", text="Highest deceleration.  [default: as --accel]"),
    _quantity("--jerk", kind="jerk", text="Highest jerk while speeding up.  [default: 2000 mm/s^3]"),
    _quantity("--decel-jerk", "--deceleration-jerk", kind="jerk", text="While slowing down.  [default: as --jerk]"),
    _quantity("--start-feed", kind="feed", text="Feed at the start of the path.  [default: 0]"),
    _quantity("--end-feed", kind="feed", text="Feed at its end.  [default: 0]"),
    _quantity("--chord-error", kind="length", text="Between the curve and the chord from setpoint to setpoint."),
    _quantity("--centripetal", kind="acceleration", text="Highest centripetal acceleration."),
    _axis_limit("--axis-velocity", "axis_velocity", "Highest velocity of each linear axis, or x=60,theta=90deg/s."),
    _axis_limit("--axis-accel", "axis_acceleration", "Highest acceleration of each axis, as above."),
    _axis_limit("--axis-jerk", "axis_jerk", "Highest jerk of each axis, as above."),
    _quantity("--period", kind="time", text="Servo period: one setpoint each.  [default: 1 ms]"),
    click.option(
        "--strategy",
        metavar="NAME",
        help="seven-phase or time-optimal.  [default: time-optimal if an axis, chord or centripetal limit is given, "
        "else seven-phase]",
    ),
)

#: Limits along the path, and the options that give them.
_ALONG_PATH = {
    "feed": "feed",
    "acceleration": "accel",
    "deceleration": "decel",
    "jerk": "jerk",
    "deceleration_jerk": "decel_jerk",
    "start_feed": "start_feed",
    "end_feed": "end_feed",
}

corrections = click.option(
    "--corrections", type=int, default=1, show_default=True, help="Passes of a method's corrector, 0 to 100."
)


def limits_from(given: dict[str, Any]) -> tuple[Limits, float, str]:
    """Limits, period and strategy from what the options of `limits` were `given`."""
    from splinefeed.pipeline.run import DEFAULT_STRATEGY, PAPER_LIMITS, PAPER_PERIOD, TIME_OPTIMAL
    from splinefeed.records import AXIS_LIMITS, Limits

    def said(name: str, otherwise: Any) -> Any:
        return otherwise if given[name] is None else given[name]

    beyond = {name: given[name] for name in ("chord_error", "centripetal") if given[name] is not None}
    for name in AXIS_LIMITS:
        beyond |= given[name] or {}
    own = {name: given[option] for name, option in _ALONG_PATH.items() if given[option] is not None}
    # the paper's limits stand in for what is not said; where axes are limited, nothing need be along the path
    assumed = {"feed": PAPER_LIMITS.feed}
    if not any(name in ("axis_acceleration", "axis_jerk") for name in (key.partition(".")[0] for key in beyond)):
        assumed |= {"acceleration": PAPER_LIMITS.acceleration, "jerk": PAPER_LIMITS.jerk}
    limits = Limits.from_dict({**assumed, **own, **beyond})
    return limits, said("period", PAPER_PERIOD), said("strategy", TIME_OPTIMAL if beyond else DEFAULT_STRATEGY)


def reading_from(given: dict[str, Any]) -> dict[str, Any]:
    """How to read a SOURCE, from what the options of `reading` were `given`."""
    said = {name: given[name] for name in ("which", "chord", "tolerance") if given[name] is not None}
    return said | ({"repair": True} if given["repair"] else {})
