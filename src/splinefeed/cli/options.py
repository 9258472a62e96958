"""Options that several commands share, and quantities with units as their values."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import click

from splinefeed import units
from splinefeed.errors import InputError

if TYPE_CHECKING:
    from splinefeed.formats.path_parts import PathParts
    from splinefeed.geometry.path import Path
    from splinefeed.machine.machine import Machine
    from splinefeed.records import Limits

F = TypeVar("F", bound=Callable[..., Any])

#: Said at the end of every help text in which quantities occur.
UNITS_NOTE = "Quantities may carry a unit (3600mm/min, 50mm/s^2, 1ms); bare numbers are mm and s."


class Value(click.ParamType):  # type: ignore[type-arg]  # only newer versions of click have it
    """What a function makes of the text of an option; its InputError is one of usage."""

    def __init__(self, name: str, read: Callable[[str], Any]) -> None:
        self.name, self._read = name, read

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The value, in mm, s and rad."""
        try:
            return self._read(value)
        except InputError as error:
            raise click.BadParameter(str(error), ctx, param) from None


class Quantity(Value):
    """A number with or without a unit, as `units.parse` reads it; `kind` is one of its kinds."""

    def __init__(self, kind: str) -> None:
        super().__init__(kind, lambda value: units.parse(value, kind, "deg" if kind == "angle" else None))


class Names(Value):
    """A list of names between commas, each once."""

    def __init__(self) -> None:
        super().__init__("name,name", _names)


def _names(text: str) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not names:
        raise InputError("no name is given; write for example taylor-2,milne-simpson")
    return names


def _of_axes(limit: str, text: str) -> dict[str, float]:
    """A limit of every linear axis, `2000`, or of single ones, `x=2000,theta=90deg/s^3`, as `Limits.as_dict` has it."""
    from splinefeed.formats import limits_toml

    if "=" in text:
        named = limits_toml.by_axis(text)
        return {f"{limit}.{axis}": limits_toml.axis_value(limit, axis, value) for axis, value in named}
    if "," in text:
        raise InputError(f"{text!r} holds several values; name the axes: x=500,y=800")
    return {limit: limits_toml.axis_value(limit, "x", text)}


def _travel(text: str) -> dict[str, float]:
    """Soft limits of axes, `x=0:500,theta=-90:90`, as `Limits.as_dict` has them."""
    from splinefeed.formats.limits_toml import turning
    from splinefeed.records import ROTARY_AXES, TRAVEL_ENDS

    found = {}
    try:
        for each in text.split(","):
            axis, _, ends = each.partition("=")
            axis = axis.strip()
            for name, end in zip(TRAVEL_ENDS, (ends.partition(":")[0], ends.partition(":")[2]), strict=True):
                found[f"{name}.{axis}"] = turning(end, 0) if axis in ROTARY_AXES else units.parse(end, "length")
    except InputError as error:
        raise InputError(f"{error}; write for example x=0:500") from None
    return found


def _smoothing(text: str) -> float | str:
    return text if text == "program" else units.parse(text, "length")


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
    return () if given["no_figures"] else tuple(given["figures"] or ("svg",))


