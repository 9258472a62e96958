"""Draw docs/figures/smoothing.svg: curvature of a real program before and after, and print its numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import splinefeed as sf
from splinefeed.curves.differential import curvatures
from splinefeed.paths.smoothing import smoothed
from splinefeed.reports import theme
from splinefeed.reports.figure import Figure, Line, Panel, PlotAxis

PROGRAM = Path(__file__).parents[2] / "tests" / "data" / "gcode" / "cncjs_tball.gcode"
TOLERANCE = 0.01
#: The part of the program that is drawn, mm.
FROM, TO = 1195.0, 1235.0


def main() -> None:
    """Curvature of the lines, as their angle over their mean length, and of the curves that take their place."""
    path = sf.read(PROGRAM)
    result = smoothed(path, TOLERANCE)
    at, turn = turns(path)
    s = np.linspace(0.0, result.length, 400_001)
    curve, u = result.locate(s)
    bend = curvatures(result.evaluate(curve, u, 2), result.linear)
    window = (at > FROM) & (at < TO)
    inside = (s > FROM) & (s < TO)
    print(f"{len(path.curves)} curves, {len(path.stops)} stops; then {len(result.curves)} and {len(result.stops)}")
    print(f"drawn: up to {turn[window].max():.4g} 1/mm before, {bend[inside].max():.4g} 1/mm after")
    joints, height = at[window], turn[window]
    stems = np.column_stack([0.0 * height, height, np.nan * height]).ravel()
    before = Line(np.repeat(joints, 3), stems, f"{PROGRAM.stem}: its lines, angle of each joint over the mean length "
                  "beside it", theme.VERMILION, 1.0, named=True)  # fmt: skip
    after = Line(s[inside], bend[inside], f"smoothed by {1e3 * TOLERANCE:g} µm", named=True)
    along, curvature = PlotAxis("arc length (mm)"), PlotAxis("curvature (1/mm)", low=0.0)
    panels = tuple(Panel(along, curvature, (line,)) for line in (before, after))
    Figure("Curvature of a program before and after smoothing", panels).save(Path(__file__).with_suffix(".svg"))


def turns(path: sf.Path) -> tuple[np.ndarray, np.ndarray]:
    """Arc length of each joint of lines, mm, and its angle over the mean length beside it, 1/mm."""
    steps = (path.ends[:, 1] - path.ends[:, 0])[:, : path.linear]
    length = np.linalg.norm(steps, axis=1)
    unit = steps / length[:, None]
    angle = 2.0 * np.arctan2(np.linalg.norm(unit[1:] - unit[:-1], axis=1), np.linalg.norm(unit[1:] + unit[:-1], axis=1))
    return path.curve_starts[1:-1], angle / (0.5 * (length[1:] + length[:-1]))


if __name__ == "__main__":
    main()
