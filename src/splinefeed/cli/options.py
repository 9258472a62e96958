"""Options that several commands share, and quantities with units as their values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import click

from splinefeed import units
from splinefeed.errors import InputError, UnitError

if TYPE_CHECKING:
    from splinefeed.formats.path_parts import PathParts
    from splinefeed.geometry.path import Path
    from splinefeed.machine.machine import Machine
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
        try:
            return units.parse(value, self.kind, "deg" if self.kind == "angle" else None)
        except UnitError as error:
            raise click.BadParameter(str(error), ctx, param) from None


class Smoothing(click.ParamType):  # type: ignore[type-arg]
    """A length, or the word `program`."""

    name = "tolerance"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | str:
        """The tolerance in mm, or `program`."""
        from splinefeed.geometry.smoothing import PROGRAM

        return PROGRAM if value == PROGRAM else Quantity("length").convert(value, param, ctx)


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
        from splinefeed.formats import limits_toml

        try:
            if "=" not in value:
                if "," in value:
                    raise InputError(f"{value!r} holds several values; name the axes: x=500,y=800")
                return {self.limit: limits_toml.axis_value(self.limit, "x", value)}
            return {
                f"{self.limit}.{axis}": limits_toml.axis_value(self.limit, axis, text)
                for axis, text in limits_toml.by_axis(value)
            }
        except InputError as error:
            raise click.BadParameter(str(error), ctx, param) from None


class Travels(click.ParamType):  # type: ignore[type-arg]
    """Soft limits of axes, `x=0:500,theta=-90:90`."""

    name = "x=low:high"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Least and greatest position by axis, mm or rad."""
        from splinefeed.formats.limits_toml import turning
        from splinefeed.records import ROTARY_AXES

        found = {}
        try:
            for each in value.split(","):
                axis, _, ends = each.partition("=")
                low, _, high = ends.partition(":")
                axis = axis.strip()
                found[axis] = tuple(
                    turning(end, 0) if axis in ROTARY_AXES else units.parse(end, "length") for end in (low, high)
                )
        except InputError as error:
            raise click.BadParameter(f"{error}; write for example x=0:500", ctx, param) from None
        return found


def _axis_limit(name: str, limit: str, text: str) -> Callable[[F], F]:
    flags = dict.fromkeys([name, f"--{limit.replace('_', '-')}"])
    return click.option(*flags, limit, type=AxisQuantities(limit), metavar="LIMIT", help=text)


