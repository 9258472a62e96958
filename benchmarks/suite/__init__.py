"""Planning problems as data, a judge, and planners side by side: see README.md."""

from __future__ import annotations

from benchmarks.tables import Report


def measure() -> Report:
    """All problems by all planners that are installed."""
    from benchmarks.suite.__main__ import measure

    return measure()
