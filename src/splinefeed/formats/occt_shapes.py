"""What OCCT makes of a STEP or IGES file, as descriptions of curves; runs in the process of `cad_worker` only."""

from __future__ import annotations

import math
import os
import pathlib
import re
import tempfile
from collections.abc import Iterator
from typing import Any

from splinefeed.errors import FormatError
from splinefeed.formats import occt_splines

#: Ends of a line farther out than this, mm, are OCCT's sign for infinite.
INFINITE = 1e50
#: How far an approximation may be from an offset curve that is no circle and no line, mm, and its most spans.
OFFSET_TOLERANCE = 1e-7
OFFSET_SPANS = 2000
#: Most faults of a file that are findings each when it is repaired.
MOST_FAULTS = 5
_SYNTAX = re.compile(r"Line (\d+): (.*?)\s*\*{4}")
_ENTITY = "entity "
_UNSOUND = "OCCT finds no valid data in it; is the file complete?"


def read(task: dict[str, Any]) -> dict[str, Any]:
    """Answer a task of the kind "step" or "iges"; see `cad_worker`.

    Raises FormatError for what OCCT holds against the file as a whole, or, when repairing, makes findings of it; what
    it holds against single entities are findings.
    """
    reader, faults, findings, units = (_step if task["kind"] == "step" else _iges)(task["file"])
    said = _said(reader.WS().ModelCheckList(True))
    faults += [each for each in said if not each.startswith(_ENTITY)]
    if faults and not task["repair"]:
        raise FormatError(faults[0] + (f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""))
    roots = reader.NbRootsForTransfer()
    if roots == 0:
        raise FormatError("holds no geometry that OCCT can read; was it exported whole?")
    read = reader.TransferRoots()
    if read < roots:
        findings.append(f"{roots - read} of {roots} roots could not be read by OCCT")
    findings += _shortened(_said(reader.WS().TransferReader().TransientProcess().CheckList(False), "not mapped"))
    findings += _shortened(faults + [each for each in said if each.startswith(_ENTITY)])
    gathered = _Gathered(task["most_curves"], task["most_points"])
    for i in range(1, reader.NbShapes() + 1):
        gathered.add(reader.Shape(i))
    wanted = bool(task["edges"])
    if not wanted and not gathered.groups and gathered.bodies:
        wanted = True
        findings.append("no free curves; these are the edges of its faces")
    if wanted:
        gathered.add_edges_of_faces()
    elif gathered.bodies:
        findings.append("edges of faces are left out; edges=True (--edges) reads them too")
    return {"units": units, "findings": findings + gathered.findings(), "groups": gathered.groups}


def _step(file: str) -> tuple[Any, list[str], list[str], str]:
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    with tempfile.TemporaryDirectory(prefix="splinefeed-") as folder:
        said = _listened(os.path.join(folder, "said"))
        done = reader.ReadFile(file) == IFSelect_RetDone
        said.Close()
        if not done:
            words = pathlib.Path(folder, "said").read_text(encoding="utf-8", errors="replace")
            line = _SYNTAX.search(words)
            raise FormatError(f"line {line[1]}: OCCT says: {line[2]}; is the file complete?" if line else _UNSOUND)
    return reader, occt_splines.mend_step(reader.WS().Model()), [], _step_units(reader)


def _listened(file: str) -> Any:
    """What writes the messages of OCCT to `file` from here on."""
    from OCP.Message import Message, Message_Gravity, Message_PrinterOStream

    said = Message_PrinterOStream(file, False, Message_Gravity.Message_Trace)
    messenger = Message.DefaultMessenger_s()
    messenger.ChangePrinters().Clear()
    messenger.AddPrinter(said)
    return said


def _step_units(reader: Any) -> str:
    """The unit of length of the first shape, as the file calls it."""
    try:
        from OCP.collections import Sequence_TCollection_AsciiString as Names
    except ImportError:  # before OCP 8
        from OCP.TColStd import TColStd_SequenceOfAsciiString as Names
    lengths, angles, solid_angles = Names(), Names(), Names()
    reader.FileUnits(lengths, angles, solid_angles)
    return str(lengths.Value(1).ToCString()) if lengths.Length() else ""


def _iges(file: str) -> tuple[Any, list[str], list[str], str]:
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.IGESControl import IGESControl_Reader
    from OCP.Interface import Interface_Static

    reader = IGESControl_Reader()
    # 0: no splitting of curves where a derivative jumps
    Interface_Static.SetIVal_s("read.iges.bspline.continuity", 0)
    if reader.ReadFile(file) != IFSelect_RetDone or not (model := reader.IGESModel()).NbEntities():
        raise FormatError(_UNSOUND)
    section, findings = model.GlobalSection(), []
    scale = section.Scale()
    if scale != 1.0:
        findings.append(f"the model space is {scale:g} times the real size by the header; the model is read as it is")
    name = section.UnitName()
    units = {1: "in", 2: "mm", 4: "ft", 5: "mi", 6: "m", 7: "km", 8: "mil", 9: "um", 10: "cm", 11: "uin"}
    said = name.ToCString() if name is not None else ""
    return reader, occt_splines.check_iges(model), findings, units.get(section.UnitFlag(), said)


