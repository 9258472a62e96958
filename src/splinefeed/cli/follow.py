"""`splinefeed follow`: what the axes of a machine do with setpoints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import click

from splinefeed import units
from splinefeed.cli import options
from splinefeed.cli.answers import Page, answers
from splinefeed.cli.output import number, print_text
from splinefeed.cli.panels import PanelCommand
from splinefeed.cli.progress import Say
from splinefeed.cli.setpoints_file import path_of, read_setpoints_chunks, says_path
from splinefeed.cli.summary import print_errors, print_notes
from splinefeed.errors import FormatError, InputError

if TYPE_CHECKING:
    from splinefeed.pipeline.follow import Servo
    from splinefeed.pipeline.overview import Overview, Pictured
    from splinefeed.records import Response, Setpoints

EXAMPLES = """\b
Examples:
  splinefeed follow splinefeed-butterfly/setpoints.h5 --machine xytheta
  splinefeed follow recorded.csv --path part.json --machine router -o recorded-on-router
  splinefeed follow wing.h5 --machine my-table.toml --json

"""


def _print(page: Mapping[str, Any]) -> None:
    seconds = page["followed_ticks"] * page["period_s"]
    print_text(
        f"{page['name']} on {page['machine']}: {page['followed_ticks']} ticks, one every "
        f"{units.format_quantity(page['period_s'], 'time')}, {number(seconds, 6)} s"
        + (" (linear model)" if page["linear"] else "")
    )
    print_notes(page["notes"])
    print_text()
    print_errors(page)
    if page["stopped"]:
        print_text()
        print_text(f"STOPPED: {page['stopped']}")


@click.command(cls=PanelCommand, epilog=EXAMPLES + options.UNITS_NOTE)
@click.argument("setpoints")
@click.option(
    "--machine",
    metavar="NAME|FILE",
    required=True,
    help="The machine; splinefeed machine list shows the built-in ones.",
)
@click.option("--path", "source", metavar="FILE|SHAPE", help="The true path.  [default: that of the setpoints]")
@click.option("--which", metavar="NAME|NUMBER", help="Which path of a file that holds several (from 1).")
@click.option("--chord", type=options.Quantity("length"), metavar="LENGTH", help="Airfoil .dat: one unit of the file.")
@click.option("--columns", type=options.Names(), metavar="NAMES", help="CSV without names: its columns, as t,x,y.")
@click.option("--period", type=options.Quantity("time"), metavar="TIME", help="CSV: the period.  [default: from t]")
@click.option("--linear", is_flag=True, help="Without friction, backlash, counts, converter codes and limits.")
@options.figures
@click.option("-o", "--output", metavar="DIR", help="Folder to write to.  [default: splinefeed-NAME-on-MACHINE]")
@answers(_print)
def command(say: Say, setpoints: str, **given: Any) -> Page:
    """Simulate the axes of a machine on SETPOINTS; report following error and contour error.

    SETPOINTS is a file that splinefeed saved (.h5, .csv, .mat), or a CSV of another program with columns t and axes.
    The contour error, the distance from the true path, needs the path. If an axis runs away, the simulation stops
    there, writes what it has and exits with code 1.
    """
    from itertools import chain
    from pathlib import Path

    import splinefeed
    from splinefeed.formats.plain import plain
    from splinefeed.formats.setpoints import save
    from splinefeed.machine.machine import Machine
    from splinefeed.pipeline.follow import Servo
    from splinefeed.pipeline.overview import Overview, Pictured
    from splinefeed.report import files
    from splinefeed.report.folder import default_name, staged
    from splinefeed.report.path_figures import contour_figure
    from splinefeed.report.servo_figures import errors_figure
    from splinefeed.simulation.follow import CHUNK

    drawing = options.figure_formats(given)
    machine = Machine.load(given["machine"])
    say(f"reading {setpoints}")
    chunks, notes = read_setpoints_chunks(setpoints, given, CHUNK)
    first = next(chunks, None)
    if first is None:
        raise FormatError(f"{setpoints}: holds no setpoints")
    path = source = None
    if given["source"] or says_path(first.settings):
        path, source = path_of(first.settings, given, setpoints)
    else:
        notes.append("the path is not known, so there is no contour error; give --path FILE or --path SHAPE")
    name = str(first.settings.get("path") or (path.name if path else Path(setpoints).stem))
    servo = Servo(machine, path, linear=given["linear"])
    overview, pictured = Overview(), Pictured()
    folder = given["output"] if given["output"] is not None else f"{default_name(name)}-on-{machine.name}"
    with staged(folder, files.FOLLOW_RECORD, files.FOLLOW_NAMES) as stage:
        try:
            save(_responses(chain([first], chunks), servo, overview, pictured, say), stage / files.RESPONSE)
        except FormatError:
            raise
        except InputError as error:
            raise FormatError(f"{setpoints}: {error}") from None
        names = [files.RESPONSE]
        if drawing:
            say("drawing")
            drawn = {"errors": errors_figure({first.method: overview.response}, name, machine.name)}
            beside = pictured.deviation(path) if path is not None else None
            if beside is not None:
                drawn["contour"] = contour_figure(beside, name, machine.name)
            names += files.save_figures(drawn.items(), stage, drawing)
            notes += files.missing(drawing, page=False)
        if servo.off_path > 0.0:
            notes.append(f"the setpoints are off the path by at most {servo.off_path:.3g} mm")
        numbers = servo.tally.numbers()
        page: dict[str, Any] = plain(
            {
                "ok": numbers["stopped"] is None,
                "file": setpoints,
                "name": name,
                "path": source,
                "machine": machine.name,
                "machine_file": given["machine"],
                "linear": given["linear"],
                "period_s": first.period,
                **numbers,
                "notes": [*notes, *servo.notes],
                "program": f"splinefeed {splinefeed.__version__}",
            }
        )
        names.append(files.FOLLOW_RECORD)
        files.write_record({**page, "files": names}, stage / files.FOLLOW_RECORD)
    return {**page, "files": [str(Path(folder) / each) for each in names]}


def _responses(
    chunks: Iterator[Setpoints], servo: Servo, overview: Overview, pictured: Pictured, say: Say
) -> Iterator[Response]:
    """The response piece by piece on its way to the file, seen by what figures are drawn from."""
    from splinefeed.pipeline.follow import follow_chunks

    for response in follow_chunks(chunks, servo):
        overview.see(response)
        pictured.see(response, servo.commanded)
        yield response
        say(f"following: {servo.tally.ticks} ticks, {servo.tally.ticks * servo.tally.period:.6g} s of the motion")
