"""A figure as Plotly's plain data, for the pages of the report and the studio; Plotly itself is not imported."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping
from typing import Any

import numpy as np

from splinefeed.records import Array
from splinefeed.report import theme
from splinefeed.report.detail import FEW, Store
from splinefeed.report.figure import Axis, Coloured, Dots, Figure, Heat, Level, Line, Panel, Shades

Plain = dict[str, Any]
#: How wide and how high a path in space is at most, in units of Plotly's scene, so that it stays in view as it turns;
#: ticks along an axis, a unit; and how flat a scene may be, as a share of its longest side.
WIDE, HIGH, TICKS, FLAT = 1.6, 1.15, 5.0, 0.02
MARGIN = {"l": 84, "r": 24, "t": 16, "b": 52}
FONT = {"size": 12.5}
CURSOR = {"showspikes": True, "spikemode": "across", "spikethickness": 1, "spikedash": "dot"}
#: Room between panels, with the words above the lower one and with an x axis between them; of a legend, pixels.
_GAP, _FOOT, _LEGEND = 34, 76, 26
#: Height of the picture of a path, and the room left of a heat map for the names of its rows, pixels.
PATH_HEIGHT, ROWS = 560, 160
#: Ends this near the left or right edge of a picture, share of it, have their word inside.
EDGE = 0.25


def to_plain(figure: Figure, store: Store | None = None) -> Plain:
    """Data and layout of the figure, as `Plotly.react` takes them once zoom.js has put in what is seen of long curves.

    store  of the points of long curves, the figure's own where none is given: its `store` holds that then
    Of a path also `colours`, what it may be coloured by (values, label, ends of the scale), and whether it is in space.
    """
    first = figure.panels[0]
    coloured = first.of(Coloured)
    if coloured:
        return _path(first, coloured[0])
    own = Store() if store is None else store
    plain = _stacked(figure, own)
    if store is None and own.series:
        plain["store"] = {"series": own.series, "data": own.text()}
    return plain


def _stacked(figure: Figure, store: Store) -> Plain:
    """Panels one above the other; those over the same quantity have one axis and one cursor."""
    panels = figure.panels
    names = {mark.name for panel in panels for _, mark in panel.legend()}
    legend = figure.legend and len(names) > 1
    heats = any(panel.of(Heat) for panel in panels)
    last = {panel.x.label: k for k, panel in enumerate(panels)}
    across = {label: str(k + 1) if k else "" for k, label in enumerate(last)}
    gaps = [_FOOT if last[panel.x.label] == k else _GAP for k, panel in enumerate(panels)]
    inside = sum(panel.height for panel in panels) + sum(gaps[:-1])
    margin = {**MARGIN, "l": ROWS if heats else 66, "t": 30 + (_LEGEND if legend else 0)}
    alike = len(across) == 1 and not panels[0].x.log and not any(panel.of(Heat | Dots) for panel in panels)
    layout: Plain = {
        "height": inside + margin["t"] + margin["b"],
        "margin": margin,
        "font": FONT,
        "hovermode": "x unified" if alike else "closest",
        "hoversubplots": "axis",
        "shapes": [],
        "annotations": [],
        "legend": {"orientation": "h", "x": 0, "y": 1.0 + _LEGEND / inside, "yanchor": "bottom"},
    }
    data: list[Plain] = []
    top = float(inside)
    for k, panel in enumerate(panels):
        x, y = across[panel.x.label], str(k + 1) if k else ""
        axes = {"xaxis": f"x{x}", "yaxis": f"y{y}"}
        low = top - panel.height
        layout[f"yaxis{y}"] = {**_axis(panel.y), "domain": [max(low / inside, 0.0), top / inside], "anchor": f"x{x}"}
        top = low - gaps[k]
        if last[panel.x.label] == k:
            title = {"title": {"text": panel.x.label}, "anchor": f"y{y}"}
            layout[f"xaxis{x}"] = {**_axis(panel.x), **title, **(CURSOR if alike else {})}
        layout["annotations"].append(
            {
                "text": _heading(panel, legend), "xref": "paper", "x": 0, "xanchor": "left", "yref": f"y{y} domain",
                "y": 1, "yanchor": "bottom", "showarrow": False,
            }
        )  # fmt: skip
        for mark in panel.marks:
            if isinstance(mark, Heat):
                data.append({**_heat(mark, store), **axes})
                layout[f"yaxis{y}"] |= {"autorange": "reversed", "nticks": 0, "dtick": 1}
            elif isinstance(mark, Line | Dots):
                shown = legend and bool(mark.named) and mark.name in names
                names.discard(mark.name)
                group = {"legendgroup": mark.name} if legend and mark.named else {}
                trace = _line(mark, store) if isinstance(mark, Line) else _dots(mark)
                data.append({**trace, **group, "showlegend": shown, **axes})
        layout["shapes"] += [_level(level, axes) for level in panel.levels()]
    return {"data": data, "layout": layout}


def _axis(axis: Axis) -> Plain:
    out: Plain = {"exponentformat": "power", "ticklabeloverflow": "allow"}  # looking whether labels fit takes long
    out |= {"type": "log"} if axis.log else {"nticks": 5 if axis.label != "time (s)" else 12}
    if axis.low is not None and axis.high is not None:
        ends = (axis.low, axis.high)
        out["range"] = [float(np.log10(each)) if axis.log else each for each in ends]
    elif axis.low == 0.0:
        out["rangemode"] = "tozero"
    return out


def _heading(panel: Panel, legend: bool) -> str:
    words = [] if panel.of(Heat) else [html.escape(panel.y.label)]
    for name, mark in [] if legend else panel.legend():
        words.append(f'<span style="color:{mark.colour}">\u25a0</span>\u00a0{html.escape(name)}')
    return "  ".join(words)


def _line(mark: Line, store: Store) -> Plain:
    line = {"color": mark.colour, "width": 0 if mark.fill else mark.width, "dash": "dash" if mark.dash else "solid"}
    filled = {"fill": "toself", "hoverinfo": "name"} if mark.fill else {}
    if len(mark.x) > FEW and mark.rising:
        through = {"type": "scatter", "detail": store.curve(mark.x, mark.y, mark.stretch)}
    else:
        through = _through(mark.x, mark.y)
    return {**through, "mode": "lines", "name": mark.name, "line": line, **filled}


def _dots(mark: Dots, along: Array | None = None) -> Plain:
    """Points, with a word each that stays inside the picture, whose x is `along`; other words show under the mouse."""
    worded: Plain = {"mode": "markers"}
    if mark.words:
        where = [f"top {'center' if along is None else _inward(x, along)}" for x in mark.x.tolist()]
        worded = {"mode": "markers+text", "text": list(mark.words), "textposition": where, "hoverinfo": "text"}
    elif mark.hover:
        worded |= {"text": [html.escape(each) for each in mark.hover]}
    marker = {"size": mark.size * (0.5 if mark.z else 1.0), "color": mark.colour}  # in space a point is twice as wide
    return {**_through(mark.x, mark.y, *mark.z), "name": mark.name, "marker": marker, **worded}


def _through(*place: Array, kind: str = "f8") -> Plain:
    """A trace through x, y and in space z, (n,) each."""
    columns = {letter: array(each, kind) for letter, each in zip("xyz", place, strict=False)}
    return {"type": "scatter3d" if len(place) == 3 else "scatter", **columns}


def _level(level: Level, axes: Mapping[str, str]) -> Plain:
    across, along = ("x", "y") if level.upright else ("y", "x")
    place = {f"{across}ref": axes[f"{across}axis"], f"{across}0": level.value, f"{across}1": level.value}
    whole = {f"{along}ref": f"{axes[f'{along}axis']} domain", f"{along}0": 0, f"{along}1": 1}
    return {"type": "line", **whole, **place, "line": {"color": level.colour, "width": 1, "dash": "dash"}}


def _heat(heat: Heat, store: Store) -> Plain:
    tall = 26 * len(heat.rows)
    shares = np.ascontiguousarray(np.round(100.0 * heat.share, 1).T)
    return {
        "type": "heatmap",
        "detail": {"strips": [store.curve(heat.x, each, heat.stretch) for each in shares]},
        "y": list(heat.rows),
        "zmin": 0,
        "zmax": 100,
        "colorscale": "Viridis",
        "colorbar": {
            "title": {"text": "share (%)", "side": "right"}, "thickness": 14,
            "lenmode": "pixels", "len": max(tall, 120), "y": 0, "yanchor": "bottom",
        },
        "hovertemplate": "%{y}<br>t = %{x:.4f} s<br>%{z:.1f} % of the limit<extra></extra>",
    }  # fmt: skip


def _path(panel: Panel, mark: Coloured) -> Plain:
    labels = [each for each in (panel.x.label, panel.y.label, panel.z) if each]
    space, shades = len(labels) == 3, next(iter(mark.shades.values()))
    paint = {
        "color": _rounded(shades),
        "cmin": shades.low,
        "cmax": shades.high,
        "colorscale": "Viridis",
        "colorbar": {"title": {"text": shades.label, "side": "right"}, "thickness": 14},
    }
    hover = [_hover_text(name, f"customdata[{k}]") for k, name in enumerate(mark.names)]
    for letter, label in zip("xyz", labels, strict=False):
        hover.append(f"{html.escape(label.partition(' ')[0])} = %{{{letter}:.5f}}")
    points = {
        **_through(*mark.place.T),
        "customdata": np.round(mark.hover, 7).tolist(),
        "hovertemplate": f"{'<br>'.join(hover)}<extra></extra>",
        **({"mode": "lines", "line": {"width": 5, **paint}} if space else {}),
        **({} if space else {"mode": "markers", "marker": {"size": 5, **paint}}),
    }
    line = {"color": theme.FAINT, "width": 2 if space else 1}
    thread = {**_through(*mark.thread.T, kind="f4"), "mode": "lines", "line": line, "hoverinfo": "skip"}
    data = [points, *(_dots(dots, mark.place[:, 0]) for dots in panel.of(Dots))]
    if not space or np.isnan(mark.thread).any():  # NaN: the tool axis beside the path
        data.insert(0, thread)
    if mark.rapid is not None:
        dashed = {**line, "width": 2, "dash": "dash"}
        data.append({**_through(*mark.rapid.T, kind="f4"), "mode": "lines", "line": dashed, "hoverinfo": "skip"})
    layout: Plain = {"height": PATH_HEIGHT, "margin": MARGIN, "font": FONT, "hovermode": "closest", "showlegend": False}
    if space:
        layout |= {"margin": dict.fromkeys("lrtb", 8), "scene": _scene(mark, labels)}
    else:
        for name, label in zip(("xaxis", "yaxis"), labels, strict=True):
            layout[name] = {"title": {"text": label}, "zeroline": False}
        if panel.equal:
            layout["yaxis"] |= {"scaleanchor": "x", "scaleratio": 1}
    colours = {
        name: {"values": _rounded(each), "label": each.label, "low": each.low, "high": each.high}
        for name, each in mark.shades.items()
    }
    return {"data": data, "layout": layout, "colours": colours, "space": space}


def _scene(mark: Coloured, labels: list[str]) -> Plain:
    """Axes of a path in space in true proportion, and from where it is seen."""
    both = np.concatenate([mark.place, mark.thread])
    size = np.nanmax(both, axis=0) - np.nanmin(both, axis=0)
    size = np.maximum(size, FLAT * np.max(size))  # a side of no length has no scale
    size = (size * min(WIDE / np.hypot(size[0], size[1]), HIGH / size[2])).tolist()
    axes = {
        f"{letter}axis": {"title": {"text": label}, "nticks": 2 + round(TICKS * part)}
        for letter, label, part in zip("xyz", labels, size, strict=True)
    }
    camera = {"eye": dict(zip("xyz", theme.EYE, strict=True)), "center": {"x": 0, "y": 0, "z": -0.12}}
    return {"aspectmode": "manual", "aspectratio": dict(zip("xyz", size, strict=True)), "camera": camera, **axes}


def _hover_text(name: str, place: str) -> str:
    """A line of the words at a point: name, value to its digits, unit."""
    word, _, unit = name.partition(" ")
    digits = ".6g" if not unit else ".4f"
    return f"{html.escape(word)} = %{{{place}:{digits}}}{' ' + html.escape(unit.strip('()')) if unit else ''}"


def _inward(x: float, along: Array) -> str:
    """Where a word goes that must not leave the picture at its left or right edge, which a narrow screen has near."""
    width = float(np.ptp(along))
    share = (x - float(np.min(along))) / width if width > 0.0 else 0.5
    return "right" if share < EDGE else "left" if share > 1.0 - EDGE else "center"


def _rounded(shades: Shades) -> list[float | None]:
    """Values to six digits of the greatest; None for what is not finite."""
    digits = 5 - int(np.floor(np.log10(max(abs(shades.high), abs(shades.low)))))
    finite = np.isfinite(shades.values)
    rounded = np.round(np.where(finite, shades.values, 0.0), digits).tolist()
    return [each if there else None for each, there in zip(rounded, finite.tolist(), strict=True)]


def array(values: Array, kind: str = "f8") -> dict[str, str]:
    """An array as Plotly reads it from base64."""
    return {"dtype": kind, "bdata": base64.b64encode(np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()).decode()}
