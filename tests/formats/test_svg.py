"""SVG: real files against numbers of other libraries, every element against svgelements, and faults."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import svgelements

import splinefeed as sf
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import FormatError, InputError
from splinefeed.formats import svg
from splinefeed.formats.registry import read, read_all, write
from splinefeed.paths.contents import Contents
from splinefeed.paths.shapes import butterfly, circle, ellipse

TRUTH = json.loads((Path(__file__).parents[1] / "data" / "drawings.json").read_text())
PIXEL = 25.4 / 96.0


def curves_of(paths: Contents) -> list[NurbsCurve]:
    return [curve for path in paths for curve in path.curves]


@pytest.mark.parametrize("name", [name for name in TRUTH if name.startswith("svg/")])
def test_real_files_come_out_as_other_libraries_measured_them(data_dir: Path, name: str) -> None:
    truth = TRUTH[name]
    invalid = "decided_truth" in truth
    if invalid:
        with pytest.raises(
            FormatError, match=r"line 8: <path id='path2'>: path data: expected 2 numbers for L at '150#80'"
        ):
            read_all(data_dir / name)
    paths = read_all(data_dir / name, repair=invalid)
    copies = 0.0
    if invalid:
        assert any("what comes before it is kept" in finding for finding in paths[0].findings)
        copies = truth["decided_truth"]["path2_length"]  # path2 then lies on path1, and is left out
    pixel = {"svg/trimesh_MIL.svg": 25.4 / 90.0}.get(name, PIXEL)  # of Inkscape 0.48
    total = sum(path.length for path in paths) / pixel
    assert total == pytest.approx(truth["total_length_px"] - copies, rel=1e-11)
    boxes = np.array([path.bounding_box() for path in paths])
    low, high = boxes[:, 0].min(axis=0) / pixel, boxes[:, 1].max(axis=0) / pixel
    height = {"svg/trimesh_MIL.svg": 5329.134, "svg/svgpathtools_transforms.svg": 365.0}.get(name, 200.0)
    (left, top), (right, bottom) = truth["bbox_px"]
    assert np.abs(low - [left, height - bottom]).max() < 1e-8
    assert np.abs(high - [right, height - top]).max() < 1e-8


def test_points_may_be_glued_as_path_data_may(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    file.write_text('<svg><polygon points="0,0 1.0e1-0.5e1.5.5"/></svg>')
    assert read(file).length / PIXEL == pytest.approx(math.hypot(10, 5) + math.hypot(9.5, 5.5) + math.hypot(0.5, 0.5))


def test_a_prefix_that_is_not_declared_is_the_usual_one(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    body = '<defs><path id="p" d="M0 0H9"/></defs><g inkscape:label="cut"><use xlink:href="#p"/></g><sodipodi:g/>'
    file.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm">\n{body}</svg>')
    path = read(file, layer="cut")
    assert path.length / PIXEL == pytest.approx(9.0)
    file.write_text(f"<svg>{body}")
    with pytest.raises(FormatError, match=r"line 1, column \d+: no element found; expected SVG"):
        read(file)


# --- every element, against svgelements ---------------------------------------------------------------------------

DRAWINGS = {
    "commands": '<path d="M10,10 h5 v5 l-3 2 H2 V3 c1 2 3 4 5 6 s2-3 4,1 S30 30 40 10 q5 5 10 0 t10 0 T80 20 z '
    'm5 5l9 9"/>',
    "arcs": '<path d="M10 10 A30 20 30 1 0 50 40 a5 8 0 0121 5 A1 1 0 0 1 90 45 A0 5 0 0 1 95 50 '
    'A 400 300 5 0 0 99 9"/>',
    "glued": '<path d="M.5.5-3.5+4e1L1e1-2.5.5.25"/>',
    "after close": '<path d="M10 10 L20 10 L20 20 Z L5 5 M30 30 40 40 50 30z"/>',
    "rect": '<rect x="1" y="2" width="30" height="20"/><rect x="50" y="2" width="30" height="20" rx="5"/>'
    '<rect x="1" y="50" width="30" height="20" rx="50" ry="3"/>',
    "circle": '<circle cx="50" cy="50" r="20"/><ellipse cx="20" cy="70" rx="10" ry="3"/><circle r="0"/>',
    "poly": '<polyline points="1,2 3,4 10 5, 8,9"/><polygon points="50 50 60 50 60 60"/>'
    '<line x1="1" y1="9" x2="7" y2="90"/>',
    "transforms": '<g transform="translate(10, 5) rotate(30) skewX(10)"><rect width="20" height="10" rx="2"/>'
    '<g transform="matrix(1 .5 -.2 2 3 4)scale(.5)"><circle r="7"/>'
    '<path d="M0 0Q10 10 20 0" transform="rotate(90 3 4)"/>'
    '</g><ellipse rx="4" ry="9" transform="skewY(-20) scale(1 -1)"/></g>',
    "use": '<defs><g id="a"><rect id="b" width="5" height="4"/></g></defs><use href="#a" x="10" y="20"/>'
    '<use xlink:href="#b" transform="scale(2) rotate(45)" x="20" y="3"/>',
    "units": '<rect x="1mm" y="0.5in" width="2cm" height="10pt"/><circle cx="5pc" cy="2pc" r="4mm"/>',
    "hidden": '<g display="none"><rect width="9" height="9"/></g><rect width="3" height="2"/>'
    '<rect style="fill:red; display : none" width="3" height="5"/>',
}  # fmt: skip
ROOTS = {
    "mm": 'width="100mm" height="80mm" viewBox="0 0 100 80"',
    "inch": 'width="4in" height="3in" viewBox="0 0 100 80"',
    "meet": 'width="5in" height="3in" viewBox="-10 5 50 80"',
    "slice": 'width="96" height="300" viewBox="0 0 100 80" preserveAspectRatio="xMaxYMin slice"',
    "none": 'width="96" height="300" viewBox="0 0 100 80" preserveAspectRatio="none"',
    "bare": 'width="120" height="90"',
}


def drawing(root: str, body: str) -> str:
    spaces = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    return f"<svg {spaces} {root}>{body}</svg>"


def reference(file: Path) -> tuple[np.ndarray, float]:
    """Points (n, 2), px, on every curve as svgelements has it, and their length, px.

    Its `reify` leaves skewed circles and rectangles where they are, so the matrix is applied here.
    """
    points, length = [], 0.0
    for shape in svgelements.SVG.parse(str(file), reify=False, ppi=96.0).elements():
        if not isinstance(shape, svgelements.Shape):
            continue
        m = shape.transform
        matrix, offset = np.array([[m.a, m.b], [m.c, m.d]]), np.array([m.e, m.f])
        for segment in shape.segments(transformed=False):
            if isinstance(segment, svgelements.Move) or segment.start == segment.end:
                continue
            dense = [(p.x, p.y) for p in (segment.point(t) for t in np.linspace(0.0, 1.0, 801))]
            placed = np.array(dense) @ matrix + offset
            points.append(placed[::100])
            length += float(np.linalg.norm(np.diff(placed, axis=0), axis=1).sum())
    return np.concatenate(points), length


@pytest.mark.parametrize("root", [root for root in ROOTS if root != "mm"])
@pytest.mark.parametrize("body", DRAWINGS)
def test_an_element_lies_where_svgelements_draws_it(tmp_path: Path, root: str, body: str) -> None:
    file = tmp_path / "part.svg"
    file.write_text(drawing(ROOTS[root], DRAWINGS[body]))
    paths = read_all(file)
    height = {"inch": 288, "meet": 288, "slice": 300, "none": 300, "bare": 90}[root] * PIXEL
    points, length = reference(file)
    near = np.min([curve.nearest(points * PIXEL * [1, -1] + [0, height])[1] for curve in curves_of(paths)], axis=0)
    assert near.max() < (2e-3 if body == "units" else 1e-9)  # it has 1 mm = 3.7795 px
    assert sum(path.length for path in paths) == pytest.approx(length * PIXEL, rel=1e-4 if body == "units" else 1e-5)


def test_arcs_are_exact_and_one_curve_each(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    file.write_text(drawing(ROOTS["mm"], '<path d="M10 40 A30 30 0 1 1 40 70"/><circle cx="50" cy="40" r="7"/>'))
    arc, full = curves_of(read_all(file))
    assert np.abs(np.hypot(*(arc(np.linspace(0, 1, 500)) - [40, 40]).T) - 30).max() < 1e-13
    assert arc.ends.tolist() == [[10.0, 40.0], [40.0, pytest.approx(10.0, abs=1e-13)]]
    assert np.abs(np.hypot(*(full(np.linspace(0, 1, 500)) - [50, 40]).T) - 7).max() < 2e-14
    assert (full.degree, len(full.control_points), full.closed) == (2, 9, True)


def test_flat_arcs_of_huge_ellipses_keep_their_digits(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    file.write_text(drawing(ROOTS["mm"], '<path d="M10 40 A1e9 1e9 0 0 0 20 40"/>'))
    (path,) = read_all(file)
    (curve,) = path.curves
    middle = curve(0.5)
    assert abs(middle[1] - 40.0 - (-1.25e-8)) < 1e-13  # sagitta c^2 / 8 r


def test_symbols_inner_pages_and_switches(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    body = (
        '<symbol id="s" viewBox="0 0 10 10"><path d="M0 0H10"/></symbol>'
        '<use href="#s" x="5" y="6" width="20" height="20"/>'
        '<svg x="50" y="10" width="20" height="10" viewBox="0 0 40 40"><path d="M0 0V40"/></svg>'
        '<switch><path d="M1 70H3"/><path d="M1 75H3"/></switch>'
    )
    file.write_text(drawing(ROOTS["mm"], body))
    assert [curve.ends.round(12).tolist() for curve in curves_of(read_all(file))] == [
        [[5, 74], [25, 74]], [[55, 70], [55, 60]], [[1, 10], [3, 10]],
    ]  # fmt: skip


def test_a_switch_draws_the_first_that_is_meant_for_any_program(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    body = (
        '<switch><foreignObject requiredExtensions="http://ns.adobe.com/AdobeIllustrator/10.0/" width="1" height="1"/>'
        '<g requiredExtensions="http://example.org/x"><path d="M9 9H20"/></g><g><path d="M1 70H3"/></g>'
        '<path d="M9 8H20"/></switch><path requiredExtensions="x" d="M1 5H2"/>'
    )
    file.write_text(drawing(ROOTS["mm"], body))
    (path,) = read_all(file)
    assert path.curves[0].ends.round(12).tolist() == [[1, 10], [3, 10]]
    assert "left out: 1 path for other programs" in path.findings


def test_groups_are_layers_and_names_come_from_ids(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    body = (
        '<g id="g1" inkscape:label="Cut"><path id="one" d="M0 0H9"/><g><path d="M0 5H9"/></g></g>'
        '<g id="g2"><path d="M0 9H9"/><text>hello</text></g>'
    )
    root = ROOTS["mm"] + ' xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
    file.write_text(drawing(root, body))
    assert [path.name for path in read_all(file)] == ["one#1", "path#2", "path#3"]
    assert [path.name for path in read_all(file, layer="cut")] == ["one#1", "path#2"]
    lone = read(file, layer=["g2"])
    assert (lone.name, lone.findings) == ("part", ("left out: 1 text",))
    with pytest.raises(FormatError, match=r"has no group 'fold'; there are 'Cut', 'g1', 'g2'"):
        read_all(file, layer="fold")


def test_style_sheets_can_hide(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    body = (
        "<style>/* made by hand */ .no, #gone { fill: red; display: none } .dim{visibility:hidden}</style>"
        '<path class="cut no" d="M0 0H9"/><path id="gone" d="M0 1H9"/><g class="dim"><path d="M0 2H9"/>'
        '<path visibility="visible" d="M0 3H9"/></g>'
    )
    file.write_text(drawing(ROOTS["mm"], body))
    (path,) = read_all(file)
    assert path(0.0).tolist() == [0.0, 77.0]
    said = "not shown in the drawing, left out (option hidden): 2 path that is not displayed, 1 path that is hidden"
    assert path.findings == (said,)


def test_units_and_where_the_page_is(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    file.write_text(drawing('width="200" height="96"', '<line x1="25%" y1="50%" x2="100%" y2="50%"/>'))
    assert (read(file).curves[0].control_points / PIXEL).round(12).tolist() == [[50.0, 48.0], [200.0, 48.0]]
    file.write_text(drawing('width="2in" height="1in"', '<path d="M0 0H96"/>'))
    paths = read_all(file)
    assert (paths.units, paths[0].findings) == ("in", ())
    assert paths[0].curves[0].control_points.tolist() == [[0.0, pytest.approx(25.4)], [pytest.approx(25.4)] * 2]
    file.write_text(drawing("", '<path d="M0 0H96V10"/>'))
    (path,) = read_all(file)
    assert path.findings == (
        "the page has no size in mm or inch: 1 px is read as 1/96 inch (option units)",
        "the page has no height: y is flipped about 0",
    )
    assert path(path.length)[1] == pytest.approx(-10 * PIXEL)


# --- out and back ---------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_what_svg_can_hold_comes_back_as_it_was(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    body = DRAWINGS["commands"] + DRAWINGS["transforms"] + DRAWINGS["circle"]
    file.write_text(drawing(ROOTS["meet"], body))
    paths = read_all(file)
    assert write(paths, tmp_path / "out.svg") == ()
    back = read_all(tmp_path / "out.svg")
    assert [path.closed for path in back] == [path.closed for path in paths]
    for one, other in zip(paths, back, strict=True):
        assert other.length == pytest.approx(one.length, rel=1e-13)
        s = np.linspace(0, 1, 101)
        if not one.closed or not one.curves[0].rational:
            assert np.abs(one(s * one.length) - other(s * other.length)).max() < 1e-11
        far = [np.min([c.nearest(curve(np.linspace(*curve.domain, 20)))[1] for c in other.curves], axis=0)
               for curve in one.curves]  # fmt: skip
        assert max(each.max() for each in far) < 1e-12


def test_shapes_of_the_house_come_back_where_they_were(tmp_path: Path) -> None:
    for shape in (circle(10.0, center=(-30.0, 5.0)), ellipse(20.0, 10.0, 0.3, center=(3.0, -40.0))):
        assert write(shape, tmp_path / "out.svg") == ()
        back = read(tmp_path / "out.svg")
        want = shape.curves[0](np.linspace(0, 1, 200))
        assert np.max(np.min([c.nearest(want)[1] for c in back.curves], axis=0)) < 1e-13 * 40
        assert back.closed


def test_what_svg_cannot_hold_is_approximated_within_a_tolerance_that_is_kept(tmp_path: Path) -> None:
    shape = butterfly()
    for tolerance in (1e-2, 1e-5):
        (note,) = write(shape, tmp_path / "out.svg", tolerance=tolerance)
        assert note.startswith("1 curve(s) approximated by cubics, at most ")
        said = float(note.split("at most ")[1].split(" mm")[0])
        back = read(tmp_path / "out.svg")
        u = np.linspace(*shape.curves[0].domain, 3001)
        far = np.min([curve.nearest(shape.curves[0](u))[1] for curve in back.curves], axis=0).max()
        assert far <= said * 1.01 <= tolerance * 1.01


# --- faults ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ('<path id="p" d="L 1 2"/>', "line 1: <path id='p'>: path data: expected a command, M first at 'L 1 2'"),
        ('<path d="M 1 2 X 3"/>', "line 1: <path>: path data: expected a command, M first at 'X 3'"),
        ('<path d="M 1 2 C 3 4 5 6 7"/>', "line 1: <path>: path data: expected 6 numbers for C at '3 4 5 6 7'"),
        ('<path d="M 1 2 L 3 4 5"/>', "line 1: <path>: path data: expected a command, M first at '5'"),
        ('<path d="M 1 2 L"/>', "line 1: <path>: path data: expected 2 numbers for L, but the data ends"),
        ('<path d="M 1 2 A 3 3 0 2 0 5 5"/>', "line 1: <path>: path data: expected 7 numbers for A at '3 3 0 2 0 5 5'"),
        ('<path d="M 1,,2 L3 4"/>', "line 1: <path>: path data: expected 2 numbers for M at '1,,2 L3 4'"),
        ('<path d="M 1 2 L nan 4"/>', "line 1: <path>: path data: expected 2 numbers for L at 'nan 4'"),
        ('<path d="M 1 2 L 1e999 4"/>', "line 1: <path>: path data: expected numbers of at most 1e+100 at '1e999 4'"),
        ('<path d="M 1 2 L 1e99 4"/>', "a curve of 'path' goes beyond 1e+09 mm; check the units"),
        ('<path d="M0 0H1" transform="rotate(1 2)"/>', "line 1: <path>: transform: rotate(1 2) is not a function"),
        ('<path d="M0 0H1" transform="turn"/>', "line 1: <path>: transform: expected functions such as translate("),
        ('<rect width="-1" height="2"/>', "line 1: <rect>: its width, height or radius is below 0; expected 0 or more"),
        ('<rect width="2vw" height="2"/>', "line 1: <rect>: width is '2vw'; expected a number in px, in"),
        ('<polygon points="1 2 3"/>', "line 1: <polygon>: points: 3 numbers; expected pairs"),
        ('<polygon points="1 2 a 4"/>', "line 1: <polygon>: points: 'a' is not a number"),
        ('<use href="#no"/>', "line 1: <use>: there is no element with id 'no'"),
        ('<g id="a"><use href="#b"/></g><g id="b"><use href="#a"/></g>', "line 1: <use>: uses itself, or more"),
        ("<path d='M0 0H1'>", "line 1, column "),
        ("", "holds no curves"),
        ("<text>only words</text>", "holds no curves (left out: 1 text)"),
    ],
)  # fmt: skip
def test_faults_are_one_line_with_their_place(tmp_path: Path, body: str, reason: str) -> None:
    file = tmp_path / "bad.svg"
    file.write_text(drawing(ROOTS["mm"], body))
    with pytest.raises(FormatError) as caught:
        read_all(file)
    assert str(caught.value).startswith(f"{file}: {reason}")


IMPLIED = " ".join(f"a{k} CDATA #IMPLIED" for k in range(101))
LAUGHS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 10))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (f'<!-- a -->\n<!DOCTYPE svg [<!ENTITY l0 "ha">{LAUGHS}]>\n<svg>&l9;</svg>', "line 2: declares the entity"),
        ('<!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/passwd">]><svg>&x;</svg>', "line 1: declares the entity 'x'"),
        ('<!DOCTYPE svg [<!ENTITY % x SYSTEM "http://localhost/x"> %x;]><svg/>', "line 1: declares the entity 'x'"),
        ('<!DOCTYPE svg [<!ATTLIST g a CDATA "1">]><svg/>', "line 1: gives every <g> the attribute 'a'; save it"),
        (f"<!DOCTYPE svg [<!ATTLIST g {IMPLIED}>]><svg/>", "line 1: declares more than 100 attributes; save it"),
        ("<html><svg/></html>", "line 1: <html>: expected <svg>"),
        ("<svg" + ">" * 1, "line 1, column 6: no element found; expected SVG, is the file complete?"),
        ("<svg>" + "<g>" * 500 + "</g>" * 500 + "</svg>", "line 1: has more than 500000 elements, or"),
        ('<svg viewBox="0 0 0 5"><path d="M0 0H1"/></svg>', "line 1: <svg>: viewBox is '0 0 0 5'; expected x, y"),
        ('<svg viewBox="0 0 5"/>', "line 1: <svg>: viewBox is '0 0 5'; expected x, y, and a width"),
        ('<svg width="0" height="5"/>', "line 1: <svg>: its width or height is not above 0"),
        ('<svg width="wide"/>', "line 1: <svg>: width is 'wide'; expected a number in px"),
        ('<?xml version="1.0" encoding="klingon"?><svg/>', ""),
    ],
)  # fmt: skip
def test_hostile_files_are_refused_in_one_line(tmp_path: Path, text: str, reason: str) -> None:
    file = tmp_path / "bad.svg"
    file.write_text(text)
    with pytest.raises(FormatError) as caught:
        read_all(file)
    assert str(caught.value).startswith(f"{file}: {reason}")


def test_a_doctype_that_declares_attributes_as_old_drawing_programs_do_is_read(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    declared = "<!DOCTYPE svg [<!ATTLIST svg xmlns:a3 CDATA #IMPLIED a3:scriptImplementation CDATA #IMPLIED>]>\n"
    file.write_text(declared + drawing(ROOTS["mm"], '<path d="M0 0H1"/>'))
    assert read(file).length == pytest.approx(1.0)


def test_a_doctype_without_entities_is_read(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    public = '<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">\n'
    file.write_text(public + drawing(ROOTS["mm"], '<path d="M0 0H1"/>'))
    assert read(file).length == pytest.approx(1.0)


def test_uses_that_multiply_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(svg, "MAX_USED", 5000)
    file = tmp_path / "bad.svg"
    groups = "".join(f'<g id="g{i}">{f"""<use href="#g{i + 1}"/>""" * 10}</g>' for i in range(9))
    file.write_text(drawing(ROOTS["mm"], f'<defs>{groups}<path id="g9" d="M0 0H1"/></defs><use href="#g0"/>'))
    with pytest.raises(FormatError, match="more than 5000 elements are drawn by uses"):
        read_all(file)
    deep = "".join(f'<g id="g{i}"><use href="#g{i + 1}"/></g>' for i in range(60)) + '<path id="g60" d="M0 0H1"/>'
    file.write_text(drawing(ROOTS["mm"], f'<defs>{deep}</defs><use href="#g0"/>'))
    with pytest.raises(FormatError, match="uses itself, or more than 32 deep"):
        read_all(file)


def test_repair_keeps_what_stands_before_a_fault(tmp_path: Path) -> None:
    file = tmp_path / "bad.svg"
    file.write_text(drawing(ROOTS["mm"], '<path d="M1 1 H6 V oops"/><use href="#no"/>\n<rect width="-1" height="1"/>'))
    (path,) = read_all(file, repair=True)
    assert path.length == pytest.approx(5.0)
    assert path.findings == (
        "line 1: <path>: path data: expected 1 numbers for V at 'oops'; what comes before it is kept",
        "line 1: <use>: there is no element with id 'no'; left out",
        "line 2: <rect>: its width, height or radius is below 0; expected 0 or more; left out",
    )


def test_rotary_axes_feeds_and_depth_are_lost_in_words(tmp_path: Path) -> None:
    helix = read_json_helix()
    notes = write(helix, tmp_path / "out.svg")
    assert notes == ("SVG has no place for these, which are left out: rotary axes (a), z, feeds",)
    with pytest.raises(InputError, match="option 'colour' is not one of a SVG drawing file"):
        write(helix, tmp_path / "out.svg", colour="red")


def read_json_helix():
    import splinefeed as sf

    points = [[0, 0, 0, 0], [1, 2, 3, math.pi], [4, 4, 4, 1], [6, 0, 1, 2]]
    return sf.Path([sf.NurbsCurve.bezier(points)], axes=("x", "y", "z", "a"), feeds=[10.0])


@pytest.mark.parametrize("name", ["svg/svgpathtools_transforms.svg", "svg/resvg_no-commawsp-arc-flags.svg"])
def test_a_file_cut_anywhere_is_refused(tmp_path: Path, data_dir: Path, name: str) -> None:
    content = (data_dir / name).read_bytes().rstrip()
    file = tmp_path / "cut.svg"
    for size in range(1, len(content), len(content) // 40):
        file.write_bytes(content[:size])
        with pytest.raises(FormatError):
            read_all(file)


ILLUSTRATOR = "<!-- Generator: Adobe Illustrator 24.0.1, SVG Export Plug-In . SVG Version: 6.00 Build 0)  -->"
INKSCAPE = 'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" inkscape:version="{}"'


@pytest.mark.parametrize(
    ("before", "attributes", "per_inch", "said"),
    [
        (ILLUSTRATOR, 'width="850.39px" height="200px" viewBox="0 0 850.39 200"', 72, "Adobe Illustrator"),
        (ILLUSTRATOR, 'width="200mm" height="100mm" viewBox="0 0 566.93 283.46"', 72, ""),
        ("", 'xmlns:i="http://ns.adobe.com/AdobeIllustrator/10.0/" width="300" height="200"', 72, "Adobe Illustrator"),
        ("", INKSCAPE.format("0.48.4 r9939") + ' width="300" height="200"', 90, "Inkscape before 0.92"),
        ("", INKSCAPE.format("0.91 r13725") + ' width="100mm" height="80mm"', 90, "Inkscape before 0.92"),
        ("", INKSCAPE.format("0.92.4") + ' width="300" height="200"', 96, ""),
        ("", INKSCAPE.format("1.2.2") + ' width="300" height="200"', 96, ""),
        ("", 'width="300" height="200"', 96, ""),
    ],
)
def test_a_px_is_what_the_program_takes_it_for_that_wrote_the_drawing(tmp_path, before, attributes, per_inch, said):
    """After LaserWeb4#346 (Illustrator: 72), OpenBuilds-CAM#76 and LasaurApp#72 (Inkscape 0.48 and 0.91: 90)."""
    file = tmp_path / "drawing.svg"
    inner = f'<path fill="none" stroke="red" d="M 0 0 h {per_inch}"/>'
    file.write_text(f'<?xml version="1.0"?>{before}<svg xmlns="http://www.w3.org/2000/svg" {attributes}>{inner}</svg>')
    path = sf.read(file)
    assert path.length == pytest.approx(25.4, rel=1e-4)
    assert any(f"1/{per_inch} inch" in each and said in each for each in path.findings) or not said
    height = {"100mm": 100.0, "80mm": 80.0}.get(
        attributes.split('height="')[1].partition('"')[0], 200 * 25.4 / per_inch
    )
    assert path.curves[0].control_points[0, 1] == pytest.approx(height, rel=1e-4)  # the top of the page


def test_the_option_says_what_a_px_is_whoever_wrote_the_drawing(tmp_path):
    file = tmp_path / "drawing.svg"
    inner = '<path fill="none" stroke="red" d="M 0 0 h 10"/>'
    file.write_text(f'{ILLUSTRATOR}<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9">{inner}</svg>')
    assert sf.read(file, units="mm").length == pytest.approx(10.0)
