"""What OCCT makes of a STEP or IGES file, as descriptions of curves; runs in the process of `cad_process` only."""

from __future__ import annotations

import os
import pathlib
import re
from collections.abc import Iterator
from itertools import groupby, islice
from typing import Any

from OCP import GeomAbs
from OCP.Approx import Approx_Curve3d
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepTools import BRepTools_WireExplorer
from OCP.Geom import Geom_TrimmedCurve
from OCP.GeomConvert import GeomConvert
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESControl import IGESControl_Reader
from OCP.Interface import Interface_Static
from OCP.Message import Message, Message_Gravity, Message_PrinterOStream
from OCP.STEPControl import STEPControl_Reader
from OCP.StepData import StepData_LFalse
from OCP.StepGeom import StepGeom_Axis2Placement3d
from OCP.StepShape import StepShape_GeometricSet, StepShape_GeometricSetSelect, StepShape_ShapeRepresentation
from OCP.StepVisual import (
    StepVisual_Invisibility,
    StepVisual_PresentationLayerAssignment,
    StepVisual_StyledItem,
)
from OCP.TopAbs import TopAbs_COMPOUND, TopAbs_EDGE, TopAbs_REVERSED, TopAbs_VERTEX, TopAbs_WIRE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Iterator

from splinefeed.errors import FormatError
from splinefeed.formats.cad_process import Curve, Gathered, arc_of, nurbs
from splinefeed.formats.drawing import DASHED

try:
    from OCP.collections import Sequence_TCollection_AsciiString as Names
except ImportError:  # before OCP 8
    from OCP.TColStd import TColStd_SequenceOfAsciiString as Names

#: Ends of a line farther out than this, mm, are OCCT's sign for infinite.
INFINITE = 1e50
#: How far an approximation may be from an offset curve that is no circle and no line, mm, and its most spans.
OFFSET_TOLERANCE = 1e-7
OFFSET_SPANS = 2000
#: An end of an edge this near to an end of its curve, mm and as a share of the domain, is that end: edges are cut by
#: points that are rounded.
SAME_END, SAME_PARAMETER = 1e-7, 1e-3
#: Resolution below which an IGES file's word for it is not believed, units of the file: what ten digits are worth.
LEAST_RESOLUTION = 1e-6
#: Most faults of a file that are findings each when it is repaired.
MOST_FAULTS = 5
#: So much of what OCCT says of a file is looked at, letters.
MOST_SAID = 4000
_SYNTAX = re.compile(r"Line (\d+): (.*?)(?<!\s)\s*+\*{4}")
_ENTITY = "entity "
_UNSOUND = "OCCT finds no valid data in it; is the file complete?"
_FULL_KNOT = (
    "a B-spline has an inner knot of multiplicity degree + 1, which OCCT cannot hold; let the CAD split it there"
)
_DATE = "Incorrect Date Format"
#: Types of curves in IGES, and patterns of lines that have gaps (IGES 5.3, directory entry, field 4).
_CURVES, _DASHES = frozenset((100, 102, 104, 106, 110, 112, 126)), frozenset(range(2, 6))
_IGES_UNITS = {1: "in", 2: "mm", 4: "ft", 5: "mi", 6: "m", 7: "km", 8: "mil", 9: "um", 10: "cm", 11: "uin"}


def read(task: dict[str, Any]) -> dict[str, Any]:
    """Answer a task of the kind "step" or "iges".

    Parameters
    ----------
    task : dict
        See `cad_process`.

    Returns
    -------
    dict
        What `Gathered.answer` returns.

    Raises
    ------
    FormatError
        For what OCCT holds against the file as a whole, a finding when repairing; what it holds against single entities
        are findings.
    """
    gathered = _Shapes(task)
    reader, faults, units = (_step if task["kind"] == "step" else _iges)(task["file"], pathlib.Path(task["folder"]))
    _look_for_hidden(reader, gathered, task["kind"])
    said = _said(reader.WS().ModelCheckList(True))
    dates = [each for each in said if _DATE in each]
    if dates:
        gathered.findings.append("a date in the header of the file is missing or not valid; no curve depends on it")
    said = [each for each in said if each not in dates]
    faults += [each for each in said if not each.startswith(_ENTITY)]
    if faults and not task["repair"]:
        raise FormatError(faults[0] + (f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""))
    roots = reader.NbRootsForTransfer()
    if roots == 0:
        raise FormatError("holds no geometry that OCCT can read; was it exported whole?")
    read = reader.TransferRoots()
    if read < roots:
        gathered.findings.append(f"{roots - read} of {roots} roots could not be read by OCCT")
    faults += [each for each in said if each.startswith(_ENTITY)]
    faults = _said(reader.WS().TransferReader().TransientProcess().CheckList(False), "not mapped") + faults
    gathered.findings += faults[:MOST_FAULTS] + ["... and more of OCCT's checks"] * (len(faults) > MOST_FAULTS)
    for i in range(1, reader.NbShapes() + 1):
        gathered.add_shape(reader.Shape(i))
    if gathered.wants_edges():
        gathered.add_edges_of_faces()
    return gathered.answer(units)


