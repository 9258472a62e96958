"""A figure as SVG: text that can be searched, no library, the same figure to the byte every time."""

from __future__ import annotations

import base64
import html
import struct
import zlib

import numpy as np

from splinefeed.reports import theme
from splinefeed.reports.layout import Box, Dot, Picture, Stroke, Text, layout
from splinefeed.reports.marks import FigureData

FONT = "DejaVu Sans, Verdana, Arial, sans-serif"


def to_text(figure: FigureData) -> str:
    """The figure as the text of an SVG file."""
    sheet = layout(figure)
    clips: dict[Box, str] = {}
    body = [_element(item, clips) for item in sheet.items]
    boxes = "".join(
        f'<clipPath id="{name}"><rect x="{x:.1f}" y="{y:.1f}" width="{w:.1f}" height="{h:.1f}"/></clipPath>'
        for (x, y, w, h), name in clips.items()
    )
    title = html.escape(figure.title.replace("\n", "; "))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{sheet.width:g}" height="{sheet.height:g}" '
        f'viewBox="0 0 {sheet.width:g} {sheet.height:g}" font-family="{FONT}" role="img">\n<title>{title}</title>\n'
        f'<rect width="100%" height="100%" fill="#fff"/>\n<defs>{boxes}</defs>\n' + "\n".join(body) + "\n</svg>\n"
    )


def _element(item: Stroke | Dot | Text | Picture, clips: dict[Box, str]) -> str:
    if isinstance(item, Text):
        bold = ' font-weight="bold"' if item.bold else ""
        # paper around the letters, so that they can be read over lines
        return (
            f'<text x="{item.x:.1f}" y="{item.y:.1f}" font-size="{item.size:g}" fill="{item.colour}" '
            f'text-anchor="{item.anchor}" paint-order="stroke" stroke="#fff" stroke-width="3"'
            f"{bold}>{html.escape(item.text)}</text>"
        )
    if isinstance(item, Picture):
        x, y, w, h = item.box
        data = base64.b64encode(png(item.pixels)).decode()
        return (
            f'<image x="{x:.1f}" y="{y:.1f}" width="{w:.1f}" height="{h:.1f}" preserveAspectRatio="none" '
            f'style="image-rendering:pixelated" href="data:image/png;base64,{data}"/>'
        )
    clip = "" if item.clip is None else f' clip-path="url(#{clips.setdefault(item.clip, f"c{len(clips)}")})"'
    if isinstance(item, Dot):
        return f'<circle cx="{item.x:.1f}" cy="{item.y:.1f}" r="{0.5 * item.size:g}" fill="{item.colour}"{clip}/>'
    if item.fill:
        return f'<path d="{_path(item.points)}z" fill="{item.colour}"{clip}/>'
    lengths = " ".join(f"{each:g}" for each in theme.DASHES[item.dash])
    dash = f' stroke-dasharray="{lengths}"' if lengths else ""
    return (
        f'<path d="{_path(item.points)}" fill="none" stroke="{item.colour}" stroke-width="{item.width:g}" '
        f'stroke-linejoin="round"{dash}{clip}/>'
    )


def _path(points: np.ndarray) -> str:
    """Moves and lines through points (n, 2); a NaN begins a new line."""
    whole = np.isfinite(points).all(axis=1)
    text, pen = [], "M"
    for (x, y), there in zip(np.clip(points, -1e5, 1e5).tolist(), whole.tolist(), strict=True):
        if there:
            text.append(f"{pen}{x:.1f} {y:.1f}")
        pen = "L" if there else "M"
    return "".join(text)


def png(pixels: np.ndarray) -> bytes:
    """Pixels (rows, columns, 3), 0 to 255, as a PNG file (RFC 2083)."""
    rows, columns, _ = pixels.shape
    lines = np.zeros((rows, 1 + 3 * columns), dtype=np.uint8)  # a filter of none before each line
    lines[:, 1:] = pixels.reshape(rows, 3 * columns)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", columns, rows, 8, 2, 0, 0, 0)
    packed = zlib.compress(lines.tobytes(), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")
