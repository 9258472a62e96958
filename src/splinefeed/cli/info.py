"""`splinefeed info`: what a file or a shape holds."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Mapping
from typing import Any

import splinefeed as sf
from splinefeed.cli import options
from splinefeed.cli.answers import answers
from splinefeed.cli.output import Block, Page, Say, counted, listed, notes, number
from splinefeed.cli.source import read_contents

#: Curves and corners that the text lists; --json lists all.
MOST_LISTED = 12
#: Coordinates below this share of the largest, and radii beyond it of the length, are what rounding left of 0.
ROUNDING = 1e-12
#: Programs with at most this many moves are made into a path; of longer ones as many curves are listed.
FEW = 5_000


def _show(page: Page) -> list[Block]:
    several = len(page["paths"]) > 1
    head = f"{page['format']}, {counted(len(page['paths']), 'path')}, units of the file: {page['units']}"
    paths = [line for path in page["paths"][:MOST_LISTED] for line in _path_lines(path)]
    rows = [
        {
            **curve,
            "curve": f"{i} (path {curve['path']})" if several else str(i),
            "kind": "rational" if curve["rational"] else "polynomial",
            "length": number(curve["length_mm"], 7),
        }
        for i, curve in enumerate(page["curves"][:MOST_LISTED])
    ]
    heads = "curve, kind, degree, control points=control_points, spans, length"
    curves = listed(rows, heads, texts=2) if rows else []
    if left := len(page["curves"]) + page["curves_left_out"] - len(rows):
        curves.append(f"... and {left} more; --json{' --all' * bool(page['curves_left_out'])} lists all")
    program = _program_lines(page["program"]) if "program" in page else []
    return [[head, *paths, *program], [*curves, *notes(page["findings"])]]


def _path_lines(path: Mapping[str, Any]) -> list[str]:
    from splinefeed.records import unit_along

    shape, unit = "closed" if path["closed"] else "open", unit_along(path["axes"])
    lines = [f"{path['name']}: {shape}, {number(path['length_mm'], 7)} {unit}, axes {' '.join(path['axes'])}"]
    for axis, axis_unit, *box in zip(path["axes"], path["axis_units"], path["bbox_min"], path["bbox_max"], strict=True):
        noise = ROUNDING * max(map(abs, box))
        ends = [number(0.0 if abs(end) < noise else end, 6) for end in box]
        lines.append(f"  {axis:<8}{' to '.join(ends)} {axis_unit}")
    if unit == "mm":
        lines.append(f"  least radius of curvature {_radius_words(path['min_radius_mm'], path['length_mm'])}")
    sharp = sum(corner["stop"] for corner in path["corner_places"])
    others = f", {counted(more, 'other stop')} of the program" if (more := path["stops"] - sharp) > 0 else ""
    jumps = counted(path["corners"] - sharp, "jump")
    lines.append(f"  {counted(sharp, 'corner')} to stop at, {jumps} of curvature{others}")
    alike: dict[str, list[float]] = {}
    for corner in path["corner_places"]:
        what = f"turns by {number(corner['angle_deg'])} deg" if corner["stop"] else "curvature jumps"
        alike.setdefault(what, []).append(corner["s_mm"])
    for what, places in sorted(alike.items(), key=lambda each: -len(each[1]))[:MOST_LISTED]:
        more = f", and {len(places) - 1} more alike" if len(places) > 1 else ""
        lines.append(f"    at {number(places[0], 6)} {unit}: {what}{more}")
    if path["gaps"]:
        lines.append(f"  {counted(path['gaps'], 'gap')}, the largest {number(path['largest_gap_mm'])} {unit}")
    return lines


def _program_lines(program: Mapping[str, Any]) -> list[str]:
    """Lines, moves, lengths, feeds and times of a program."""
    counts = ", ".join(f"{count} {kind}" for kind, count in program["motion_blocks"].items())
    lengths = ", ".join(f"{number(length, 7)} mm {kind}" for kind, length in program["lengths_mm"].items())
    lines = [
        f"program of {program['lines']} lines, dialect {program['dialect']} ({program['dialect_by']})",
        f"  moves     {counts}; {program['markers']} lines with M, S or T",
        f"  lengths   {lengths}",
    ]
    if program["feed_max_mm_s"] is not None:
        feeds = " to ".join(dict.fromkeys(number(60.0 * program[f"feed_{end}_mm_s"]) for end in ("min", "max")))
        times = f"{number(program['feed_time_s'])} s at them, {number(program['dwell_s'])} s of dwells"
        lines.append(f"  feeds     {feeds} mm/min; {times}, without rapid moves")
    from splinefeed.programs.gcode.dialects import named

    ends = program["ends"] or named(program["dialect"]).extruder  # a printer's program just stops
    return lines if ends else [*lines, "  note      no M2 or M30 ends it"]


@answers(_show)
@options.table("""
source          SOURCE
--all every     -       List every curve of a long program in --json, not the first alone.
""")
@options.reading
def info(say: Say, source: str, every: bool, **given: Any) -> Page:
    """Show what SOURCE holds: curves, length, corners, least radius, and what its reader guessed or repaired.

    Examples:
      splinefeed info butterfly
      splinefeed info part.json
      splinefeed info section.dat --chord 150mm --json
    """
    from splinefeed.curves.tables import fit_together
    from splinefeed.formats import registry
    from splinefeed.programs.gcode.overview import summary

    say(f"reading {source}")
    reading, more = options.reading_from(given), {}
    is_file = not sf.shapes.is_shape(source) and os.path.isfile(source)
    if is_file and registry.format_of(source).module == "programs.gcode" and not set(reading) - options.OF_PROGRAMS:
        found = summary(source, **reading, most_listed=sys.maxsize if every else FEW)
        more = {"program": found.program()}
        if sum(found.moves.values()) > FEW:  # from its moves: a hundred megabytes take seconds
            return {**found.page(source), "format": "G-code", **more}
    paths = read_contents(source, reading)
    fit_together([path.joined[0] for path in paths if len(path.joined) == 1])
    return {
        "paths": [_path(path) for path in paths],
        "curves": [_curve(path, i, k) for k, path in enumerate(paths, start=1) for i in range(len(path.curves))],
        "curves_left_out": 0,
        "format": paths.format,
        "units": paths.units,
        "findings": list(dict.fromkeys(finding for path in paths for finding in path.findings)),
        **more,
    }


def _path(path: sf.Path) -> dict[str, Any]:
    """One path; lengths in mm, rotary axes and angles in degrees."""
    from splinefeed.files.metadata import axis_units, to_degrees
    from splinefeed.paths.path import JOIN_TOLERANCE

    low, high = path.bounding_box()
    radius = path.minimum_radius()
    return {
        "name": path.name,
        "axes": list(path.axes),
        "axis_units": axis_units(path.axes, rotary="deg"),
        "curves": len(path.curves),
        "degrees": sorted({curve.degree for curve in path.curves}),
        "length_mm": path.tip_end,
        "bbox_min": to_degrees(low[None], path.axes)[0].tolist(),
        "bbox_max": to_degrees(high[None], path.axes)[0].tolist(),
        "closed": path.closed,
        "min_radius_mm": radius if math.isfinite(radius) else None,
        "corners": len(path.corners),
        "stops": len(path.stops),
        "corner_places": [
            {
                "s_mm": s,
                "angle_deg": math.degrees(c.angle),
                "curvature_jump_per_mm": c.curvature_jump if math.isfinite(c.curvature_jump) else None,
                "stop": c.stop,
            }
            for c, s in zip(path.corners, path.tip_length(path.corners.s).tolist(), strict=True)
        ],
        "gaps": sum(gap > JOIN_TOLERANCE for gap in path.gaps),
        "largest_gap_mm": max(path.gaps, default=0.0),
    }


def _curve(path: sf.Path, i: int, number: int) -> dict[str, Any]:
    curve = path.curves[i]
    begin, end = path.tip_length(path.curve_starts[i : i + 2]).tolist()
    return {
        "path": number,
        "degree": curve.degree,
        "control_points": len(curve.control_points),
        "spans": len(curve.breaks) - 1,
        "rational": curve.rational,
        "closed": curve.closed,
        "length_mm": end - begin,
    }


def _radius_words(radius: float | None, length: float) -> str:
    """The least radius, mm; what rounding makes of a straight line and of a cusp is called by its name."""
    if radius is None or radius * ROUNDING > length:
        return "none (straight lines)"
    return "0 mm (a cusp)" if radius < ROUNDING * length else f"{number(radius)} mm"
