"""`splinefeed info`: what a file or a shape holds."""

from __future__ import annotations

import math
from typing import Any

import click

import splinefeed as sf
from splinefeed.cli import options
from splinefeed.cli.answers import Page, declared
from splinefeed.cli.output import counted, number, print_rows, print_text
from splinefeed.cli.program import print_program, program_page
from splinefeed.cli.progress import Say
from splinefeed.cli.source import read_contents
from splinefeed.cli.summary import print_notes

#: Curves and corners that the text lists; --json lists all.
MOST_LISTED = 12
#: Coordinates below this share of the largest, and radii beyond it of the length, are what rounding left of 0.
ROUNDING = 1e-12


def _print(page: Page) -> None:
    from splinefeed.records import unit_along

    print_text(f"{page['format']}, {counted(len(page['paths']), 'path')}, units of the file: {page['units']}")
    for path in page["paths"][:MOST_LISTED]:
        shape, unit = "closed" if path["closed"] else "open", unit_along(path["axes"])
        print_text(f"{path['name']}: {shape}, {number(path['length_mm'], 7)} {unit}, axes {' '.join(path['axes'])}")
        box = zip(path["axes"], path["axis_units"], path["bbox_min"], path["bbox_max"], strict=True)
        for axis, axis_unit, low, high in box:
            noise = ROUNDING * max(abs(low), abs(high))
            ends = [number(0.0 if abs(end) < noise else end, 6) for end in (low, high)]
            print_text(f"  {axis:<8}{' to '.join(ends)} {axis_unit}")
        if unit == "mm":
            print_text(f"  least radius of curvature {_radius_words(path['min_radius_mm'], path['length_mm'])}")
        jumps = counted(path["corners"] - path["stops"], "jump")
        print_text(f"  {counted(path['stops'], 'corner')} to stop at, {jumps} of curvature")
        for corner in path["corner_places"][:MOST_LISTED]:
            what = f"turns by {number(corner['angle_deg'])} deg" if corner["stop"] else "curvature jumps"
            print_text(f"    at {number(corner['s_mm'], 6)} {unit}: {what}")
        if path["gaps"]:
            print_text(f"  {counted(path['gaps'], 'gap')}, the largest {number(path['largest_gap_mm'])} {unit}")
    if "program" in page:
        print_program(page["program"])
    print_text()
    rows = []
    for i, curve in enumerate(page["curves"][:MOST_LISTED]):
        name = f"{i} (path {curve['path']})" if len(page["paths"]) > 1 else str(i)
        kind = "rational" if curve["rational"] else "polynomial"
        rows.append({**curve, "curve": name, "kind": kind, "length": number(curve["length_mm"], 7)})
    if rows:
        print_rows(rows, "curve, kind, degree, control points=control_points, spans, length", texts=2)
    if left := len(page["curves"]) + page["curves_left_out"] - len(rows):
        print_text(f"... and {left} more; --json{' --all' * bool(page['curves_left_out'])} lists all")
    print_notes(page["findings"])


@declared(_print)
@click.argument("source")
@options.reading
@click.option("--all", "every", is_flag=True, help="List every curve of a long program in --json, not the first alone.")
def command(say: Say, source: str, every: bool, **given: Any) -> Page:
    """Show what SOURCE holds: curves, length, corners, least radius, and what its reader guessed or repaired.

    Examples:
      splinefeed info butterfly
      splinefeed info part.json
      splinefeed info section.dat --chord 150mm --json
    """
    say(f"reading {source}")
    reading = options.reading_from(given)
    page, program = program_page(source, reading, every)
    if page is None:
        paths = read_contents(source, reading)
        page = {
            "paths": [_path(path) for path in paths],
            "curves": [_curve(path, i, k) for k, path in enumerate(paths, start=1) for i in range(len(path.curves))],
            "curves_left_out": 0,
            "format": paths.format,
            "units": paths.units,
            "findings": list(dict.fromkeys(finding for path in paths for finding in path.findings)),
        }
    return page if program is None else {**page, "program": program}


def _path(path: sf.Path) -> dict[str, Any]:
    """One path; lengths in mm, rotary axes and angles in degrees."""
    from splinefeed.formats.metadata import axis_units, to_degrees
    from splinefeed.geometry.path import JOIN_TOLERANCE

    low, high = path.bounding_box()
    radius = path.minimum_radius()
    return {
        "name": path.name,
        "axes": list(path.axes),
        "axis_units": axis_units(path.axes, rotary="deg"),
        "curves": len(path.curves),
        "degrees": sorted({curve.degree for curve in path.curves}),
        "length_mm": path.length,
        "bbox_min": to_degrees(low[None], path.axes)[0].tolist(),
        "bbox_max": to_degrees(high[None], path.axes)[0].tolist(),
        "closed": path.closed,
        "min_radius_mm": radius if math.isfinite(radius) else None,
        "corners": len(path.corners),
        "stops": len(path.stops),
        "corner_places": [
            {
                "s_mm": c.s,
                "angle_deg": math.degrees(c.angle),
                "curvature_jump_per_mm": c.curvature_jump if math.isfinite(c.curvature_jump) else None,
                "stop": c.stop,
            }
            for c in path.corners
        ],
        "gaps": sum(gap > JOIN_TOLERANCE for gap in path.gaps),
        "largest_gap_mm": max(path.gaps, default=0.0),
    }


def _curve(path: sf.Path, i: int, number: int) -> dict[str, Any]:
    curve = path.curves[i]
    return {
        "path": number,
        "degree": curve.degree,
        "control_points": len(curve.control_points),
        "spans": len(curve.breaks) - 1,
        "rational": curve.rational,
        "closed": curve.closed,
        "length_mm": float(path.curve_starts[i + 1] - path.curve_starts[i]),
    }


def _radius_words(radius: float | None, length: float) -> str:
    """The least radius, mm; what rounding makes of a straight line and of a cusp is called by its name."""
    if radius is None or radius * ROUNDING > length:
        return "none (straight lines)"
    return "0 mm (a cusp)" if radius < ROUNDING * length else f"{number(radius)} mm"
