"""The paths and limits that benchmarks run on."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

import splinefeed as sf

#: The butterfly's limits, mm/s, mm/s^2, mm/s^3, and the servo period, s, of every benchmark that plans a motion.
FAST = sf.Limits(feed=60.0, acceleration=500.0, jerk=20000.0)
PERIOD = 1e-3


@lru_cache(maxsize=1)
def butterfly() -> sf.Path:
    """The planar rational cubic of 51 control points that the literature of NURBS interpolators shares."""
    path: sf.Path = sf.shapes.butterfly()
    return path


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
