"""`splinefeed compare`: every interpolation method on the same motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from splinefeed.cli import options
from splinefeed.cli.panels import PanelCommand

if TYPE_CHECKING:
    from splinefeed.cli.progress import Say
    from splinefeed.pipeline.compare import MethodResult

EXAMPLES = """\b
Examples:
  splinefeed compare
  splinefeed compare butterfly --start-feed 60 --end-feed 60
  splinefeed compare part.json --methods taylor-2,milne-simpson,arc-length --json

"""


@click.command(cls=PanelCommand, epilog=EXAMPLES + options.UNITS_NOTE)
@click.argument("source", required=False)
@click.option("--methods", "names", type=options.Names(), help="Only these methods.  [default: all]")
@options.limits
@options.corrections
@options.reading
@options.as_json
def command(source: str | None, as_json: bool, names: tuple[str, ...] | None, **given: Any) -> None:
    """Run every method over the motion along SOURCE and print a table of the results.

    \b
    ripple       error of each step's length against the planned one, relative
    drift        how far the method is ahead of the law at the end of the path
    chord error  largest distance of the path from the line between setpoints
    ns a tick    time of one setpoint on this machine

    Without SOURCE: the paper's airfoil.
    """  # noqa: D301 - click takes a backspace as "do not wrap"
    from splinefeed.cli import output
    from splinefeed.cli.progress import busy

    with busy() as say:
        page, results = _compare(source, names, given, say)
    if as_json:
        output.print_json(page)
        return
    from splinefeed.cli.summary import print_methods, print_notes
    from splinefeed.records import unit_along

    duration, unit = output.number(page["duration_s"], 6), unit_along(page["axes"])
    output.print_text(
        f"{page['name']}: {output.number(page['length_mm'], 7)} {unit} in {duration} s, {page['ticks']} setpoints; "
        f"rounding alone makes a ripple of {page['ripple_floor']:.1e}"
    )
    print_notes(page["notes"])
    output.print_text()
    print_methods(results, unit)


def _compare(
    source: str | None, names: tuple[str, ...] | None, given: dict[str, Any], say: Say
) -> tuple[dict[str, Any], list[MethodResult]]:
    from splinefeed.cli.source import read_path
    from splinefeed.feed.planning import plan
    from splinefeed.interpolation import registry
    from splinefeed.interpolation.interpolator import Interpolator
    from splinefeed.pipeline.compare import compare
    from splinefeed.pipeline.run import PAPER_SHAPE

    limits, period, strategy = options.limits_from(given)
    names = names or registry.methods()
    for name in names:
        registry.method(name)
    source = PAPER_SHAPE if source is None else source
    say(f"reading {source}")
    path = read_path(source, options.reading_from(given))
    limits, assumed = options.as_programmed(limits, path, given)
    say("planning")
    law = plan(path, limits, strategy=strategy, period=period)
    results = []
    for name in names:
        say(f"comparing methods: {name}")
        results += [trace.result for trace in compare(path, law, methods=[name], corrections=given["corrections"])]
    page = {
        "name": path.name,
        "axes": list(path.axes),
        "duration_s": law.duration,
        "length_mm": path.length,
        "ticks": Interpolator(path, law, method=names[0]).ticks,
        "period_s": period,
        "strategy": law.strategy,
        "corrections": given["corrections"],
        "limits": limits.as_dict(),
        "ripple_floor": max(result.ripple_floor for result in results),
        "methods": [result.as_dict() for result in results],
        "notes": [*assumed, *path.findings, *law.notes],
    }
    return page, results
