"""What a user's settings mean for a path: which limits hold, and how it is smoothed, with the proof."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.machine import limits_toml
from splinefeed.machine.machine import Machine
from splinefeed.paths.path import Path
from splinefeed.paths.path_parts import PathParts
from splinefeed.paths.track import Track
from splinefeed.records import BY_AXIS, Limits, by_name, field_of

#: The paper's experiment: f = 60 mm/s, A = D = 50 mm/s^2, J = 2000 mm/s^3, one setpoint a millisecond.
PAPER_LIMITS = Limits(feed=60.0, acceleration=50.0, jerk=2000.0)
PAPER_PERIOD = 1e-3
PAPER_SHAPE = "naca:0025?perimeter=33"
#: Stands for a feed, mm/s, where the program of the path says it.
ANY_FEED = 1e9
#: How fast rapid moves are.
RAPID_AS_AXES = "rapid moves as fast as the velocities of the axes allow"
NO_RAPID = "velocities of the axes are not known; give --machine or --axis-velocity"
#: What follows where a limit is missing.
MISSING = {
    "acceleration": "speed changes as fast as the other limits allow; give --machine, --axis-accel or --accel",
    "jerk": "acceleration changes in steps, whose jerk grows as the period gets shorter; give --axis-jerk or --jerk",
}


def planned_axes(path: Track | PathParts, machine: Machine | None) -> tuple[str, ...]:
    """Give the names that limits are for.

    Parameters
    ----------
    path : Track or PathParts
        To be planned.
    machine : Machine or None
        With kinematics, for a path with a tool axis.

    Returns
    -------
    tuple of str
        Axes of the path, or joints of the machine that a tool path is planned in.
    """
    if path.needs_machine and machine is not None and machine.kinematics is not None:
        return machine.kinematics.joints
    return path.axes


def completed(flat: Mapping[str, Any], machine: Machine | None, axes: Sequence[str], *, assume: bool = True) -> Limits:
    """Make limits of those that are given, over those that a machine has for the axes.

    Parameters
    ----------
    flat : mapping of str to object
        Limits as `Limits.as_dict` has them, or lists of quantities in the order of the axes, as files have them.
    machine : Machine or None
        Whose limits hold where none are given.
    axes : sequence of str
        Of the path, or joints.
    assume : bool, optional
        Whether the paper's stand in along the path where none are said, those of acceleration and jerk only without
        such limits of the axes.

    Returns
    -------
    Limits
        mm, rad and s.

    Raises
    ------
    LimitsError
        For a list that does not fit the axes, and for a number over a machine's where all of them turn.
    """
    out: dict[str, float] = {}
    own = {} if machine is None else machine.limits(axes)
    for name, values in own.items():
        out |= {f"{name}.{axis}": value for axis, value in values.items()}
    for name, value in limits_toml.in_order(flat, axes).items():
        each = name in BY_AXIS and own.get(name)  # one number is for every linear axis
        out |= {f"{name}.{axis}": one for axis, one in by_name(name, value, axes).items()} if each else {name: value}
    if assume:
        kinds = {field_of(key) for key in out}
        if not kinds & {"axis_acceleration", "axis_jerk"}:
            out = {"acceleration": PAPER_LIMITS.acceleration, "jerk": PAPER_LIMITS.jerk, **out}
        out = {"feed": PAPER_LIMITS.feed, **out}
    return Limits.from_dict(out)


def limited(
    path: Path | PathParts,
    flat: Mapping[str, Any],
    machine: Machine | None,
    *,
    assume: bool = True,
    rapids_too: bool = False,
) -> tuple[Any, Limits, tuple[str, ...]]:
    """Give a path the feeds that hold, and limits of those that are given.

    Parameters
    ----------
    path : Path or PathParts
        With the feeds of its program, where it has some.
    flat : mapping of str to object
        As `completed` takes it.
    machine : Machine or None
        Whose limits hold where none are given.
    assume : bool, optional
        Whether the paper's stand in where neither the program nor the machine says a limit.
    rapids_too : bool, optional
        Whether a feed that is given is for rapid moves, too.

    Returns
    -------
    path : Path or PathParts
        With its feeds as they are to be, mm/s.
    limits : Limits
        For it.
    notes : tuple of str
        On them, one sentence each.

    Raises
    ------
    LimitsError
        As `completed` raises it.

    Notes
    -----
    A feed that is given is the most of feed moves. Rapid moves are as fast as the velocities of the axes allow where
    each axis has one.
    """
    axes = planned_axes(path, machine)
    said = path.feed_range
    if "feed" not in flat and said is not None:
        # the feed of the program stands in below; here another one, above all, lets all else be checked
        limits, notes = at_programmed_feeds(completed({"feed": ANY_FEED, **flat}, machine, axes, assume=assume), path)
    else:
        limits, notes = completed(flat, machine, axes, assume=assume), []
        if said is not None and said[0] and path.linking is None:
            notes = [_feed_note(limits.feed, said[0])]
        if said is not None and said[1] and not rapids_too:
            if np.isfinite(limits.of_axes("axis_velocity", axes)).all():
                path, limits = fed(path, limits.feed), replace(limits, feed=math.inf)
                notes = [f"{notes[0]}; {RAPID_AS_AXES}" if notes else RAPID_AS_AXES]
            else:
                notes.append(f"rapid moves keep this feed, too: {NO_RAPID}")
    return path, limits, (*notes, *(_assumed(flat, limits) if assume else []), *missing(limits))


def fed(path: Any, feed: float) -> Any:
    """Bound the feeds of a path; rapid moves, of infinite feed, stay.

    Parameters
    ----------
    path : Path or PathParts
        To be driven.
    feed : float
        Of feed moves at the most, mm/s.

    Returns
    -------
    Path or PathParts
        The same where it has no feeds.
    """
    if path.in_parts is not None:
        top, rapids = path.feeds
        return replace(path, feeds=(min(top, feed), rapids), make=lambda: (fed(part, feed) for part in path))
    if path.feeds is None:
        return path
    return path.with_feeds(np.where(np.isfinite(path.feeds), np.minimum(path.feeds, feed), path.feeds))


def speed(value: float) -> str:
    """A feed, mm/s, in words: as programs have it, too."""
    return f"{value:.6g} mm/s ({60.0 * value:.6g} mm/min)"


def _feed_note(feed: float, top: float) -> str:
    """What a feed that is given does to a program whose highest is `top`, mm/s."""
    if feed >= top:
        return f"the feed that is given, {speed(feed)}, slows nothing down: the program's are {speed(top)} at most"
    return f"feed moves run at the program's feeds, but at most at the one that is given, {speed(feed)}"


def _assumed(flat: Mapping[str, Any], limits: Limits) -> list[str]:
    """What to say of limits along the path that nobody gave."""
    given, kept = {field_of(name) for name in flat}, limits.as_dict()
    units = {"feed": "mm/s", "acceleration": "mm/s^2", "jerk": "mm/s^3"}
    usual = {name: getattr(PAPER_LIMITS, name) for name in units}
    found = [
        f"{name} {usual[name]:g} {unit}"
        for name, unit in units.items()
        if name not in given and kept.get(name) == usual[name]
    ]
    return [f"assumed, as nothing else is given: {', '.join(found)}"] if found else []


def missing(limits: Limits) -> list[str]:
    """A sentence for each kind of limit that nothing has: acceleration and jerk, and what follows from it."""
    if limits.models:
        return []
    sums = list((limits.combinations or {}).values())
    found = []
    for name, follows in MISSING.items():
        own = [getattr(limits, name), *(getattr(each, name) for each in sums)]
        if getattr(limits, f"axis_{name}") is None and min(own) == math.inf:
            found.append(f"no {name} limit is given, of path or axes: {follows}")
    return found


def at_programmed_feeds(limits: Limits, path: Path | PathParts) -> tuple[Limits, list[str]]:
    """Complete limits, where no feed is given, for a path whose curves carry the feeds of a program.

    Parameters
    ----------
    limits : Limits
        Of all else.
    path : Path or PathParts
        With the programmed feeds, or none.

    Returns
    -------
    limits : Limits
        The programmed feeds hold. Rapid moves run as fast as the axes can where their velocities are limited, else at
        the highest programmed feed or the paper's, whichever is more. The same for a path without feeds.
    notes : list of str
        What is said of it, one sentence.
    """
    if path.feed_range is None:
        return limits, []
    top, rapids = path.feed_range
    said = f"feed moves run at the program's feeds, {speed(top)} at most" if top else "the program has no F word here"
    if path.linking is not None:
        said = f"contours are cut at {speed(top)}" + ", which is assumed" * (path.linking.feed is None)
    note = f"no feed is given: {said}"
    if not rapids:
        return replace(limits, feed=top), [note]
    if limits.axis_velocity is not None:
        return replace(limits, feed=math.inf), [f"{note}; {RAPID_AS_AXES}"]
    rapid = max(top, PAPER_LIMITS.feed)
    return replace(limits, feed=rapid), [f"{note}; rapid moves at {speed(rapid)}, which is assumed"]


def smooth(path: Path, how: Mapping[str, Any]) -> Path:
    """Smooth a path by a user's settings; its findings state the proof.

    Parameters
    ----------
    path : Path
        To be smoothed.
    how : mapping of str to object
        `smooth`, the tolerance, mm, or PROGRAM, without which the path stays; `corners`; `corner_angle`, degrees;
        `angle_tolerance`, of the tool axis or of rotary axes, rad.

    Returns
    -------
    Path
        Within the tolerance of `path`.

    Raises
    ------
    InputError
        Where a program has no tolerance.
    CurveError
        If the path exceeds it, which is not known to happen.
    """
    if how.get("smooth") is None:
        return path
    from splinefeed.paths.smoothing_proven import smooth as smoothed  # not at every start of the command line

    said = arguments(how, path.tolerances is not None and bool(path.tolerances.any()))
    return smoothed(path, **said)


def arguments(how: Mapping[str, Any], says_tolerance: bool) -> dict[str, Any]:
    """Make settings arguments of what smooths.

    Parameters
    ----------
    how : mapping of str to object
        As `smooth` takes it, with a tolerance.
    says_tolerance : bool
        Whether the program says one (G64 P).

    Returns
    -------
    dict of str to object
        Lengths in mm, angles in rad.

    Raises
    ------
    InputError
        For PROGRAM where the program has no tolerance.
    """
    from splinefeed.paths.smoothing import PROGRAM

    said: dict[str, Any] = {"tolerance": how["smooth"]}
    if how["smooth"] == PROGRAM:
        if not says_tolerance:
            raise InputError(
                "--smooth program: the program has no tolerance (G64 P), and G64 alone says none, nor "
                "does it as a machine's default; give one: --smooth 0.01mm"
            )
        said["corners"] = "round"
    called = {"corners": "corners", "corner_angle": "corner_angle", "angle_tolerance": "angular_tolerance"}
    said |= {name: how[key] for key, name in called.items() if key in how}
    if "corner_angle" in said:
        said["corner_angle"] = math.radians(said["corner_angle"])
    return said
