"""`splinefeed tune-feed`: the highest feed at which a machine keeps to a contour tolerance."""

from __future__ import annotations

from typing import Any

import click

import splinefeed as sf
from splinefeed.cli import options
from splinefeed.cli.answers import answers, recorded
from splinefeed.cli.output import Block, Page, length, listed, notes, number
from splinefeed.cli.progress import Say
from splinefeed.cli.source import task_of


def _show(page: Page) -> list[Block]:
    best, tolerance, rows = page["best"], length(page["contour_tolerance_mm"]), []
    for each in page["trials"]:
        kept = each["contour_error_max_mm"] <= page["contour_tolerance_mm"]
        judged = "ran away" if each["stopped"] else "within" if kept else "over"
        rows.append({**each, "": "best" if each == best else "", "tolerance": judged})
    heads = (
        "=, scale, top feed=feed_max_mm_s, time=duration_s, contour error=contour_error_max_mm, "
        "its rms=contour_error_rms_mm, at=at_s_mm, tolerance"
    )
    if best is None:
        least, feed = length(page["least_error_mm"]), number(page["least_error_feed_mm_s"])
        end = f"NOT KEPT: no feed tried keeps {tolerance}; the least contour error is {least} at {feed} mm/s"
    else:
        feed, time, error = best["feed_max_mm_s"], best["duration_s"], best["contour_error_max_mm"]
        end = f"top feed {number(feed)} mm/s, {number(time, 6)} s, contour error {length(error)}"
    head = f"{page['name']} on {page['machine']}, contour error within {tolerance}, {page['strategy']}"
    return [[head, *notes(page["notes"])], listed(rows, heads), [end]]


@answers(_show)
@click.argument("source")
@options.table("""
--machine       NAME|FILE!       The machine; its axes' limits hold, too.
--contour-tolerance  LENGTH!     Largest distance of the simulated machine from the path.
--vary          all|feed =all    Scale all limits as a slower clock does (feed by k, acceleration by k^2, jerk by k^3),
                                 or the feed alone.
--method        NAME             Interpolation method.  [default: arc-length]
-o --output     DIR              Folder to write to.  [default: splinefeed-NAME-for-MACHINE]
""")
@options.limits
@options.tangential
@options.corrections
@options.reading
@options.figures
def command(say: Say, source: str, **given: Any) -> Page:
    """Find the fastest motion along SOURCE whose simulated contour error is within a tolerance.

    The given limits, or those of the machine's axes, are scaled down until it is; each trial plans, interpolates and
    follows. Writes the limits found (limits.toml, for run --limits), the setpoints under them, and the curve of
    contour error by feed. The exit code is 1 where no feed keeps the tolerance.

    Examples:
      splinefeed tune-feed butterfly --machine xytheta --contour-tolerance 20um
      splinefeed tune-feed part.json --machine my-table.toml --contour-tolerance 5um --feed 6000mm/min
      splinefeed tune-feed wing.dat --machine lintable --contour-tolerance 0.01 --vary feed --json
    """
    import dataclasses

    from splinefeed.formats import limits_toml
    from splinefeed.interpolation import registry
    from splinefeed.pipeline.contour_feed import tune_feed
    from splinefeed.report import files
    from splinefeed.report.folder import default_name, staged
    from splinefeed.report.record import command as command_line
    from splinefeed.report.record import source_of
    from splinefeed.report.servo_figures import feed_curve_figure

    drawing = options.figure_formats(given)
    machine = sf.Machine.load(given["machine"])
    method = registry.method(given["method"] or registry.DEFAULT_METHOD).name
    what = task_of(say, source, given, machine)
    path = what.path
    folder = given["output"] if given["output"] is not None else f"{default_name(path.name)}-for-{machine.name}"
    with staged(folder, files.TUNE_FEED_RECORD, files.TUNE_FEED_NAMES) as stage:
        tuning = tune_feed(
            path, what.limits, machine, given["contour_tolerance"],
            period=what.period, strategy=what.strategy, method=method, corrections=given["corrections"],
            vary=given["vary"], on_progress=say,
        )  # fmt: skip
        say("writing")
        names, served, points = [], tuning.served, tuning.setpoints
        if tuning.best is not None and served is not None and points is not None:
            limits_toml.write(tuning.best.limits, stage / files.LIMITS)
            command = command_line(source, points.settings, what.reading, ("hdf5",), given["machine"])
            settings = {**points.settings, "source": source_of(source), "command": command}
            sf.save(dataclasses.replace(points, settings=settings), stage / files.SETPOINTS["hdf5"])
            sf.save(served.response, stage / files.RESPONSE)
            names += [files.LIMITS, files.SETPOINTS["hdf5"], files.RESPONSE]
        names += files.save_figures(
            [("feed-curve", feed_curve_figure(tuning, path.name, machine.name))], stage, drawing
        )
        said = [*path.findings, *(served.notes if served else ()), *tuning.notes, *files.missing(drawing, page=False)]
        page = {
            "name": path.name,
            "source": source_of(source),
            "machine": machine.name,
            "machine_file": given["machine"],
            "period_s": what.period,
            "strategy": tuning.trials[-1].law.strategy,
            "method": method,
            "vary": given["vary"],
            "limits_asked": what.limits.as_dict(),
            **tuning.numbers(),
            "notes": said,
            "least_error_mm": tuning.least.error,
            "least_error_feed_mm_s": tuning.least.feed,
        }
        return recorded(page, names, folder, stage, files.TUNE_FEED_RECORD)
