"""Parts that figures share: curves over time thinned to their pixels, limits as lines, units in labels."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from splinefeed.analysis.thinning import extremes
from splinefeed.geometry.path import Path
from splinefeed.records import Array, Setpoints
from splinefeed.report import theme

#: A limit farther out than this many times the data is said in words: drawn, it would press the data flat.
FARTHEST_LIMIT = 3.0

#: Units as figures write them, by the unit of length and the order of the derivative.
_PER_SECOND = ("", "/s", "/s²", "/s³")


def unit_of(length: str, order: int) -> str:
    """The unit of the order-th derivative over time of `length` ("mm" or "deg"), for a label."""
    return f"{'°' if length == 'deg' else length}{_PER_SECOND[order]}"


def curve(ax: Axes, t: Array, values: Array, **style: object) -> None:
    """Draw `values` (n,) over t (n,), s: every peak stays, whatever the number of ticks."""
    kept = extremes(values)
    ax.plot(t[kept], values[kept], **{"color": theme.BLUE, **style})  # type: ignore[arg-type]


def limit(ax: Axes, value: float, worst: float, text: str) -> None:
    """A dashed line at a limit with its name, or words alone where it is far beyond the `worst` value.

    Nothing for an infinite limit, nor for a negative one out of sight: its positive twin has the words.
    """
    if not np.isfinite(value) or value < -FARTHEST_LIMIT * worst:
        return
    if value > FARTHEST_LIMIT * worst:
        ax.annotate(
            f"{text}: beyond this scale",
            (0.995, 0.97),
            xycoords="axes fraction",
            ha="right",
            va="top",
            color=theme.VERMILION,
            fontsize=8.5,
        )
        return
    line_at(ax, value, theme.VERMILION)
    ax.annotate(
        text,
        (1.0, value),
        xycoords=("axes fraction", "data"),
        xytext=(-2, 2 if value > 0.0 else -2),
        textcoords="offset points",
        ha="right",
        va="bottom" if value > 0.0 else "top",
        color=theme.VERMILION,
        fontsize=8.5,
    )


def line_at(ax: Axes, value: float, colour: str) -> None:
    """A dashed line across `ax` at `value`."""
    ax.axhline(value, color=colour, linestyle=(0, (5, 3)), linewidth=1.0)


def finite_peak(values: Array) -> tuple[int, float]:
    """Index and size of the largest |value| that is finite; (0, 0.0) if none is."""
    if not len(values):
        return 0, 0.0
    sizes = np.where(np.isfinite(values), np.abs(values), 0.0)
    at = int(np.argmax(sizes))
    return at, float(sizes[at])


def short(value: float) -> str:
    """`value` in three digits, for a label."""
    return theme.short_power(f"{value:.3g}" if not 1e3 <= abs(value) < 1e5 else f"{value:.0f}")


def first_axis(path: Path, points: Setpoints) -> tuple[Array, str]:
    """Position (n,) of the first axis for a picture over time, and its label: mm, or degrees for a rotary axis."""
    if path.linear:
        return points.position[:, 0], f"{theme.words(path.axes[0], 12)} (mm)"
    return np.degrees(points.position[:, 0]), f"{path.axes[0]} (deg)"
