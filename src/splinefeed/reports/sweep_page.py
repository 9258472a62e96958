"""sweep.html: all runs of a sweep in one page: parallel coordinates, and cycle time against contour error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from splinefeed.reports import theme
from splinefeed.reports.figure import Dots, Figure, Line, Panel, PlotAxis
from splinefeed.reports.html import filled, listed, section, table, text_of
from splinefeed.reports.interactive import to_plain
from splinefeed.sweeps.store import column, pareto, settings_columns
from splinefeed.sweeps.work import FAILED

#: The file that it is written to.
NAME = "sweep.html"
#: Runs that are drawn at the most; more are thinned evenly.
MOST = 20_000
#: Title of the second figure, and what a screen reader says.
PARETO = ("Cycle time against contour error", "cycle time against contour error, with the Pareto front")
#: Coordinates behind the settings, where they have values.
RESULTS = {
    "duration_s": "time (s)",
    "ripple_max": "ripple",
    "worst_share": "worst share",
    "contour_error_max_mm": "contour (mm)",
    "tracking_error_max_mm": "tracking (mm)",
}


def page(about: Mapping[str, Any], rows: Mapping[str, Sequence[Any]], sums: Mapping[str, Any]) -> str:
    """Write the page of a sweep as one HTML file.

    Parameters
    ----------
    about : mapping of str to object
        What the sweep is: its name, its grid, how it was run.
    rows : mapping of str to sequence
        The columns of its results.
    sums : mapping of str to object
        What `summary` returns.

    Returns
    -------
    str
        The text of the file.
    """
    made = np.flatnonzero([status != FAILED for status in rows["status"]])
    count = len(made)
    kept = made[np.unique(np.linspace(0, count - 1, min(count, MOST)).astype(np.int64))] if count else made
    figures = {"parallel": _parallel(about, rows, kept)} if count else {}
    if len(pareto(rows)):
        figures["pareto"] = to_plain(_pareto(rows, kept))
    state = "good" if sums["failed"] == 0 and sums["not_kept"] == 0 and sums["there"] == sums["runs"] else "bad"
    verdict = (
        f"{sums['there']} of {sums['runs']} runs: {sums['ok']} ok, {sums['not_kept']} not kept, {sums['failed']} failed"
    )
    return filled(
        "sweep.html",
        {"figures": figures, "series": []},
        title=text_of(about["name"]),
        state=state,
        verdict=text_of(verdict),
        failures=listed([f"{each['error']} ({each['runs']} runs)" for each in sums["failures"]], "said bad"),
        numbers=_numbers(sums),
        pareto=section("pareto", *PARETO) if "pareto" in figures else "",
    )


def _parallel(about: Mapping[str, Any], rows: Mapping[str, Sequence[Any]], kept: Any) -> dict[str, Any]:
    dimensions: list[dict[str, Any]] = []
    for name in ["source", *settings_columns(about), *RESULTS]:
        label = RESULTS.get(name, name.removeprefix("limits.").removeprefix("machine."))
        values = [rows[name][k] for k in kept]
        if len(set(values)) < 2 and name != "duration_s":
            continue
        if any(isinstance(value, str) for value in values):
            names, numbers = np.unique([str(value) for value in values], return_inverse=True)
            ticks = {"tickvals": list(range(len(names))), "ticktext": names.tolist()}
            dimensions.append({"label": label, "values": numbers.tolist(), **ticks})
        else:
            least = min((float(value) for value in values if value is not None), default=0.0)
            dimensions.append(
                {"label": label, "values": [least if value is None else float(value) for value in values]}
            )
    time = np.nan_to_num(column(rows, "duration_s")[kept])
    line = {"color": time.tolist(), "colorscale": "Viridis", "colorbar": {"title": {"text": "cycle time (s)"}}}
    data = [{"type": "parcoords", "dimensions": dimensions, "line": line}]
    layout = {"height": 460, "margin": {"l": 170, "r": 40, "t": 60, "b": 30}, "font": {"size": 12}}
    return {"data": data, "layout": layout}


def _pareto(rows: Mapping[str, Sequence[Any]], kept: Any) -> Figure:
    time, error = column(rows, "duration_s"), 1e3 * column(rows, "contour_error_max_mm")
    shown = [int(k) for k in kept if np.isfinite(time[k]) and np.isfinite(error[k])]
    names = tuple(f"run {rows['index'][k]}: {rows['source'][k]}" for k in shown)
    front = np.repeat(pareto(rows), 2)
    marks = (
        Dots(time[shown], error[shown], "runs", colour=theme.BLUE, hover=names),
        Line(time[front][1:], error[front][:-1], "Pareto front", theme.VERMILION, named=True),
    )
    panel = Panel(PlotAxis("cycle time (s)"), PlotAxis("largest contour error (µm)"), marks, height=360)
    return Figure("", (panel,))


def _numbers(sums: Mapping[str, Any]) -> str:
    rows = [
        f"<td>{text_of(name)}</td><td>{each['least']:.6g}</td><td>{each['least_run']}</td>"
        f"<td>{each['median']:.6g}</td><td>{each['most']:.6g}</td><td>{each['most_run']}</td>"
        for name, each in sums["numbers"].items()
    ]
    return table(("", "least", "run", "median", "most", "run"), rows)
