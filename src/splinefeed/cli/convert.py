"""`splinefeed convert`: from any format to any other."""

from __future__ import annotations

from typing import Any

import click

from splinefeed.cli import options
from splinefeed.cli.answers import Page, answers
from splinefeed.cli.output import counted, number, print_text
from splinefeed.cli.progress import Say
from splinefeed.cli.source import read_contents
from splinefeed.cli.summary import print_notes

#: What is a fit to points, as close as it is written.
FITTED = (".dat", ".csv", ".xyz", ".pts", ".asc")

EXAMPLES = """\b
Examples:
  splinefeed convert part.dxf part.svg
  splinefeed convert drawing.svg outline.json --path outline --repair
  splinefeed convert butterfly butterfly.svg --tolerance 0.1um --json
  splinefeed convert lines.ngc curves.json --smooth 0.01mm
  splinefeed convert scan.csv scan.ngc --tolerance 20um
  splinefeed convert wing.step wing.nc --to fanuc --as arcs --feed 1200mm/min

"""


def _print(page: dict[str, Any]) -> None:
    print_text(
        f"{page['source']} ({page['from']}): {counted(page['paths'], 'path')}, {counted(page['curves'], 'curve')} "
        f"-> {page['file']} ({page['to']})"
    )
    if page["largest_distance_mm"] is not None:
        distance = f"{number(page['largest_distance_mm'], 2)} mm" if page["largest_distance_mm"] else "0 mm"
        print_text(f"read back: {counted(page['curves_written'], 'curve')}, at most {distance} from those read")
    print_notes(page["notes"] + page["findings"])


@click.command(epilog=EXAMPLES + options.UNITS_NOTE)
@click.argument("source", metavar="IN")
@click.argument("target", metavar="OUT")
@options.reading_alone
@options.smoothing
@options.quantity("--join", kind="length", text="Curves of a drawing closer than this are joined.  [default: 1e-6 mm]")
@options.quantity(
    "--tolerance",
    kind="length",
    text="Largest distance where OUT cannot hold a curve exactly, and of fits to points.  [default: 0.001 mm]",
)
@click.option("--to", "to_dialect", metavar="NAME", help="G-code OUT: linuxcnc, fanuc, siemens, mach3 or printer.")
@click.option("--as", "as_", metavar="NAME", help="G-code OUT: g5.2, g6.2, bspline, arcs or g1, for curves.")
@options.quantity("--feed", kind="feed", text="G-code OUT: the feed, where IN has none.")
@answers(_print)
def command(say: Say, source: str, target: str, **given: Any) -> Page:
    """Write the curves of IN, a file or a shape, to OUT; the suffix of OUT sets the format.

    Every curve is kept exactly where OUT can hold it; what is approximated or lost is reported. OUT is then read back,
    and its distance from the curves of IN is measured.
    """
    from splinefeed.formats import registry
    from splinefeed.formats.contents import Contents
    from splinefeed.pipeline.convert import convert
    from splinefeed.pipeline.settings import smooth

    form_written = registry.format_to_write(target).title  # before anything long begins
    say(f"reading {source}")
    reading = options.reading_from({**given, "tolerance": None})
    if given["join"] is not None:
        reading["tolerance"] = given["join"]
    elif given["tolerance"] is not None and source.lower().endswith(FITTED):
        reading["tolerance"] = given["tolerance"]
    paths = read_contents(source, reading)
    if how := options.smoothing_from(given):
        say("smoothing")
        units, form = paths.units, paths.format
        paths = Contents([smooth(path, how) for path in paths], units)
        paths.format = form
    say(f"writing {target}")
    writing = {"dialect": given["to_dialect"], "as_": given["as_"], "feed": given["feed"]}
    writing = {name: value for name, value in writing.items() if value is not None}
    notes, curves, distance = convert(paths, target, tolerance=given["tolerance"], writing=writing)
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
        "notes": list(notes),
        "findings": list(dict.fromkeys(finding for path in paths for finding in path.findings)),
    }
