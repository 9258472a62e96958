"""Paths and laws that several tests share."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from importlib.resources import files

import numpy as np

from splinefeed import Limits, NurbsCurve, Path, TimeLaw
from splinefeed.planner.stream import WINDOW, LookAhead, MotionBlock


def butterfly() -> Path:
    data = json.loads(files("splinefeed").joinpath("data/butterfly.json").read_text())
    points = np.array(data["control_points"])[:, :2]
    return Path([NurbsCurve(data["degree"], data["knots"], points, data["weights"])], name="butterfly")


def smooth() -> Path:
    """One quartic Bezier: no knots, no cusps, so that nothing but a method's own order shows."""
    return Path([NurbsCurve.bezier([[0, 0], [10, 25], [35, -20], [50, 15], [70, 5]])], name="smooth")


def smooth_law(path: Path) -> TimeLaw:
    """One second with a feed that changes all the time and is never 0."""
    return TimeLaw(
        breaks=[0.0, 1.0], coefficients=np.array([[0, 0.7, 0.9, -0.8, 0.2, 0]]) * path.length, strategy="test"
    )


def constant(path: Path, feed: float) -> TimeLaw:
    """The whole path at one feed, mm/s."""
    return TimeLaw(breaks=[0.0, path.length / feed], coefficients=[[0, feed, 0, 0, 0, 0]], strategy="test")


def look_ahead(paths: Iterable[Path], limits: Limits, period: float, window: int = WINDOW) -> Iterator[MotionBlock]:
    """Blocks of motion over paths that follow each other without end."""
    planner: LookAhead | None = None
    for path in paths:
        planner = planner or LookAhead(limits, period, path.axes, window)
        yield from planner.push(path)
    if planner is not None:
        yield from planner.finish()


def vertices(path: Path) -> np.ndarray:
    """Where the curves of a path begin, and its end, (curves + 1, axes)."""
    return np.vstack([path.ends[:1, 0], path.ends[:, 1]])
