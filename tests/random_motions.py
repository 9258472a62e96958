"""Random paths and limits for the planners: every kind of curve and of limit, from a seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import motions
import sample_curves
import splinefeed as sf
from splinefeed.paths.each_curve import Marker

ROTARY = ("a", "b", "c")
HALF = np.sqrt(0.5)


@dataclass(frozen=True)
class Motion:
    """What to plan: where, under which limits, by which strategy, for which servo period, s."""

    path: sf.Path
    limits: sf.Limits
    strategy: str
    period: float


def motion(seed: int, strategies: tuple[str, ...] = ("time-optimal",)) -> Motion:
    """The motion of a seed: about a second long, over eighteen decades of size, under one to ten limits."""
    rng = np.random.default_rng(seed)
    path = random_path(rng, seed)
    strategy = str(rng.choice(strategies))
    period = float(rng.choice([1e-3, 1e-3, 5e-4, 2e-3, 4e-3]))
    limits = random_limits(rng, path, strategy)
    return Motion(dressed(rng, path, limits), limits, strategy, period)


def passing(seed: int) -> Motion:
    """The same for the time-optimal strategy, with corners that may be passed, and moving ends, more often than not."""
    rng = np.random.default_rng(seed)
    curves = (polyline, beziers, lines_and_arcs, walk)[int(rng.integers(4))](rng, seed)
    path = sf.Path(curves, ("x", "y", "z")[: curves[0].axes], tolerance=1e-6)
    given: dict[str, float] = random_limits(rng, path, "time-optimal").as_dict()
    if rng.random() < 0.8:
        given["axis_velocity_step"] = float(given["feed"] * 10 ** rng.uniform(-2, 0.3))
    if rng.random() < 0.5:
        for name in ("start_feed", "end_feed"):
            given[name] = float(given["feed"] * rng.uniform(0, 1)) if rng.random() < 0.7 else 0.0
    period = float(rng.choice([1e-3, 5e-4, 2e-3, 4e-3]))
    return Motion(path, sf.Limits.from_dict(given), "time-optimal", period)


def random_path(rng: np.random.Generator, seed: int) -> sf.Path:
    """A path of one of the kinds, at one of many sizes."""
    kind = KINDS[int(rng.integers(len(KINDS)))]
    curves = kind(rng, seed)
    axes = curves[0].axes
    scale = 10.0 ** rng.uniform(-6, 6) if rng.random() < 0.15 else 1.0
    curves = [c.transformed(scale * np.eye(axes)) for c in curves]
    rotary = int(rng.integers(1, min(axes - 1, 3) + 1)) if axes > 1 and rng.random() < 0.2 else 0
    if rotary and all(np.linalg.norm(np.ptp(c.control_points[:, : axes - rotary], axis=0)) > 0 for c in curves):
        names = ("x", "y", "z", "u", "v", "w")[: axes - rotary] + ROTARY[:rotary]
    else:
        names = ("x", "y", "z", "u", "v", "w")[:axes]
    return sf.Path(curves, names, tolerance=1e-6 * max(scale, 1.0))


def any_curve(rng: np.random.Generator, seed: int) -> list[sf.NurbsCurve]:
    return [sample_curves.random_curve(seed, far=bool(rng.random() < 0.05))]


def walk(rng: np.random.Generator, seed: int) -> list[sf.NurbsCurve]:
    """A random walk of control points."""
    degree = int(rng.integers(2, 6))
    count = degree + 1 + int(rng.integers(0, 15))
    points = np.cumsum(rng.normal(size=(count, int(rng.integers(2, 4)))), axis=0) * 10 ** rng.uniform(-1, 2)
    knots = np.r_[np.zeros(degree + 1), np.sort(rng.random(count - degree - 1)), np.ones(degree + 1)]
    weights = rng.uniform(0.3, 3, count) if rng.random() < 0.5 else None
    return [sf.NurbsCurve(degree, knots, points, weights)]


def smooth_walk(rng: np.random.Generator, seed: int) -> list[sf.NurbsCurve]:
    """The same with even knots and a step that turns slowly."""
    degree = int(rng.integers(3, 6))
    count = degree + 1 + int(rng.integers(0, 20))
    heading = np.cumsum(rng.normal(size=count) * 0.5)
    points = np.cumsum(np.column_stack([np.cos(heading), np.sin(heading)]), axis=0) * 10 ** rng.uniform(-1, 2)
    knots = np.r_[np.zeros(degree), np.linspace(0, 1, count - degree + 1), np.ones(degree)]
    return [sf.NurbsCurve(degree, knots, points)]


def polyline(rng: np.random.Generator, seed: int) -> list[sf.NurbsCurve]:
    """Lines with corners of all angles, some of them very short."""
    count = int(rng.integers(1, 8))
    turn = rng.choice([0.0, 1e-7, 1e-5, 2e-4, 0.02, 0.5, np.pi / 2, 3.0, np.pi], count) * rng.choice([-1, 1], count)
    heading = np.cumsum(turn)
    length = 10.0 ** rng.uniform(-6 if rng.random() < 0.3 else -1, 2, count)
    steps = np.column_stack([np.cos(heading), np.sin(heading)]) * length[:, None]
    points = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])
    if rng.random() < 0.3:
        return [sf.NurbsCurve(1, np.r_[0, np.arange(count + 1), count], points)]
    return [sf.NurbsCurve.bezier(points[k : k + 2]) for k in range(count)]


def lines_and_arcs(rng: np.random.Generator, seed: int) -> list[sf.NurbsCurve]:
    """Lines and quarter circles that join without a corner, or with one here and there."""
    at, ahead = np.zeros(2), np.array([1.0, 0.0])
    curves = []
    for _ in range(int(rng.integers(1, 7))):
        side = np.array([-ahead[1], ahead[0]]) * rng.choice([-1.0, 1.0])
        radius = 10.0 ** rng.uniform(-2, 2)
        if rng.random() < 0.5:
            curves.append(sf.NurbsCurve.bezier([at, at + radius * ahead]))
            at = at + radius * ahead
        else:
            end = at + radius * (ahead + side)
            curves.append(sf.NurbsCurve.bezier([at, at + radius * ahead, end], [1.0, HALF, 1.0]))
            at, ahead = end, side
        if rng.random() < 0.1:
            ahead = side
    return curves


def beziers(rng: np.random.Generator, seed: int) -> list[sf.NurbsCurve]:
    """Beziers in a row, joined at an angle, with a common tangent, or with common curvature."""
    axes, degree = int(rng.integers(2, 4)), int(rng.integers(2, 6))
    size = 10.0 ** rng.uniform(-1, 2)
    curves = []
    last = None
    for _ in range(int(rng.integers(2, 7))):
        points = np.cumsum(rng.normal(size=(degree + 1, axes)), axis=0) * size
        if last is not None:
            points += last[-1] - points[0]
            if rng.random() < 0.7:
                points[1] = points[0] + (last[-1] - last[-2]) * 10.0 ** rng.uniform(-0.5, 0.5)
                if degree > 3 and rng.random() < 0.5:
                    points[1] = 2 * last[-1] - last[-2]
                    points[2] = last[-3] + 2 * (points[1] - last[-2])
        curves.append(sf.NurbsCurve.bezier(points))
        last = points
    if rng.random() < 0.1:  # the same stretch once more, straight back over it
        curves.append(curves[-1].reversed())
    return curves


def still(rng: np.random.Generator, seed: int) -> list[sf.NurbsCurve]:
    """A curve with C' = 0 somewhere, or another that is known to be awkward."""
    known = [*sample_curves.STILL.values(), *sample_curves.KNOWN.values()]
    return [known[int(rng.integers(len(known)))]]


