"""Draw interpolators.svg, and make the numbers of docs/math/interpolators.md: orders, roots, and steps."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from marked import rows, words, write

import splinefeed as sf
from splinefeed.analysis.measures import drift
from splinefeed.reports import theme
from splinefeed.reports.figure import Figure, Level, Line, Panel, PlotAxis

put = partial(write, "math/interpolators.md", "interpolators")
#: Milne's predictor on u' = lambda u without its factor h = lambda T: (4/3) (2 r^3 - r^2 + 2 r), highest power first.
MILNE = np.array([0, 8 / 3, -4 / 3, 8 / 3, 0])
#: What one step of a one-step method multiplies an error by.
ONE_STEP = {
    "taylor-1": lambda h: 1 + h,
    "taylor-2": lambda h: 1 + h + h**2 / 2,
    "taylor-3": lambda h: 1 + h + h**2 / 2 + h**3 / 6,
    "runge-kutta-4": lambda h: 1 + h + h**2 / 2 + h**3 / 6 + h**4 / 24,
}
MULTISTEP = ("adams-bashforth-moulton", "hamming", "milne-simpson")
ORDERED = ("taylor-1", "taylor-2", "taylor-3", "runge-kutta-4", *MULTISTEP, "tsai-cheng", "runge-kutta-2-compensated")


def polynomial(name: str, h: float) -> np.ndarray:
    """Coefficients, highest first, of the polynomial whose roots say what errors do: PECE, one correction."""
    r = np.eye(5)  # r[k] is r^(4-k)
    milne = r[4] + h * MILNE
    if name == "milne-simpson":
        return r[0] - (r[2] + h / 3 * (milne + 4 * r[1] + r[2]))
    if name == "hamming":
        return r[0] - (9 * r[1] - r[3] + 3 * h * (milne + 2 * r[1] - r[2])) / 8
    adams = r[1] + h / 24 * (55 * r[1] - 59 * r[2] + 37 * r[3] - 9 * r[4])
    return r[0] - (r[1] + h / 24 * (9 * adams + 19 * r[1] - 5 * r[2] + r[3]))


def roots(name: str, h: float) -> np.ndarray:
    """The root that follows exp(h) first, then the others by size."""
    if name in ONE_STEP:
        return np.array([ONE_STEP[name](h)], dtype=complex)
    found = np.roots(polynomial(name, h))
    first = int(np.argmin(np.abs(found - np.exp(h))))
    others = np.delete(found, first)
    return np.concatenate([found[first : first + 1], others[np.argsort(-np.abs(others))]])


def limit(name: str) -> float:
    """The most negative h up to which no root is larger than 1, in steps of 0.001; 0 if there is none."""
    h = 0.0
    while np.max(np.abs(roots(name, h - 0.001))) <= 1.0 + 1e-12:
        h -= 0.001
    return h


def orders() -> dict[str, float]:
    """Observed order of each method: largest drift at 1/400 s against 1/800 s on a quartic, at a changing feed."""
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [10, 25], [35, -20], [50, 15], [70, 5]])])
    law = sf.TimeLaw(
        breaks=[0.0, 1.0], coefficients=np.array([[0, 0.7, 0.9, -0.8, 0.2, 0]]) * path.length, strategy="quartic"
    )
    found = {}
    for name in ORDERED:
        errors = [
            np.max(np.abs(drift(sf.interpolate(path, law, period=1.0 / ticks, method=name), law)))
            for ticks in (400, 800)
        ]
        found[name] = float(np.log2(errors[0] / errors[1]))
    return found


def steps() -> tuple[float, float, float]:
    """|h| on the butterfly at 60 mm/s and 1 ms: its median, its 99th percentile and its largest value."""
    path = sf.shapes.butterfly()
    curve = path.curves[0]
    law = sf.TimeLaw(breaks=[0, path.length / 60], coefficients=[[0, 60, 0, 0, 0, 0]], strategy="constant")
    points = sf.interpolate(path, law, period=1e-3)
    d = curve.derivatives(points.u, 2)
    h = 60 * 1e-3 * np.sum(d[:, 1] * d[:, 2], axis=1) / np.linalg.norm(d[:, 1], axis=1) ** 3
    return float(np.median(np.abs(h))), float(np.quantile(np.abs(h), 0.99)), float(np.max(np.abs(h)))


def told() -> dict[str, str]:
    """What the page says, by the names of its parts."""
    observed = orders()
    return {
        "orders": rows(("method", "observed order"), *((f"`{name}`", f"{observed[name]:.2f}") for name in ORDERED)),
        "limits": rows(("method", "h"), *((f"`{name}`", f"{limit(name):.2f}") for name in (*ONE_STEP, *MULTISTEP))),
        "steps": words(
            """How large is h in practice? On the butterfly at 60 mm/s and 1 ms |h| is: median {:.4f}, 99 in a hundred
            below {:.2f}, the largest {:.1f}. Almost everywhere any method will do; near its cusps none of the open-loop
            ones does.""".format(*steps())
        ),
    }


def picture() -> Figure:
    """Largest parasitic root of each multistep method over h, and the error of the true root of all methods."""
    h = np.linspace(-0.8, 0.6, 281)
    styles = {"adams-bashforth-moulton": theme.GREEN, "hamming": theme.BLUE, "milne-simpson": theme.VERMILION}
    one_step = {"taylor-1": theme.BROWN, "taylor-2": theme.PURPLE, "taylor-3": theme.FAINT, "runge-kutta-4": theme.INK}
    parasitic = [
        Line(h, np.array([abs(roots(name, x)[1]) for x in h]), name, colour, named=True)
        for name, colour in styles.items()
    ]
    true = [
        Line(h, np.array([max(abs(roots(name, x)[0] / np.exp(x) - 1), 1e-9) for x in h]), name, colour, named=True)
        for name, colour in (one_step | styles).items()
    ]
    step = PlotAxis("h = λ T")
    panels = (
        Panel(
            step, PlotAxis("largest parasitic root |r|"), (*parasitic, Level(1.0, colour=theme.FAINT, always=True)),
            "above 1 it grows from tick to tick", height=190,
        ),
        Panel(step, PlotAxis("error of the true root, |r / exp(h) - 1|", 1e-8, 1.0, log=True), tuple(true), height=190),
    )  # fmt: skip
    return Figure("What one step makes of an error, u' = λ u", panels)


if __name__ == "__main__":
    picture().save(Path(__file__).with_suffix(".svg"))
    made = told()
    put("orders", made["orders"])
    put("limits", made["limits"])
    put("steps", made["steps"])
