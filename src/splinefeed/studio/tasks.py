"""What a worker process does for a page: read, plan, follow, tune, and make files; all through `pipeline`.

Uploads are read here, never in the server: what crashes a reader, eats memory or does not end takes a worker with it
and nothing else.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path as File
from typing import Any

import splinefeed as sf
from splinefeed.errors import InputError, SplinefeedError
from splinefeed.feed.modes import LOOK_AHEAD, TIME_OPTIMAL
from splinefeed.pipeline.run import PAPER_LIMITS
from splinefeed.studio import playing, programs, results, sources, tuning
from splinefeed.studio.settings import PATHS, Bench, SettingsError, complete, resolve
from splinefeed.workers import Answer, Handler, Mail

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
    settings = complete(request.get("settings"))
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
    from splinefeed.formats import registry
    from splinefeed.machine import writing
    from splinefeed.report import files, html
    from splinefeed.report.record import documented

    wanted, made = bench.done(request["settings"])
    machine, served = wanted.machine, made.served

    def setpoints(form: str, file: File) -> None:
        sf.save(documented(made, results.numbers(wanted, made, (form,))).setpoints(), file)

    def report(file: File) -> None:
        responses = {} if served is None else {made.kept.method: served.response}
        drawn = files.of_run(made, responses, results.machine_name(wanted) or "")
        files.write_report(html.page(made, results.numbers(wanted, made), drawn), file)

    makers: dict[str, tuple[str, Callable[[File], object]]] = {
        "law": (files.LAW, partial(sf.save, made.law)),
        "numbers": (files.RECORD, partial(files.write_record, results.numbers(wanted, made))),
        "report": (files.REPORT, report),
        **{f"path {form}": (f"path.{form}", partial(registry.write, made.path)) for form in PATHS},
        **{f"setpoints {form}": (name, partial(setpoints, form)) for form, name in files.SETPOINTS.items()},
    }
    if machine is not None:
        makers["machine"] = ("machine.toml", partial(writing.save, machine))
    if served is not None:
        makers["response"] = (files.RESPONSE, partial(sf.save, served.response))
    what = " ".join(str(request[name]) for name in ("what", "form") if request.get(name))
    if what not in makers:
        raise InputError(f"there is no download {what[:40]!r}; there are {', '.join(makers)}")
    name, write = makers[what]
    bench.say(f"writing {what}")
    file = sources.room(bench.made) / name
    write(file)
    return {"download": file.parent.name, "name": name, "bytes": file.stat().st_size}


def warm(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """Load or compile the kernels: for moving sliders alone, for playing, or for everything else."""
    usual = complete({})
    if request.get("play"):
        motion = playing.motion_of({"settings": usual}, bench)[1]
        for _ in range(2):
            motion.take(8, 1.0)
        return {}
    results.result(*bench.done({**usual, "strategy": LOOK_AHEAD}))
    bench.done({**usual, "limits": PAPER_LIMITS.as_dict()})
    if request.get("all"):
        results.result(*bench.done({**usual, "machine": {"name": "xytheta"}}))
    return {}


#: Every task by its name.
TASKS: dict[str, Callable[[Mapping[str, Any], Bench], dict[str, Any]]] = {
    "plan": plan,
    "settle": settle,
    "read": read,
    "make": make,
    "tune": tuning.tuned,
    "play": playing.played,
    "warm": warm,
}


def open_bench(mail: Mail, uploads: str, made: str) -> Handler:
    """What answers requests with the two folders; errors are answers too, and the next request finds it sound."""
    bench = Bench(File(uploads), File(made), mail)

    def answer(request: dict[str, Any]) -> Answer:
        try:
            found = TASKS[request["task"]](request, bench)
            entry = found.pop("entry", None)
            return {"entry": entry}, json.dumps(found, separators=(",", ":"), allow_nan=False).encode()
        except Exception as error:  # the page shows it
            return {"error": error_of(error)}, b""

    return answer


def error_of(error: Exception) -> dict[str, Any]:
    """What went wrong, for the page: words by field, and whether it is a fault of the program."""
    if isinstance(error, SettingsError):
        return {"fields": error.problems, "fault": False}
    words = " ".join(str(error).split())
    if isinstance(error, MemoryError):
        words = "not enough memory for this; choose a longer period or a shorter path"
    elif not isinstance(error, SplinefeedError):
        return {"fields": {"": f"internal fault, please report it: {type(error).__name__}: {words}"}, "fault": True}
    return {"fields": {"": words}, "fault": False}
