"""Run planners over the problems and print one table: `python -m benchmarks.suite --help`.

`--best` runs `time-optimal` on finer cells, too, and writes the least time that any of them reached within the limits
into the problems, with its planner's name.
Planners that are not installed are left out: COPP (copp-py), TOPP-RA (toppra), Ruckig (ruckig).
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

import splinefeed as sf
from benchmarks.sampled import Array, Profile, stretched
from benchmarks.suite.judge import judge
from benchmarks.suite.make import PROBLEMS
from benchmarks.tables import Column, Headline, Report, Table
from splinefeed.planner.strategies import MODES, TIME_OPTIMAL, plan_in_mode

#: A share up to here is the rounding of third differences at 1 ms.
HELD = 1.0 + 1e-6
#: Share by which our times may be over the best known ones.
ALLOWED = 0.005
SHARES = ("feed", "axis_velocity", "axis_acceleration", "axis_jerk")
#: What was found of the problems of a group by a planner: time over the best one, worst share, computing time, s.
Found = dict[tuple[str, str], list[tuple[float | None, float, float]]]
#: Grid of the peers.
NODES = 1000
#: How `--best` has ours look for a better time.
FINER = {
    "cells half as long": {"cell": 0.1, "tolerance": 5e-5},
    "cells a quarter as long": {"cell": 0.05, "tolerance": 2e-5},
}
#: Problems of a name that begins so stand in one row.
GROUPS = {
    "butterfly": "butterfly, 3 sets of limits",
    "airfoil": "airfoil, 3 sets",
    "trident": "trident, 3 sets",
    "star": "star, 3 sets",
    "heart": "heart, 3 sets",
    "slot": "slot (curvature jumps), 3 sets",
    "quadratic-star": "quadratic star (curvature jumps), 3 sets",
    "random7": "100 random splines, 7 axes",
    "program": "5 programs, smoothed",
}


def main() -> None:
    """Plan, judge, print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.suite", description=__doc__)
    parser.add_argument("--best", action="store_true", help="look for better times, and write them into the problems")
    parser.add_argument("--only", default="", metavar="TEXT", help="problems whose name contains this")
    parser.add_argument("--nodes", type=int, default=NODES, help=f"grid of the peers (default {NODES})")
    given = parser.parse_args()
    print(compared(given.only, given.nodes, best=given.best).markdown())


def compared(only: str = "", nodes: int = NODES, *, best: bool = False) -> Table:
    """The table of all problems whose name contains `only`; with `best` better times are kept in their files."""
    found: Found = defaultdict(list)
    for file in sorted(each for each in PROBLEMS.glob("*.json") if only in each.stem):
        problem = json.loads(file.read_text(encoding="utf-8"))
        path, group = path_of(problem), next(group for group in GROUPS if file.stem.startswith(group))
        each = planners(problem, path, nodes)
        results = list(_judged(problem, path, each))
        if best:
            finer = {f"{TIME_OPTIMAL}, {how}": partial(_finer, problem, path, how) for how in FINER}
            better = [*results, *_judged(problem, path, finer)]
            held = [(times, name) for name, times, worst, _ in better if worst <= HELD]
            times, name = min(held, default=(math.inf, ""))
            if times < (problem["best"]["s"] or math.inf):
                problem["best"] = {"s": round(times, 9), "how": name}
                file.write_text(json.dumps(problem) + "\n", encoding="utf-8")
        for name, times, worst, computing in results:
            print(f"{file.stem:24} {name:28} {times:9.4f} s {worst:12.7f} {computing:8.3f} s", file=sys.stderr)
            least = problem["best"]["s"]
            found[group, name].append((times / least if least else None, worst, computing))
    return table(found)


def _judged(
    problem: dict[str, Any], path: sf.Path, plans: dict[str, Callable[[], Profile]]
) -> Iterator[tuple[str, float, float, float]]:
    """Planner, time, s, largest share of a limit, and computing time, s, of each that finds a motion."""
    for name, plan in plans.items():
        try:
            profile = plan()
        except Exception as error:
            print(f"{problem['name']}: {name}: {type(error).__name__}: {error}", file=sys.stderr)
            continue
        verdict = judge(problem, setpoints(path, profile, problem["period"]))
        if max(verdict["off_curve"], verdict["off_ends"]) > 1e-6 * path.size:
            print(f"{problem['name']}: {name}: {verdict['off_curve']:.3g} off the curve", file=sys.stderr)
            continue
        yield name, profile.duration, max(verdict[share] for share in SHARES), profile.computing


def path_of(problem: dict[str, Any]) -> sf.Path:
    """The curves of a problem as a path."""
    curves = [
        sf.NurbsCurve(each["degree"], each["knots"], each["control_points"], each["weights"])
        for each in problem["curves"]
    ]
    return sf.Path(curves, axes=tuple(problem["axes"]), name=problem["name"])


