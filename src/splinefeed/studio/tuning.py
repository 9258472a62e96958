"""A page's machine tuned: gains by a rule or for its path, steps and contour error before and after."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import splinefeed as sf
from splinefeed.errors import InputError, SplinefeedError
from splinefeed.formats.plain import plain
from splinefeed.machine import writing
from splinefeed.pipeline.experiment import serve
from splinefeed.pipeline.tuned import TunedMachine, along_path, by_rule
from splinefeed.pipeline.tuning import EVALUATIONS, PATH_RULE
from splinefeed.report import interactive
from splinefeed.report.servo_figures import errors_figure, step_figure
from splinefeed.studio import sources
from splinefeed.studio.settings import Bench, SettingsError, Wanted

#: Runs of the path that a page may ask for.
MOST_RUNS = 5000
#: Least time between two reports of progress, s.
OFTEN = 0.1


def tuned(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """The new machine as the text of its file, its page of numbers, and figures of steps and errors.

    The request's `how` has `rule`, `kind` and `identify` of a rule; `runs` and `feed_forward` of rule path. Raises
    SettingsError.
    """
    wanted, run = bench.done(request["settings"])
    machine, before, how = wanted.machine, run.served, dict(request.get("how") or {})
    if machine is None or before is None:
        raise SettingsError({"machine": "choose the machine to tune"})
    try:
        found = _found(machine, wanted, run, how, bench)
        bench.say(f"following on the tuned {machine.name}")
        after = serve(wanted.path, run.law, run.points, found.machine)
    except SplinefeedError as error:
        raise SettingsError({"": sources.words(error, bench.uploads)}) from error
    bench.say("drawing")
    old, new = before.tally.numbers(), after.tally.numbers()
    figures = {"tuning": step_figure(found.curves(), machine.name)}
    if len(before.response) and len(after.response):
        figures["errors"] = errors_figure({"old gains": before.response, "new gains": after.response})
    page = {
        **found.page,
        "contour_error_max_before_mm": old.get("contour_error_max_mm"),
        "contour_error_max_mm": new.get("contour_error_max_mm"),
        "tracking_error_max_before": old.get("tracking_error_max"),
        "tracking_error_max": new.get("tracking_error_max"),
        "stopped": new.get("stopped"),
    }
    name = f"{machine.name.removesuffix('-tuned')}-tuned"
    return {
        "numbers": plain(page),
        "figures": {key: interactive.to_plain(figure) for key, figure in figures.items()},
        "machine": {"name": name, "toml": writing.to_text(found.machine)},
        "rule": how.get("rule"),
    }


def _found(machine: sf.Machine, wanted: Wanted, run: sf.Run, how: Mapping[str, Any], bench: Bench) -> TunedMachine:
    moving = [axis for axis in wanted.path.axes if axis in machine.axes]
    if how.get("rule") != PATH_RULE:
        kind, identify = str(how.get("kind", "pid")), str(how.get("identify", "model"))
        return by_rule(
            machine, moving, str(how.get("rule")), period=wanted.period, kind=kind, identify=identify, say=bench.say
        )
    runs = how.get("runs", EVALUATIONS)
    if isinstance(runs, bool) or not isinstance(runs, int) or not 1 <= runs <= MOST_RUNS:
        raise InputError(f"runs is {runs!r}; it must be a whole number from 1 to {MOST_RUNS}")
    said_at = 0.0

    def progress(done: int, total: int) -> None:
        nonlocal said_at
        if (now := time.monotonic()) - said_at >= OFTEN or done == total:
            said_at = now
            bench.mail.tell({"kind": "progress", "words": f"{done} of {total} runs", "share": [done, total]})

    forward, points = bool(how.get("feed_forward")), run.points
    return along_path(
        machine, points, wanted.path, axes=moving, evaluations=runs, feed_forward=forward, on_progress=progress
    )
