"""What the author's program does not show is not cut: one rule, one finding and one option for all drawings.

After material-design-icons#37 (an invisible square around every icon), import_3dm#17 (hidden objects) and ezdxf#330 (an
arc of no sweep); SVG 2, "Painting"; DXF Reference, LAYER group 70 and 62, entities group 60 and 67.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import ezdxf
import pytest
import rhino3dm

import splinefeed as sf
from splinefeed.formats.registry import read_all

SAID = "not shown in the drawing, left out (option hidden): "


def svg(folder: Path, body: str) -> Path:
    """A page of 100 mm."""
    file = folder / "page.svg"
    head = '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 0 100 100">'
    file.write_text(f'{head}<path d="M1 1h4"/>{body}</svg>')
    return file


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ('<path d="M0 0h24v24H0z" fill="none"/>', "1 path without paint"),
        ('<rect width="9" height="9" style="fill:none;stroke:none"/>', "1 rect without paint"),
        ('<rect width="9" height="9" opacity="0"/>', "1 rect of opacity 0"),
        ('<g opacity="0.0%"><circle r="4"/><circle r="5"/></g>', "2 circle of opacity 0"),
        ('<g fill="none"><circle r="4"/></g>', "1 circle without paint"),
        ('<g fill="none" stroke="red"><circle r="4" stroke-width="0mm"/></g>', "1 circle without paint"),
        ('<circle r="4" fill="transparent"/>', "1 circle without paint"),
        ('<circle r="4" fill="none" stroke="rgba(0,0,0,0)"/>', "1 circle without paint"),
        ('<circle r="4" fill="#ff000000" stroke="#f000"/>', "1 circle without paint"),
        ('<circle r="4" fill="hsla(0, 100%, 50%, 0.0)" stroke="rgb(1 2 3 / 0%)"/>', "1 circle without paint"),
        ('<circle r="4" fill-opacity="0" stroke="red" stroke-opacity="0"/>', "1 circle without paint"),
        ("<style>.guide{fill:none}</style><circle r='4' class='guide'/>", "1 circle without paint"),
        ('<g visibility="hidden"><circle r="4"/></g>', "1 circle that is hidden"),
        ('<g style="display:none"><circle r="4"/></g>', "1 circle that is not displayed"),
        ('<defs><circle id="c" r="4" fill="none"/></defs><use href="#c"/>', "1 circle without paint"),
    ],
)
def test_what_an_svg_does_not_show_is_left_out(tmp_path: Path, body: str, said: str) -> None:
    file = svg(tmp_path, body)
    paths = read_all(file)
    assert [path.length for path in paths] == pytest.approx([4.0]) and paths[0].findings == (SAID + said,)
    every = read_all(file, hidden=True)
    assert len(every) > 1 and f"read all the same: {said}" in every[0].findings[0]


@pytest.mark.parametrize(
    "body",
    [
        '<circle r="4" fill="rgba(0,0,0,.5)"/>', '<circle r="4" fill="#f00f"/>', '<circle r="4" fill="rgb(0,0,0)"/>',
        '<circle r="4" fill="rgb(1 2 3 / 0.05)"/>',
        '<circle r="4" style="fill:none;stroke:#f00"/>', '<g fill="none"><circle r="4" fill="red"/></g>',
        '<g fill="none"><circle r="4" stroke="url(#a)"/></g>', '<circle r="4" opacity="0.2"/>',
        '<g fill="none" stroke="black"><circle r="4" stroke="inherit"/></g>', '<line x2="4" stroke="red"/>',
        '<defs><circle id="c" r="4"/></defs><use href="#c" fill="red"/>',
        '<g visibility="hidden"><circle r="4" visibility="visible"/></g>',
    ],
)  # fmt: skip
def test_what_an_svg_shows_is_read(tmp_path: Path, body: str) -> None:
    paths = read_all(svg(tmp_path, body))
    assert len(paths) == 2 and not paths[0].findings


def test_a_dashed_stroke_is_said(tmp_path: Path) -> None:
    (first, *_) = read_all(svg(tmp_path, '<g stroke-dasharray="4 2"><path d="M9 9h9" stroke="red"/></g>'))
    assert first.findings == ("1 x element with a dashed stroke, which is read without gaps",)


def test_layers_and_entities_that_a_dxf_does_not_show(tmp_path: Path) -> None:
    document = ezdxf.new("R2010", units=4)
    document.layers.add("ice").freeze()
    document.layers.add("off").off()
    block = document.blocks.new("b")
    block.add_circle((0, 0), 1, {"layer": "Cut"})
    block.add_circle((0, 0), 2)
    space = document.modelspace()
    space.add_line((0, 0), (5, 0))
    space.add_lwpolyline([(0, 1), (5, 1)], dxfattribs={"layer": "ice"})
    space.add_blockref("b", (20, 0), {"layer": "ice"})  # frozen: all of it
    space.add_blockref("b", (30, 0), {"layer": "off"})  # off: what is on layer 0 in it
    space.add_line((0, 2), (5, 2), {"layer": "OFF"})
    space.add_line((0, 3), (5, 3), {"invisible": 1})
    document.saveas(file := tmp_path / "a.dxf")
    paths = read_all(file)
    assert [round(path.length, 6) for path in paths] == [5.0, 6.283185]
    assert sorted(paths[0].findings[0].removeprefix(SAID).split(", 1 ")) == [
        "1 LWPOLYLINE on layer 'ice', frozen", "CIRCLE on layer 'off', off", "INSERT on layer 'ice', frozen",
        "LINE invisible", "LINE on layer 'OFF', off",
    ]  # fmt: skip
    assert len(read_all(file, hidden=True)) == 8
    assert len(read_all(file, layer="ice")) == 2


def test_dashed_lines_and_wide_polylines_of_dxf_are_said(tmp_path: Path) -> None:
    document = ezdxf.new("R2010", units=4)
    document.linetypes.add("DASHED", [1.0, 0.5, -0.5])
    document.layers.add("hidden edges", linetype="DASHED")
    space = document.modelspace()
    space.add_line((0, 0), (5, 0), {"linetype": "Dashed"})
    space.add_line((0, 1), (5, 1), {"layer": "hidden edges"})
    space.add_line((0, 2), (5, 2), {"layer": "hidden edges", "linetype": "Continuous"})
    space.add_lwpolyline([(0, 3), (5, 3)], dxfattribs={"const_width": 2.0})
    space.add_lwpolyline([(0, 4, 1, 1), (5, 4)], format="xyse")
    space.add_polyline2d([(0, 5), (5, 5)])
    document.saveas(file := tmp_path / "a.dxf")
    (first, *_) = read_all(file)
    assert first.findings == (
        "2 x element with a dashed stroke, which is read without gaps",
        "2 x polyline with a width, of which the middle is read",
    )


def test_an_arc_of_no_sweep_has_no_length(tmp_path: Path) -> None:
    document = ezdxf.new("R2010", units=4)
    space = document.modelspace()
    space.add_line((0, 0), (5, 0))
    space.add_arc((50, 50), 9, 270, 270)
    space.add_ellipse((50, 50), (9, 0), 0.5, 1.0, 1.0)
    space.add_arc((90, 50), 1, 0, 360)
    space.add_arc((20, 50), 1, 350, 10)
    document.saveas(file := tmp_path / "a.dxf")
    paths = read_all(file)
    assert [path.length for path in paths] == pytest.approx([5.0, 6.283185307, 0.3490658504])
    assert paths[0].findings == ("left out: 2 entity without length",)


def test_objects_and_layers_that_rhino_does_not_show(tmp_path: Path) -> None:
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    for name, shown in (("cut", True), ("dim", False)):
        layer = rhino3dm.Layer()
        layer.Name, layer.Visible = name, shown
        model.Layers.Add(layer)
    for index, hidden, page in ((0, False, False), (0, True, False), (1, False, False), (0, False, True)):
        attributes = rhino3dm.ObjectAttributes()
        attributes.LayerIndex, attributes.Visible = index, not hidden
        if page:
            attributes.ActiveSpace = rhino3dm.ActiveSpace.PageSpace
        model.Objects.AddCurve(rhino3dm.LineCurve(rhino3dm.Point3d(0, 0, 0), rhino3dm.Point3d(5, 0, 0)), attributes)
    file = tmp_path / "a.3dm"
    model.Write(str(file), 7)
    (path,) = read_all(file)
    assert path.findings[-1] == f"{SAID}1 hidden object, 1 object on layer 'dim', off, 1 object in a layout"
    assert len(read_all(file, hidden=True)) == 4 and len(read_all(file, layer="dim")) == 1


def test_a_dashed_line_of_iges_is_said(data_dir: Path, tmp_path: Path) -> None:
    text = (data_dir / "iges" / "blank.igs").read_text()
    lines = text.splitlines(keepends=True)
    first = next(i for i, line in enumerate(lines) if line[72:73] == "D")
    lines[first] = lines[first][:24] + f"{2:8d}" + lines[first][32:]  # the pattern of the line: dashed
    (file := tmp_path / "a.igs").write_text("".join(lines))
    assert "1 x element with a dashed stroke, which is read without gaps" in read_all(file, hidden=True)[0].findings


def test_a_blanked_entity_of_iges_is_left_out(data_dir: Path) -> None:
    file = data_dir / "iges" / "blank.igs"
    (path,) = read_all(file)
    assert path.length == pytest.approx(50.0) and path.findings == (f"{SAID}1 blanked entity",)
    assert len(read_all(file, hidden=True)) == 2


INVISIBLE = """#57=DRAUGHTING_PRE_DEFINED_CURVE_FONT('continuous');
#58=DRAUGHTING_PRE_DEFINED_COLOUR('red');
#50=CURVE_STYLE('',#57,POSITIVE_LENGTH_MEASURE(0.1),#58);
#51=PRESENTATION_STYLE_ASSIGNMENT((#50));
#52=STYLED_ITEM('',(#51),{styled});
#53=PRESENTATION_LAYER_ASSIGNMENT('construction','',({on_layer}));
#54=INVISIBILITY(({unseen}));
ENDSEC;
END-ISO"""


@pytest.mark.parametrize(
    ("styled", "on_layer", "unseen", "lengths", "said"),
    [
        (1, "2", "#52", [10.0, 30.0], "1 invisible item"),
        (1, "2", "#53", [10.0, 20.0], "1 item on layer 'construction', off"),
        (1, "0 2", "#52,#53", [], "2 item on layer 'construction', off, 1 invisible item"),
        ("set", "2", "#52", [], "1 invisible item"),
        ("shape", "2", "#52", [], "1 invisible item"),
    ],
)
def test_what_step_calls_invisible_is_left_out(tmp_path: Path, styled, on_layer, unseen, lengths, said) -> None:
    lines = [sf.Path.polyline([[0, y, 0], [y + 10, y, 0]]) for y in (0, 10, 20)]
    sf.write(lines, file := tmp_path / "a.step")
    text = file.read_text()
    curves = re.findall(r"(#\d+)=B_SPLINE_CURVE_WITH_KNOTS", text)
    number = {"set": "#15", "shape": "#16", **dict(enumerate(curves))}
    said_of = {"styled": number[styled], "on_layer": ",".join(curves[int(k)] for k in on_layer.split())}
    more = INVISIBLE.format(**said_of, unseen=unseen)
    file.write_text(text.replace("ENDSEC;\nEND-ISO", re.sub(r"#5(\d)", r"#905\1", more)))
    every = read_all(file, hidden=True)
    assert sorted(path.length for path in every) == pytest.approx([10.0, 20.0, 30.0])
    assert f"read all the same: {said}" in every[0].findings[-1]
    if lengths:
        shown = read_all(file)
        assert [path.length for path in shown] == pytest.approx(lengths) and shown[0].findings == (SAID + said,)
    else:
        with pytest.raises(sf.errors.InputError, match=re.escape(f"holds no curves ({SAID}{said})")):
            read_all(file)


@pytest.mark.parametrize(
    ("font", "dashed"),
    [
        ("DRAUGHTING_PRE_DEFINED_CURVE_FONT('continuous')", 0),
        ("DRAUGHTING_PRE_DEFINED_CURVE_FONT('chain double dash')", 1),
        ("CURVE_STYLE_FONT('own',(#59))", 1),
    ],
)
def test_a_dashed_curve_of_step_is_said(tmp_path: Path, font: str, dashed: int) -> None:
    sf.write([sf.Path.polyline([[0, y, 0], [y + 10, y, 0]]) for y in (0, 10)], file := tmp_path / "a.step")
    text = file.read_text()
    curve = re.findall(r"(#\d+)=B_SPLINE_CURVE_WITH_KNOTS", text)[1]
    more = INVISIBLE.format(styled=curve, on_layer=curve, unseen="").replace("#54=INVISIBILITY(());\n", "")
    more = more.replace("DRAUGHTING_PRE_DEFINED_CURVE_FONT('continuous')", font)
    more = more.replace("ENDSEC;", "#59=CURVE_STYLE_FONT_PATTERN(2.,1.);\nENDSEC;")
    file.write_text(text.replace("ENDSEC;\nEND-ISO", re.sub(r"#5(\d)", r"#905\1", more)))
    said = [each for each in read_all(file)[0].findings if "dashed" in each]
    assert said == ["1 x element with a dashed stroke, which is read without gaps"] * dashed


#: In a process of its own: rhino3dm frees a line type that was added twice when Python ends.
DASHED_3DM = """
import os, sys, rhino3dm
model = rhino3dm.File3dm()
kept = []
for name, gaps in (("full", False), ("dashes", True)):
    line = rhino3dm.Linetype()
    kept.append(line)
    line.Name = name
    line.AppendSegment(2.0, True)
    if gaps:
        line.AppendSegment(1.0, False)
    model.Linetypes.Add(line)
    layer = rhino3dm.Layer()
    layer.Name, layer.LinetypeIndex = f"layer of {name}", len(model.Linetypes) - 1
    model.Layers.Add(layer)
