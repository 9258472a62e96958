"""Tool paths: the flank-milling path of a paper against the best known time, and look-ahead over a longer one."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

import splinefeed as sf
from benchmarks.tables import Column, Headline, Report, Table
from splinefeed.kinematics import kinematics
from splinefeed.records import Limits

FLANK = Path(__file__).parents[1] / "tests" / "data" / "five-axis" / "flank_milling_2022.json"
#: Best known time of the flank-milling path, s: a direct NLP of 1000, 2000 and 4000 cells, 8.0315, 8.0311 and 8.0310.
BEST_KNOWN = 8.0310
#: A plan of ours may take this many times that; look-ahead may compute for this share of the motion.
ALLOWED, SHARE = 1.005, 1.0 / 20.0
#: Limits and period, s, that the paper prints.
FEED, CHORD, PERIOD = 100.0, 0.000125, 2e-3
ROUNDS = 5


def measure() -> Report:
    """Seconds of motion and of computing, shares of the limits by differences, and how far the tip is off its curve."""
    milled = flank()
    rows: list[tuple[str | float | None, ...]] = []
    paper = limits(500.0, 3000.0, 0.4, 0.8, 0.5, 1.5, CHORD)
    for strategy in ("time-optimal", "look-ahead"):
        rows.append(("flank milling, 98 mm", *_judged(milled, paper, strategy)))
    wave = sf.kinematics.JointPath(long_path(), kinematics("xyzac-trt", z_rot_point=-30.0, tool_offset=60.0))
    for name, given in (
        ("1000 mm, the same limits", paper),
        ("1000 mm, a fast machine", limits(3000.0, 30000.0, 3.0, 3.0, 20.0, 300.0, 0.005)),
    ):
        rows.append((name, *_judged(wave, given, "look-ahead")))
    columns = (
        Column("path"),
        Column("strategy"),
        Column("motion, s", ".3f"),
        Column("over the best known, %", ".2f"),
        Column("joint velocity, share", ".4f"),
        Column("joint acceleration, share", ".4f"),
        Column("joint jerk, share", ".4f"),
        Column("tip off its curve, mm", ".0e"),
        Column("computing, s", ".2f"),
        Column("motion / computing", ".0f"),
    )
    notes = (
        "Machine: xyzac-trt with the limits of joints of the paper (H.-Y. Ma et al., J. Computational Design and "
        "Engineering 2022, table 4), 2 ms, rest to rest. Best known: a direct NLP with 4000 cells, 8.0310 s; COPP with "
        "4000 nodes 8.0400 s; without limits of jerk 7.112 s. Shares: differences of the setpoints of joints, standing "
        "still before and after. The tip comes from the setpoints by the forward kinematics. Computing: CPU time of "
        f"planning, the least of {ROUNDS}.",
    )
    caption = "Five axes under limits of velocity, acceleration and jerk of each joint, 2 ms."
    best, worst = float(rows[0][2] or 0), max(max(float(each or 0) for each in row[4:7]) for row in rows)
    share = max(float(row[8] or 0) / float(row[2] or 1) for row in rows[1:])
    headlines = (
        Headline(
            "five-axis flank milling against the best known motion",
            f"{best:.3f} s, {100.0 * (best / BEST_KNOWN - 1.0):.2f} % over, worst share of a limit {worst:.7f}",
            "at most 0.5 % over, 1",
            best <= ALLOWED * BEST_KNOWN and worst <= 1.0 + 1e-6,
        ),
        Headline(
            "`look-ahead` over 1000 mm of five-axis path: computing",
            f"1/{1.0 / share:.0f} of the motion",
            "1/20 of the motion",
            share <= SHARE,
        ),
    )
    return Report((Table(caption, columns, tuple(rows), notes),), headlines)


def limits(
    acceleration: float, jerk: float, va: float, vc: float, rotary: float, rotary_jerk: float, chord: float | None
) -> Limits:
    """Limits of joints, 100 mm/s for linear ones and the tip."""
    return Limits(
        feed=FEED,
        chord_error=chord,
        axis_velocity={**dict.fromkeys("xyz", 100.0 if jerk < 1e4 else 500.0), "a": va, "c": vc},
        axis_acceleration={**dict.fromkeys("xyz", acceleration), **dict.fromkeys("ac", rotary)},
        axis_jerk={**dict.fromkeys("xyz", jerk), **dict.fromkeys("ac", rotary_jerk)},
    )


def flank() -> sf.kinematics.JointPath:
    """The flank-milling path on a machine without offsets."""
    tool = sf.read(FLANK)
    assert isinstance(tool, sf.ToolPath)
    return sf.kinematics.JointPath(tool, kinematics("xyzac-trt"))


def long_path() -> sf.ToolPath:
    """A wave of seven turns, about 1000 mm long, with a tool that leans by 10 to 40 degrees."""
    count = 80
    knots = np.concatenate([[0.0] * 3, np.linspace(0.0, 1.0, count - 2), [1.0] * 3])
    phi, along = np.linspace(0.0, 14.0 * np.pi, count), np.linspace(0.0, 1.0, count)
    tip = np.column_stack([240.0 * along, 36.0 * np.sin(phi), 4.0 * np.cos(2.0 * phi)])
    lean, turn = np.radians(25.0 + 15.0 * np.sin(12.0 * along)), 2.5 * along + 0.3 * np.sin(phi)
    axis = np.column_stack([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)])
    return sf.ToolPath(sf.NurbsCurve(3, knots, tip), sf.NurbsCurve(3, knots, axis), kind="vectors", name="wave")


def _judged(path: sf.kinematics.JointPath, given: Limits, strategy: str) -> tuple[str | float | None, ...]:
    """Strategy, motion and time over the best known, shares, tip error, seconds of computing and their ratio."""
    seconds = []
    for _ in range(ROUNDS):
        began = time.process_time()
        law = sf.plan(path, given, period=PERIOD, strategy=strategy)
        seconds.append(time.process_time() - began)
    points = sf.interpolate(path, law)
    q = np.concatenate([points.position[:1].repeat(3, axis=0), points.position, points.position[-1:].repeat(3, axis=0)])
    shares = []
    for order, name in enumerate(("axis_velocity", "axis_acceleration", "axis_jerk"), start=1):
        seen = np.max(np.abs(np.diff(q, n=order, axis=0)), axis=0) / PERIOD**order
        shares.append(float(np.max(seen / given.of_axes(name, path.axes))))
    tip, _ = path.kinematics.forward(points.position)
    off = float(np.max(np.linalg.norm(tip - path.tool.evaluate(points.curve, points.u, 0)[:, 0], axis=1)))
    over = 100.0 * (law.duration / BEST_KNOWN - 1.0) if path.length < 100.0 else None
    least = min(seconds)
    return (strategy, law.duration, over, *shares, off, least, law.duration / least)
