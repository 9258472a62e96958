"""The path with its feed as colour: in the plane, in space, or over time if there is one axis only."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from splinefeed.analysis.thinning import cells, runs
from splinefeed.geometry.path import Path
from splinefeed.records import Array, Setpoints, unit_along
from splinefeed.report import theme
from splinefeed.report.drawing import first_axis, short

#: Height of the picture over its width, at the least and at the most.
ASPECTS = (0.22, 1.0)
WIDTH = 7.6
#: Pictures higher than this, over their width, have the colour bar on their right, others below; its room in inches.
UPRIGHT_BAR = 0.55
BAR_ROOM = 0.74
#: Ends closer than this share of the picture get one label.
SAME_PLACE = 0.02
#: Width of a letter of a word beside the path, as a share of the picture.
WORD = 0.014
#: Size of a dot where not every tick is there, points squared.
DOT = 4.0
#: More stops than this are not marked one by one.
MOST_STOPS = 60


def path_figure(path: Path, points: Setpoints, thread: Array | None = None) -> Figure:
    """Where the tool goes, and how fast: position over the linear axes, equal scales, feed in mm/s as colour.

    thread  (m, linear axes) where the path runs, if `points` are but some of its ticks; these are dots on it then
    """
    with theme.applied():
        place = points.position[:, : min(path.linear, 3)]
        unit = unit_along(path.axes)
        duration, top = float(points.t[-1]), float(np.max(points.feed))
        title = f"{theme.words(path.name)}: {short(path.length)} {unit} in {short(duration)} s, "
        title += f"top feed {short(top)} {unit}/s"
        if place.shape[1] <= 1:
            return _over_time(path, points, title)
        elif place.shape[1] == 3 and np.ptp(place[:, 2]) > 0.0:
            return _in_space(path, points, place, title, thread)
        return _in_the_plane(path, points, place[:, :2], title, thread)


def _in_the_plane(path: Path, points: Setpoints, place: Array, title: str, thread: Array | None) -> Figure:
    width, height = np.ptp(place, axis=0)
    aspect = float(np.clip(height / width if width > 0.0 else ASPECTS[1], *ASPECTS))
    upright = aspect > UPRIGHT_BAR
    figure, ax, bar = _with_bar(aspect * WIDTH * (0.8 if upright else 0.86), title, upright)
    lines: Any
    if thread is None:
        lines = LineCollection([], linewidths=2.4, capstyle="round", **_coloured(points))
        _fill(lines, points, place)
        ax.add_collection(lines)
    else:
        ax.plot(*thread[:, :2].T, color=theme.FAINT, linewidth=0.5)
        lines = ax.scatter(
            place[:, 0], place[:, 1], c=points.feed, s=DOT, linewidths=0, zorder=2, rasterized=True, **_coloured(points)
        )
    _mark_ends(ax, place)
    _mark_stops(ax, path, place.shape[1])
    ax.margins(0.06)
    ax.autoscale_view()
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel(_axis(path, 0))
    ax.set_ylabel(_axis(path, 1))
    for axis in (ax.xaxis, ax.yaxis):
        theme.plain_ticks(axis)
    _draw_bar(figure, lines, bar, upright, "mm")
    return figure


def _with_bar(height: float, title: str, upright: bool) -> tuple[Figure, Axes, Axes]:
    """A figure with an axes of that height, inches, and another for the colour bar on its right or below it."""
    bottom = theme.BOTTOM + (0.0 if upright else BAR_ROOM)
    right = BAR_ROOM + 0.44 if upright else 0.3
    whole = height + bottom + 0.42
    figure = theme.new_figure(WIDTH, whole, title, bottom=bottom, right=right)
    ax = figure.add_subplot()
    box = ax.get_position()
    place = (
        (1.0 - (right - 0.22) / WIDTH, box.y0, 0.16 / WIDTH, box.height)
        if upright
        else (box.x0 + 0.15 * box.width, theme.BOTTOM / whole, 0.7 * box.width, 0.16 / whole)
    )
    bar = figure.add_axes(place)
    return figure, ax, bar


def _draw_bar(figure: Figure, lines: Any, bar: Axes, upright: bool, unit: str) -> None:
    label = f"feed ({unit}/s)"
    drawn = figure.colorbar(lines, cax=bar, label=label, orientation="vertical" if upright else "horizontal")
    theme.plain_ticks(drawn.ax.yaxis if upright else drawn.ax.xaxis)


def _in_space(path: Path, points: Setpoints, place: Array, title: str, thread: Array | None) -> Figure:
    from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
    from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]

    figure = theme.new_figure(WIDTH, 5.8, title, left=0.1, bottom=0.2, right=0.3)
    ax = figure.add_subplot(projection="3d")
    assert isinstance(ax, Axes3D)
    lines: Any
    if thread is None:
        lines = Line3DCollection([], linewidths=2.2, **_coloured(points))
        _fill(lines, points, place)
        ax.add_collection3d(lines)
    else:
        ax.plot(*thread.T, color=theme.FAINT, linewidth=0.5)
        lines = ax.scatter(
            place[:, 0],
            place[:, 1],
            place[:, 2],
            c=points.feed,
            s=DOT,
            linewidths=0,
            rasterized=True,
            **_coloured(points),
        )
    low, high = place.min(axis=0), place.max(axis=0)
    room = 0.05 * float(np.max(high - low))
    bounds = np.column_stack([low - room, high + room])
    ax.set(xlim=bounds[0], ylim=bounds[1], zlim=bounds[2])
    ax.set_box_aspect(tuple(np.ptp(bounds, axis=1)), zoom=1.05)
    ax.set_xlabel(_axis(path, 0))
    ax.set_ylabel(_axis(path, 1))
    ax.set_zlabel(_axis(path, 2))
    ax.plot(*place[0][:, None], marker="o", color=theme.INK, linestyle="none")
    ax.text(*place[0], "  start", color=theme.INK)
    figure.colorbar(lines, ax=ax, label="feed (mm/s)", shrink=0.7, pad=0.08, aspect=30)
    return figure


def _over_time(path: Path, points: Setpoints, title: str) -> Figure:
    figure, ax, bar = _with_bar(3.2, title, upright=True)
    values, label = first_axis(path, points)
    place = np.column_stack([points.t, values])
    lines = LineCollection([], linewidths=2.4, **_coloured(points))
    scale = np.ptp(place, axis=0)
    _fill(lines, points, place, place / np.where(scale > 0.0, scale, 1.0))
    ax.add_collection(lines)
    ax.autoscale_view()
    ax.set_xlabel("time (s)")
    ax.set_ylabel(label)
    for axis in (ax.xaxis, ax.yaxis):
        theme.plain_ticks(axis)
    _draw_bar(figure, lines, bar, True, unit_along(path.axes))
    return figure


def _axis(path: Path, number: int) -> str:
    return f"{theme.words(path.axes[number], 12)} (mm)"


def _coloured(points: Setpoints) -> dict[str, Any]:
    top = float(np.max(points.feed))
    return {"cmap": theme.feed_colours(), "norm": Normalize(0.0, top if top > 0.0 else 1.0)}


def _fill(lines: Any, points: Setpoints, place: Array, scaled: Array | None = None) -> None:
    """Give `lines` one polyline for each stretch of one colour: a tenth of the lines that single steps would make."""
    kept = cells(place if scaled is None else scaled)
    thin, feed = place[kept], points.feed[kept]
    middle = 0.5 * (feed[:-1] + feed[1:])
    levels = np.floor(middle / lines.norm.vmax * (theme.COLOURS - 1) + 0.5).astype(np.int64)
    stretches = runs(levels)
    lines.set_segments([thin[first : last + 2] for first, last in stretches])
    lines.set_array(np.array([levels[first] for first, _ in stretches]) * lines.norm.vmax / (theme.COLOURS - 1))


def _mark_ends(ax: Axes, place: Array) -> None:
    """The start as a dot with a word and the direction of travel, the end as a ring if it lies elsewhere."""
    size = float(np.max(np.ptp(place, axis=0)))
    ahead = place[np.argmax(np.linalg.norm(place - place[0], axis=1) > 0.05 * size)]
    arrow = {"arrowstyle": "-|>,head_width=0.35,head_length=0.7", "color": theme.INK, "linewidth": 1.6}
    ax.annotate("", ahead, place[0], arrowprops={**arrow, "shrinkA": 0, "shrinkB": 0}, zorder=5)
    ax.plot(*place[0], marker="o", color=theme.INK, markersize=6.5, zorder=6)
    together = bool(np.linalg.norm(place[-1] - place[0]) <= SAME_PLACE * size)
    _label(ax, place, 0, "start and end" if together else "start")
    if not together:
        ax.plot(*place[-1], marker="o", markerfacecolor="white", color=theme.INK, markersize=6.5, zorder=6)
        _label(ax, place, -1, "end")


def _label(ax: Axes, place: Array, at: int, text: str) -> None:
    """A word at a point, on the side that looks away from the middle of the picture."""
    low, high = place.min(axis=0), place.max(axis=0)
    size = float(np.max(high - low))
    x, y = (place[at] - 0.5 * (low + high)) / np.where(high > low, high - low, size)
    aside = abs(x) > abs(y)
    sign = 1 if (x if aside else y) >= 0.0 else -1
    ax.annotate(
        text,
        place[at],
        xytext=(10 * sign, 0) if aside else (0, 9 * sign),
        textcoords="offset points",
        ha=("left" if sign > 0 else "right") if aside else "center",
        va="center" if aside else ("bottom" if sign > 0 else "top"),
        zorder=6,
    )
    if aside:  # a place of no visible point makes room for the word
        ax.update_datalim([place[at] + (sign * WORD * len(text) * size, 0.0)])


def _mark_stops(ax: Axes, path: Path, axes: int) -> None:
    if 0 < len(path.stops) <= MOST_STOPS:
        at = path(np.array(path.stops))[:, :axes]
        ax.plot(at[:, 0], at[:, 1], "s", color=theme.VERMILION, markersize=4.5, zorder=5, label="rests at a corner")
        ax.legend(loc="best")