#: How a G-code program is read.
reading_program = _all(
    click.option("--dialect", metavar="NAME", help="G-code: the control, if the program does not show it."),
    click.option("--start", metavar="X,Y,Z,...", help="G-code: tool position before the first line, mm and deg."),
    click.option("--offsets", metavar="G54=X,Y,Z;...", help="G-code: work offsets.  [default: at 0]"),
    click.option("--tools", metavar="FILE", help="G-code: tool table (.tbl, .toml); G43 takes tool lengths from it."),
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
    click.option("--units", metavar="UNIT", help="DXF: mm, in, ...; overrides the file."),
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
        type=Value("tolerance", _smoothing),
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
_SMOOTHING = ("smooth", "corners", "corner_angle", "angle_tolerance")


def smoothing_from(given: Mapping[str, Any]) -> dict[str, Any]:
    """How to smooth a path, from what the options of `smoothing` were `given`; the angle in degrees.

    Raises InputError for how without by how much.
    """
    said = {name: given[name] for name in _SMOOTHING if given.get(name) is not None}
    if said and "smooth" not in said:
        raise InputError(f"--{next(iter(said)).replace('_', '-')}: needs --smooth; give --smooth LENGTH too")
    return said


def smoothing_note(path: Path, given: Mapping[str, Any]) -> list[str]:
    """What to say of a program that asks for smoothing where none is given."""
    if given["smooth"] is not None or path.tolerances is None or not path.tolerances.any():
        return []
    top = float(path.tolerances.max())
    tolerance = f"G64 P{top:g}" if top < math.inf else "G64"
    return [f"the program allows smoothing ({tolerance}), which is off; turn it on with --smooth program"]


#: Limits along the path: name, kind, options, help, and what the paper's experiment assumes.
_LIMITS = (
    ("feed", "feed", ["--feed"], "Feed limit along the path.", "60 mm/s"),
    ("acceleration", "acceleration", ["--accel", "--acceleration"], "Acceleration limit along the path.",
     "50 mm/s^2, or none where axes have limits"),
    ("deceleration", "acceleration", ["--decel", "--deceleration"], "Deceleration limit along the path.", "as --accel"),
    ("jerk", "jerk", ["--jerk"], "Jerk limit along the path, speeding up.",
     "2000 mm/s^3, or none where axes have limits"),
    ("deceleration_jerk", "jerk", ["--decel-jerk", "--deceleration-jerk"], "Jerk limit along the path, slowing down.",
     "as --jerk"),
    ("start_feed", "feed", ["--start-feed"], "Feed at the start of the path.", "0"),
    ("end_feed", "feed", ["--end-feed"], "Feed at the end of the path.", "0"),
    ("chord_error", "length", ["--chord-error"], "Chord error (sag) between two setpoints.", ""),
    ("orientation_error", "angle", ["--orientation-error"], "How far the tool axis may be off between two setpoints.",
     ""),
    ("centripetal", "acceleration", ["--centripetal"], "Centripetal acceleration limit.", ""),
)  # fmt: skip
#: Limits by axis: name, options, help.
_AXIS_LIMITS = (
    ("axis_velocity", ["--axis-velocity"], "Limit of each linear axis: 60, or x=60,theta=90deg/s."),
    ("axis_acceleration", ["--axis-accel", "--axis-acceleration"],
     "Limit of each linear axis: 500, or x=500,theta=90deg/s^2."),
    ("axis_jerk", ["--axis-jerk"], "Limit of each linear axis: 20000, or x=20000,y=15000."),
    ("axis_velocity_step", ["--axis-velocity-step"],
     "Junction velocity: largest velocity step of each axis at a corner; without it corners are exact stops."),
)  # fmt: skip


def _of_axis(limit: str) -> Value:
    return Value(limit, lambda text: _of_axes(limit, text))


def limits_alone(default: str = "") -> Callable[[F], F]:
    """Options of limits; `default` is where limits come from that are not given, the paper's values if empty."""
    file = f"Limits in a TOML file; options replace single ones.{f'  [default: {default}]' if default else ''}"
    return _all(
        click.option("--limits", "limits_file", metavar="FILE", help=file),
        *(
            quantity(*flags, name, kind=kind, text=f"{text}  [default: {paper}]" if paper and not default else text)
            for name, kind, flags, text, paper in _LIMITS
        ),
        *(
            click.option(*flags, name, type=_of_axis(name), metavar="LIMIT", help=text)
            for name, flags, text in _AXIS_LIMITS
        ),
        click.option(
            "--travel",
            type=Value("x=low:high", _travel),
            metavar="AXIS=LOW:HIGH",
            help="Soft limits of position: x=0:500,y=0:300.",
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

tangential = click.option(
    "--3d", "tangential", is_flag=True, help="A third axis, theta, follows the tangent of a planar path."
)

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
    along = {name: given[name] for name, *_ in _LIMITS if given[name] is not None}
    by_axis = {name: given[name] for name, *_ in _AXIS_LIMITS if given[name] is not None}
    out = {key: value for key, value in flat.items() if key.partition(".")[0] not in by_axis} | along
    for values in (*by_axis.values(), given["travel"] or {}):
        out |= values
    return out


_READING = ("which", "layer", "units", "chord", "edges", "dialect", "start", "offsets", "tools", "repair", "from_line",
            "tolerance")  # fmt: skip


def reading_from(given: Mapping[str, Any]) -> dict[str, Any]:
    """How to read a SOURCE, from what the options of `reading` were `given`."""
    return {name: given[name] for name in _READING if given.get(name) not in (None, False)}
