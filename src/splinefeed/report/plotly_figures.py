"""The figures of the report as Plotly's plain data: no more points than a screen has pixels, and every peak kept."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from splinefeed.analysis.spectrum import tracking_spectra
from splinefeed.analysis.thinning import cells, extremes
from splinefeed.geometry.differential import curvatures
from splinefeed.pipeline.run import Run
from splinefeed.records import ROTARY_AXES, Array, IntArray, Response, unit_along
from splinefeed.report import theme
from splinefeed.report.drawing import first_axis, unit_of
from splinefeed.report.limits_figure import words_of

Figure = dict[str, Any]
#: Columns of pixels of a panel over time; two points are kept in each.
COLUMNS = 1200
#: Points of the path at most, and columns of the strip of shares.
POINTS, STRIP = 4000, 800
#: Lines of a spectrum at most.
LINES = 2000
#: Height of one panel, and of the picture of the path, pixels.
PANEL, PATH = 150, 560
#: Colours of axes and of methods, in turn: Okabe and Ito's as far as white paper shows them; dress.js has the night's.
COLOURS = (theme.BLUE, theme.VERMILION, theme.GREEN, "#CC79A7", theme.OCHRE, theme.INK)
#: From where a path in space is looked at, in sizes of its box: x to the right, y away, z up.
EYE = {"x": -0.8, "y": -1.85, "z": 1.2}
#: Ends closer than this share of the picture get one label, and one this near its left or right edge has it inside.
SAME_PLACE, EDGE = 0.02, 0.25
_MARGIN = {"l": 84, "r": 24, "t": 16, "b": 52}
#: Room between panels, with the words above the lower one, and of a legend above all of them, pixels.
_GAP, _LEGEND = 34, 26
_FONT = {"size": 12.5}


def motion(run: Run) -> Figure:
    """s, feed, acceleration and jerk along the path, then velocity, acceleration and jerk of the axes, one cursor."""
    t, law, limits = run.points.t, run.law, run.limits
    along = unit_along(run.path.axes)
    kept = extremes(law.jerk(t), COLUMNS)
    shown = t[kept]
    panels: list[tuple[str, list[Figure], list[float]]] = [
        (f"s ({along})", [_line(shown, law(shown), "s", 0)], []),
        (
            f"feed ({along}/s)",
            [
                _line(
                    *_thin(t, np.minimum(run.use.top, 1.6 * float(np.max(run.points.feed)))), "maximum velocity", None
                ),
                _line(*_thin(t, run.points.feed), "feed", 0),
            ],
            [limits.feed],
        ),
        (
            f"acceleration ({along}/s²)",
            [_line(*_thin(t, law.acceleration(t)), "acceleration", 0)],
            [limits.acceleration, -_finite(limits.deceleration)],
        ),
        (
            f"jerk ({along}/s³)",
            [_line(*_thin(t, law.jerk(t)), "jerk", 0)],
            [limits.jerk, -_finite(limits.deceleration_jerk)],
        ),
    ]
    for rotary in (False, True):
        axes = [k for k in range(len(run.path.axes)) if (k >= run.path.linear) == rotary]
        for order, quantity in enumerate(("velocity", "acceleration", "jerk"), start=1):
            values = getattr(run.motion, quantity)
            unit = unit_of("deg" if rotary else "mm", order)
            factor = 180.0 / np.pi if rotary else 1.0
            lines = [_line(*_thin(t, factor * values[:, k]), f"{run.path.axes[k]} {quantity}", k) for k in axes]
            if lines:
                names = " ".join(_tinted(run.path.axes[k], k) for k in axes)
                tops = factor * limits.of_axes(f"axis_{quantity}", run.path.axes)[axes]
                panels.append((f"{names} {quantity} ({unit})", lines, [*np.unique(tops), *-np.unique(tops)]))
    return _stacked(panels)


def errors(responses: Mapping[str, Response]) -> Figure:
    """Contour error and tracking errors over time, one colour a method."""
    first = next(iter(responses.values()))
    panels: list[tuple[str, list[Figure], list[float]]] = []
    if first.contour_error is not None:
        lines = [
            _line(*_thin(each.t, 1e3 * each.contour_error), f"contour error, {name}", k)
            for k, (name, each) in enumerate(responses.items())
            if each.contour_error is not None
        ]
        panels.append(("contour error (µm)", lines, []))
    for axis in range(len(first.axes)):
        rotary = first.axes[axis] in ROTARY_AXES
        factor, unit = (180.0 / np.pi, "°") if rotary else (1e3, "µm")
        lines = [
            _line(*_thin(each.t, factor * each.tracking_error[:, axis]), f"{first.axes[axis]}, {name}", k)
            for k, (name, each) in enumerate(responses.items())
        ]
        panels.append((f"{first.axes[axis]} tracking error ({unit})", lines, []))
    for k, name in enumerate(responses):  # the colours, said once above all panels
        panels[0][1][k] |= {"showlegend": len(responses) > 1, "name": name}
    return _stacked(panels)


def spectra(response: Response) -> Figure:
    """Amplitude spectra of the tracking errors, both scales logarithmic."""
    lines = []
    for k, (axis, found) in enumerate(tracking_spectra(response).items()):
        kept = extremes(found.amplitude[1:], LINES // 2) + 1
        factor = 180.0 / np.pi if axis in ROTARY_AXES else 1e3
        unit = "°" if axis in ROTARY_AXES else "µm"
        lines.append(
            _line(found.frequency[kept], np.maximum(factor * found.amplitude[kept], 1e-12), f"{axis} ({unit})", k)
            | {"showlegend": True}
        )
    layout = {
        "height": 340,
        "margin": _MARGIN,
        "font": _FONT,
        "hovermode": "closest",
        "xaxis": {"title": {"text": "frequency (Hz)"}, "type": "log"},
        "yaxis": {"title": {"text": "amplitude"}, "type": "log", "exponentformat": "power"},
        "legend": {"orientation": "h", "y": 1.12},
    }
    for line in lines:
        del line["_peak"]
    return {"data": lines, "layout": layout}


def binding(run: Run) -> Figure:
    """The greatest share of each limit in each column of pixels, over time."""
    use = run.use
    count = len(use.t)
    size = -(-count // min(count, STRIP))
    peaks = np.pad(use.share, ((0, -count % size), (0, 0)), mode="edge").reshape(-1, size, len(use.names)).max(axis=1)
    at = use.t[np.minimum((np.arange(len(peaks)) + 0.5) * size, count - 1).astype(np.int64)]
    picture = {
        "type": "heatmap",
        "x": _array(at),
        "y": [words_of(name) for name in use.names],
        "z": np.round(100.0 * peaks.T, 1).tolist(),
        "zmin": 0,
        "zmax": 100,
        "colorscale": "Viridis",
        "colorbar": {"title": {"text": "share (%)", "side": "right"}, "thickness": 14},
        "hovertemplate": "%{y}<br>t = %{x:.4f} s<br>%{z:.1f} % of the limit<extra></extra>",
    }
    layout = {
        "height": 90 + 34 * len(use.names),
        "margin": {**_MARGIN, "l": 160},
        "font": _FONT,
        "xaxis": {"title": {"text": "time (s)"}},
        "yaxis": {"autorange": "reversed"},
    }
    return {"data": [picture], "layout": layout}


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
    coordinates = {letter: _array(place[kept, k]) for k, letter in enumerate(letters)}
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
            **{letter: _array(thin[:, k], "f4") for k, letter in enumerate(letters)},
            "line": {"color": theme.FAINT, "width": 1},
            "hoverinfo": "skip",
            "showlegend": False,
        }
        data = [
            thread,
            {"type": "scatter", "mode": "markers", **coordinates, **shared, "marker": {"size": 5, **paint}},
        ]
    data.append(_ends(place, letters))
    layout: Figure = {"height": PATH, "margin": _MARGIN, "font": _FONT, "hovermode": "closest"}
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


def _stacked(panels: Sequence[tuple[str, list[Figure], list[float]]]) -> Figure:
    """Panels one above the other over one axis of time with one cursor; limits as dashed lines where they are near."""
    count = len(panels)
    named = any(line["showlegend"] for _, lines, _ in panels for line in lines)
    margin = {**_MARGIN, "l": 66, "t": 30 + (_LEGEND if named else 0)}
    height = PANEL * count + 70
    inside = height - margin["t"] - margin["b"]
    gap = _GAP / inside
    tall = (1.0 - gap * (count - 1)) / count
    layout: Figure = {
        "height": height,
        "margin": margin,
        "font": _FONT,
        "hovermode": "x unified",
        "hoversubplots": "axis",
        "shapes": [],
        "annotations": [],
        "legend": {"orientation": "h", "x": 0, "y": 1.0 + _LEGEND / inside, "yanchor": "bottom"},
        "xaxis": {
            "title": {"text": "time (s)"},
            "anchor": f"y{count if count > 1 else ''}",
            "showspikes": True,
            "spikemode": "across",
            "spikethickness": 1,
            "spikedash": "dot",
            "ticklabeloverflow": "allow",
        },
    }
    data = []
    for k, (label, lines, limits) in enumerate(panels):
        name = "y" if k == 0 else f"y{k + 1}"
        top = 1.0 - k * (tall + gap)
        layout[name.replace("y", "yaxis")] = {
            "domain": [max(top - tall, 0.0), top],
            "exponentformat": "power",
            "nticks": 5,
            "ticklabeloverflow": "allow",  # looking whether labels fit takes as long as drawing them
        }
        words = {"text": label, "xref": "paper", "x": 0, "xanchor": "left", "yref": f"{name} domain", "y": 1}
        layout["annotations"].append({**words, "yanchor": "bottom", "showarrow": False})
        peak = max((line["_peak"] for line in lines), default=0.0)
        for line in lines:
            data.append({**{key: value for key, value in line.items() if key != "_peak"}, "xaxis": "x", "yaxis": name})
        for value in limits:
            if np.isfinite(value) and abs(value) <= 3.0 * peak:
                layout["shapes"].append(
                    {
                        "type": "line",
                        "xref": "x domain",
                        "x0": 0,
                        "x1": 1,
                        "yref": name,
                        "y0": value,
                        "y1": value,
                        "line": {"color": theme.VERMILION, "width": 1, "dash": "dash"},
                    }
                )
    return {"data": data, "layout": layout}


def _tinted(name: str, number: int) -> str:
    """A square in an axis' colour, and its name: the colours are for lines, words in them would be faint."""
    colour = COLOURS[number % len(COLOURS)]
    return f'<span style="color:{colour}">\u25a0</span>\u00a0{html.escape(theme.words(name, 12))}'


