"""How a notebook shows a record: a small table, and a sparkline or the shape of a path."""

from __future__ import annotations

import html
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.records.arrays import Array

#: Width and height of a sparkline, and side of the square that a shape fits into, px.
WIDTH, HEIGHT, SQUARE = 240, 40, 120
#: Points of a shape.
DRAWN = 400
#: A sparkline keeps the least and the largest value of each of so many parts.
PARTS = 120
#: Okabe and Ito's blue, as in the report.
COLOUR = "#0072B2"


def table(rows: Mapping[str, str], picture: str = "") -> str:
    """HTML of a table of two columns, and a picture below it."""
    body = "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(text)}</td></tr>" for name, text in rows.items())
    return f"<table>{body}</table>{picture}"


def sparkline(values: ArrayLike, label: str) -> str:
    """SVG of values (n,) over their index, from zero or the least to the largest; "" without a finite value.

    Each part of the values keeps its least and its largest, so that no peak is lost.
    """
    found = np.asarray(values, dtype=np.float64)
    found = found[np.isfinite(found)]
    if not found.size:
        return ""
    parts = np.array_split(found, min(PARTS, len(found)))
    kept = np.array([end for part in parts for end in (part.min(), part.max())])
    low, high = min(float(kept.min()), 0.0), max(float(kept.max()), 0.0)
    x = np.linspace(1.0, WIDTH - 1.0, len(kept))
    y = HEIGHT - 2.0 - (HEIGHT - 4.0) * (kept - low) / ((high - low) or 1.0)
    return _svg(np.column_stack([x, y]), WIDTH, HEIGHT, label)


def shape(place: Array, label: str) -> str:
    """SVG of a line through place (n, d), mm, seen along its third axis, in one scale; "" where d < 2."""
    if place.ndim != 2 or place.shape[1] < 2 or not len(place) or not np.isfinite(place).all():
        return ""
    low, span = place[:, :2].min(axis=0), np.ptp(place[:, :2], axis=0)
    scale = (SQUARE - 4.0) / (float(span.max()) or 1.0)
    flat = 2.0 + scale * (place[:, :2] - low)
    width, height = (max(round(float(4.0 + scale * each)), 8) for each in span)
    return _svg(np.column_stack([flat[:, 0], height - flat[:, 1]]), width, height, label)


def _svg(points: Array, width: int, height: int, label: str) -> str:
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points.tolist())
    title = html.escape(label)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" role="img" aria-label="{title}">'
        f'<title>{title}</title><polyline points="{line}" fill="none" stroke="{COLOUR}" stroke-width="1.4"/></svg>'
    )
