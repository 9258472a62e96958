"""Figures of the report over time and frequency as Plotly's plain data: few points, and every peak kept."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from splinefeed.analysis.spectrum import tracking_spectra
from splinefeed.analysis.thinning import extremes
from splinefeed.pipeline.run import Run
from splinefeed.records import ROTARY_AXES, Array, Response, unit_along
from splinefeed.report import theme
from splinefeed.report.drawing import unit_of
from splinefeed.report.limits_figure import words_of

Figure = dict[str, Any]
#: Columns of pixels of a panel over time; two points are kept in each.
COLUMNS = 1200
#: Columns of the strip of shares.
STRIP = 800
#: Lines of a spectrum at most.
LINES = 2000
#: Height of one panel, pixels.
PANEL = 150
#: Colours of axes and of methods, in turn: Okabe and Ito's as far as white paper shows them; dress.js has the night's.
COLOURS = (theme.BLUE, theme.VERMILION, theme.GREEN, "#CC79A7", theme.OCHRE, theme.INK)
MARGIN = {"l": 84, "r": 24, "t": 16, "b": 52}
#: Room between panels, with the words above the lower one, and of a legend above all of them, pixels.
_GAP, _LEGEND = 34, 26
FONT = {"size": 12.5}


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
        "margin": MARGIN,
        "font": FONT,
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
        "x": array(at),
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
        "margin": {**MARGIN, "l": 160},
        "font": FONT,
        "xaxis": {"title": {"text": "time (s)"}},
        "yaxis": {"autorange": "reversed"},
    }
    return {"data": [picture], "layout": layout}


def _stacked(panels: Sequence[tuple[str, list[Figure], list[float]]]) -> Figure:
    """Panels one above the other over one axis of time with one cursor; limits as dashed lines where they are near."""
    count = len(panels)
    named = any(line["showlegend"] for _, lines, _ in panels for line in lines)
    margin = {**MARGIN, "l": 66, "t": 30 + (_LEGEND if named else 0)}
    height = PANEL * count + 70
    inside = height - margin["t"] - margin["b"]
    gap = _GAP / inside
    tall = (1.0 - gap * (count - 1)) / count
    layout: Figure = {
        "height": height,
        "margin": margin,
        "font": FONT,
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
        "x": array(t),
        "y": array(values),
        "name": name,
        "line": {"color": colour, "width": 1.0 if number is None else 1.5},
        "showlegend": False,
        "_peak": float(np.max(np.abs(finite), initial=0.0)),
    }


def array(values: Array, kind: str = "f8") -> dict[str, str]:
    """An array as Plotly reads it from base64."""
    return {"dtype": kind, "bdata": base64.b64encode(np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()).decode()}


def _finite(value: float | None) -> float:
    return np.inf if value is None else value
