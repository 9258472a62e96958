"""TOPP-RA (toppra): time-optimal under velocity and acceleration, by reachability analysis; it knows no jerk."""

from __future__ import annotations

import logging
import time

import numpy as np

import splinefeed as sf
from benchmarks.sampled import Profile, Sampled, grid


def plan(path: sf.Path, limits: tuple[float, float, float], nodes: int) -> Profile:
    """Reachability analysis on the common grid; s(t) of constant acceleration in each cell."""
    import toppra
    from toppra import algorithm, constraint

    logging.getLogger("toppra").setLevel(logging.ERROR)
    feed, acceleration, _ = limits
    g = Sampled.of(path, grid(path, nodes))
    axes = g.r.shape[1]

    class Geometry(toppra.interpolator.AbstractGeometricPath):
        """The path's exact derivatives, as TOPP-RA asks for them; a column of s holds the feed limit on the path."""

        dof = axes + 1
        path_interval = np.array([0.0, g.s[-1]])
        waypoints = None

        def __call__(self, s: np.ndarray, order: int = 0) -> np.ndarray:
            values = by_order(np.atleast_1d(s))[order]
            along = [np.atleast_1d(s), np.ones(len(values)), np.zeros(len(values))][order]
            both = np.column_stack([values, along])
            return both if np.ndim(s) else both[0]

    def by_order(s: np.ndarray) -> tuple[np.ndarray, ...]:
        at = Sampled.of(path, np.clip(s, 0.0, path.length))
        return at.r, at.r1, at.r2

    bounds = np.column_stack([-np.ones(axes + 1), np.ones(axes + 1)])
    free = bounds.copy()
    free[-1] *= np.inf
    free[-1] = [-1e9, 1e9]
    start = time.process_time()
    instance = algorithm.TOPPRA(
        [
            constraint.JointVelocityConstraint(feed * bounds),
            constraint.JointAccelerationConstraint(
                np.where(np.abs(free) > 1.0, free, acceleration * free),
                discretization_scheme=constraint.DiscretizationType.Interpolation,
            ),
        ],
        Geometry(),
        gridpoints=g.s,
        solver_wrapper="seidel",
    )
    _, v, _ = instance.compute_parameterization(0.0, 0.0)
    spent = time.process_time() - start
    times = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(g.s) / (v[1:] + v[:-1]))])

    def at(t: np.ndarray) -> np.ndarray:
        cell = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
        since, span = t - times[cell], times[cell + 1] - times[cell]
        return g.s[cell] + v[cell] * since + 0.5 * (v[cell + 1] - v[cell]) / span * since**2

    return Profile(float(times[-1]), at, spent)
