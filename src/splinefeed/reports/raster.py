"""A figure as PNG or PDF: the same sheet as the SVG, painted by Matplotlib."""

from __future__ import annotations

import logging
import os
import warnings

from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.figure import Figure as Paper
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke

from splinefeed.reports import theme
from splinefeed.reports.layout import Dot, Picture, Stroke, Text, layout
from splinefeed.reports.marks import FigureData

#: Pixels of a sheet in an inch, points in an inch, and pixels of a PNG.
PIXELS, POINTS, DPI = 96.0, 72.0, 120
#: What files say of themselves: no date, so that the same figure gives the same file.
_SAID: dict[str, dict[str, str | None]] = {"png": {"Software": "splinefeed"}, "pdf": {"CreationDate": None}}
_SIDES = {"start": "left", "middle": "center", "end": "right"}


def write(figure: FigureData, file: str | os.PathLike[str], form: str) -> None:
    """Write a figure as PNG or PDF; the same figure gives the same file.

    Parameters
    ----------
    figure : Figure
        To be written.
    file : str or PathLike
        Its name.
    form : str
        "png" or "pdf".
    """
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it would talk of fonts and cache folders on stderr
    sheet = layout(figure)
    small = POINTS / PIXELS
    with rc_context({"text.parse_math": False, "font.family": "sans-serif"}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing", UserWarning)  # a box stands for a letter no font has
        paper = Paper(figsize=(sheet.width / PIXELS, sheet.height / PIXELS), dpi=DPI)
        axes = paper.add_axes((0.0, 0.0, 1.0, 1.0), autoscale_on=False)
        axes.set(xlim=(0.0, sheet.width), ylim=(sheet.height, 0.0))
        axes.set_axis_off()
        # so that words can be read over lines; in a PDF they would be outlines and no words
        around = [] if form == "pdf" else [withStroke(linewidth=small * 3.0, foreground="#fff")]
        for k, item in enumerate(sheet.items):
            drawn: Artist
            if isinstance(item, Text):
                drawn = axes.text(
                    item.x, item.y, item.text, color=item.colour, size=small * item.size, ha=_SIDES[item.anchor],
                    va="baseline", weight="bold" if item.bold else "normal", path_effects=around,
                )  # fmt: skip
            elif isinstance(item, Picture):
                x, y, w, h = item.box
                drawn = axes.imshow(item.pixels, extent=(x, x + w, y + h, y), interpolation="nearest", aspect="auto")
            elif isinstance(item, Dot):
                (drawn,) = axes.plot(item.x, item.y, "o", markersize=small * item.size, color=item.colour)
            elif item.fill:
                (drawn,) = axes.fill(*item.points.T, color=item.colour, linewidth=0.0)
            else:
                dashes = tuple(each / item.width for each in theme.DASHES[item.dash]) or (None, None)
                (drawn,) = axes.plot(
                    *item.points.T, color=item.colour, linewidth=small * item.width, dashes=dashes,
                    solid_joinstyle="round", solid_capstyle="butt",
                )  # fmt: skip
            drawn.set_zorder(k)
            if isinstance(item, Stroke | Dot) and item.clip is not None:
                left, top, width, height = item.clip
                drawn.set_clip_path(Rectangle((left, top), width, height, transform=axes.transData))
        paper.savefig(file, format=form, metadata=_SAID[form])
