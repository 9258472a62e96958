"""`splinefeed report`: the HTML report of a run, made again from what it left."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from splinefeed.cli.answers import Page, answers
from splinefeed.cli.output import counted, print_text
from splinefeed.cli.progress import Say
from splinefeed.cli.setpoints_file import on_its_machine, path_of
from splinefeed.errors import FormatError

if TYPE_CHECKING:
    from pathlib import Path


EXAMPLES = """\b
Examples:
  splinefeed report splinefeed-butterfly
  splinefeed report splinefeed-wing -o wing.html

"""


def _print(page: Page) -> None:
    print_text("checked: every limit holds" if page["ok"] else f"NOT KEPT: {counted(len(page['problems']), 'problem')}")


@click.command(epilog=EXAMPLES)
@click.argument("folder")
@click.option("-o", "--output", metavar="FILE", help="File to write.  [default: report.html in the folder]")
@click.option("--machine", metavar="NAME|FILE", help="Of a tool path: the machine.  [default: that of the run]")
@answers(_print)
def command(say: Say, folder: str, output: str | None, machine: str | None) -> Page:
    """Make the report of the run in FOLDER again: one HTML file that works offline.

    The setpoints are measured and checked again, against their path and limits. The exit code is 1 where a limit or a
    check does not hold.
    """
    from functools import partial
    from pathlib import Path

    from splinefeed.formats.plain import plain
    from splinefeed.formats.setpoints import load, load_chunks
    from splinefeed.pipeline.compare import MethodResult
    from splinefeed.pipeline.run import MOST_IN_CHUNKS, check_ticks, measured
    from splinefeed.records import Limits, Response, TimeLaw
    from splinefeed.report import files, html

    place = Path(folder)
    said = _record(place / files.RECORD)
    say(f"reading {folder}")
    forms = ("hdf5", "npz", "parquet", "mat", "csv")  # those that keep every digit and all settings
    file = next((each for form in forms if (each := place / files.SETPOINTS[form]).is_file()), None)
    if file is None:
        raise FormatError(f"{place}: has no setpoints that can be read again; run once more with --format hdf5")
    law = load(place / files.LAW)
    if not isinstance(law, TimeLaw):
        raise FormatError(f"{place / files.LAW}: holds {type(law).__name__}; expected TimeLaw")
    settings = next(load_chunks(file, 1)).settings
    path, _ = path_of(settings, {"source": None, "which": None, "chord": None}, str(file))
    limits = Limits.from_dict(settings["limits"])
    joints = on_its_machine(path, settings, machine, limits)
    say("measuring and checking")
    ticks = check_ticks(law, settings["period"], MOST_IN_CHUNKS)
    run = measured(joints, limits, law, partial(load_chunks, file), ticks)
    responses = {}
    if (place / files.RESPONSE).is_file():
        response = load(place / files.RESPONSE)
        if isinstance(response, Response):
            responses[run.kept.method] = response
    page: dict[str, Any] = {**said, **plain(run.numbers())}
    results = [MethodResult(**each) for each in said.get("methods", [])]
    target = Path(output) if output else place / files.REPORT
    say(f"writing {target}")
    drawn = files.of_run(run, responses, str(page.get("machine", "")))
    files.write_report(html.page(run, page, drawn, results), target)
    return {**page, "files": [str(target)]}


def _record(file: Path) -> dict[str, Any]:
    import json

    try:
        said = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise FormatError(f"{file}: is not there; give a folder that splinefeed run wrote") from None
    except (OSError, ValueError, RecursionError) as error:
        raise FormatError(f"{file}: cannot be read: {error}") from None
    if not isinstance(said, dict):
        raise FormatError(f"{file}: is not the record of a run")
    return said
