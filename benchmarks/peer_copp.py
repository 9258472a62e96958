"""COPP (copp-py): time-optimal by a sequence of convex programs on a grid."""

from __future__ import annotations

import time

import numpy as np

import splinefeed as sf
from benchmarks.sampled import Profile, Sampled, grid

#: Programs solved on each grid, each linearised at the one before.
PASSES = 3


def plan(path: sf.Path, limits: tuple[float, float, float], nodes: tuple[int, ...]) -> Profile:
    """Solve TOPP3 on one grid after the other, each starting from the last."""
    import copp_py as copp

    feed, acceleration, jerk = limits
    length, clock = feed**2 / acceleration, feed / acceleration  # so that feed and acceleration become 1
    start, spent = None, 0.0
    for count in nodes:
        g = Sampled.of(path, grid(path, count))
        began = time.process_time()
        z, one = g.s / length, np.ones(g.r.shape[1])
        robot = copp.Robot(g.r.shape[1], capacity=count)
        robot.append_s(z)
        robot.set_q(g.r / length, g.r1, g.r2 * length, 0, dddq=g.r3 * length**2)
        robot.add_velocity_limits(one, -one, start_idx_s=0, length=count)
        robot.add_acceleration_limits(one, -one, start_idx_s=0, length=count)
        robot.constraints.add_constraint_1st(np.ones((count, 1)), 0)
        if start is None:
            ra = copp.solver.topp2_ra
            q = ra.solve(ra.Problem(robot.constraints, idx_s_interval=(0, count - 1), a_boundary=(0.0, 0.0)))
            a = None
        else:
            q, a = (np.interp(z, start[0], values) for values in start[1:])
        most = np.full(one.shape, jerk * feed / acceleration**2)
        robot.add_jerk_limits(most, -most, start_idx_s=0, length=count)
        for _ in range(PASSES):
            problem = copp.solver.topp3_socp.Problem(
                robot.constraints,
                idx_s_start=0,
                a_linearization=q,
                a_boundary=(0.0, 0.0),
                b_boundary=(0.0, 0.0),
                num_stationary_max=(1, 1),
                **({} if a is None else {"b_linearization": a}),
            )
            found = copp.solver.topp3_socp.solve(problem)
            q, a = found.a, found.b
        start = (z, q, a)
        spent += time.process_time() - began
    began = time.process_time()
    duration, times = copp.interpolation.s_to_t_topp3(z, found, 0.0)
    spent += time.process_time() - began

    def at(t: np.ndarray) -> np.ndarray:
        inside = np.minimum(t / clock, duration)
        return length * np.asarray(copp.interpolation.t_to_s_topp3_samples(z, found, times, inside))

    return Profile(clock * duration, at, spent)
