"""A figure as PNG or PDF: the same sheet as the SVG, painted by Matplotlib."""

from __future__ import annotations

import logging
import os
import warnings

from matplotlib import rc_context
from matplotlib.figure import Figure as Paper
from matplotlib.image import BboxImage
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle
from matplotlib.text import Text as Words
from matplotlib.transforms import Affine2D, Bbox, TransformedBbox

from splinefeed.report.figure import Figure
from splinefeed.report.layout import DASH, Dot, Picture, Stroke, Text, layout

#: Pixels of a sheet in an inch, points in an inch, and pixels of a PNG.
PIXELS, POINTS, DPI = 96.0, 72.0, 120
#: What files say of themselves: no date, so that the same figure gives the same file.
_SAID: dict[str, dict[str, str | None]] = {"png": {"Software": "splinefeed"}, "pdf": {"CreationDate": None}}
_SIDES = {"start": "left", "middle": "center", "end": "right"}


def write(figure: Figure, file: str | os.PathLike[str], form: str) -> None:
    """Write the figure to `file` as "png" or "pdf"; the same figure gives the same file."""
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it would talk of fonts and cache folders on stderr
    sheet = layout(figure)
    small = POINTS / PIXELS
    with rc_context({"text.parse_math": False, "font.family": "sans-serif"}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing", UserWarning)  # a box stands for a letter no font has
        paper = Paper(figsize=(sheet.width / PIXELS, sheet.height / PIXELS), dpi=DPI)
        place = Affine2D().scale(1.0, -1.0).translate(0.0, sheet.height).scale(1.0 / PIXELS) + paper.dpi_scale_trans
        for k, item in enumerate(sheet.items):
            if isinstance(item, Text):
                artist: Words | Line2D | Polygon | BboxImage = Words(
                    item.x, item.y, item.text, color=item.colour, fontsize=small * item.size,
                    ha=_SIDES[item.anchor], va="baseline", fontweight="bold" if item.bold else "normal",
                )  # fmt: skip
            elif isinstance(item, Picture):
                x, y, w, h = item.box
                artist = BboxImage(TransformedBbox(Bbox.from_bounds(x, y, w, h), place), interpolation="nearest")
                artist.set_data(item.pixels)
            elif isinstance(item, Dot):
                artist = Line2D(
                    [item.x], [item.y], marker="o", markersize=small * item.size, color=item.colour,
                    linestyle="",
                )  # fmt: skip
            elif item.fill:
                artist = Polygon(item.points, color=item.colour, linewidth=0.0)
            else:
                artist = Line2D(
                    item.points[:, 0], item.points[:, 1], color=item.colour, linewidth=small * item.width,
                    linestyle=(0, tuple(small * each / (small * item.width) for each in DASH)) if item.dash else "-",
                    solid_joinstyle="round", solid_capstyle="butt",
                )  # fmt: skip
            artist.set_zorder(k)
            if not isinstance(item, Picture):
                artist.set_transform(place)
            paper.add_artist(artist)
            if isinstance(item, Stroke | Dot) and item.clip is not None:
                left, top, width, height = item.clip
                artist.set_clip_path(Rectangle((left, top), width, height, transform=place))
        paper.savefig(file, format=form, metadata=_SAID[form])
