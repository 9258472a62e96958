"""What a run leaves in its folder: setpoints, figures, and a page of numbers with the command that repeats it."""

from __future__ import annotations

import json
import logging
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path as File
from typing import TYPE_CHECKING, Any

from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.setpoints import FORMATS, save
from splinefeed.pipeline.compare import MethodTrace
from splinefeed.pipeline.contour_feed import FeedTuning
from splinefeed.pipeline.deviation import Deviation, deviation
from splinefeed.pipeline.experiment import Served
from splinefeed.pipeline.long_run import LongRun
from splinefeed.pipeline.run import Run
from splinefeed.records import Response, unit_along

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
#: The page to look at.
REPORT = "report.html"
#: What the axes of a machine did.
RESPONSE = "response.h5"
#: Names of setpoint files by format.
SETPOINTS = {name: f"setpoints{each.suffixes[0]}" for name, each in FORMATS.items()}
FIGURES = ("path", "feed", "axes", "limits", "binding", "ripple")
#: Limits along the path; figures of what binds are drawn where there are others besides.
_ALONG = {"feed", "acceleration", "deceleration", "jerk"}
FIGURE_FORMATS = ("svg", "png")
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
    REPORT,
    *SETPOINTS.values(),
    *(f"{name}.{suffix}" for name in FIGURES for suffix in FIGURE_FORMATS),
    *FOLLOW_NAMES[1:],
)


def figures(run: Run, traces: Sequence[MethodTrace]) -> Iterator[tuple[str, Figure]]:
    """Name and figure, one at a time; those of what binds and of methods only where there is something to show."""
    from splinefeed.report.figures import axes_figure, feed_figure, ripple_figure
    from splinefeed.report.limits_figure import binding_figure, limits_figure
    from splinefeed.report.path_figure import path_figure

    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it would talk of fonts and cache folders on stderr
    long = isinstance(run, LongRun)
    yield "path", path_figure(run.path, run.points, run.thread if long else None)
    yield "feed", feed_figure(run.law, run.limits, run.path.name, unit_along(run.path.axes))
    yield "axes", axes_figure(run.motion, run.path, run.limits)
    if not _ALONG.issuperset(run.use.names):
        yield "limits", limits_figure(run.use, run.points, run.path.name)
        yield "binding", binding_figure(run.use, run.path, run.points, run.thread if long else None)
    if traces:
        yield "ripple", ripple_figure(traces, run.path.name)


def save_figure(figure: Figure, file: str | os.PathLike[str]) -> None:
    """Write `figure` as what its suffix says, whole or not at all; the same figure gives the same file."""
    from splinefeed.report import theme

    form = File(file).suffix[1:]
    metadata = {"Date": None} if form == "svg" else {"Software": "splinefeed"}
    with theme.applied(), atomic_write(file) as temporary:
        figure.savefig(temporary, format=form, dpi=theme.DPI, metadata=metadata)


def write(
    run: Run,
    folder: str | os.PathLike[str],
    *,
    formats: Iterable[str] = ("hdf5",),
    traces: Sequence[MethodTrace] = (),
    with_figures: bool = True,
    record: Mapping[str, Any] | None = None,
    served: Sequence[Served] = (),
) -> list[str]:
    """Write everything that `run` leaves to `folder`, and give the names; `record` goes to the page of numbers.

    served  what a machine did with the setpoints, the ones of the run itself last; of a long run not kept as a file
    """
    place = File(folder)
    names = []
    long = isinstance(run, LongRun)
    for form in dict.fromkeys(formats):
        names.append(SETPOINTS[form])
        save(run.setpoints(), place / names[-1])
    names.append(LAW)
    save(run.law, place / LAW)
    if served and not long:
        names.append(RESPONSE)
        save(served[-1].response, place / RESPONSE)
    if with_figures:
        names += save_figures(figures(run, traces), place)
        if served:
            responses = {each.points.method: each.response for each in served}
            machine = str((record or {}).get("machine", ""))
            beside = None if long else deviation(served[-1].response, run.path, run.points.s)
            names += save_figures(servo_figures(responses, run.path.name, machine, beside), place)
        from splinefeed.report import html, library

        if library.available():
            own_first = {each.points.method: each.response for each in reversed(served)}
            names.append(REPORT)
            write_report(html.page(run, record or {}, [trace.result for trace in traces], own_first), place / REPORT)
    names.append(RECORD)
    write_record({**(record or {}), "files": names}, place / RECORD)
    return names


def write_artefacts(folder: str, with_setpoints: bool, with_report: bool, task: Task, run: Run) -> None:
    """Write setpoints and report of one run of a sweep into a folder of its own, named by its number."""
    place = File(folder) / f"{task.index:07d}"
    place.mkdir(parents=True, exist_ok=True)
    if with_setpoints:
        save(run.setpoints(), place / SETPOINTS["hdf5"])
    if with_report:
        from splinefeed.report import html

        numbers = {**run.numbers(), "name": f"{run.path.name}, run {task.index}", "settings": task.settings}
        write_report(html.page(run, numbers), place / REPORT)


def write_report(page: str, file: File) -> None:
    """Write the text of a report, whole or not at all."""
    with atomic_write(file) as temporary:
        temporary.write_text(page, encoding="utf-8")


def save_figures(drawn: Iterable[tuple[str, Figure]], folder: File) -> list[str]:
    """Write each figure in every format, and give the names of the files."""
    names = []
    for name, figure in drawn:
        for suffix in FIGURE_FORMATS:
            names.append(f"{name}.{suffix}")
            save_figure(figure, folder / names[-1])
    return names


def servo_figures(
    responses: Mapping[str, Response], name: str, machine: str, beside: Deviation | None = None
) -> Iterator[tuple[str, Figure]]:
    """Name and figure of what the axes of a machine did, one at a time; `responses` by what led to them."""
    from splinefeed.report.servo_figures import contour_figure, errors_figure

    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    yield "errors", errors_figure(responses, name, machine)
    if beside is not None:
        yield "contour", contour_figure(beside, name, machine)


def tune_names(axes: Iterable[str]) -> tuple[str, ...]:
    """Names of all files that tuning these axes may leave."""
    names = ("step", *(_bode_name(axis) for axis in axes))
    return (TUNE_RECORD, *(f"{name}.{suffix}" for name in names for suffix in FIGURE_FORMATS))


def tune_figures(axes: Sequence[TunedAxis], machine: str) -> Iterator[tuple[str, Figure]]:
    """Name and figure of tuned axes, one at a time: a Bode plot of each, and the steps of all."""
    from splinefeed.report.bode import bode_figure, step_figure

    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    for tuned in axes:
        yield _bode_name(tuned.axis.name), bode_figure(tuned, machine)
    yield "step", step_figure(axes, machine)


def _bode_name(axis: str) -> str:
    """The name of an axis's figure; of an axis with a strange name only what is harmless in a file's name."""
    return f"bode-{re.sub(r'[^A-Za-z0-9_-]', '-', axis)[:32]}"


def feed_curve(tuning: FeedTuning, name: str, machine: str) -> Iterator[tuple[str, Figure]]:
    """Name and figure of a search for the highest feed."""
    from splinefeed.report.feed_curve import feed_curve_figure

    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    yield "feed-curve", feed_curve_figure(tuning, name, machine)


def write_record(page: Mapping[str, Any], file: File) -> None:
    """Write a page of numbers as JSON."""
    with atomic_write(file) as temporary:
        temporary.write_text(json.dumps(page, indent=2, allow_nan=False) + "\n", encoding="utf-8")
