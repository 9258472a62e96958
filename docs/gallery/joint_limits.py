"""Which joint is the slow one? The share of each joint's limits over time."""

import numpy as np

import splinefeed as sf

joints = tuple(sf.records.Joint(f"q{k}", "rad") for k in range(1, 7))
waypoints = np.cumsum(np.random.default_rng(3).normal(size=(6, 6)), axis=0)  # rad
path = sf.Path.through(waypoints, joints)
run = sf.run(path, sf.Limits(axis_velocity=[3, 3, 3, 2, 2, 2], axis_acceleration=8, axis_jerk=100))

figure = sf.plot.limits(run)
part = run.use.time_bound_by()
assert sum(part.values()) > 0.9
