"""What rhino3dm finds in a .3dm file, as descriptions of curves; runs in the process of `cad_process` only."""

from __future__ import annotations

from typing import Any

import numpy as np
import rhino3dm

from splinefeed import units
from splinefeed.errors import FormatError
from splinefeed.formats.cad_process import Curve, Gathered, arc_of, nurbs
from splinefeed.formats.drawing import DASHED
from splinefeed.records import Array

#: Units of files by Rhino's names for them.
UNITS = {"Millimeters": "mm", "Centimeters": "cm", "Meters": "m", "Inches": "in", "Feet": "ft", "Microns": "um",
         "Mils": "mil", "None": "mm", "Unset": "mm"}  # fmt: skip
#: Line types as long as the process lasts: rhino3dm 8.35 frees one twice where Python lets go of it.
_KEPT: list[Any] = []
#: Blocks in blocks.
MAX_DEPTH = 16


def read(task: dict[str, Any]) -> dict[str, Any]:
    """Answer a task of the kind "3dm"; see `cad_process`."""
    file = rhino3dm.File3dm.Read(task["file"])
    if file is None:
        raise FormatError("rhino3dm finds no valid 3DM file in it; is the file complete?")
    unit = file.Settings.ModelUnitSystem.name
    if unit not in UNITS:
        raise FormatError(f"its unit is {unit}, not one of workpieces; change it in Rhino")
    gathered = _Objects(task, file)
    if unit in ("None", "Unset"):
        gathered.findings.append(f"its unit is {unit}; read as mm")
    gathered.add_all(units.parse(f"1{UNITS[unit]}", "length"))
    return gathered.answer(UNITS[unit])


class _Objects(Gathered):
    """Curves of the objects of a file, blocks put where their references have them."""

    def __init__(self, task: dict[str, Any], file: Any) -> None:
        super().__init__(task)
        self.file = file
        self.layers = [layer.FullPath or layer.Name for layer in file.Layers]
        for name in task["layers"]:
            if name not in self.layers:
                raise FormatError(f"layer {name!r} is not there; layers are {', '.join(self.layers) or 'none'}")
        self.off = {name for layer, name in zip(file.Layers, self.layers, strict=True) if not layer.Visible}
        self.dashes = 0  # curves of which gaps are read, too
        lines = list(file.Linetypes)
        _KEPT.extend(lines)
        self.dashed = {line.Index for line in lines if line.SegmentCount > 1}  # dashes and gaps follow each other
        self.objects = {str(each.Attributes.Id): each for each in file.Objects}

    def add_all(self, scale: float) -> None:
        """Everything that is not part of a block; the edges of bodies where they are wanted or nothing else is."""
        whole = np.diag([scale, scale, scale, 1.0])
        for each in self.file.Objects:
            if not each.Attributes.IsInstanceDefinitionObject:
                self.add_object(each, whole, 0)
        for brep, name, matrix in self.bodies if self.wants_edges() else ():
            for i in range(len(brep.Edges)):
                self.add_curve(brep.Edges[i].ToNurbsCurve(), name, matrix)
        self.findings += [f"{self.dashes} x {DASHED}"] if self.dashes else []

    def add_object(self, entry: Any, matrix: Array, depth: int) -> None:
        """An object under the 4 x 4 `matrix` from its place to mm."""
        geometry, attributes = entry.Geometry, entry.Attributes
        index = attributes.LayerIndex
        layer = self.layers[index] if 0 <= index < len(self.layers) else ""
        if self.task["layers"] and depth == 0 and layer not in self.task["layers"]:
            return
        if not self.reads(self.unseen(attributes, layer)):
            return
        name = attributes.Name or layer
        if isinstance(geometry, rhino3dm.Extrusion):
            geometry = geometry.ToBrep(False) or geometry
        if isinstance(geometry, rhino3dm.InstanceReference):
            self.add_block(geometry, matrix, depth)
        elif isinstance(geometry, rhino3dm.Curve):
            own = attributes.LinetypeSource == rhino3dm.ObjectLinetypeSource.LinetypeFromObject
            line = attributes.LinetypeIndex if own else self.file.Layers[index].LinetypeIndex if layer else -1
            self.dashes += line in self.dashed
            self.add_curve(geometry, name, matrix)
        elif isinstance(geometry, rhino3dm.Brep):
            self.bodies.append((geometry, name, matrix))
        else:
            self.left_out[type(geometry).__name__] += 1

    def unseen(self, attributes: Any, layer: str) -> str:
        """Why an object is not seen, or ""; a layer named by the option is read, and one within a layer that is off."""
        if attributes.ActiveSpace.name == "PageSpace":
            return "object in a layout"
        if attributes.Mode.name == "Hidden" or not attributes.Visible:
            return "hidden object"
        parts = layer.split("::")
        off = [name for name in ("::".join(parts[:k]) for k in range(1, len(parts) + 1)) if name in self.off]
        return f"object on layer {layer!r}, off" if off and layer not in self.task["layers"] else ""

    def add_block(self, reference: Any, matrix: Array, depth: int) -> None:
        """The objects of a block where `reference` puts them."""
        if depth >= MAX_DEPTH:
            raise FormatError(f"blocks are nested more than {MAX_DEPTH} deep")
        definition = self.file.InstanceDefinitions.FindId(reference.ParentIdefId)
        if definition is None:
            self.left_out["reference to a block that is not there"] += 1
            return
        form = reference.Xform
        placed = matrix @ np.array([[getattr(form, f"M{row}{column}") for column in range(4)] for row in range(4)])
        for identity in definition.GetObjectIds():
            member = self.objects.get(str(identity))
            if member is not None:
                self.add_object(member, placed, depth + 1)

    def add_curve(self, curve: Any, name: str, matrix: Array) -> None:
        """One curve as one group; a polycurve with gaps as its segments."""
        if curve is None:
            self.left_out["edge without a curve"] += 1
            return
        parts = [curve]
        if isinstance(curve, rhino3dm.PolyCurve) and curve.HasGap:
            parts = list(curve.Explode())
            self.findings.append(f"a polycurve has gaps; its {len(parts)} segments are read one by one")
        self.add([_described(part, matrix) for part in parts], name)


def _described(curve: Any, matrix: Array) -> Curve:
    turn, shift = matrix[:3, :3], matrix[:3, 3]
    if isinstance(curve, rhino3dm.ArcCurve):
        arc = curve.Arc
        x, y = (turn @ _xyz(axis) * arc.Radius for axis in (arc.Plane.XAxis, arc.Plane.YAxis))
        return arc_of(turn @ _xyz(arc.Center) + shift, x, y, arc.AngleDomain.T0, arc.AngleDomain.T1)
    made = curve.ToNurbsCurve()
    if made is None:
        raise FormatError(f"a {type(curve).__name__} has no form as NURBS; is the file damaged?")
    points = [made.Points[i] for i in range(len(made.Points))]
    # rhino3dm gives points times weights; Rhino leaves out the first and the last knot, which say nothing
    places = np.array([[point.X / point.W, point.Y / point.W, point.Z / point.W] for point in points])
    knots, weights = list(made.Knots), [point.W for point in points] if made.IsRational else None
    return nurbs(made.Degree, [knots[0], *knots, knots[-1]], (places @ turn.T + shift).tolist(), weights)


def _xyz(point: Any) -> list[float]:
    return [point.X, point.Y, point.Z]