def planners(problem: dict[str, Any], path: sf.Path, nodes: int) -> dict[str, Callable[[], Profile]]:
    """What plans the problem."""
    limits, period = problem["limits"], problem["period"]
    triple = (limits["feed"], limits["axis_acceleration"], limits["axis_jerk"])
    out = {
        f"splinefeed `{name}`": partial(_ours, path, limits, period, name) for name in ("time-optimal", "look-ahead")
    }
    if find_spec("copp_py"):
        from benchmarks import peer_copp

        out[f"COPP, {nodes} nodes"] = lambda: stretched(path, triple, peer_copp.plan(path, triple, (nodes,)), period)
    if find_spec("toppra"):
        from benchmarks import peer_toppra

        out["TOPP-RA (no jerk limit)"] = partial(peer_toppra.plan, path, triple, nodes)
    if find_spec("ruckig") and len(path.curves) == 1 and path.curves[0].degree == 1:
        out["Ruckig (straight lines)"] = partial(_ruckig, path, triple)
    return out


def _ours(path: sf.Path, limits: dict[str, float], period: float, strategy: str) -> Profile:
    asked = sf.Limits(**limits)
    sf.plan(path, asked, strategy=strategy, period=period)  # warm, as every row is
    began = time.process_time()
    law = sf.plan(path, asked, strategy=strategy, period=period)
    return Profile(law.duration, law, time.process_time() - began)


def _finer(problem: dict[str, Any], path: sf.Path, how: str) -> Profile:
    """Ours on finer cells, closer to their optimum."""
    MODES[how] = replace(MODES[TIME_OPTIMAL], **FINER[how])
    law = plan_in_mode(path, sf.Limits(**problem["limits"]), problem["period"], strategy=how)
    return Profile(law.duration, law, 0.0)


def _ruckig(path: sf.Path, triple: tuple[float, float, float]) -> Profile:
    """One axis along the line; the limits of the axis that moves most are those along it."""
    import ruckig

    ends = path.curves[0].control_points[[0, -1]]
    most = float(np.max(np.abs(ends[1] - ends[0]))) / path.length
    feed, acceleration, jerk = triple
    asked, trajectory = ruckig.InputParameter(1), ruckig.Trajectory(1)
    asked.current_position, asked.target_position = [0.0], [path.length]
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = [feed], [acceleration / most], [jerk / most]
    began = time.process_time()
    ruckig.Ruckig(1).calculate(asked, trajectory)
    computing = time.process_time() - began

    def at(t: Array) -> Array:
        return np.array([trajectory.at_time(float(each))[0][0] for each in np.atleast_1d(t)])

    return Profile(trajectory.duration, at, computing)


def setpoints(path: sf.Path, profile: Profile, period: float) -> Array:
    """Positions at the ticks (n, axes), the end held at the last."""
    ticks = int(np.ceil(profile.duration / period - 1e-9))
    s = np.asarray(profile.at(np.minimum(np.arange(ticks + 1) * period, profile.duration)), dtype=np.float64)
    found: Array = path(np.clip(s, 0.0, path.length))
    return found


def table(found: Found) -> Table:
    """A row for each group and planner."""
    rows = []
    for (group, planner), each in found.items():
        ratios = sorted(ratio for ratio, _, _ in each if ratio is not None)
        middle = ratios[len(ratios) // 2] if ratios else None
        shares, computing = [share for _, share, _ in each], sorted(took for _, _, took in each)
        rows.append((
            GROUPS[group], planner, len(each), middle, ratios[-1] if ratios else None, max(shares),
            computing[len(computing) // 2], computing[-1],
        ))  # fmt: skip
    columns = (
        Column("problems"),
        Column("planner"),
        Column("solved"),
        Column("T / best, median", ".4f"),
        Column("T / best, worst", ".4f"),
        Column("worst share of a limit", ".7f"),
        Column("computing, s, median", ".3f"),
        Column("computing, s, worst", ".3f"),
    )
    note = (
        "Best: the least time that is known within all limits at the setpoints; each problem's file says who found it: "
        "collocation in time by IPOPT, COPP on 4000 nodes, or `time-optimal` on cells a half or a quarter as long, "
        "which `--best` runs beside the table. Computing: processor time of a warm run. Peers plan on a grid, half of "
        "its nodes even in length and half in turning, and are slowed as a whole until their setpoints hold the "
        "limits; TOPP-RA knows no jerk and is left as it is. Shares are judged by `judge.py`, which uses NumPy and "
        "SciPy alone."
    )
    return Table("The suite: planners side by side.", columns, tuple(rows), (note,))


def measure() -> Report:
    """All problems by all planners that are installed."""
    found = compared()
    ours = [dict(zip([column.title for column in found.columns], row, strict=True)) for row in found.rows]
    ours = [row for row in ours if row["planner"] == f"splinefeed `{TIME_OPTIMAL}`"]
    over = max(float(row["T / best, worst"] or 0.0) for row in ours) - 1.0
    share = max(float(row["worst share of a limit"] or 0.0) for row in ours)
    solved = sum(int(row["solved"] or 0) for row in ours)
    headline = Headline(
        f"`{TIME_OPTIMAL}` on the {solved} problems of the suite against the best known times",
        f"at most {100.0 * over:.2f} % over, worst share of a limit {share:.7f}",
        f"{100.0 * ALLOWED:g} %, 1",
        over <= ALLOWED and share <= HELD,
    )
    return Report((found,), (headline,))


if __name__ == "__main__":
    main()
