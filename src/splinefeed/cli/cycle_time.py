"""`splinefeed time` and `calibrate`: how long a program takes on a machine, and the model of that, fitted to runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import splinefeed as sf
from splinefeed.cli import options
from splinefeed.cli.answers import answers
from splinefeed.cli.output import Block, Page, Say, notes, number, table
from splinefeed.errors import InputError

if TYPE_CHECKING:
    from splinefeed.programs import CycleTime

RUN = """\
A run is a CSV with the columns seconds,what,value: Block_Number is the line that runs, Program_Status ACTIVE and
PROGRAM_COMPLETED its start and end.
"""
#: Seconds that are not 0 with two decimals.
SHOWN = 0.005
#: Beyond an end of the travel by less than this, mm, is rounding of a program.
TRAVEL_ROUNDING = 1e-6
#: How to say where a part lies.
LIES = "say where the part lies on the machine: --offsets G54=X,Y,Z"
#: Said where the control passes corners.
PASSED = "corners are passed as this control does ({}); splinefeed run stops at corners unless --smooth passes them"


def _show_time(page: Page) -> list[Block]:
    whole = round(page["total_s"])
    clock = f"{whole // 3600} h " * (whole >= 3600) + f"{whole // 60 % 60} min " * (whole >= 60) + f"{whole % 60} s"
    kinds = [kind for kind in ("cutting", "rapid", "tool_change", "spindle", "dwell", "start") if page[f"{kind}_s"] > 0]
    tools = [
        [each["tool"] or "-", *(f"{each[f'{kind}_s']:.2f}" for kind in (*kinds, "total"))]
        for each in (*page["tools"], {**page, "tool": "all"})
        if each["total_s"] >= SHOWN
    ]
    places = [
        [
            f"line {each['line']}",
            f"{each['seconds']:.2f}",
            f"{round(each['beyond_feed_s'], 2) + 0.0:+.2f}",
            each["limit"],
        ]
        for each in page["places"]
    ]
    saves = [[each["what"], f"{each['saves_s']:.2f}"] for each in page["saves"] if each["saves_s"] >= SHOWN]
    total = f"{clock} ({page['total_s']:.2f} s), {page['blocks']} blocks"
    if page["interval_s"] is not None:
        total = f"{clock} ({page['total_s']:.2f} s, 95 % interval {{:.1f}} to {{:.1f}}), {page['blocks']} blocks"
        total = total.format(*page["interval_s"])
    head = f"{page['name']} on {page['machine']}: {total}; dialect {page['dialect']}; control: {page['control']}"
    stops = f"{page['corner_stops']} corners are stops: {page['corner_stops_s']:.2f} s more than passing them"
    share = f", {page['corner_stops_s'] / page['total_s']:.1%} of the time" if page["total_s"] else ""
    return [
        [head, *([f"{stops}{share}"] if page["corner_stops"] else []), *notes(page["notes"])],
        table(["tool (s)", *(kind.replace("_", " ") for kind in (*kinds, "total"))], tools),
        table(["place", "s", "against F alone, s", "what binds"], places),
        table(["20 % more (times: less) of", "saves, s"], saves) if saves else [],
    ]


@answers(_show_time, "")
@options.table("""
program         PROGRAM
--machine       NAME|FILE   The machine: its [control], or the limits of its axes.  [default: that of
                            splinefeed machine use, else plain-mill]