def _all(*decorators: Callable[[F], F]) -> Callable[[F], F]:
    """Apply `decorators` so that the help lists them in this order."""

    def decorate(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


def quantity(*names: str, kind: str, text: str) -> Callable[[F], F]:
    """An option that is a quantity of `kind`, with `text` as its help."""
    return click.option(*names, type=Quantity(kind), metavar=kind.upper(), help=text)


as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object, and nothing else, on stdout.")

#: Files of figures, and none of them.
figures = _all(
    click.option(
        "--figures",
        type=click.Choice(["svg", "png", "pdf"]),
        multiple=True,
        help="Format of the figures; may be repeated.  [default: svg]",
    ),
    click.option("--no-figures", is_flag=True, help="Draw nothing."),
)


def figure_formats(given: Mapping[str, Any]) -> tuple[str, ...]:
    """Formats of the figures, none with --no-figures."""
    if given["no_figures"] and given["figures"]:
        raise InputError("--no-figures: draws nothing; leave it out, or --figures")
    return () if given["no_figures"] else tuple(given["figures"] or ("svg",))


#: How a G-code program is read.
reading_program = _all(
    click.option("--dialect", metavar="NAME", help="G-code: the control, if the program does not show it."),
    click.option("--start", metavar="X,Y,Z,...", help="G-code: tool position before the first line, mm and deg."),
    click.option("--offsets", metavar="G54=X,Y,Z;...", help="G-code: work offsets.  [default: at 0]"),
    click.option("--tools", metavar="FILE", help="G-code: tool table (.tbl); G43 takes tool lengths from it."),
    click.option("--repair", is_flag=True, help="Repair what is safe to repair in a faulty file, and list it."),
)

#: Where a program begins.
from_line = click.option(
    "--from-line", metavar="N", help="G-code: resume the program at this line, with the modes in force there."
)

#: How a SOURCE is read, but for the tolerance.
reading_alone = _all(
    click.option("--path", "which", metavar="NAME|NUMBER", help="Which path of a file that holds several (from 1)."),
    click.option("--layer", metavar="NAME,NAME", help="DXF, 3DM, SVG (groups): only these layers."),
    click.option("--units", "file_units", metavar="UNIT", help="DXF: mm, in, ...; overrides the file."),
    quantity("--chord", kind="length", text="Airfoil .dat: length of one unit of the file.  [default: 100 mm]"),
    click.option("--edges", is_flag=True, help="STEP, IGES, 3DM: edges of faces as well as free curves."),
    reading_program,
    from_line,
)

#: How a SOURCE is read.
reading = _all(
    reading_alone,
    quantity(
        "--tolerance",
        kind="length",
        text="Airfoil .dat, points .csv .xyz: largest distance of the fit.  [default: 0.001 mm]  "
        "Drawings, CAD, JSON: ends closer than this are joined.  [default: 1e-6 mm]",
    ),
)

#: How the path is smoothed.
smoothing = _all(
    click.option(
        "--smooth",
        type=Smoothing(),
        metavar="LENGTH|program",
        help="Replace short lines and corners by curves within this tolerance; `program`: that of its G64 P.",
    ),
    click.option(
        "--corners",
        type=click.Choice(["keep", "round"]),
        help="What --smooth does at corners sharper than --corner-angle.  [default: keep; round for `program`]",
    ),
    click.option(
        "--corner-angle",
        type=click.FloatRange(0.0, 180.0, min_open=True),
        metavar="DEGREES",
        help="Joints that turn by more than this are corners.  [default: 45]",
    ),
    quantity(
        "--angle-tolerance",
        kind="angle",
        text="How far --smooth may turn the tool axis, or rotary axes: 0.1deg, 1mrad.  [default: 0.05 deg]",
    ),
)


def smoothing_from(given: Mapping[str, Any]) -> dict[str, Any]:
    """How to smooth a path, from what the options of `smoothing` were `given`; the angle in degrees.

    Raises InputError for how without by how much.
    """
    names = ("smooth", "corners", "corner_angle", "angle_tolerance")
    said = {name: given[name] for name in names if given[name] is not None}
    for name in said:
        if "smooth" not in said:
            raise InputError(f"--{name.replace('_', '-')}: needs --smooth; give --smooth LENGTH too")
    return said


def smoothing_note(path: Path, given: Mapping[str, Any]) -> list[str]:
    """What to say of a program that asks for smoothing where none is given."""
    import math

    if given["smooth"] is not None or path.tolerances is None or not path.tolerances.any():
        return []
    top = float(path.tolerances.max())
    tolerance = f"G64 P{top:g}" if top < math.inf else "G64"
    return [f"the program allows smoothing ({tolerance}), which is off; turn it on with --smooth program"]


#: Single limits: option, name it is given as, kind, help, and what the paper's experiment assumes.
_SINGLE = (
    (("--feed",), "feed", "Feed limit along the path.", "60 mm/s"),
    (
        ("--accel", "--acceleration"),
        "acceleration",
        "Acceleration limit along the path.",
        "50 mm/s^2, or none where axes have limits",
    ),
    (("--decel", "--deceleration"), "acceleration", "Deceleration limit along the path.", "as --accel"),
    (("--jerk",), "jerk", "Jerk limit along the path, speeding up.", "2000 mm/s^3, or none where axes have limits"),
    (("--decel-jerk", "--deceleration-jerk"), "jerk", "Jerk limit along the path, slowing down.", "as --jerk"),
    (("--start-feed",), "feed", "Feed at the start of the path.", "0"),
    (("--end-feed",), "feed", "Feed at the end of the path.", "0"),
    (("--chord-error",), "length", "Chord error (sag) between two setpoints.", ""),
    (("--orientation-error",), "angle", "How far the tool axis may be off between two setpoints.", ""),
    (("--centripetal",), "acceleration", "Centripetal acceleration limit.", ""),
)


def limits_alone(default: str = "") -> Callable[[F], F]:
    """Options of limits; `default` is where limits come from that are not given, the paper's values if empty."""
    file = f"Limits in a TOML file; options replace single ones.{f'  [default: {default}]' if default else ''}"
    return _all(
        click.option("--limits", "limits_file", metavar="FILE", help=file),
        *(
            quantity(*flags, kind=kind, text=f"{text}  [default: {paper}]" if paper and not default else text)
            for flags, kind, text, paper in _SINGLE
        ),
        _axis_limit("--axis-velocity", "axis_velocity", "Limit of each linear axis: 60, or x=60,theta=90deg/s."),
        _axis_limit("--axis-accel", "axis_acceleration", "Limit of each linear axis: 500, or x=500,theta=90deg/s^2."),
        _axis_limit("--axis-jerk", "axis_jerk", "Limit of each linear axis: 20000, or x=20000,y=15000."),
        _axis_limit(
            "--axis-velocity-step",
            "axis_velocity_step",
            "Junction velocity: largest velocity step of each axis at a corner; without it corners are exact stops.",
        ),
        click.option(
            "--travel", type=Travels(), metavar="AXIS=LOW:HIGH", help="Soft limits of position: x=0:500,y=0:300."
        ),
    )


#: What the motion along the path must never exceed, the servo period, and who plans it.
limits = _all(
    limits_alone(),
    quantity("--period", kind="time", text="Servo period: one setpoint each.  [default: 1 ms]"),
    click.option(
        "--strategy",
        metavar="NAME",
        help="How to plan.  [default: automatic: seven-phase for feed, acceleration and jerk along the path alone, "
        "else time-optimal]",
    ),
)

machine = click.option(
    "--machine",
    metavar="NAME|FILE",
    help="A machine file or a built-in machine; its axis limits apply unless others are given. See splinefeed machine.",
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


def limits_from(
    given: dict[str, Any], machine: Machine | None = None, axes: Sequence[str] = ()
) -> tuple[Limits, float, str | None]:
    """Limits, period and strategy, None if it is left open, from what the options of `limits` were `given`.

    Without a file of limits the paper's stand in for what is not said, but not where limits of the axes say enough.
    The limits of the `axes` of a machine hold where neither file nor options say others.
    """
    from splinefeed.formats import limits_toml
    from splinefeed.pipeline.limits import completed
    from splinefeed.pipeline.run import PAPER_PERIOD

    file = given["limits_file"]
    flat = replaced(limits_toml.read(file).as_dict() if file else {}, given)
    period = PAPER_PERIOD if given["period"] is None else given["period"]
    return completed(flat, machine, axes, assume=not file), period, given["strategy"]


def as_programmed(limits: Limits, path: Path | PathParts, given: Mapping[str, Any]) -> tuple[Limits, list[str]]:
    """The limits for a path whose curves carry the feeds of a program, where no feed is said, and a note of it."""
    from splinefeed.formats import limits_toml
    from splinefeed.pipeline.limits import at_programmed_feeds

    file = given["limits_file"]
    if given["feed"] is not None or (file and "feed" in limits_toml.read(file).as_dict()):
        return limits, []
    return at_programmed_feeds(limits, path)


def replaced(flat: Mapping[str, float], given: Mapping[str, Any]) -> dict[str, float]:
    """Limits as `Limits.as_dict` has them, with those that options `given` say in their place."""
    from splinefeed.records import BY_AXIS, TRAVEL_ENDS

    out = dict(flat)
    for name in (*_ALONG_PATH, "chord_error", "orientation_error", "centripetal"):
        if (value := given[_ALONG_PATH.get(name, name)]) is not None:
            out[name] = value
    for name in BY_AXIS:
        if given[name] is not None:
            out = {key: value for key, value in out.items() if key.partition(".")[0] != name} | given[name]
    for axis, ends in (given["travel"] or {}).items():
        out |= {f"{name}.{axis}": end for name, end in zip(TRAVEL_ENDS, ends, strict=True)}
    return out


#: Options of `reading` by the names that readers have for them.
_READING = {
    "which": "which",
    "layer": "layer",
    "file_units": "units",
    "chord": "chord",
    "dialect": "dialect",
    "start": "start",
    "offsets": "offsets",
    "tools": "tools",
    "from_line": "from_line",
}


def reading_from(given: dict[str, Any]) -> dict[str, Any]:
    """How to read a SOURCE, from what the options of `reading` were `given`."""
    said = {name: given[option] for option, name in _READING.items() if given[option] is not None}
    if given.get("tolerance") is not None:
        said["tolerance"] = given["tolerance"]
    return said | {name: True for name in ("edges", "repair") if given[name]}
