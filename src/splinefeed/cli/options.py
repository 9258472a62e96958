"""Options that several commands share, and quantities with units as their values."""

from __future__ import annotations

import os
import re
import sys
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeVar

import click

import splinefeed as sf
from splinefeed import units
from splinefeed.errors import InputError
from splinefeed.files.sizes import MAX_STANDARD_INPUT_BYTES
from splinefeed.limit_table import BY_AXIS, TABLE, LimitKind
from splinefeed.numbers import finite

F = TypeVar("F", bound=Callable[..., Any])

#: Said at the end of every help text in which quantities occur.
UNITS_NOTE = "Quantities may carry a unit (3600mm/min, 50mm/s^2, 1ms); bare numbers are mm and s."


class Value(click.ParamType):  # type: ignore[type-arg]  # only newer versions of click have it
    """What a function makes of the text of an option; its InputError is one of usage."""

    name = "value"

    def __init__(self, read: Callable[[str], Any]) -> None:
        self._read = read

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The value, in mm, s and rad."""
        try:
            return self._read(value)
        except InputError as error:
            raise click.BadParameter(str(error), ctx, param) from None


def _quantity(kind: str) -> Value:
    """A number with or without a unit, as `units.parse` reads it; `kind` is one of its kinds."""
    unit = units.KINDS[kind].base.replace("rad", "deg")  # of a number without one
    return Value(lambda value: units.parse(value, kind, unit))


def _names(text: str) -> tuple[str, ...]:
    """A list of names between commas, each once."""
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not names:
        raise InputError("no name is given; write for example taylor-2,milne-simpson")
    return names


def _of_axes(limit: str, text: str) -> dict[str, Any]:
    """A limit of every linear axis, `2000`, of each in the path's order, `2000,90deg/s^3`, or of `x=2000,a=90deg/s^3`.

    As `Limits.as_dict` has it; values in the path's order stay a list of texts until the axes are known.
    """
    from splinefeed.machine import limits_toml

    if "=" in text:
        named = limits_toml.by_axis(text)
        return {f"{limit}.{axis}": limits_toml.axis_value(limit, axis, value) for axis, value in named}
    if "," in text:
        listed = {limit: [each.strip() for each in text.split(",")]}
        limits_toml.in_order(listed, ())  # refuses what is no quantity
        return listed
    return {limit: limits_toml.axis_value(limit, "x", text)}


def _travel(text: str) -> dict[str, float]:
    """Soft limits of axes, `x=0:500,theta=-90:90`, as `Limits.as_dict` has them."""
    from splinefeed.machine.limits_toml import by_axis, travel_of
    from splinefeed.records import TRAVEL_ENDS

    found: dict[str, float] = {}
    try:
        for axis, ends in by_axis(text):
            positions = travel_of(axis, list(ends.partition(":")[::2]))
            found |= {f"{end}.{axis}": position for end, position in zip(TRAVEL_ENDS, positions, strict=True)}
    except InputError as error:
        raise InputError(f"{error}; write for example x=0:500") from None
    return found


def _percent(text: str) -> float:
    try:
        return finite(text.removesuffix("%"))
    except InputError:
        raise InputError(f"{text!r} is not a percentage; write for example 80%") from None


#: Kinds of values of options by what the help calls them; any other word in capitals is a text.
_TYPES: dict[str, Any] = {
    **{kind.upper(): _quantity(kind) for kind in units.KINDS},
    "NAMES": Value(_names),
    "INTEGER": int,
    "COUNT": click.IntRange(0),
    "NUMBER": Value(finite),
    "DEGREES": click.FloatRange(0.0, 180.0, min_open=True),
    "AXIS=LOW:HIGH": Value(_travel),
    "PERCENT": Value(_percent),
    "LENGTH|program": Value(lambda text: text if text == "program" else units.parse(text, "length")),
}


def _rows(text: str) -> list[list[str]]:
    """The rows of a table: flags and parameter name, what they take, and the help."""
    rows = [re.split(r" {2,}", line, maxsplit=2) for line in re.sub(r"\n +", " ", text).splitlines() if line]
    return [[*row, ""][:3] for row in rows]


def _parameter(names: str) -> str:
    return names.split()[-1].lstrip("-").replace("-", "_")


def table(text: str) -> Callable[[F], F]:
    """What a command takes, a row each: flags and name, what they take, and the help, which may go on in the next line.

    What they take is `-` for a switch, a key of _TYPES, choices in small letters between bars, or any word for a text.
    Behind it stand `!` for an option that is required, `*` for one that may be repeated, `=` and a default. A name
    without dashes is an argument, which may be left out if what it takes is in brackets; `...` takes several.
    """

    def decorate(function: F) -> F:
        for names, takes, words in reversed(_rows(text)):
            takes, _, default = takes.partition(" =")
            more: dict[str, Any] = {"required": takes.endswith("!"), "multiple": takes.endswith("*")}
            if default:
                more |= {"default": [default] if more["multiple"] else default, "show_default": True}
            takes = takes.rstrip("!*")
            kind: dict[str, Any] = {"type": _TYPES.get(takes), "metavar": takes}
            if takes == "-":
                kind = {"is_flag": True}
            elif takes.islower():
                kind = {"type": click.Choice(takes.split("|"))}
            elif takes == "LIMIT":
                kind["type"] = Value(partial(_of_axes, _parameter(names)))
            if names.startswith("-"):
                function = click.option(*names.split(), help=words, **more, **kind)(function)
            else:
                many = -1 if takes.endswith("...") else 1
                kind["callback"] = _from_standard_input
                function = click.argument(names, required=takes[0] != "[", nargs=many, **kind)(function)
        return function

    return decorate


def _from_standard_input(ctx: click.Context, parameter: click.Parameter, value: Any) -> Any:
    """What an argument says; for `-` a file with all of standard input, which goes when the command ends."""
    if value != "-":
        return value
    folder = ctx.with_resource(tempfile.TemporaryDirectory(prefix="splinefeed-"))
    file = os.path.join(folder, "standard-input")
    left = MAX_STANDARD_INPUT_BYTES
    with open(file, "wb") as stream:
        while block := sys.stdin.buffer.read(2**20):
            left -= len(block)
            if left < 0:
                raise InputError(
                    f"standard input is longer than {MAX_STANDARD_INPUT_BYTES / 2**20:g} MB; give the name of a file"
                )
            stream.write(block)
    return file


as_json = table("--json as_json  -  Print one JSON object, and nothing else, on stdout.")

#: Files of figures, and none of them.
figures = table("""
--figures  svg|png|pdf* =svg  Format of the figures; may be repeated.
--no-figures  -  Draw nothing.
""")


def figure_formats(given: Mapping[str, Any]) -> tuple[str, ...]:
    """Formats of the figures, none with --no-figures."""
    return () if given["no_figures"] else given["figures"]


#: How a G-code program is read.
_PROGRAM = """
--dialect  NAME             G-code: the control, if the program does not show it.
--start    X,Y,Z,...        G-code: tool position before the first line, mm and deg.
--offsets  G54=X,Y,Z;...    G-code: work offsets.  [default: at 0]
--tools    FILE             G-code: tool table (.tbl); G43 takes tool lengths from it.
--increments  -             G-code of Fanuc: axis words without a decimal point count 0.001 mm.
--units    UNIT             G-code: mm or in, where no line says it (G20, G21); DXF: mm, in, ..., overrides the
                            file; SVG: what a px is (pt).