def _said(checks: Any, warning: str = "") -> list[str]:
    """What `checks` of OCCT hold against the file and its entities, which count from 1 in the order of the file.

    Of its warnings those are taken that hold the words `warning`.
    """
    found = []
    checks.Start()
    while checks.More():
        check = checks.Value()
        words = [check.CFail(i) for i in range(1, check.NbFails() + 1)]
        words += [said for i in range(1, check.NbWarnings() + 1) if warning and warning in (said := check.CWarning(i))]
        place = f"{_ENTITY}{checks.Number()}: " if checks.Number() else ""
        found += [f"{place}OCCT says: {_sentence(each)}" for each in words]
        checks.Next()
    return found


def _shortened(faults: list[str]) -> list[str]:
    more = [f"... and {len(faults) - MOST_FAULTS} more of OCCT's checks"] if len(faults) > MOST_FAULTS else []
    return faults[:MOST_FAULTS] + more


def _sentence(words: str) -> str:
    return " ".join(words.split()).rstrip(".")


class _Gathered:
    """Curves of shapes: wires and edges as they stand, faces kept for later."""

    def __init__(self, most_curves: int, most_points: int) -> None:
        self.most_curves, self.most_points = most_curves, most_points
        self.groups: list[dict[str, Any]] = []
        self.bodies: list[Any] = []
        self.curves = self.points = 0
        self.left_out: dict[str, int] = {}
        self.approximated: list[str] = []

    def add(self, shape: Any) -> None:
        """The curves of `shape`; one path a wire, one an edge."""
        from OCP.TopAbs import TopAbs_COMPOUND, TopAbs_EDGE, TopAbs_VERTEX, TopAbs_WIRE

        stack = [shape]
        while stack:
            each = stack.pop()
            if each.IsNull():
                continue
            kind = each.ShapeType()
            if kind == TopAbs_EDGE:
                self.add_group([each])
            elif kind == TopAbs_WIRE:
                self.add_group(list(_edges_of_wire(each)))
            elif kind == TopAbs_COMPOUND:
                stack += reversed(_members(each))
            elif kind == TopAbs_VERTEX:
                self.leave_out("point")
            else:
                self.bodies.append(each)

    def add_edges_of_faces(self) -> None:
        """Every edge of the bodies once, as its curve runs."""
        from OCP.TopAbs import TopAbs_EDGE
        from OCP.TopExp import TopExp_Explorer

        seen: dict[int, list[Any]] = {}
        for body in self.bodies:
            explorer = TopExp_Explorer(body, TopAbs_EDGE)
            while explorer.More():
                edge = explorer.Current()
                explorer.Next()
                alike = seen.setdefault(hash(edge), [])
                if not any(edge.IsSame(other) for other in alike):
                    alike.append(edge)
                    self.add_group([edge], as_it_runs=True)

    def add_group(self, edges: list[Any], *, as_it_runs: bool = False) -> None:
        """A path of `edges`, those without a curve in space left out."""
        curves = []
        for edge in edges:
            found = self.curve(edge)
            if found is not None:
                found["reversed"] = not as_it_runs and _is_reversed(edge)
                curves.append(found)
        if curves:
            self.groups.append({"name": "", "curves": curves})

    def curve(self, edge: Any) -> dict[str, Any] | None:
        """The curve of an edge, None if there is none that a tool can follow."""
        from OCP.BRep import BRep_Tool
        from OCP.BRepAdaptor import BRepAdaptor_Curve

        edge = _as_edge(edge)
        if BRep_Tool.Degenerated_s(edge):
            self.leave_out("edge of no length")
            return None
        adaptor = BRepAdaptor_Curve(edge)
        if not adaptor.Is3DCurve():
            self.leave_out("curve in the parameters of a surface")
            return None
        first, last = adaptor.FirstParameter(), adaptor.LastParameter()
        if not (math.isfinite(first) and math.isfinite(last)) or max(abs(first), abs(last)) > INFINITE:
            self.leave_out("curve without ends")
            return None
        self.curves += 1
        if self.curves > self.most_curves:
            raise FormatError(f"holds more than {self.most_curves} curves; that is more than can be read")
        found = self.described(edge, adaptor, first, last)
        self.points += len(found.get("points", ()))
        if self.points > self.most_points:
            raise FormatError(f"holds more than {self.most_points} control points; that is more than can be read")
        return found

    def described(self, edge: Any, adaptor: Any, first: float, last: float) -> dict[str, Any]:
        """What `cad_curves.curves_of` makes a curve of: an arc, or a B-spline as exact as the file has it."""
        from OCP import GeomAbs
        from OCP.BRep import BRep_Tool
        from OCP.Geom import Geom_TrimmedCurve
        from OCP.GeomConvert import GeomConvert

        kind = adaptor.GetType()
        if kind in (GeomAbs.GeomAbs_Circle, GeomAbs.GeomAbs_Ellipse):
            return _arc(adaptor, kind == GeomAbs.GeomAbs_Circle, first, last)
        if kind == GeomAbs.GeomAbs_BSplineCurve:
            return _b_spline(adaptor.BSpline(), first, last)
        if kind not in (GeomAbs.GeomAbs_OffsetCurve, GeomAbs.GeomAbs_OtherCurve):
            part = Geom_TrimmedCurve(BRep_Tool.Curve_s(edge, 0.0, 0.0), first, last)
            return _b_spline(GeomConvert.CurveToBSplineCurve_s(part), first, last)
        return self.approximation(adaptor, first, last)

    def approximation(self, adaptor: Any, first: float, last: float) -> dict[str, Any]:
        """A B-spline near a curve that is none, such as the offset of one."""
        from OCP.Approx import Approx_Curve3d
        from OCP.GeomAbs import GeomAbs_C2

        made = Approx_Curve3d(adaptor, OFFSET_TOLERANCE, GeomAbs_C2, OFFSET_SPANS, 9)
        if not made.IsDone() or not made.HasResult():
            raise FormatError("holds an offset curve that no B-spline approximates closely enough")
        self.approximated.append(f"an offset curve is approximated; largest distance {made.MaxError():.3g} mm")
        return _b_spline(made.Curve(), first, last)

    def leave_out(self, what: str) -> None:
        """Count what is not a tool path."""
        self.left_out[what] = self.left_out.get(what, 0) + 1

    def findings(self) -> list[str]:
        """What was left out and what was approximated."""
        return [f"left out: {count} x {what}" for what, count in self.left_out.items()] + self.approximated


