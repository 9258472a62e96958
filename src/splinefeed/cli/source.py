"""What a user calls SOURCE, a shape or a file, to a path; and what is planned along it."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import splinefeed as sf
from splinefeed.cli import options
from splinefeed.cli.progress import Say
from splinefeed.errors import InputError, nearest

if TYPE_CHECKING:
    from splinefeed.formats.contents import Contents


#: What is done to a path after it is read.
_AFTER_READING = ("tangential", "smooth", "corners", "corner_angle", "angle_tolerance")


class Task(NamedTuple):
    """What a command plans: a path, how it was read, limits, period, strategy and notes on them."""

    source: str
    path: sf.Path
    reading: dict[str, Any]
    limits: sf.Limits
    period: float
    strategy: str | None
    notes: list[str]


def task_of(say: Say, source: str | None, given: dict[str, Any], machine: sf.Machine | None = None) -> Task:
    """What SOURCE and the options mean, the paper's airfoil without SOURCE; `machine` gives limits of its axes."""
    from splinefeed.pipeline.run import PAPER_SHAPE, planned_axes

    source = PAPER_SHAPE if source is None else source
    if machine is None:
        options.limits_from(given)  # options are validated before the file is opened
    reading = options.reading_from(given) | options.smoothing_from(given)
    reading |= {"tangential": True} if given.get("tangential") else {}
    say(f"reading {source}")
    path = read_path(source, reading)
    limits, period, strategy = options.limits_from(given, machine, planned_axes(path, machine))
    limits, notes = options.as_programmed(limits, path, given)
    return Task(source, path, reading, limits, period, strategy, notes)


def read_path(source: str, reading: Mapping[str, Any]) -> sf.Path:
    """The path that `source` means, read as `options.reading_from` says, and smoothed as `options.smoothing_from`.

    With theta behind if `tangential` is true.
    """
    from splinefeed.formats import registry
    from splinefeed.geometry.tangential import tangential
    from splinefeed.pipeline.smooth import smooth

    paths = read_contents(source, {name: value for name, value in reading.items() if name not in _AFTER_READING})
    path = smooth(paths[0] if len(paths) == 1 else registry.choose(paths, None, source), reading)
    return tangential(path) if reading.get("tangential") else path


def check_rotary(path: sf.Path, source: str, machine: sf.Machine) -> None:
    """InputError where a path turns a rotary axis that the machine does not have, with the line of a program."""
    import numpy as np

    for k, axis in enumerate(path.axes):
        if k < path.linear or axis in machine.axes or np.ptp(path.flat.points[:, k]) == 0.0:
            continue
        line = ""
        if os.path.isfile(source) and not axis[1:]:
            with open(source, encoding="utf-8", errors="replace") as text:
                said = re.compile(rf"[^(;]*(?<![A-Z]){axis}\s*=?\s*[-+.\d#\[]", re.IGNORECASE)
                line = next((f" (line {i})" for i, each in enumerate(text, 1) if said.match(each)), "")
        raise InputError(
            f"{source}: turns the rotary axis {axis.upper()}{line}, which {machine.name} does not have; its axes are "
            f"{', '.join(machine.axes)}: choose the machine that the program is for"
        )


def read_contents(source: str, reading: Mapping[str, Any]) -> Contents:
    """Every path of `source`, or the one that `--path` chooses, with the units and the format of the file."""
    from splinefeed.formats import registry
    from splinefeed.formats.contents import Contents

    if sf.shapes.is_shape(source):
        for name in reading:
            option = "--path" if name == "which" else f"--{name}"
            raise InputError(f"{option}: is for files; {source!r} is a shape, whose options follow its '?'")
        shape = Contents([sf.shapes.from_text(source)])
        shape.format = "shape"
        return shape
    if not os.path.exists(source) and not os.path.splitext(source)[1] and os.sep not in source:
        name = source.partition(":")[0].partition("?")[0]
        raise InputError(f"{source}: no such file or shape; {nearest(name, sf.shapes.names(), 'shapes are {}')}")
    which = reading.get("which")
    found = registry.read_all(source, **{name: value for name, value in reading.items() if name != "which"})
    if which is None:
        return found
    chosen = Contents([registry.choose(found, which, source)], found.units)
    chosen.format = found.format
    return chosen
