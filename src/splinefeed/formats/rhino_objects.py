"""What rhino3dm finds in a .3dm file, as descriptions of curves; runs in the process of `cad_worker` only."""

from __future__ import annotations

from typing import Any

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.records import Array

#: How many mm the unit of a file is, by Rhino's name for it.
MILLIMETRES = {
    "Microns": 1e-3,
    "Millimeters": 1.0,
    "Centimeters": 10.0,
    "Decimeters": 100.0,
    "Meters": 1000.0,
    "Kilometers": 1e6,
    "Nanometers": 1e-6,
    "Microinches": 25.4e-6,
    "Mils": 0.0254,
    "Inches": 25.4,
    "Feet": 304.8,
    "Yards": 914.4,
    "Miles": 1609344.0,
}
_SHORT = {"Millimeters": "mm", "Centimeters": "cm", "Meters": "m", "Inches": "in", "Feet": "ft", "Microns": "um"}
#: Blocks in blocks.
MAX_DEPTH = 16


def read(task: dict[str, Any]) -> dict[str, Any]:
    """Answer a task of the kind "3dm"; see `cad_worker`."""
    import rhino3dm

    file = rhino3dm.File3dm.Read(task["file"])
    if file is None:
        raise FormatError("rhino3dm finds no valid 3DM file in it; is the file complete?")
    unit = file.Settings.ModelUnitSystem.name
    gathered = _Gathered(rhino3dm, file, task, MILLIMETRES.get(unit, 1.0))
    if unit not in MILLIMETRES:
        gathered.findings.append(f"its unit is {unit}; read as mm")
    gathered.add_all()
    return {"units": _SHORT.get(unit, unit), "findings": gathered.all_findings(), "groups": gathered.groups}


