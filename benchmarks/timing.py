"""How things are timed against each other on a machine that also does other work."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Times:
    """Seconds of each round."""

    seconds: tuple[float, ...]

    @property
    def least(self) -> float:
        """The fastest round: what the code costs when nothing disturbs it."""
        return min(self.seconds)

    @property
    def median(self) -> float:
        """The middle round: what it costs here and now."""
        return statistics.median(self.seconds)


def interleaved(candidates: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, Times]:
    """Time all candidates once, then all once again, `rounds` times, after one round that does not count.

    Whatever slows the machine for a while so slows all of them, and their ratios hold.
    """
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    for call in candidates.values():
        call()
    for _ in range(rounds):
        for name, call in candidates.items():
            start = time.perf_counter()
            call()
            seconds[name].append(time.perf_counter() - start)
    return {name: Times(tuple(each)) for name, each in seconds.items()}
