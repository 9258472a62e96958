"""Contour error over feed, and cycle time over contour error, as a search for the feed found them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from splinefeed.pipeline.contour_feed import FeedTuning
from splinefeed.records import Array
from splinefeed.report import theme
from splinefeed.report.drawing import short

#: Labels along a logarithmic scale: 1, 2 and 5 times each power of ten.
_STEPS = (1.0, 2.0, 5.0)


def feed_curve_figure(tuning: FeedTuning, name: str, machine: str) -> Figure:
    """Every trial: its contour error over its top feed, and its time over its contour error; the best one marked."""
    sound = [trial for trial in tuning.trials if trial.stopped is None]
    feed = np.array([trial.feed for trial in sound])
    error = 1e3 * np.array([trial.error for trial in sound])
    time = np.array([trial.duration for trial in sound])
    tolerance = 1e3 * tuning.tolerance
    best = tuning.best
    title = f"{theme.words(name)} on {theme.words(machine)}: contour error by feed"
    if best is not None:
        title += f"\nwithin {short(tolerance)} µm: top feed {short(best.feed)} mm/s, {short(best.duration)} s"
    else:
        title += f"\nnone of these feeds keeps {short(tolerance)} µm"
    with theme.applied():
        figure = theme.new_figure(9.0, 4.2, title, gaps=(theme.LEFT, 0.0), grid=(1, 2))
        left, right = figure.subplots(1, 2)
        for ax, x, y, labels in (
            (left, feed, error, ("top feed (mm/s)", "largest contour error (µm)")),
            (right, error, time, ("largest contour error (µm)", "time of the motion (s)")),
        ):
            ax.plot(x, y, "o-", color=theme.BLUE, markersize=4)
            ax.set_xlabel(labels[0])
            ax.set_ylabel(labels[1])
            _logarithmic(ax, x, y, tolerance if ax is left else None)
        left.axhline(tolerance, color=theme.VERMILION, linestyle=(0, (5, 3)), linewidth=1.0)
        right.axvline(tolerance, color=theme.VERMILION, linestyle=(0, (5, 3)), linewidth=1.0)
        left.annotate(
            f"tolerance {short(tolerance)} µm",
            (0.02, tolerance),
            xycoords=("axes fraction", "data"),
            xytext=(0, 3),
            textcoords="offset points",
            color=theme.VERMILION,
            fontsize=8.5,
        )
        if best is not None:
            left.plot(best.feed, 1e3 * best.error, "o", color=theme.VERMILION, markersize=7)
            right.plot(1e3 * best.error, best.duration, "o", color=theme.VERMILION, markersize=7)
        return figure


def _logarithmic(ax: Axes, x: Array, y: Array, level: float | None) -> None:
    """Logarithmic scales with plain labels where there is something to show."""
    for values, axis, set_scale, set_limits in (
        (x, ax.xaxis, ax.set_xscale, ax.set_xlim),
        (y if level is None else np.append(y, level), ax.yaxis, ax.set_yscale, ax.set_ylim),
    ):
        seen = values[values > 0.0]
        if not len(seen):
            continue
        low, high = float(seen.min()) / 1.2, float(seen.max()) * 1.2
        set_limits(low, high)
        set_scale("log")
        powers = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
        ticks = [step * power for power in powers for step in _STEPS if low <= step * power <= high]
        axis.set_ticks(ticks)
        axis.set_ticks([], minor=True)
        theme.plain_ticks(axis)
