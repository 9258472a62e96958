"""`splinefeed convert`: from any format to any other."""

from __future__ import annotations

import os
from typing import Any

from splinefeed.cli import options
from splinefeed.cli.answers import answers
from splinefeed.cli.output import Block, Page, Say, counted, notes, number
from splinefeed.cli.source import UNSAID, read_contents
from splinefeed.errors import InputError

#: Formats that are a fit to points, as close as it is written.
FITTED = ("formats.airfoil", "formats.points")


def _show(page: Page) -> list[Block]:
    read = f"{page['source']} ({page['from']}): {counted(page['paths'], 'path')}, {counted(page['curves'], 'curve')}"
    lines, distance = [f"{read} -> {page['file']} ({page['to']})"], page["largest_distance_mm"]
    if distance is not None:
        written = counted(page["curves_written"], "curve")
        lines.append(f"read back: {written}, at most {number(distance, 2)} mm from those read")
    return [[*lines, *notes(page["notes"] + page["findings"])]]


@answers(_show)
@options.table("""
source          IN
target          OUT
--join          LENGTH  Curves of a drawing closer than this are joined.  [default: 1e-6 mm]
--tolerance     LENGTH  Largest distance where OUT cannot hold a curve exactly, and of fits to points.
                        [default: 0.001 mm]
--to dialect_written  NAME  G-code OUT: linuxcnc, fanuc, siemens, mach3 or printer.
--as as_        NAME    G-code OUT: g5.2, g6.2, bspline, arcs or g1, for curves.
--feed          FEED    G-code OUT: the feed, where IN has none.
""")
@options.linking
@options.reading_alone
@options.smoothing
def convert(say: Say, source: str, target: str, **given: Any) -> Page:
    """Write the curves of IN, a file or a shape, to OUT; the suffix of OUT sets the format.

    Every curve is kept exactly where OUT can hold it; what is approximated or lost is reported. OUT is then read back,
    and its distance from the curves of IN is measured. In a program the contours of a drawing are one motion, as `run`
    makes it: inner before outer, linked by rapid moves.

    Examples:
      splinefeed convert part.dxf part.svg
      splinefeed convert drawing.svg outline.json --path outline --repair
      splinefeed convert butterfly butterfly.svg --tolerance 0.1um --json
      splinefeed convert lines.ngc curves.json --smooth 0.01mm
      splinefeed convert scan.csv scan.ngc --tolerance 20um
      splinefeed convert plate.dxf plate.ngc --clearance 5mm --feed 20
      splinefeed convert wing.step wing.nc --to fanuc --as arcs --feed 1200mm/min
    """
    from splinefeed.formats import registry
    from splinefeed.runs.convert import convert as write_and_read_back

    form_written = registry.format_to_write(target).title  # before anything long begins
    say(f"reading {source}")
    points = os.path.isfile(source) and registry.format_of(source).module in FITTED
    fitted = given["tolerance"] if points else None
    join = fitted if given["join"] is None else given["join"]
    into_program = registry.format_to_write(target).module == "programs.gcode"
    reading = options.reading_from({**given, "tolerance": join})
    if not into_program and (links := [name for name in options.LINKS if name in reading]):
        raise InputError(f"--{links[0].replace('_', '-')}: is for programs; {target} is a {form_written}")
    if given["feed"] is not None:
        reading[UNSAID] = {"cut_feed": given["feed"]}
    paths = read_contents(source, reading, one=into_program)
    say(f"writing {target}")
    writing = {"dialect": given["dialect_written"], "as_": given["as_"], "feed": given["feed"]}
    writing = {name: value for name, value in writing.items() if value is not None}
    said, curves, distance = write_and_read_back(paths, target, tolerance=given["tolerance"], writing=writing)
    return {
        "ok": True,
        "source": source,
        "file": target,
        "from": paths.format,
        "to": form_written,
        "units": paths.units,
        "paths": len(paths),
        "curves": sum(len(path.curves) for path in paths),
        "curves_written": curves,
        "largest_distance_mm": distance,
        "notes": list(said),
        "findings": list(dict.fromkeys(finding for path in paths for finding in path.findings)),
    }