def _members(shape: Any) -> list[Any]:
    """The shapes that a compound or a wire directly holds."""
    from OCP.TopoDS import TopoDS_Iterator

    found, iterator = [], TopoDS_Iterator(shape)
    while iterator.More():
        found.append(iterator.Value())
        iterator.Next()
    return found


def _edges_of_wire(wire: Any) -> Iterator[Any]:
    """The edges of a wire one behind the other where it is sound, else as they stand."""
    from OCP.BRepTools import BRepTools_WireExplorer
    from OCP.TopoDS import TopoDS

    listed = _members(wire)
    ordered: list[Any] = []
    explorer = BRepTools_WireExplorer(TopoDS.Wire_s(wire) if hasattr(TopoDS, "Wire_s") else TopoDS.Wire(wire))
    while explorer.More() and len(ordered) <= len(listed):
        ordered.append(explorer.Current())
        explorer.Next()
    yield from ordered if len(ordered) == len(listed) else listed


def _as_edge(shape: Any) -> Any:
    from OCP.TopoDS import TopoDS

    return TopoDS.Edge_s(shape) if hasattr(TopoDS, "Edge_s") else TopoDS.Edge(shape)  # the name changed with OCP 8


def _is_reversed(edge: Any) -> bool:
    from OCP.TopAbs import TopAbs_REVERSED

    return bool(edge.Orientation() == TopAbs_REVERSED)


def _xyz(point: Any) -> tuple[float, float, float]:
    return point.X(), point.Y(), point.Z()


def _arc(adaptor: Any, circle: bool, first: float, last: float) -> dict[str, Any]:
    """Centre, the two conjugate radii, and the stretch of their parameter."""
    conic = adaptor.Circle() if circle else adaptor.Ellipse()
    radii = (conic.Radius(), conic.Radius()) if circle else (conic.MajorRadius(), conic.MinorRadius())
    axes = [
        [radius * value for value in _xyz(axis.Direction())]
        for radius, axis in zip(radii, (conic.XAxis(), conic.YAxis()), strict=True)
    ]
    return {"type": "arc", "center": _xyz(conic.Location()), "x": axes[0], "y": axes[1], "first": first, "last": last}


def _b_spline(curve: Any, first: float, last: float) -> dict[str, Any]:
    """Knots, points and weights as they are; a periodic curve is cut open where the edge begins, which is exact."""
    if curve.IsPeriodic():
        start, end = curve.FirstParameter(), curve.LastParameter()
        if first == start and last == end:
            curve.SetNotPeriodic()
        else:
            curve.Segment(first, last)
    places = range(1, curve.NbPoles() + 1)
    knots: list[float] = []
    for i in range(1, curve.NbKnots() + 1):
        knots += [curve.Knot(i)] * curve.Multiplicity(i)
    return {
        "type": "nurbs",
        "degree": curve.Degree(),
        "knots": knots,
        "points": [_xyz(curve.Pole(i)) for i in places],
        "weights": [curve.Weight(i) for i in places] if curve.IsRational() else None,
        "first": first,
        "last": last,
    }
