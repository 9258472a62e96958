"""`splinefeed tune-feed`: the highest feed at which a machine keeps to a contour tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from splinefeed.cli import options
from splinefeed.cli.answers import Page, answers
from splinefeed.cli.output import number, print_table, print_text
from splinefeed.cli.panels import PanelCommand
from splinefeed.cli.progress import Say
from splinefeed.cli.source import read_path
from splinefeed.cli.summary import length, print_notes

EXAMPLES = """\b
Examples:
  splinefeed tune-feed butterfly --machine xytheta --contour-tolerance 20um
  splinefeed tune-feed part.json --machine my-table.toml --contour-tolerance 5um --feed 6000mm/min
  splinefeed tune-feed wing.dat --machine lintable --contour-tolerance 0.01 --vary feed --json

"""


def _print(page: Mapping[str, Any]) -> None:
    best, tolerance = page["best"], length(page["contour_tolerance_mm"])
    print_text(f"{page['name']} on {page['machine']}, contour error within {tolerance}, {page['strategy']}")
    print_notes(page["notes"])
    print_text()
    rows = []
    for each in page["trials"]:
        kept = each["stopped"] is None and each["contour_error_max_mm"] <= page["contour_tolerance_mm"]
        verdict = "ran away" if each["stopped"] else "within" if kept else "over"
        rows.append(
            [
                "best" if each == best else "",
                number(each["scale"]),
                f"{number(each['feed_max_mm_s'])} mm/s",
                f"{number(each['duration_s'], 6)} s",
                length(each["contour_error_max_mm"]),
                length(each["contour_error_rms_mm"]),
                "" if each["at_s_mm"] is None else f"{number(each['at_s_mm'])} mm",
                verdict,
            ]
        )
    print_table(["", "scale", "top feed", "time", "contour error", "its rms", "at", "tolerance"], rows)
    print_text()
    if best is None:
        least, feed = length(page["least_error_mm"]), number(page["least_error_feed_mm_s"])
        print_text(f"NOT KEPT: no feed tried keeps {tolerance}; the least contour error is {least} at {feed} mm/s")
    else:
        feed, time, error = best["feed_max_mm_s"], best["duration_s"], best["contour_error_max_mm"]
        print_text(f"top feed {number(feed)} mm/s, {number(time, 6)} s, contour error {length(error)}")


@click.command(cls=PanelCommand, epilog=EXAMPLES + options.UNITS_NOTE)
@click.argument("source")
@click.option("--machine", metavar="NAME|FILE", required=True, help="The machine; its axes' limits hold, too.")
@click.option(
    "--contour-tolerance",
    type=options.Quantity("length"),
    metavar="LENGTH",
    required=True,
    help="Largest distance of the simulated machine from the path.",
)
@click.option(
    "--vary",
    type=click.Choice(["all", "feed"]),
    default="all",
    show_default=True,
    help="Scale all limits as a slower clock does (feed by k, acceleration by k^2, jerk by k^3), or the feed alone.",
)
@options.limits
@click.option("--3d", "tangential", is_flag=True, help="A third axis, theta, follows the tangent of a planar path.")
@click.option("--method", metavar="NAME", help="Interpolation method.  [default: arc-length]")
@options.corrections
@options.reading
@options.figures
@click.option("-o", "--output", metavar="DIR", help="Folder to write to.  [default: splinefeed-NAME-for-MACHINE]")
@answers(_print)
def command(say: Say, source: str, **given: Any) -> Page:
    """Find the fastest motion along SOURCE whose simulated contour error is within a tolerance.

    The given limits, or those of the machine's axes, are scaled down until it is; each trial plans, interpolates and
    follows. Writes the limits found (limits.toml, for run --limits), the setpoints under them, and the curve of
    contour error by feed. The exit code is 1 where no feed keeps the tolerance.
    """
    import dataclasses
    from pathlib import Path

    import splinefeed
    from splinefeed.formats import limits_toml
    from splinefeed.formats.plain import plain
    from splinefeed.formats.setpoints import save
    from splinefeed.interpolation import registry
    from splinefeed.machine.machine import Machine
    from splinefeed.pipeline.contour_feed import tune_feed
    from splinefeed.report import files
    from splinefeed.report.folder import default_name, staged
    from splinefeed.report.record import command as command_line
    from splinefeed.report.record import source_of
    from splinefeed.report.servo_figures import feed_curve_figure

    drawing = options.figure_formats(given)
    machine = Machine.load(given["machine"])
    method = given["method"] or registry.DEFAULT_METHOD
    registry.method(method)
    reading = options.reading_from(given) | ({"tangential": True} if given["tangential"] else {})
    say(f"reading {source}")
    path = read_path(source, reading)
    limits, period, strategy = options.limits_from(given, machine, path.axes)
    limits, _ = options.as_programmed(limits, path, given)
    folder = given["output"] if given["output"] is not None else f"{default_name(path.name)}-for-{machine.name}"
    with staged(folder, files.TUNE_FEED_RECORD, files.TUNE_FEED_NAMES) as stage:
        tuning = tune_feed(
            path, limits, machine, given["contour_tolerance"],
            period=period, strategy=strategy, method=method, corrections=given["corrections"],
            vary=given["vary"], on_progress=say,
        )  # fmt: skip
        say("writing")
        names = []
        if tuning.best is not None and tuning.served is not None:
            limits_toml.write(tuning.best.limits, stage / files.LIMITS)
            setpoints = tuning.served.setpoints
            command = command_line(source, setpoints.settings, reading, ("hdf5",), given["machine"])
            settings = {**setpoints.settings, "source": source_of(source), "command": command}
            save(dataclasses.replace(setpoints, settings=settings), stage / files.SETPOINTS["hdf5"])
            save(tuning.served.response, stage / files.RESPONSE)
            names += [files.LIMITS, files.SETPOINTS["hdf5"], files.RESPONSE]
        drawn = [("feed-curve", feed_curve_figure(tuning, path.name, machine.name))]
        names += files.save_figures(drawn, stage, drawing)
        names.append(files.TUNE_FEED_RECORD)
        page: dict[str, Any] = plain(
            {
                "name": path.name,
                "source": source_of(source),
                "machine": machine.name,
                "machine_file": given["machine"],
                "period_s": period,
                "strategy": tuning.trials[-1].law.strategy,
                "method": method,
                "vary": given["vary"],
                "limits_asked": limits.as_dict(),
                **tuning.numbers(),
                "notes": [
                    *path.findings,
                    *(tuning.served.notes if tuning.served else ()),
                    *tuning.notes,
                    *files.missing(drawing, page=False),
                ],
                "least_error_mm": tuning.least.error,
                "least_error_feed_mm_s": tuning.least.feed,
                "program": f"splinefeed {splinefeed.__version__}",
            }
        )
        files.write_record({**page, "files": names}, stage / files.TUNE_FEED_RECORD)
    return {**page, "files": [str(Path(folder) / name) for name in names]}
