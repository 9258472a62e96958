"""Reading drawings of 20,000 entities to paths, chained, against ezdxf's and svgelements' own reading."""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.tables import Column, Headline, Report, Table
from benchmarks.timing import interleaved
from splinefeed.formats.registry import read_all

#: Groups of five entities each, in either file.
GROUPS = 4000
ROUNDS = 5
#: What was promised: the library's own read and 30 % more.
TARGET = 1.3


def measure() -> Report:
    """Seconds for both files, and what stands between us and the promise."""
    import ezdxf
    import svgelements

    rows, ratios = [], {}
    with tempfile.TemporaryDirectory(prefix="splinefeed-bench-") as folder:
        dxf, svg = Path(folder, "many.dxf"), Path(folder, "many.svg")
        write_dxf(dxf)
        write_svg(svg)
        for file, library, theirs in ((dxf, "ezdxf", ezdxf.readfile), (svg, "svgelements", svgelements.SVG.parse)):
            times = interleaved({"ours": partial(read_all, file), "theirs": partial(theirs, str(file))}, ROUNDS)
            ours, their = times["ours"].least, times["theirs"].least
            paths = read_all(file)
            ratios[library] = ours / their
            curves = sum(len(path.curves) for path in paths)
            rows.append((file.name, file.stat().st_size / 1e6, 5 * GROUPS, curves, ours, library, their, ours / their))
    columns = (
        Column("file"),
        Column("MB", ".1f"),
        Column("entities", ",d"),
        Column("curves", ",d"),
        Column("splinefeed, s", ".2f"),
        Column("library"),
        Column("library alone, s", ".2f"),
        Column("ratio", ".2f"),
    )
    caption = "Reading drawings to checked paths, against a library's own reading to its document."
    lines = tuple(
        Headline(f"a drawing of 20,000 entities read, against {name} alone", f"{ratio:.2f} times", "1.3 times",
                 ratio <= TARGET)
        for name, ratio in ratios.items()
    )  # fmt: skip
    return Report((Table(caption, columns, tuple(rows)),), lines)


def write_dxf(file: Path) -> None:
    """Lines, arcs, circles, polylines with a bulge and splines of 8 control points, apart from each other."""
    import ezdxf

    random = np.random.default_rng(1)
    document = ezdxf.new("R2000")
    document.units = 4
    space = document.modelspace()
    for x, y in random.uniform(0.0, 1000.0, (GROUPS, 2)).tolist():
        space.add_line((x, y), (x + 5.0, y + 3.0))
        space.add_arc((x, y), 3.0, 10.0, 200.0)
        space.add_circle((x, y), 4.0)
        space.add_lwpolyline([(x, y), (x + 3, y), (x + 3, y + 4, 0, 0, 0.5), (x, y + 4)], close=True)
        space.add_open_spline(random.uniform(0.0, 10.0, (8, 3)), degree=3)
    document.saveas(file)


def write_svg(file: Path) -> None:
    """Paths of cubics and lines, paths of arcs and quadratics, circles, round rectangles and turned polylines."""
    random = np.random.default_rng(2)
    out = ['<svg xmlns="http://www.w3.org/2000/svg" width="1000mm" height="1000mm" viewBox="0 0 1000 1000">']
    for x, y in random.uniform(0.0, 990.0, (GROUPS, 2)).round(4).tolist():
        out += [
            f'<path d="M{x} {y}c1 2 3 4 5 5s2 1 3 -2l4 4 2 -3z"/>',
            f'<path d="M{x} {y}A3 4 10 0 1 {x + 5} {y + 1}q1 1 2 0t3 3"/>',
            f'<circle cx="{x}" cy="{y}" r="3"/><rect x="{x}" y="{y}" width="4" height="3" rx="1"/>',
            f'<polyline points="{x},{y} {x + 1},{y + 3} {x + 2},{y - 1}" transform="rotate(10)"/>',
        ]
    file.write_text("\n".join([*out, "</svg>"]), encoding="utf-8")
