"""Beside LinuxCNC's own planner: the same curve and limits, each as HAL saw it at every servo tick."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

import splinefeed as sf
from benchmarks.hal_session import hal_session
from benchmarks.linuxcnc_planner import PERIOD, mill, recorded
from benchmarks.tables import Cell, Column, Headline, Report, Table
from splinefeed.analysis.following import ContourMeter
from splinefeed.live.hal_files import HalAxis, hal_text
from splinefeed.live.linuxcnc_sink import LinuxcncSink, installed
from splinefeed.live.motion import along
from splinefeed.live.operator import Operator
from splinefeed.live.stream import play
from splinefeed.planner.override.reserve import with_reserve

Array = NDArray[np.float64]
#: Feed = axis velocity, mm/s; acceleration of each axis, mm/s^2; what G64 P allows, mm; rows kept ahead of HAL.
FEED, ACCELERATION, BLENDING, AHEAD = 60.0, 500.0, 0.01, 300
#: Jerks of each axis for ours, mm/s^3: LinuxCNC 2.9 knows none.
JERKS = (20_000.0, 200_000.0)
#: Lines of equal length that stand for the curve, and ticks of the running mean that ripple is told from.
LINES, MEAN = 4000, 25


@dataclass(frozen=True)
class Outcome:
    """What a recorded motion is like; mm, s."""

    duration: float
    ripple: float
    acceleration: float
    jerk: float
    deviation: float


@lru_cache(maxsize=1)
def curve() -> sf.Path:
    """The butterfly's control points and weights on even knots, as G5.2 of LinuxCNC takes no others."""
    given = sf.shapes.butterfly().curves[0]
    count, degree = len(given.control_points), given.degree
    inner = np.arange(1.0, count - degree)
    knots = np.concatenate([np.zeros(degree + 1), inner, np.full(degree + 1, float(count - degree))])
    return sf.Path([sf.NurbsCurve(degree, knots, given.control_points, given.weights)], name="butterfly, even knots")


def program(lines: bool) -> str:
    """The curve for LinuxCNC, as G5.2 or as short lines, under G64 P."""
    path = curve()
    spline = path.curves[0]
    if lines:
        body = [f"G1 X{x:.6f} Y{y:.6f}" for x, y in path(np.linspace(0.0, path.length, LINES + 1)[1:])]
    else:
        points = [
            f"X{x:.9f} Y{y:.9f} P{weight:.9f}"
            for (x, y), weight in zip(spline.control_points, spline.weights, strict=True)
        ]
        # the first point is where the tool is
        body = [f"G5.2 P{spline.weights[0]:.9f} L{spline.degree + 1}", *points[1:], "G5.3"]
    x, y = spline.control_points[0]
    head = ["G21 G17 G90 G94 G40 G49 G54", f"G64 P{BLENDING:g}", f"G0 X{x:.9f} Y{y:.9f} Z0", "G4 P0.2"]
    return "\n".join([*head, f"F{60.0 * FEED:g}", *body, "M2", ""])


def lines_off() -> float:
    """How far the middles of the lines are from the curve, mm."""
    ends = curve()(np.linspace(0.0, curve().length, LINES + 1))
    return ContourMeter(curve()).measure(0.5 * (ends[1:] + ends[:-1])).max


