"""Random paths to smooth: polylines, chopped arcs and curves, noise, and mixtures of lines and true arcs."""

from __future__ import annotations

import math

import numpy as np

import splinefeed as sf


def turned(rng, count, step, angle):
    """Points of a walk that turns by at most `angle`, rad, after steps of about `step`, mm."""
    heading = np.cumsum(rng.uniform(-angle, angle, count))
    lengths = step * rng.uniform(0.3, 1.7, count)
    return np.vstack([np.zeros(2), np.cumsum(lengths[:, None] * np.c_[np.cos(heading), np.sin(heading)], axis=0)])


def chopped_arc(rng, radius, sag, noise):
    """Points on an arc at uneven places, each off by at most `noise`, mm."""
    step = math.sqrt(8.0 * sag / radius)
    phi = np.concatenate([[0.0], np.cumsum(step * rng.uniform(0.2, 1.0, int(rng.integers(20, 120))))])
    points = radius * np.c_[np.sin(phi), 1.0 - np.cos(phi)]
    return points + noise * rng.uniform(-1.0, 1.0, points.shape)


def smooth_curve(rng, count):
    t = np.sort(rng.uniform(0.0, 6.0, count))
    return np.c_[8.0 * t, 5.0 * np.sin(t) + np.sin(2.3 * t)]


def random_path(seed):
    """A polyline, a chopped arc or curve, or a mixture of long and short lines and true arcs; and a tolerance, mm."""
    rng = np.random.default_rng(seed)
    tolerance = float(10.0 ** rng.uniform(-3.0, -1.0))
    kind = seed % 6
    if kind == 0:
        points = turned(rng, int(rng.integers(2, 60)), 5.0, rng.uniform(0.1, 3.0))
    elif kind == 1:
        points = chopped_arc(rng, rng.uniform(2.0, 80.0), 0.5 * tolerance, 0.2 * tolerance)
    elif kind == 2:
        points = np.round(smooth_curve(rng, int(rng.integers(50, 400))), 3)
    elif kind == 3:
        points = np.vstack([turned(rng, 12, 10.0, 1.0), chopped_arc(rng, 5.0, 0.3 * tolerance, 0.05 * tolerance)])
        points[13:] += points[12] - points[13] + [0.5, 0.2]
    elif kind == 4:
        points = turned(rng, 300, 3.0 * tolerance, 1.5)  # nothing but noise
    else:
        return mixture(rng), tolerance
    return sf.Path.polyline(points, repair=True), tolerance


def arc(start, centre, angle):
    """A circular arc as rational quadratic Bezier curves of at most a quarter turn."""
    parts = max(1, math.ceil(abs(angle) / (0.5 * math.pi)))
    half = 0.5 * angle / parts
    curves = []
    p = np.asarray(start, dtype=float)
    for _ in range(parts):
        r = p - centre
        c, s = math.cos(2 * half), math.sin(2 * half)
        q = centre + np.array([c * r[0] - s * r[1], s * r[0] + c * r[1]])
        c, s = math.cos(half), math.sin(half)
        middle = centre + np.array([c * r[0] - s * r[1], s * r[0] + c * r[1]]) / c
        curves.append(sf.NurbsCurve.bezier([p, middle, q], [1.0, c, 1.0]))
        p = q
    return curves


def mixture(rng):
    """Lines and arcs, some joined smoothly, some at corners."""
    curves, at, heading = [], np.zeros(2), 0.0
    for _ in range(int(rng.integers(3, 12))):
        if rng.random() < 0.5:
            heading += rng.choice([0.0, rng.uniform(-0.5, 0.5), rng.uniform(-2.5, 2.5)])
        direction = np.array([math.cos(heading), math.sin(heading)])
        if rng.random() < 0.5:
            to = at + rng.uniform(0.5, 30.0) * direction
            curves.append(sf.NurbsCurve(1, [0, 0, 1, 1], [at, to]))
        else:
            radius, angle = rng.uniform(0.5, 20.0), rng.uniform(0.3, 3.0) * rng.choice([-1.0, 1.0])
            centre = at + math.copysign(radius, angle) * np.array([-direction[1], direction[0]])
            curves += arc(at, centre, angle)
            heading += angle
        at = curves[-1].ends[1]
    return sf.Path(curves)


#: Radius of the arc behind each of `noises`, mm, and the tolerance by which it is smoothed, mm.
RADIUS, NOISE_TOLERANCE = 25.0, 0.01


def noises(seed):
    """Points on an arc of RADIUS as CAM systems spoil it, by name; near-collinear ones on a radius of 5 m."""
    rng = np.random.default_rng(seed)

    def on_arc(phi, radius=RADIUS):
        return radius * np.c_[np.sin(phi), 1.0 - np.cos(phi)]

    even, uneven = np.linspace(0.0, 2.0, 1200), np.cumsum(rng.uniform(0.1, 1.9, 1200)) / 600.0
    jitter = np.round(on_arc(even), 3)
    backs = np.round(on_arc(even), 4)
    at = np.arange(40, 480, 40)
    chopped = on_arc(np.concatenate([[0.0], np.cumsum(np.tile([0.02, 0.02, 0.02, 0.0007], 25))]))
    return {
        "jitter of the last digit": jitter,
        "uneven lengths": np.round(on_arc(uneven), 4),
        "duplicates": np.repeat(jitter, rng.integers(1, 4, len(jitter)), axis=0),
        "tiny reversals": np.insert(backs, at, backs[at - 1] + 0.3 * (backs[at - 2] - backs[at - 1]) * [1e-2], axis=0),
        "near-collinear": np.round(on_arc(np.linspace(0.0, 0.01, 400), 5000.0), 3),
        "arc chopped into lines": np.round(chopped, 4),
    }
