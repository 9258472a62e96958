"""What a run leaves in its folder: setpoints, figures, and a page of numbers with the command that repeats it."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path as File
from typing import TYPE_CHECKING, Any

import numpy as np

from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.setpoints import FORMATS, load_chunks, save
from splinefeed.pipeline.compare import MethodTrace
from splinefeed.pipeline.deviation import Deviation, deviation
from splinefeed.pipeline.experiment import Served
from splinefeed.pipeline.run import Run
from splinefeed.records import Response, Setpoints
from splinefeed.report.saving import FORMATS as FIGURE_FORMATS
from splinefeed.report.saving import save_figures

if TYPE_CHECKING:
    from splinefeed.report.figure import Figure
    from splinefeed.simulation.curves import TunedAxis
    from splinefeed.sweeps.spec import Task

#: The page of numbers; a folder that has one written by us is ours.
RECORD = "run.json"
#: The pages of numbers of all commands that write a folder: files that one of them lists are ours.
FOLLOW_RECORD = "follow.json"
TUNE_RECORD = "tune.json"
TUNE_FEED_RECORD = "tune-feed.json"
RECORDS = (RECORD, FOLLOW_RECORD, TUNE_RECORD, TUNE_FEED_RECORD)
#: Limits that a search found.
LIMITS = "limits.toml"
#: The time law.
LAW = "law.h5"
#: The path of a run that was made in Python, which no file names.
PATH = "run-path.json"
#: The page to look at.
REPORT = "report.html"
#: What the axes of a machine did.
RESPONSE = "response.h5"
#: Where the tool is at each setpoint of joints: its tip on the workpiece, mm, and its axis, a unit vector.
TIP, TIP_COLUMNS = "tip.csv", "t_s,s_mm,x_mm,y_mm,z_mm,i,j,k"
#: Names of setpoint files by format.
SETPOINTS = {name: f"setpoints{each.suffixes[0]}" for name, each in FORMATS.items()}
FIGURES = ("path", "motion", "limits", "binding", "ripple")
#: Limits along the path; figures of what binds are drawn where there are others.
_ALONG = {"feed", "acceleration", "deceleration", "jerk"}
SERVO_FIGURES = ("errors", "contour")
#: Everything that a run may leave, and that following setpoints may.
FOLLOW_NAMES = (
    FOLLOW_RECORD,
    RESPONSE,
    *(f"{name}.{suffix}" for name in SERVO_FIGURES for suffix in FIGURE_FORMATS),
)
TUNE_FEED_NAMES = (
    TUNE_FEED_RECORD,
    LIMITS,
    SETPOINTS["hdf5"],
    RESPONSE,
    *(f"feed-curve.{suffix}" for suffix in FIGURE_FORMATS),
)
NAMES = (
    RECORD,
    LAW,
    PATH,
    REPORT,
    TIP,
    *SETPOINTS.values(),
    *(f"{name}.{suffix}" for name in FIGURES for suffix in FIGURE_FORMATS),
    *FOLLOW_NAMES[1:],
)


def of_run(run: Run, responses: Mapping[str, Response] | None = None, machine: str = "") -> dict[str, Figure]:
    """The figures of a run for its page, by name; responses: what a machine did, by method, the run's own first."""
    from splinefeed.report.motion_figures import motion_figure
    from splinefeed.report.path_figures import limits_figure, path_figure
    from splinefeed.report.servo_figures import errors_figure, has_spectra, spectra_figure

    followed = {name: each for name, each in (responses or {}).items() if len(each)}
    own = next(iter(followed.values()), None)
    found = {"path": path_figure(run, own), "motion": motion_figure(run)}
    if run.use.names:
        found["limits"] = limits_figure(run.use, run.kept, run.path.name)
    if own is not None:
        found["errors"] = errors_figure(followed, run.path.name, machine)
        if has_spectra(run, own):
            found["spectra"] = spectra_figure(own)
    return found


def figures(
    run: Run, traces: Sequence[MethodTrace], drawn: Mapping[str, Figure], beside: Deviation | None = None,
    machine: str = "",
) -> Iterator[tuple[str, Figure]]:  # fmt: skip
    """Name and figure of those that become files; of limits and of methods only where there is something to show."""
    from splinefeed.report.motion_figures import ripple_figure
    from splinefeed.report.path_figures import binding_figure, contour_figure

    bound = not _ALONG.issuperset(run.use.names)
    for name in ("path", "motion", *(("limits",) if bound else ()), "errors"):
        if name in drawn:
            yield name, drawn[name]
    if bound:
        yield "binding", binding_figure(run)
    if traces:
        yield "ripple", ripple_figure(traces, run.path.name)
    if beside is not None:
        yield "contour", contour_figure(beside, run.path.name, machine)