def _step(file: str, folder: pathlib.Path) -> tuple[Any, list[str], str]:
    """OCCT's reader of a STEP file, what is wrong with its curves, and the unit of its first shape.

    No curve is closed for OCCT from here on: it makes such curves periodic and drops the last weight. Points stay.
    """
    reader, faults = STEPControl_Reader(), []
    words = folder / "said"
    said = Message_PrinterOStream(os.fspath(words), False, Message_Gravity.Message_Trace)
    Message.DefaultMessenger_s().ChangePrinters().Clear()
    Message.DefaultMessenger_s().AddPrinter(said)
    done = reader.ReadFile(file) == IFSelect_RetDone
    said.Close()
    if not done:
        line = _SYNTAX.search(words.read_text(encoding="utf-8", errors="replace")[:MOST_SAID])
        raise FormatError(f"line {line[1]}: OCCT says: {line[2]}; is the file complete?" if line else _UNSOUND)
    model = reader.WS().Model()
    for number in range(1, model.NbEntities() + 1):
        curve = model.Value(number)
        if type(curve).__name__.startswith("StepGeom_BSplineCurveWithKnots"):
            curve.SetClosedCurve(StepData_LFalse)
            knots = curve
            if hasattr(curve, "WeightsData"):  # a rational one holds itself as parts
                knots = curve.BSplineCurveWithKnots()
                knots.SetClosedCurve(StepData_LFalse)
                curve.RationalBSplineCurve().SetClosedCurve(StepData_LFalse)
            inner = range(2, knots.NbKnotMultiplicities())
            if any(knots.KnotMultiplicitiesValue(i) > curve.Degree() for i in inner):
                faults.append(f"entity {number}: {_FULL_KNOT}")
    lengths, angles, solid_angles = Names(), Names(), Names()
    reader.FileUnits(lengths, angles, solid_angles)
    return reader, faults, str(lengths.Value(1).ToCString()) if lengths.Length() else ""


def _iges(file: str, folder: pathlib.Path) -> tuple[Any, list[str], str]:
    """OCCT's reader of an IGES file, what is wrong with its curves, and its unit.

    Faults are B-splines (126) that may jump and arcs (100) that do not end on the circle that they begin on: OCCT moves
    both. The error that a file allows itself is the resolution in its section G.
    """
    reader, faults = IGESControl_Reader(), []
    # 0: no splitting of curves where a derivative jumps
    Interface_Static.SetIVal_s("read.iges.bspline.continuity", 0)
    plain = _without_comments(pathlib.Path(file), folder / "plain.igs")
    done = reader.ReadFile(os.fspath(plain)) == IFSelect_RetDone
    if not done or not (model := reader.IGESModel()).NbEntities():
        raise FormatError(_UNSOUND)
    section = model.GlobalSection()
    allowed = max(section.Resolution(), LEAST_RESOLUTION)
    for number in range(1, model.NbEntities() + 1):
        curve = model.Entity(number)
        label, kind = f"entity D{model.DNum(curve)}", type(curve).__name__
        if kind == "IGESGeom_CircularArc":
            begin, end = (curve.Center().Distance(point) for point in (curve.StartPoint(), curve.EndPoint()))
            if not (begin > 0.0 and abs(end - begin) <= allowed):
                faults.append(f"{label}: an arc begins with radius {begin:.9g} and ends with {end:.9g}")
        elif kind == "IGESGeom_BSplineCurve":
            degree = curve.Degree()
            times = [len(list(run)) for _, run in groupby(curve.Knot(i - degree) for i in range(curve.NbKnots()))]
            if max(times[1:-1], default=0) > degree:
                faults.append(f"{label}: {_FULL_KNOT}")
    name = section.UnitName()
    return reader, faults, _IGES_UNITS.get(section.UnitFlag(), name.ToCString() if name is not None else "")