--repair   -                Repair what is safe to repair in a faulty file, and list it.
"""
_FROM_LINE = """
--from-line  N              G-code: resume the program at this line, with the modes in force there.
"""
#: How a SOURCE is read, but for the tolerance.
_READING_ALONE = f"""
--path which  NAME|NUMBER   Which path of a file that holds several (from 1).
--layer    NAME,NAME        DXF, 3DM, SVG (groups): only these layers.
--hidden   -                Drawings: read what they do not show (layers off, no paint), too.
--chord    LENGTH           Airfoil .dat: length of one unit of the file.  [default: 100 mm]
--edges    -                STEP, IGES, 3DM: edges of faces as well as free curves.
{_PROGRAM.strip()}
{_FROM_LINE.strip()}
"""
#: How a SOURCE is read.
_READING = f"""{_READING_ALONE}
--tolerance  LENGTH         Airfoil .dat, points .csv .xyz: largest distance of the fit.  [default: 0.001 mm]
                            Drawings, CAD, JSON: ends closer than this are joined.  [default: 1e-6 mm]
"""
#: How the path is smoothed.
_SMOOTHING = """
--smooth   LENGTH|program   Replace short lines and corners by curves within this tolerance; `program`: that of its
                            G64 P.
--corners  keep|round       What --smooth does at corners sharper than --corner-angle.
                            [default: keep; round for `program`]
