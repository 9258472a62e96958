"""What the axes of a machine did: their errors over time, side by side for setpoints of several methods."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from splinefeed.records import ROTARY_AXES, Array, BoolArray, Response
from splinefeed.report import theme
from splinefeed.report.drawing import curve, finite_peak, short

#: Lengths below this, mm, are written in micrometres.
MICROMETRES_BELOW = 1.0
#: Room for one panel more, inches.
PANEL = (3.3, 1.55)


@dataclass(frozen=True, eq=False)
class _Row:
    """One quantity of all responses: its label with the unit, and what its values are multiplied by."""

    label: str
    unit: str
    values: tuple[Array, ...]
    saturated: tuple[BoolArray | None, ...]


def errors_figure(responses: Mapping[str, Response], name: str, machine: str) -> Figure:
    """Tracking error of each axis and the contour error over time, one column a response, one scale a row.

    Where the output of an axis is at its limit the foot of its panel is marked. Fig. 5 of the paper.
    """
    shown = list(responses.values())
    rows = _rows(shown)
    columns = len(shown)
    title = f"{theme.words(name)} on {theme.words(machine)}: errors over time"
    with theme.applied():
        width = max(PANEL[0] * columns + 1.0, 6.4)
        titled = 2 if columns > 1 else 1
        figure = theme.new_figure(
            width, PANEL[1] * len(rows) + 1.1, title, gaps=(0.16, 0.34), grid=(len(rows), columns), titles=titled
        )
        grid = figure.subplots(len(rows), columns, sharex=True, sharey="row", squeeze=False)
        panel = (width - theme.LEFT - theme.RIGHT - 0.16 * (columns - 1)) / columns
        for i, row in enumerate(rows):
            for j, (method, response) in enumerate(responses.items()):
                ax = grid[i, j]
                _panel(ax, response, row.values[j], row.saturated[j], row.unit)
                if i == 0 and columns > 1:
                    ax.set_title(f"{theme.words(method, 30)}\n{ax.get_title(loc='left')}", fontsize=9.5)
            grid[i, 0].set_ylabel(f"{row.label} ({row.unit})")
            grid[i, 0].yaxis.set_label_coords(-theme.LABEL_AT / panel, 0.5)
        for ax in grid[-1]:
            ax.set_xlabel("time (s)")
            ax.locator_params(axis="x", nbins=6)
            theme.plain_ticks(ax.xaxis)
        return figure


def _rows(responses: list[Response]) -> list[_Row]:
    """The axes, then the contour error where every response has one."""
    rows = []
    for column, axis in enumerate(responses[0].axes):
        errors = [response.tracking_error[:, column] for response in responses]
        saturated = tuple(response.saturated[:, column] for response in responses)
        rows.append(_row(f"{theme.words(axis, 12)} error", errors, saturated, axis in ROTARY_AXES))
    contours = [response.contour_error for response in responses]
    if all(each is not None for each in contours):
        found = [np.asarray(each) for each in contours]
        rows.append(_row("contour error", found, (None,) * len(found), rotary=False))
    return rows


def _row(label: str, values: list[Array], saturated: tuple[BoolArray | None, ...], rotary: bool) -> _Row:
    """Values in degrees, micrometres or millimetres, whichever suits the largest."""
    if rotary:
        return _Row(label, "°", tuple(np.rad2deg(each) for each in values), saturated)
    small = max(finite_peak(each)[1] for each in values) < MICROMETRES_BELOW
    return _Row(label, "µm" if small else "mm", tuple((1e3 if small else 1.0) * each for each in values), saturated)


def _panel(ax: Axes, response: Response, values: Array, saturated: BoolArray | None, unit: str) -> None:
    """One error over time, its largest marked and said, and the place where the axis was stopped."""
    t = response.t
    at, peak = finite_peak(values)
    curve(ax, t, values, linewidth=1.0)
    ax.axhline(0.0, color=theme.FAINT, linewidth=0.6)
    ax.margins(x=0.01, y=0.1)
    ax.locator_params(axis="y", nbins=5)
    theme.plain_ticks(ax.yaxis)
    ax.set_title(f"at most {short(peak)} {unit} at {short(float(t[at]))} s" if peak > 0.0 else "none", fontsize=9.0)
    if peak > 0.0:
        ax.plot(t[at], values[at], "o", color=theme.VERMILION, markersize=4)
    if saturated is not None and saturated.any():
        foot = np.where(saturated, 0.02, np.nan)
        ax.plot(t, foot, color=theme.VERMILION, linewidth=3.0, transform=ax.get_xaxis_transform())
        ax.annotate(
            "red foot: output at its limit",
            (0.995, 0.05),
            xycoords="axes fraction",
            ha="right",
            color=theme.VERMILION,
            fontsize=8.0,
        )
    if response.stopped is not None:
        ax.axvline(float(t[-1]), color=theme.VERMILION, linestyle=(0, (5, 3)), linewidth=1.0)
        ax.annotate(
            "stopped",
            (float(t[-1]), 0.9),
            xycoords=("data", "axes fraction"),
            xytext=(-3, 0),
            textcoords="offset points",
            ha="right",
            color=theme.VERMILION,
            fontsize=8.5,
        )
