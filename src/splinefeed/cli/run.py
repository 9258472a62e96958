"""`splinefeed run`: the whole chain, with its files and figures."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import click

import splinefeed as sf
from splinefeed.cli import options, summary
from splinefeed.cli.answers import answers
from splinefeed.cli.failures import spoken
from splinefeed.cli.output import Page, Say
from splinefeed.cli.source import AFTER_READING, check_rotary, job_of, job_of_robot, read_path
from splinefeed.errors import InputError
from splinefeed.formats.setpoint_table import FORMATS

#: Most ticks of a motion on which methods are compared: each is held as a whole.
MOST_COMPARED = 4_000_000
#: What is not kept of a motion of more than so many ticks.
LONG_NOTE = (
    "more than {} ticks: figures over time are areas from the least to the greatest of every {:.4g} ms, and spectra of "
    "following errors are left out"
)
#: Said where --compare asks for what is left out.
NOT_COMPARED = "methods are compared on motions of at most four million ticks along paths without a tool axis: left out"
#: What a path that is too long to be held lacks.
PARTS_NOTE = "read in parts: the time law is not kept, so that `splinefeed report` cannot make the report again"
#: How far a table's lines may be left by the curves that replace them, mm, unless it is said.
POINTS_TOLERANCE = 1e-3


@answers(summary.run)
@options.limits
@options.machine
@options.tangential
@options.table(f"""
source          [SOURCE]
--method        NAME    The method.  [default: arc-length; the paper's without SOURCE]
--format formats  {"|".join(FORMATS)}* =hdf5  Format of the setpoints; may be repeated.
--robot         FILE    A URDF: SOURCE is a motion of that arm, JSON with waypoints or along, its limits too.
--tip           -       Tool paths: write tip and tool axis at each setpoint too, tip.csv.
-o --output     DIR     Folder to write to.  [default: splinefeed-NAME]
""")
@click.option(
    "--compare/--no-compare",
    default=None,
    help="Run other methods on the same time law, for a table and a figure.  [default: only without SOURCE]",
)
@options.corrections
@options.linking
@options.reading
@options.smoothing
@options.figures
def run(say: Say, source: str | None, **given: Any) -> Page:
    """Plan the motion along SOURCE, interpolate it, check every limit; write setpoints, figures and a report.

    SOURCE is a shape (butterfly, naca:0025?perimeter=33, ...) or a file: G-code, DXF, SVG, STEP, IGES, 3DM, JSON, an
    airfoil .dat. With --machine, simulated axes follow the setpoints: following error and contour error. The exit code
    is 1 if a limit does not hold, the end of the path is missed, or an axis becomes unstable.

    Without SOURCE: the paper's experiment. A NACA 0025 airfoil of 33 mm perimeter under the paper's limits, on a model
    of the paper's machine (or --machine), by the paper's two methods and milne-simpson-anchored.

    Examples:
      splinefeed run
      splinefeed run --3d
      splinefeed run butterfly --machine xytheta
      splinefeed run butterfly --accel 500 --jerk 20000 -o wings
      splinefeed run section.dat --chord 150mm --feed 3600mm/min --format hdf5 --format csv
      splinefeed run mould.nc --machine router --smooth program
      splinefeed run flank.json --machine trunnion --feed 100 --period 2ms
      splinefeed run panda.json --robot panda.urdf
    """
    from splinefeed.interpolation import registry
    from splinefeed.reports import files
    from splinefeed.reports.folder import default_name, staged
    from splinefeed.reports.record import about, record
    from splinefeed.runs import comparison
    from splinefeed.runs.run import LONG, carry_out

    drawing = options.figure_formats(given)
    of_paper = source is None
    named = given["machine"] or (comparison.PAPER_MACHINE if of_paper else None)
    machine = None if named is None else sf.Machine.load(named)
    method = given["method"] or (comparison.PAPER_METHODS[-1] if of_paper else registry.DEFAULT_METHOD)
    registry.method(method)
    # the paper's experiment has the paper's limits, whatever the machine
    if given["robot"] is not None:
        what = job_of_robot(say, source, given)
    else:
        what = job_of(say, source, given, None if of_paper else machine, read=partial(_read, given))
    compared = of_paper if given["compare"] is None else given["compare"]
    path: Any = what.path
    corrections, formats, reading = given["corrections"], given["formats"], what.reading
    tool, parts = path.needs_machine, path.in_parts is not None
    if given["tip"] and not tool:
        raise InputError(f"--tip: {path.name} has no tool axis; its setpoints are the tool's positions already")
    if machine is not None and not tool and not parts:
        check_rotary(path, what.source, machine)
    table = parts and path.unit == "lines"
    if table:
        reading = {"smooth": reading.get("tolerance", POINTS_TOLERANCE), **reading}
        reading.pop("tolerance", None)
    job = replace(what, machine=machine, method=method, corrections=corrections, reading=reading)

    def described(settings: Mapping[str, Any]) -> dict[str, Any]:
        """What the record of the run says of how it is made."""
        return about(settings, None if of_paper else job.source, job.reading, formats, machine=named)

    def documented(settings: Mapping[str, Any]) -> dict[str, Any]:
        """What a file of setpoints says of that; of a table that was smoothed `read` makes another path."""
        said = described(settings)
        return {name: said[name] for name in ("command", *(() if table else ("source",)))}

    folder = default_name(path.name) if given["output"] is None else given["output"]
    with staged(folder) as stage, files.writers(stage, formats, documented) as (meters, responses):
        say("making the motion")
        result = carry_out(
            job,
            meters=meters,
            responses=responses,
            on_read=_progress(say, path) if parts else None,
        )
        others: list[Any] = []
        servo: dict[str, Any] | None = None
        if machine is not None and result.served is not None:
            if of_paper and result.whole:
                say(f"following on {machine.name}")
                names = [name for name in comparison.PAPER_METHODS if name != method]
                others += comparison.serve_methods(path, result.law, machine, names, corrections)
            servo = {**comparison.servo_numbers([*others, result.served], of_paper), "machine_file": named}
        traces: list[Any] = []
        possible = result.ticks <= MOST_COMPARED and result.joints is None
        if compared and possible:
            say("comparing methods")
            traces += sf.runs.compare(
                path, result.law, methods=comparison.BESIDE_A_RUN, corrections=corrections, timed=False
            )
        page = record(result, described(result.settings), traces, servo)
        long = [] if result.whole else [LONG_NOTE.format(LONG, 1e3 * _block(result))]
        page["notes"] = [*job.notes, *page["notes"], *long, *([PARTS_NOTE] if parts else [])]
        page["notes"] += [*([NOT_COMPARED] if compared and not possible else []), *files.missing(drawing)]
        page["notes"] = list(map(spoken, page["notes"]))
        say("drawing")
        page["files"] = files.write(
            result, stage, formats=formats, traces=traces, figure_formats=drawing, record=page, others=others,
            tip=given["tip"],
        )  # fmt: skip
    return {**page, "files": [os.path.join(folder, name) for name in page["files"]]}


def _block(result: sf.Run) -> float:
    """How long, s, the blocks are that figures over time show the least and the greatest of."""
    edges = result.bands["feed"].edges
    return float(edges[1] - edges[0])


def _progress(say: Say, parts: Any) -> Callable[[int, int], None]:
    """What says how far a file that is read part by part is, and how long the rest takes."""
    began, count = time.monotonic(), parts.count

    def progress(read: int, ticks: int) -> None:
        gone = time.monotonic() - began
        left = f", about {gone * (count - read) / read:.0f} s left" if 0 < read < count and gone > 1.0 else ""
        say(f"{read} of {count} {parts.unit} planned ahead, {ticks} setpoints written{left}")

    return progress


def _read(given: Mapping[str, Any], source: str, reading: Mapping[str, Any]) -> sf.Path | sf.paths.PathParts:
    """The path, in parts where the file is too long to be held as a whole; InputError for what needs the whole."""
    from splinefeed.formats.long_files import MOST_LINES, too_long
    from splinefeed.planner.strategies import LOOK_AHEAD
    from splinefeed.runs.long_path import METHOD
    from splinefeed.runs.settings import fed

    if not too_long(source):
        return read_path(source, reading)
    refused = {
        "--3d": given["tangential"],
        "--compare": given["compare"],
        f"--strategy {given['strategy']}": given["strategy"] not in (None, LOOK_AHEAD),
        f"--method {given['method']}": given["method"] not in (None, METHOD),
        **{f"--{name.replace('_', '-')}": name in reading for name in options.LINKS if name != "cut_feed"},
    }
    for words in (option for option, found in refused.items() if found):
        raise InputError(
            f"{words}: needs the whole path; a file of more than {MOST_LINES} lines goes by windows, with {LOOK_AHEAD} "
            f"and {METHOD} alone: leave it out"
        )
    alone = ("tolerance", *AFTER_READING)
    parts = sf.formats.read_parts(source, **{name: value for name, value in reading.items() if name not in alone})
    if "tolerance" in reading and parts.unit != "lines":
        raise InputError("--tolerance: is for tables of points; use --smooth LENGTH for a program")
    return fed(parts, reading["cut_feed"]) if "cut_feed" in reading and parts.feeds is not None else parts
