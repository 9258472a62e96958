"""`splinefeed follow`: what the axes of a machine do with setpoints."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import splinefeed as sf
from splinefeed import units
from splinefeed.cli import options, summary
from splinefeed.cli.answers import answers, recorded
from splinefeed.cli.output import Block, Page, Say, notes, number
from splinefeed.cli.setpoints_file import path_of, read_setpoints_chunks, says_path
from splinefeed.errors import FormatError
from splinefeed.files.metadata import naming


def _show(page: Page) -> list[Block]:
    ticks = f"{page['followed_ticks']} ticks, one every {units.format_quantity(page['period_s'], 'time')}"
    seconds = f"{number(page['followed_ticks'] * page['period_s'], 6)} s" + " (linear model)" * page["linear"]
    head = f"{page['name']} on {page['machine']}: {ticks}, {seconds}"
    return [[head, *notes(page["notes"])], summary.errors(page), summary.stopped(page)]


@answers(_show)
@options.table("""
setpoints       SETPOINTS
--machine       NAME|FILE!       The machine; splinefeed machine list shows the built-in ones.
--linear        -                Without friction, backlash, counts, converter codes and limits.
-o --output     DIR              Folder to write to.  [default: splinefeed-NAME-on-MACHINE]
""")
@options.setpoints_path
@options.setpoints_csv
@options.figures
def follow(say: Say, setpoints: str, **given: Any) -> Page:
    """Simulate the axes of a machine on SETPOINTS; report following error and contour error.

    SETPOINTS is a file that splinefeed saved (.h5, .csv, .mat), or a CSV of another program with columns t and axes.
    The contour error, the distance from the true path, needs the path. If an axis runs away, the simulation stops
    there, writes what it has and exits with code 1.

    Examples:
      splinefeed follow splinefeed-butterfly/setpoints.h5 --machine xytheta
      splinefeed follow recorded.csv --path part.json --machine router -o recorded-on-router
      splinefeed follow wing.h5 --machine my-table.toml --json
    """
    from itertools import chain
    from pathlib import Path

    from splinefeed.analysis.thinning import Kept
    from splinefeed.reports import files
    from splinefeed.reports.folder import default_name, staged
    from splinefeed.reports.path_figures import contour_figure
    from splinefeed.reports.servo_figures import errors_figure
    from splinefeed.runs.fold import CHUNK
    from splinefeed.runs.following import MOST_SAMPLES, Servo, follow_chunks

    drawing = options.figure_formats(given)
    machine = sf.Machine.load(given["machine"])
    say(f"reading {setpoints}")
    chunks, said = read_setpoints_chunks(setpoints, given, CHUNK)
    first = next(chunks, None)
    if first is None:
        raise FormatError(f"{setpoints}: holds no setpoints")
    path = source = None
    if given["source"] or says_path(first.settings):
        path, source = path_of(first.settings, given, setpoints)
    else:
        said.append("the path is not known, so there is no contour error; give --path FILE or --path SHAPE")
    name = str(first.settings.get("path") or (path.name if path else Path(setpoints).stem))
    servo = Servo(machine, first, path, linear=given["linear"], keep=Kept(most=MOST_SAMPLES))

    def responses() -> Iterator[sf.Response]:
        """The response piece by piece on its way to the file."""
        for response in follow_chunks(chain([first], chunks), servo):
            yield response
            say(f"following: {servo.tally.ticks} ticks, {servo.tally.ticks * first.period:.6g} s of the motion")

    folder = given["output"] if given["output"] is not None else f"{default_name(name)}-on-{machine.name}"
    with staged(folder, files.FOLLOW_RECORD, files.FOLLOW_NAMES) as stage:
        with naming(setpoints):
            sf.save(responses(), stage / files.RESPONSE)
        names = [files.RESPONSE]
        if drawing:
            say("drawing")
            drawn = {"errors": errors_figure({first.method: servo.response}, name, machine.name, servo.bands)}
            if (beside := servo.deviation()) is not None:
                drawn["contour"] = contour_figure(beside, name, machine.name)
            names += files.save_figures(drawn.items(), stage, drawing)
            said += files.missing(drawing, page=False)
        if servo.off_path > 0.0:
            linear = path is not None and path.linear > 0
            far = f"{servo.off_path:.3g} mm" if linear else f"{math.degrees(servo.off_path):.3g} deg"
            said.append(f"the setpoints are off the path by at most {far}")
        numbers = servo.tally.numbers()
        page = {
            "ok": numbers["stopped"] is None,
            "file": setpoints,
            "name": name,
            "path": source,
            "machine": machine.name,
            "machine_file": given["machine"],
            "linear": given["linear"],
            "period_s": first.period,
            **numbers,
            "notes": [*said, *servo.notes],
        }
        return recorded(page, names, folder, stage, files.FOLLOW_RECORD)
