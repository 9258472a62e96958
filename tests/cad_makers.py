"""CAD files made by OCCT itself, for tests: edges of every kind, assemblies, units; and its own length of an edge."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeWire
from OCP.collections import Array1_double, Array1_gp_Pnt, Array1_int
from OCP.GCPnts import GCPnts_AbscissaPoint, GCPnts_UniformAbscissa
from OCP.Geom import Geom_BezierCurve, Geom_BSplineCurve
from OCP.gp import gp_Ax1, gp_Ax2, gp_Circ, gp_Dir, gp_Elips, gp_Hypr, gp_Parab, gp_Pnt, gp_Trsf, gp_Vec
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESControl import IGESControl_Writer
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound

Message.DefaultMessenger_s().ChangePrinters().Clear()
SKEW = gp_Ax2(gp_Pnt(1, 2, 3), gp_Dir(1, 1, 1))


def loop() -> Geom_BSplineCurve:
    """Closed, with other weights at its end than at its beginning."""
    rows = wiggle()
    rows[-1] = rows[0]
    return b_spline(rows, [0, 0.2, 0.5, 0.7, 0.8, 1.5], [4, 1, 1, 2, 1, 4], 3, [*WEIGHTS[:-1], 3.0])


def edge(*arguments: Any) -> Any:
    return BRepBuilderAPI_MakeEdge(*arguments).Edge()


def points_of(rows: Any) -> Any:
    array = Array1_gp_Pnt(1, len(rows))
    for i, row in enumerate(rows, start=1):
        array.SetValue(i, gp_Pnt(*map(float, row)))
    return array


def numbers_of(values: Any, kind: Any = Array1_double) -> Any:
    array = kind(1, len(values))
    for i, value in enumerate(values, start=1):
        array.SetValue(i, value)
    return array


def b_spline(
    rows: Any, knots: Any, counts: Any, degree: int, weights: Any = None, periodic: bool = False
) -> Geom_BSplineCurve:
    where, times = numbers_of([float(k) for k in knots]), numbers_of(counts, Array1_int)
    if weights is None:
        return Geom_BSplineCurve(points_of(rows), where, times, degree, periodic)
    return Geom_BSplineCurve(points_of(rows), numbers_of(weights), where, times, degree, periodic)


def wiggle(count: int = 9, seed: int = 1) -> Any:
    random = np.random.default_rng(seed)
    return np.column_stack([np.linspace(0.0, 40.0, count), random.normal(size=(count, 2)) * 8.0])


def cubic(weights: Any = None) -> Geom_BSplineCurve:
    return b_spline(wiggle(), [0, 0.2, 0.5, 0.7, 0.8, 1.5], [4, 1, 1, 2, 1, 4], 3, weights)


def ring(weights: Any = None) -> Geom_BSplineCurve:
    """Periodic: six points about the origin, uniform knots."""
    angles = np.arange(6) / 6.0 * 2.0 * np.pi
    rows = np.column_stack([30.0 * np.cos(angles), 20.0 * np.sin(angles), 5.0 * np.sin(2 * angles)])
    return b_spline(rows, range(7), [1] * 7, 3, weights, periodic=True)


WEIGHTS = [1.0, 2.0, 0.5, 1.0, 1.5, 1.0, 0.7, 1.0, 1.0]
#: Edges by name, with degree, number of control points and whether rational, of the curve that must come out.
EDGES: dict[str, tuple[Any, tuple[int, int, bool]]] = {
    "line": (edge(gp_Pnt(0, 0, 0), gp_Pnt(1, 2, 3)), (1, 2, False)),
    "circle": (edge(gp_Circ(SKEW, 5.0)), (2, 9, True)),
    "arc": (edge(gp_Circ(SKEW, 5.0), 0.3, 2.9), (2, 5, True)),
    "quarter": (edge(gp_Circ(SKEW, 5.0), 0.5 * np.pi, np.pi), (2, 3, True)),
    "ellipse": (edge(gp_Elips(SKEW, 5.0, 2.0)), (2, 9, True)),
    "elliptic arc": (edge(gp_Elips(SKEW, 5.0, 2.0), 5.0, 7.5), (2, 5, True)),
    "hyperbola": (edge(gp_Hypr(SKEW, 5.0, 2.0), -1.0, 1.5), (2, 3, True)),
    "parabola": (edge(gp_Parab(SKEW, 2.0), -3.0, 5.0), (2, 3, False)),
    "bezier": (edge(Geom_BezierCurve(points_of(wiggle(6)))), (5, 6, False)),
    "rational bezier": (edge(Geom_BezierCurve(points_of(wiggle(6)), numbers_of(WEIGHTS[:6]))), (5, 6, True)),
    "spline": (edge(cubic()), (3, 9, False)),
    "rational spline": (edge(cubic(WEIGHTS)), (3, 9, True)),
    "trimmed spline": (edge(cubic(), 0.1, 0.75), (3, 8, False)),
    "trimmed rational spline": (edge(cubic(WEIGHTS), 0.5, 0.8), (3, 6, True)),
    "ring": (edge(ring()), (3, 9, False)),
    "rational ring": (edge(ring(WEIGHTS[:6])), (3, 9, True)),
    "loop": (edge(loop()), (3, 9, True)),
    "part of a ring": (edge(ring(), 1.5, 4.5), (3, 7, False)),
}


def length(shape: Any) -> float:
    return float(GCPnts_AbscissaPoint.Length_s(BRepAdaptor_Curve(shape), 1e-10))


def points(shape: Any, count: int = 17) -> Any:
    """Points of the edge (count, 3) at equal steps of its length, by OCCT."""
    adaptor = BRepAdaptor_Curve(shape)
    even = GCPnts_UniformAbscissa(adaptor, count, 1e-10)
    places = [adaptor.Value(even.Parameter(i)) for i in range(1, count + 1)]
    return np.array([[place.X(), place.Y(), place.Z()] for place in places])


def wire(*edges: Any) -> Any:
    maker = BRepBuilderAPI_MakeWire()
    for each in edges:
        maker.Add(each)
    return maker.Wire()


def compound(*shapes: Any) -> Any:
    made = TopoDS_Compound()
    builder = BRep_Builder()
    builder.MakeCompound(made)
    for shape in shapes:
        builder.Add(made, shape)
    return made


def placed(shape: Any, angle: float, move: tuple[float, float, float]) -> Any:
    """`shape` turned about z and moved, as an instance: its geometry stays, its location changes."""
    turn, shift = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), angle)
    shift.SetTranslation(gp_Vec(*move))
    return shape.Moved(TopLoc_Location(shift.Multiplied(turn)))


def write_step(file: Path, *shapes: Any, unit: str = "MM", assembly: bool = False) -> None:
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", unit)
    Interface_Static.SetIVal_s("write.step.assembly", int(assembly))
    for shape in shapes:
        assert writer.Transfer(shape, STEPControl_AsIs) == IFSelect_RetDone
    assert writer.Write(str(file)) == IFSelect_RetDone
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    Interface_Static.SetIVal_s("write.step.assembly", 0)


def write_iges(file: Path, *shapes: Any, unit: str = "MM") -> None:
    writer = IGESControl_Writer(unit, 0)
    for shape in shapes:
        writer.AddShape(shape)
    writer.ComputeModel()
    assert writer.Write(str(file))