def _without_comments(file: pathlib.Path, target: pathlib.Path) -> pathlib.Path:
    """The file, or a copy without comments behind the parameters of its entities, which OCCT takes for parameters.

    A line of comment becomes an empty record, so that no line has another number. IGES 5.3, 2.2.4.5: what stands behind
    the record delimiter of an entity, on its lines, is comment.
    """
    lines = file.read_bytes().splitlines()
    delimiter, owner, ended, changed = b";", b"", False, False
    for i, line in enumerate(lines):
        if line[72:].strip() == b"G0000001" and (said := re.match(rb"(?:1H.)?.1H(.)", line[:12])):
            delimiter = said[1]
        if line[72:73] != b"P":
            continue
        ended = ended and line[64:72] == owner
        owner, end = line[64:72], 0 if ended else _record_end(line[:64], delimiter)
        ended |= end >= 0
        kept = (delimiter if ended and end == 0 else line[: end + 1]).ljust(64) if ended else line[:64]
        changed |= kept != line[:64]
        lines[i] = kept + line[64:]
    if not changed:
        return file
    target.write_bytes(b"\n".join([*lines, b""]))
    return target


def _record_end(text: bytes, delimiter: bytes) -> int:
    """Where the record delimiter stands in a line of parameters, outside of texts such as 3HA;B; -1 for nowhere."""
    at = 0
    while at < len(text):
        if said := re.match(rb"([0-9]+)H", text[at:]):
            at += said.end() + int(said[1])
        elif text[at : at + 1] == delimiter:
            return at
        else:
            at += 1
            while at < len(text) and text[at - 1 : at].isdigit() and text[at : at + 1].isdigit():
                at += 1
    return -1


def _look_for_hidden(reader: Any, gathered: Gathered, kind: str) -> None:
    """What the file does not show, blanked entities of IGES and invisible items of STEP, is left out and counted."""
    model = reader.WS().Model()
    every = (model.Value(number) for number in range(1, model.NbEntities() + 1))
    if kind == "step":
        styles = [each for each in every if isinstance(each, StepVisual_Invisibility | StepVisual_StyledItem)]
        if dashed := sum(_is_dashed(each) for each in styles if isinstance(each, StepVisual_StyledItem)):
            gathered.findings.append(f"{dashed} x {DASHED}")
        _leave_out_invisible(model, [each for each in styles if isinstance(each, StepVisual_Invisibility)], gathered)
        return
    if (scale := model.GlobalSection().Scale()) not in (0.0, 1.0):
        gathered.findings.append(
            f"the file has a model scale of {scale:g}: places are read as they are written; in the real world they are "
            f"{1.0 / scale:g} times as large"
        )
    entities = [each for each in every if each.SubordinateStatus() == 0]
    if dashed := sum(each.RankLineFont() in _DASHES for each in entities if each.TypeNumber() in _CURVES):
        gathered.findings.append(f"{dashed} x {DASHED}")
    blank = sum(each.BlankStatus() == 1 for each in entities)
    if blank:
        gathered.unshown["blanked entity"] += blank
        reader.SetReadVisible(not gathered.task["hidden"])


def _is_dashed(item: Any) -> bool:
    """Whether a styled item of STEP has a curve style whose font has gaps (ISO 10303-46, curve_style_font)."""
    for each in (item.StylesValue(i) for i in range(1, item.NbStyles() + 1)):
        for style in (each.StylesValue(i).CurveStyle() for i in range(1, each.NbStyles() + 1)):
            font = None if style is None else style.CurveFont()
            if font is not None and (known := font.PreDefinedCurveFont()) is not None:
                return bool(known.Name().ToCString().strip().casefold() not in ("continuous", ""))
            if font is not None and (made := font.CurveStyleFont()) is not None:
                patterns = (made.PatternListValue(i) for i in range(1, made.NbPatternList() + 1))
                return any(pattern.InvisibleSegmentLength() > 0.0 for pattern in patterns)
    return False


