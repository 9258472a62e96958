"""Planners side by side on the same curves and limits: seconds of motion and of computing, shares of the limits."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import splinefeed as sf
from benchmarks import cases, peer_casadi, peer_copp, peer_ruckig, peer_toppra
from benchmarks.cases import BEST, SETTINGS, airfoil12
from benchmarks.sampled import Profile, shares_at_setpoints, stretched
from benchmarks.tables import Column, Headline, Report, Table

#: A plan of ours may take this many times the best known time.
ALLOWED = 1.005
#: Shares of a limit up to here are the rounding of third differences at 1 ms, not a fault.
ROUNDING = 1e-6


def measure() -> Report:
    """Duration, worst share of the axis limits at the setpoints, and seconds of computing, planner by planner."""
    paths = {"butterfly": cases.butterfly(), "airfoil12": airfoil12()}
    rows = []
    for (name, setting), best in BEST.items():
        path, limits = paths[name], SETTINGS[setting]
        for planner, call in _planners(path, limits).items():
            if profile := call():
                rows.append((name, setting, planner, *_judged(path, limits, best, profile)))
    columns = (
        Column("curve"),
        Column("limits"),
        Column("planner"),
        Column("motion, s", ".3f"),
        Column("over the best known, %", ".2f"),
        Column("feed, share", ".4f"),
        Column("acceleration, share", ".4f"),
        Column("jerk, share", ".4f"),
        Column("computing, s", ".3f"),
    )
    notes = (
        "Limits (feed = axis velocity, axis acceleration, axis jerk): A 60, 500, 20000; B 100, 2000, 50000; "
        "C 60, 50, 2000. Shares: the worst step along the path, second and third difference of an axis's "
        "setpoints over 1 ms, against feed, axis acceleration and axis jerk: above 1 the motion exceeds the "
        "limit. Computing: processor time of one warm run, without reading the curve.",
        "All but ours plan on one grid, half of its nodes even in length and half in turning. COPP, scaled to feed = "
        "acceleration = 1, makes three passes (for 4000 nodes three more, from the result of 1000). IPOPT solves the "
        "same third-order problem without convexity, started from ours: a second opinion on the optimum, not a planner "
        "for use, and left out where it finds no motion in 300 iterations. Both are then slowed as a whole until their "
        "setpoints hold the limits. TOPP-RA knows no jerk: its row shows what that asks of the drives.",
        "What they do that splinefeed does not: COPP plans for other convex objectives, "
        "TOPP-RA under any second-order constraint, CasADi for any objective; Ruckig finds a motion from "
        "any state to any state in microseconds, in a control cycle.",
    )
    caption = "The same problem by other planners: rest to rest under feed, axis velocity, acceleration and jerk, 1 ms."
    ours = [row for row in rows if row[2] == "splinefeed `time-optimal`"]
    worst = max(float(row[4]) for row in ours)
    share = max(max(float(each) for each in row[5:8]) for row in ours)
    headline = Headline(
        "`time-optimal` against the best known motion",
        f"at most {worst:.2f} % over, worst share of a limit {share:.7f}",
        f"{100.0 * (ALLOWED - 1.0):.1f} %, 1",
        worst <= 100.0 * (ALLOWED - 1.0) and share <= 1.0 + ROUNDING,
    )
    return Report((Table(caption, columns, tuple(rows), notes), peer_ruckig.table()), (headline,))


def _planners(path: sf.Path, limits: tuple[float, float, float]) -> dict[str, Callable[[], Profile | None]]:
    ours = {
        f"splinefeed `{strategy}`": partial(_ours, path, limits, strategy)
        for strategy in ("time-optimal", "look-ahead")
    }
    return {
        **ours,
        "COPP TOPP3-SOCP, 1000 nodes": partial(_held, path, limits, partial(peer_copp.plan, nodes=(1000,))),
        "COPP TOPP3-SOCP, 4000 nodes": partial(_held, path, limits, partial(peer_copp.plan, nodes=(1000, 4000))),
        "IPOPT by CasADi, 4000 nodes": partial(_held, path, limits, partial(peer_casadi.plan, nodes=4000)),
        "TOPP-RA (no jerk limit), 1000 nodes": partial(peer_toppra.plan, path, limits, 1000),
    }


def _held(path: sf.Path, limits: tuple[float, float, float], planner: Callable[..., Profile | None]) -> Profile | None:
    found = planner(path, limits)
    return None if found is None else stretched(path, limits, found, cases.PERIOD)


def _ours(path: sf.Path, limits: tuple[float, float, float], strategy: str) -> Profile:
    feed, acceleration, jerk = limits
    asked = sf.Limits(feed=feed, axis_velocity=feed, axis_acceleration=acceleration, axis_jerk=jerk)
    sf.plan(path, asked, strategy=strategy, period=cases.PERIOD)  # warm, as every row is
    start = time.process_time()
    law = sf.plan(path, asked, strategy=strategy, period=cases.PERIOD)
    return Profile(law.duration, law, time.process_time() - start)


def _judged(path: sf.Path, limits: tuple[float, float, float], best: float, profile: Profile) -> tuple[float, ...]:
    shares = shares_at_setpoints(path, profile, limits, cases.PERIOD)
    return profile.duration, 100.0 * (profile.duration / best - 1.0), *shares, profile.computing
