"""The picture of the path in the report, as Plotly's plain data: points with what they say, coloured by one of many."""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import Any

import numpy as np

from splinefeed.analysis.thinning import cells
from splinefeed.geometry.differential import curvatures
from splinefeed.pipeline.run import Run
from splinefeed.records import Array, IntArray, Response, unit_along
from splinefeed.report import theme
from splinefeed.report.drawing import first_axis
from splinefeed.report.limits_figure import words_of
from splinefeed.report.plotly_figures import FONT, MARGIN, Figure, array

#: Points of the path at most.
POINTS = 4000
#: Height of the picture, pixels.
HEIGHT = 560
#: From where a path in space is looked at, in sizes of its box: x to the right, y away, z up.
EYE = {"x": -0.8, "y": -1.85, "z": 1.2}
#: Ends closer than this share of the picture get one label, and one this near its left or right edge has it inside.
SAME_PLACE, EDGE = 0.02, 0.25


def path(
    run: Run, response: Response | None, colour: str | None = None
) -> tuple[Figure, dict[str, dict[str, Any]], bool]:
    """The path as points with hover, what it may be coloured by, and whether it is drawn in space.

    colour  the only one wanted, where there is one of that name
    """
    points, linear = run.points, run.path.linear
    place = points.position[:, : min(linear, 3)]
    space = place.shape[1] == 3 and bool(np.ptp(place[:, 2]) > 0.0)
    values, label = first_axis(run.path, points)
    if place.shape[1] <= 1:
        place = np.column_stack([points.t, values])
    place = place if space else place[:, :2]
    quantities = _quantities(run, response)
    kept = _places(place, quantities)
    if colour in quantities:
        quantities = {colour: quantities[colour]}
    colours = {}
    for name, (values, label, top) in quantities.items():
        finite = values[np.isfinite(values)]
        high = top if top is not None else float(np.max(finite, initial=0.0)) or 1.0
        low = min(0.0, float(np.min(finite, initial=0.0)))
        colours[name] = {"values": _short(values[kept], max(high, -low)), "label": label, "low": low, "high": high}
    along = unit_along(run.path.axes)
    hover = "t = %{customdata[0]:.4f} s<br>s = %{customdata[1]:.4f} " + along + "<br>u = %{customdata[2]:.6g}"
    hover += "<br>feed = %{customdata[3]:.4f} " + along + "/s"
    names = [f"{axis} (mm)" for axis in run.path.axes[:3]] if linear > 1 else ["time (s)", label]
    letters = "xyz" if space else "xy"
    for letter, name in zip(letters, names, strict=False):
        hover += f"<br>{html.escape(name.partition(' ')[0])} = %{{{letter}:.5f}}"
    custom = np.column_stack([points.t, points.s, points.u, points.feed])[kept]
    first = next(iter(colours.values()))
    paint = {
        "color": first["values"],
        "cmin": first["low"],
        "cmax": first["high"],
        "colorscale": "Viridis",
        "colorbar": {"title": {"text": first["label"], "side": "right"}, "thickness": 14},
    }
    thin = run.thread[:, : len(letters)] if linear > 1 else place[kept]
    coordinates = {letter: array(place[kept, k]) for k, letter in enumerate(letters)}
    shared = {
        "customdata": np.round(custom, 7).tolist(),
        "hovertemplate": f"{hover}<extra></extra>",
        "showlegend": False,
    }
    data: list[Figure]
    if space:
        data = [{"type": "scatter3d", "mode": "lines", **coordinates, **shared, "line": {"width": 5, **paint}}]
    else:
        thread = {
            "type": "scatter",
            "mode": "lines",
            **{letter: array(thin[:, k], "f4") for k, letter in enumerate(letters)},
            "line": {"color": theme.FAINT, "width": 1},
            "hoverinfo": "skip",
            "showlegend": False,
        }
        data = [
            thread,
            {"type": "scatter", "mode": "markers", **coordinates, **shared, "marker": {"size": 5, **paint}},
        ]
    data.append(_ends(place, letters))
    layout: Figure = {"height": HEIGHT, "margin": MARGIN, "font": FONT, "hovermode": "closest"}
    if space:
        layout["margin"] = dict.fromkeys("lrtb", 8)
        size = np.ptp(place, axis=0) / np.max(np.ptp(place, axis=0))  # Plotly's own sizes would let flat parts overflow
        layout["scene"] = {
            "aspectmode": "manual",
            "aspectratio": dict(zip("xyz", size.tolist(), strict=True)),
            "camera": {"eye": EYE, "center": {"x": 0, "y": 0, "z": -0.12}},
            **{
                f"{letter}axis": {"title": {"text": name}, "nticks": 2 + round(7 * float(part))}
                for letter, name, part in zip("xyz", names, size, strict=True)
            },
        }
    else:
        layout["xaxis"] = {"title": {"text": names[0]}, "zeroline": False}
        layout["yaxis"] = {"title": {"text": names[1]}, "zeroline": False}
        if linear > 1:
            layout["yaxis"] |= {"scaleanchor": "x", "scaleratio": 1}
    return {"data": data, "layout": layout}, colours, space


