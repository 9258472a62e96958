"""Arc length of the butterfly: making its table, reading it, inverting it, and quadrature with bisection for scale."""

from __future__ import annotations

import time
from functools import partial

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

import splinefeed as sf
from benchmarks import cases
from benchmarks.tables import Column, Headline, Report, Table
from benchmarks.timing import interleaved
from splinefeed.curves.curve import NurbsCurve

COUNT = 100_000
#: Inversions by quad and brentq, each of which integrates the speed anew about ten times.
SCALE_COUNT = 5
ROUNDS = 30
#: The table must be made within this, ms, when the compiler has done its work.
TARGET = 20.0


def measure() -> Report:
    """Milliseconds for the table, nanoseconds for S(u) and its inverse, and the same by SciPy's quad and brentq."""
    curve = cases.butterfly().curves[0]
    s = np.linspace(0.0, curve.length, COUNT)
    u = curve.parameter_at(s)

    def table() -> None:
        NurbsCurve(curve.degree, curve.knots, curve.control_points, curve.weights).arc  # noqa: B018

    times = interleaved(
        {"table": table, "S(u)": partial(curve.arc_length, u), "u(s)": partial(curve.parameter_at, s)}, ROUNDS
    )
    made, there, back = (times[name].least for name in ("table", "S(u)", "u(s)"))
    inverse = ByQuadrature(curve)
    some = np.linspace(0.0, curve.length, SCALE_COUNT + 2)[1:-1]
    start = time.perf_counter()
    found = np.array([inverse(float(value)) for value in some])
    scale = (time.perf_counter() - start) / SCALE_COUNT
    apart = float(np.max(np.abs(curve.arc_length(found) - some)))
    round_trip = float(np.max(np.abs(curve.arc_length(u) - s)))
    rows = (
        ("making the table", 1e6 * made, f"{len(curve.arc.table)} pieces; median {1e6 * times['table'].median:,.0f}"),
        ("S(u)", 1e6 * there / COUNT, f"{COUNT:,} at a time"),
        ("u(s)", 1e6 * back / COUNT, f"{COUNT:,} at a time; S(u(s)) - s at most {round_trip:.0e} mm"),
        (
            "u(s) by SciPy's quad and brentq",
            1e6 * scale,
            f"one at a time, {COUNT * scale / back:,.0f} times as long; {apart:.0e} mm from the table",
        ),
    )
    caption = f"Arc length of the butterfly, {curve.length:.6g} mm, warm."
    columns = Column("what"), Column("us", ",.3f"), Column("remark")
    outcome = f"{1e3 * made:.1f} ms, {len(curve.arc.table)} pieces"
    headline = Headline("arc-length table of the butterfly", outcome, f"{TARGET:g} ms", 1e3 * made <= TARGET)
    return Report((Table(caption, columns, rows),), (headline,))


class ByQuadrature:
    """The parameter at an arc length as one would find it without a table: brentq on quad of |C'|, span by span."""

    def __init__(self, curve: sf.NurbsCurve) -> None:
        self.curve = curve
        spans = zip(curve.breaks[:-1], curve.breaks[1:], strict=True)
        self.starts = np.cumsum([0.0, *(self.length(start, end) for start, end in spans)])

    def speed(self, u: float) -> float:
        """|C'(u)|."""
        return float(np.linalg.norm(self.curve.derivatives(u, 1)[1]))

    def length(self, start: float, end: float) -> float:
        """Arc length between two parameters of one span, mm."""
        return float(quad(self.speed, start, end, epsabs=1e-11, epsrel=1e-11, limit=200)[0])

    def __call__(self, s: float) -> float:
        """The parameter at arc length s, mm."""
        i = int(np.searchsorted(self.starts, s, side="right")) - 1
        start, end = self.curve.breaks[i : i + 2]
        rest = s - self.starts[i]
        return float(brentq(lambda u: self.length(start, u) - rest, start, end, xtol=1e-14, rtol=1e-14))
