"""What a page is sent of a run: its page of numbers, figures as plain data, curves to edit, and a small picture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

import splinefeed as sf
from splinefeed.files.plain import plain
from splinefeed.formats import json_curve
from splinefeed.records import unit_along, view, words_of
from splinefeed.records.verdict import ALLOWED
from splinefeed.reports import interactive, plot, theme
from splinefeed.reports.path_figures import path_figure
from splinefeed.reports.record import about, record
from splinefeed.reports.servo_figures import errors_figure, has_spectra, spectra_figure
from splinefeed.runs.comparison import servo_numbers
from splinefeed.studio.settings import Wanted
from splinefeed.studio.sources import MOST_EDITED

#: Points of the small picture at the most.
PICTURE_POINTS = 300


def numbers(wanted: Wanted, run: sf.Run, formats: tuple[str, ...] = ("hdf5",)) -> dict[str, Any]:
    """The page of numbers of a run, as `splinefeed run` writes it, with the source called as the user does."""
    servo = None
    if run.served is not None and wanted.machine is not None:
        servo = {**servo_numbers([run.served]), "machine_file": machine_name(wanted)}
    machine, origin = None if servo is None and wanted.followed else machine_name(wanted), wanted.origin
    made = about(run.settings, origin["text"], wanted.reading, formats, machine=machine, origin=origin)
    page = record(run, made, servo=servo)
    return {**page, "notes": [*wanted.notes, *page["notes"]]}


def machine_name(wanted: Wanted) -> str | None:
    """What a command line calls the machine: its name, or that of the file that a page offers."""
    given = wanted.given["machine"]
    if wanted.machine is None:
        return None
    return f"{wanted.machine.name}.toml" if isinstance(given, Mapping) and given.get("toml") else wanted.machine.name


def result(wanted: Wanted, run: sf.Run, look: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """All that a page shows of a run; look: only what shows now, the `figure` and the `colour` of the path."""
    response = None if run.served is None else run.served.response
    seen, along = None if look is None else look.get("figure"), unit_along(run.path.axes)
    path = path_figure(run, response, None if look is None else str(look.get("colour")))
    figures = {"motion": plot.motion(run)} if look is None or seen == "motion" else {}
    if run.use.names and (look is None or seen == "binding"):
        figures["binding"] = plot.limits(run)
    if response is not None and len(response):
        figures["errors"] = errors_figure({run.kept.method: response}, bands=run.bands)
        if has_spectra(run, response):
            figures["spectra"] = spectra_figure({"": response})
    return {
        "numbers": numbers(wanted, run),
        "words": {
            "allowed": ALLOWED,
            "measures": [asdict(each.label) for each in run.measures],
            **{name: words_of(name) for name in run.verdict.limits},
        },
        "units": {"s": theme.unit("length", along), **{name: theme.unit(name, along) for name in run.verdict.limits}},
        "figures": {name: interactive.to_plain(figure) for name, figure in figures.items()},
        "path": interactive.to_plain(path),
        "curves": curves(run),
    }


def curves(run: sf.Run) -> str | None:
    """The curves as the text of a JSON file, for editing; None where there are too many points, or not a plane."""
    path = run.path
    if path.linear != len(path.axes) or len(path.axes) != 2 or path.sticks(run.kept.position[:1]) is not None:
        return None
    if len(path.curves) > MOST_EDITED or sum(len(each.control_points) for each in path.curves) > MOST_EDITED:
        return None
    return json_curve.to_text([path])


def entry(wanted: Wanted, page: Mapping[str, Any], run: sf.Run) -> dict[str, Any]:
    """What the history keeps of a run beside its settings."""
    names = ("ok", "duration_s", "length_mm", "strategy", "method", "ticks", "lower_bound_s", "contour_error_max_mm")
    kept = {**{name: page.get(name) for name in names}, "machine": machine_name(wanted)}
    place = run.place
    place = np.vstack([place[:: -(-len(place) // PICTURE_POINTS)], place[-1:]])
    picture = view.shape(place, run.path.name) or view.sparkline(place[:, :1].ravel(), run.path.name)
    return plain({"name": run.path.name, "numbers": kept, "picture": picture})  # type: ignore[no-any-return]
