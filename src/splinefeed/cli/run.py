"""`splinefeed run`: the whole chain, with its files and figures."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from splinefeed.cli import options
from splinefeed.cli.answers import Page, answers
from splinefeed.cli.panels import PanelCommand
from splinefeed.cli.progress import Say
from splinefeed.cli.source import check_rotary, read_path
from splinefeed.cli.summary import print_run
from splinefeed.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from splinefeed.formats.path_parts import PathParts
    from splinefeed.records import Limits

#: What is left out of a run that is too long to be kept whole.
LONG_NOTE = (
    "long motion: computed, checked and written in chunks; figures show the peaks; methods are not "
    "compared; response and spectra are not kept (splinefeed follow setpoints.h5 computes them again)"
)
#: ... and of one whose path is too long to be held.
PARTS_NOTE = (
    "by windows: setpoints and numbers only; no figures, time law, feed ripple or comparison of "
    "methods, and no simulated axes (splinefeed follow setpoints.h5 simulates them)"
)
#: How far a table's lines may be left by the curves that replace them, mm, unless it is said.
POINTS_TOLERANCE = 1e-3
EXAMPLES = """\b
Examples:
  splinefeed run
  splinefeed run --3d
  splinefeed run butterfly --machine xytheta
  splinefeed run butterfly --accel 500 --jerk 20000 -o wings
  splinefeed run section.dat --chord 150mm --feed 3600mm/min --format hdf5 --format csv
  splinefeed run mould.nc --machine router --smooth program
  splinefeed run flank.json --machine trunnion --feed 100 --period 2ms

