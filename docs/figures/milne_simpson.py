"""Draw milne_simpson.svg: the ripple of Milne-Simpson after one kick, and its |C'|^(1/3) law; and tell how it holds."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from marked import words, write

import splinefeed as sf
from splinefeed.analysis.measures import feed_ripple
from splinefeed.reports import theme
from splinefeed.reports.figure import Figure, Line, Panel, PlotAxis

put = partial(write, "math/milne-simpson.md", "milne_simpson")
FEED, PERIOD = 60.0, 1e-3
#: A planar cubic with one double knot, where the curvature jumps: the only kick on the way.
KNOTS = [0, 0, 0, 0, 0.2, 0.2, 1, 1, 1, 1]
POINTS = [[0, 0], [6, 12], [14, 4], [22, 14], [30, -30], [60, 20]]


def main() -> None:
    """Run the methods, tell the fit, and write the figure beside this script."""
    curve = sf.NurbsCurve(3, KNOTS, POINTS)
    path = sf.Path([curve])
    duration = path.length / FEED
    law = sf.TimeLaw(breaks=[0, duration], coefficients=[[0, FEED, 0, 0, 0, 0]], strategy="constant")
    above, below = [], []
    styles = (("milne-simpson", theme.BLUE), ("hamming", theme.VERMILION), ("milne-simpson-anchored", theme.GREEN))
    for name, colour in styles:
        points = sf.interpolate(path, law, period=PERIOD, method=name)
        ripple = feed_ripple(points, path, law)
        kick = int(np.searchsorted(points.u, 0.2))
        shown = slice(kick - 8, kick + 40)
        above.append(Line(1e3 * ripple.t[shown], 100 * ripple.relative[shown], name, colour, named=True))
        if name != "milne-simpson":
            continue
        error = points.u - path.locate(np.minimum(law(points.t), path.length))[1]
        # the part that changes sign at every tick: what is left when neighbours are averaged out
        alternating = np.abs(error[1:-1] - 0.5 * (error[2:] + error[:-2])) / 2
        speed = np.linalg.norm(curve.derivatives(points.u[1:-1], 1)[:, 1], axis=1)
        after = slice(kick + 30, len(alternating) - 5)
        ratio = alternating[after] / speed[after] ** (1 / 3)
        put("law", law_words(ratio, speed[after]))
        time = 1e3 * points.t[1:-1]
        size, law_of_it = 1e6 * alternating[after], 1e6 * ratio.mean() * speed[after] ** (1 / 3)
        below.append(Line(time[after], size, "alternating part of u, measured", theme.PALE, 3.0, named=True))
        below.append(Line(time[after], law_of_it, "constant · |C'|^(1/3)", theme.INK, 1.0, dash=True, named=True))
    panels = (
        Panel(PlotAxis("time after the start (ms)"), PlotAxis("feed ripple (%)"), tuple(above), height=190),
        Panel(PlotAxis("time (ms)"), PlotAxis("size (1e-6 of u)"), tuple(below), height=190),
    )
    title = "After a curvature jump: 60 mm/s, 1 ms, one correction\nit never dies: it follows |C'| to the power 1/3"
    Figure(title, panels).save(Path(__file__).with_suffix(".svg"))


def law_words(ratio: np.ndarray, speed: np.ndarray) -> str:
    """How far size / |C'|^(1/3), (n,), is from its mean after the kick, while |C'|, (n,), varies."""
    off = np.max(np.abs(ratio / ratio.mean() - 1.0))
    return words(
        f"""After the knot the measured alternating part stays within {100.0 * off:.1f} % of constant times |C'|^(1/3),
        while |C'| itself varies by a factor of {speed.max() / speed.min():.1f}."""
    )


if __name__ == "__main__":
    main()
