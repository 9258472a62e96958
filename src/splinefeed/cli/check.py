"""`splinefeed check`: whether setpoints lie on their path and hold every limit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from splinefeed.cli import options
from splinefeed.cli.answers import Page, answers
from splinefeed.cli.output import counted, number, print_table, print_text
from splinefeed.cli.panels import PanelCommand
from splinefeed.cli.progress import Say
from splinefeed.cli.setpoints_file import on_its_machine, path_of, read_setpoints
from splinefeed.cli.summary import print_notes
from splinefeed.errors import LimitsError

if TYPE_CHECKING:
    from splinefeed.records import Limits, Setpoints

EXAMPLES = """\b
Examples:
  splinefeed check splinefeed-butterfly/setpoints.h5
  splinefeed check wing.h5 --path wing.json --limits machine.toml --certificate wing-check.json
  splinefeed check recorded.csv --path butterfly --feed 60 --axis-jerk x=20000,y=15000 --resolution 1um

"""


def _print(page: Page) -> None:
    from splinefeed.records import unit_along, unit_of

    unit = unit_along(page["axes"])
    print_text(
        f"{page['file']}: {page['ticks']} setpoints, one every {number(page['period_s'], 6)} s, along "
        f"{number(page['length_mm'], 7)} {unit} of {page['path']}"
    )
    print_text(f"off the curve by at most {number(page['off_curve_max_mm'], 3)} {unit}; off its start and end by "
               f"{number(page['start_error_mm'], 3)} and {number(page['end_error_mm'], 3)} {unit}")  # fmt: skip
    print_notes(page["notes"])
    print_text()
    rows = []
    for name, each in page["limits"].items():
        of = unit_of(name, unit)
        values = [f"{number(each['worst'], 6)} {of}", f"{number(each['limit'], 6)} {of}"]
        values += [f"{each['share']:.6%}", f"{each['floor']:.1e}"]
        place = [f"{number(each['at_s'])} {unit}", f"{number(each['at_t_s'])} s", each["by"]]
        rows.append([name, *values, *place, "holds" if each["ok"] else "OVER"])
    print_table(["limit", "worst", "allowed", "share", "floor", "at", "at time", "by", ""], rows)
    print_text()
    for problem in page["problems"]:
        print_text(f"problem   {problem}")
    print_text("all limits and checks hold" if page["ok"] else f"NOT KEPT: {counted(len(page['problems']), 'problem')}")


@click.command(cls=PanelCommand, epilog=EXAMPLES + options.UNITS_NOTE)
@click.argument("setpoints")
@click.option("--path", "source", metavar="FILE|SHAPE", help="The path.  [default: that of the setpoints]")
@click.option("--which", metavar="NAME|NUMBER", help="Which path of a file that holds several (from 1).")
@click.option("--chord", type=options.Quantity("length"), metavar="LENGTH", help="Airfoil .dat: one unit of the file.")
@options.limits_alone("those of the setpoints")
@click.option("--law", "law_file", metavar="FILE", help="The time law (.h5): exact derivatives are checked too.")
@click.option(
    "--tolerance",
    type=options.Quantity("length"),
    metavar="LENGTH",
    help="Largest distance of a setpoint from the curve.  [default: 1e-9 mm]",
)
@click.option("--resolution", type=options.Quantity("length"), metavar="LENGTH", help="Last digit of the positions.")
@click.option("--columns", type=options.Names(), metavar="NAMES", help="CSV without names: its columns, as t,x,y.")
@click.option("--period", type=options.Quantity("time"), metavar="TIME", help="CSV: the period.  [default: from t]")
@click.option(
    "--machine",
    metavar="NAME|FILE",
    help="Of a tool path: the machine of these joints.  [default: that of the setpoints]",
)
@click.option("--certificate", "certificate_file", metavar="FILE", help="Write a certificate, JSON.")
@answers(_print)
def command(say: Say, setpoints: str, **given: Any) -> Page:
    """Check SETPOINTS against their path and limits, independently of the planner.

    SETPOINTS is a file that splinefeed saved (.h5, .csv, .mat), or a CSV of another program with columns t and axes. A
    file that a run wrote names its path and limits; options replace single limits. The exit code is 1 where a limit or
    a check does not hold.
    """
    from splinefeed.analysis.certificate import certificate, write_certificate
    from splinefeed.analysis.check import check
    from splinefeed.analysis.check_bounds import TOLERANCE
    from splinefeed.formats.setpoints import load
    from splinefeed.records import TimeLaw

    say(f"reading {setpoints}")
    points, notes = read_setpoints(setpoints, given)
    limits = _limits(points, given, setpoints)
    path, source = path_of(points.settings, given, setpoints)
    law = None if given["law_file"] is None else load(given["law_file"], TimeLaw)
    say("checking")
    verdict = check(
        points,
        on_its_machine(path, points.settings, given["machine"], limits),
        limits,
        law=law,
        tolerance=TOLERANCE if given["tolerance"] is None else given["tolerance"],
        resolution=given["resolution"] or 0.0,
    )
    page = {"file": setpoints, "path": source, "axes": list(points.axes), **verdict.as_dict()}
    page["notes"] = [*notes, *page["notes"]]
    page["files"] = []
    if given["certificate_file"]:
        write_certificate(certificate(points, path, limits, verdict, law), given["certificate_file"])
        page["files"] = [given["certificate_file"]]
    return page


def _limits(setpoints: Setpoints, given: Mapping[str, Any], file: str) -> Limits:
    """Limits of the file of limits, or else of the settings, with those of the options in their place."""
    from splinefeed.formats import limits_toml
    from splinefeed.records import Limits

    flat: dict[str, float] = {}
    if given["limits_file"]:
        flat = limits_toml.read(given["limits_file"]).as_dict()
    elif isinstance(settings := setpoints.settings.get("limits"), Mapping):
        flat = dict(settings)
    flat = options.replaced(flat, given)
    if not flat:
        raise LimitsError(f"{file}: has no limits; give --limits FILE, or --feed, --axis-jerk and the like")
    return Limits.from_dict(flat)
