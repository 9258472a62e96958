"""What a measure of runs is: a meter whose numbers runs, files, the command line, pages and sweeps all tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from splinefeed.analysis.bands import Band
from splinefeed.analysis.thinning import Kept
from splinefeed.records import Limits, Verdict
from splinefeed.runs.fold import Chunk, Meter


@dataclass(frozen=True)
class MeasureLabel:
    """How people read of a measure.

    Parameters
    ----------
    name : str
        What it is called.
    key : str
        Of its number.
    unit : str, optional
        "mm", or "" of what is relative.
    beside : (str, str), optional
        Words and key of a number to compare it with.
    """

    name: str
    key: str
    unit: str = ""
    beside: tuple[str, str] | None = None


@dataclass(frozen=True)
class MeasuredRun:
    """What measures are made for: limits of a run, how ticks are kept, the highest feed of the motion where known."""

    limits: Limits
    keep: Callable[[], Kept]
    top: float | None = None


class Measure(Meter):
    """A meter (`fold.Meter`) of every run; a new one is a file with a class of this kind, and a line of `measures`.

    Attributes
    ----------
    label : MeasureLabel
        What it is called where people read it.
    columns : tuple of str
        Keys of the numbers that sweeps keep.
    bands : dict of str to Band
        Of what figures show over time where ticks are left out.
    """

    label: ClassVar[MeasureLabel]
    columns: ClassVar[tuple[str, ...]] = ()

    def __init__(self, given: MeasuredRun) -> None:
        self.bands: dict[str, Band] = {}

    def feed(self, chunk: Chunk) -> None:
        """Measure the ticks of a chunk."""
        raise NotImplementedError

    def numbers(self, verdict: Verdict) -> dict[str, Any]:
        """What was found, by the keys of `--json`; the check found `verdict`."""
        raise NotImplementedError