def _thin(t: Array, values: Array) -> tuple[Array, Array]:
    kept = extremes(values, COLUMNS)
    return t[kept], values[kept]


def _line(t: Array, values: Array, name: str, number: int | None) -> Figure:
    """One curve; `number` chooses its colour, None is grey."""
    colour = theme.PALE if number is None else COLOURS[number % len(COLOURS)]
    finite = values[np.isfinite(values)]
    return {
        "type": "scatter",
        "mode": "lines",
        "x": _array(t),
        "y": _array(values),
        "name": name,
        "line": {"color": colour, "width": 1.0 if number is None else 1.5},
        "showlegend": False,
        "_peak": float(np.max(np.abs(finite), initial=0.0)),
    }


def _array(values: Array, kind: str = "f8") -> dict[str, str]:
    """An array as Plotly reads it from base64."""
    return {"dtype": kind, "bdata": base64.b64encode(np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()).decode()}


def _short(values: Array, top: float) -> list[float | None]:
    """Values for a colour to six digits of `top`, the greatest; None for what is not finite."""
    digits = 5 - int(np.floor(np.log10(top)))
    finite = np.isfinite(values)
    rounded: list[float | None] = np.round(np.where(finite, values, 0.0), digits).tolist()
    return rounded if finite.all() else [each if is_one else None for each, is_one in zip(rounded, finite, strict=True)]


def _finite(value: float | None) -> float:
    return np.inf if value is None else value
