"""Batch: curves on their way through the smoothing, with the data of each and of the joint before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from splinefeed.geometry.curves import Flat
from splinefeed.records import Array, BoolArray, IntArray


@dataclass(frozen=True, eq=False)
class Batch:
    """Curves that follow each other.

    flat       the curves
    first      (n,) number of the first curve of the path that each stands for
    allowed    (n,) tolerance, mm
    spent      (n,) share of it that is used up
    line       (n,) straight lines that may be changed
    free       (n,) whether the joint before it may be smoothed; apart whether feed or tolerance changes there
    corner     (n,) whether that joint turns by more than the corner angle
    feed       (n,) mm/s; said  tolerance of the program, mm; NaN where none is given
    """

    flat: Flat
    first: IntArray
    allowed: Array
    spent: Array
    line: BoolArray
    free: BoolArray
    apart: BoolArray
    corner: BoolArray
    feed: Array
    said: Array

    @classmethod
    def joined(cls, batches: Sequence[Batch]) -> Batch:
        """All of them, one behind the other."""
        if len(batches) == 1:
            return batches[0]
        columns = {name: np.concatenate([getattr(batch, name) for batch in batches]) for name in COLUMNS}
        return cls(flat=Flat.joined([batch.flat for batch in batches]), **columns)

    def part(self, low: int, high: int) -> Batch:
        """The curves from `low` to the one before `high`."""
        return Batch(self.flat.part(low, high), **{name: getattr(self, name)[low:high] for name in COLUMNS})

    def standing(self, flat: Flat, at: IntArray, spent: Array) -> Batch:
        """Other curves, number i of which stands for those from at[i] to the one before at[i + 1]."""
        columns = {name: getattr(self, name)[at] for name in COLUMNS}
        columns["allowed"] = np.minimum.reduceat(self.allowed, at)
        columns["spent"] = spent
        return Batch(flat, **columns)

    def __len__(self) -> int:
        return len(self.first)


COLUMNS = tuple(field.name for field in fields(Batch) if field.name != "flat")
