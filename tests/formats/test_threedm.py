"""3DM files that rhino3dm wrote, of every version: kinds of curves, units, layers, blocks, edges of solids."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rhino3dm as rhino

from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import FormatError
from splinefeed.formats.registry import read, read_all

RING = [(10.0 * math.cos(a), 6.0 * math.sin(a), 2.0 * math.sin(2.0 * a)) for a in np.arange(7) / 7.0 * 2.0 * math.pi]
BENT = [(50.0 + 3.0 * i, 5.0 * math.sin(1.7 * i), float(i % 3)) for i in range(7)]


def ring(periodic: bool = True) -> Any:
    return rhino.NurbsCurve.Create(periodic, 3, [rhino.Point3d(*each) for each in (RING if periodic else BENT)])


def circle() -> Any:
    made = rhino.ArcCurve.CreateFromCircle(rhino.Circle(rhino.Point3d(1, 2, 30), 5.0))
    made.Rotate(0.7, rhino.Vector3d(1, 1, 0), rhino.Point3d(0, 0, 30))
    return made


def arc() -> Any:
    return rhino.ArcCurve.CreateFromArc(
        rhino.Arc(rhino.Point3d(0, 0, 60), rhino.Point3d(5, 3, 61), rhino.Point3d(8, 0, 60))
    )


def line() -> Any:
    return rhino.LineCurve(rhino.Point3d(0, 50, 0), rhino.Point3d(1, 52, 3))


def polyline() -> Any:
    points = rhino.Polyline(4)
    for place in ((0, 0, 90), (1, 0, 90), (1, 2, 90), (0, 5, 95)):
        points.Add(*place)
    return points.ToPolylineCurve()


def polycurve() -> Any:
    made = rhino.PolyCurve()
    made.AppendSegment(rhino.LineCurve(rhino.Point3d(-5, 0, 60), rhino.Point3d(0, 0, 60)))
    made.AppendSegment(arc())
    made.Translate(rhino.Vector3d(0, 0, 60))
    return made


#: Curves by name, with degree, number of control points and whether rational, of the curve that must come out.
CURVES: dict[str, tuple[Any, tuple[int, int, bool]]] = {
    "ring": (ring(), (3, 10, False)),
    "spline": (ring(periodic=False), (3, 7, False)),
    "circle": (circle(), (2, 9, True)),
    "arc": (arc(), (2, 5, True)),
    "line": (line(), (1, 2, False)),
    "polyline": (polyline(), (1, 4, False)),
    "polycurve": (polycurve(), (2, 7, True)),
}


def assert_same_points(curve: NurbsCurve, theirs: Any, scale: float) -> None:
    """Every point of Rhino's curve lies on ours: among 4001 of ours there is one as near as their step."""
    domain = theirs.Domain
    wanted = [theirs.PointAt(t) for t in np.linspace(domain.T0, domain.T1, 41)]
    rows = scale * np.array([[point.X, point.Y, point.Z] for point in wanted])
    ours = curve(np.linspace(*curve.domain, 4001))[:, : curve.axes]
    steps = np.linalg.norm(rows[:, None, : curve.axes] - ours[None], axis=2).min(axis=1)
    assert np.max(steps) < curve.length / 3000.0
    assert np.allclose(curve.ends, rows[[0, -1], : curve.axes], rtol=0.0, atol=1e-12 * np.abs(rows).max())


@pytest.mark.parametrize("version", range(2, 9))
def test_every_kind_of_curve_and_every_version(tmp_path: Path, version: int) -> None:
    file = rhino.File3dm()
    file.Settings.ModelUnitSystem = rhino.UnitSystem.Inches
    for name, (curve, _) in CURVES.items():
        attributes = rhino.ObjectAttributes()
        attributes.Name = name
        file.Objects.AddCurve(curve, attributes)
    file.Objects.AddPoint(rhino.Point3d(0, 0, 0))
    assert file.Write(str(tmp_path / "part.3dm"), version)
    contents = read_all(tmp_path / "part.3dm")
    assert contents.units == "in"
    assert contents[0].findings == ("left out: 1 x Point",)
    assert [path.name.partition("#")[0] for path in contents] == list(CURVES)
    for path, (theirs, kind) in zip(contents, CURVES.values(), strict=True):
        (curve,) = path.curves
        assert (curve.degree, len(curve.control_points), curve.rational) == kind
        assert curve.clamped
        assert_same_points(curve, theirs, 25.4)


