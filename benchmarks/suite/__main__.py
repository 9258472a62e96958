"""Run planners over the problems and print one table: `python -m benchmarks.suite --help`.

`--best` writes the least time that any of them reached within the limits into the problems, with its planner's name.
Planners that are not installed are left out: COPP (copp-py), TOPP-RA (toppra), Ruckig (ruckig).
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

import splinefeed as sf
from benchmarks.sampled import Array, Profile, stretched
from benchmarks.suite.judge import judge
from benchmarks.suite.make import PROBLEMS
from benchmarks.tables import Column, Table

#: A share up to here is the rounding of third differences at 1 ms.
HELD = 1.0 + 1e-6
SHARES = ("feed", "axis_velocity", "axis_acceleration", "axis_jerk")
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
    parser.add_argument("--best", action="store_true", help="write the least times into the problems")
    parser.add_argument("--only", default="", metavar="TEXT", help="problems whose name contains this")
    parser.add_argument("--nodes", type=int, default=1000, help="grid of the peers (default 1000)")
    given = parser.parse_args()
    found: dict[tuple[str, str], list[tuple[float | None, float, float]]] = defaultdict(list)
    for file in sorted(PROBLEMS.glob(f"*{given.only}*.json")):
        problem = json.loads(file.read_text(encoding="utf-8"))
        group = next(group for group in GROUPS if file.stem.startswith(group))
        results = []
        for name, times, worst, computing in _judged(problem, given.nodes):
            print(f"{file.stem:24} {name:28} {times:9.4f} s {worst:12.7f} {computing:8.3f} s", file=sys.stderr)
            results.append((name, times, worst, computing))
        kept = [(times, name) for name, times, worst, _ in results if worst <= HELD]
        if given.best and kept and (problem["best"]["s"] is None or min(kept)[0] < problem["best"]["s"]):
            problem["best"] = dict(zip(("s", "how"), min(kept), strict=True))
            file.write_text(json.dumps(problem) + "\n", encoding="utf-8")
        least = problem["best"]["s"]
        for name, times, worst, computing in results:
            found[group, name].append((times / least if least else None, worst, computing))
    print(table(found).markdown())


def _judged(problem: dict[str, Any], nodes: int) -> Iterator[tuple[str, float, float, float]]:
    """Planner, time, s, largest share of a limit, and computing time, s, of each that applies and finds a motion."""
    path = path_of(problem)
    for name, plan in planners(problem, path, nodes).items():
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
    began = time.perf_counter()
    law = sf.plan(path, asked, strategy=strategy, period=period)
    return Profile(law.duration, law, time.perf_counter() - began)


def _ruckig(path: sf.Path, triple: tuple[float, float, float]) -> Profile:
    """One axis along the line; the limits of the axis that moves most are those along it."""
    import ruckig

    ends = path.curves[0].control_points[[0, -1]]
    most = float(np.max(np.abs(ends[1] - ends[0]))) / path.length
    feed, acceleration, jerk = triple
    asked, trajectory = ruckig.InputParameter(1), ruckig.Trajectory(1)
    asked.current_position, asked.target_position = [0.0], [path.length]
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = [feed], [acceleration / most], [jerk / most]
    began = time.perf_counter()
    ruckig.Ruckig(1).calculate(asked, trajectory)
    computing = time.perf_counter() - began

    def at(t: Array) -> Array:
        return np.array([trajectory.at_time(float(each))[0][0] for each in np.atleast_1d(t)])

    return Profile(trajectory.duration, at, computing)


def setpoints(path: sf.Path, profile: Profile, period: float) -> Array:
    """Positions at the ticks (n, axes), the end held at the last."""
    ticks = int(np.ceil(profile.duration / period - 1e-9))
    s = np.asarray(profile.at(np.minimum(np.arange(ticks + 1) * period, profile.duration)), dtype=np.float64)
    found: Array = path(np.clip(s, 0.0, path.length))
    return found


def table(found: dict[tuple[str, str], list[tuple[float | None, float, float]]]) -> Table:
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
        "Best: the least time that any planner of this table, or an earlier run of it, reached within all limits at "
        "the setpoints; each problem's file names it. Peers plan on a grid, half of its nodes even in length and half "
        "in turning, and are slowed as a whole until their setpoints hold the limits; TOPP-RA knows no jerk and is "
        "left as it is. Shares are judged by `judge.py`, which uses NumPy and SciPy alone."
    )
    return Table("The suite: planners side by side.", columns, tuple(rows), (note,))


if __name__ == "__main__":
    main()
