"""`splinefeed run`: the whole chain, with its files and figures."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import click

from splinefeed.cli import options
from splinefeed.cli.failures import DONE, NOT_KEPT

if TYPE_CHECKING:
    from splinefeed.cli.progress import Say
    from splinefeed.pipeline.compare import MethodTrace
    from splinefeed.pipeline.run import Run

EXAMPLES = """\b
Examples:
  splinefeed run
  splinefeed run butterfly --accel 500 --jerk 20000 -o wings
  splinefeed run section.dat --chord 150mm --feed 3600mm/min --format hdf5 --format csv

"""


@click.command(epilog=EXAMPLES + options.UNITS_NOTE)
@click.argument("source", required=False)
@options.limits
@click.option("--method", metavar="NAME", help="Interpolation method.  [default: milne-simpson-anchored]")
@options.corrections
@options.reading
@click.option(
    "--format",
    "formats",
    type=click.Choice(["hdf5", "csv", "mat", "npz", "parquet", "halstreamer", "pvt"]),
    multiple=True,
    help="Format of the setpoints; may be repeated.  [default: hdf5]",
)
@click.option("--figures/--no-figures", default=True, help="Draw figures, SVG and PNG.  [default: figures]")
@click.option("--no-compare", is_flag=True, help="Leave out the other methods, with their table and figure.")
@click.option("-o", "--output", metavar="DIR", help="Folder to write to.  [default: splinefeed-NAME]")
@options.as_json
@click.pass_context
def command(ctx: click.Context, /, source: str | None, as_json: bool, **given: Any) -> None:
    """Plan the motion along SOURCE, make its setpoints, measure them; write files and figures.

    SOURCE is a shape (naca:0025?perimeter=33, butterfly, ...), a JSON curve or an airfoil .dat file; without it, the
    paper's experiment runs: a NACA 0025 airfoil of 33 mm perimeter. The exit code is 1 where a limit of the path does
    not hold, or its end is missed.
    """
    from splinefeed.cli import output
    from splinefeed.cli.progress import busy

    with busy("run") as say:
        result, traces, page = _run(source, given, say)
    if as_json:
        output.print_json(page)
    else:
        from splinefeed.cli.summary import print_run

        print_run(page, [trace.result for trace in traces])
        output.print_text()
        output.print_text(f"wrote {' '.join(page['files'])}")
    ctx.exit(DONE if result.ok else NOT_KEPT)


def _run(source: str | None, given: dict[str, Any], say: Say) -> tuple[Run, list[MethodTrace], dict[str, Any]]:
    """Run and write; the page of numbers, with `files` as seen from the current folder."""
    from pathlib import Path

    from splinefeed.cli.folder import default_name, staged
    from splinefeed.cli.record import record
    from splinefeed.cli.source import read_path
    from splinefeed.interpolation import registry
    from splinefeed.pipeline.compare import compare
    from splinefeed.pipeline.run import PAPER_SHAPE, run
    from splinefeed.report import files

    limits, period, strategy = options.limits_from(given)
    method = given["method"] or registry.DEFAULT_METHOD
    registry.method(method)
    source = PAPER_SHAPE if source is None else source
    reading = options.reading_from(given)
    formats = given["formats"] or ("hdf5",)
    corrections = given["corrections"]
    say(f"reading {source}")
    path = read_path(source, reading)
    folder = default_name(path.name) if given["output"] is None else given["output"]
    with staged(folder) as stage:
        say("planning and interpolating")
        result = run(path, limits, period=period, strategy=strategy, method=method, corrections=corrections)
        traces: list[MethodTrace] = []
        for name in () if given["no_compare"] else registry.methods():
            say(f"comparing methods: {name}")
            traces += compare(path, result.law, methods=[name], corrections=corrections)
        page = record(result, traces, source, reading, formats)
        say("writing setpoints and figures")
        settings = {**result.points.settings, "source": page["source"], "command": page["command"]}
        documented = dataclasses.replace(result, points=dataclasses.replace(result.points, settings=settings))
        names = files.write(
            documented, stage, formats=formats, traces=traces, with_figures=given["figures"], record=page
        )
    return result, traces, {**page, "files": [str(Path(folder) / name) for name in names]}
