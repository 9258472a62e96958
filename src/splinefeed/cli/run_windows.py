"""`splinefeed run` of a file whose path is too long to be held: by windows, in memory that does not grow."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from splinefeed.cli.progress import Say
from splinefeed.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from splinefeed.formats.path_parts import PathParts
    from splinefeed.records import Limits

NOTE = (
    "by windows: setpoints and numbers only; no figures, time law, feed ripple or comparison of "
    "methods, and no simulated axes (splinefeed follow setpoints.h5 simulates them)"
)
#: How far a table's lines may be left by the curves that replace them, mm, unless it is said.
POINTS_TOLERANCE = 1e-3


def parts_of(source: str | None, reading: dict[str, Any], given: dict[str, Any]) -> PathParts | None:
    """The path in parts, where the file is too long to be held as a whole; else None."""
    from splinefeed.formats.path_parts import read_parts, too_long

    if source is None or not too_long(source):
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
    made = WindowedRun(parts, limits, period, reading, _progress(say, parts))
    said = about(made.settings, source, reading, formats)
    # of a table the lines were smoothed: the path that `read` makes of its points is another one
    kept = {name: said[name] for name in ("command", *(() if table else ("source",)))}
    chunks = (replace(chunk, settings={**chunk.settings, **kept}) for chunk in made.setpoints())
    names = [*files.write_setpoints(chunks, stage, formats), files.RECORD]
    page = record(made, said)
    page |= {"notes": [*assumed, *page["notes"], NOTE], "files": names}
    files.write_record(page, stage / files.RECORD)
    return page


def _check_possible(given: dict[str, Any]) -> None:
    """InputError for what needs the whole path or the whole motion."""
    from splinefeed.feed.modes import LOOK_AHEAD
    from splinefeed.formats.path_parts import MOST_LINES
    from splinefeed.pipeline.long_path import METHOD

    refused = {
        "--contour-tolerance": given["contour_tolerance"] is not None,
        "--3d": given["tangential"],
        "--format mat": "mat" in given["formats"],
        f"--strategy {given['strategy']}": given["strategy"] not in (None, LOOK_AHEAD),
        f"--method {given['method']}": given["method"] not in (None, METHOD),
    }
    for words in (option for option, found in refused.items() if found):
        raise InputError(
            f"{words}: needs the whole path; a file of more than {MOST_LINES} lines goes by windows, with {LOOK_AHEAD} "
            f"and {METHOD} alone: leave it out"
        )


def _progress(say: Say, parts: PathParts) -> Callable[[int, int], None]:
    """Say how far it is, and how long it will take at the pace so far."""
    began, count = time.monotonic(), parts.count

    def progress(read: int, ticks: int) -> None:
        gone = time.monotonic() - began
        left = f", about {gone * (count - read) / read:.0f} s left" if 0 < read < count and gone > 1.0 else ""
        say(f"{read} of {count} {parts.unit} planned ahead, {ticks} setpoints written{left}")

    return progress
