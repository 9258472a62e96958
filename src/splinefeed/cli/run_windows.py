"""`splinefeed run` of a file whose path is too long to be held: by windows, in memory that does not grow."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from splinefeed.cli.progress import Say
from splinefeed.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from splinefeed.formats.path_parts import PathParts
    from splinefeed.records import Limits

#: What needs the whole path or the whole motion, and what is said of it.
NOT_BY_WINDOWS = {
    "contour_tolerance": "--contour-tolerance: needs the whole motion; leave out --by-windows",
    "tangential": "--3d: needs the whole path; leave out --by-windows",
}
NOTE = (
    "by windows: setpoints and numbers only; no figures, time law, feed ripple or comparison of "
    "methods, and no simulated axes (splinefeed follow setpoints.h5 simulates them)"
)
#: How far a table's lines may be left by the curves that replace them, mm, unless it is said.
POINTS_TOLERANCE = 1e-3


def parts_of(source: str | None, reading: dict[str, Any], given: dict[str, Any]) -> PathParts | None:
    """The path in parts, where it is too long to be held as a whole or the option says so; else None."""
    from splinefeed.formats.path_parts import read_parts, too_long

    if source is None:
        if given["by_windows"]:
            raise InputError("--by-windows: needs a SOURCE, a file of G-code or a table of points")
        return None
    if not given["by_windows"] and not too_long(source):
        return None
    _check_possible(given)
    alone = ("tolerance", "tangential", "smooth", "corners", "corner_angle", "angle_tolerance")
    parts = read_parts(source, **{name: value for name, value in reading.items() if name not in alone})
    if "tolerance" in reading and parts.unit != "lines":
        raise InputError("--tolerance: is for tables of points; use --smooth LENGTH for a program")
    return parts


def write(
    parts: PathParts, limits: Limits, period: float, stage: Path, source: str, reading: dict[str, Any],
    formats: tuple[str, ...], assumed: list[str], say: Say,
) -> dict[str, Any]:  # fmt: skip
    """Make, check and write the setpoints; the page of numbers with the names of its files."""
    from splinefeed.pipeline.windows import WindowedRun
    from splinefeed.report import files
    from splinefeed.report.record import about, record

    table = parts.unit == "lines"
    if table:
        tolerance = reading.get("tolerance", POINTS_TOLERANCE)
        reading = {"smooth": tolerance, **{name: value for name, value in reading.items() if name != "tolerance"}}
    how: dict[str, Any] = {name: reading[name] for name in ("smooth", "corners", "corner_angle") if name in reading}
    made = WindowedRun(parts, limits, period, how, on_progress=_progress(say, parts.count, parts.unit))
    said = about(made.settings, source, {**reading, "by_windows": True}, formats)
    # of a table the lines were smoothed: the path that `read` makes of its points is another one
    made.said = {name: said[name] for name in ("command", *(() if table else ("source",)))}
    names = [*files.write_setpoints(made.setpoints(), stage, formats), files.RECORD]
    page = record(made, said)
    page |= {"notes": [*assumed, *page["notes"], NOTE], "files": names}
    files.write_record(page, stage / files.RECORD)
    return page


def _check_possible(given: dict[str, Any]) -> None:
    """InputError for what cannot be done by windows."""
    from splinefeed.feed.modes import LOOK_AHEAD
    from splinefeed.pipeline.long_path import METHOD

    for name, sentence in NOT_BY_WINDOWS.items():
        if given[name]:
            raise InputError(sentence)
    for name, only in (("strategy", LOOK_AHEAD), ("method", METHOD)):
        if given[name] not in (None, only):
            raise InputError(f"--{name} {given[name]}: needs the whole path; by windows there is {only} alone")
    if "mat" in given["formats"]:
        raise InputError("--format mat: needs all setpoints in memory; by windows choose hdf5, csv, npz or parquet")


def _progress(say: Say, count: int, unit: str) -> Callable[[int, int], None]:
    """Say how far it is, and how long it will take at the pace so far."""
    began = time.monotonic()

    def progress(read: int, ticks: int) -> None:
        gone = time.monotonic() - began
        left = f", about {gone * (count - read) / read:.0f} s left" if 0 < read < count and gone > 1.0 else ""
        say(f"{read} of {count} {unit} planned ahead, {ticks} setpoints written{left}")

    return progress
