"""A figure as Plotly's plain data, for the pages of the report and the studio; Plotly itself is not imported."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from splinefeed.records import Array
from splinefeed.reports import theme
from splinefeed.reports.detail import FEW, DetailStore
from splinefeed.reports.figure import Coloured, Dots, Figure, Heat, Level, Line, Panel, PlotAxis, Shades

Plain = dict[str, Any]
MARGIN = {"l": 84, "r": 24, "t": 16, "b": 52}
FONT = {"size": 12.5}
CURSOR = {"showspikes": True, "spikemode": "across", "spikethickness": 1, "spikedash": "dot"}
#: Room between panels, with the words above the lower one and with an x axis between them; of a legend, pixels.
_GAP, _FOOT, _LEGEND = 34, 76, 26
#: Share of an axis at its ends where the word of a point does not fit above it.
BESIDE = 0.3
#: Height of the words of a limit, pixels; where along its line they may stand, the first where there is room; and the
#: share of a panel's height beyond the outermost limit.
LABEL, PLACES, HEADROOM = 14.0, ("end", "middle", "start"), 0.06
#: Room left of a heat map for each letter of the names of its rows, pixels.
LETTER = 6.6


def to_plain(figure: Figure, store: DetailStore | None = None) -> Plain:
    """Make data and layout of a figure, as `Plotly.react` takes them; of a path, what path.js takes.

    Parameters
    ----------
    figure : Figure
        To be drawn on a page.
    store : DetailStore, optional
        Of the points of long curves; without one the figure has its own, as `store`.

    Returns
    -------
    dict
        For JSON. zoom.js puts in what is seen of long curves.
    """
    first = figure.panels[0]
    coloured = first.of(Coloured)
    own = DetailStore() if store is None else store
    plain = _path(first, coloured[0], own) if coloured else _stacked(figure, own)
    if store is None and own.series:
        plain["store"] = {"series": own.series, "data": own.text()}
    return plain


def _stacked(figure: Figure, store: DetailStore) -> Plain:
    """Panels one above the other; those over the same quantity have one axis and one cursor."""
    panels = figure.panels
    names = {mark.name for panel in panels for _, mark in panel.legend()}
    legend = figure.legend and len(names) > 1 and len(panels) > 1  # one panel has its names beside its label
    last = {panel.x.label: k for k, panel in enumerate(panels)}
    across = {label: str(k + 1) if k else "" for k, label in enumerate(last)}
    gaps = [_FOOT if last[panel.x.label] == k else _GAP for k, panel in enumerate(panels)]
    inside = sum(panel.height for panel in panels) + sum(gaps[:-1])
    rows = max((len(row) for panel in panels for heat in panel.of(Heat) for row in heat.rows), default=0)
    margin = {**MARGIN, "l": max(LETTER * rows + 16, 66), "t": 30 + (_LEGEND if legend else 0)}
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
                trace = _line(mark, store) if isinstance(mark, Line) else _dots(mark, panel.x)
                if isinstance(mark, Line) and not mark.fill:
                    trace["hovertemplate"] = _hover(panel)
                data.append({**trace, **group, "showlegend": shown, **axes})
        if levels := panel.levels():
            low, high = _extent(panel, levels)
            room = HEADROOM * (high - low)
            layout[f"yaxis{y}"] |= {} if panel.y.log else {"autorangeoptions": {"include": [low - room, high + room]}}
            layout["shapes"] += _levels(levels, (high - low) * LABEL / panel.height, axes)
    return {"data": data, "layout": layout}


def _hover(panel: Panel) -> str:
    """What the mouse shows of a curve: both values to three digits, with their units."""
    x, y = (
        label.rpartition("(")[2].partition(")")[0] if "(" in label else "" for label in (panel.x.label, panel.y.label)
    )
    return f"%{{y:.3~g}} {html.escape(y)}<br>at %{{x:.3~g}} {html.escape(x)}<extra>%{{fullData.name}}</extra>"


def _axis(axis: PlotAxis) -> Plain:
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
        sample = theme.DASH_SAMPLES[mark.dash] if isinstance(mark, Line) and not mark.fill else "\u25a0"
        words.append(f'<span style="color:{mark.colour}">{sample}</span>\u00a0{html.escape(name)}')
    return "  ".join(words)


def _line(mark: Line, store: DetailStore) -> Plain:
    line = {"color": mark.colour, "width": 0 if mark.fill else mark.width, "dash": theme.DASH_NAMES[mark.dash]}
    filled = {"fill": "toself", "hoverinfo": "name"} if mark.fill else {}
    if len(mark.x) > FEW and mark.rising:
        through = {"type": "scatter", "detail": store.curve(mark.x, mark.y, mark.high)}
    else:
        through = _through(mark.x, mark.y)
    return {**through, "mode": "lines", "name": mark.name, "line": line, **filled}


def _dots(mark: Dots, axis: PlotAxis) -> Plain:
    """Points with a word each, on the side where the axis has room for it, or with words that show under the mouse."""
    worded: Plain = {"mode": "markers"}
    if mark.words:
        x, ends = mark.x, np.array([axis.low or 0.0, axis.high or 0.0])
        if axis.log:
            x, ends = np.log(np.maximum(x, 1e-300)), np.log(np.maximum(ends, 1e-300))
        share = (x - ends[0]) / (ends[1] - ends[0]) if ends[1] > ends[0] else np.full(len(x), 0.5)
        sides = ["right" if each < BESIDE else "left" if each > 1.0 - BESIDE else "center" for each in share.tolist()]
        places = [f"top {side}" for side in sides]
        worded = {"mode": "markers+text", "text": list(mark.words), "textposition": places, "hoverinfo": "text"}
    elif mark.hover:
        worded |= {"text": [html.escape(each) for each in mark.hover]}
    return {
        **_through(mark.x, mark.y),
        "name": mark.name,
        "marker": {"size": mark.size, "color": mark.colour},
        **worded,
    }


def _through(x: Array, y: Array) -> Plain:
    """A trace through x, y (n,)."""
    return {"type": "scatter", "x": array(x), "y": array(y)}


def _extent(panel: Panel, levels: Sequence[Level]) -> tuple[float, float]:
    """The least and the greatest of curves and levels of a panel."""
    values = np.concatenate([[each.value for each in levels if not each.upright], *(m.values for m in panel.of(Line))])
    values = values[np.isfinite(values)]
    return (float(np.min(values)), float(np.max(values))) if len(values) else (0.0, 1.0)


def _levels(levels: Sequence[Level], apart: float, axes: Mapping[str, str]) -> list[Plain]:
    """Levels whose words stand where no others are within `apart`, the outermost at the end of their lines."""
    taken: list[tuple[str, float]] = []
    found = []
    for level in sorted(levels, key=lambda each: -abs(each.value)):
        free = (place for place in PLACES if all(p != place or abs(y - level.value) >= apart for p, y in taken))
        place = next(free, PLACES[0])
        if level.text and not level.upright:
            taken.append((place, level.value))
        found.append(_level(level, axes, place))
    return found


def _level(level: Level, axes: Mapping[str, str], place: str) -> Plain:
    across, along = ("x", "y") if level.upright else ("y", "x")
    where = {f"{across}ref": axes[f"{across}axis"], f"{across}0": level.value, f"{across}1": level.value}
    whole = {f"{along}ref": f"{axes[f'{along}axis']} domain", f"{along}0": 0, f"{along}1": 1}
    label = {} if not level.text or level.upright else {
        "label": {
            "text": html.escape(level.text), "textposition": place, "yanchor": "top" if level.value > 0.0 else "bottom",
            "padding": 1, "font": {"size": 11, "color": theme.WORDS.get(level.colour, level.colour)},
        }
    }  # fmt: skip
    return {"type": "line", **whole, **where, **label, "line": {"color": level.colour, "width": 1, "dash": "dash"}}


def _heat(heat: Heat, store: DetailStore) -> Plain:
    tall, band = 26 * len(heat.rows), len(heat.x) > len(heat.share)
    shares = np.ascontiguousarray(np.round(100.0 * heat.share, 1).T)
    return {
        "type": "heatmap",
        "detail": {"strips": [store.curve(heat.x, each, each if band else None) for each in shares]},
        "y": list(heat.rows),
        "zmin": 0,
        "zmax": 100,
        "colorscale": "Viridis",
        "colorbar": {
            "title": {"text": "share (%)", "side": "right"}, "thickness": 14,
            "lenmode": "pixels", "len": max(tall, 120), "y": 0, "yanchor": "bottom",
        },
        "hovertemplate": "%{y}<br>t = %{x:.3f} s<br>%{z:.3~g} % of the limit<extra></extra>",
    }  # fmt: skip


def _path(panel: Panel, mark: Coloured, store: DetailStore) -> Plain:
    """A path as path.js draws it.

    Its data are `points`, what `said` each of them is, with `names`, and `thread`, where the path runs; `rapid` moves,
    which are dashed; the `arm` at some times; the `track`, where the tool is when; `stops`, places that are marked;
    `colours`, values with label and ends of the scale.
    """
    labels = [each for each in (panel.x.label, panel.y.label, panel.z) if each]
    dots = [dict(zip("xyz", (each.x.tolist(), each.y.tolist()), strict=False)) for each in panel.of(Dots) if each.named]
    plain: Plain = {
        "points": _columns(mark.place),
        "said": np.round(mark.hover, 7).tolist(),
        "names": list(mark.names),
        "thread": None if mark.joined and not np.isnan(mark.thread).any() else _columns(mark.thread, "f4"),
        "joined": mark.joined,
        "rapid": None if mark.rapid is None else _columns(mark.rapid, "f4"),
        "labels": labels,
        "space": len(labels) == 3,
        "equal": panel.equal,
        "stops": dots,
        "colours": {
            name: {"values": _rounded(each), "label": each.label, "low": each.low, "high": each.high}
            for name, each in mark.shades.items()
        },
    }
    if mark.arm is not None:
        t, poses = mark.arm
        plain["arm"] = {"t": array(t, "f4"), "points": poses.shape[1], **_columns(poses.reshape(-1, 3), "f4")}
    if mark.track is not None:
        t, place, rapid = mark.track
        columns = [store.curve(t, column) for column in place.T]
        plain["track"] = {"t": columns[0]["x"], **{name: each["y"] for name, each in zip("xyz", columns, strict=False)}}
        if rapid.any():
            plain["track"]["rapid"] = store.curve(t, rapid)["y"]
    return plain


def _columns(place: Array, kind: str = "f8") -> dict[str, dict[str, str]]:
    return {name: array(column, kind) for name, column in zip("xyz", place.T, strict=False)}


def _rounded(shades: Shades) -> list[float | None]:
    """Values to six digits of the greatest; None for what is not finite."""
    digits = 5 - int(np.floor(np.log10(max(abs(shades.high), abs(shades.low)))))
    finite = np.isfinite(shades.values)
    rounded = np.round(np.where(finite, shades.values, 0.0), digits).tolist()
    return [each if there else None for each, there in zip(rounded, finite.tolist(), strict=True)]


def array(values: Array, kind: str = "f8") -> dict[str, str]:
    """Encode an array as Plotly reads it.

    Parameters
    ----------
    values : array (n,)
        To be encoded.
    kind : str, optional
        Of its numbers, such as f8 or f4.

    Returns
    -------
    dict of str to str
        The kind, and the bytes in base64.
    """
    return {"dtype": kind, "bdata": base64.b64encode(np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()).decode()}
