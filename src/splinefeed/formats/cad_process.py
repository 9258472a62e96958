"""The process that reads CAD files with OCCT and rhino3dm, and the paths of what it answers.

OCCT was seen to end by a segmentation fault on more than half of STEP files with a few bytes changed, and such
libraries cannot be stopped. So they run apart, with a limit on time and memory; a file that they cannot bear is an
error of one line, and the next file finds a new process. It is started by the first file and stays for the next ones.
"""

from __future__ import annotations

import itertools
import json
import os
from typing import Any

import numpy as np

from splinefeed.errors import CurveError, InputError
from splinefeed.formats.contents import Contents
from splinefeed.formats.drawing import BROKEN, Drawing
from splinefeed.formats.metadata import naming
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.editing import unbroken
from splinefeed.workers import LostError, Worker

#: Time that a library gets for a file, s, and for each MB of it.
MAX_SECONDS = 30.0
SECONDS_PER_MB = 5.0
#: What a library may take of the memory, bytes of address space; OCCT itself is half a gigabyte of it.
MAX_ADDRESS_SPACE = 6 * 2**30
#: Names that files give to their units.
_UNITS = {"millimetre": "mm", "metre": "m", "centimetre": "cm", "micrometre": "um", "inch": "in", "foot": "ft"}

_worker = Worker("splinefeed.formats.cad_worker:open_libraries", memory=MAX_ADDRESS_SPACE, quiet=True)


def read(drawing: Drawing, kind: str, faults: list[str], *, edges: bool) -> Contents:
    """The paths in the file of `drawing`, whose own check has found `faults`; with `edges` those of bodies too.

    With `repair` a fault or a curve that cannot be is a finding. Raises FormatError for all else, and where the library
    is not installed.
    """
    file = drawing.file
    with naming(file):
        for fault in faults:
            drawing.fault(fault, "")
        seconds = MAX_SECONDS + SECONDS_PER_MB * file.stat().st_size / 1e6
        try:
            task = {"kind": kind, "file": os.path.abspath(file), "layers": drawing.layers}
            answer = json.loads(_worker.ask({**task, "repair": drawing.repair, "edges": edges}, seconds=seconds)[1])
        except LostError as error:
            why = f"takes longer than {seconds:.0f} s" if error.late else "makes the CAD library crash"
            raise InputError(f"{why}; is it damaged?") from None
        if "refused" in answer:
            raise InputError(answer["refused"])
        drawing.findings += answer["findings"]
        numbers = itertools.count(1)
        for group in answer["groups"]:
            curves: list[NurbsCurve] = []
            for said, number in zip(group["curves"], numbers, strict=False):
                try:
                    made = _curves(said)
                except CurveError as error:
                    drawing.fault(f"curve {number}: {error}")
                    continue
                if not made:
                    drawing.left_out["curve of no length"] += 1
                elif len(made) > 1:
                    drawing.notes[BROKEN] += 1
                curves += made
            drawing.add_runs(curves, group["name"] or file.stem)
        unit = answer["units"].lower()
        return drawing.contents(_UNITS.get(unit, unit) or "mm")


def _curves(said: dict[str, Any]) -> list[NurbsCurve]:
    """The curve that the worker describes, in mm; none if it has no length, its pieces where it may jump at knots."""
    # the first and the last knot touch no point of the domain; OCCT moves them where it made a closed curve periodic
    knots = np.array([said["knots"][1], *said["knots"][1:-1], said["knots"][-2]])
    weights = None if said["weights"] is None else np.array(said["weights"], dtype=np.float64)
    parts = unbroken(said["degree"], knots, np.array(said["points"], dtype=np.float64), weights)
    curves = [NurbsCurve(said["degree"], *part).with_clamped_ends() for part in parts if np.any(part[1] != part[1][0])]
    return [curve.reversed() for curve in reversed(curves)] if said["reversed"] else curves
