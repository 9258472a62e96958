"""A figure written as a file."""

from __future__ import annotations

import os
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path as File

from splinefeed.errors import InputError
from splinefeed.formats.atomic import atomic_write
from splinefeed.report.figure import Figure

#: Formats of figures, the usual one first; all but that need Matplotlib.
FORMATS = ("svg", "png", "pdf")
#: What brings the libraries that draw.
EXTRA = 'pip install "splinefeed[plots]"'


def save_figure(figure: Figure, file: str | os.PathLike[str]) -> None:
    """Write `figure` as what its suffix says, whole or not at all; the same figure gives the same file.

    Raises InputError for another suffix, or for PNG or PDF where Matplotlib is not installed.
    """
    form = File(file).suffix[1:].lower()
    if form not in FORMATS:
        raise InputError(f"{file}: figures are written as {', '.join(FORMATS)}")
    if not possible(form):
        raise InputError(f"{file}: {form} needs Matplotlib: {EXTRA}")
    with atomic_write(file) as temporary:
        if form == "svg":
            from splinefeed.report.svg import to_text

            temporary.write_text(to_text(figure), encoding="utf-8")
        else:
            from splinefeed.report.raster import write

            write(figure, temporary, form)


def save_figures(drawn: Iterable[tuple[str, Figure]], folder: File, formats: Iterable[str] = FORMATS[:1]) -> list[str]:
    """Write each figure in every format that is possible here, and give the names of the files."""
    wanted = [form for form in dict.fromkeys(formats) if possible(form)]
    names = []
    for name, figure in drawn:
        for form in wanted:
            names.append(f"{name}.{form}")
            save_figure(figure, folder / names[-1])
    return names


def possible(form: str) -> bool:
    """Whether figures can be written in that format here."""
    return form == FORMATS[0] or find_spec("matplotlib") is not None


def missing(formats: Iterable[str]) -> list[str]:
    """A sentence for each format that cannot be written here: what brings it."""
    lacking = [form for form in dict.fromkeys(formats) if not possible(form)]
    return [f"no figures as {form}: they need Matplotlib, {EXTRA}" for form in lacking]