def write(
    run: Run,
    folder: str | os.PathLike[str],
    *,
    formats: Iterable[str] = ("hdf5",),
    traces: Sequence[MethodTrace] = (),
    figure_formats: Iterable[str] = FIGURE_FORMATS[:1],
    record: Mapping[str, Any] | None = None,
    others: Sequence[Served] = (),
    tip: bool = False,
    with_path: bool = False,
) -> list[str]:
    """Write everything that `run` leaves to `folder`, and give the names; `record` goes to the page of numbers.

    figure_formats  of the figures; without any there is no report either
    tip  whether tip and tool axis are written beside the joints of a tool path; with_path  whether the path is, as JSON
    others  what a machine did with the setpoints of other methods; what it did with those of a long run is not kept
    """
    place = File(folder)
    names = write_setpoints(run.setpoints(), place, formats)
    if tip and run.joints is not None:
        names.append(TIP)
        found = run.joints.kinematics.forward(run.points.position)
        with atomic_write(place / TIP) as temporary:
            rows = np.column_stack([run.points.t, run.points.s, *found])
            np.savetxt(temporary, rows, "%.17g", delimiter=",", header=TIP_COLUMNS, comments="")
    if with_path:
        from splinefeed.formats.registry import write as write_path

        names.append(PATH)
        write_path(run.path, place / PATH)
    names.append(LAW)
    save(run.law, place / LAW)
    own = run.served if run.whole else None
    if own is not None:
        names.append(RESPONSE)
        save(own.response, place / RESPONSE)
    wanted = tuple(figure_formats)
    if wanted:
        from splinefeed.report import html, library

        machine = str((record or {}).get("machine", ""))
        served = [*others, *([] if run.served is None else [run.served])]
        own_first = {each.setpoints.method: each.response for each in reversed(served)}
        drawn = of_run(run, own_first, machine)
        beside = None if own is None else deviation(own.response, run.path, run.kept.s)
        names += save_figures(figures(run, traces, drawn, beside, machine), place, wanted)
        if library.available():
            names.append(REPORT)
            write_report(html.page(run, record or {}, drawn, [trace.result for trace in traces]), place / REPORT)
    names.append(RECORD)
    write_record({**(record or {}), "files": names}, place / RECORD)
    return names


def write_setpoints(setpoints: Setpoints | Iterator[Setpoints], place: File, formats: Iterable[str]) -> list[str]:
    """Write setpoints in every format, and give the names; chunks are made once, for the first."""
    wanted = list(dict.fromkeys(formats))
    if isinstance(setpoints, Setpoints) or len(wanted) == 1:
        for form in wanted:
            save(setpoints, place / SETPOINTS[form])
        return [SETPOINTS[form] for form in wanted]
    first = next(setpoints)
    whole = place / SETPOINTS["hdf5"]
    save(chain([first], setpoints), whole)
    for form in wanted:
        if form != "hdf5":
            save(load_chunks(whole, len(first)), place / SETPOINTS[form])
    if "hdf5" not in wanted:
        whole.unlink()
    return [SETPOINTS[form] for form in wanted]


def missing(figure_formats: Iterable[str]) -> list[str]:
    """A sentence for each page and picture that is wanted and cannot be drawn here: which extra brings it."""
    from splinefeed.report import library, saving

    wanted = tuple(figure_formats)
    page = [] if library.available() or not wanted else [f"no {REPORT}: it needs Plotly, {saving.EXTRA}"]
    return page + saving.missing(wanted)


def write_artefacts(folder: str, with_setpoints: bool, with_report: bool, task: Task, run: Run) -> None:
    """Write setpoints and report of one run of a sweep into a folder of its own, named by its number."""
    place = File(folder) / f"{task.index:07d}"
    place.mkdir(parents=True, exist_ok=True)
    if with_setpoints:
        save(run.setpoints(), place / SETPOINTS["hdf5"])
    if with_report:
        from splinefeed.report import html

        numbers = {**run.numbers(), "name": f"{run.path.name}, run {task.index}", "settings": task.settings}
        write_report(html.page(run, numbers, of_run(run)), place / REPORT)


def write_report(page: str, file: File) -> None:
    """Write the text of a report, whole or not at all."""
    with atomic_write(file) as temporary:
        temporary.write_text(page, encoding="utf-8")


def servo_figures(
    responses: Mapping[str, Response], name: str, machine: str, beside: Deviation | None = None
) -> Iterator[tuple[str, Figure]]:
    """Name and figure of what the axes of a machine did; `responses` by what led to them."""
    from splinefeed.report.path_figures import contour_figure
    from splinefeed.report.servo_figures import errors_figure

    yield "errors", errors_figure(responses, name, machine)
    if beside is not None:
        yield "contour", contour_figure(beside, name, machine)


def tune_names(axes: Iterable[str]) -> tuple[str, ...]:
    """Names of all files that tuning these axes may leave."""
    names = ("step", *(_bode_name(axis) for axis in axes))
    return (TUNE_RECORD, *(f"{name}.{suffix}" for name in names for suffix in FIGURE_FORMATS))


def tune_figures(axes: Sequence[TunedAxis], machine: str) -> Iterator[tuple[str, Figure]]:
    """Name and figure of tuned axes: a Bode plot of each, and the steps of all."""
    from splinefeed.report.servo_figures import bode_figure, step_figure

    for tuned in axes:
        yield _bode_name(tuned.axis.name), bode_figure(tuned, machine)
    yield "step", step_figure(axes, machine)


def _bode_name(axis: str) -> str:
    """The name of an axis's figure; of an axis with a strange name only what is harmless in a file's name."""
    return f"bode-{re.sub(r'[^A-Za-z0-9_-]', '-', axis)[:32]}"


def write_record(page: Mapping[str, Any], file: File) -> None:
    """Write a page of numbers as JSON."""
    with atomic_write(file) as temporary:
        temporary.write_text(json.dumps(page, indent=2, allow_nan=False) + "\n", encoding="utf-8")
