"""`splinefeed report`: the HTML report of a run, made again from what it left."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import splinefeed as sf
from splinefeed.cli import options
from splinefeed.cli.answers import answers
from splinefeed.cli.failures import spoken
from splinefeed.cli.output import Page, Say, verdict
from splinefeed.cli.setpoints_file import of_robot, on_its_machine, path_of, run_of
from splinefeed.errors import FormatError
from splinefeed.paths.track import Track

#: Formats of setpoints that keep every digit and all settings, those that are read first.
FORMS = ("hdf5", "npz", "parquet", "mat", "csv")


@answers(lambda page: [verdict(page)], "")
@options.table("""
folder          FOLDER
-o --output     FILE             File to write.  [default: report.html in the folder]
--machine       NAME|FILE        Of a tool path: the machine.  [default: that of the run]
""")
def report(say: Say, folder: str, output: str | None, machine: str | None) -> Page:
    """Make the report of the run in FOLDER again: one HTML file that works offline.

    The setpoints are measured and checked again, against their path and limits. The exit code is 1 where a limit or a
    check does not hold.

    Examples:
      splinefeed report splinefeed-butterfly
      splinefeed report splinefeed-wing -o wing.html
    """
    from splinefeed.files.atomic import write_text
    from splinefeed.files.plain import plain
    from splinefeed.formats.setpoints import load_chunks
    from splinefeed.reports import files, html, record
    from splinefeed.runs.run import MOST_IN_CHUNKS, check_ticks, measured

    place = Path(folder)
    said = record.read(place / files.RECORD)
    say(f"reading {folder}")
    file = next((place / files.SETPOINTS[form] for form in FORMS if (place / files.SETPOINTS[form]).is_file()), None)
    if file is None:
        raise FormatError(f"{place}: has no setpoints that can be read again; run once more with --format hdf5")
    kept, there_now = said.get("sha256", {}), files.digests(place)
    for name in (file.name, files.LAW):
        if name in kept and kept[name] != there_now.get(name):
            raise FormatError(
                f"{place / name}: is not the file that {files.RECORD} describes: it has changed, or a run was cut off "
                "while its files were put in place; run once more"
            )
    law = sf.load(place / files.LAW, sf.TimeLaw)
    settings = next(load_chunks(file, 1)).settings
    moved: Track
    if (arm := of_robot(settings, str(file))) is not None:
        moved, limits, period = arm
    else:
        limits, period = run_of(settings, str(file))
        moved = on_its_machine(path_of(settings, {"source": None}, str(file))[0], settings, machine, limits)
    say("measuring and checking")
    ticks = check_ticks(law, period, MOST_IN_CHUNKS)
    run = measured(moved, limits, law, partial(_in_order, file, len(moved.tip_path.curves)), ticks)
    there = (place / files.RESPONSE).is_file()
    responses = {run.kept.method: sf.load(place / files.RESPONSE, sf.Response)} if there else {}
    for response in responses.values():
        _check_times(place / files.RESPONSE, response.t)
    page: dict[str, Any] = {**said, **plain(run.numbers())}
    page["notes"] = list(dict.fromkeys([*said.get("notes", []), *map(spoken, page["notes"])]))
    results = [sf.runs.MethodResult(**each) for each in said.get("methods", [])]
    target = Path(output) if output else place / files.REPORT
    say(f"writing {target}")
    drawn = files.of_run(run, responses, str(page.get("machine", "")))
    write_text(target, html.page(run, page, drawn, results))
    return {**page, "files": [str(target)]}


def _in_order(file: Path, curves: int, rows: int) -> Iterator[sf.Setpoints]:
    """Setpoints of a file in pieces; FormatError where times do not grow, or on a curve that the path does not have."""
    from splinefeed.formats.setpoints import load_chunks

    last = -math.inf
    for part in load_chunks(file, rows):
        _check_times(file, part.t, last)
        last = float(part.t[-1])
        beyond = (part.curve < 0) | (part.curve >= curves)
        if beyond.any():
            number = int(part.curve[np.argmax(beyond)])
            raise FormatError(f"{file}: a setpoint is on curve {number}; the path has {curves} curve(s), from 0")
        yield part


def _check_times(file: Path, t: Any, last: float = -math.inf) -> None:
    before = np.append(last, t[:-1])
    if (late := t <= before).any():
        tick = int(np.argmax(late))
        raise FormatError(f"{file}: t[{tick}] is {t[tick]:g} s, behind {before[tick]:g} s; times must grow")
