"""DXF: real files against numbers of other libraries, every entity against ezdxf's own geometry, and faults."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import ezdxf
import ezdxf.path
import numpy as np
import pytest
from ezdxf import disassemble
from ezdxf.lldxf.types import DXFTag
from scipy.interpolate import BSpline

from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import FormatError, InputError, SplinefeedError
from splinefeed.formats import dxf_entities, dxf_tags
from splinefeed.formats.registry import read_all, write
from splinefeed.paths.contents import Contents

TRUTH = json.loads((Path(__file__).parents[1] / "data" / "drawings.json").read_text())
MILLIMETRES = {None: 1.0, 1: 25.4, 4: 1.0, 5: 10.0}


def curves_of(paths: Contents) -> list[NurbsCurve]:
    return [curve for path in paths for curve in path.curves]


def matches(curve: NurbsCurve, truth: dict, scale: float) -> bool:
    """Whether a curve is the one that `truth` describes, run through either way."""
    points = np.array([truth["start"], truth["end"]])[:, : curve.axes] * scale
    ends = curve.ends
    size = max(1.0, float(np.abs(points).max()))
    same = min(np.abs(ends - points).max(), np.abs(ends[::-1] - points).max()) < 1e-12 * size
    return bool(
        same
        and curve.degree == truth["degree"]
        and len(curve.control_points) == truth["n_ctrl"]
        and curve.rational == truth["rational"]
        and curve.closed == truth["closed"]
        and math.isclose(curve.length, truth["length"] * scale, rel_tol=1e-11)
        and np.allclose(curve.bounding_box(), np.array([truth["bbox_min"], truth["bbox_max"]])[:, : curve.axes] * scale,
                        rtol=0, atol=1e-9 * size)
    )  # fmt: skip


@pytest.mark.parametrize("name", [name for name in TRUTH if name.startswith("dxf/")])
def test_splines_of_real_files_come_out_as_other_libraries_measured_them(data_dir: Path, name: str) -> None:
    truth = TRUTH[name]
    paths = read_all(data_dir / name)
    scale = MILLIMETRES[truth["insunits"]]
    left = curves_of(paths)
    for expected in truth["curves"]:
        index = next((i for i, curve in enumerate(left) if matches(curve, expected, scale)), None)
        assert index is not None, expected
        del left[index]
    straight = truth["entities"].get("LINE", 0) + truth["entities"].get("LWPOLYLINE", 0)
    assert len(left) <= straight + truth["entities"].get("CIRCLE", 0) + truth["entities"].get("ARC", 0)
    assert paths.units == {None: "mm", 1: "in", 4: "mm", 5: "cm"}[truth["insunits"]]


# --- every entity, against ezdxf ----------------------------------------------------------------------------------


def drawing() -> ezdxf.document.Drawing:
    document = ezdxf.new("R2010")
    document.units = 4
    return document


def saved(document: ezdxf.document.Drawing, tmp_path: Path, *, binary: bool = False) -> Path:
    file = tmp_path / "part.dxf"
    document.saveas(file, fmt="bin" if binary else "asc")
    return file


def points_of(document: ezdxf.document.Drawing) -> tuple[np.ndarray, np.ndarray, float]:
    """Points (n, 3) of every entity, blocks carried out, as ezdxf draws them by Bezier curves; and the length, mm.

    The ends of the Bezier curves are on the entity but for rounding, what lies between them is not.
    """
    every = [ezdxf.path.make_path(entity) for entity in disassemble.recursive_decompose(document.modelspace())]
    ends = [tuple(point) for path in every for point in (path.start, *(command.end for command in path.commands()))]
    drawn = [np.array([tuple(point) for point in path.flattening(1e-4)]) for path in every]
    length = sum(np.linalg.norm(np.diff(points, axis=0), axis=1).sum() for points in drawn)
    return np.array(ends), np.concatenate(drawn), float(length)


def distances(paths: Contents, points: np.ndarray) -> np.ndarray:
    every = curves_of(paths)
    points = points[:, : every[0].axes]
    return np.min([curve.nearest(points)[1] for curve in every], axis=0)


def add_line(space):
    space.add_line((1, 2, 3), (4, -5, 6))


def add_arc(space):
    space.add_arc((1, 2), 5, 350, 190)


def add_tilted_arc(space):
    space.add_arc((1, 2, 3), 5, 30, 200, dxfattribs={"extrusion": (0.3, -0.5, 0.8)})


def add_circle_from_below(space):
    space.add_circle((4, 2, 1), 3, dxfattribs={"extrusion": (0, 0, -1)})


def add_ellipse(space):
    space.add_ellipse((1, 2, 0), (4, 3, 0), 0.4, 0.5, 5.5)


def add_tilted_ellipse(space):
    space.add_ellipse((1, 2, 0), (0, 3, 4), 0.4, 5.0, 1.0, dxfattribs={"extrusion": (1, 0, 0)})


def add_bulges(space):
    space.add_lwpolyline([(0, 0, 0.5), (10, 0, 0), (10, 8, -1.2), (4, 8, 0), (2, 3, 0)], format="xyb", close=True)


def add_lifted_bulges(space):
    space.add_lwpolyline(
        [(0, 0, 0.5), (10, 0, 3.0), (10, 8, 0)], format="xyb", dxfattribs={"elevation": 4, "extrusion": (0, 1, 1)}
    )


def add_polyline_2d(space):
    space.add_polyline2d([(0, 0, 0.3), (5, 0, 0), (5, 5, -0.7)], format="xyb", close=True)


def add_polyline_3d(space):
    space.add_polyline3d([(0, 0, 0), (5, 0, 1), (5, 5, 2), (0, 5, 7)], close=True)


def add_rational_spline(space):
    space.add_rational_spline([(0, 0, 0), (3, 5, 1), (7, -2, 0), (9, 4, 2), (12, 0, 0)], [1, 2, 0.5, 1.5, 1], degree=3)


ENTITIES: list[Callable] = [
    add_line, add_arc, add_tilted_arc, add_circle_from_below, add_ellipse, add_tilted_ellipse, add_bulges,
    add_lifted_bulges, add_polyline_2d, add_polyline_3d, add_rational_spline,
]  # fmt: skip


@pytest.mark.parametrize("binary", [False, True], ids=["text", "binary"])
@pytest.mark.parametrize("add", ENTITIES, ids=lambda add: add.__name__[4:])
def test_an_entity_lies_where_ezdxf_draws_it(tmp_path: Path, add: Callable, binary: bool) -> None:
    document = drawing()
    add(document.modelspace())
    paths = read_all(saved(document, tmp_path, binary=binary))
    ends, points, length = points_of(document)
    assert distances(paths, ends).max() < 1e-13 * 20
    assert distances(paths, points).max() < 2e-3
    assert sum(path.length for path in paths) == pytest.approx(length, rel=3e-4)


@pytest.mark.parametrize("add", ENTITIES, ids=lambda add: add.__name__[4:])
def test_an_entity_in_nested_blocks_lies_where_ezdxf_draws_it(tmp_path: Path, add: Callable) -> None:
    document = drawing()
    inner, outer = document.blocks.new("INNER", base_point=(1, 1, 0)), document.blocks.new("outer")
    add(inner)
    outer.add_blockref("inner", (3, 4, 1), dxfattribs={"rotation": 30, "xscale": 2, "yscale": 0.5, "zscale": 1})
    document.modelspace().add_blockref(
        "OUTER", (-2, 5, 0), dxfattribs={"rotation": -75, "xscale": -1.5, "yscale": 1.5, "zscale": 1.5}
    )
    paths = read_all(saved(document, tmp_path))
    ends, points, length = points_of(document)
    assert distances(paths, ends).max() < 1e-9  # ezdxf squeezes an arc to an ellipse by its own rounding
    assert distances(paths, points).max() < 5e-3
    assert sum(path.length for path in paths) == pytest.approx(length, rel=3e-4)


def test_blocks_squeezed_askew_are_right_where_no_reference_can_say_so(tmp_path: Path) -> None:
    document = drawing()
    inner, outer = document.blocks.new("inner", base_point=(1, 1, 0)), document.blocks.new("outer")
    inner.add_circle((2, 1), 3)
    outer.add_blockref("inner", (3, 4), dxfattribs={"rotation": 30, "xscale": 2, "yscale": 0.5})
    document.modelspace().add_blockref("outer", (-2, 5), dxfattribs={"rotation": -75, "xscale": -1, "yscale": 3})
    (path,) = read_all(saved(document, tmp_path))

    def turned(x, y, degrees):
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        return c * x - s * y, s * x + c * y

    t = np.linspace(0, 2 * math.pi, 37)
    x, y = turned(2 * (2 + 3 * np.cos(t) - 1), 0.5 * (1 + 3 * np.sin(t) - 1), 30)
    x, y = turned(-(x + 3), 3 * (y + 4), -75)
    assert path.curves[0].nearest(np.column_stack([x - 2, y + 5]))[1].max() < 1e-13 * 30
    assert len(path.curves) == 1


def test_circles_are_one_exact_rational_curve_and_squeezed_ones_exact_ellipses(tmp_path: Path) -> None:
    document = drawing()
    block = document.blocks.new("hole")
    block.add_circle((0, 0), 2)
    document.modelspace().add_blockref("hole", (10, 20), dxfattribs={"xscale": 3, "yscale": 0.5, "rotation": 30})
    (path,) = read_all(saved(document, tmp_path))
    (curve,) = path.curves
    assert (curve.degree, len(curve.control_points), path.closed) == (2, 9, True)
    turn = np.array([[math.cos(math.pi / 6), math.sin(math.pi / 6)], [-math.sin(math.pi / 6), math.cos(math.pi / 6)]])
    local = (curve(np.linspace(0, 1, 101)) - [10, 20]) @ turn.T
    assert np.abs((local[:, 0] / 6) ** 2 + local[:, 1] ** 2 - 1).max() < 1e-14


def test_an_array_of_references_is_rows_times_columns(tmp_path: Path) -> None:
    document = drawing()
    document.blocks.new("tick").add_line((0, 0), (0, 1))
    document.modelspace().add_blockref(
        "tick", (5, 5), dxfattribs={"row_count": 2, "column_count": 3, "row_spacing": 10, "column_spacing": 4}
    )
    paths = read_all(saved(document, tmp_path))
    assert [path(0.0).tolist() for path in paths] == [[5 + 4 * i, 5 + 10 * j] for j in range(2) for i in range(3)]


def test_a_periodic_spline_with_open_knots_is_the_one_scipy_evaluates(tmp_path: Path) -> None:
    document = drawing()
    spline = document.modelspace().add_spline()
    spline.set_closed([(0, 0, 0), (5, 1, 0), (6, 6, 0), (1, 5, 0)], degree=3)
    (path,) = read_all(saved(document, tmp_path))
    (curve,) = path.curves
    reference = BSpline(np.array(spline.knots), np.array(spline.control_points)[:, :2], 3)
    u = np.linspace(*curve.domain, 101)
    assert np.abs(curve(u) - reference(u)).max() < 1e-14 * 20
    assert path.closed


def test_splines_of_fit_points_run_through_them(tmp_path: Path) -> None:
    points = [(0, 0, 0), (3, 4, 0), (8, 2, 0), (12, 6, 0)]
    document = drawing()
    document.modelspace().add_spline(points)
    (path,) = read_all(saved(document, tmp_path))
    (curve,) = path.curves
    assert curve.nearest(np.array(points)[:, :2])[1].max() < 1e-13
    assert path.findings[0].startswith("1 x spline given by fit points alone: a cubic by chord length")
    second = curve.derivatives(np.array(curve.domain), 2)[:, 2]
    assert np.abs(second).max() < 1e-12  # natural ends
    closed = drawing()
    closed.modelspace().add_spline(points).closed = True
    (path,) = read_all(saved(closed, tmp_path))
    assert path.closed
    left, right = path.curves[0].derivatives(np.array(path.curves[0].domain), 2)[[1, 0], 1:]
    assert np.abs(left - right).max() < 1e-10  # as smooth at the seam as elsewhere


@pytest.mark.parametrize("closed", [False, True])
def test_fit_points_so_near_that_no_spline_tells_them_apart_are_refused(tmp_path: Path, closed: bool) -> None:
    document = drawing()
    document.modelspace().add_spline([(0, 0, 0), (1e8, 0, 0), (1e8, 1e-12, 0), (1e8 + 1, 0, 0)]).closed = closed
    with pytest.raises(FormatError, match=r"SPLINE: has fit points 1e-12 and 1e\+08 apart, which no spline joins$"):
        read_all(saved(document, tmp_path))


# --- layers, units, what is left out --------------------------------------------------------------------------------


@pytest.fixture
def layered(tmp_path: Path) -> Path:
    document = drawing()
    document.layers.add("Cut")
    document.layers.add("engrave").off()
    block = document.blocks.new("b")
    block.add_line((0, 0), (1, 0))  # on layer 0: takes the layer of the reference
    block.add_line((0, 3), (1, 3), {"layer": "engrave"})
    space = document.modelspace()
    space.add_line((0, 10), (5, 10), {"layer": "Cut"})
    space.add_blockref("b", (20, 0), {"layer": "Cut"})
    return saved(document, tmp_path)


def test_layers_are_chosen_by_name(layered: Path) -> None:
    shown = read_all(layered)
    assert [path.name for path in shown] == ["Cut#1", "Cut#2"]
    said = "not shown in the drawing, left out (option hidden): 1 LINE on layer 'engrave', off"
    assert all(path.findings == (said,) for path in shown)
    assert [path.name for path in read_all(layered, hidden=True)] == ["Cut#1", "Cut#2", "engrave#3"]
    assert [path.name for path in read_all(layered, layer="cut")] == ["Cut#1", "Cut#2"]
    (path,) = read_all(layered, layer="engrave")
    assert not path.findings and path.length == 1.0  # a layer that is named is wanted, shown or not
    with pytest.raises(FormatError, match=r"part\.dxf: has no layer 'Fold'; there are '0', 'Defpoints', 'Cut', 'eng"):
        read_all(layered, layer="Fold, Cut")
    with pytest.raises(FormatError, match="holds no curves"):
        read_all(layered, layer="0")


@pytest.mark.parametrize(
    ("number", "name", "factor"), [(1, "in", 25.4), (4, "mm", 1), (6, "m", 1000), (9, "mil", 0.0254)]
)
def test_units_of_the_header_scale_to_millimetres(tmp_path: Path, number: int, name: str, factor: float) -> None:
    document = drawing()
    document.units = number
    document.modelspace().add_circle((1, 0), 2)
    file = saved(document, tmp_path)
    paths = read_all(file)
    assert paths.units == name
    assert paths[0].length == pytest.approx(4 * math.pi * factor, rel=1e-14)
    assert read_all(file, units="cm")[0].length == pytest.approx(40 * math.pi, rel=1e-14)


def test_a_drawing_without_units_is_in_mm_and_says_so(tmp_path: Path) -> None:
    document = drawing()
    document.units = 0
    document.header["$MEASUREMENT"] = 0
    document.modelspace().add_line((0, 0), (2, 0))
    (path,) = read_all(saved(document, tmp_path))
    assert path.findings == ("the drawing has no units; read as mm ($MEASUREMENT says inch: if so, give units in)",)
    with pytest.raises(InputError, match="'1furlong' has an unknown unit: furlong"):
        read_all(tmp_path / "part.dxf", units="furlong")


def test_what_is_no_tool_path_is_counted(tmp_path: Path) -> None:
    document = drawing()
    space = document.modelspace()
    space.add_line((0, 0), (1, 0))
    space.add_line((1, 0), (2, 0), {"invisible": 1})
    space.add_line((3, 3), (3, 3))
    for _ in range(3):
        space.add_text("hello")
    space.add_point((1, 1))
    space.add_3dface([(0, 0), (1, 0), (1, 1)])
    hatch = space.add_hatch()
    hatch.paths.add_polyline_path([(0, 0), (1, 0), (1, 1)])
    space.add_linear_dim((0, 2), (0, 0), (1, 0)).render()
    document.layout("Layout1").add_line((0, 0), (9, 9))
    (path,) = read_all(saved(document, tmp_path))
    assert path.length == 1.0
    hidden = "not shown in the drawing, left out (option hidden): 1 LINE invisible, 1 LINE in paper space"
    assert path.findings[0] == hidden
    kinds = path.findings[1].removeprefix("left out: ").split(", ")
    assert kinds[0] == "3 TEXT"
    assert {"1 entity without length", "1 POINT", "1 3DFACE", "1 HATCH", "1 DIMENSION"} < set(kinds)


def test_ends_that_meet_make_one_path_with_the_direction_of_its_first_curve(tmp_path: Path) -> None:
    document = drawing()
    space = document.modelspace()
    corners = [(0, 0), (10, 0), (10, 5), (0, 5)]
    for a, b in ((0, 1), (2, 1), (2, 3), (0, 3)):
        space.add_line(corners[a], corners[b])
    (path,) = read_all(saved(document, tmp_path))
    assert path.closed
    assert [curve.ends.tolist() for curve in path.curves] == [
        [list(map(float, a)), list(map(float, b))] for a, b in itertools.pairwise([*corners, corners[0]])
    ]


# --- out and back ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in TRUTH if name.startswith("dxf/")])
def test_a_written_drawing_is_read_as_it_was(tmp_path: Path, data_dir: Path, name: str) -> None:
    paths = read_all(data_dir / name)
    assert write(paths, tmp_path / "out.dxf") == ()
    back = read_all(tmp_path / "out.dxf")
    assert not ezdxf.readfile(tmp_path / "out.dxf").audit().errors
    before, after = curves_of(paths), curves_of(back)
    assert len(before) == len(after)
    size = max(np.abs(curve.control_points).max() for curve in before)
    for one, other in zip(before, after, strict=True):
        if one.degree == 2 and one.rational:  # a circle is written as one
            assert (
                np.abs(one(np.linspace(*one.domain, 50)) - other(np.linspace(*other.domain, 50))).max() < 1e-12 * size
            )
        else:
            assert np.array_equal(one.control_points, other.control_points)


# --- faults ---------------------------------------------------------------------------------------------------------

START = "0\nSECTION\n2\nENTITIES\n"
END = "0\nENDSEC\n0\nEOF\n"
LINE = "0\nLINE\n8\n0\n10\n0\n20\n0\n11\n5\n21\n0\n"
KNOTS = "".join(f"40\n{k}\n" for k in (0, 0, 0, 0, 1, 1, 1, 1))
CONTROL = "".join(f"10\n{x}\n20\n{y}\n30\n0\n" for x, y in ((0, 0), (1, 2), (3, 2), (4, 0)))


def test_a_spline_lies_where_it_is_whatever_its_extrusion(tmp_path: Path) -> None:
    file = tmp_path / "drawing.dxf"
    file.write_text(START + f"0\nSPLINE\n210\n0\n220\n0\n230\n0\n71\n3\n{KNOTS}{CONTROL}" + END)
    assert np.array_equal(read_all(file)[0].curves[0].control_points, [[0, 0], [1, 2], [3, 2], [4, 0]])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("0\nSECTION\n2\nHEADER\n" + END, "has no section ENTITIES; is the file complete, and is it a drawing?"),
        (START + END, "holds no curves (the drawing has no units; read as mm)"),
        (START + LINE, "line 5: ends inside section ENTITIES; is the file complete?"),
        (START + LINE + "zero\nLINE\n" + END, "ezdxf says: Invalid group code \"zero \" at line 17; is the file"),
        (START + LINE.replace("11\n5", "11\nnan") + END, "line 5: LINE: group 11 is 'nan'; expected a number"),
        (START + LINE.replace("11\n5", "11\nfive") + END, "line 5: LINE: group 11 is 'five'; expected a number"),
        (START + LINE.replace("11\n5\n", "") + END, "line 5: LINE: has no end; is the file complete?"),
        (START + LINE.replace("11\n5", "11\n5e99") + END, "a curve of '0' goes beyond 1e+09 mm"),
        (START + LINE.replace("11\n5", "11\n5e300") + END, "line 5: LINE: group 11 is '5e300'; expected a number of"),
        (START + "0\nCIRCLE\n10\n0\n20\n0\n40\n-2\n" + END, "line 5: CIRCLE: radius (group 40) is -2; "),
        (START + "0\nSECTION\n2\nOBJECTS\n" + END, "line 5: 'SECTION' where no section may begin; "),
        (START + "0\nINSERT\n2\nnut\n10\n0\n20\n0\n" + END, "line 5: INSERT: there is no block 'nut'"),
        (START + f"0\nSPLINE\n71\n3\n{KNOTS[10:]}{CONTROL}" + END, "line 5: SPLINE: 6 knots for 4 control points"),
        (START + f"0\nSPLINE\n71\n5\n{KNOTS}{CONTROL}" + END, "line 5: SPLINE: 4 control point(s) for degree 5"),
        (START + f"0\nSPLINE\n71\n3\n{KNOTS}{CONTROL}41\n1\n" + END, "line 5: SPLINE: 1 weights "),
        (START + "0\nLINE\n210\n0\n220\n0\n230\n0\n" + END, "line 5: LINE: has no start; is the file complete?"),
        (START + "0\nCIRCLE\n10\n0\n20\n0\n40\n1\n210\n0\n220\n0\n" + END, "line 5: CIRCLE: the extrusion (group 210)"),
        ("\0\1\2\3", "byte 0: is binary; expected a text or binary DXF drawing"),
        ("AutoCAD Binary DXF\r\n\x1a\0\0\0SECTION\0\2", "ends inside a tag; is the file complete?"),
    ],
)  # fmt: skip
def test_faults_are_one_line_with_their_place(tmp_path: Path, text: str, reason: str) -> None:
    file = tmp_path / "bad.dxf"
    file.write_bytes(text.encode())
    with pytest.raises(FormatError) as caught:
        read_all(file)
    assert str(caught.value).startswith(f"{file}: {reason}")


def block(name: str, content: str) -> str:
    return f"0\nBLOCK\n2\n{name}\n10\n0\n20\n0\n{content}0\nENDBLK\n"


def insert(name: str) -> str:
    return f"0\nINSERT\n2\n{name}\n10\n1\n20\n1\n"


def with_blocks(blocks: str, entities: str) -> str:
    return f"0\nSECTION\n2\nBLOCKS\n{blocks}0\nENDSEC\n{START}{entities}{END}"


def test_blocks_that_insert_themselves_or_grow_without_end_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dxf_entities, "MAX_VISITS", 20_000)
    file = tmp_path / "bad.dxf"
    file.write_text(with_blocks(block("a", insert("b")) + block("b", insert("A")), insert("a")))
    with pytest.raises(FormatError, match=r"INSERT: block 'A' inserts itself, or more than 32 deep: a > b > a"):
        read_all(file)
    doubling = "".join(block(f"b{i}", insert(f"b{i + 1}") * 10) for i in range(12)) + block("b12", LINE)
    file.write_text(with_blocks(doubling, insert("b0")))
    for repair in (False, True):
        with pytest.raises(
            FormatError, match=f"has more than {dxf_entities.MAX_VISITS} entities|more than 200000 curves"
        ):
            read_all(file, repair=repair)
    deep = "".join(block(f"b{i}", insert(f"b{i + 1}")) for i in range(100)) + block("b100", LINE)
    file.write_text(with_blocks(deep, insert("b0")))
    with pytest.raises(FormatError, match="inserts itself, or more than 32 deep"):
        read_all(file)
    file.write_text(with_blocks(block("a", LINE), insert("a") + "70\n32767\n71\n32767\n44\n1\n45\n1\n"))
    with pytest.raises(FormatError, match="has more than"):
        read_all(file)


def test_repair_leaves_faulty_entities_out_and_says_which(tmp_path: Path) -> None:
    file = tmp_path / "bad.dxf"
    file.write_text(START + LINE + LINE.replace("11\n5", "11\nnan") + insert("nut") + LINE + END)
    with pytest.raises(FormatError):
        read_all(file)
    (path,) = read_all(file, repair=True)
    assert path.length == 5.0
    assert path.findings == (
        "the drawing has no units; read as mm",
        "line 17: LINE: group 11 is 'nan'; expected a number; left out",
        "line 29: INSERT: there is no block 'nut'; left out",
        "1 curve(s) lie exactly on others, the first from (0, 0) in '0'; copies are left out",
    )


@pytest.mark.parametrize("name", ["dxf/trimesh_spline.DXF", "dxf/dxfparser_splines.dxf"])
def test_a_file_cut_anywhere_is_refused_or_whole(tmp_path: Path, data_dir: Path, name: str) -> None:
    content = (data_dir / name).read_bytes()
    whole = [curve.control_points.tolist() for curve in curves_of(read_all(data_dir / name))]
    entities_end = content.index(b"ENDSEC", content.index(b"ENTITIES"))
    file = tmp_path / "cut.dxf"
    step = len(content) // 40
    for size in range(1, len(content), step):
        file.write_bytes(content[:size])
        try:
            found = [curve.control_points.tolist() for curve in curves_of(read_all(file))]
        except FormatError as error:
            assert str(error).startswith(f"{file}: ")
        else:
            assert size > entities_end
            assert found == whole
        with contextlib.suppress(SplinefeedError):
            read_all(file, repair=True)


def test_scales_of_blocks_within_blocks_are_bounded(tmp_path: Path) -> None:
    def insert(name: str) -> str:
        return f"0\nINSERT\n8\n0\n2\n{name}\n10\n0\n20\n0\n41\n1e90\n42\n1e90\n"

    line = "0\nLINE\n8\n0\n10\n0\n20\n0\n11\n1\n21\n1\n"
    inner = {"a": insert("b"), "b": insert("c"), "c": insert("d"), "d": line}
    blocks = "".join(f"0\nBLOCK\n2\n{k}\n70\n0\n10\n0\n20\n0\n{text}0\nENDBLK\n" for k, text in inner.items())
    (file := tmp_path / "a.dxf").write_text(
        f"0\nSECTION\n2\nBLOCKS\n{blocks}0\nENDSEC\n0\nSECTION\n2\nENTITIES\n{insert('a')}0\nENDSEC\n0\nEOF\n"
    )
    with pytest.raises(FormatError, match="its scale, with those above it, is too large"):
        read_all(file)


def test_tags_are_counted_while_they_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of one entity, too, before all of them are held together."""
    monkeypatch.setattr(dxf_tags, "MAX_TAGS", 1000)
    taken = []

    def endless(*given: object) -> Iterator[DXFTag]:
        yield DXFTag(0, "LINE")
        while True:
            taken.append(1)
            yield DXFTag(1, "")

    monkeypatch.setattr(dxf_tags, "ascii_tags_loader", endless)
    with pytest.raises(InputError, match="has more than 1000 tags"):
        dxf_tags.read_sections(b"0\nLINE\n")
    assert len(taken) <= 1001