--corner-angle  DEGREES     Joints that turn by more than this are corners.  [default: 45]
--angle-tolerance  ANGLE    How far --smooth may turn the tool axis, or rotary axes: 0.1deg, 1mrad.  [default: 0.05 deg]
"""
#: How several contours become one motion.
_LINKING = """
--clearance  LENGTH         Drawings of several contours: z of the rapid moves between them.  [default: that of the
                            machine; else laser off]
--cut-feed  FEED            ... their feed, and the most of a program's feed moves; --feed is then that of rapid moves,
                            too.  [default: --feed]
--first    NAME|NUMBER      ... the one to begin with (from 1).
--keep-order  -             ... in the order of the file, each from where it is drawn.
"""
_TANGENTIAL = "--3d tangential  -  A third axis, theta, follows the tangent of a planar path."
reading_program, from_line, reading_alone = map(table, (_PROGRAM, _FROM_LINE, _READING_ALONE))
reading, smoothing, linking, tangential = map(table, (_READING, _SMOOTHING, _LINKING, _TANGENTIAL))
#: Options of programs; the registry says which of the others are none of theirs.
OF_PROGRAMS = {_parameter(names) for names, *_ in _rows(_PROGRAM + _FROM_LINE)}
LINKS = [_parameter(names) for names, *_ in _rows(_LINKING)]
SMOOTHS = [_parameter(names) for names, *_ in _rows(_SMOOTHING)]
_READS = [_parameter(names) for names, *_ in _rows(_READING + _TANGENTIAL + _LINKING)]

#: A CSV of setpoints, and the path that they were made along.
setpoints_csv = table("""
--columns  NAMES            CSV without names: its columns, as t,x,y.
--period   TIME             CSV: the period.  [default: from t]
""")
setpoints_path = table("""
--path source  FILE|SHAPE   The path.  [default: that of the setpoints]
--which    NAME|NUMBER      Which path of a file that holds several (from 1).
--chord    LENGTH           Airfoil .dat: one unit of the file.
""")


def reading_from(given: Mapping[str, Any]) -> dict[str, Any]:
    """Collect how to read a SOURCE, smooth it and give it a tangential axis.

    Parameters
    ----------
    given : mapping
        Values of these options.

    Returns
    -------
    dict of str to object
        Arguments of `read_path`.

    Raises
    ------
    InputError
        For how to smooth without by how much.
    """
    said = {
        name: given[name] for name in (*_READS, *SMOOTHS) if given.get(name) is not None and given[name] is not False
    }
    if "smooth" not in said and (alone := [name for name in SMOOTHS if name in said]):
        raise InputError(f"--{alone[0].replace('_', '-')}: needs --smooth; give --smooth LENGTH too")
    return said


#: Shorter flags of limits, and what the paper's experiment assumes of them where a command assumes anything.
_SHORT = {
    "acceleration": "--accel",
    "deceleration": "--decel",
    "deceleration_jerk": "--decel-jerk",
    "axis_acceleration": "--axis-accel",
}
_PAPER = {
    "feed": "60 mm/s",
    "acceleration": "50 mm/s^2, or none where axes have limits",
    "deceleration": "as --accel",
    "jerk": "2000 mm/s^3, or none where axes have limits",
    "deceleration_jerk": "as --jerk",
    "start_feed": "0",
    "end_feed": "0",
}


def _limit_row(kind: LimitKind, paper: bool) -> str:
    """The row of a limit's option."""
    flags = [_SHORT.get(kind.name, ""), f"--{kind.name.replace('_', '-')}", kind.name]
    takes = "LIMIT" if kind.name in BY_AXIS else kind.quantity.upper()
    usual = f"  [default: {_PAPER[kind.name]}]" if paper and kind.name in _PAPER else ""
    return f"{' '.join(flags).strip()}  {takes}  {kind.says}{usual}"


