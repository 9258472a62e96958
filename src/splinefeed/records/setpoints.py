"""Setpoints: where every axis must be at each servo tick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from splinefeed.records import view
from splinefeed.records.arrays import Array, IntArray, hold_columns

#: All columns of setpoints.
COLUMNS = ("t", "curve", "u", "s", "feed", "position")


@dataclass(frozen=True, eq=False, kw_only=True)
class Setpoints:
    """Where every axis must be at each servo tick.

    t         (n,)       time of the tick, s
    curve     (n,)       index of the curve in its path
    u         (n,)       parameter on that curve
    s         (n,)       arc length of the point along the path, mm
    feed      (n,)       planned feed at the tick, mm/s
    position  (n, axes)  mm, rotary axes rad
    axes      names of the axes; period in s; method as registered
    settings  all that is needed to repeat them
    Raises InputError for arrays of other shapes. Source: docs/setpoint-files.md.
    Example: `sf.interpolate(path, law).position[:, 0]`
    """

    t: Array
    curve: IntArray
    u: Array
    s: Array
    feed: Array
    position: Array
    axes: tuple[str, ...]
    period: float
    method: str
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "axes", tuple(self.axes))
        flat = {**dict.fromkeys(("t", "u", "s", "feed"), np.float64), "curve": np.int64}
        hold_columns(self, len(self.t), len(self.axes), flat, {"position": np.float64})

    def part(self, start: int, stop: int) -> Setpoints:
        """Setpoints start ... stop - 1, as views of these."""
        columns = {name: getattr(self, name)[start:stop] for name in COLUMNS}
        return replace(self, **columns)

    @staticmethod
    def joined(parts: Sequence[Setpoints]) -> Setpoints:
        """Setpoints that follow each other, at least one, in one record."""
        if len(parts) == 1:
            return parts[0]
        columns: dict[str, Any] = {name: np.concatenate([getattr(each, name) for each in parts]) for name in COLUMNS}
        return replace(parts[-1], **columns)

    def __repr__(self) -> str:
        return f"Setpoints({len(self)}, one every {self.period:g} s, axes {' '.join(self.axes)}, {self.method!r})"

    def _repr_html_(self) -> str:
        return view.table({"setpoints": f"{self!r}"}, view.sparkline(self.feed, "feed over time"))

    def __len__(self) -> int:
        return len(self.t)
