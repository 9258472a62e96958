"""The process that reads CAD files with OCCT and rhino3dm, and the paths of what it answers.

OCCT was seen to end by a segmentation fault on more than half of STEP files with a few bytes changed, and such
libraries cannot be stopped. So they run apart, with a limit on time and memory; a file that they cannot bear is an
error of one line, and the next file finds a new process. It is started by the first file and stays for the next ones.
"""

from __future__ import annotations

import importlib.util
import json
import os
import pathlib
from typing import Any, NamedTuple

from splinefeed.errors import CurveError, FormatError
from splinefeed.formats.cad_curves import curves_of
from splinefeed.formats.contents import Contents
from splinefeed.formats.drawing import Drawing, many, runs_that_meet
from splinefeed.formats.sizes import MAX_DRAWING_CURVES, MAX_DRAWING_POINTS
from splinefeed.workers import LostError, Worker

#: Time that a library gets for a file, s, and for each MB of it.
MAX_SECONDS = 30.0
SECONDS_PER_MB = 5.0
#: What a library may take of the memory, bytes of address space; OCCT itself is half a gigabyte of it.
MAX_ADDRESS_SPACE = 6 * 2**30
#: Names that files give to their units.
_UNITS = {"millimetre": "mm", "metre": "m", "centimetre": "cm", "micrometre": "um", "inch": "in", "foot": "ft"}
_INSTALL = "run: pip install 'splinefeed[cad]'"


class Library(NamedTuple):
    """What reads a kind of file: the kind, the module to import, and what people call it."""

    kind: str
    module: str
    title: str


_worker = Worker("splinefeed.formats.cad_worker:open_libraries", memory=MAX_ADDRESS_SPACE, quiet=True)


def read(
    file: pathlib.Path,
    library: Library,
    findings: list[str],
    *,
    tolerance: float,
    repair: bool,
    **wanted: Any,
) -> Contents:
    """The paths in the checked `file`; `findings` are those of the check, `wanted` is for the library's side.

    Curves whose ends meet within `tolerance`, mm, make one path; see `drawing`. With `repair` a curve that cannot be is
    a finding. Raises FormatError for all else, and where the library is not installed.
    """
    _check_installed(file, library)
    limits = {"most_curves": MAX_DRAWING_CURVES, "most_points": MAX_DRAWING_POINTS}
    task = {"kind": library.kind, "file": os.path.abspath(file), "repair": repair, **limits, **wanted}
    seconds = MAX_SECONDS + SECONDS_PER_MB * file.stat().st_size / 2**20
    try:
        answer = json.loads(_worker.ask(task, seconds=seconds)[1])
    except LostError as error:
        why = f"takes longer than {seconds:.0f} s" if error.late else "makes the CAD library crash"
        raise FormatError(f"{file}: {why}; is it damaged?") from None
    if "missing" in answer:
        raise FormatError(f"{file}: needs {library.title}, which cannot be loaded ({answer['missing']}); {_INSTALL}")
    if "refused" in answer:
        raise FormatError(f"{file}: {answer['refused']}")
    drawing = Drawing(os.fspath(file), findings=[*findings, *answer["findings"]])
    number = no_length = broken = 0
    for group in answer["groups"]:
        curves = []
        for said in group["curves"]:
            number += 1
            try:
                made = curves_of(said)
            except CurveError as error:
                if not repair:
                    raise FormatError(f"{file}: curve {number}: {error}") from None
                drawing.findings.append(f"curve {number} is left out: {error}")
                continue
            no_length += not made
            broken += len(made) > 1
            curves += made
        for run in runs_that_meet(curves):
            drawing.add(run, group["name"] or file.stem)
    if broken:
        drawing.findings.append(
            f"{many(broken, 'spline has a knot', 'splines have knots')} of multiplicity degree + 1, at which it may "
            f"jump; each is the pieces between, exactly"
        )
    if no_length:
        drawing.left_out["curve of no length"] = no_length
    unit = answer["units"].lower()
    return Contents(drawing.paths(file.stem, tolerance, repair), _UNITS.get(unit, unit) or "mm")


def _check_installed(file: pathlib.Path, library: Library) -> None:
    try:
        there = importlib.util.find_spec(library.module) is not None
    except (ImportError, ValueError):  # ValueError: someone put None in sys.modules
        there = False
    if not there:
        raise FormatError(f"{file}: needs {library.title}, which is not installed; {_INSTALL}")
