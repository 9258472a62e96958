"""What a reader found in a file."""

from __future__ import annotations

from collections.abc import Iterable

from splinefeed.paths.path import Path


class Contents(list[Path]):
    """The paths of a file in its order, in mm.

    Parameters
    ----------
    paths : iterable of Path, optional
        The paths.
    units : str, optional
        What lengths in the file have: "mm", "in", ...

    Attributes
    ----------
    format : str
        Title of the format.
    """

    def __init__(self, paths: Iterable[Path] = (), units: str = "mm") -> None:
        super().__init__(paths)
        self.units = units
        self.format = ""  # its title, which the registry knows
