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
#: What the table calls each kind of time.
_TITLES = {"cutting_s": "cutting", "rapid_s": "rapid", "tool_change_s": "tool change", "spindle_s": "spindle",
           "dwell_s": "dwell", "start_s": "start"}  # fmt: skip


def _print(page: Mapping[str, Any]) -> None:
    print_text(f"{page['name']} on {page['machine']}: {_clock(page['total_s'])}, {page['blocks']} blocks")
    print_notes(page["notes"])
    print_text()
    shown = [key for key in _TITLES if page[key] > 0.0]
    rows = [[each["tool"] or "-", *[_seconds(each[key]) for key in (*shown, "total_s")]] for each in page["tools"]]
    rows.append(["all", *[_seconds(page[key]) for key in (*shown, "total_s")]])
    print_table(["tool (s)", *[_TITLES[key] for key in shown], "total"], rows)
    print_text()
    rows = [
        [f"line {each['line']}", _seconds(each["seconds"]), _seconds(each["beyond_feed_s"]), each["limit"]]
        for each in page["places"]
    ]
    print_table(["place", "s", "beyond feed, s", "what binds"], rows)
    if page["saves"]:
        print_text()
        rows = [[each["what"], _seconds(each["saves_s"])] for each in page["saves"] if each["saves_s"] >= 0.005]
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


def _seconds(value: float) -> str:
    return f"{value:.2f}"


def _clock(seconds: float) -> str:
    """1 h 02 min 03 s, and in seconds."""
    whole = round(seconds)
    parts = [f"{whole // 3600} h "] if whole >= 3600 else []
    parts += [f"{whole // 60 % 60} min "] if whole >= 60 else []
    return f"{''.join(parts)}{whole % 60} s ({seconds:.2f} s)"
