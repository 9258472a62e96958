"""A path as a program: lines, arcs and splines with the words that a control has for them.

What a control has no word for is approximated within `tolerance` and measured both ways against the curve itself.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence

from splinefeed import units
from splinefeed.errors import InputError
from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.gcode.moves import LETTERS
from splinefeed.formats.gcode.text import DECIMALS, Text
from splinefeed.formats.gcode.write_curves import Task, write_curve
from splinefeed.formats.metadata import to_degrees
from splinefeed.geometry.path import Marker, Path
from splinefeed.records import ROTARY_AXES

#: How far what is approximated may be from the curve unless the caller says otherwise, mm.
DEFAULT_TOLERANCE = 1e-3
#: Spline words of each dialect that is written, the default first.
FORMS = {
    "linuxcnc": ("g5.2", "g6.2", "arcs", "g1"),
    "fanuc": ("g6.2", "arcs", "g1"),
    "siemens": ("bspline", "arcs", "g1"),
    "mach3": ("arcs", "g1"),
    "printer": ("g1", "arcs"),
}
#: First lines, by which a reader recognizes the dialect.
_HEADERS = {
    "linuxcnc": ("G17 G21 G40 G49 G80 G90 G91.1 G94",),
    "fanuc": ("%", "O0001", "G17 G21 G40 G49 G80 G90 G94"),
    "siemens": ("; SINUMERIK", "G17 G71 G40 G90 G94"),
    "mach3": ("(Mach3)", "G17 G21 G40 G49 G80 G90 G91.1 G94"),
    "printer": (";FLAVOR:Marlin", "G21", "G90"),
}
#: Letter of a wait in seconds.
_DWELL = {"fanuc": "X", "siemens": "F", "printer": "S"}
_ENDS = {"M2", "M30"}


def write(
    paths: Sequence[Path],
    target: str | os.PathLike[str],
    *,
    dialect: str = "linuxcnc",
    as_: str | None = None,
    tolerance: float | str = DEFAULT_TOLERANCE,
    feed: float | str | None = None,
    decimals: int | None = None,
) -> list[str]:
    """Write `paths` as one program; what is approximated, left out or rounded comes back, one sentence each.

    dialect    linuxcnc, fanuc, siemens, mach3 or printer
    as_        what curves become: g5.2, g6.2, bspline, arcs or g1; the default is the first that the dialect has
    tolerance  mm, for what has to be approximated; feed  mm/s, where the path says none; decimals  of numbers

    Raises InputError for options that do not go together and axes that have no letter.
    """
    if dialect not in FORMS:
        raise InputError(f"dialect {dialect!r} cannot be written; there are {', '.join(FORMS)}")
    form = FORMS[dialect][0] if as_ is None else as_.lower()
    if form not in FORMS[dialect]:
        raise InputError(f"{as_!r} is no form of {dialect} (option as); choose from {', '.join(FORMS[dialect])}")
    allowed = units.parse(tolerance, "length")
    if allowed <= 0.0:
        raise InputError(f"tolerance is {allowed:g} mm; it must be greater than 0")
    places = DECIMALS[dialect] if decimals is None else decimals
    if isinstance(places, bool) or not isinstance(places, int) or not 1 <= places <= 17:
        raise InputError(f"decimals is {places!r}; expected a whole number from 1 to 17")
    text = Text(dialect, places)
    text.lines += _HEADERS[dialect]
    for number, path in enumerate(paths, start=1):
        letters = _letters(path, text)
        if number > 1:
            text.said.say(f"path {number} begins elsewhere: a straight rapid move leads there")
        speed = None if feed is None else units.parse(feed, "feed")
        _write_path(path, letters, text, form, allowed, speed)
    if not text.ended:
        text.lines.append("M30" if dialect in ("fanuc", "siemens") else "M2")
    if dialect == "fanuc":
        text.lines.append("%")
    with atomic_write(target) as temporary:
        temporary.write_text("\n".join([*text.lines, ""]), encoding="ascii")
    return text.findings()


def _letters(path: Path, text: Text) -> list[str]:
    """The letter of each axis; InputError for one that has none."""
    letters = []
    for axis in path.axes:
        letter = "C" if axis == "theta" else axis.upper()
        if letter not in LETTERS:
            raise InputError(
                f"axis {axis!r} has no letter in a program; name the axes x, y, z, u, v, w and a, b, c (or theta)"
            )
        if axis == "theta":
            text.said.say("axis theta is written as C")
        letters.append(letter)
    if len(set(letters)) < len(letters):
        raise InputError(f"axes {path.axes}: theta and c would both be written as C")
    return letters


def _write_path(path: Path, letters: list[str], text: Text, form: str, tolerance: float, feed: float | None) -> None:
    start = to_degrees(path.curves[0].control_points[:1] if path.curves[0].clamped else path(0.0)[None], path.axes)[0]
    text.break_motion()
    text.move("G0", text.places(letters, start, every=True), None)
    markers = _by_place(path.markers)
    rotary = [axis in ROTARY_AXES for axis in path.axes]
    for i, curve in enumerate(path.curves):
        _write_markers(markers.get(i, []), text, last=False)
        if path.tolerances is not None:
            _write_control(float(path.tolerances[i]), text)
        speed = feed if path.feeds is None else float(path.feeds[i])
        if speed is None:
            text.said.say("no feed is given, and most controls refuse lines without F; give the option feed")
        rapid = speed is not None and math.isinf(speed)
        if rapid and curve.degree > 1:
            text.said.say("a rapid move along a curve is written at the feed in force")
        write_curve(Task(i, curve, letters, rotary, form, tolerance, None if rapid else speed, rapid), text)
    _write_markers(markers.get(len(path.curves), []), text, last=True)


def _by_place(markers: Sequence[Marker]) -> dict[int, list[Marker]]:
    places: dict[int, list[Marker]] = {}
    for marker in markers:
        places.setdefault(marker.before, []).append(marker)
    return places


def _write_markers(markers: Sequence[Marker], text: Text, last: bool) -> None:
    """M, S and T as they were; a dwell, and a rest without one, as G4."""
    for marker in markers:
        if marker.text:
            if not (marker.text.isascii() and marker.text.isprintable()):
                raise InputError(f"marker {marker.text[:40]!r} is not a line of G-code; use plain letters and digits")
            if marker.text in _ENDS and not last:
                text.said.say(f"{marker.text} is inside the path and is left out")
                continue
            text.lines.append(marker.text)
            text.ended |= marker.text in _ENDS
        if marker.dwell > 0.0 or (not marker.text and marker.stop):
            text.lines.append(f"G4 {_DWELL.get(text.dialect, 'P')}{text.number(marker.dwell)}")
    if markers:
        text.break_motion()


def _write_control(tolerance: float, text: Text) -> None:
    """G61 for an exact path, G64 with P for how far it may be left."""
    if text.dialect == "printer":
        return
    exact = {"siemens": "G60"}.get(text.dialect, "G61")
    if tolerance == 0.0:
        said = exact
    elif math.isinf(tolerance) or text.dialect != "linuxcnc":
        said = "G64"
        if math.isfinite(tolerance):
            text.said.say(f"{text.dialect} has no word for a path tolerance: G64 is written without P")
    else:
        said = f"G64 P{text.number(tolerance)}"
    if said != text.control:
        text.lines.append(said)
        text.control = said
