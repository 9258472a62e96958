"""`splinefeed time`: how long a program takes on a machine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from splinefeed.cli import options
from splinefeed.cli.answers import Page, answers
from splinefeed.cli.output import print_table, print_text
from splinefeed.cli.panels import PanelCommand
from splinefeed.cli.progress import Say
from splinefeed.cli.summary import print_notes

EXAMPLES = """\b
Examples:
  splinefeed time part.nc --machine hurco-04
  splinefeed time part.nc --machine my-mill.toml --figure part-time.svg
  splinefeed time part.ngc --machine router --offsets "G28=0,0,80" --json
  splinefeed time part.nc --machine hurco-04 --from-line 120

"""


def _print(page: Mapping[str, Any]) -> None:
    whole = round(page["total_s"])
    clock = f"{whole // 3600} h " * (whole >= 3600) + f"{whole // 60 % 60} min " * (whole >= 60) + f"{whole % 60} s"
    print_text(f"{page['name']} on {page['machine']}: {clock} ({page['total_s']:.2f} s), {page['blocks']} blocks")
    print_notes(page["notes"])
    print_text()
    shown = [f"{kind}_s" for kind in ("cutting", "rapid", "tool_change", "spindle", "dwell", "start")]
    shown = [key for key in shown if page[key] > 0.0] + ["total_s"]
    rows = [
        [each["tool"] or "-", *(f"{each[key]:.2f}" for key in shown)]
        for each in (*page["tools"], {**page, "tool": "all"})
    ]
    print_table(["tool (s)", *(key.removesuffix("_s").replace("_", " ") for key in shown)], rows)
    print_text()
    rows = [
        [f"line {each['line']}", f"{each['seconds']:.2f}", f"{each['beyond_feed_s']:.2f}", each["limit"]]
        for each in page["places"]
    ]
    print_table(["place", "s", "beyond feed, s", "what binds"], rows)
    rows = [[each["what"], f"{each['saves_s']:.2f}"] for each in page["saves"] if each["saves_s"] >= 0.005]
    if rows:
        print_text()
        print_table(["20 % better", "saves, s"], rows)


@click.command(cls=PanelCommand, epilog=EXAMPLES)
@click.argument("program")
@click.option("--machine", metavar="NAME|FILE", required=True, help="The machine, with a section [control].")
@options.reading_program
@options.from_line
@click.option("--figure", metavar="FILE", help="Draw a bar chart along the program (.svg, .png, .pdf).")
@click.option("--no-saves", is_flag=True, help="Do not search for what would save time.")
@answers(_print)
def command(say: Say, program: str, **given: Any) -> Page:
    """Estimate the cycle time of PROGRAM (G-code): cutting, rapid moves, tool changes, spindle and dwells.

    The section [control] of the machine file describes how the control plans: see `splinefeed machine show hurco-04`.
    Also reports the time of each tool, the slowest lines with the limit that binds there, and what 20 % more of each
    limit saves.
    """
    from splinefeed.pipeline.cycle_time import cycle_time
    from splinefeed.report.time_figures import time_figure

    reading = {name: given[name] for name in ("dialect", "start", "offsets", "tools", "repair", "from_line")}
    say(f"reading {program}")
    time = cycle_time(program, given["machine"], **reading)
    page = time.as_dict() | {"source": program, "saves": [], "files": []}
    if not given["no_saves"]:
        say("planning with other limits")
        page["saves"] = time.saves()
    if given["figure"] is not None:
        time_figure(time).save(given["figure"])
        page["files"] = [given["figure"]]
    return page
