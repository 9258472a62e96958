"""`splinefeed check`: whether setpoints lie on their path and hold every limit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import splinefeed as sf
from splinefeed.cli import options, summary
from splinefeed.cli.answers import answers
from splinefeed.cli.output import Block, Page, Say, notes, number, verdict
from splinefeed.cli.setpoints_file import of_robot, on_its_machine, path_of, read_setpoints
from splinefeed.errors import LimitsError
from splinefeed.paths.track import Track


def _show(page: Page) -> list[Block]:
    unit = summary.unit_of_path(page)
    ticks = f"{page['ticks']} setpoints, one every {number(page['period_s'], 6)} s"
    off, start, end = (number(page[f"{name}_mm"], 3) for name in ("off_curve_max", "start_error", "end_error"))
    return [
        [
            f"{page['file']}: {ticks}, along {number(page['length_mm'], 7)} {unit} of {page['path']}",
            f"off the curve by at most {off} {unit}; off its start and end by {start} and {end} {unit}",
            *notes(page["notes"]),
        ],
        summary.limits(page, checked=True),
        verdict(page),
    ]


@answers(_show)
@options.setpoints_path
@options.limits_alone("those of the setpoints")
@options.table("""
setpoints       SETPOINTS
--law law_file  FILE             The time law (.h5): exact derivatives are checked too.
--tolerance     LENGTH =1e-9 mm  Largest distance of a setpoint from the curve.
--resolution    LENGTH           Last digit of the positions.
--machine       NAME|FILE        Of a tool path: the machine of these joints.  [default: that of the setpoints]
--certificate certificate_file  FILE  Write a certificate, JSON.
""")
@options.setpoints_csv
def check(say: Say, setpoints: str, **given: Any) -> Page:
    """Check SETPOINTS against their path and limits, independently of the planner.

    SETPOINTS is a file that splinefeed saved (.h5, .csv, .mat), or a CSV of another program with columns t and axes. A
    file that a run wrote names its path and limits; options replace single limits. The exit code is 1 where a limit or
    a check does not hold.

    Examples:
      splinefeed check splinefeed-butterfly/setpoints.h5
      splinefeed check wing.h5 --path wing.json --limits machine.toml --certificate wing-check.json
      splinefeed check recorded.csv --path butterfly --feed 60 --axis-jerk x=20000,y=15000 --resolution 1um
    """
    from splinefeed.checks.certificate import certificate, write_certificate
    from splinefeed.runs.settings import completed

    say(f"reading {setpoints}")
    points, guessed = read_setpoints(setpoints, given)
    own = points.settings.get("limits")
    flat = options.said_limits(given, own if isinstance(own, Mapping) else {})
    if not flat:
        raise LimitsError(f"{setpoints}: has no limits; give --limits FILE, or --feed, --axis-jerk and the like")
    arm = None if given["source"] else of_robot(points.settings, setpoints)
    moved: Track
    if arm is not None:
        if flat != own:
            raise LimitsError(f"{setpoints}: is a motion of an arm, whose limits are in its own files; give no others")
        (moved, limits, _), source = arm, points.settings["source"]["text"]
    else:
        path, source = path_of(points.settings, given, setpoints)
        limits = completed(flat, None, points.axes, assume=False)
        moved = on_its_machine(path, points.settings, given["machine"], limits)
    law = None if given["law_file"] is None else sf.load(given["law_file"], sf.TimeLaw)
    say("checking the setpoints")
    found = sf.check(
        points,
        moved,
        limits,
        law=law,
        tolerance=given["tolerance"],
        resolution=given["resolution"] or 0.0,
    )
    certified = given["certificate_file"]
    if certified:
        write_certificate(certificate(points, moved.tip_path, limits, found, law), certified)
    page = {"file": setpoints, "path": source, "axes": list(points.axes), "unit": found.along, **found.as_dict()}
    return {**page, "notes": [*guessed, *page["notes"]], "files": [certified] if certified else []}