"""


@click.command(cls=PanelCommand, epilog=EXAMPLES + options.UNITS_NOTE)
@click.argument("source", required=False)
@options.limits
@options.machine
@click.option("--3d", "tangential", is_flag=True, help="A third axis, theta, follows the tangent of a planar path.")
@click.option("--method", metavar="NAME", help="The method.  [default: arc-length; the paper's without SOURCE]")
@options.corrections
@options.reading
@options.smoothing
@click.option(
    "--format",
    "formats",
    type=click.Choice(["hdf5", "csv", "mat", "npz", "parquet", "halstreamer", "pvt"]),
    multiple=True,
    help="Format of the setpoints; may be repeated.  [default: hdf5]",
)
@options.figures
@click.option("--no-compare", is_flag=True, help="Leave out the other methods, with their table and figure.")
@click.option("--tip", is_flag=True, help="Tool paths: write tip and tool axis at each setpoint too, tip.csv.")
@click.option("-o", "--output", metavar="DIR", help="Folder to write to.  [default: splinefeed-NAME]")
@answers(print_run)
def command(say: Say, source: str | None, **given: Any) -> Page:
    """Plan the motion along SOURCE, interpolate it, check every limit; write setpoints, figures and a report.

    SOURCE is a shape (butterfly, naca:0025?perimeter=33, ...) or a file: G-code, DXF, SVG, STEP, IGES, 3DM, JSON, an
    airfoil .dat. With --machine, simulated axes follow the setpoints: following error and contour error. The exit code
    is 1 if a limit does not hold, the end of the path is missed, or an axis becomes unstable.

    Without SOURCE: the paper's experiment. A NACA 0025 airfoil of 33 mm perimeter under the paper's limits, on a model
    of the paper's machine (or --machine), by the paper's two methods and milne-simpson-anchored.
    """
    from splinefeed.formats.path_parts import PathParts
    from splinefeed.geometry.tool_path import ToolPath
    from splinefeed.interpolation import registry
    from splinefeed.machine.machine import Machine
    from splinefeed.pipeline.compare import (
        BESIDE_A_RUN,
        PAPER_MACHINE,
        PAPER_METHODS,
        compare,
        serve_methods,
        servo_numbers,
    )
    from splinefeed.pipeline.run import PAPER_SHAPE, on_machine, planned_axes
    from splinefeed.pipeline.run import run as make_run
    from splinefeed.report import files
    from splinefeed.report.folder import default_name, staged
    from splinefeed.report.record import about, documented, record

    drawing = options.figure_formats(given)
    of_paper = source is None
    named = given["machine"] or (PAPER_MACHINE if of_paper else None)
    machine = None if named is None else Machine.load(named)
    planned_for = None if of_paper else machine  # the paper's experiment has the paper's limits, whatever the machine
    if planned_for is None:
        options.limits_from(given)  # options are validated before the file is opened
    method = given["method"] or (PAPER_METHODS[-1] if of_paper else registry.DEFAULT_METHOD)
    registry.method(method)
    reading = options.reading_from(given) | options.smoothing_from(given)
    reading |= {"tangential": True} if given["tangential"] else {}
    formats = tuple(given["formats"] or ("hdf5",))
    source = PAPER_SHAPE if source is None else source
    say(f"reading {source}")
    path = _parts_of(source, reading, given) or read_path(source, reading)
    tool = isinstance(path, ToolPath)
    axes = path.axes if isinstance(path, PathParts) else planned_axes(path, machine)
    if machine is not None and not tool and not isinstance(path, PathParts):
        check_rotary(path, source, machine)
    limits, period, strategy = options.limits_from(given, planned_for, axes)
    limits, assumed = options.as_programmed(limits, path, given)
    if given["tip"] and not tool:
        raise InputError(f"--tip: {path.name} has no tool axis; its setpoints are the tool's positions already")
    folder = default_name(path.name) if given["output"] is None else given["output"]
    how: dict[str, Any] = {"strategy": strategy, "method": method, "corrections": given["corrections"]}
    with staged(folder) as stage:
        if isinstance(path, PathParts):
            page = _write_parts(path, limits, period, stage, source, reading, formats, say)
            return _seen_from_here({**page, "notes": [*assumed, *page["notes"]]}, folder)
        moved = on_machine(path, machine if tool else None, limits)
        say("planning and interpolating")
        result = make_run(
            moved, limits, machine=None if tool else machine, period=period,
            on_progress=lambda what, done, of: say(f"{what}: {done} of {of} ticks"), **how,
        )  # fmt: skip
        others: list[Any] = []
        servo: dict[str, Any] | None = None
        if machine is not None and result.served is not None:
            if of_paper and result.whole:
                say(f"following on {machine.name}")
                names = [name for name in PAPER_METHODS if name != method]
                others += serve_methods(path, result.law, machine, names, given["corrections"])
            servo = {**servo_numbers([*others, result.served], machine, of_paper), "machine_file": named}
        traces: list[Any] = []
        for name in () if given["no_compare"] or tool or not result.whole else BESIDE_A_RUN:
            say(f"comparing methods: {name}")
            traces += compare(path, result.law, methods=[name], corrections=given["corrections"], timed=False)
        said = about(result.settings, None if of_paper else source, reading, formats, machine=named)
        page = record(result, said, traces, servo)
        notes = [*assumed, *options.smoothing_note(path, given), *page["notes"]]
        page["notes"] = [*notes, *([] if result.whole else [LONG_NOTE]), *files.missing(drawing)]
        say("writing setpoints and figures")
        page["files"] = files.write(
            documented(result, said), stage, formats=formats, traces=traces, figure_formats=drawing, record=page,
            others=others, tip=given["tip"],
        )  # fmt: skip
    return _seen_from_here(page, folder)


def _parts_of(source: str, reading: dict[str, Any], given: dict[str, Any]) -> PathParts | None:
    """The path in parts, where the file is too long to be held as a whole; InputError for what needs the whole."""
    from splinefeed.cli.source import AFTER_READING
    from splinefeed.feed.modes import LOOK_AHEAD
    from splinefeed.formats.path_parts import MOST_LINES, read_parts, too_long
    from splinefeed.pipeline.long_path import METHOD

    if not too_long(source):
        return None
    refused = {
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
    alone = ("tolerance", *AFTER_READING)
    parts = read_parts(source, **{name: value for name, value in reading.items() if name not in alone})
    if "tolerance" in reading and parts.unit != "lines":
        raise InputError("--tolerance: is for tables of points; use --smooth LENGTH for a program")
    return parts


def _write_parts(
    parts: PathParts, limits: Limits, period: float, stage: Path, source: str, reading: dict[str, Any],
    formats: tuple[str, ...], say: Say,
) -> dict[str, Any]:  # fmt: skip
    from splinefeed.pipeline.long_path import WindowedRun
    from splinefeed.report import files
    from splinefeed.report.record import about, record

    table, began, count = parts.unit == "lines", time.monotonic(), parts.count
    if table:
        reading = dict(reading)
        reading = {"smooth": reading.pop("tolerance", POINTS_TOLERANCE), **reading}

    def progress(read: int, ticks: int) -> None:
        gone = time.monotonic() - began
        left = f", about {gone * (count - read) / read:.0f} s left" if 0 < read < count and gone > 1.0 else ""
        say(f"{read} of {count} {parts.unit} planned ahead, {ticks} setpoints written{left}")

    made = WindowedRun(parts, limits, period, reading, progress)
    said = about(made.settings, source, reading, formats)
    # of a table the lines were smoothed: the path that `read` makes of its points is another one
    kept = {name: said[name] for name in ("command", *(() if table else ("source",)))}
    chunks = (replace(chunk, settings={**chunk.settings, **kept}) for chunk in made.setpoints())
    names = [*files.write_setpoints(chunks, stage, formats), files.RECORD]
    page = record(made, said)
    page |= {"notes": [*page["notes"], PARTS_NOTE], "files": names}
    files.write_record(page, stage / files.RECORD)
    return page


def _seen_from_here(page: dict[str, Any], folder: str) -> dict[str, Any]:
    return {**page, "files": [os.path.join(folder, name) for name in page["files"]]}
