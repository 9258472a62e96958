"""What a user should know of a motion before it is planned: corners at which it stops, and places that are assumed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from splinefeed.machine.machine import Machine
from splinefeed.paths.path import Path
from splinefeed.paths.path_parts import PathParts
from splinefeed.paths.smoothing import PROGRAM, SMOOTHING_CORNER_ANGLE
from splinefeed.records import Array, Limits

#: What is counted of a program that is read in parts.
MOVES = "moves"
#: By how much corners turn at most that smoothing passes unless it is said, in words.
MILD = f"{math.degrees(SMOOTHING_CORNER_ANGLE):g} deg"

#: Where the zero of a program is taken to lie in the travel of a machine.
ZERO = (
    "travel is checked with the zero of the program at that of the machine, which is assumed; --offsets G54=X,Y,Z says "
    "where it lies"
)


def at_corners(path: Path | PathParts, limits: Limits, machine: Machine | None, how: Mapping[str, Any]) -> list[str]:
    """Say at how many corners the tool stops, what else would pass them, and how to smooth them.

    Parameters
    ----------
    path : Path or PathParts
        To be driven.
    limits : Limits
        That hold.
    machine : Machine or None
        Whose control passes corners, or not.
    how : mapping of str to object
        How the path was smoothed, as `settings.smooth` takes it.

    Returns
    -------
    list of str
        One sentence each.

    Notes
    -----
    Corners where nothing but the direction stops the tool count: those beside rapid moves, and where a program waits,
    are stops whatever is smoothed. Of a path in parts their number is not known.
    """
    if limits.axis_velocity_step is not None:
        return []
    if path.in_parts is not None:
        if "smooth" in how or path.in_parts.unit != MOVES:  # a table is smoothed
            return []
        which, rest = f"those that turn by {MILD} at most", ", and with --corners round the others"
        return ["the tool stops exactly at each corner", _how(which, rest, path.in_parts.tolerance, machine)]
    angles = _passable(path.tip_path)
    if not len(angles):
        return []
    count, mild = len(angles), int(np.count_nonzero(angles <= SMOOTHING_CORNER_ANGLE))
    stops = f"{count} corner{'s' * (count > 1)}"
    if "smooth" in how:
        rounded = how.get("corners", "round" if how["smooth"] == PROGRAM else "keep") == "round"
        said = f"the tool still stops exactly at {stops}, which smoothing keeps"
        return [said if rounded else f"{said}; --corners round passes what is not a reversal, too"]
    top = None if path.tolerances is None else float(path.tolerances.max(initial=0.0))
    which = "corners" if mild in (0, count) else f"{mild} of them, which turn by {MILD} at most,"
    rest = "" if mild == count else ", and with --corners round the others" if mild else ", with --corners round"
    return [f"the tool stops exactly at {stops}{_at_feeds(path, limits)}", _how(which, rest, top, machine)]


def at_zero(path: Path | PathParts, limits: Limits, how: Mapping[str, Any]) -> list[str]:
    """Say where a program's zero is taken to lie in a machine's travel, if nobody said it.

    Parameters
    ----------
    path : Path or PathParts
        Of a program, or not.
    limits : Limits
        With travel, or without.
    how : mapping of str to object
        How the program was read: `offsets` say where its zero lies.

    Returns
    -------
    list of str
        One sentence, or none.
    """
    programmed = path.in_parts.unit == MOVES if path.in_parts is not None else path.tip_path.lines is not None
    return [ZERO] if limits.travel and programmed and "offsets" not in how else []


def _how(which: str, rest: str, tolerance: float | None, machine: Machine | None) -> str:
    """What passes corners, and how to smooth `which` of them; rest: what others need."""
    if tolerance:
        words = f"G64 P{tolerance:g}" if tolerance < math.inf else "G64"
        return f"the program allows smoothing ({words}), which is off; turn it on with --smooth program"
    said = "" if tolerance is None else "the program asks for exact stops (G61); "
    if tolerance is None and machine is not None and machine.control is not None and machine.control.passing:
        said = f"the control of {machine.name} passes corners ({machine.control.passing}), as splinefeed time counts; "
    return f"{said}--smooth LENGTH, such as 0.01mm, passes {which} within that tolerance{rest}"


def _at_feeds(path: Any, limits: Limits) -> str:
    """How long what is cut takes at its feeds alone, in words; nothing where it has none."""
    feeds = np.full(len(path.curves), limits.feed)
    cut = np.isfinite(feeds) if path.feeds is None else np.isfinite(path.feeds)
    feeds = feeds if path.feeds is None else np.minimum(feeds, path.feeds)
    if not cut.any():
        return ""
    lengths = np.diff(path.tip_length(path.curve_starts))
    what = "the path takes" if cut.all() else "its feed moves take"
    return f"; at the feeds alone {what} {np.sum(lengths[cut] / feeds[cut]):.4g} s"


def _passable(path: Path) -> Array:
    """By how much the corners turn, rad, at which the direction alone stops the tool, (k,)."""
    corners = path.corners
    stop = corners.stop.copy()
    waits = {float(path.curve_starts[marker.before]) for marker in path.markers if marker.stop}
    stop &= ~np.isin(corners.s, list(waits))
    if path.feeds is not None:
        behind = np.searchsorted(path.curve_starts, corners.s, side="right") - 1
        at = np.isin(corners.s, path.curve_starts)
        for curve in (behind, np.where(at, behind - 1, behind)):
            stop &= np.isfinite(path.feeds[np.clip(curve, 0, len(path.feeds) - 1)])
    return np.asarray(corners.angle[stop])
