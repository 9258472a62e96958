"""Smoothing: real programs before and after under the same limits, and how many lines a second."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

import splinefeed as sf
from benchmarks.tables import Cell, Column, Headline, Report, Table
from splinefeed.geometry.smoothing_proof import deviation

FOLDER = Path(__file__).parents[1] / "tests" / "data" / "gcode"
#: Programs with short lines or with corners, as they came.
PROGRAMS = ("cncjs_tball.gcode", "cncjs_calibration.gcode", "gcodetoolpath_helical-thread-milling.nc")
TOLERANCE, PRECISION, PERIOD = 0.01, 1e-4, 1e-3
#: Along the path, mm/s, mm/s^2 and mm/s^3, besides what the axes of the router allow.
ALONG = {"feed": 100.0, "acceleration": 1500.0, "jerk": 30000.0}
#: Lines of the made-up programs, and least lines a second.
LINES, LEAST_RATE = 200_000, 50_000.0


def measure() -> Report:
    """Plan every program with look-ahead for the router, as it is, with corners kept, and rounded."""
    rows: list[tuple[Cell, ...]] = []
    for name in PROGRAMS:
        path = sf.read(FOLDER / name, repair=True)
        limits = sf.Limits(**ALONG, **sf.Table.load("router").limits(path.axes))
        for how in ("as it is", "corners kept", "corners rounded"):
            after = path
            if how != "as it is":
                after = path.smoothed(TOLERANCE, corners="keep" if how == "corners kept" else "round")
            law = sf.plan(after, limits, strategy="look-ahead", period=PERIOD)
            position = sf.interpolate(after, law, period=PERIOD).position
            jerk = np.abs(np.diff(position[:, : path.linear], 3, axis=0)).max() / PERIOD**3
            off = None if after is path else 1e3 * deviation(path, after, PRECISION).largest
            row = (Path(name).stem, how, len(after.curves), len(after.stops), law.duration, float(jerk), off)
            rows.append(row)
    columns = (
        Column("program"),
        Column("path"),
        Column("curves", ",d"),
        Column("stops", ",d"),
        Column("time, s", ".2f"),
        Column("axis jerk, mm/s^3", ",.0f"),
        Column("deviation, um", ".2f"),
    )
    programs = Table(
        f"Real programs, smoothed by {1e3 * TOLERANCE:g} um, at their own feeds on the router's limits, look-ahead.",
        columns,
        tuple(rows),
        ("Axis jerk: third differences of the setpoints at 1 ms. Deviation: bound of the two-way distance.",),
    )
    rates = {"short lines of a curve, rounded to 1 um": rate(curve()), "long lines at random": rate(walk())}
    speed = Table(
        "Lines smoothed a second, one core.", (Column("lines"), Column("a second", ",.0f")), (*rates.items(),)
    )
    least = rates["short lines of a curve, rounded to 1 um"]
    return Report(
        (programs, speed),
        (
            Headline(
                "short lines smoothed, one core", f"{least:,.0f} a second", f"{LEAST_RATE:,.0f}", least >= LEAST_RATE
            ),
        ),
    )


def curve() -> sf.Path:
    """Lines of 0.2 mm on a curve in space, as a program writes them."""
    t = np.linspace(0.0, 0.2 * LINES, LINES + 1)
    return sf.Path.polyline(
        np.round(np.c_[100 * np.cos(t / 80) + t / 50, 60 * np.sin(t / 37), 2 * np.sin(t / 9)], 3), axes=("x", "y", "z")
    )


def walk() -> sf.Path:
    """Lines of some millimetres in any direction."""
    return sf.Path.polyline(np.cumsum(np.random.default_rng(0).uniform(-8.0, 8.0, (LINES, 3)), axis=0))


def rate(path: sf.Path) -> float:
    """Lines a second, kernels compiled and the arc-length table made."""
    path.smoothed(TOLERANCE, corners="round")
    start = time.perf_counter()
    path.smoothed(TOLERANCE, corners="round")
    return len(path.curves) / (time.perf_counter() - start)
