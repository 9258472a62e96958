"""`splinefeed time`: how long a program takes on a machine."""

from __future__ import annotations

from typing import Any

import click

from splinefeed.cli import options
from splinefeed.cli.answers import answers
from splinefeed.cli.output import Block, Page, notes, table
from splinefeed.cli.progress import Say


def _show(page: Page) -> list[Block]:
    whole = round(page["total_s"])
    clock = f"{whole // 3600} h " * (whole >= 3600) + f"{whole // 60 % 60} min " * (whole >= 60) + f"{whole % 60} s"
    kinds = [kind for kind in ("cutting", "rapid", "tool_change", "spindle", "dwell", "start") if page[f"{kind}_s"] > 0]
    tools = [
        [each["tool"] or "-", *(f"{each[f'{kind}_s']:.2f}" for kind in (*kinds, "total"))]
        for each in (*page["tools"], {**page, "tool": "all"})
    ]
    places = [
        [f"line {each['line']}", f"{each['seconds']:.2f}", f"{each['beyond_feed_s']:.2f}", each["limit"]]
        for each in page["places"]
    ]
    saves = [[each["what"], f"{each['saves_s']:.2f}"] for each in page["saves"] if each["saves_s"] >= 0.005]
    total = f"{clock} ({page['total_s']:.2f} s), {page['blocks']} blocks"
    return [
        [f"{page['name']} on {page['machine']}: {total}", *notes(page["notes"])],
        table(["tool (s)", *(kind.replace("_", " ") for kind in (*kinds, "total"))], tools),
        table(["place", "s", "beyond feed, s", "what binds"], places),
        table(["20 % better", "saves, s"], saves) if saves else [],
    ]


@answers(_show, "")
@click.argument("program")
@options.table("""
--machine       NAME|FILE!  The machine, with a section [control].
--figure        FILE        Draw a bar chart along the program (.svg, .png, .pdf).
--no-saves      -           Do not search for what would save time.
""")
@options.reading_program
@options.from_line
def command(say: Say, program: str, **given: Any) -> Page:
    """Estimate the cycle time of PROGRAM (G-code): cutting, rapid moves, tool changes, spindle and dwells.

    The section [control] of the machine file describes how the control plans: see `splinefeed machine show hurco-04`.
    Also reports the time of each tool, the slowest lines with the limit that binds there, and what 20 % more of each
    limit saves.

    Examples:
      splinefeed time part.nc --machine hurco-04
      splinefeed time part.nc --machine my-mill.toml --figure part-time.svg
      splinefeed time part.ngc --machine router --offsets "G28=0,0,80" --json
      splinefeed time part.nc --machine hurco-04 --from-line 120
    """
    from splinefeed.pipeline.cycle_time import cycle_time
    from splinefeed.report.time_figures import time_figure

    say(f"reading {program}")
    time = cycle_time(program, given["machine"], **options.reading_from(given))
    page = time.as_dict() | {"source": program, "saves": [], "files": []}
    if not given["no_saves"]:
        say("planning with other limits")
        page["saves"] = time.saves()
    if given["figure"] is not None:
        time_figure(time).save(given["figure"])
        page["files"] = [given["figure"]]
    return page
