"""Draw docs/figures/smoothing.svg: curvature of a real program before and after, and print its numbers."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import splinefeed as sf
from splinefeed.geometry.differential import curvatures
from splinefeed.report.files import save_figure

PROGRAM = Path(__file__).parents[2] / "tests" / "data" / "gcode" / "cncjs_tball.gcode"
TOLERANCE = 0.01
#: The part of the program that is drawn, mm.
FROM, TO = 1195.0, 1235.0


def main() -> None:
    """Curvature of the lines, as their angle over their mean length, and of the curves that take their place."""
    path = sf.read(PROGRAM)
    result = path.smoothed(TOLERANCE)
    at, turn = turns(path)
    s = np.linspace(0.0, result.length, 400_001)
    curve, u = result.locate(s)
    bend = curvatures(result.evaluate(curve, u, 2), result.linear)
    window = (at > FROM) & (at < TO)
    inside = (s > FROM) & (s < TO)
    print(f"{len(path.curves)} curves, {len(path.stops)} stops; then {len(result.curves)} and {len(result.stops)}")
    print(f"drawn: up to {turn[window].max():.4g} 1/mm before, {bend[inside].max():.4g} 1/mm after")
    figure, axes = plt.subplots(2, 1, figsize=(8.0, 4.8), sharex=True, layout="constrained")
    axes[0].vlines(at[window], 0.0, turn[window], color="tab:red", linewidth=0.8)
    axes[0].set_title(f"{PROGRAM.stem}: its lines, angle of each joint over the mean length beside it", fontsize=10)
    axes[1].plot(s[inside], bend[inside], color="tab:blue", linewidth=1.2)
    axes[1].set_title(f"smoothed by {1e3 * TOLERANCE:g} um", fontsize=10)
    axes[1].set_xlabel("arc length, mm")
    for each in axes:
        each.set_ylabel("curvature, 1/mm")
        each.set_ylim(bottom=0.0)
        each.grid(alpha=0.3)
    save_figure(figure, Path(__file__).with_suffix(".svg"))


def turns(path: sf.Path) -> tuple[np.ndarray, np.ndarray]:
    """Arc length of each joint of lines, mm, and its angle over the mean length beside it, 1/mm."""
    steps = (path.ends[:, 1] - path.ends[:, 0])[:, : path.linear]
    length = np.linalg.norm(steps, axis=1)
    unit = steps / length[:, None]
    angle = 2.0 * np.arctan2(np.linalg.norm(unit[1:] - unit[:-1], axis=1), np.linalg.norm(unit[1:] + unit[:-1], axis=1))
    return path.curve_starts[1:-1], angle / (0.5 * (length[1:] + length[:-1]))


if __name__ == "__main__":
    main()