--limits limits_file  FILE  Limits in a TOML file, as run takes them; they hold in place of the machine's.
--figure        FILE        Draw a bar chart along the program (.svg, .png, .pdf).
--no-saves      -           Do not search for what would save time.
""")
@options.reading_program
@options.from_line
def time(say: Say, program: str, **given: Any) -> Page:
    """Estimate the cycle time of PROGRAM (G-code): cutting, rapid moves, tool changes, spindle and dwells.

    The section [control] of the machine file describes how the control plans: see `splinefeed machine show hurco-04`;
    a machine without it stops at every corner and keeps the limits of its axes. Also reports the time of each tool, the
    slowest lines with the limit that binds there, and what 20 % more of each limit saves.

    Examples:
      splinefeed time part.nc
      splinefeed time part.nc --machine hurco-04
      splinefeed time part.nc --machine my-mill.toml --figure part-time.svg
      splinefeed time part.nc --limits limits.toml
      splinefeed time part.ngc --machine router --offsets "G28=0,0,80" --json
      splinefeed time part.nc --machine hurco-04 --from-line 120
    """
    from splinefeed.reports.time_figures import time_figure

    machine, said = options.machine_under(given, otherwise=True)
    say(f"reading {program}")
    found = sf.cycle_time(program, machine, **options.reading_from(given))
    page = found.as_dict() | {"source": program, "saves": [], "files": []}
    page["notes"] = [*page["notes"], *said]
    page["notes"] += _beyond_travel(found)
    if machine.control is not None and machine.control.passing:
        page["notes"].append(PASSED.format(machine.control.passing))
    if not given["no_saves"]:
        say("planning with other limits")
        page["saves"] = found.saves()
    if given["figure"] is not None:
        time_figure(found).save(given["figure"])
        page["files"] = [given["figure"]]
    return page


def _beyond_travel(found: CycleTime) -> list[str]:
    """What to say of moves that leave the travel of an axis, from where the first feed move begins: the furthest."""
    import numpy as np

    blocks, said = found.blocks, []
    first = int(np.argmin(blocks.rapid))  # where the tool is before is not known
    rows = np.arange(blocks.end[first - 1] if first else 1, len(blocks.trace))
    for column, name in enumerate("xyz"):
        axis = found.machine.axes.get(name)
        for sign, end in () if axis is None else ((-1.0, axis.limits.minimum), (1.0, axis.limits.maximum)):
            beyond = np.zeros(1) if end is None else sign * (blocks.trace[rows, column] - end)
            if end is not None and beyond.max() > TRAVEL_ROUNDING:
                row = rows[int(np.argmax(beyond))]
                line = blocks.line[np.searchsorted(blocks.end, row)]
                place = f"{name} = {number(float(blocks.trace[row, column]))} mm in line {line}"
                said.append(f"the program goes to {place}; its travel ends at {number(end)} mm: {LIES}")
    return said


def _show_fit(page: Page) -> list[Block]:
    numbers = [
        [
            each["name"], number(each["value"]), each["unit"],
            (f"{number(each['low'])} to {number(each['high'])}" if each["shown"] else "not shown by these runs")
            + ", at the edge of its prior" * each["edge"],
        ]
        for each in page["numbers"]
    ]  # fmt: skip
    runs = [
        [name, f"{each['recorded_s']:.2f}", f"{each['estimated_s']:.2f}", f"{each['error']:+.2%}"]
        for run in page["runs"]
        for name, each in ((run["run"], run), *((f"  {tool['tool']}", tool) for tool in run["tools"]))
    ]
    head = ["MISSES its own runs; the file is written, but do not trust it there:", *page["misses"]]
    return [
        [*(head if page["misses"] else []), *notes(page["notes"])],
        table(["number", "value", "unit", "95 % interval"], numbers),
        table(["run", "recorded, s", "estimated, s", "error"], runs),
    ]


@answers(_show_fit, RUN)
@options.table("""
runs            PROGRAM=RUN...
--machine       NAME|FILE!  The machine; its [control] is the prior.
--keep          NAME*       A number that stays as the file has it; may be repeated.
--strict        -           Exit with code 1 where the fit misses its own runs by more than 2 %.
-o --output     FILE        Machine file to write.  [default: MACHINE-calibrated.toml]
""")
@options.reading_program
def calibrate(say: Say, runs: tuple[str, ...], **given: Any) -> Page:
    """Fit the section [control] of a machine file to recorded RUNS, and report how certain each number is.

    A fit that misses a run, or an operation of one, by more than 2 % says so first, with what is likely missing.
    Numbers that the runs do not determine keep their value in the machine file, or a usual one, and are named. The
    machine is written to a new file, with how well each number is known: `splinefeed time` then gives intervals.

    Examples:
      splinefeed calibrate part.nc=monday.csv part.nc=friday.csv --machine my-mill.toml -o calibrated.toml
      splinefeed calibrate part.nc=run.csv --machine my-mill.toml --keep home.z --json
    """
    from splinefeed.programs import calibration

    machine = sf.Machine.load(given["machine"])
    for name in given["keep"]:
        if name not in calibration.PRIORS:
            raise InputError(f"--keep: {name!r} is not fitted; choose from {', '.join(calibration.PRIORS)}")
    file = given["output"] if given["output"] is not None else f"{machine.name}-calibrated.toml"
    say("reading runs")
    recorded = []
    for run in runs:
        program, equals, log = run.rpartition("=")
        if not equals:
            raise InputError(f"{run}: its program is missing; write PROGRAM={run}")
        recorded.append(calibration.record(program, log, machine, **options.reading_from(given)))
    found = calibration.calibrate(recorded, machine, keep=given["keep"], say=say)
    found.machine.save(file)
    return {**found.as_dict(), "ok": not (given["strict"] and found.misses), "files": [file]}
