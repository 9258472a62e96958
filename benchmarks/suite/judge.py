"""Judge setpoints against a problem of the suite: `python judge.py PROBLEM.json SETPOINTS.csv`.

SETPOINTS.csv has one row a tick from rest to rest, one column an axis in the problem's order, and no header. Printed:
the time, s; the largest share of each limit, by differences over the period of the setpoints with rest before and
behind; the largest distance of a setpoint from the curve, in the unit of the axes.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.spatial import cKDTree

#: Samples of each knot span among which the nearest point is looked for, and Newton steps from there.
SAMPLES, STEPS = 400, 8
#: A setpoint further from the curve than this share of its size is looked at from so many samples more.
ON_CURVE, BRANCHES = 1e-10, 24


def judge(problem: dict[str, Any], r: NDArray[np.float64]) -> dict[str, float]:
    """Time, s, shares of the limits, and distance from the curve, of setpoints r (n, axes)."""
    period, limits = problem["period"], problem["limits"]
    still = np.ones((3, 1))
    both = np.concatenate([still * r[0], r, still * r[-1]])
    step = np.linalg.norm(np.diff(r, axis=0), axis=1)  # a chord: never longer than the way along the curve
    found = {"time_s": period * (len(r) - 1), "feed": float(np.max(step)) / period / limits["feed"]}
    for order, name in enumerate(("axis_velocity", "axis_acceleration", "axis_jerk"), start=1):
        found[name] = float(np.max(np.abs(np.diff(both, order, axis=0)))) / period**order / limits[name]
    found["off_curve"] = float(np.max(distances(problem, r)))
    ends = np.array([curve_at(problem["curves"][0], 0.0), curve_at(problem["curves"][-1], 1.0)])
    found["off_ends"] = float(np.max(np.linalg.norm(ends - r[[0, -1]], axis=1)))
    return found


def curve_at(curve: dict[str, Any], share: float | NDArray[np.float64], order: int = 0) -> NDArray[np.float64]:
    """Points, or derivatives by `share`, at shares (n,) of the curve's domain, 0 to 1: rational B-splines."""
    p, knots = curve["degree"], np.array(curve["knots"])
    points, weights = np.array(curve["control_points"]), np.array(curve.get("weights") or 1.0)
    weights = np.broadcast_to(weights, len(points))
    a, b = knots[p], knots[-p - 1]
    spline = BSpline(knots, np.column_stack([points * weights[:, None], weights]), p)
    u = a + np.asarray(share) * (b - a)
    (c, w), (c1, w1) = ((v[..., :-1], v[..., -1:]) for v in (spline(u), (b - a) * spline(u, 1)))
    return np.asarray(c / w if order == 0 else (c1 - c / w * w1) / w)


def distances(problem: dict[str, Any], r: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of each setpoint (n, axes) from the nearest point of any curve, (n,)."""
    curves, shares, places = problem["curves"], [], []
    for curve in curves:
        shares.append(np.linspace(0.0, 1.0, SAMPLES * (len(np.unique(curve["knots"])) - 1) + 1))
        places.append(curve_at(curve, shares[-1]))
    whole, trees = cKDTree(np.concatenate(places)), [cKDTree(each) for each in places]
    owner = np.repeat(np.arange(len(curves)), [len(each) for each in shares])
    nearest = owner[whole.query(r)[1]]
    best, size = np.full(len(r), np.inf), float(np.linalg.norm(np.ptp(whole.data, axis=0)))
    # first the curve of the nearest sample; then, where that is not it, all, and other branches of them
    for only, near in ((True, 1), (False, 1), (False, BRANCHES)):
        for i, curve in enumerate(curves):
            rows = np.flatnonzero((best > ON_CURVE * size) & (~np.array(only) | (nearest == i)))
            if not len(rows):
                continue
            u = shares[i][trees[i].query(r[rows], k=[*range(1, near + 1)])[1]].ravel()
            point = np.repeat(r[rows], near, axis=0)
            for _ in range(STEPS):  # Gauss and Newton on the squared distance
                apart, slope = curve_at(curve, u) - point, curve_at(curve, u, 1)
                along = np.sum(apart * slope, axis=1) / np.maximum(np.sum(slope**2, axis=1), 1e-300)
                u = np.clip(u - along, 0.0, 1.0)
            away = np.linalg.norm(curve_at(curve, u) - point, axis=1).reshape(-1, near).min(axis=1)
            best[rows] = np.minimum(best[rows], away)
    return best


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        given = json.load(file)
    for name, value in judge(given, np.loadtxt(sys.argv[2], delimiter=",", ndmin=2)).items():
        print(f"{name:18} {value:.9g}")
