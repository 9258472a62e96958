"""`splinefeed run --by-windows`: a program of any length to checked setpoints, in memory that does not grow."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from splinefeed.cli import options

if TYPE_CHECKING:
    from pathlib import Path

    from splinefeed.cli.progress import Say
    from splinefeed.pipeline.windows import WindowedRun

#: What needs the whole path or the whole motion, and what is said of it.
NOT_BY_WINDOWS = {
    "contour_tolerance": "--contour-tolerance: needs the whole motion, several times; leave out --by-windows",
    "tangential": "--3d: needs the whole path; leave out --by-windows",
}
NOTE = (
    "by windows: setpoints and numbers alone; no figures, no time law, no ripple, no comparison of methods, and no "
    "simulated axes (splinefeed follow setpoints.h5 makes these of the setpoints)"
)
#: How far a table's lines may be left by the curves that replace them, mm, unless it is said.
POINTS_TOLERANCE = 1e-3


def run(source: str | None, given: dict[str, Any], say: Say) -> dict[str, Any]:
    """Run and write; the page of numbers, with `files` as seen from the current folder."""
    from pathlib import Path

    from splinefeed.errors import InputError
    from splinefeed.formats.path_parts import read_parts
    from splinefeed.machine.table import Machine
    from splinefeed.pipeline.windows import WindowedRun
    from splinefeed.report import files
    from splinefeed.report.folder import default_name, staged

    _check_possible(given)
    if source is None:
        raise InputError("--by-windows: needs a SOURCE, a file of G-code or a table of points")
    machine = Machine.load(given["machine"]) if given["machine"] else None
    if machine is None:
        options.limits_from(given)  # options are validated before the file is opened
    say(f"looking through {source}")
    reading = options.reading_from(given)
    how = options.smoothing_from(given)
    tolerance = reading.pop("tolerance", None)
    parts = read_parts(source, **reading)
    table = parts.unit == "lines"
    if table:
        how.setdefault("smooth", POINTS_TOLERANCE if tolerance is None else tolerance)
    elif tolerance is not None:
        raise InputError("--tolerance: is for tables of points here; --smooth LENGTH smooths a program")
    limits, period, _ = options.limits_from(given, machine, parts.axes)
    limits, assumed = options.as_programmed(limits, parts, given)
    folder = default_name(parts.name) if given["output"] is None else given["output"]
    formats = tuple(dict.fromkeys(given["formats"] or ("hdf5",)))
    page = _about(source, limits.as_dict(), period, {**reading, **how}, formats, given)
    # of a table the lines were smoothed: the path that `read` makes of its points is another one
    kept = {name: page[name] for name in ("command", *(() if table else ("source",)))}
    made = WindowedRun(parts, limits, period, how, kept, _progress(say, parts.count, parts.unit))
    with staged(folder) as stage:
        names = _write(made, stage, formats, say)
        numbers = made.numbers()
        notes = [*assumed, *numbers["notes"], NOTE]
        page |= {**numbers, "name": parts.name, "notes": notes}
        files.write_record({**page, "files": [*names, files.RECORD]}, stage / files.RECORD)
    return {**page, "files": [str(Path(folder) / name) for name in (*names, files.RECORD)]}


def print_page(page: dict[str, Any]) -> None:
    """The numbers for people."""
    from splinefeed import units
    from splinefeed.cli.output import number, print_text
    from splinefeed.cli.summary import law_sentence, print_limits, print_notes

    period = units.format_quantity(page["period_s"], "time")
    print_text(
        f"{page['name']}: {number(page['length_mm'], 7)} mm in {number(page['duration_s'], 6)} s, "
        f"{page['ticks']} setpoints, one every {period}"
    )
    print_text(f"law       {page['strategy']}; {law_sentence(page, 'mm')}")
    print_notes(page["notes"])
    print_text()
    print_limits(page["limits"], "mm")
    print_text()
    for problem in page["problems"]:
        print_text(f"problem   {problem}")
    print_text("checked: every limit holds" if page["ok"] else "NOT KEPT: see the problems above")
    print_text()
    print_text(f"wrote {' '.join(page['files'])}")


def _check_possible(given: dict[str, Any]) -> None:
    """InputError for what cannot be done by windows."""
    from splinefeed.errors import InputError
    from splinefeed.feed.modes import LOOK_AHEAD
    from splinefeed.pipeline.long_path import METHOD

    for name, sentence in NOT_BY_WINDOWS.items():
        if given[name]:
            raise InputError(sentence)
    for name, only in (("strategy", LOOK_AHEAD), ("method", METHOD)):
        if given[name] not in (None, only):
            raise InputError(f"--{name} {given[name]}: needs the whole path; by windows there is {only} alone")
    if "mat" in given["formats"]:
        raise InputError("--format mat: needs all setpoints in memory; by windows choose hdf5, csv, npz or parquet")


def _about(
    source: str, limits: dict[str, float], period: float, reading: dict[str, Any], formats: tuple[str, ...],
    given: dict[str, Any],
) -> dict[str, Any]:  # fmt: skip
    """What the page of numbers says of the question and of the program."""
    import splinefeed
    from splinefeed.feed.modes import LOOK_AHEAD
    from splinefeed.formats.plain import plain
    from splinefeed.pipeline.long_path import METHOD
    from splinefeed.report.record import command, source_of, versions

    settings = {"limits": limits, "period": period, "strategy": LOOK_AHEAD, "method": METHOD}
    about: dict[str, Any] = plain(
        {
            "source": source_of(source),
            "settings": {**settings, "reading": reading},
            "command": command(source, settings, {**reading, "by_windows": True}, formats),
            "program": f"splinefeed {splinefeed.__version__}",
            "versions": versions(),
        }
    )
    return about


def _write(made: WindowedRun, stage: Path, formats: tuple[str, ...], say: Say) -> list[str]:
    """Write the setpoints in every format, and give the names: the first one as they are made, others from that."""
    from splinefeed.formats.setpoints import load_chunks, save
    from splinefeed.pipeline.long_run import MOST_IN_COLUMN
    from splinefeed.report.files import SETPOINTS

    if len(formats) == 1:
        save(made.setpoints(), stage / SETPOINTS[formats[0]])
        return [SETPOINTS[formats[0]]]
    whole = stage / SETPOINTS["hdf5"]
    save(made.setpoints(), whole)
    for form in formats:
        if form != "hdf5":
            say(f"writing {SETPOINTS[form]}")
            save(load_chunks(whole, MOST_IN_COLUMN), stage / SETPOINTS[form])
    if "hdf5" not in formats:
        whole.unlink()
    return [SETPOINTS[form] for form in formats]


def _progress(say: Say, count: int, unit: str) -> Callable[[int, int], None]:
    """Say how far it is, and how long it will take at the pace so far."""
    began = time.monotonic()

    def progress(read: int, ticks: int) -> None:
        gone = time.monotonic() - began
        left = f", about {gone * (count - read) / read:.0f} s left" if 0 < read < count and gone > 1.0 else ""
        say(f"{read} of {count} {unit} planned ahead, {ticks} setpoints written{left}")

    return progress
