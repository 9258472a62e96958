"""CAD files read by OCCT and rhino3dm, in the process that native readers have, and the paths of what they answer.

OCCT was seen to end by a segmentation fault on more than half of STEP files with a few bytes changed.

A task is {"kind", "file", "folder", "edges", "repair", "hidden", "layers"}, the folder being one for temporary files,
which is removed here: a process that dies leaves them. The answer is {"units", "findings", "unshown",
"groups"}, "unshown" being counts of what the author's program does not show, with groups of
{"name", "curves"} that make one path each, and curves of {"degree", "knots", "points", "weights", "reversed"}.
"""

from __future__ import annotations

import gc
import itertools
import math
import os
import pathlib
import tempfile
from collections import Counter
from collections.abc import Sequence
from importlib import import_module
from typing import Any

import numpy as np

from splinefeed.curves.arcs import arc
from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.editing import unbroken
from splinefeed.errors import CurveError, InputError
from splinefeed.files.native_process import ask
from splinefeed.formats.drawing import BROKEN, Drawing
from splinefeed.paths.contents import Contents

#: Time that a library gets for each MB of a file beside that of all, s.
SECONDS_PER_MB = 5.0
#: Names that files give to their units.
_UNITS = {"millimetre": "mm", "metre": "m", "centimetre": "cm", "micrometre": "um", "inch": "in", "foot": "ft"}
#: The module that reads each kind of file, and what people call its library.
MODULES = {
    **dict.fromkeys(("step", "iges"), ("occt_shapes", "OCCT (package cadquery-ocp-novtk)")),
    "3dm": ("rhino_objects", "rhino3dm"),
}
#: Arcs shorter than this, mm, have no length.
SHORTEST = 1e-9

Curve = dict[str, Any]


def read(drawing: Drawing, kind: str, faults: list[str], *, edges: bool) -> Contents:
    """Read the paths in a file by a library of CAD, in a process of its own.

    Parameters
    ----------
    drawing : Drawing
        Of the file.
    kind : str
        "step", "iges" or "3dm".
    faults : list of str
        What the format's own check has found.
    edges : bool
        Whether the edges of bodies are read, too.

    Returns
    -------
    Contents
        Paths, mm, and units.

    Raises
    ------
    InputError
        For faults, which are findings with `repair`, and where the library is not installed.
    """
    file = drawing.file
    for fault in faults:
        drawing.fault(fault, "")
    task = {"kind": kind, "layers": drawing.layers, "repair": drawing.repair, "hidden": drawing.hidden}
    with tempfile.TemporaryDirectory(prefix="splinefeed-") as folder:
        task |= {"folder": folder, "edges": edges}
        answer = ask("formats.cad_process", "contents", file, SECONDS_PER_MB, **task)[0]
    drawing.findings += answer["findings"]
    drawing.unshown.update(answer["unshown"])
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


# --- in the process ---------------------------------------------------------------------------------------------------


def contents(file: pathlib.Path, **task: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return what a library reads of a file, and no columns; runs in the process that may die over a damaged file."""
    module, title = MODULES[task["kind"]]
    try:
        read = import_module(f"splinefeed.formats.{module}").read
    except ImportError as error:
        why = f"needs {title}, which cannot be loaded ({error}); run: pip install 'splinefeed[cad]'"
        raise InputError(why) from None
    gc.disable()  # it would walk through the many small objects of an answer again and again
    try:
        return read({**task, "file": os.fspath(file)}), {}
    finally:
        gc.enable()


class Gathered:
    """Gather the curves of a file, bodies whose edges may be curves, and findings."""

    def __init__(self, task: dict[str, Any]) -> None:
        self.task = task
        self.groups: list[dict[str, Any]] = []
        self.bodies: list[Any] = []
        self.findings: list[str] = []
        self.left_out: Counter[str] = Counter()
        self.unshown: Counter[str] = Counter()

    def reads(self, unseen: str) -> bool:
        """Tell whether something is read; `unseen` is why the author's program does not show it, "" if it does."""
        self.unshown.update([unseen] if unseen else [])
        return bool(self.task["hidden"]) or not unseen

    def add(self, curves: Sequence[Curve], name: str = "") -> None:
        """Add one path."""
        self.groups.append({"name": name, "curves": curves})

    def wants_edges(self) -> bool:
        """Tell whether the edges of bodies are read: on request, or where there is nothing else."""
        if self.task["edges"] or not self.bodies:
            return bool(self.task["edges"])
        if self.groups:
            self.findings.append("edges of faces are left out; edges=True (--edges) reads them too")
        else:
            self.findings.append("no free curves; these are the edges of its faces")
        return not self.groups

    def answer(self, units: str) -> dict[str, Any]:
        """Return what the other process gets."""
        left_out = [f"left out: {count} x {what}" for what, count in self.left_out.items()]
        return {"units": units, "findings": self.findings + left_out, "unshown": self.unshown, "groups": self.groups}


def arc_of(center: Any, x: Any, y: Any, first: float, last: float) -> Curve:
    """Return the arc center + x cos(t) + y sin(t), t from `first` to `last`; a single point where it has no length."""
    center, x, y = (np.array(each, dtype=np.float64) for each in (center, x, y))
    sweep = float(np.clip(last - first, -2.0 * math.pi, 2.0 * math.pi))
    if abs(sweep) * float(np.max(np.abs([x, y]))) <= SHORTEST:
        return nurbs(1, [0.0, 0.0, 1.0, 1.0], [center.tolist()] * 2, None)
    made = arc(center, x, y, first, sweep)
    weights = None if made.weights is None else made.weights.tolist()
    return nurbs(2, made.knots.tolist(), made.control_points.tolist(), weights)


def nurbs(degree: int, knots: Sequence[float], points: Sequence[Sequence[float]], weights: Any) -> Curve:
    """Return a NURBS curve, traversed as its parameter grows."""
    return {"degree": degree, "knots": knots, "points": points, "weights": weights, "reversed": False}
