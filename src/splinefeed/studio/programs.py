"""A program as the control of a machine plans it, for a page: text, path, and the time of each line and tool."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from splinefeed.errors import InputError
from splinefeed.formats.plain import plain
from splinefeed.pipeline.cycle_time import CycleTime, cycle_time
from splinefeed.report import interactive
from splinefeed.report.time_figures import program_figure, time_figure
from splinefeed.studio import results, sources
from splinefeed.studio.settings import Bench, SettingsError, machine_of

#: A program of more bytes is timed as a job, which says how far it is and can be cancelled.
MOST_AT_ONCE = 2_000_000


def timed(settings: Mapping[str, Any], bench: Bench, *, at_once: bool) -> dict[str, Any]:
    """All that a page shows of a program on a machine, or `at_once` for a long one that it takes a job.

    Raises SettingsError with what is wrong beside its field.
    """
    problems: dict[str, str] = {}
    machine = machine_of(settings["machine"], problems)
    if machine is None:
        raise SettingsError(problems or {"machine": "choose the machine whose control is to run the program"})
    try:
        source = settings["source"]
        file = sources.upload(source.get("file"), bench.uploads)
        options = sources.reading_of(source, sources.PROGRAM, bench.uploads)
        if at_once and file.stat().st_size > MOST_AT_ONCE:
            return {"final": False, "shown": None}
        bench.say(f"timing {file.name} on {machine.name}")
        time = cycle_time(file, machine, **options)
    except (InputError, OSError) as error:
        field = "machine" if str(error).startswith(f"{machine.name}:") else "source"
        raise SettingsError({field: sources.words(error, bench.uploads)}) from error
    bench.say("planning with other limits")
    page = {**time.as_dict(), "name": file.name, "saves": time.saves()}
    bench.say("drawing")
    text = file.read_bytes().decode("utf-8", errors="replace")
    result = {**shown(time, text), "numbers": plain(page)}
    return {"final": True, "shown": f"as the control of {machine.name} runs it", "result": result}


def shown(time: CycleTime, text: str) -> dict[str, Any]:
    """The text, the path and figure, and each line's time as arrays."""
    figure, of = program_figure(time), time.by_line
    columns = {name: getattr(of, name) for name in ("line", "seconds", "beyond", "begin", "limit", "operation")}
    columns |= dict(zip("xyz", of.place.T, strict=True))
    return {
        "program": text,
        "lines": {name: interactive.array(values) for name, values in columns.items()},
        "limits": time.limits,
        "path": results.drawn(figure),
        "figures": {"tools": interactive.to_plain(time_figure(time))},
        "axes": ["x", "y", "z"],
    }
