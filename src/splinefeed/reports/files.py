"""What a run leaves in its folder: setpoints, figures, and a page of numbers with the command that repeats it."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path as File
from typing import TYPE_CHECKING, Any

import numpy as np

from splinefeed.files.atomic import atomic_write, write_page, write_text
from splinefeed.formats.setpoint_table import FORMATS
from splinefeed.formats.setpoints import Writer, save
from splinefeed.records import Response
from splinefeed.reports.figure import EXTRA, Figure, possible
from splinefeed.reports.figure import FORMATS as FIGURE_FORMATS
from splinefeed.runs.comparison import MethodTrace
from splinefeed.runs.fold import Meter
from splinefeed.runs.following import Deviation, Servo
from splinefeed.runs.meters import FileMeter
from splinefeed.runs.result import Run

if TYPE_CHECKING:
    from splinefeed.simulation.tuning import TunedAxis
    from splinefeed.sweeps.spec import Task

#: The page of numbers of a run, and those of the other commands that write a folder: files that one of them lists are
#: ours, and a folder that has one written by us is.
RECORD, FOLLOW_RECORD, TUNE_RECORD, TUNE_FEED_RECORD = "run.json", "follow.json", "tune.json", "tune-feed.json"
RECORDS = (RECORD, FOLLOW_RECORD, TUNE_RECORD, TUNE_FEED_RECORD)
#: Limits that a search found, the time law, the path of a run that was made in Python, the page to look at, and what
#: the axes of a machine did.
LIMITS, LAW, PATH, REPORT, RESPONSE = "limits.toml", "law.h5", "run-path.json", "report.html", "response.h5"
#: Where the tool is at each setpoint of joints: its tip on the workpiece, mm, and its axis, a unit vector.
TIP, TIP_COLUMNS = "tip.csv", "t_s,s_mm,x_mm,y_mm,z_mm,i,j,k"
#: Names of setpoint files by format.
SETPOINTS = {name: f"setpoints{each.suffixes[0]}" for name, each in FORMATS.items()}
FIGURES = ("path", "motion", "limits", "binding", "ripple")
#: Limits along the path; figures of what binds are drawn where there are others.
_ALONG = {"feed", "acceleration", "deceleration", "jerk"}


def _drawn(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}.{suffix}" for name in names for suffix in FIGURE_FORMATS)


#: Everything that a run may leave, and what the other commands may.
FOLLOW_NAMES = (FOLLOW_RECORD, RESPONSE, *_drawn("errors", "contour"))
TUNE_FEED_NAMES = (TUNE_FEED_RECORD, LIMITS, SETPOINTS["hdf5"], RESPONSE, *_drawn("feed-curve"))
NAMES = (RECORD, LAW, PATH, REPORT, TIP, *SETPOINTS.values(), *_drawn(*FIGURES), *FOLLOW_NAMES[1:])


def of_run(
    run: Run,
    responses: Mapping[str, Response] | None = None,
    machine: str = "",
    traces: Sequence[MethodTrace] = (),
    beside: Deviation | None = None,
) -> dict[str, Figure]:
    """Draw the figures of a run, for its page and its files.

    Parameters
    ----------
    run : Run
        To be drawn.
    responses : mapping of str to Response, optional
        What a machine did, by method, the run's own first.
    machine : str, optional
        Its name.
    traces : sequence of MethodTrace, optional
        Of methods that the run's is compared with.
    beside : Deviation, optional
        How far the machine was from the path.

    Returns
    -------
    dict of str to Figure
        By name: those that there is something to show of.
    """
    from splinefeed.reports import plot
    from splinefeed.reports.motion_figures import ripple_figure
    from splinefeed.reports.path_figures import contour_figure, path_figure
    from splinefeed.reports.servo_figures import errors_figure, has_spectra, spectra_figure

    followed = {name: each for name, each in (responses or {}).items() if len(each)}
    own = next(iter(followed.values()), None)
    found = {"path": path_figure(run, own), "motion": plot.motion(run)}
    if run.use.names:
        found["limits"] = plot.limits(run)
    if own is not None:
        found["errors"] = errors_figure(followed, run.path.name, machine, run.bands)
        if has_spectra(run, own):
            found["spectra"] = spectra_figure({"": own})
    if not _ALONG.issuperset(run.use.names):
        found["binding"] = plot.binding(run)
    if traces:
        found["ripple"] = ripple_figure(traces, run.path.name)
    if beside is not None:
        found["contour"] = contour_figure(beside, run.path.name, machine)
    return found


def to_files(found: Mapping[str, Figure]) -> list[tuple[str, Figure]]:
    """Those that become files; those of limits only where there is something to show."""
    left_out = {"spectra"} if "binding" in found else {"spectra", "limits"}
    return [(name, figure) for name, figure in found.items() if name not in left_out]


@contextmanager
def writers(
    folder: str | os.PathLike[str], formats: Iterable[str], said: Callable[[Mapping[str, Any]], Any]
) -> Iterator[tuple[list[Meter], Writer]]:
    """Open the files of setpoints and of a response, which are written as they are made.

    Parameters
    ----------
    folder : str or PathLike
        Where they go.
    formats : iterable of str
        A file of setpoints each.
    said : callable
        Of the settings of setpoints, what a file says beside them of how they are made.

    Yields
    ------
    meters : list of Meter
        That write setpoints.
    response : Writer
        Of the response of a machine.

    Notes
    -----
    At the end of the context what is not finished is removed.
    """
    place = File(folder)
    with ExitStack() as stack:
        opened = [stack.enter_context(Writer(place / name)) for name in setpoint_names(formats)]
        yield [FileMeter(each, said) for each in opened], stack.enter_context(Writer(place / RESPONSE))


def setpoint_names(formats: Iterable[str]) -> list[str]:
    """Names of the files of setpoints, one a format."""
    return [SETPOINTS[form] for form in dict.fromkeys(formats)]


def write(
    run: Run,
    folder: str | os.PathLike[str],
    *,
    formats: Iterable[str] = ("hdf5",),
    traces: Sequence[MethodTrace] = (),
    figure_formats: Iterable[str] = FIGURE_FORMATS[:1],
    record: Mapping[str, Any] | None = None,
    others: Sequence[Servo] = (),
    tip: bool = False,
    with_path: bool = False,
) -> list[str]:
    """Write everything that a run leaves to a folder.

    Parameters
    ----------
    run : Run
        To be written.
    folder : str or PathLike
        That is there.
    formats : iterable of str, optional
        Of the setpoints; their files, and the response of a machine, are written where they are not there.
    traces : sequence of MethodTrace, optional
        Of methods that the run's is compared with.
    figure_formats : iterable of str, optional
        Of the figures; without any there is no report either.
    record : mapping of str to object, optional
        Goes to the page of numbers.
    others : sequence of Servo, optional
        What a machine did with the setpoints of other methods.
    tip : bool, optional
        Whether tip and tool axis are written beside the joints of a tool path.
    with_path : bool, optional
        Whether the path is written, as JSON.

    Returns
    -------
    list of str
        Names of the files.
    """
    place, said = File(folder), record or {}
    names = setpoint_names(formats)
    for name in names:
        if not (place / name).is_file():
            save(run.setpoints(), place / name)
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
    if run.planned is not None:
        names.append(LAW)
        save(run.law, place / LAW)
    own = run.served if run.whole else None
    if own is not None and not (place / RESPONSE).is_file():
        save(own.response, place / RESPONSE)
    names += [RESPONSE] if (place / RESPONSE).is_file() else []
    wanted = tuple(figure_formats)
    if wanted:
        from splinefeed.reports import html, library

        served = [*others, *([] if run.served is None else [run.served])]
        own_first = {each.method: each.response for each in reversed(served)}
        beside = None if own is None else own.deviation()
        drawn = of_run(run, own_first, str(said.get("machine", "")), traces, beside)
        names += save_figures(to_files(drawn), place, wanted)
        if library.available():
            names.append(REPORT)
            write_text(place / REPORT, html.page(run, said, drawn, [trace.result for trace in traces]))
    names.append(RECORD)
    write_page(place / RECORD, {**said, "files": names, "sha256": digests(place)})
    return names


def digests(place: File) -> dict[str, str]:
    """Compute the SHA-256 of the files that a report is made of: they are of one run, or the page tells.

    Parameters
    ----------
    place : Path
        The folder.

    Returns
    -------
    dict of str to str
        By name, of those that are there.
    """
    found = {}
    for name in (*SETPOINTS.values(), LAW):
        if (place / name).is_file():
            with (place / name).open("rb") as stream:
                found[name] = hashlib.file_digest(stream, "sha256").hexdigest()
    return found


def save_figures(drawn: Iterable[tuple[str, Figure]], folder: File, formats: Iterable[str]) -> list[str]:
    """Write figures in every format that is possible here.

    Parameters
    ----------
    drawn : iterable of tuple
        Name and figure.
    folder : Path
        Where they go.
    formats : iterable of str
        svg, png and pdf.

    Returns
    -------
    list of str
        Names of the files.
    """
    wanted = [form for form in dict.fromkeys(formats) if possible(form)]
    names = []
    for name, figure in drawn:
        for form in wanted:
            names.append(f"{name}.{form}")
            figure.save(folder / names[-1])
    return names


def missing(formats: Iterable[str], page: bool = True) -> list[str]:
    """Say what is wanted and cannot be drawn here, and which extra brings it.

    Parameters
    ----------
    formats : iterable of str
        Of pictures.
    page : bool, optional
        Whether there is to be a page, too.

    Returns
    -------
    list of str
        One sentence each.
    """
    from splinefeed.reports import library

    wanted = tuple(dict.fromkeys(formats))
    lacking = [f"no {REPORT}: it needs Plotly, {EXTRA}"] if page and wanted and not library.available() else []
    return lacking + [f"no figures as {form}: they need Matplotlib, {EXTRA}" for form in wanted if not possible(form)]


def write_artefacts(folder: str, with_setpoints: bool, with_report: bool, task: Task, run: Run) -> None:
    """Write setpoints and report of one run of a sweep into a folder of its own, named by its number.

    Parameters
    ----------
    folder : str
        Of all of them.
    with_setpoints, with_report : bool
        What is written.
    task : Task
        Of the sweep.
    run : Run
        Its result.
    """
    place = File(folder) / f"{task.index:07d}"
    place.mkdir(parents=True, exist_ok=True)
    if with_setpoints:
        save(run.setpoints(), place / SETPOINTS["hdf5"])
    if with_report:
        from splinefeed.reports import html

        numbers = {**run.numbers(), "name": f"{run.path.name}, run {task.index}", "settings": task.settings}
        write_text(place / REPORT, html.page(run, numbers, of_run(run)))


def tune_names(axes: Iterable[str]) -> tuple[str, ...]:
    """Name all files that tuning axes may leave.

    Parameters
    ----------
    axes : iterable of str
        That are tuned.

    Returns
    -------
    tuple of str
        The page of numbers, and figures.
    """
    return (TUNE_RECORD, *_drawn("step", *(_bode_name(axis) for axis in axes)))


def tune_figures(axes: Sequence[TunedAxis], machine: str) -> Iterator[tuple[str, Figure]]:
    """Draw tuned axes.

    Parameters
    ----------
    axes : sequence of TunedAxis
        Before and after.
    machine : str
        Its name, for titles.

    Yields
    ------
    name : str
        Of the figure.
    figure : Figure
        A Bode plot of each axis, then the steps of all.
    """
    from splinefeed.reports.servo_figures import bode_figure, step_figure

    for tuned in axes:
        yield _bode_name(tuned.axis.name), bode_figure(tuned, machine)
    yield "step", step_figure(axes, machine)


def _bode_name(axis: str) -> str:
    """The name of an axis's figure; of an axis with a strange name only what is harmless in a file's name."""
    return f"bode-{re.sub(r'[^A-Za-z0-9_-]', '-', axis)[:32]}"
