"""STEP and IGES files that OCCT wrote or that were written by hand: exact curves, units, places, wires, options."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Pnt

from cad_makers import (
    EDGES,
    compound,
    edge,
    length,
    placed,
    points,
    wire,
    write_iges,
    write_step,
)
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import FormatError
from splinefeed.formats import step
from splinefeed.formats.registry import read, read_all

#: Digits that OCCT's writers leave, relative: 15 in STEP, 10 in IGES, and 9 in IGES in inches.
STEP_DIGITS, IGES_DIGITS = 2e-12, 3e-9
#: OCCT writes an ellipse to IGES as a B-spline near it, and a parabola with mm and inches mixed.
NOT_IN_IGES = ("ellipse", "parabola")


def assert_same_curve(curve: NurbsCurve, shape: Any, tolerance: float) -> None:
    wanted = points(shape)[:, : curve.axes]
    size = float(np.max(np.ptp(wanted, axis=0)))
    assert curve.length == pytest.approx(length(shape), rel=tolerance)
    assert np.allclose(curve.ends, wanted[[0, -1]], rtol=0.0, atol=10.0 * tolerance * size)
    even = curve(curve.parameter_at(np.linspace(0.0, curve.length, len(wanted))))
    assert np.allclose(even, wanted, rtol=0.0, atol=(1e-8 + 10.0 * tolerance) * size)


@pytest.mark.parametrize("unit", ["MM", "INCH"])
@pytest.mark.parametrize("name", EDGES)
def test_every_kind_of_edge_comes_out_of_step_exactly(tmp_path: Path, name: str, unit: str) -> None:
    shape, kind = EDGES[name]
    write_step(tmp_path / "part.stp", shape, unit=unit)
    contents = read_all(tmp_path / "part.stp")
    (path,) = contents
    (curve,) = path.curves
    assert contents.units == {"MM": "mm", "INCH": "in"}[unit]
    assert (curve.degree, len(curve.control_points), curve.rational) == kind
    assert curve.clamped and path.findings == ()
    assert_same_curve(curve, shape, STEP_DIGITS)


@pytest.mark.parametrize("name", [name for name in EDGES if name not in NOT_IN_IGES])
def test_every_kind_of_edge_comes_out_of_iges(tmp_path: Path, name: str) -> None:
    shape, kind = EDGES[name]
    write_iges(tmp_path / "part.igs", shape, unit="IN")
    contents = read_all(tmp_path / "part.igs")
    (curve,) = contents[0].curves
    assert contents.units == "in"
    assert (curve.degree, len(curve.control_points), curve.rational) == kind
    assert_same_curve(curve, shape, IGES_DIGITS)


def test_an_edge_of_a_wire_that_lies_backwards_is_turned(tmp_path: Path) -> None:
    places = [gp_Pnt(*each) for each in ((0, 0, 0), (10, 0, 0), (10, 5, 1), (3, 7, 2))]
    against = edge(places[2], places[1])
    write_step(tmp_path / "part.stp", wire(edge(places[0], places[1]), against, edge(places[2], places[3])))
    (path,) = read_all(tmp_path / "part.stp")
    walked = np.array([path.curves[0].ends[0], *(curve.ends[1] for curve in path.curves)])
    wanted = np.array([[0, 0, 0], [10, 0, 0], [10, 5, 1], [3, 7, 2]])
    assert np.allclose(walked, wanted, atol=1e-12) or np.allclose(walked, wanted[::-1], atol=1e-12)


@pytest.mark.parametrize("assembly", [False, True])
def test_assemblies_are_put_where_they_belong(tmp_path: Path, assembly: bool) -> None:
    part = compound(EDGES["spline"][0], EDGES["arc"][0])
    places = [(0.0, (0.0, 0.0, 0.0)), (1.0, (100.0, 0.0, 0.0)), (0.5, (0.0, 50.0, 7.0))]
    write_step(tmp_path / "part.stp", compound(*(placed(part, *place) for place in places)), assembly=assembly)
    starts = np.array([path.curves[0].ends[0] for path in read_all(tmp_path / "part.stp")])
    wanted = []
    for angle, move in places:
        turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        wanted += [turn @ points(EDGES[name][0])[0] + move for name in ("spline", "arc")]
    assert np.allclose(starts, wanted, rtol=0.0, atol=1e-10)


def test_several_roots_and_a_wire(tmp_path: Path) -> None:
    corners = [gp_Pnt(*each) for each in ((0, 0, 0), (10, 0, 0), (10, 5, 0))]
    loop = wire(*(edge(corners[i], corners[(i + 1) % 3]) for i in range(3)))
    write_step(tmp_path / "part.stp", loop, EDGES["circle"][0])
    triangle, circle = read_all(tmp_path / "part.stp")
    assert (len(triangle.curves), triangle.closed, circle.closed) == (3, True, True)
    assert triangle.length == pytest.approx(15.0 + np.hypot(10.0, 5.0), rel=1e-14)


def test_edges_of_faces_come_on_request_or_where_there_is_nothing_else(tmp_path: Path) -> None:
    file = tmp_path / "part.stp"
    cylinder, spline = BRepPrimAPI_MakeCylinder(5.0, 10.0).Shape(), EDGES["spline"][0]
    write_step(file, compound(cylinder, spline))
    (path,) = read_all(file)
    assert path.length == pytest.approx(length(spline), rel=1e-12)
    assert path.findings == ("edges of faces are left out; edges=True (--edges) reads them too",)
    lengths = sorted(path.length for path in read_all(file, edges=True))
    assert lengths == pytest.approx(sorted([10.0, 10.0 * np.pi, 10.0 * np.pi, length(spline)]), rel=1e-12)
    write_step(file, BRepPrimAPI_MakeBox(10.0, 20.0, 30.0).Shape())
    box = read_all(file)
    assert sorted(path.length for path in box) == pytest.approx([10.0] * 4 + [20.0] * 4 + [30.0] * 4, rel=1e-14)
    assert box[0].findings[0] == "no free curves; these are the edges of its faces"


def test_the_edges_of_a_flat_face_are_a_closed_path_in_x_and_y(tmp_path: Path) -> None:
    corners = [gp_Pnt(*each) for each in ((0, 0, 0), (10, 0, 0), (10, 5, 0))]
    loop = wire(*(edge(corners[i], corners[(i + 1) % 3]) for i in range(3)))
    write_step(tmp_path / "part.stp", BRepBuilderAPI_MakeFace(loop).Face())
    (path,) = read_all(tmp_path / "part.stp")
    assert (path.axes, path.closed, len(path.curves)) == (("x", "y"), True, 3)


# --- by hand ----------------------------------------------------------------------------------------------------------

GIVEN = """#20=CARTESIAN_POINT('',(0.,0.,0.));
#21=CARTESIAN_POINT('',(10.,0.,0.));
#22=CARTESIAN_POINT('',(10.,5.,0.));
#23=CARTESIAN_POINT('',(3.,7.,1.));
#24=DIRECTION('',(0.,0.,1.));
#25=DIRECTION('',(1.,0.,0.));
#26=AXIS2_PLACEMENT_3D('',#20,#24,#25);
#27=CIRCLE('',#26,10.);
"""
ARC = "#30=TRIMMED_CURVE('',#27,(PARAMETER_VALUE(0.5)),(PARAMETER_VALUE(2.)),.T.,.PARAMETER.);\n"
COMPOSITE = """#28=TRIMMED_CURVE('',#27,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(1.)),.T.,.PARAMETER.);
#31=CARTESIAN_POINT('',(5.403023058681398,8.414709848078965,0.));
#33=POLYLINE('',(#31,#20));
#34=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#28);
#35=COMPOSITE_CURVE_SEGMENT(.DISCONTINUOUS.,.T.,#33);
#30=COMPOSITE_CURVE('',(#34,#35),.F.);
"""
SHAPE = "(#20,#21,#22,#23),.UNSPECIFIED.,.F.,.F."
MILLIMETRE = "#10=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));"
INCH = """#10=(CONVERSION_BASED_UNIT('INCH',#50)LENGTH_UNIT()NAMED_UNIT(#52));
#50=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#51);
#51=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#52=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);"""
RADIAN = "#11=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));"
DEGREE = """#11=(CONVERSION_BASED_UNIT('DEGREE',#50)NAMED_UNIT(#52)PLANE_ANGLE_UNIT());
#50=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.017453292519943295),#51);
#51=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#52=DIMENSIONAL_EXPONENTS(0.,0.,0.,0.,0.,0.,0.);"""


