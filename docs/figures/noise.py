"""Draw docs/figures/noise.svg: curvature of lines with the noises of CAM systems, and of what becomes of them."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import splinefeed as sf
from splinefeed.geometry.differential import curvatures
from splinefeed.report.files import save_figure

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))

from smoothing_paths import NOISE_TOLERANCE, RADIUS, noises  # the same points as in the tests


def main() -> None:
    """One panel a noise: angle of each joint over the length beside it, and the curvature of the result, times R."""
    figure, panels = plt.subplots(3, 2, figsize=(8.0, 6.6), layout="constrained")
    for axes, (name, points) in zip(panels.ravel(), noises(0).items(), strict=True):
        radius = 5000.0 if name == "near-collinear" else RADIUS
        path = sf.Path.polyline(points, repair=True)
        result = path.smoothed(NOISE_TOLERANCE)
        steps = path.ends[:, 1] - path.ends[:, 0]
        length = np.linalg.norm(steps, axis=1)
        unit = steps / length[:, None]
        apart, along = (np.linalg.norm(unit[1:] + way * unit[:-1], axis=1) for way in (-1.0, 1.0))
        lines = radius * 2.0 * np.arctan2(apart, along) / (0.5 * (length[1:] + length[:-1]))
        s = np.linspace(0.0, result.length, 20_001)
        bend = radius * curvatures(result.evaluate(*result.locate(s), 2))
        axes.plot(path.curve_starts[1:-1:3], np.maximum(lines[::3], 1e-2), ".", color="tab:red", markersize=2)
        axes.plot(s[::50], bend[::50], color="tab:blue", linewidth=1.2)
        axes.set_yscale("log")
        axes.set_ylim(5e-2, 1e4)
        axes.set_title(f"{name}: up to {lines.max():.3g}, then {bend.min():.3f} to {bend.max():.3f}", fontsize=8)
        axes.grid(alpha=0.3)
        print(f"{name}: {len(path.curves)} lines, curvature up to {lines.max():.3g} / R; "
              f"{len(result.curves)} curves, {bend.min():.4f} / R to {bend.max():.4f} / R")  # fmt: skip
    for axes in panels[:, 0]:
        axes.set_ylabel("curvature times radius")
    for axes in panels[-1]:
        axes.set_xlabel("arc length, mm")
    save_figure(figure, Path(__file__).with_suffix(".svg"))


if __name__ == "__main__":
    main()