def cusp(rng: np.random.Generator, seed: int) -> list[sf.NurbsCurve]:
    return [sample_curves.with_cusp(float(rng.uniform(0.01, 0.99)), int(rng.integers(3, 7)), 2, seed)]


def loop(rng: np.random.Generator, seed: int) -> list[sf.NurbsCurve]:
    return [sample_curves.with_loop(float(rng.uniform(0.1, 0.9)), 10.0 ** rng.uniform(-5, -0.5))]


def shape(rng: np.random.Generator, seed: int) -> list[sf.NurbsCurve]:
    name = rng.choice(["butterfly", "circle", "ellipse", "naca"])
    if name == "butterfly":
        return list(motions.butterfly().curves)
    if name == "naca":
        return list(sf.shapes.naca(str(rng.choice(["0025", "2412", "4415"])), chord=float(rng.uniform(5, 200))).curves)
    a = 10.0 ** rng.uniform(-1, 2)
    return [sample_curves.ellipse(a, a if name == "circle" else a * 10.0 ** rng.uniform(-2, 0))]


KINDS = (any_curve, walk, walk, smooth_walk, smooth_walk, polyline, lines_and_arcs, beziers, still, cusp, loop, shape)


def random_limits(rng: np.random.Generator, path: sf.Path, strategy: str) -> sf.Limits:
    """Limits under which the path takes of the order of a second, if it has no sharp bends."""
    length = path.length
    feed = length / 10.0 ** rng.uniform(-1.3, 0.6)
    acceleration = feed / 10.0 ** rng.uniform(-2.5, 0)
    jerk = acceleration / 10.0 ** rng.uniform(-2.5, -0.3)
    given: dict[str, object] = {"feed": feed}
    along = strategy == "seven-phase" or rng.random() < 0.5
    if along:
        given |= {"acceleration": acceleration, "jerk": jerk}
        if rng.random() < 0.3:
            given |= {"deceleration": acceleration * 10.0 ** rng.uniform(-1, 1)}
        if rng.random() < 0.3:
            given |= {"deceleration_jerk": jerk * 10.0 ** rng.uniform(-1, 1)}
    if strategy == "seven-phase":
        return sf.Limits(**given)
    turns = np.array([np.ptp(path(np.linspace(0, length, 9)), axis=0)])[0]

    def per_axis(value: float, least: float = 1.0) -> object:
        if rng.random() < 0.5 and path.linear == len(path.axes):
            return float(value)
        share = np.where(np.arange(len(path.axes)) < path.linear, length, np.maximum(turns, 1e-3)) / length
        return {a: float(value * share[k] * 10.0 ** rng.uniform(-0.5, 0.5)) for k, a in enumerate(path.axes)}

    if not along or rng.random() < 0.5:
        given["axis_acceleration"] = per_axis(acceleration)
        if rng.random() < 0.8:
            given["axis_jerk"] = per_axis(jerk)
    if rng.random() < 0.4:
        given["axis_velocity"] = per_axis(feed)
    if rng.random() < 0.3:
        given["centripetal"] = float(acceleration * 10.0 ** rng.uniform(-1, 0.5))
    if rng.random() < 0.3:
        given["chord_error"] = float(length * 10.0 ** rng.uniform(-7, -4))
    return sf.Limits(**given)


def dressed(rng: np.random.Generator, path: sf.Path, limits: sf.Limits) -> sf.Path:
    """The path with what a program may say besides: a feed a curve, stops, dwells."""
    count = len(path.curves)
    feeds = None
    if rng.random() < 0.4:
        feeds = np.where(rng.random(count) < 0.2, np.inf, limits.feed * 10.0 ** rng.uniform(-1, 0.3, count))
    markers = []
    if rng.random() < 0.3:
        for _ in range(int(rng.integers(1, 3))):
            dwell = float(rng.choice([0.0, 1e-4, 0.01, 0.0123]))
            markers.append(Marker(int(rng.integers(count + 1)), "M0", dwell))
    return sf.Path(path.curves, path.axes, tolerance=path.tolerance, feeds=feeds, markers=markers)