for y, (layer, own) in enumerate([(0, -1), (0, 1), (1, -1), (1, 0)]):
    attributes = rhino3dm.ObjectAttributes()
    attributes.LayerIndex = layer
    if own >= 0:
        attributes.LinetypeIndex, attributes.LinetypeSource = own, rhino3dm.ObjectLinetypeSource.LinetypeFromObject
    model.Objects.AddCurve(rhino3dm.LineCurve(rhino3dm.Point3d(0, y, 0), rhino3dm.Point3d(5, y, 0)), attributes)
os._exit(0 if model.Write(sys.argv[1], 8) else 1)
"""


def test_dashed_curves_of_3dm_are_said(tmp_path: Path) -> None:
    file = tmp_path / "a.3dm"
    subprocess.run([sys.executable, "-c", DASHED_3DM, file], check=True)
    paths = read_all(file)
    assert len(paths) == 4
    assert "2 x element with a dashed stroke, which is read without gaps" in paths[0].findings


def test_an_invisible_body_of_step_has_no_edges(data_dir: Path, tmp_path: Path) -> None:
    text = (data_dir / "step" / "trimesh_featuretype.STEP").read_text()
    at = text.rindex("ENDSEC;")
    file = tmp_path / "a.step"
    file.write_text(text[:at] + "#90001=STYLED_ITEM('',(),#551);\n#90002=INVISIBILITY((#90001));\n" + text[at:])
    with pytest.raises(sf.errors.InputError, match=r"holds no curves .*1 invisible item"):
        read_all(file)
    assert read_all(file, hidden=True)