def test_a_periodic_curve_closes_smoothly(tmp_path: Path) -> None:
    file = rhino.File3dm()
    file.Objects.AddCurve(ring())
    file.Write(str(tmp_path / "part.3dm"), 7)
    path = read(tmp_path / "part.3dm")
    assert path.closed and not len(path.corners)
    start, end = path.curves[0].derivatives(np.array(path.curves[0].domain), 2)
    assert np.allclose(start, end, rtol=0.0, atol=1e-11)


def test_layers_are_chosen_by_name(tmp_path: Path) -> None:
    file = rhino.File3dm()
    for name in ("cut", "mark"):
        layer = rhino.Layer()
        layer.Name = name
        attributes = rhino.ObjectAttributes()
        attributes.LayerIndex = file.Layers.Add(layer)
        file.Objects.AddCurve(line() if name == "cut" else circle(), attributes)
    file.Write(str(tmp_path / "part.3dm"), 7)
    assert len(read_all(tmp_path / "part.3dm")) == 2
    (path,) = read_all(tmp_path / "part.3dm", layer="cut")
    assert path.curves[0].degree == 1
    with pytest.raises(FormatError, match=r"part\.3dm: layer 'bore' is not there; layers are cut, mark"):
        read_all(tmp_path / "part.3dm", layer="cut,bore")


def test_blocks_are_put_where_their_references_have_them(tmp_path: Path) -> None:
    file = rhino.File3dm()
    plain = rhino.ObjectAttributes()
    file.InstanceDefinitions.Add("block", "", "", "", rhino.Point3d(0, 0, 0), (circle(), line()), (plain, plain))
    block = file.InstanceDefinitions[0]
    for move in ((100.0, 0.0, 0.0), (0.0, 200.0, 0.0)):
        placed = rhino.Transform.Translation(*move)
        placed.M00 = 2.0
        file.Objects.AddInstanceObject(rhino.InstanceReference(block.Id, placed))
    file.Write(str(tmp_path / "part.3dm"), 7)
    contents = read_all(tmp_path / "part.3dm")
    assert len(contents) == 4
    lines = [path.curves[0].ends for path in contents if path.curves[0].degree == 1]
    assert np.allclose(lines, [[[100, 50, 0], [102, 52, 3]], [[0, 250, 0], [2, 252, 3]]], rtol=0.0, atol=1e-12)
    squeezed = next(path.curves[0] for path in contents if path.curves[0].rational)
    assert squeezed.closed and np.ptp(squeezed.curvature(np.linspace(*squeezed.domain, 9))) > 0.01


def test_edges_of_solids_on_request_or_where_there_is_nothing_else(tmp_path: Path) -> None:
    file = rhino.File3dm()
    file.Objects.AddBrep(rhino.Brep.CreateFromBox(rhino.Box(rhino.BoundingBox(0, 0, 0, 1, 2, 3))))
    file.Write(str(tmp_path / "part.3dm"), 7)
    contents = read_all(tmp_path / "part.3dm")
    assert sorted(path.length for path in contents) == pytest.approx([1.0] * 4 + [2.0] * 4 + [3.0] * 4, rel=1e-14)
    assert contents[0].findings[0] == "no free curves; these are the edges of its faces"
    file.Objects.AddCurve(circle())
    file.Write(str(tmp_path / "part.3dm"), 7)
    assert len(read_all(tmp_path / "part.3dm")) == 1
    assert len(read_all(tmp_path / "part.3dm", edges=True)) == 13


def test_a_file_without_unit_says_so(tmp_path: Path) -> None:
    file = rhino.File3dm()
    file.Settings.ModelUnitSystem = rhino.UnitSystem.Unset
    file.Objects.AddCurve(line())
    file.Write(str(tmp_path / "part.3dm"), 7)
    path = read(tmp_path / "part.3dm")
    assert path.findings == ("its unit is Unset; read as mm",)
    assert path.length == pytest.approx(math.sqrt(14.0), rel=1e-14)
