"""Which limit binds where: feed against the maximum-velocity curve, a strip along s, shares over time, and the path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from splinefeed.analysis.binding import BINDS, LimitUse
from splinefeed.analysis.thinning import COLUMNS, cells, runs
from splinefeed.geometry.path import Path
from splinefeed.records import Array, IntArray, Setpoints, unit_along
from splinefeed.report import theme
from splinefeed.report.drawing import curve, first_axis

#: Colour of each kind of limit; one for all axes.
KINDS = {
    "feed": theme.BLUE,
    "acceleration": "#56B4E9",
    "deceleration": "#56B4E9",
    "jerk": theme.INK,
    "centripetal": "#B8A800",
    "chord_error": "#E69F00",
    "axis_velocity": theme.GREEN,
    "axis_acceleration": theme.VERMILION,
    "axis_jerk": "#CC79A7",
}
NONE = "#c4c4c4"
WIDTH, HEIGHT = 7.6, 6.2
#: Inches: the feed, the strip along s, one row of shares, what lies between them.
FEED, STRIP, ROW, GAP = 2.5, 0.22, 0.24, 0.62
#: The maximum-velocity curve is drawn up to this many times the highest feed.
HEADROOM = 1.6


def limits_figure(use: LimitUse, points: Setpoints, name: str) -> Figure:
    """Feed and maximum-velocity curve over s, below them what binds; then the share of each limit over time."""
    rows = max(len(use.names), 1)
    height = FEED + STRIP + 0.08 + GAP + ROW * rows + theme.BOTTOM + 0.62
    title = f"{theme.words(name)}: which limit binds\n{_sentence(use)}"
    with theme.applied():
        figure = theme.new_figure(WIDTH, height, title)
        left, width = 1.55 / WIDTH, 1.0 - (1.55 + 0.75) / WIDTH

        def place(top: float, tall: float) -> Axes:
            return figure.add_axes((left, 1.0 - (top + tall) / height, width, tall / height))

        ax = place(0.62, FEED)
        _feed(ax, use, points)
        strip = place(0.62 + FEED + 0.08, STRIP)
        _strip(strip, use, unit_along(points.axes))
        shares = place(0.62 + FEED + 0.08 + STRIP + GAP, ROW * rows)
        _shares(figure, shares, use)
        return figure


def binding_figure(use: LimitUse, path: Path, points: Setpoints, thread: Array | None = None) -> Figure:
    """The path over its first two linear axes, or over time if there is one, coloured by the limit that binds.

    thread  as for `path_figure.path_figure`
    """
    if path.linear > 1:
        place = points.position[:, :2]
        labels = [f"{theme.words(axis, 12)} (mm)" for axis in path.axes[:2]]
    else:
        values, label = first_axis(path, points)
        place = np.column_stack([points.t, values])
        labels = ["time (s)", label]
    binding = _kinds(use)
    with theme.applied():
        title = f"{theme.words(path.name)}: which limit binds ({BINDS:.0%} of it used), and how much of the time\n"
        figure = theme.new_figure(WIDTH, HEIGHT, title, titles=1)
        ax = figure.add_subplot()
        if thread is None or path.linear < 2:
            ax.add_collection(_stretches(use, path, place, binding))
        else:
            ax.plot(*thread[:, :2].T, color=theme.FAINT, linewidth=0.5)
            colours = np.array(_colours(use))[binding]
            ax.scatter(place[:, 0], place[:, 1], c=colours, s=4.0, linewidths=0, zorder=2, rasterized=True)
        ax.margins(0.06)
        ax.autoscale_view()
        if path.linear > 1:
            ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel(labels[0])
        ax.set_ylabel(labels[1])
        for axis in (ax.xaxis, ax.yaxis):
            theme.plain_ticks(axis)
        _legend(figure, use)
        return figure


def _stretches(use: LimitUse, path: Path, place: Array, binding: IntArray) -> LineCollection:
    """One polyline for each stretch of one colour."""
    span = np.ptp(place, axis=0)
    kept = cells(place / np.where(span > 0.0, span, 1.0) * (1.0 if path.linear < 2 else span))
    kept = np.unique(np.concatenate([kept, [first for first, _ in runs(binding)]])).astype(np.int64)
    thin, kinds = place[kept], binding[kept]
    stretches = runs(kinds)
    return LineCollection(
        [thin[first : last + 2] for first, last in stretches],
        colors=[_colours(use)[kinds[first]] for first, _ in stretches],
        linewidths=2.4,
    )


def _feed(ax: Axes, use: LimitUse, points: Setpoints) -> None:
    high = HEADROOM * float(np.max(points.feed))
    top = np.minimum(use.top, high)
    curve(ax, use.s, top, color=theme.FAINT, linewidth=1.0)
    curve(ax, use.s, points.feed, color=theme.BLUE)
    ax.set_ylim(0.0, min(high, 1.12 * max(float(np.max(top)), float(np.max(points.feed)))))
    ax.margins(x=0.0)
    ax.set_ylabel(f"feed ({unit_along(points.axes)}/s)")
    ax.tick_params(labelbottom=False)
    theme.plain_ticks(ax.yaxis)
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
    ax.text(0.99, 0.97, "grey: maximum-velocity curve", transform=ax.transAxes, ha="right", va="top",
            color=theme.FAINT, fontsize=8.5, bbox=box)  # fmt: skip


def _strip(ax: Axes, use: LimitUse, unit: str) -> None:
    """What binds along s, one colour a pixel; unit of s."""
    length = float(use.s[-1]) if use.s[-1] > 0.0 else 1.0
    at = np.searchsorted(use.s, (np.arange(2 * COLUMNS) + 0.5) / (2 * COLUMNS) * length)
    kinds = _kinds(use)[np.minimum(at, len(use.s) - 1)]
    colours = _colours(use)
    picture = ListedColormap(colours)
    ax.imshow(kinds[None, :], cmap=picture, vmin=-0.5, vmax=len(colours) - 0.5, aspect="auto",
              extent=(0.0, length, 0.0, 1.0), interpolation="nearest")  # fmt: skip
    ax.set_yticks([])
    ax.grid(visible=False)
    ax.set_ylabel("binds", rotation=0, ha="right", va="center")
    ax.set_xlabel(f"s ({unit})")
    theme.plain_ticks(ax.xaxis)


def _shares(figure: Figure, ax: Axes, use: LimitUse) -> None:
    """The greatest share of each limit in each column of pixels, over time."""
    ax.set_xlabel("time (s)")
    ax.grid(visible=False)
    if not use.names:
        ax.text(0.5, 0.5, "no limits", transform=ax.transAxes, ha="center", va="center")
        ax.set_yticks([])
        return
    count = len(use.t)
    size = -(-count // min(count, COLUMNS))
    padded = np.pad(use.share, ((0, -count % size), (0, 0)), mode="edge")
    peaks = padded.reshape(-1, size, len(use.names)).max(axis=1)
    mesh = ax.imshow(peaks.T, cmap=theme.feed_colours(), vmin=0.0, vmax=1.0, aspect="auto",
                     extent=(0.0, float(use.t[-1]), len(use.names) - 0.5, -0.5), interpolation="nearest")  # fmt: skip
    ax.set_yticks(range(len(use.names)), [words_of(name) for name in use.names], fontsize=8.5)
    for tick, name in zip(ax.get_yticklabels(), use.names, strict=True):
        tick.set_color(KINDS[name.partition(".")[0]])
    theme.plain_ticks(ax.xaxis)
    box = ax.get_position()
    bar = figure.add_axes((box.x1 + 0.012, box.y0, 0.016, box.height))
    drawn = figure.colorbar(mesh, cax=bar, label="share of the limit")
    drawn.ax.yaxis.label.set_fontsize(8.5)
    theme.plain_ticks(drawn.ax.yaxis)


def _kinds(use: LimitUse) -> IntArray:
    """Index of the kind of limit that binds at each tick into KINDS, behind them all where none does, (n,)."""
    order = list(KINDS)
    index = np.array([order.index(name.partition(".")[0]) for name in use.names] + [len(order)], dtype=np.int64)
    return index[use.binding]


def _colours(use: LimitUse) -> Sequence[str]:
    return [*KINDS.values(), NONE]


def _legend(figure: Figure, use: LimitUse) -> None:
    """A line under the title: colour, kind of limit, and the part of the time in which it binds."""
    colours = {**{words_of(kind): colour for kind, colour in KINDS.items()}, "none": NONE}
    handles = [Patch(color=colours[kind], label=f"{kind} {part:.0%}") for kind, part in _parts(use)]
    at = (0.12 / WIDTH, 1.0 - 0.3 / HEIGHT)
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=at, ncols=5, columnspacing=1.2, handlelength=1.2)


def _parts(use: LimitUse) -> list[tuple[str, float]]:
    """Kinds of limits and the part of the time in which they bind, the longest first, "none" last."""
    kinds: dict[str, float] = {}
    for name, part in use.time_bound_by().items():
        kind = "none" if name == "none" else words_of(name.partition(".")[0])
        kinds[kind] = kinds.get(kind, 0.0) + part
    none = kinds.pop("none", 0.0)
    return [*sorted(kinds.items(), key=lambda each: -each[1]), ("none", none)]


def _sentence(use: LimitUse) -> str:
    said = [f"{kind} {part:.0%}" for kind, part in _parts(use) if part >= 0.005]
    return f"of the time: {', '.join(said)}"


def words_of(name: str) -> str:
    """The name of a limit in words: axis jerk x."""
    kind, _, axis = name.partition(".")
    return f"{kind.replace('_', ' ')}{f' {axis}' if axis else ''}"
