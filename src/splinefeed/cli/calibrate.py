"""`splinefeed calibrate`: how a machine's control plans, fitted to recorded runs."""

from __future__ import annotations

from typing import Any

import click

from splinefeed.cli import options
from splinefeed.cli.answers import answers
from splinefeed.cli.output import Block, Page, number, table
from splinefeed.cli.progress import Say
from splinefeed.errors import InputError

RUN = """\
A run is a CSV with the columns seconds,what,value: Block_Number is the line that runs, Program_Status ACTIVE and
PROGRAM_COMPLETED its start and end.
"""


def _show(page: Page) -> list[Block]:
    numbers = [
        [
            each["name"], number(each["value"]), each["unit"],
            f"{number(each['low'])} to {number(each['high'])}" if each["shown"] else "not shown by these runs",
        ]
        for each in page["numbers"]
    ]  # fmt: skip
    runs = [
        [name, f"{each['recorded_s']:.2f}", f"{each['estimated_s']:.2f}", f"{each['error']:+.2%}"]
        for run in page["runs"]
        for name, each in ((run["run"], run), *((f"  {tool['tool']}", tool) for tool in run["tools"]))
    ]
    return [
        table(["number", "value", "unit", "95 % interval"], numbers),
        table(["run", "recorded, s", "estimated, s", "error"], runs),
    ]


@answers(_show, RUN)
@click.argument("runs", nargs=-1, required=True, metavar="PROGRAM=RUN...")
@options.table("""
--machine       NAME|FILE!  The machine; its [control] is the prior.
--keep          NAME*       A number that stays as the file has it; may be repeated.
-o --output     FILE        Machine file to write.  [default: MACHINE-calibrated.toml]
""")
@options.reading_program
def command(say: Say, runs: tuple[str, ...], **given: Any) -> Page:
    """Fit the section [control] of a machine file to recorded RUNS, and report how certain each number is.

    Numbers that the runs do not determine keep their value in the machine file, or a usual one, and are named. The
    machine is written to a new file.

    Examples:
      splinefeed calibrate part.nc=monday.csv part.nc=friday.csv --machine my-mill.toml -o calibrated.toml
      splinefeed calibrate part.nc=run.csv --machine my-mill.toml --keep home.z --json
    """
    from splinefeed.machine.machine import Machine
    from splinefeed.pipeline.calibration import PRIORS, calibrate, record

    machine = Machine.load(given["machine"])
    for name in given["keep"]:
        if name not in PRIORS:
            raise InputError(f"--keep: {name!r} is not fitted; choose from {', '.join(PRIORS)}")
    file = given["output"] if given["output"] is not None else f"{machine.name}-calibrated.toml"
    say("reading runs")
    recorded = []
    for run in runs:
        program, equals, log = run.rpartition("=")
        if not equals:
            raise InputError(f"{run}: its program is missing; write PROGRAM={run}")
        recorded.append(record(program, log, machine, **options.reading_from(given)))
    found = calibrate(recorded, machine, keep=given["keep"], say=say)
    found.machine.save(file)
    return {**found.as_dict(), "files": [file]}
