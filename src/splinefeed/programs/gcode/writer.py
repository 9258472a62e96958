"""A path as a program: lines, arcs and splines with the words that a control has for them.

What a control has no word for is approximated within `tolerance` and measured both ways against the curve itself.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from operator import attrgetter

from splinefeed import units
from splinefeed.errors import InputError
from splinefeed.files.atomic import atomic_write
from splinefeed.paths.each_curve import Marker
from splinefeed.paths.path import Path
from splinefeed.paths.resolution import RESOLUTION
from splinefeed.programs.gcode.moves import LETTERS
from splinefeed.programs.gcode.write_curves import CONTROLS, WrittenText
from splinefeed.records import ROTARY_AXES
from splinefeed.records.limits import positive

#: How far what is approximated may be from the curve unless the caller says otherwise, mm.
DEFAULT_TOLERANCE = 1e-3
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
    """Write paths as one program.

    Parameters
    ----------
    paths : sequence of Path
        To be written, one behind the other.
    target : str or PathLike
        The file.
    dialect : str, optional
        linuxcnc, fanuc, siemens, mach3 or printer.
    as_ : str, optional
        What curves become: g5.2, g6.2, bspline, arcs or g1; the default is the first that the dialect has.
    tolerance : float or str, optional
        Of what has to be approximated, mm.
    feed : float or str, optional
        Where the path says none, mm/s.
    decimals : int, optional
        Of numbers, 1 to 17.

    Returns
    -------
    list of str
        What is approximated, left out or rounded, one sentence each.

    Raises
    ------
    InputError
        For options that do not go together, and axes that have no letter.
    """
    if dialect not in CONTROLS:
        raise InputError(f"dialect {dialect!r} cannot be written; there are {', '.join(CONTROLS)}")
    control = CONTROLS[dialect]
    form = control.forms[0] if as_ is None else as_.lower()
    if form not in control.forms:
        raise InputError(f"{as_!r} is no form of {dialect} (option as); choose from {', '.join(control.forms)}")
    allowed = positive(units.parse(tolerance, "length"), "tolerance", RESOLUTION)
    places = control.decimals if decimals is None else decimals
    if isinstance(places, bool) or not isinstance(places, int) or not 1 <= places <= 17:
        raise InputError(f"decimals is {places!r}; expected a whole number from 1 to 17")
    speed = None if feed is None else units.parse(feed, "feed")
    text = WrittenText(dialect, form, allowed, places)
    for number, path in enumerate(paths, start=1):
        letters = _letters(path, text)
        if number > 1:
            text.said.say(f"path {number} begins elsewhere: a straight rapid move leads there")
        _write_path(path, letters, text, speed)
    ended = not _ENDS.isdisjoint(text.lines)
    text.lines += [line for line in control.footer if not (ended and line in _ENDS)]
    with atomic_write(target) as temporary:
        temporary.write_text("\n".join([*text.lines, ""]), encoding="ascii")
    return text.findings()


def _letters(path: Path, text: WrittenText) -> list[str]:
    """The letter of each axis; InputError for one that has none."""
    letters = ["C" if axis == "theta" else axis.upper() for axis in path.axes]
    for axis, letter in zip(path.axes, letters, strict=True):
        if letter not in LETTERS:
            raise InputError(
                f"axis {axis!r} has no letter in a program; name the axes x, y, z, u, v, w and a, b, c (or theta)"
            )
    if len(set(letters)) < len(letters):
        raise InputError(f"axes {path.axes}: theta and c would both be written as C")
    if "theta" in path.axes:
        text.said.say("axis theta is written as C")
    return letters


def _write_path(path: Path, letters: list[str], text: WrittenText, feed: float | None) -> None:
    first = path.curves[0]
    start = first.control_points[0] if first.clamped else path(0.0)
    text.begin_path(letters, [axis in ROTARY_AXES for axis in path.axes], start)
    markers = sorted(path.markers, key=attrgetter("before"))
    for i, curve in enumerate(path.curves):
        while markers and markers[0].before <= i:
            _write_marker(markers.pop(0), text, last=False)
        if path.tolerances is not None and text.control.exact:
            text.change("path_control", _path_control(float(path.tolerances[i]), text))
        speed = feed if path.feeds is None else float(path.feeds[i])
        if speed is None:
            text.said.say("no feed is given, and most controls refuse lines without F; give the option feed")
        if speed == math.inf and text.control.g0_at_f:
            text.said.say("a rapid move is written as G0, which a printer moves at the feed in force")
        if speed == math.inf and curve.degree > 1:
            text.said.say("a rapid move along a curve is written at the feed in force")
        text.write_curve(i, curve, speed)
    for marker in markers:
        _write_marker(marker, text, last=True)


def _write_marker(marker: Marker, text: WrittenText, last: bool) -> None:
    """M, S and T as they were; a dwell, and a rest without one, as G4."""
    text.motion = ""
    if marker.text:
        if not (marker.text.isascii() and marker.text.isprintable()):
            raise InputError(f"marker {marker.text[:40]!r} is not a line of G-code; use plain letters and digits")
        if marker.text in _ENDS and not last:
            text.said.say(f"{marker.text} is inside the path and is left out")
            return
        words = marker.text.split()
        if text.control.g0_at_f:  # the command comes first
            words.sort(key=lambda word: word[0] not in "MT")
        text.lines.append(" ".join(words))
    if marker.dwell > 0.0 or (not marker.text and marker.stop):
        text.lines.append(f"G4 {text.control.dwell}{text.number(marker.dwell)}")


def _path_control(tolerance: float, text: WrittenText) -> str:
    """G61 for an exact path, G64 with P for how far it may be left."""
    if tolerance == 0.0:
        return text.control.exact
    if text.control.within and math.isfinite(tolerance):
        return f"G64 {text.control.within}{text.number(tolerance)}"
    if math.isfinite(tolerance):
        text.said.say(f"{text.dialect} has no word for a path tolerance: G64 is written without P")
    return "G64"
