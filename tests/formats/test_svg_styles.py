"""SVG: style sheets, transforms as properties, symbols and inner pages, packed files."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
import svgelements

from splinefeed.errors import FormatError
from splinefeed.formats.registry import format_of, read, read_all, write
from splinefeed.formats.svg_tree import Node, Styles, read_tree
from splinefeed.paths.shapes import circle

SPACES = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'


def drawing(body: str, more: str = "") -> str:
    return f'<svg {SPACES} width="100mm" height="100mm" viewBox="0 0 100 100" {more}>{body}</svg>'


def drawn(folder: Path, body: str, more: str = "", **options: object) -> list[list[list[float]]]:
    """Ends of all paths, mm, y down from the upper edge as in the file."""
    file = folder / "part.svg"
    file.write_text(drawing(body, more))
    paths = read_all(file, **options)
    return [(path.ends[[0, -1], [0, 1]] * [1, -1] + [0, 100]).round(9).tolist() for path in paths]


# --- who is meant ---------------------------------------------------------------------------------------------------

TREE = (
    '<g id="a" class="one two"><path id="p" class="cut deep"/><path id="q"/><rect id="r" data-k="x-y z"/></g>'
    '<g id="b"><g id="c" class="two"><path id="s" class="cut"/></g></g>'
)


def styled(rules: str, body: str) -> tuple[Node, Styles]:
    root = read_tree(f"<svg {SPACES}><style><![CDATA[{rules}]]></style>{body}</svg>".encode())
    return root, Styles(root)


@pytest.mark.parametrize(
    ("selector", "meant"),
    [
        ("path", "pqs"), ("*", "abcpqrs"), (".cut", "ps"), ("#a, #b", "ab"), (".two", "ac"), (".tw", ""), ("#p", "p"),
        ("rect ,.deep,#q", "pqr"), ("PATH", ""),
    ],
)  # fmt: skip
def test_a_selector_means_what_css_says(selector: str, meant: str) -> None:
    root, styles = styled(f"{selector} {{ display: none }}", TREE)
    found = [n.attrib["id"] for n in root.walk() if "id" in n.attrib and styles.of(n).get("display") == "none"]
    assert sorted(found) == sorted(meant) and not styles.findings


@pytest.mark.parametrize(
    ("rules", "own", "value"),
    [
        ("path{x:1} path{x:2}", "", "2"), ("#p{x:1} .cut{x:2} path{x:3}", "", "1"), (".cut{x:1} path{x:2}", "", "1"),
        (".cut{x:1} .deep{x:2}", "", "2"), (".deep{x:1} .cut{x:2}", "", "2"),
        ("path{x:1}", "x:5", "5"), ("path{x:1 !important} #p{x:2}", "", "1"), ("path{x:1!important}", "x:5", "1"),
        ("path{x:1!important}", "x:5 !important", "5"), ("@charset 'a'; path{x:1}", "", "1"),
        ("@media print { path{x:1} }", "", "7"), ("@font-face{src:x} path{x:1}", "", "1"),
        ("@media print { path{x:1} g{x:2} } path{x:3}", "", "3"), ("@keyframes k{from{x:1} to{x:2}} g{y:3}", "", "7"),
        ("path{x:initial}", "", None), ("path{x:1", "", "1"),
        ("/* path{x:1} */ path{X : 2 ; ;}", "", "2"), ("<!-- path{x:4} -->", "", "4"), ("}} path{x:1}", "", "1"),
        ("path{x:1;x:2}", "", "2"), ("path{x:1!important;x:2}", "", "1"),
    ],
)  # fmt: skip
def test_the_later_and_the_nearer_rule_decides(rules: str, own: str, value: str | None) -> None:
    root, styles = styled(rules, f'<path id="p" class="cut deep" x="7" style="{own}"/>')
    assert styles.of(root.children[1]).get("x") == value


@pytest.mark.parametrize(
    "selector", ["g path", "path.cut", "path:not(.cut)", "g > path", "[class]", "path::before", "svg|path", "a " * 300]
)
def test_rules_that_are_not_understood_are_findings_where_they_matter(selector: str) -> None:
    assert styled(f"{selector}{{color:red}}", TREE)[1].findings == []
    assert styled(f"{selector}{{x:1}}", TREE)[1].findings == [
        "1 rule of the style sheet not followed; what such a rule hides, moves or sizes is read as it stands: "
        f"{selector.strip()[:40]!r}"
    ]


def test_at_rules_are_findings_where_they_matter(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    rules = (
        "a b{display:none} @import url(x.css); @media (width>9px){path{r:1} g{s:1}} @page{margin:0} @font-face{src:x}"
    )
    file.write_text(drawing(f"<style><![CDATA[{rules}]]></style><path d='M0 0H9'/>"))
    assert read(file).findings == (
        "3 rules of the style sheet not followed; what such a rule hides, moves or sizes is read as it stands: "
        "'a b', '@import url(x.css)', '@media (width>9px)'",
    )


def test_large_sheets_and_open_brackets_take_no_longer_than_their_text(tmp_path: Path) -> None:
    """A class that 20,000 rules and 20,000 elements name: a step each, not one a pair."""
    rules = "".join(f".a{{x:{k}}}" for k in range(20_000)) + f".a{{x:{'(' * 99_999}"
    body = "<path class='a' d='M0 0H9'/>" * 20_000
    assert len(drawn(tmp_path, f"<style>{rules}</style>{body}")) == 20_000


# --- where it lies --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("body", "ends"),
    [
        # properties move as attributes do, and overrule them
        ('<path d="M0 0H9" transform="scale(3)" style="transform: translate(10, 20)"/>', [[10, 20], [19, 20]]),
        ('<style>path{transform:rotate(90)}</style><path d="M0 0H9"/>', [[0, 0], [0, 9]]),
        ('<path d="M0 0H9" style="transform:translate(0 10)scale(2 1) skewY(45)"/>', [[0, 10], [18, 19]]),
        ('<path d="M50 50H60" transform="rotate(90)" transform-origin="50 50"/>', [[50, 50], [50, 60]]),
        ('<path d="M50 50H60" transform="scale(2)" style="transform-origin:center"/>', [[50, 50], [70, 50]]),
        ('<path d="M100 0V10" transform="scale(2)" style="transform-origin:right top"/>', [[100, 0], [100, 20]]),
        ('<path d="M0 0H9" style="transform:scale(2);transform-origin:bottom"/>', [[-50, -100], [-32, -100]]),
        ('<path d="M0 0H9" style="transform:none" transform="scale(2)"/>', [[0, 0], [9, 0]]),
        ('<style>line{x1:1}</style><line x1="2" y1="3" x2="9" y2="3"/>', [[2, 3], [9, 3]]),
        # pages within pages, symbols
        ('<svg x="10" y="20" width="50" height="40"><line x2="100%" y2="50%"/></svg>', [[10, 20], [60, 40]]),
        ('<svg x="10%" width="50" height="50" viewBox="0 0 10 20"><line x2="100%"/></svg>', [[22.5, 0], [47.5, 0]]),
        ('<svg width="50" height="50" viewBox="0 0 10 20" preserveAspectRatio="xMinYMax slice"><line x2="10"/></svg>',
         [[0, -50], [50, -50]]),
        ('<svg viewBox="0 0 50 50"><line x2="5" y2="5"/></svg>', [[0, 0], [10, 10]]),
        ('<symbol id="s" viewBox="0 0 10 10"><line x2="5" y2="5"/></symbol><use href="#s"/>', [[0, 0], [50, 50]]),
        ('<symbol id="s" viewBox="0 0 10 10" width="20" height="20"><line x2="5" y2="5"/></symbol>'
         '<use href="#s" x="1" height="40"/>', [[1, 10], [11, 20]]),
        ('<symbol id="s"><line x2="50%" y2="5"/></symbol><use href="#s" width="20" height="9"/>', [[0, 0], [10, 5]]),
        ('<symbol id="s" transform="scale(2)"><line x2="5" y2="5"/></symbol><use href="#s" x="3"/>',
         [[3, 0], [13, 10]]),
        ('<svg id="s" x="5" width="9" height="9"><line x2="100%"/></svg><g display="none"/>', [[5, 0], [14, 0]]),
        ('<defs><svg id="s" x="5" width="9" height="9"><line x2="100%"/></svg></defs><use href="#s" x="2" width="30"/>',
         [[7, 0], [37, 0]]),
    ],
)  # fmt: skip
def test_an_element_lies_where_css_and_svg_2_put_it(tmp_path: Path, body: str, ends: list[list[float]]) -> None:
    assert drawn(tmp_path, body) == [ends]


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ('<path d="M0 0H9" style="transform:rotate3d(1,1,1,3deg)"/>', "transform: expected functions such as"),
        ('<path d="M0 0H9" style="transform:scale(2px)"/>', "transform: scale: '2px' is not a number"),
        ('<path d="M0 0H9" style="transform:rotate(3deg)"/>', "transform: rotate: '3deg' is not a number"),
        ('<path d="M0 0H9" style="transform:translateX(3)"/>', "transform: translateX(3) is not a function of SVG"),
        ('<path d="M0 0H9" style="d:path(&quot;M1 1H5&quot;)"/>', "path data: expected a command, M first at 'path("),
        ('<path d="M0 0H9em"/>', "path data: expected a command, M first at 'em'"),
        ('<path d="M0 0H9" style="rotate:3deg"/>', "the property rotate is not supported; write it as transform"),
        ('<path d="M0 0H9" style="transform:scale(2);transform-box:fill-box"/>', "transform-box is 'fill-box'; only"),
    ],
)  # fmt: skip
def test_what_css_can_and_this_cannot_is_said(tmp_path: Path, body: str, reason: str) -> None:
    with pytest.raises(FormatError) as caught:
        drawn(tmp_path, body)
    assert str(caught.value).split("<path>: ")[1].startswith(reason)


def test_symbols_that_are_not_shown_stay_away(tmp_path: Path) -> None:
    body = '<symbol id="s" style="display:none"><path d="M0 0H9"/></symbol><use href="#s"/><path d="M0 1H9"/>'
    assert drawn(tmp_path, body) == [[[0, 1], [9, 1]]]


def test_clips_masks_and_moved_pages_are_findings(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    body = '<g clip-path="url(#c)"><path d="M0 0H9" style="mask:url(#m)"/></g><path d="M0 1H9" clip-path="none"/>'
    file.write_text(drawing(body, 'transform="scale(2)"'))
    assert read_all(file)[0].findings == (
        "the transform of the page itself is not applied",
        "left out: 1 clip-path of g, which is drawn whole, 1 mask of path, which is drawn whole",
    )


#: What svgelements knows of it too; symbols and inner pages it puts elsewhere than Chromium does, which agrees with us.
SHARED = {
    "classes": "<style>.a{display:none} .c{display:inline}</style>"
    '<path class="a" d="M0 0H9"/><path class="c" d="M0 5H9"/>',
    "style": '<g transform="translate(3,4)"><rect width="4" height="5" transform="rotate(20)"/></g>',
}  # fmt: skip


@pytest.mark.parametrize("name", SHARED)
def test_svgelements_sees_the_same(tmp_path: Path, name: str) -> None:
    file = tmp_path / "part.svg"
    file.write_text(drawing(SHARED[name]))
    shapes = [s for s in svgelements.SVG.parse(str(file), ppi=96.0).elements() if isinstance(s, svgelements.Shape)]
    boxes = np.array([shape.bbox() for shape in shapes]).reshape(-1, 2, 2)
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    found = np.array([path.bounding_box() for path in read_all(file)])
    ours = np.array([found[:, 0].min(axis=0), found[:, 1].max(axis=0)]) * 96.0 / 25.4
    height = 100.0 * 96.0 / 25.4
    assert np.abs(ours[:, 0] - [low[0], high[0]]).max() < 1e-3
    assert np.abs(height - ours[::-1, 1] - [low[1], high[1]]).max() < 1e-3


# --- files ----------------------------------------------------------------------------------------------------------


def test_packed_drawings_are_read_and_written(tmp_path: Path) -> None:
    file = tmp_path / "part.svgz"
    assert write(circle(5.0), file) == ()
    content = file.read_bytes()
    assert content[:2] == b"\x1f\x8b" and gzip.decompress(content).startswith(b"<")
    assert write(circle(5.0), file) == () and file.read_bytes() == content
    assert read(file).length == pytest.approx(10.0 * np.pi, rel=1e-13)
    other = tmp_path / "drawing.bin"
    other.write_bytes(content + b"\0" * 512)
    assert format_of(other).title == "SVG drawing" and read(other).closed


def test_packed_drawings_that_are_cut_garbled_or_bombs_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "part.svgz"
    whole = gzip.compress(drawing('<path d="M0 0H9"/>').encode())
    for end in range(2, len(whole) - 1):
        file.write_bytes(whole[:end])
        with pytest.raises(FormatError):
            read(file)
    for content, reason in (
        (whole[:20] + b"\xff\xff" + whole[22:], "is not a valid gzip file"),
        (whole[:-8] + b"\0" * 8, "is not a valid gzip file"),
        (whole + b"PK", "is not a valid gzip file"),
        (gzip.compress(b"<svg>" + b" " * (300 * 2**20), 1), "unpacks to more than 256 MB"),
    ):
        file.write_bytes(content)
        with pytest.raises(FormatError, match=reason):
            read(file)


def test_entities_as_illustrator_writes_them_are_read(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    names = '<!ENTITY ns_svg "http://www.w3.org/2000/svg"><!ENTITY st0 "display:none">'
    body = '<path d="M0 0H9"/><path d="M0 1H9" style="&st0;"/>'
    file.write_text(f"<!DOCTYPE svg [{names}]>{drawing(body).replace('http://www.w3.org/2000/svg', '&ns_svg;', 1)}")
    assert read(file).length == pytest.approx(9.0)
    file.write_text(f'<!DOCTYPE svg [<!ENTITY a SYSTEM "other.svg">]>{drawing(body)}')
    with pytest.raises(FormatError, match="line 1: declares the entity 'a', which is in another file"):
        read(file)


def test_a_page_gets_its_size_from_its_style_where_it_has_no_other(tmp_path: Path) -> None:
    file = tmp_path / "part.svg"
    file.write_text(f'<svg {SPACES} style="width:50mm;height:50mm" viewBox="0 0 10 10"><path d="M0 0H1"/></svg>')
    assert read(file).length == pytest.approx(5.0)
    file.write_text(f'<svg {SPACES} style="width:100%" width="50mm" viewBox="0 0 10 10"><path d="M0 0H1"/></svg>')
    assert read(file).length == pytest.approx(5.0)
