"""How every figure looks: one set of fonts, sizes and colours that colour-blind readers can tell apart."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib
from matplotlib.axis import Axis
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullLocator

#: Okabe and Ito's colours, https://jfly.uni-koeln.de/color/: distinct with every kind of colour blindness.
BLUE = "#0072B2"
VERMILION = "#D55E00"
GREEN = "#009E73"
#: Their orange and sky blue, darkened until white paper shows it, and ink in place of the other.
OCHRE = "#A87400"
INK = "#1a1a1a"
FAINT = "#6b6b6b"
#: What stands behind the thing that is shown.
PALE = "#8a8f94"
GRID = "#e3e3e3"
BAND = "#e9f3ee"

#: Pixels an inch of PNG files.
DPI = 120
#: Part of the colour map that is used: its last, bright yellow cannot be seen on white paper.
_DARK_PART = 0.93
#: Steps of the colour map; a feed is read to a few of them.
COLOURS = 64

_SETTINGS: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Arial", "Helvetica", "sans-serif"],
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "axes.titlecolor": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.limits": (-3, 5),
    "axes.formatter.use_mathtext": True,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "lines.linewidth": 1.3,
    "lines.solid_joinstyle": "round",
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "figure.dpi": DPI,
    "figure.facecolor": "white",
    "figure.titlesize": 11.5,
    "figure.titleweight": "bold",
    "legend.frameon": False,
    "text.parse_math": False,  # a $ in a name is a $
    "svg.fonttype": "none",  # text stays text: it can be searched, and the files are half as large
    "svg.hashsalt": "splinefeed",  # the same figure gives the same file
    "path.simplify_threshold": 0.2,
}


#: Room around the axes, inches: for a label and six letters of a tick on the left, a label and a tick below.
LEFT, BOTTOM, RIGHT = 0.98, 0.52, 0.14
#: How far left of an axes its label stands.
LABEL_AT = 0.74
#: Room of one line of a title above an axes.
TITLE_ROOM = 0.17


@contextmanager
def applied() -> Iterator[None]:
    """The settings of the theme, for the making and for the saving of a figure."""
    with matplotlib.rc_context(_SETTINGS), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing", UserWarning)  # a box stands for a letter no font has
        yield


def words(name: str, longest: int = 48) -> str:
    """`name` for a title: without what cannot be printed, and not too long."""
    text = "".join(c if c.isprintable() else " " for c in name)
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def new_figure(
    width: float,
    height: float,
    title: str,
    *,
    left: float = LEFT,
    bottom: float = BOTTOM,
    right: float = RIGHT,
    gaps: tuple[float, float] = (0.0, 0.0),
    grid: tuple[int, int] = (1, 1),
    titles: int = 0,
) -> Figure:
    """A figure of that size in inches with a title, and the room around and between a `grid` of axes, in inches.

    titles  lines of the title of each axes

    Room of a fixed size, for labels whose size is known: finding it out takes as long as drawing everything.
    """
    lines = title.count("\n") + 1
    top = 0.22 * lines + 0.2 + TITLE_ROOM * titles
    across, down = width - left - right, height - top - bottom
    rows, columns = grid
    figure = Figure(figsize=(width, height))
    figure.subplots_adjust(
        left=left / width,
        right=1.0 - right / width,
        bottom=bottom / height,
        top=1.0 - top / height,
        wspace=gaps[0] * columns / (across - gaps[0] * (columns - 1)),
        hspace=gaps[1] * rows / (down - gaps[1] * (rows - 1)),
    )
    figure.suptitle(title, x=0.12 / width, y=1.0 - 0.09 / height, ha="left", va="top")
    return figure


def plain_ticks(axis: Axis, *, logarithmic: bool = False) -> None:
    """Few ticks on `axis`, labelled in plain text: mathematical typesetting of each takes longer than the curve."""
    if logarithmic:
        axis.set_major_formatter(FuncFormatter(_power))
        axis.set_minor_locator(NullLocator())
    else:
        axis.set_major_formatter(FuncFormatter(lambda value, _: tick_text(value)))


def tick_text(value: float) -> str:
    """A tick's number in at most six letters: 12000, 1.2e6."""
    text = f"{value:.6g}"
    if len(text.lstrip("-")) > 5 or "e" in text:
        text = re.sub(r"\.?0*e", "e", short_power(f"{value:.3e}"))
    return "0" if text in ("-0", "0e0") else text


def short_power(text: str) -> str:
    """1.2e5 for 1.2e+05."""
    return re.sub(r"e([+-])0*", lambda sign: "e" + sign[1].strip("+"), text)


def _power(value: float, _: object) -> str:
    return f"1e{round(math.log10(value))}" if value > 0.0 else ""


def feed_colours() -> ListedColormap:
    """The colours of a feed, from none to the top."""
    whole = matplotlib.colormaps["viridis"]
    return ListedColormap([whole(_DARK_PART * i / (COLOURS - 1)) for i in range(COLOURS)], name="feed")
