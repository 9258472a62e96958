"""A page's machine tuned: gains by a rule or for its path, steps and contour error before and after."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from splinefeed.errors import InputError, SplinefeedError
from splinefeed.formats.plain import plain
from splinefeed.machine import writing
from splinefeed.pipeline.follow import serve
from splinefeed.pipeline.run import Run
from splinefeed.pipeline.tuning import EVALUATIONS, PATH_RULE, TunedMachine, along_path, by_rule
from splinefeed.report import interactive
from splinefeed.report.servo_figures import errors_figure, step_figure
from splinefeed.studio import sources
from splinefeed.studio.bench import Bench
from splinefeed.studio.settings import SettingsError, Wanted

#: Runs of the path that a page may ask for.
MOST_RUNS = 5000
#: Least time between two reports of progress, s.
OFTEN = 0.1


def tuned(settings: Mapping[str, Any], how: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """The new machine as the text of its file, its page of numbers, and figures of steps and errors.

    how  `rule`, `kind` and `identify` of a rule; `runs` and `feed_forward` of rule path. Raises SettingsError.
    """
    wanted, run = bench.done(settings)
    before = run.served
    if wanted.machine is None or before is None:
        raise SettingsError({"machine": "choose the machine to tune"})
    try:
        found = _found(wanted, run, how, bench)
        bench.say(f"following on the tuned {wanted.machine.name}")
        after = serve(wanted.path, run.law, run.points, found.machine)
    except SplinefeedError as error:
        raise SettingsError({"": sources.words(error, bench.uploads)}) from error
    bench.say("drawing")
    old, new = before.tally.numbers(), after.tally.numbers()
    figures = {"tuning": step_figure(found.curves(), wanted.machine.name)}
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
    name = wanted.machine.name if wanted.machine.name.endswith("-tuned") else f"{wanted.machine.name}-tuned"
    return {
        "numbers": plain(page),
        "figures": {name: interactive.to_plain(figure) for name, figure in figures.items()},
        "machine": {"name": name, "toml": writing.to_text(found.machine)},
        "rule": how.get("rule"),
    }


def _found(wanted: Wanted, run: Run, how: Mapping[str, Any], bench: Bench) -> TunedMachine:
    machine = wanted.machine
    assert machine is not None
    moving = [axis for axis in wanted.path.axes if axis in machine.axes]
    if how.get("rule") != PATH_RULE:
        kind, identify = str(how.get("kind", "pid")), str(how.get("identify", "model"))
        return by_rule(
            machine, moving, str(how.get("rule")), period=wanted.period, kind=kind, identify=identify, say=bench.say
        )
    runs = how.get("runs", EVALUATIONS)
    if isinstance(runs, bool) or not isinstance(runs, int) or not 1 <= runs <= MOST_RUNS:
        raise InputError(f"runs is {runs!r}; it must be a whole number from 1 to {MOST_RUNS}")

    said = 0.0

    def progress(done: int, total: int) -> None:
        nonlocal said
        if (now := time.monotonic()) - said < OFTEN and done < total:
            return
        said = now
        bench.mail.tell({"kind": "progress", "words": f"{done} of {total} runs", "share": [done, total]})

    return along_path(
        machine,
        run.points,
        wanted.path,
        axes=moving,
        evaluations=runs,
        feed_forward=bool(how.get("feed_forward")),
        on_progress=progress,
    )
