"""What a user calls SOURCE, a shape or a file, to a path; and what is planned along it."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import splinefeed as sf
from splinefeed.cli import options
from splinefeed.cli.output import Say
from splinefeed.errors import InputError, nearest

if TYPE_CHECKING:
    from splinefeed.paths.contents import Contents
    from splinefeed.runs.run import MotionJob


#: What is done to a path after it is read.
AFTER_READING = ("tangential", *options.SMOOTHS, *options.LINKS, "unsaid")
#: How contours are linked where nothing says it, among how to read.
UNSAID = AFTER_READING[-1]


def job_of(
    say: Say,
    source: str | None,
    given: Mapping[str, Any],
    machine: sf.Machine | None = None,
    read: Callable[[str, Mapping[str, Any]], Any] | None = None,
) -> MotionJob:
    """Make a job of SOURCE and the options; without SOURCE that of the paper's airfoil.

    Parameters
    ----------
    say : Say
        Prints.
    source : str or None
        What the user typed.
    given : mapping
        Values of the options.
    machine : Machine, optional
        Gives limits of its axes.
    read : callable, optional
        How to read a source, in place of `read_path`.

    Returns
    -------
    MotionJob
        The job.
    """
    from splinefeed.runs.remarks import at_corners, at_zero
    from splinefeed.runs.run import MotionJob
    from splinefeed.runs.settings import PAPER_LIMITS, PAPER_PERIOD, PAPER_SHAPE, completed, limited

    of_paper, source = source is None, PAPER_SHAPE if source is None else source
    flat, assume = options.said_limits(given, {}), not given["limits_file"]
    if machine is None:
        completed(flat, None, (), assume=assume)  # options are validated before the file is opened
    reading = options.reading_from(given)
    say(f"reading {source}")
    unsaid = {} if machine is None or machine.clearance is None else {"clearance": machine.clearance}
    unsaid["cut_feed"] = flat.get("feed", PAPER_LIMITS.feed)
    path, rapids_too = (read or read_path)(source, {**reading, UNSAID: unsaid}), "cut_feed" in reading
    if path.linking is not None:  # what a command that makes it again has to say
        said = {"clearance": path.linking.clearance, "cut_feed": path.linking.feed}
        reading |= {name: value for name, value in said.items() if value is not None}
    found, limits, notes = limited(path, flat, machine, assume=assume, rapids_too=rapids_too)
    if found is not path:
        path, reading = found, reading | {"cut_feed": flat["feed"]}
    corners = at_corners(path, limits, machine, reading) if "smooth" in given else []
    notes = () if of_paper else (*notes, *corners, *at_zero(path, limits, reading))
    period = PAPER_PERIOD if given["period"] is None else given["period"]
    return MotionJob(path, limits, machine, period, given["strategy"], source=source, reading=reading, notes=notes)


def job_of_robot(say: Say, source: str | None, given: Mapping[str, Any]) -> MotionJob:
    """What a file of a motion of an arm means, along with its URDF; InputError for options that are not an arm's."""
    from splinefeed.records import field_of
    from splinefeed.robots.motion_file import read_motion
    from splinefeed.runs.run import MotionJob
    from splinefeed.runs.settings import PAPER_PERIOD

    if source is None:
        raise InputError("--robot: give a motion too: splinefeed run MOTION.json --robot ROBOT.urdf")
    said = options.said_limits(given, {})
    feed = said.pop("feed", None)
    refused = [*(field_of(name) for name in said), *options.reading_from(given)]
    refused += [name for name in ("machine", "compare", "tip") if given[name]]
    if refused:
        option = refused[0].replace("_", "-")
        raise InputError(f"--{option}: an arm has its limits and motion from its own files; leave it out")
    say(f"reading {source}")
    arm, path, limits = read_motion(source, given["robot"], feed=feed)
    period = PAPER_PERIOD if given["period"] is None else given["period"]
    reading = {"robot": given["robot"], **({} if feed is None else {"feed": feed})}
    how: dict[str, Any] = {"source": source, "reading": reading, "notes": arm.notes}
    return MotionJob(path, limits, None, period, given["strategy"], **how)


def read_path(source: str, reading: Mapping[str, Any]) -> sf.Path:
    """The one path that `source` means; see `read_contents`."""
    return read_contents(source, reading, one=True)[0]


def check_rotary(path: sf.Path, source: str, machine: sf.Machine) -> None:
    """InputError where a path turns a rotary axis that the machine does not have, with the line of a program."""
    import numpy as np

    for k, axis in enumerate(path.axes):
        if k < path.linear or axis in machine.axes or np.ptp(path.flat.points[:, k]) == 0.0:
            continue
        line = ""
        if os.path.isfile(source) and not axis[1:]:
            with open(source, encoding="utf-8", errors="replace") as text:
                said = re.compile(rf"[^(;]*(?<![A-Z]){axis}\s*+=?\s*+[-+.\d#\[]", re.IGNORECASE)
                line = next((f" (line {i})" for i, each in enumerate(text, 1) if said.match(each)), "")
        raise InputError(
            f"{source}: turns the rotary axis {axis.upper()}{line}, which {machine.name} does not have; its axes are "
            f"{', '.join(machine.axes)}: choose the machine that the program is for"
        )


def read_contents(source: str, reading: Mapping[str, Any], *, one: bool = False) -> Contents:
    """Every path of `source`, or the one that `--path` chooses, with the units and the format of the file.

    Read, smoothed, and with theta behind as `options.reading_from` says. Where `one` is wanted, several contours become
    one motion, and a single one does if the options say how.
    """
    from splinefeed.formats import registry
    from splinefeed.paths.contents import Contents
    from splinefeed.runs.settings import fed, smooth

    how = {name: value for name, value in reading.items() if name not in AFTER_READING}
    if sf.shapes.is_shape(source):
        for name in how:
            option = "--path" if name == "which" else f"--{name}"
            raise InputError(f"{option}: is for files; {source!r} is a shape, whose options follow its '?'")
        found = Contents([sf.shapes.from_text(source)])
        found.format = "shape"
    elif not os.path.exists(source) and not os.path.splitext(source)[1] and os.sep not in source:
        name = source.partition(":")[0].partition("?")[0]
        raise InputError(f"{source}: no such file or shape; {nearest(name, sf.shapes.names(), 'shapes are {}')}")
    else:
        which = how.pop("which", None)
        found = registry.read_all(source, **how)
        if which is not None:
            found[:] = [registry.choose(found, which, source)]
    found[:] = [smooth(path, reading) for path in found]
    if reading.get("tangential"):
        found[:] = map(sf.paths.tangential, found)
    linking = {name: reading[name] for name in options.LINKS if name in reading}
    if list(linking) == ["cut_feed"] and len(found) == 1 and found[0].feed_range is not None:  # a program's feed moves
        found[:] = [fed(found[0], linking.pop("cut_feed"))]
    if linking and found.format in ("G-code", "shape"):
        raise InputError(f"--{next(iter(linking)).replace('_', '-')}: is for drawings; {source} has its own moves")
    if one and (len(found) > 1 or linking):
        linking = {**reading.get(UNSAID, {}), **linking}
        called = {"feed" if name == "cut_feed" else name: value for name, value in linking.items()}
        found[:] = [registry.as_job(found, source, **called)]
    return found
