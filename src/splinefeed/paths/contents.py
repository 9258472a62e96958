"""What a reader found in a file."""

from __future__ import annotations

from collections.abc import Iterable

from splinefeed.paths.path import Path


class Contents(list[Path]):
    """The paths of a file in its order, in mm, the `units` that its lengths have ("mm", "in", ...) and its `format`."""

    def __init__(self, paths: Iterable[Path] = (), units: str = "mm") -> None:
        super().__init__(paths)
        self.units = units
        self.format = ""  # its title, which the registry knows
