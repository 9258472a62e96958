"""Draw docs/figures/noise.svg: curvature of lines with the noises of CAM systems, and of what becomes of them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import splinefeed as sf
from splinefeed.curves.differential import curvatures
from splinefeed.paths.smoothing import smoothed
from splinefeed.reports import theme
from splinefeed.reports.figure import Dots, Figure, Line, Panel, PlotAxis

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))

from smoothing_paths import NOISE_TOLERANCE, RADIUS, noises  # the same points as in the tests


def main() -> None:
    """One panel a noise: angle of each joint over the length beside it, and the curvature of the result, times R."""
    panels = []
    for name, points in noises(0).items():
        radius = 5000.0 if name == "near-collinear" else RADIUS
        path = sf.Path.polyline(points, repair=True)
        result = smoothed(path, NOISE_TOLERANCE)
        steps = path.ends[:, 1] - path.ends[:, 0]
        length = np.linalg.norm(steps, axis=1)
        unit = steps / length[:, None]
        apart, along = (np.linalg.norm(unit[1:] + way * unit[:-1], axis=1) for way in (-1.0, 1.0))
        lines = radius * 2.0 * np.arctan2(apart, along) / (0.5 * (length[1:] + length[:-1]))
        s = np.linspace(0.0, result.length, 20_001)
        bend = radius * curvatures(result.evaluate(*result.locate(s), 2))
        joints = path.curve_starts[1:-1:3]
        dots = Dots(joints, np.maximum(lines[::3], 1e-2), colour=theme.VERMILION, size=2.0)
        note = f"up to {lines.max():.3g}, then {bend.min():.3f} to {bend.max():.3f}"
        y = PlotAxis(name, 5e-2, 1e4, log=True)
        panels.append(Panel(PlotAxis("arc length (mm)"), y, (dots, Line(s[::50], bend[::50])), note, height=140))
        print(f"{name}: {len(path.curves)} lines, curvature up to {lines.max():.3g} / R; "
              f"{len(result.curves)} curves, {bend.min():.4f} / R to {bend.max():.4f} / R")  # fmt: skip
    title = "Curvature times radius: lines with the noises of CAM systems (dots), and the curves made of them"
    Figure(title, tuple(panels), columns=2, width=860).save(Path(__file__).with_suffix(".svg"))


if __name__ == "__main__":
    main()