def judged(position: Array) -> Outcome:
    """The motion (n, 2) from rest to rest."""
    v, a, j = (np.diff(position, order, axis=0) / PERIOD**order for order in (1, 2, 3))
    feed = np.linalg.norm(v, axis=1)
    mean = np.convolve(feed, np.full(MEAN, 1.0 / MEAN), "valid")
    inside = feed[MEAN // 2 : MEAN // 2 + len(mean)]
    return Outcome(
        duration=(len(position) - 1) * PERIOD,
        ripple=float(np.sqrt(np.mean((inside - mean) ** 2))) / FEED,
        acceleration=float(np.max(np.abs(a))),
        jerk=float(np.max(np.abs(j))),
        deviation=ContourMeter(curve()).measure(position).max,
    )


def by_linuxcnc(lines: bool) -> Outcome:
    """LinuxCNC's planner; the way to the start is left out, and one tick at rest kept at each end."""
    found = recorded(program(lines), mill(FEED, ACCELERATION))
    return judged(found.moving(first_line=6)[:, :2])


def by_stream(jerk: float) -> Outcome:
    """Our plan, with the reserve that lets it be overridden, as HAL's streamer commanded it."""
    path = curve()
    limits = sf.Limits(feed=FEED, axis_velocity=FEED, axis_acceleration=ACCELERATION, axis_jerk=jerk)
    law = sf.plan(path, with_reserve(limits), strategy="time-optimal", period=PERIOD)
    motion = along(path, law, replace(limits, feed=2.0 * FEED))
    with hal_session(hal_text(tuple(HalAxis(name) for name in path.axes), PERIOD)) as home:
        sink = LinuxcncSink(AHEAD, record=True, home=home)
        state = play(motion, sink, Operator(), AHEAD, here=True)
        offset = sink.samples[0, 3:5] - motion.start
    assert state.done
    assert state.underruns == 0
    rows = sink.samples[:, 3:5] - offset
    moves = np.flatnonzero(np.any(np.diff(rows, axis=0) != 0.0, axis=1))
    return judged(rows[moves[0] : moves[-1] + 2])


def by_plan(jerk: float) -> Outcome:
    """Our plan without a reserve: what `run` writes."""
    limits = sf.Limits(feed=FEED, axis_velocity=FEED, axis_acceleration=ACCELERATION, axis_jerk=jerk)
    law = sf.plan(curve(), limits, strategy="time-optimal", period=PERIOD)
    return judged(sf.interpolate(curve(), law, period=PERIOD, method="arc-length").position)


def _micrometres(length: float) -> str:
    """A length in mm as people say it."""
    return f"{1e3 * length:.2g} um" if length > 1e-6 else "less than 1 nm"


def measure() -> Report:
    """Run each on LinuxCNC where it is installed; else the report has our plans alone, and says so."""
    found: dict[str, Outcome] = {}
    if installed():
        found[f"LinuxCNC, G5.2, G64 P{BLENDING:g}"] = by_linuxcnc(lines=False)
        found[f"LinuxCNC, {LINES:,} lines, G64 P{BLENDING:g}"] = by_linuxcnc(lines=True)
    for jerk in JERKS:
        if installed():
            found[f"streamed, with a reserve, jerk {jerk:,.0f}"] = by_stream(jerk)
        found[f"planned, jerk {jerk:,.0f}"] = by_plan(jerk)
    columns = (
        Column("who plans"),
        Column("time, s", ".3f"),
        Column("ripple, %", ".3f"),
        Column("axis acceleration, mm/s^2", ",.0f"),
        Column("axis jerk, mm/s^3", ",.0f"),
        Column("deviation, um", ".4f"),
    )
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (who, each.duration, 100.0 * each.ripple, each.acceleration, each.jerk, 1e3 * each.deviation)
        for who, each in found.items()
    )
    notes = (
        f"The butterfly's {len(curve().curves[0].control_points)} control points on even knots, {FEED:g} mm/s, every "
        f"axis {FEED:g} mm/s and {ACCELERATION:g} mm/s^2; LinuxCNC 2.9 has no limit of jerk. Positions that joints "
        f"were commanded to at each servo tick of {1e3 * PERIOD:g} ms, as HAL's sampler saw them (LinuxCNC and "
        f"streamed), from rest to rest. Ripple: root mean square of the feed less its mean over {MEAN} ticks, to the "
        "programmed feed; acceleration and jerk: largest second and third differences of an axis; deviation: largest "
        "distance from the curve, from which the lines themselves are off by "
        f"{1e3 * lines_off():.2g} um. A reserve is what a stream keeps to be slowed anywhere.",
    )
    table = Table("Beside LinuxCNC's own planner, on the same curve and limits.", columns, rows, notes)
    if not installed():
        return Report((replace(table, notes=(*notes, "LinuxCNC is not installed where this was measured.")),))
    peer, ours = found[f"LinuxCNC, G5.2, G64 P{BLENDING:g}"], found[f"streamed, with a reserve, jerk {JERKS[0]:,.0f}"]
    outcome = (
        f"{ours.duration:.2f} s, jerk {ours.jerk:,.0f} mm/s^3, off by {_micrometres(ours.deviation)}; "
        f"LinuxCNC's planner: {peer.duration:.2f} s, {peer.jerk:,.0f} mm/s^3, {_micrometres(peer.deviation)}"
    )
    return Report((table,), (Headline("the butterfly into LinuxCNC's HAL", outcome),))