def _quantities(run: Run, response: Response | None) -> dict[str, tuple[Array, str, float | None]]:
    """What the path may be coloured by: values at each tick, label, and the top of the scale if it is fixed."""
    points = run.points
    out: dict[str, tuple[Array, str, float | None]] = {
        "feed": (points.feed, f"feed ({unit_along(run.path.axes)}/s)", None),
    }
    if run.path.linear:
        kappa = curvatures(run.path.evaluate(points.curve, points.u, 2), run.path.linear)
        kappa = np.where(run.path.turning(points.curve, points.u), 0.0, kappa)
        kappa = np.minimum(kappa, np.quantile(kappa[np.isfinite(kappa)], 0.995))
        out["curvature"] = (kappa, "curvature (1/mm)", None)
    if response is not None and response.contour_error is not None:
        error = np.full(len(points), np.nan)
        error[: len(response)] = 1e3 * response.contour_error
        out["contour error"] = (error, "contour error (µm)", None)
    out["nearest limit"] = (100.0 * run.use.share.max(axis=1, initial=0.0), "largest share (%)", 100.0)
    for k, name in enumerate(run.use.names):
        out[f"share of {words_of(name)}"] = (100.0 * run.use.share[:, k], f"{words_of(name)} (%)", 100.0)
    return out


def _places(place: Array, quantities: Mapping[str, tuple[Array, str, float | None]]) -> IntArray:
    """Ticks that the picture of the path shows: those that are a pixel apart, and the peaks of what colours it."""
    kept = cells(place / max(float(np.max(np.ptp(place, axis=0))), 1e-300))
    kept = kept[:: -(-len(kept) // POINTS)]
    peaks = [int(np.nanargmax(values)) for values, _, _ in quantities.values() if np.isfinite(values).any()]
    return np.unique(np.concatenate([kept, peaks, [0, len(place) - 1]])).astype(np.int64)


def _ends(place: Array, letters: str) -> Figure:
    """Start and end as marks with words."""
    closed = bool(np.linalg.norm(place[-1] - place[0]) <= SAME_PLACE * float(np.max(np.ptp(place, axis=0))))
    at = place[[0]] if closed else place[[0, -1]]
    return {
        "type": "scatter3d" if len(letters) == 3 else "scatter",
        "mode": "markers+text",
        **{letter: at[:, k].tolist() for k, letter in enumerate(letters)},
        "text": ["start and end"] if closed else ["start", "end"],
        "textposition": [f"top {_inward(point[0], place[:, 0])}" for point in at],
        "showlegend": False,
        "marker": {"size": 5 if len(letters) == 3 else 9, "color": theme.FAINT, "symbol": "circle"},
        "hoverinfo": "text",
    }


def _inward(x: float, along: Array) -> str:
    """Where a word goes that must not leave the picture at its left or right edge, which a narrow screen has near."""
    width = float(np.ptp(along))
    share = (x - float(np.min(along))) / width if width > 0.0 else 0.5
    return "right" if share < EDGE else "left" if share > 1.0 - EDGE else "center"


def _short(values: Array, top: float) -> list[float | None]:
    """Values for a colour to six digits of `top`, the greatest; None for what is not finite."""
    digits = 5 - int(np.floor(np.log10(top)))
    finite = np.isfinite(values)
    rounded: list[float | None] = np.round(np.where(finite, values, 0.0), digits).tolist()
    return rounded if finite.all() else [each if is_one else None for each, is_one in zip(rounded, finite, strict=True)]
