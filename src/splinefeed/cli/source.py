"""What a user calls SOURCE, a shape or a file, to a path."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from splinefeed.errors import InputError, nearest

if TYPE_CHECKING:
    from splinefeed.formats.contents import Contents
    from splinefeed.geometry.path import Path
    from splinefeed.machine.machine import Machine


#: What is done to a path after it is read.
AFTER_READING = ("tangential", "smooth", "corners", "corner_angle", "angle_tolerance")


def read_path(source: str, reading: Mapping[str, Any]) -> Path:
    """The path that `source` means, read as `options.reading_from` says, and smoothed as `options.smoothing_from`.

    With theta behind if `tangential` is true.
    """
    from splinefeed.formats import registry
    from splinefeed.pipeline.settings import smooth

    paths = read_contents(source, {name: value for name, value in reading.items() if name not in AFTER_READING})
    path = paths[0] if len(paths) == 1 else registry.choose(paths, None, source)
    path = smooth(path, reading)
    if not reading.get("tangential"):
        return path
    from splinefeed.geometry.tangential import tangential

    return tangential(path)


def check_rotary(path: Path, source: str, machine: Machine) -> None:
    """InputError where a path turns a rotary axis that the machine does not have, with the line of a program."""
    import re

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
    from splinefeed.formats.contents import Contents
    from splinefeed.geometry import shapes

    if not source.strip():
        raise InputError(f"{source!r}: is not the name of a file or a shape")
    if shapes.is_shape(source):
        for name in reading:
            option = "--path" if name == "which" else f"--{name}"
            raise InputError(f"{option}: is for files; {source!r} is a shape, whose options follow its '?'")
        shape = Contents([shapes.from_text(source)])
        shape.format = "shape"
        return shape
    if not os.path.exists(source) and not os.path.splitext(source)[1] and os.sep not in source:
        name = source.partition(":")[0].partition("?")[0]
        hint = nearest(name, shapes.names(), "shapes are {}")
        raise InputError(f"{source}: no such file or shape; {hint}")
    from splinefeed.formats import registry

    which = reading.get("which")
    options = {name: value for name, value in reading.items() if name != "which"}
    found = registry.read_all(source, **options)
    if which is None:
        return found
    chosen = Contents([registry.choose(found, which, source)], found.units)
    chosen.format = found.format
    return chosen
