"""A figure that can be written and shown: `marks` say what it holds, `svg` and `raster` draw it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path as File

from splinefeed.errors import InputError
from splinefeed.files.atomic import atomic_write, write_text
from splinefeed.reports.marks import Coloured as Coloured
from splinefeed.reports.marks import Dots as Dots
from splinefeed.reports.marks import FigureData as FigureData
from splinefeed.reports.marks import Heat as Heat
from splinefeed.reports.marks import Level as Level
from splinefeed.reports.marks import Line as Line
from splinefeed.reports.marks import Mark as Mark
from splinefeed.reports.marks import Panel as Panel
from splinefeed.reports.marks import PlotAxis as PlotAxis
from splinefeed.reports.marks import Shades as Shades
from splinefeed.reports.marks import peak as peak
from splinefeed.reports.svg import to_text

#: Formats of figures, the usual one first; all but that need Matplotlib.
FORMATS = ("svg", "png", "pdf")
#: What brings the libraries that draw.
EXTRA = 'pip install "splinefeed[plots]"'


@dataclass(frozen=True, eq=False)
class Figure(FigureData):
    """Panels below each other, or in columns; those with the same x label share that axis and its cursor.

    Parameters
    ----------
    title : str
        Above the panels.
    panels : tuple of Panel
        Each with its axes and marks.
    columns : int, optional
        How many stand beside each other.
    legend : bool, optional
        Whether curves of one name in all panels are one, and the page has a legend to choose from.
    width : int, optional
        In px.

    Raises
    ------
    InputError
        By `save`, for another ending than .svg, .png or .pdf, and for PNG or PDF where Matplotlib is not installed.

    References
    ----------
    .. [1] docs/start.md shows the report.

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.plot.path(sf.shapes.circle(radius=10)).save("path.svg")
    """

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write the figure as what the file's name ends in, whole or not at all.

        Parameters
        ----------
        file : str or PathLike
            Its name ends in .svg, .png or .pdf.

        Raises
        ------
        InputError
            For another ending, and for PNG or PDF where Matplotlib is not installed.
        FormatError
            For a file that cannot be written.
        """
        form = File(file).suffix[1:].lower()
        if form not in FORMATS:
            raise InputError(f"{file}: figures are written as {', '.join(FORMATS)}")
        if not possible(form):
            raise InputError(f"{file}: {form} needs Matplotlib: {EXTRA}")
        if form == "svg":
            write_text(file, self._repr_svg_())
        else:
            from splinefeed.reports import raster

            with atomic_write(file) as temporary:
                raster.write(self, temporary, form)

    def __repr__(self) -> str:
        title, count = self.title.splitlines()[0] if self.title else "", len(self.panels)
        return f"Figure({title!r}, {count} panel{'s' * (count != 1)}; show it in a notebook, or .save('figure.svg'))"

    def _repr_svg_(self) -> str:
        """The figure in a notebook."""
        return to_text(self)


def possible(form: str) -> bool:
    """Whether figures can be written in that format here."""
    return form == FORMATS[0] or find_spec("matplotlib") is not None
