"""`splinefeed compare`: every interpolation method on the same motion."""

from __future__ import annotations

from typing import Any

import click

import splinefeed as sf
from splinefeed.cli import options, summary
from splinefeed.cli.answers import answers
from splinefeed.cli.output import Block, Page, notes
from splinefeed.cli.progress import Say
from splinefeed.cli.source import task_of


def _show(page: Page) -> list[Block]:
    floor = f"rounding alone makes a ripple of {page['ripple_floor']:.1e}"
    head = f"{summary.motion_sentence(page)}, {page['ticks']} setpoints; {floor}"
    return [[head, *notes(page["notes"])], summary.methods(page)]


@answers(_show)
@click.argument("source", required=False)
@options.table("--methods names  NAMES  Only these methods.  [default: all]")
@options.limits
@options.corrections
@options.reading
def command(say: Say, source: str | None, names: tuple[str, ...] | None, **given: Any) -> Page:
    """Run every method over the motion along SOURCE and print a table of the results.

    \b
    ripple       error of each step's length against the planned one, relative
    drift        how far the method is ahead of the law at the end of the path
    chord error  largest distance of the path from the line between setpoints
    ns a tick    time of one setpoint on this machine

    Without SOURCE: the paper's airfoil.

    Examples:
      splinefeed compare
      splinefeed compare butterfly --start-feed 60 --end-feed 60
      splinefeed compare part.json --methods taylor-2,milne-simpson,arc-length --json
    """  # noqa: D301 - click takes a backspace as "do not wrap"
    from splinefeed.interpolation import registry

    names = names or registry.methods()
    for name in names:
        registry.method(name)
    what = task_of(say, source, given)
    path = what.path
    say("planning")
    law = sf.plan(path, what.limits, strategy=what.strategy, period=what.period)
    results = []
    for name in names:
        say(f"comparing methods: {name}")
        results += [trace.result for trace in sf.compare(path, law, methods=[name], corrections=given["corrections"])]
    return {
        "name": path.name,
        "axes": list(path.axes),
        "duration_s": law.duration,
        "length_mm": path.length,
        "ticks": sf.Interpolator(path, law, method=names[0]).ticks,
        "period_s": what.period,
        "strategy": law.strategy,
        "corrections": given["corrections"],
        "limits": what.limits.as_dict(),
        "ripple_floor": max(result.ripple_floor for result in results),
        "methods": [result.as_dict() for result in results],
        "notes": [*what.notes, *path.findings, *law.notes],
    }
