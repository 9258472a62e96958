"""Lengths of the curves in files of others, mm, by the libraries that are made for their formats: not by splinefeed.

`python tests/reference_lengths.py FOLDER` prints a page such as `tests/data/public_files.json` of the files in FOLDER.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import quad

PIXEL = 25.4 / 96.0
GAUSS = np.polynomial.legendre.leggauss(24)


def length(file: Path) -> float:
    """The length of all curves in `file` together, mm."""
    return float(math.fsum(_OF[file.suffix.lower()](file)))


def _dxf(file: Path) -> Iterable[float]:
    """ezdxf: entities of the model space, blocks taken apart."""
    from ezdxf import recover, units

    document, _ = recover.readfile(file)
    scale = units.conversion_factor(document.units, units.MM) if document.units else 1.0
    return (scale * each for entity in document.modelspace() for each in _of_entity(entity))


def _of_entity(entity: Any) -> Iterable[float]:
    kind = entity.dxftype()
    if entity.dxf.get("invisible", 0):
        return
    if kind == "INSERT":
        for insert in entity.multi_insert() if entity.mcount > 1 else [entity]:
            for each in insert.virtual_entities():
                yield from _of_entity(each)
    elif kind == "LINE":
        yield (entity.dxf.end - entity.dxf.start).magnitude
    elif kind in ("LWPOLYLINE", "POLYLINE") and not getattr(entity, "is_poly_face_mesh", False):
        for each in entity.virtual_entities():
            yield from _of_entity(each)
    elif kind == "CIRCLE":
        yield 2.0 * math.pi * entity.dxf.radius
    elif kind == "ARC":
        yield entity.dxf.radius * math.radians((entity.dxf.end_angle - entity.dxf.start_angle) % 360.0 or 360.0)
    elif kind == "ELLIPSE":
        tool = entity.construction_tool()
        sweep = (tool.end_param - tool.start_param) % math.tau or math.tau
        yield _ellipse(tool.major_axis.magnitude, tool.minor_axis.magnitude, tool.start_param, sweep)
    elif kind in ("SPLINE", "HELIX"):
        if not len(entity.control_points):
            raise ValueError("a spline by fit points has no length of its own")
        tool = entity.construction_tool()
        knots = sorted(set(tool.knots()))
        low, high = tool.knots()[tool.degree], tool.knots()[tool.count]
        knots = [u for u in knots if low <= u <= high]
        yield sum(
            _integral(lambda u: [d[1].xyz for d in tool.derivatives(u, 1)], a, b) for a, b in itertools.pairwise(knots)
        )


def _ellipse(rx: float, ry: float, start: float, sweep: float) -> float:
    def speed(t: float) -> float:
        return math.hypot(rx * math.sin(t), ry * math.cos(t))

    return abs(quad(speed, start, start + sweep, epsrel=1e-12, epsabs=0.0, limit=500)[0])


def _integral(slope: Callable[[Any], Any], begin: float, end: float, parts: int = 16) -> float:
    """The integral of the norm of `slope` of many places by Gauss's rule."""
    edges = np.linspace(begin, end, parts + 1)
    half = 0.5 * np.diff(edges)
    places = (edges[:-1] + half)[:, None] + half[:, None] * GAUSS[0]
    speeds = np.linalg.norm(np.array(slope(places.ravel())), axis=1).reshape(places.shape)
    return float((speeds @ GAUSS[1]) @ half)


def _svg(file: Path) -> Iterable[float]:
    """svgelements: every shape that it draws."""
    import svgelements

    for shape in svgelements.SVG.parse(str(file), reify=True, ppi=96.0).elements():
        if not isinstance(shape, svgelements.Shape) or shape.values.get("visibility") == "hidden":
            continue
        for segment in abs(svgelements.Path(shape)):
            if isinstance(segment, svgelements.Move) or segment.start == segment.end:
                continue
            if isinstance(segment, svgelements.Arc):
                yield PIXEL * _ellipse(segment.rx, segment.ry, segment.get_start_t(), segment.sweep)
                continue
            names = ("start", "control", "control1", "control2", "end")
            points = np.array([[*getattr(segment, name)] for name in names if hasattr(segment, name)])
            steps, degree = len(points[:-1]) * np.diff(points, axis=0), len(points) - 2
            weights = [math.comb(degree, k) for k in range(degree + 1)]

            def slope(t: Any, steps: Any = steps, degree: int = degree, weights: Any = weights) -> Any:
                return np.array([w * t**k * (1.0 - t) ** (degree - k) for k, w in enumerate(weights)]).T @ steps

            yield PIXEL * _integral(slope, 0.0, 1.0, 64)


def _occt(file: Path) -> Iterable[float]:
    """OCCT: every edge once."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GCPnts import GCPnts_AbscissaPoint
    from OCP.IGESControl import IGESControl_Reader
    from OCP.Message import Message
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    Message.DefaultMessenger_s().ChangePrinters().Clear()
    reader = IGESControl_Reader() if file.suffix.lower() in (".igs", ".iges") else STEPControl_Reader()
    reader.ReadFile(str(file))
    reader.TransferRoots()
    explorer = TopExp_Explorer(reader.OneShape(), TopAbs_EDGE)
    seen: list[Any] = []
    while explorer.More():
        if not any(explorer.Current().IsSame(each) for each in seen):
            seen.append(explorer.Current())
        explorer.Next()
    for edge in seen:
        curve = BRepAdaptor_Curve(TopoDS.Edge(edge))
        if curve.Is3DCurve():
            yield GCPnts_AbscissaPoint.Length_s(curve, 1e-9)


def _rhino(file: Path) -> Iterable[float]:
    """rhino3dm: every curve, by its derivatives between its knots; where there is none, the edges of bodies."""
    import rhino3dm

    found = rhino3dm.File3dm.Read(str(file))
    scale = {"Millimeters": 1.0, "Centimeters": 10.0, "Meters": 1000.0, "Inches": 25.4}[
        found.Settings.ModelUnitSystem.name
    ]
    shapes = [each.Geometry for each in found.Objects]
    curves = [each for each in shapes if isinstance(each, rhino3dm.Curve)]
    if not curves:
        bodies = [each.ToBrep(False) if isinstance(each, rhino3dm.Extrusion) else each for each in shapes]
        curves = [edge for each in bodies if isinstance(each, rhino3dm.Brep) for edge in each.Edges]
    for curve in curves:
        made = curve.ToNurbsCurve()
        knots = sorted(set(made.Knots))

        def slope(places: Any, curve: Any = made) -> Any:
            found = [curve.DerivativeAt(u, 1)[1] for u in places]
            return [[each.X, each.Y, each.Z] for each in found]

        yield scale * sum(_integral(slope, a, b) for a, b in itertools.pairwise(knots))


_OF: dict[str, Callable[[Path], Iterable[float]]] = {
    ".dxf": _dxf, ".svg": _svg, ".stp": _occt, ".step": _occt, ".igs": _occt, ".iges": _occt, ".3dm": _rhino,
}  # fmt: skip


def main(folder: Path) -> None:
    """Print the page of the files in `folder`."""
    page = {}
    for file in sorted(each for each in folder.rglob("*") if each.suffix.lower() in _OF):
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
        page[str(file.relative_to(folder))] = {"sha256": digest, "length_mm": length(file)}
    print(json.dumps(page, indent=1))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