def _leave_out_invisible(model: Any, said: list[Any], gathered: Gathered) -> None:
    """Take items that INVISIBILITY names, by their style or layer, out of the shapes and sets of curves that list them.

    Styled items and layers of which nothing is to be shown are named by "invisibility" [1]_.

    References
    ----------
    .. [1] ISO 10303-46, 4.4 "invisibility".
    """
    unseen: list[tuple[Any, str]] = []
    for each in (
        entry.InvisibleItemsValue(i).Value() for entry in said for i in range(1, entry.NbInvisibleItems() + 1)
    ):
        if isinstance(each, StepVisual_StyledItem):
            unseen.append((each.ItemAP242().Value() or each.Item(), "invisible item"))
        elif isinstance(each, StepVisual_PresentationLayerAssignment):
            why = f"item on layer {each.Name().ToCString()[:40]!r}, off"
            items = (each.AssignedItemsValue(i).Value() for i in range(1, each.NbAssignedItems() + 1))
            unseen += [(item.Item() if isinstance(item, StepVisual_StyledItem) else item, why) for item in items]
    why_of = {id(item): why for item, why in unseen}  # OCP hands out one object for one entity, while it is kept
    found = set[int]()
    for number in range(1, model.NbEntities() + 1) if why_of else ():
        holder = model.Value(number)
        if isinstance(holder, StepShape_GeometricSet):
            listed = [holder.ElementsValue(i) for i in range(1, holder.NbElements() + 1)]
            ids = [id(each.Value()) for each in listed]
        elif isinstance(holder, StepShape_ShapeRepresentation):
            listed = [holder.ItemsValue(i) for i in range(1, holder.NbItems() + 1)]
            ids = [id(each) for each in listed]
        else:
            continue
        found |= why_of.keys() & {id(holder), *ids}
        shown = [each for each, key in zip(listed, ids, strict=True) if gathered.reads(why_of.get(key, ""))]
        whole = id(holder) in why_of and isinstance(holder, StepShape_ShapeRepresentation)
        if whole and not gathered.reads(why_of[id(holder)]):
            shown = []
        if len(shown) < len(listed):
            of_set = isinstance(holder, StepShape_GeometricSet)
            old = holder.Elements() if of_set else holder.Items()
            new = type(old)(1, max(len(shown), 1))
            for i, each in enumerate(shown, start=1):
                new.SetValue(i, each)
            if not shown:  # a place alone is no shape
                new.SetValue(1, StepShape_GeometricSetSelect() if of_set else StepGeom_Axis2Placement3d())
            (holder.SetElements if of_set else holder.SetItems)(new)
    if others := len(why_of.keys() - found):
        gathered.findings.append(
            f"{others} item(s) within a body or an assembly are invisible, and are read all the same"
        )


def _said(checks: Any, warning: str = "") -> list[str]:
    """What `checks` of OCCT hold against the file and its entities, which count from 1 in the order of the file.

    Of its warnings those are taken that hold the words `warning`.
    """
    found = []
    checks.Start()
    for check in _each(checks):
        words = [check.CFail(i) for i in range(1, check.NbFails() + 1)]
        words += [said for i in range(1, check.NbWarnings() + 1) if warning and warning in (said := check.CWarning(i))]
        place = f"{_ENTITY}{checks.Number()}: " if checks.Number() else ""
        found += [f"{place}OCCT says: {' '.join(each.split()).rstrip('.')}" for each in words]
    return found


def _each(iterator: Any, value: str = "Value") -> Iterator[Any]:
    """What an iterator of OCCT passes, by its method `value`."""
    while iterator.More():
        yield getattr(iterator, value)()
        iterator.Next()


