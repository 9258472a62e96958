"""`splinefeed plan` and `compare`: the time law alone, and every interpolation method on it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import splinefeed as sf
from splinefeed import units
from splinefeed.cli import options, summary
from splinefeed.cli.answers import answers
from splinefeed.cli.output import Block, Page, Say, notes, number, table
from splinefeed.cli.source import job_of

if TYPE_CHECKING:
    from splinefeed.records import Array

#: Decimals of the table: what is below is the rounding of the law.
ROUNDED = 9
#: Pieces that the table shows; --json lists all.
MOST_ROWS = 28


def _show(page: Page) -> list[Block]:
    period, unit = units.format_quantity(page["period_s"], "time"), summary.unit_of_path(page)
    rows = [
        [str(i), *(number(round(value, ROUNDED), 6) for value in piece.values())]
        for i, piece in enumerate(page["pieces"][:MOST_ROWS])
    ]
    along = [f"from {unit}", f"to {unit}", f"feed {unit}/s", f"to {unit}/s", f"accel {unit}/s^2", f"jerk {unit}/s^3"]
    left = len(page["pieces"]) - len(rows)
    return [
        [
            f"{summary.motion_sentence(page)}, planned for a period of {period}",
            summary.law(page),
            *notes(page["notes"]),
        ],
        summary.limits(page),
        [
            *table(["piece", "start s", "lasts s", *along], rows, texts=0),
            *([f"... and {left} more pieces; --json lists all"] if left else []),
        ],
    ]


@answers(_show)
@options.table("""
source           [SOURCE]
-o --output      FILE      Save the law as HDF5 (.h5).
""")
@options.limits
@options.machine
@options.linking
@options.reading
@options.smoothing
def plan(say: Say, source: str | None, **given: Any) -> Page:
    """Plan the time law s(t) of the motion along SOURCE, and print its pieces.

    Without SOURCE: the paper's airfoil. The exit code is 1 where a limit does not hold.

    Examples:
      splinefeed plan
      splinefeed plan part.json --feed 3600mm/min --accel 0.5m/s^2 -o law.h5
      splinefeed plan butterfly --start-feed 60 --end-feed 60 --json
    """
    from splinefeed.checks.law import limits_along
    from splinefeed.planner.planning import cheap_to_bound
    from splinefeed.records import unit_along

    what = job_of(say, source, given, sf.Machine.load(given["machine"]) if given["machine"] else None)
    path: Any = what.path
    say("making the time law")
    law = sf.plan(
        path, what.limits, strategy=what.strategy, period=what.period, bound=cheap_to_bound(path, what.limits)
    )
    verdict = sf.Verdict(limits=limits_along(law, path, what.limits), problems=(), along=unit_along(path.axes))
    if given["output"]:
        sf.save(law, given["output"])
    starts, ends = law.breaks[:-1], law.breaks[1:]
    from_s, from_feed, acceleration, jerk = path.of_tip(*_motion(law, starts))
    to_s, to_feed, *_ = path.of_tip(*_motion(law, ends))
    columns = {
        "start_s": starts,
        "duration_s": ends - starts,
        "from_mm": from_s,
        "to_mm": to_s,
        "feed_from_mm_s": from_feed,
        "feed_to_mm_s": to_feed,
        "acceleration_from_mm_s2": acceleration,
        "jerk_mm_s3": jerk,
    }
    return {
        "ok": verdict.ok,
        "name": path.name,
        "axes": list(path.axes),
        "duration_s": law.duration,
        "lower_bound_s": law.settings.get("lower_bound_s"),
        "length_mm": path.tip_end,
        "period_s": law.period,
        "strategy": law.strategy,
        "limits": verdict.as_dict()["limits"],
        "stops_mm": path.tip_length(path.stops).tolist(),
        "pieces": [dict(zip(columns, map(float, row), strict=True)) for row in zip(*columns.values(), strict=True)],
        "notes": [*what.notes, *path.findings, *law.notes],
        "files": [given["output"]] if given["output"] else [],
    }


def _motion(law: sf.TimeLaw, t: Array) -> tuple[Array, Array, Array, Array]:
    return law(t), law.feed(t), law.acceleration(t), law.jerk(t)


def _show_compared(page: Page) -> list[Block]:
    floor = f"rounding alone makes a ripple of {page['ripple_floor']:.1e}"
    head = f"{summary.motion_sentence(page)}, {page['ticks']} setpoints"
    return [[head, floor, *notes(page["notes"])], summary.methods(page)]


@answers(_show_compared)
@options.table("""
source           [SOURCE]
--methods names  NAMES     Only these methods.  [default: all]
""")
@options.limits
@options.corrections
@options.linking
@options.reading
def compare(say: Say, source: str | None, names: tuple[str, ...] | None, **given: Any) -> Page:
    """Run every method over the motion along SOURCE and print a table of the results.

    \b
    ripple       error of each step's length against the planned one, relative
    drift        how far the method is ahead of the law at the end of the path
    chord error  largest distance of the path from the line between setpoints
    ns           time of one setpoint on this machine

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
    what = job_of(say, source, given)
    path: Any = what.path
    say("making the time law")
    law = sf.plan(path, what.limits, strategy=what.strategy, period=what.period)
    say("comparing methods")
    results = [trace.result for trace in sf.runs.compare(path, law, methods=names, corrections=given["corrections"])]
    return {
        "name": path.name,
        "axes": list(path.axes),
        "duration_s": law.duration,
        "length_mm": path.tip_end,
        "ticks": sf.interpolation.Interpolator(path, law, method=names[0]).ticks,
        "period_s": what.period,
        "strategy": law.strategy,
        "corrections": given["corrections"],
        "limits": what.limits.as_dict(),
        "ripple_floor": max(result.ripple_floor for result in results),
        "methods": [result.as_dict() for result in results],
        "notes": [*what.notes, *path.findings, *law.notes],
    }