def by_hand(file: Path, body: str, *changes: tuple[str, str]) -> Path:
    frame = step._FRAME.format(name="'part'", curves="#30")
    for old, new in changes:
        assert old in frame
        frame = frame.replace(old, new)
    header = step._HEADER.format(name="'part'", program="''")
    file.write_text(f"{header}{frame}{GIVEN}{body}ENDSEC;\nEND-ISO-10303-21;\n")
    return file


@pytest.mark.parametrize(
    ("body", "changes", "kinds", "total"),
    [
        (f"#30=POLYLINE('',{SHAPE.partition('),')[0]}));\n", (), [(1, 4)], 15.0 + np.sqrt(54.0)),
        (ARC, (), [(2, 3)], 15.0),
        (ARC.replace(".T.,.PARAM", ".F.,.PARAM"), (), [(2, 9)], 10.0 * (2.0 * np.pi - 1.5)),
        (ARC.replace("0.5", "30.").replace("2.)", "120.)"), ((RADIAN, DEGREE),), [(2, 3)], 5.0 * np.pi),
        (ARC, ((MILLIMETRE, INCH),), [(2, 3)], 15.0 * 25.4),
        (ARC, (("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"),), [(2, 3)], 15000.0),
        (COMPOSITE, (), [(2, 3), (1, 2)], 20.0),
        (f"#30=QUASI_UNIFORM_CURVE('',3,{SHAPE});\n", (), [(3, 4)], 15.886634597251005),
        (f"#30=UNIFORM_CURVE('',2,{SHAPE});\n", (), [(2, 4)], 11.606198147845587),
        (
            f"#31=B_SPLINE_CURVE_WITH_KNOTS('',1,{SHAPE},(2,1,1,2),(0.,1.,2.,3.),.UNSPECIFIED.);\n"
            "#30=TRIMMED_CURVE('',#31,(#20),(#22),.T.,.CARTESIAN.);\n",
            (),
            [(1, 3)],
            15.0,
        ),
    ],
)
def test_curves_of_a_set(
    tmp_path: Path, body: str, changes: tuple[tuple[str, str], ...], kinds: list[Any], total: float
) -> None:
    (path,) = read_all(by_hand(tmp_path / "part.stp", body, *changes))
    assert [(curve.degree, len(curve.control_points)) for curve in path.curves] == kinds
    assert path.length == pytest.approx(total, rel=1e-12)


