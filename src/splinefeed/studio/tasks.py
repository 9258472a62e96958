"""What a worker process does for a page: read, plan, follow, tune, and make files; all through `runs`.

Uploads are read here, never in the server: what crashes a reader, eats memory or does not end takes a worker with it
and nothing else.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path as File
from typing import Any

import numpy as np

import splinefeed as sf
from splinefeed.errors import InputError, SplinefeedError
from splinefeed.files.atomic import write_page, write_text
from splinefeed.files.plain import plain
from splinefeed.live import stream
from splinefeed.live.motion import Motion, planned
from splinefeed.live.operator import MOST, Operator
from splinefeed.live.sinks import ClockSink
from splinefeed.paths.track import Track
from splinefeed.planner.strategies import LOOK_AHEAD, TIME_OPTIMAL
from splinefeed.programs.cycle_time import cycle_time
from splinefeed.records import unit_along
from splinefeed.reports import interactive
from splinefeed.reports.servo_figures import bode_figure, errors_figure, has_spectra, spectra_figure, step_figure
from splinefeed.reports.time_figures import program_figure, time_figure
from splinefeed.runs.following import serve
from splinefeed.runs.run import on_machine
from splinefeed.runs.settings import PAPER_LIMITS
from splinefeed.runs.tuning import EVALUATIONS, PATH_RULE, TunedMachine, by_rule, tune_on_path
from splinefeed.studio import results, sources
from splinefeed.studio.settings import PATHS, Bench, SettingsError, complete, field_of, from_toml, machine_of, resolve
from splinefeed.workers import Answer, Handler, Mail

#: Paths of more curves than this are not planned while a slider moves.
MOST_WHILE_MOVING = 20_000
#: A program of more bytes is timed as a job, which says how far it is and can be cancelled.
MOST_AT_ONCE = 2_000_000
#: Look-ahead that is kept before the clock, and at least so many rows; time between two pictures, s.
AHEAD, LEAST_ROWS, FRAME = 0.15, 24, 1.0 / 30.0


def plan(request: Mapping[str, Any], bench: Bench, *, at_once: bool = True) -> dict[str, Any]:
    """A run of the settings, followed by its machine, or a program as its control plans it.

    `at_once`, while a slider moves, without the machine and by `look-ahead` where the strategy takes its time: `final`
    says whether there is nothing to add. A request that looks at one figure, `look`, gets no other, and the history
    does not hear of it.
    """
    settings = complete(request.get("settings"))
    if settings["by_control"]:
        return timed(settings, bench, at_once=at_once)
    wanted = resolve(settings, bench.uploads)
    slow, look = wanted.strategy == TIME_OPTIMAL, request.get("look")
    if at_once and len(wanted.path.tip_path.curves) > MOST_WHILE_MOVING:
        return {"final": False, "shown": None}
    final = not at_once or not (slow or wanted.followed)
    quick = {**settings, "strategy": LOOK_AHEAD} if at_once and slow else settings
    wanted, made = bench.done(quick, follow=not at_once)
    found = results.result(wanted, made, look if isinstance(look, Mapping) else None)
    out = {"final": final, "shown": wanted.strategy, "result": found}
    return {**out, "entry": results.entry(wanted, found["numbers"], made)} if final and not look else out


settle = partial(plan, at_once=False)


def read(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """What an upload holds."""
    source = request["source"]
    bench.say(f"reading {sources.upload(source.get('file'), bench.uploads).name}")
    try:
        if (arm := sources.arm_of(source, bench.uploads)) is not None:
            _, path, _, file, _ = arm
            said: dict[str, Any] = {
                "name": path.name,
                "curves": len(path.tip_path.curves),
                "length_mm": path.length,
                "findings": [],
            }
            return {"name": file.name, "format": "arm", "units": unit_along(path.axes), "paths": [said]}
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
    from splinefeed.reports import files, html
    from splinefeed.reports.record import documented

    wanted, made = bench.done(request["settings"])
    machine, served = wanted.machine, made.served

    def setpoints(form: str, file: File) -> None:
        sf.save(documented(made, results.numbers(wanted, made, (form,))).setpoints(), file)

    def report(file: File) -> None:
        responses = {} if served is None else {made.kept.method: served.response}
        drawn = files.of_run(made, responses, results.machine_name(wanted) or "")
        write_text(file, html.page(made, results.numbers(wanted, made), drawn))

    makers: dict[str, tuple[str, Callable[[File], object]]] = {
        "law": (files.LAW, partial(sf.save, made.law)),
        "numbers": (files.RECORD, partial(write_page, page=results.numbers(wanted, made))),
        "report": (files.REPORT, report),
        **{f"path {form}": (f"path.{form}", partial(registry.write, made.path)) for form in PATHS},
        **{f"setpoints {form}": (name, partial(setpoints, form)) for form, name in files.SETPOINTS.items()},
    }
    if machine is not None:
        makers["machine"] = ("machine.toml", machine.save)
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
    """Load or compile the kernels, by the plan that a page asks for first, by playing, or by everything else, too."""
    usual = complete({})
    if request.get("play"):
        motion = motion_of({"settings": usual}, bench)[1]
        for _ in range(2):
            motion.take(8, 1.0)
        return {}
    plan({"settings": usual}, bench)
    if request.get("all"):
        bench.done({**usual, "limits": PAPER_LIMITS.as_dict()})
        results.result(*bench.done({**usual, "machine": {"name": "xytheta"}}))
    return {}


def timed(settings: Mapping[str, Any], bench: Bench, *, at_once: bool) -> dict[str, Any]:
    """Time a program on a machine, and draw it.

    Parameters
    ----------
    settings : mapping of str to object
        With source and machine.
    bench : Bench
        Of the worker.
    at_once : bool
        Whether a long one is left to a job.

    Returns
    -------
    dict of str to object
        All that a page shows, `final` where it is that.

    Raises
    ------
    SettingsError
        With what is wrong beside its field.
    """
    try:
        machine = machine_of(settings["machine"])
    except InputError as error:
        raise SettingsError({"machine": sources.words(error, bench.uploads)}) from error
    if machine is None:
        raise SettingsError({"machine": "choose the machine whose control is to run the program"})
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
    of, (line, seconds, _, _) = time.by_line, time.rows
    columns = {name: getattr(of, name) for name in ("line", "seconds", "beyond", "begin", "limit", "operation")}
    columns |= dict(zip("xyz", of.place.T, strict=True))
    order = {"begin": np.cumsum(seconds) - seconds, "line": line.astype(np.float64)}  # waits and lines said again, too
    result = {
        "program": file.read_bytes().decode("utf-8", errors="replace"),
        "lines": {name: interactive.array(values) for name, values in columns.items()},
        "order": {name: interactive.array(values) for name, values in order.items()},
        "limits": time.limits,
        "path": interactive.to_plain(program_figure(time)),
        "figures": {"tools": interactive.to_plain(time_figure(time))},
        "numbers": plain(page),
    }
    return {"final": True, "shown": f"as the control of {machine.name} runs it", "result": result}


def tune(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """Tune the machine of the settings.

    Parameters
    ----------
    request : mapping of str to object
        `settings`, and `how` with `rule`, `kind` of a rule, `runs` and `feed_forward` of rule path.
    bench : Bench
        Of the worker.

    Returns
    -------
    dict of str to object
        The new machine as the text of its file, its page of numbers, and figures of steps and errors.

    Raises
    ------
    SettingsError
        With what is wrong beside its field.
    """
    wanted, run = bench.done(request["settings"])
    machine, before, how = wanted.machine, run.served, dict(request.get("how") or {})
    if machine is not None and not machine.simulates(wanted.path.axes):
        raise SettingsError({"machine": f"{machine.name}: has limits alone; tuning needs servo loops: choose another"})
    if machine is None or before is None:
        raise SettingsError({"machine": "choose the machine to tune"})

    def progress(done: int, total: int) -> None:
        bench.mail.tell({"kind": "progress", "words": f"{done} of {total} runs", "share": [done, total]})

    moving, rule = [axis for axis in wanted.path.axes if axis in machine.axes], str(how.get("rule"))
    if rule == PATH_RULE:
        runs, forward = how.get("runs", EVALUATIONS), bool(how.get("feed_forward"))
        found: TunedMachine = tune_on_path(
            machine, run.points, wanted.path, axes=moving, evaluations=runs, feed_forward=forward, on_progress=progress
        )
    else:
        kind = str(how.get("kind") or "") or None
        found = by_rule(machine, moving, rule, period=wanted.period, kind=kind, say=bench.say)
    bench.say(f"following on the tuned {machine.name}")
    after = serve(wanted.path, run.law, run.points, found.machine)
    bench.say("drawing")
    old, new = before.tally.numbers(), after.tally.numbers()
    steps = step_figure(list(found.axes.values()), machine.name)
    loops = [
        replace(panel, y=replace(panel.y, label=f"{axis}: {panel.y.label}"))
        for axis, each in found.axes.items()
        for panel in bode_figure(each, machine.name).panels
    ]
    figures = {"tuning": steps, "loops": replace(steps, panels=tuple(loops))}
    if len(before.response) and len(after.response):
        both = {"old gains": before.response, "new gains": after.response}
        figures["errors"] = errors_figure(both)
        if all(has_spectra(run, each) for each in both.values()):
            figures["spectra"] = spectra_figure(both)
    page = {
        **found.numbers(),
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
        "machine": {"name": name, "toml": found.machine.to_text()},
        "rule": rule,
    }


def play(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """Plan with a reserve for the override, play to the end or to a stop, and say how it went.

    Orders are those of `Operator.obey`.
    """
    operator = Operator()
    operator.obey({"override": request["override"]})
    law, motion, moved = motion_of(request, bench, operator.rate)
    ahead = max(round(AHEAD / motion.period), LEAST_ROWS)
    sink = ClockSink(fill=ahead // 2)
    ended = threading.Event()

    def show() -> None:
        """Tell the page some thirty times a second where the axes are, or the tip of a tool path."""
        last = 0
        while not ended.wait(FRAME):
            row, position = sink.now()
            if row == last:
                continue
            last, tau = row, motion.tau_of(row)
            if moved.kinematics is not None:
                position = moved.kinematics.forward(position)[0]
            frame = {"kind": "frame", "row": row, "tau_s": tau, "planned_s": law.duration, "s_mm": float(law(tau))}
            rates = {"rate": motion.override.rate, "wanted": operator.wanted, "top": motion.override.top}
            bench.mail.tell({**frame, **rates, "position": position.tolist()})

    bench.mail.obey = operator.obey
    frames = threading.Thread(target=show, daemon=True)
    frames.start()
    try:
        state = stream.play(motion, sink, operator, ahead)
    finally:
        ended.set()
        frames.join()
    return {"done": state.done, "rows": state.row, "underruns": state.underruns, "tau_s": state.tau}


def motion_of(request: Mapping[str, Any], bench: Bench, rate: float = 1.0) -> tuple[sf.TimeLaw, Motion, Track]:
    """Law, motion and path of the settings, planned with a reserve for overrides up to `top`."""
    wanted = resolve(request["settings"], bench.uploads)
    bench.say(f"planning {wanted.path.name}, {wanted.strategy}, with a reserve for the override")
    moved = on_machine(wanted.path, wanted.machine if wanted.path.needs_machine else None, wanted.limits)
    top, period, strategy = float(request.get("top", 1.0)), wanted.period, wanted.strategy
    how = planned(moved, wanted.limits, period=period, strategy=strategy, top=top, most=MOST, rate=rate)
    return *how, moved


def opened(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """Settings from the text of a file: parsed here, as a text can be made to take its time."""
    return {"settings": from_toml(str(request["text"]))}


#: Every task by its name.
TASKS: dict[str, Callable[[Mapping[str, Any], Bench], dict[str, Any]]] = {
    "settle": settle, **{task.__name__: task for task in (plan, read, make, tune, play, warm, opened)}
}  # fmt: skip


def open_bench(mail: Mail, uploads: str, made: str) -> Handler:
    """What answers requests with the two folders; errors are answers too, and the next request finds it sound."""
    bench = Bench(File(uploads), File(made), mail)

    def answer(request: dict[str, Any]) -> Answer:
        bench.said = ""
        try:
            found = TASKS[request["task"]](request, bench)
            entry = found.pop("entry", None)
            return {"entry": entry}, json.dumps(found, separators=(",", ":"), allow_nan=False).encode()
        except Exception as error:  # the page shows it
            return {"error": _error(error, bench.uploads)}, b""

    return answer


def _error(error: Exception, uploads: File) -> dict[str, Any]:
    """What went wrong, for the page: words by field, and whether it is a fault of the program."""
    if isinstance(error, SettingsError):
        return {"fields": error.problems, "fault": False}
    if isinstance(error, SplinefeedError):
        return {"fields": {field_of(error): sources.words(error, uploads)}, "fault": False}
    if isinstance(error, MemoryError):
        return {"fields": {"": "not enough memory for this; choose a longer period or a shorter path"}, "fault": False}
    return {"fields": {"": f"internal fault, please report it: {sources.words(error, uploads)}"}, "fault": True}
