"""What the axes of a machine did: their errors over time, side by side for setpoints of several methods."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from splinefeed.analysis.thinning import cells
from splinefeed.pipeline.deviation import Deviation
from splinefeed.records import ROTARY_AXES, Array, BoolArray, Response
from splinefeed.report import theme
from splinefeed.report.drawing import curve, finite_peak, short

#: Lengths below this, mm, are written in micrometres.
MICROMETRES_BELOW = 1.0
#: Points of the true path in its picture, and the share of it that the largest error is enlarged to.
PATH_POINTS = 3000
ENLARGED_TO = 0.12
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


def contour_figure(deviation: Deviation, name: str, machine: str) -> Figure:
    """Where the machine was beside the true path, its distance from the path enlarged and as colour."""
    path, error = deviation.path, deviation.error
    s = np.linspace(0.0, path.length, PATH_POINTS)
    true = path(s)[:, :2]
    size = float(np.max(np.ptp(true, axis=0)))
    largest = float(np.max(error, initial=0.0))
    enlarged = _enlargement(size, largest)
    unit, factor = ("µm", 1e3) if largest < MICROMETRES_BELOW else ("mm", 1.0)
    with theme.applied():
        title = (
            f"{theme.words(name)} on {theme.words(machine)}: contour error at most {short(factor * largest)} {unit}\n"
            f"the distance from the path is drawn {enlarged:g} times as large"
        )
        shape = np.ptp(np.vstack([true, deviation.foot + enlarged * deviation.offset]), axis=0)
        aspect = float(np.clip(shape[1] / shape[0] if shape[0] > 0.0 else 1.0, 0.25, 1.0))
        figure = theme.new_figure(7.6, 6.1 * aspect + 1.6, title, right=1.25)
        ax = figure.add_subplot()
        ax.plot(true[:, 0], true[:, 1], color=theme.FAINT, linewidth=1.0)
        drawn = deviation.foot + enlarged * deviation.offset
        kept = cells(drawn)
        thin, colours = drawn[kept], factor * error[kept]
        lines = LineCollection(
            list(np.stack([thin[:-1], thin[1:]], axis=1)), linewidths=1.8, cmap=theme.feed_colours(), capstyle="round"
        )
        lines.set_array(0.5 * (colours[:-1] + colours[1:]))
        lines.set_clim(0.0, factor * largest if largest > 0.0 else 1.0)
        ax.add_collection(lines)
        at = int(np.argmax(error)) if len(error) else 0
        ax.plot(*drawn[at], "o", color=theme.VERMILION, markersize=5)
        ax.margins(0.06)
        ax.set_aspect("equal", adjustable="datalim")
        for axis, label in ((ax.xaxis, path.axes[0]), (ax.yaxis, path.axes[1])):
            axis.set_label_text(f"{theme.words(label, 12)} (mm)")
            theme.plain_ticks(axis)
        box = ax.get_position()
        bar = figure.add_axes((1.0 - 1.02 / 7.6, box.y0, 0.16 / 7.6, box.height))
        theme.plain_ticks(figure.colorbar(lines, cax=bar, label=f"contour error ({unit})").ax.yaxis)
        return figure


def _enlargement(size: float, largest: float) -> float:
    """A round number that makes the largest error some ENLARGED_TO of the picture, at least 1."""
    if largest <= 0.0:
        return 1.0
    wanted = ENLARGED_TO * size / largest
    power = 10.0 ** math.floor(math.log10(max(wanted, 1.0)))
    return max(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= max(wanted, 1.0)), 1.0)
