"""How every interpolation method does, on the paper's airfoil and on the butterfly."""

from __future__ import annotations

import splinefeed as sf
from benchmarks import cases
from benchmarks.tables import Column, Report, Table
from splinefeed.runs.settings import PAPER_LIMITS, PAPER_PERIOD, PAPER_SHAPE

COLUMNS = (
    Column("method"),
    Column("ripple, largest", ".1e"),
    Column("ripple, rms", ".1e"),
    Column("drift, mm", ".1e"),
    Column("chord error, mm", ".1e"),
    Column("ns a tick", ",.0f"),
)


def measure() -> Report:
    """One table a path."""
    airfoil = _table("The paper's airfoil", sf.shapes.from_text(PAPER_SHAPE), PAPER_LIMITS, PAPER_PERIOD)
    butterfly = _table("The butterfly", cases.butterfly(), cases.FAST, cases.PERIOD)
    return Report((airfoil, butterfly))


def _table(what: str, path: sf.Path, limits: sf.Limits, period: float) -> Table:
    law = sf.plan(path, limits, period=period)
    rows = tuple(
        (
            f"`{result.method}`",
            result.ripple_max,
            result.ripple_rms,
            result.drift_mm,
            result.chord_error_mm,
            result.ns_per_tick,
        )
        for result in (trace.result for trace in sf.runs.compare(path, law, period=period))
    )
    caption = (
        f"{what}, {path.length:.5g} mm, at {limits.feed:g} mm/s, {limits.acceleration:g} mm/s^2 and "
        f"{limits.jerk:g} mm/s^3, {1e3 * period:g} ms:"
    )
    return Table(caption, COLUMNS, rows)
