"""The paths and limits that benchmarks run on."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

import splinefeed as sf

#: The butterfly's limits, mm/s, mm/s^2, mm/s^3, and the servo period, s, of every benchmark that plans a motion.
FAST = sf.Limits(feed=60.0, acceleration=500.0, jerk=20000.0)
PERIOD = 1e-3
#: mm/s, mm/s^2, mm/s^3: feed, which limits each axis too, axis acceleration, axis jerk. C is the paper's.
SETTINGS = {"A": (60.0, 500.0, 20000.0), "B": (100.0, 2000.0, 50000.0), "C": (60.0, 50.0, 2000.0)}
#: Best known times, rest to rest, under all of them, s: collocation in time (CasADi, IPOPT) and COPP agree on them to
#: about 0.1 %.
BEST = {
    ("butterfly", "A"): 7.709,
    ("butterfly", "B"): 4.470,
    ("butterfly", "C"): 19.840,
    ("airfoil12", "A"): 1.2691,
    ("airfoil12", "B"): 0.7502,
    ("airfoil12", "C"): 3.1142,
}


@lru_cache(maxsize=1)
def butterfly() -> sf.Path:
    """The planar rational cubic of 51 control points that the literature of NURBS interpolators shares."""
    path: sf.Path = sf.shapes.butterfly()
    return path


@lru_cache(maxsize=1)
def airfoil12() -> sf.Path:
    """A closed quintic of 12 control points, clamped and uniform, 30 mm long."""
    upper = [(1, 0), (0.75, 0.06), (0.5, 0.11), (0.25, 0.15), (0.05, 0.12), (0, 0.05)]
    points = 30.0 * np.array(upper + [(x, -y) for x, y in reversed(upper)])
    knots = np.concatenate([np.zeros(6), np.linspace(0.0, 1.0, 8)[1:-1], np.ones(6)])
    return sf.Path([sf.NurbsCurve(5, knots, points)], name="airfoil12")


def axis_limits(name: str) -> sf.Limits:
    """The limits of one of SETTINGS."""
    feed, acceleration, jerk = SETTINGS[name]
    return sf.Limits(feed=feed, axis_velocity=feed, axis_acceleration=acceleration, axis_jerk=jerk)


@lru_cache(maxsize=1)
def smooth() -> sf.Path:
    """A planar rational cubic of nine spans without tight bends: 12 points around an ellipse, weights 0.7 to 1.3."""
    angle = np.linspace(0.0, 1.75 * np.pi, 12)
    points = np.column_stack([60.0 * np.cos(angle), 35.0 * np.sin(angle)])
    weights = 1.0 + 0.3 * np.sin(5.0 * angle)
    knots = [0.0] * 3 + list(np.linspace(0.0, 1.0, 10)) + [1.0] * 3
    return sf.Path([sf.NurbsCurve(3, knots, points, weights)], name="smooth cubic")


@lru_cache(maxsize=1)
def law() -> sf.TimeLaw:
    """The butterfly's motion from rest to rest under FAST."""
    return sf.plan(butterfly(), FAST, period=PERIOD)
