"""What a worker process does for a page: read, plan, follow, tune, and make files; all through `pipeline`."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Mapping
from typing import Any

from splinefeed.errors import InputError, SplinefeedError
from splinefeed.feed.modes import LOOK_AHEAD, TIME_OPTIMAL
from splinefeed.pipeline.run import PAPER_LIMITS
from splinefeed.studio import programs, results, sources
from splinefeed.studio.bench import Bench
from splinefeed.studio.settings import SettingsError, complete, resolve

#: Paths of more curves than this are not planned while a slider moves.
MOST_WHILE_MOVING = 20_000


def plan(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """A run at once: by the strategy of the settings, or by `look-ahead` in its place where that takes its time.

    `final` says whether there is nothing to add: another strategy, or a machine to follow. A request that looks at one
    figure, `look`, gets no other, and the history does not hear of it.
    """
    settings = complete(request.get("settings"))
    if settings["by_control"]:
        return programs.timed(settings, bench, at_once=True)
    wanted = resolve(settings, bench.uploads)
    final = wanted.strategy != TIME_OPTIMAL and not wanted.followed
    quick = {**settings, "strategy": LOOK_AHEAD} if wanted.strategy == TIME_OPTIMAL else settings
    if len(wanted.path.curves) > MOST_WHILE_MOVING:
        return {"final": False, "shown": None}
    wanted, made = bench.done(quick, follow=False)
    look = request.get("look")
    found = results.result(wanted, made, look if isinstance(look, Mapping) else None)
    out = {"final": final, "shown": wanted.strategy, "result": found}
    return {**out, "entry": results.entry(wanted, found["numbers"], made)} if final and not look else out


def settle(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """A run of the settings, followed by its machine, or a program as its control plans it."""
    settings = complete(_settings(request))
    if settings["by_control"]:
        return programs.timed(settings, bench, at_once=False)
    wanted, made = bench.done(settings)
    bench.say("drawing")
    found = results.result(wanted, made)
    entry = results.entry(wanted, found["numbers"], made)
    return {"final": True, "shown": wanted.strategy, "result": found, "entry": entry}


def read(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """What an upload holds."""
    source = request["source"]
    bench.say(f"reading {sources.upload(source.get('file'), bench.uploads).name}")
    try:
        contents, file = sources.contents_of(source, bench.uploads)
    except (SplinefeedError, OSError) as error:
        raise SettingsError({"source": sources.words(error, bench.uploads)}) from error
    listed = [
        {"name": each.name, "curves": len(each.curves), "length_mm": each.length, "findings": list(each.findings)}
        for each in contents[:1000]
    ]
    return {"name": file.name, "format": contents.format, "units": contents.units, "paths": listed}


def make(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """A file to download: what it is called, and where it lies in the folder of files made."""
    from splinefeed.studio import downloads

    settings, what, form = _settings(request), request.get("what"), request.get("form")
    place = bench.made / secrets.token_hex(16)
    place.mkdir(mode=0o700)
    file = downloads.make(str(what), None if form is None else str(form), settings, bench, place)
    return {"download": place.name, "name": file.name, "bytes": file.stat().st_size}


def tune(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """New gains for the machine."""
    from splinefeed.studio import tuning

    how = request.get("how")
    return tuning.tuned(_settings(request), how if isinstance(how, Mapping) else {}, bench)


def play(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """Play a motion in real time."""
    from splinefeed.studio import playing

    return playing.played(request, bench)


def warm(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """Load or compile the kernels: for moving sliders alone, for playing, or for everything else."""
    usual = complete({})
    if request.get("play"):
        from splinefeed.studio import playing

        motion = playing.motion_of({"settings": usual}, bench)[1]
        for _ in range(2):
            motion.take(8, 1.0)
        return {}
    wanted, made = bench.done({**usual, "strategy": LOOK_AHEAD})
    results.result(wanted, made)
    bench.done({**usual, "limits": PAPER_LIMITS.as_dict()})
    if request.get("all"):
        wanted, made = bench.done({**usual, "machine": {"name": "xytheta"}})
        results.result(wanted, made)
    return {}


def _settings(request: Mapping[str, Any]) -> Mapping[str, Any]:
    settings = request.get("settings")
    if not isinstance(settings, Mapping):
        raise InputError("a request without settings")
    return settings


#: Every task by its name.
TASKS: dict[str, Callable[[Mapping[str, Any], Bench], dict[str, Any]]] = {
    "plan": plan,
    "settle": settle,
    "read": read,
    "make": make,
    "tune": tune,
    "play": play,
    "warm": warm,
}


def error_of(error: BaseException) -> dict[str, Any]:
    """What went wrong, for the page: words by field, and whether it is a fault of the program."""
    if isinstance(error, SettingsError):
        return {"fields": error.problems, "fault": False}
    if isinstance(error, SplinefeedError):
        return {"fields": {"": " ".join(str(error).split())}, "fault": False}
    if isinstance(error, MemoryError):
        words = "not enough memory for this; choose a longer period or a shorter path"
        return {"fields": {"": words}, "fault": False}
    return {"fields": {"": f"internal fault, please report it: {type(error).__name__}: {error}"}, "fault": True}