def limits_alone(default: str = "", more: str = "") -> Callable[[F], F]:
    """Options of limits; `default` is where limits come from that are not given, the paper's values if empty."""
    file = f"  [default: {default}]" if default else ""
    rows = [f"--limits limits_file  FILE  Limits in a TOML file; options replace single ones.{file}"]
    rows += [_limit_row(kind, not default) for kind in TABLE if kind.says]
    rows.append("--travel  AXIS=LOW:HIGH  Soft limits of position: x=0:500,y=0:300.")
    return table("\n".join(rows) + more)


#: What the motion along the path must never exceed, the servo period, and who plans it.
limits = limits_alone(
    more="""
--period  TIME              Servo period: one setpoint each.  [default: 1 ms]
--strategy  NAME            How to plan.  [default: automatic: seven-phase for feed, acceleration and jerk along the
                            path alone, else time-optimal]
"""
)
machine = table("""
--machine  NAME|FILE        A machine file or a built-in machine; its axis limits apply unless others are given. See
                            splinefeed machine.
""")
corrections = table("--corrections  INTEGER =1  Passes of a method's corrector, 0 to 100.")


def said_limits(given: Mapping[str, Any], otherwise: Mapping[str, float]) -> dict[str, Any]:
    """Limits as `Limits.as_dict` has them: those of the file of limits, or `otherwise`, options in their place.

    Values in the path's order stay lists; `completed` names their axes.
    """
    from splinefeed.files.source import read_text, toml_of
    from splinefeed.machine import limits_toml
    from splinefeed.records import field_of

    file, out = given["limits_file"], dict(otherwise)
    if file:
        out = limits_toml.flat_of(toml_of(read_text(file), str(file)), str(file))
    for name in (*limits_toml.KINDS, "travel"):
        if isinstance(value := given[name], dict):
            out = {key: old for key, old in out.items() if field_of(key) != name} | value
        elif value is not None:
            out[name] = value
    return out


def machine_under(given: Mapping[str, Any], *, otherwise: bool = False) -> tuple[sf.Machine, list[str]]:
    """Make the machine of --machine, under the limits of --limits FILE or made of them alone.

    Parameters
    ----------
    given : mapping
        Values of these options.
    otherwise : bool, optional
        Whether the usual machine is taken where neither is given.

    Returns
    -------
    machine : Machine
        The machine.
    notes : list of str
        On it.
    """
    from splinefeed.machine import limits_toml
    from splinefeed.machine.under import under
    from splinefeed.machine.usual import usual

    machine = sf.Machine.load(given["machine"]) if given["machine"] else None
    file = given["limits_file"]
    if file is None:
        if machine is None and not otherwise:
            raise InputError("no machine is given; add --machine NAME|FILE (splinefeed machine list) or --limits FILE")
        if machine is None:
            found, said = usual()
            return found, [said]
        return machine, []
    made, unused = under(limits_toml.read(file), machine, os.path.splitext(os.path.basename(file))[0])
    return made, [f"{file}: {', '.join(unused)}: not used here"] if unused else []