def test_an_offset_curve_is_near_and_says_how_near(tmp_path: Path) -> None:
    (path,) = read_all(
        by_hand(tmp_path / "part.stp", ARC.replace("#30", "#31") + "#30=OFFSET_CURVE_3D('',#31,1.,.F.,#24);\n")
    )
    assert path.length == pytest.approx(1.5 * 9.0, rel=1e-8)
    assert path.findings[0].startswith("an offset curve is approximated; largest distance ")


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("#28=VECTOR('',#25,1.);\n#30=LINE('',#20,#28);\n", "holds no curves (left out: 1 x curve without ends)"),
        ("#30=CARTESIAN_POINT('',(1.,0.,0.));\n", "holds no curves (left out: 1 x point)"),
        ("", "OCCT says: Unresolved Reference, Ent.Id.#-3 Param.n0 1 (Id.#30)"),
        ("#30=CIRCLE('',#99,1.);\n", "OCCT says: Unresolved Reference, Ent.Id.#30 Param.n0 2 (Id.#99)"),
        (
            "#30=CIRCLE('',#26,1.;\n",
            "line 35: OCCT says: Incorrect syntax: unexpected ';', expecting ')' or ','; is the file complete?",
        ),
        ("#20=CIRCLE('',#26,1.);\n", "OCCT says: Ident defined SEVERAL TIMES : #20 (and 1 more)"),
        (
            "#30=CIRCLE(" + "(" * 40 + ")" * 40 + ");\n",
            "holds no curves (entity 26: OCCT says: Count of Parameters is not 3 for circle)",
        ),
        (
            "#30=CIRCLE('it,#26,1.);\n",
            "line 38: OCCT says: Incorrect syntax: unexpected end of file; is the file complete?",
        ),
    ],
)
def test_what_is_wrong_in_step_is_named(tmp_path: Path, body: str, reason: str) -> None:
    file = by_hand(tmp_path / "part.stp", body)
    with pytest.raises(FormatError) as caught:
        read(file)
    assert str(caught.value) == f"{file}: {reason}"


def test_iges_without_its_counts_or_in_another_form_is_named(tmp_path: Path, data_dir: Path) -> None:
    text = (data_dir / "iges/igesio_sample_curves.igs").read_text()
    lines = text.splitlines()
    cases = [
        (lines[:-1], f"line {len(lines) - 1}: does not count the lines"),
        (lines[:-2] + lines[-1:], f"line {len(lines) - 1}: does not count the lines"),
        ([line.replace("P     24", "P     25") for line in lines], "OCCT says: Syntax error in IGES file at line 66"),
        (lines[:5] + ["0,1,2"] + lines[5:], "line 6: has none of S, G, D, P, T in column 73"),
        ([lines[0][:72] + "C      1"], "line 1: has none of S, G, D, P, T in column 73, or not in order; save it as"),
    ]
    for changed, reason in cases:
        file = tmp_path / "part.igs"
        file.write_text("\n".join(changed) + "\n")
        with pytest.raises(FormatError) as caught:
            read(file)
        assert str(caught.value).startswith(f"{file}: {reason}")


def test_an_iges_arc_that_misses_its_circle_is_named(tmp_path: Path, data_dir: Path) -> None:
    text = (data_dir / "iges/igesio_sample_curves.igs").read_text()
    file = tmp_path / "part.igs"
    whole = "100,0.0,0.0,0.0,-1.5,0.0,1.5,0.0;"
    assert whole in text
    file.write_text(text.replace(whole, "100,0.0,0.0,0.0,-1.5,0.0,1.6,0.0;"))
    with pytest.raises(FormatError) as caught:
        read(file)
    ends = "an arc begins with radius 1.5 and ends with 1.6"
    fault = f"entity D21: {ends}"
    assert str(caught.value) == f"{file}: {fault}"
    assert read_all(file, repair=True)[0].findings == (fault,)
    file.write_text(text.replace(whole, "100,0.,0.0,0.,-1.5,.0,1.5009,.0;".ljust(len(whole))))
    assert read_all(file)[0].findings == ()
    file.write_text(text.replace(whole, "100,0.0,0.0,0.0;".ljust(len(whole))))
    with pytest.raises(FormatError, match="entity D21: an arc begins with radius 0 and ends with 0"):
        read(file)
