"""`splinefeed run`: the whole chain, with its files and figures."""

from __future__ import annotations

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
    from splinefeed.geometry.path import Path

#: What is left out of a run that is too long to be kept whole.
LONG_NOTE = (
    "long motion: computed, checked and written in chunks; figures show the peaks; methods are not "
    "compared; response and spectra are not kept (splinefeed follow setpoints.h5 computes them again)"
)
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
@click.option(
    "--contour-tolerance",
    type=options.Quantity("length"),
    metavar="LENGTH",
    help="Scale the limits down until the machine's contour error is within this; see splinefeed tune-feed.",
)
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
@click.option(
    "--by-windows",
    is_flag=True,
    hidden=True,  # accepted from older command lines
    help="Has no effect: a file of more than a million lines goes by windows by itself.",
)
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
    from splinefeed.cli import run_windows
    from splinefeed.formats.path_parts import PathParts
    from splinefeed.geometry.tool_path import ToolPath
    from splinefeed.interpolation import registry
    from splinefeed.machine.machine import Machine
    from splinefeed.pipeline.compare import BESIDE_A_RUN, compare
    from splinefeed.pipeline.contour_feed import limits_within
    from splinefeed.pipeline.experiment import PAPER_MACHINE, PAPER_METHODS, serve_methods, servo_numbers
    from splinefeed.pipeline.run import PAPER_SHAPE, on_machine, planned_axes
    from splinefeed.pipeline.run import run as make_run
    from splinefeed.report import files
    from splinefeed.report.folder import default_name, staged
    from splinefeed.report.record import about, documented, record

    drawing = options.figure_formats(given)
    machine = Machine.load(given["machine"] or PAPER_MACHINE) if given["machine"] or source is None else None
    of_paper = source is None
    planned_for = None if of_paper else machine  # the paper's experiment has the paper's limits, whatever the machine
    if planned_for is None:
        options.limits_from(given)  # options are validated before the file is opened
    method = given["method"] or (PAPER_METHODS[-1] if of_paper else registry.DEFAULT_METHOD)
    registry.method(method)
    reading = options.reading_from(given) | options.smoothing_from(given)
    reading |= {"tangential": True} if given["tangential"] else {}
    formats = tuple(given["formats"] or ("hdf5",))
    corrections = given["corrections"]
    say(f"reading {source or PAPER_SHAPE}")
    parts = run_windows.parts_of(source, reading, given)
    path: Path | PathParts = read_path(PAPER_SHAPE if source is None else source, reading) if parts is None else parts
    tool = isinstance(path, ToolPath)
    if isinstance(path, PathParts):
        axes = path.axes
    else:
        axes = planned_axes(path, machine)
        if machine is not None and not tool:
            check_rotary(path, source or PAPER_SHAPE, machine)
    limits, period, strategy = options.limits_from(given, planned_for, axes)
    limits, assumed = options.as_programmed(limits, path, given)
    assumed += ["--by-windows has no effect: the size of the file decides"] if given["by_windows"] else []
    if given["tip"] and not tool:
        raise InputError(f"--tip: {path.name} has no tool axis; its setpoints are the tool's positions already")
    folder = default_name(path.name) if given["output"] is None else given["output"]
    with staged(folder) as stage:
        if isinstance(path, PathParts):
            page = run_windows.write(path, limits, period, stage, str(source), reading, formats, assumed, say)
            return _seen_from_here(page, folder)
        moved = on_machine(path, machine if tool else None, limits)
        if given["contour_tolerance"] is not None:
            if machine is None:
                raise InputError("--contour-tolerance: needs a machine; give --machine NAME or --machine FILE")
            if tool:
                raise InputError("--contour-tolerance: is for paths without a tool axis")
            limits = limits_within(
                path, limits, machine, given["contour_tolerance"],
                period=period, strategy=strategy, method=method, corrections=corrections, on_progress=say,
            )  # fmt: skip
        say("planning and interpolating")
        result = make_run(
            moved, limits, machine=None if tool else machine, period=period, strategy=strategy, method=method,
            corrections=corrections, on_progress=lambda what, done, of: say(f"{what}: {done} of {of} ticks"),
        )  # fmt: skip
        others: list[Any] = []
        servo: dict[str, Any] | None = None
        if machine is not None and result.served is not None:
            if of_paper and result.whole:
                say(f"following on {machine.name}")
                names = [name for name in PAPER_METHODS if name != method]
                others += serve_methods(path, result.law, machine, names, corrections)
            servo = servo_numbers([*others, result.served], machine, of_paper)
            servo["machine_file"] = given["machine"] or PAPER_MACHINE
        traces: list[Any] = []
        for name in () if given["no_compare"] or tool or not result.whole else BESIDE_A_RUN:
            say(f"comparing methods: {name}")
            traces += compare(path, result.law, methods=[name], corrections=corrections, timed=False)
        followed = (given["machine"] or PAPER_MACHINE) if machine is not None else None
        said = about(result.settings, source, reading, formats, machine=followed)
        page = record(result, said, traces, servo)
        page["notes"] = [
            *assumed,
            *options.smoothing_note(path, given),
            *page["notes"],
            *([] if result.whole else [LONG_NOTE]),
            *files.missing(drawing),
        ]
        say("writing setpoints and figures")
        result = documented(result, said)
        page["files"] = files.write(
            result,
            stage,
            formats=formats,
            traces=traces,
            figure_formats=drawing,
            record=page,
            others=others,
            tip=given["tip"],
        )
    return _seen_from_here(page, folder)


def _seen_from_here(page: dict[str, Any], folder: str) -> dict[str, Any]:
    """The page of numbers, its files as seen from the current folder."""
    from os.path import join

    return {**page, "files": [join(folder, name) for name in page["files"]]}