class _Shapes(Gathered):
    """Curves of shapes: wires and edges as they stand, faces kept for later."""

    def add_shape(self, shape: Any) -> None:
        """The curves of `shape`; one path a wire, one an edge."""
        stack = [shape]
        while stack:
            each = stack.pop()
            if each.IsNull():
                continue
            kind = each.ShapeType()
            if kind == TopAbs_EDGE:
                self.add_edges([each])
            elif kind == TopAbs_WIRE:
                self.add_edges(_edges_of_wire(each))
            elif kind == TopAbs_COMPOUND:
                stack += reversed(list(_each(TopoDS_Iterator(each))))
            elif kind == TopAbs_VERTEX:
                self.left_out["point"] += 1
            else:
                self.bodies.append(each)

    def add_edges_of_faces(self) -> None:
        """Every edge of the bodies once, as its curve runs."""
        seen: dict[int, list[Any]] = {}
        for body in self.bodies:
            for edge in _each(TopExp_Explorer(body, TopAbs_EDGE), "Current"):
                alike = seen.setdefault(hash(edge), [])
                if not any(edge.IsSame(other) for other in alike):
                    alike.append(edge)
                    self.add_edges([edge], as_it_runs=True)

    def add_edges(self, edges: list[Any], *, as_it_runs: bool = False) -> None:
        """A path of `edges`, those without a curve in space left out."""
        curves = []
        for edge in edges:
            found = self.curve(_cast(edge, "Edge"))
            if found is not None:
                found["reversed"] = not as_it_runs and edge.Orientation() == TopAbs_REVERSED
                curves.append(found)
        if curves:
            self.add(curves)

    def curve(self, edge: Any) -> Curve | None:
        """The curve of an edge: an arc, or a B-spline as exact as the file has it; None if no tool can follow it."""
        adaptor = None if BRep_Tool.Degenerated_s(edge) else BRepAdaptor_Curve(edge)
        if adaptor is None or not adaptor.Is3DCurve():
            self.left_out["edge of no length" if adaptor is None else "curve in the parameters of a surface"] += 1
            return None
        first, last = adaptor.FirstParameter(), adaptor.LastParameter()
        if not max(abs(first), abs(last)) <= INFINITE:
            self.left_out["curve without ends"] += 1
            return None
        kind = adaptor.GetType()
        if kind in (GeomAbs.GeomAbs_Circle, GeomAbs.GeomAbs_Ellipse):
            return _arc(adaptor, kind == GeomAbs.GeomAbs_Circle, first, last)
        if kind == GeomAbs.GeomAbs_BSplineCurve:
            whole = adaptor.BSpline()
            ends = (whole.FirstParameter(), whole.LastParameter())
            slack = SAME_PARAMETER * (ends[1] - ends[0])
            if all(
                abs(u - end) <= slack and whole.Value(u).Distance(whole.Value(end)) <= SAME_END
                for u, end in zip((first, last), ends, strict=True)
            ):
                if whole.IsPeriodic():
                    whole.SetNotPeriodic()
                return _b_spline(whole)
        if kind in (GeomAbs.GeomAbs_OffsetCurve, GeomAbs.GeomAbs_OtherCurve):
            made = Approx_Curve3d(adaptor, OFFSET_TOLERANCE, GeomAbs.GeomAbs_C2, OFFSET_SPANS, 9)
            if not made.IsDone() or not made.HasResult():
                raise FormatError("holds an offset curve that no B-spline approximates closely enough")
            self.findings.append(f"an offset curve is approximated; largest distance {made.MaxError():.3g} mm")
            return _b_spline(made.Curve())
        part = Geom_TrimmedCurve(BRep_Tool.Curve_s(edge, 0.0, 0.0), first, last)
        return _b_spline(GeomConvert.CurveToBSplineCurve_s(part))


def _edges_of_wire(wire: Any) -> list[Any]:
    """The edges of a wire one behind the other where it is sound, else as they stand."""
    listed = list(_each(TopoDS_Iterator(wire)))
    explorer = BRepTools_WireExplorer(_cast(wire, "Wire"))
    ordered = list(islice(_each(explorer, "Current"), len(listed) + 1))
    return ordered if len(ordered) == len(listed) else listed


def _cast(shape: Any, kind: str) -> Any:
    return (getattr(TopoDS, f"{kind}_s", None) or getattr(TopoDS, kind))(shape)  # the name changed with OCP 8


def _xyz(point: Any) -> tuple[float, float, float]:
    return point.X(), point.Y(), point.Z()


def _arc(adaptor: Any, circle: bool, first: float, last: float) -> Curve:
    conic = adaptor.Circle() if circle else adaptor.Ellipse()
    radii = (conic.Radius(), conic.Radius()) if circle else (conic.MajorRadius(), conic.MinorRadius())
    x, y = (
        [radius * value for value in _xyz(axis.Direction())]
        for radius, axis in zip(radii, (conic.XAxis(), conic.YAxis()), strict=True)
    )
    return arc_of(_xyz(conic.Location()), x, y, first, last)


def _b_spline(curve: Any) -> Curve:
    places = range(1, curve.NbPoles() + 1)
    knots: list[float] = []
    for i in range(1, curve.NbKnots() + 1):
        knots += [curve.Knot(i)] * curve.Multiplicity(i)
    weights = [curve.Weight(i) for i in places] if curve.IsRational() else None
    return nurbs(curve.Degree(), knots, [_xyz(curve.Pole(i)) for i in places], weights)