class _Gathered:
    """Curves of the objects of a file, blocks put where their references have them."""

    def __init__(self, library: Any, file: Any, task: dict[str, Any], scale: float) -> None:
        self.library, self.file, self.task = library, file, task
        self.scale = scale
        self.groups: list[dict[str, Any]] = []
        self.findings: list[str] = []
        self.left_out: dict[str, int] = {}
        self.curves = self.points = 0
        self.bodies: list[tuple[Any, str, Array]] = []
        names = [layer.FullPath or layer.Name for layer in file.Layers]
        self.layers = dict(enumerate(names))
        self.chosen = task["layers"]
        if self.chosen:
            unknown = [name for name in self.chosen if name not in names]
            if unknown:
                raise FormatError(f"layer {unknown[0]!r} is not there; layers are {', '.join(names) or 'none'}")
        self.objects = {str(each.Attributes.Id): each for each in file.Objects}

    def add_all(self) -> None:
        """Everything that is not part of a block; the edges of bodies where they are wanted or nothing else is."""
        whole = np.eye(4)
        whole[:3] *= self.scale
        for each in self.file.Objects:
            if not each.Attributes.IsInstanceDefinitionObject:
                self.add(each, whole, 0)
        wanted = bool(self.task["edges"])
        if not wanted and not self.groups and self.bodies:
            wanted = True
            self.findings.append("no free curves; these are the edges of its surfaces")
        for brep, name, matrix in self.bodies if wanted else ():
            for i in range(len(brep.Edges)):
                self.add_curve(brep.Edges[i].ToNurbsCurve(), name, matrix)
        if self.bodies and not wanted:
            self.findings.append("edges of surfaces are left out; edges=True (--edges) reads them too")

    def add(self, entry: Any, matrix: Array, depth: int) -> None:
        """An object under the 4 x 4 `matrix` from its place to mm."""
        rhino, geometry, attributes = self.library, entry.Geometry, entry.Attributes
        name = attributes.Name or self.layers.get(attributes.LayerIndex, "")
        if self.chosen and depth == 0 and self.layers.get(attributes.LayerIndex) not in self.chosen:
            return
        if isinstance(geometry, rhino.InstanceReference):
            self.add_block(geometry, matrix, depth)
        elif isinstance(geometry, rhino.Curve):
            self.add_curve(geometry, name, matrix)
        elif isinstance(geometry, rhino.Brep):
            self.bodies.append((geometry, name, matrix))
        elif isinstance(geometry, rhino.Extrusion):
            brep = geometry.ToBrep(False)
            if brep is None:
                self.leave_out("Extrusion")
            else:
                self.bodies.append((brep, name, matrix))
        else:
            self.leave_out(type(geometry).__name__)

    def add_block(self, reference: Any, matrix: Array, depth: int) -> None:
        """The objects of a block where `reference` puts them."""
        if depth >= MAX_DEPTH:
            raise FormatError(f"blocks are nested more than {MAX_DEPTH} deep")
        definition = self.file.InstanceDefinitions.FindId(reference.ParentIdefId)
        if definition is None:
            self.leave_out("reference to a block that is not there")
            return
        placed = matrix @ _matrix(reference.Xform)
        for identity in definition.GetObjectIds():
            member = self.objects.get(str(identity))
            if member is not None:
                self.add(member, placed, depth + 1)

    def add_curve(self, curve: Any, name: str, matrix: Array) -> None:
        """One curve as one group; a polycurve with gaps as its segments."""
        rhino = self.library
        if curve is None:
            self.leave_out("edge without a curve")
            return
        parts = [curve]
        if isinstance(curve, rhino.PolyCurve) and curve.HasGap:
            parts = list(curve.Explode())
            self.findings.append(f"a polycurve has gaps; its {len(parts)} segments are read one by one")
        found = [self.described(part, matrix) for part in parts]
        self.curves += len(found)
        self.points += sum(len(each.get("points", ())) for each in found)
        for count, most, what in (
            (self.curves, self.task["most_curves"], "curves"),
            (self.points, self.task["most_points"], "control points"),
        ):
            if count > most:
                raise FormatError(f"holds more than {most} {what}; that is more than can be read")
        self.groups.append({"name": name, "curves": found})

    def described(self, curve: Any, matrix: Array) -> dict[str, Any]:
        """What `cad_curves.curves_of` makes a curve of."""
        rhino = self.library
        if isinstance(curve, rhino.ArcCurve):
            arc = curve.Arc
            plane, angles = arc.Plane, arc.AngleDomain
            return {
                "type": "arc",
                "center": _placed([_xyz(arc.Center)], matrix)[0],
                "x": (matrix[:3, :3] @ _xyz(plane.XAxis) * arc.Radius).tolist(),
                "y": (matrix[:3, :3] @ _xyz(plane.YAxis) * arc.Radius).tolist(),
                "first": angles.T0,
                "last": angles.T1,
                "reversed": False,
            }
        made = curve.ToNurbsCurve()
        if made is None:
            raise FormatError(f"a {type(curve).__name__} has no form as NURBS; is the file damaged?")
        points = [made.Points[i] for i in range(len(made.Points))]
        weights = [point.W for point in points]
        # rhino3dm gives points times weights; Rhino leaves out the first and the last knot, which say nothing
        places = [[point.X / point.W, point.Y / point.W, point.Z / point.W] for point in points]
        knots = list(made.Knots)
        return {
            "type": "nurbs",
            "degree": made.Degree,
            "knots": [knots[0], *knots, knots[-1]],
            "points": _placed(places, matrix),
            "weights": weights if made.IsRational else None,
            "first": made.Domain.T0,
            "last": made.Domain.T1,
            "reversed": False,
        }

    def leave_out(self, what: str) -> None:
        """Count what is not a curve."""
        self.left_out[what] = self.left_out.get(what, 0) + 1

    def all_findings(self) -> list[str]:
        """What was found, and what was left out."""
        return [*self.findings, *(f"left out: {count} x {what}" for what, count in self.left_out.items())]


def _xyz(point: Any) -> list[float]:
    return [point.X, point.Y, point.Z]


def _matrix(transform: Any) -> Array:
    return np.array([[getattr(transform, f"M{row}{column}") for column in range(4)] for row in range(4)])


def _placed(points: list[list[float]], matrix: Array) -> list[list[float]]:
    placed: list[list[float]] = (np.array(points) @ matrix[:3, :3].T + matrix[:3, 3]).tolist()
    return placed
