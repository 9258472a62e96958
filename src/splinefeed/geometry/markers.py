"""Marker: a command of a program between two moves."""

from __future__ import annotations

import math
from dataclasses import dataclass

from splinefeed.errors import InputError


@dataclass(frozen=True)
class Marker:
    """A command of a program between two moves, such as M3 S12000 or a dwell.

    before  index of the curve that follows it; the number of curves at the end
    text    its words, as they are written; dwell  time at rest, s; stop  whether the tool stops here
    A Path raises InputError for a marker outside it. Source: docs/gcode.md. Example: `sf.Marker(0, "M3 S12000")`
    """

    before: int
    text: str = ""
    dwell: float = 0.0
    stop: bool = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.dwell < math.inf:
            raise InputError(f"a dwell of {self.dwell!r} s; it must be 0 or more and finite")
        if self.dwell > 0.0 and not self.stop:
            raise InputError(f"a dwell of {self.dwell:g} s without a stop; the tool can wait only at rest")
