"""Write the problems of the suite as JSON: curves of our benchmarks, random splines, programs smoothed to curves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

import splinefeed as sf
from benchmarks import cases, curves
from splinefeed.paths.smoothing import smoothed

HERE = Path(__file__).parent
PROBLEMS = HERE / "problems"
DATA = Path(__file__).parents[2] / "tests" / "data" / "gcode"
#: G-code programs, from the folder of test data, whose licences stand beside them; smoothed by this tolerance, mm.
PROGRAMS = {
    "tball": "cncjs_tball.gcode",
    "calibration": "cncjs_calibration.gcode",
    "thread-milling": "gcodetoolpath_helical-thread-milling.nc",
    "one-inch-circle": "gcodetoolpath_one-inch-circle.nc",
    "mach3": "gcodepreview_mach3.gcode",
}
TOLERANCE = 0.01
#: Random splines of seven axes, numpy.random.default_rng(seed) for seeds 0 to 99: degree, control points, half width.
SEEDS, AXES, DEGREE, POINTS, WIDTH = 100, 7, 5, 12, 50.0
#: Feed, which limits each axis too, axis acceleration and axis jerk of the random splines and of the programs.
ARM, ROUTER = (100.0, 1000.0, 20000.0), (60.0, 1000.0, 30000.0)


def main() -> None:
    """Write every problem anew, with the best time that the old file knew."""
    PROBLEMS.mkdir(exist_ok=True)
    planar = {
        "butterfly": cases.butterfly(),
        "airfoil": cases.airfoil12(),
        "trident": curves.trident(),
        "star": curves.star(),
        "heart": curves.heart(),
        "slot": curves.slot(),
        "quadratic-star": curves.quadratic(),
    }
    for name, path in planar.items():
        for setting, limits in cases.SETTINGS.items():
            _write(f"{name}-{setting}", path.curves, path.axes, limits)
    for seed in range(SEEDS):
        points = np.random.default_rng(seed).uniform(-WIDTH, WIDTH, (POINTS, AXES)).round(3)
        inner = np.linspace(0.0, 1.0, POINTS - DEGREE + 1).round(12)
        knots = [0.0] * DEGREE + inner.tolist() + [1.0] * DEGREE
        names = tuple(f"j{k + 1}" for k in range(AXES))
        _write(f"random7-{seed:02d}", [sf.NurbsCurve(DEGREE, knots, points)], names, ARM)
    for name, file in PROGRAMS.items():
        path = sf.read(DATA / file, repair=True)
        _write(f"program-{name}", *_longest_stretch(smoothed(path, TOLERANCE, corners="round")), ROUTER)


def _longest_stretch(path: sf.Path) -> tuple[list[sf.NurbsCurve], tuple[str, ...]]:
    """The curves between the two neighbouring stops that are farthest apart."""
    marks = np.unique(np.concatenate([[0.0], path.stops, [path.length]]))
    longest = int(np.argmax(np.diff(marks)))
    inside = (path.curve_starts >= marks[longest] - 1e-9) & (path.curve_starts < marks[longest + 1] - 1e-9)
    return [path.curves[int(k)] for k in np.flatnonzero(inside)], path.axes


def _write(name: str, parts: Any, axes: tuple[str, ...], limits: tuple[float, float, float]) -> None:
    file = PROBLEMS / f"{name}.json"
    shape, _, setting = name.rpartition("-")
    known = cases.BEST.get(
        ({"airfoil": "airfoil12"}.get(shape, shape), setting), curves.REFERENCE.get((shape, setting))
    )
    best: dict[str, Any] = {"s": known, "how": known and "collocation in time (IPOPT) or COPP, 4000 nodes"}
    if file.exists():
        best = json.loads(file.read_text(encoding="utf-8"))["best"]
    feed, acceleration, jerk = limits
    page = {
        "name": name,
        "axes": list(axes),
        "limits": {"feed": feed, "axis_velocity": feed, "axis_acceleration": acceleration, "axis_jerk": jerk},
        "period": cases.PERIOD,
        "best": best,
        "curves": [
            {
                "degree": curve.degree,
                "knots": curve.knots.tolist(),
                "control_points": curve.control_points.tolist(),
                "weights": None if curve.weights is None else curve.weights.tolist(),
            }
            for curve in parts
        ],
    }
    file.write_text(json.dumps(page) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
