"""SVG drawings: every path and shape exactly, in mm with y up; see docs/formats.md.

SVG counts y downwards from the upper left corner of the page. Here x = 0, y = 0 is the lower left corner of the page,
as on a machine; where the page has no known height, y is only turned about. 1 px is 1/96 inch. The elements are read
here and not by svgelements, which mends silently what a machine should not cut; the tests hold both against each other.
"""

from __future__ import annotations

import os
import pathlib
import re
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats import svg_paths, svg_places, svg_shapes
from splinefeed.formats.contents import Contents
from splinefeed.formats.drawing import Drawing, counted, join_tolerance, layers_from
from splinefeed.formats.source import head_text
from splinefeed.formats.svg_paths import Piece, Subpath
from splinefeed.formats.svg_places import Affine, ShapeError, Viewport
from splinefeed.formats.svg_styles import Styles
from splinefeed.formats.svg_tree import GZIP, MAX_DEPTH, Node, read_tree, unpacked
from splinefeed.formats.svg_write import write as write
from splinefeed.geometry.arcs import polyline
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.path import JOIN_TOLERANCE
from splinefeed.records import Array

#: Elements drawn in one file, those that are used again counted each time, and how deep uses may be nested.
MAX_DRAWN = 500_000
MAX_USES = 32
#: Attribute of the root element in which `svg_write` keeps where the page lies, x and y of its lower left corner, mm.
ORIGIN = "data-splinefeed-origin"
_MM_PER_PIXEL = 25.4 / 96.0
_SHAPES = {"path", "rect", "circle", "ellipse", "line", "polyline", "polygon"}
_HOLDERS = {"g", "a", "svg", "switch", "symbol", "use"}
#: What draws nothing by itself, and what draws something that is not a curve.
_SILENT = {
    "", "title", "desc", "metadata", "style", "defs", "symbol", "clipPath", "mask", "marker", "pattern", "filter",
    "linearGradient", "radialGradient", "view", "cursor", "animate", "animateTransform", "animateMotion", "set",
    "font", "font-face",
}  # fmt: skip
_QUOTED_DATA = re.compile(r"""path\(\s*(["'])(.*)\1\s*\)""", re.DOTALL)
_OF_THE_FONT = re.compile(rb"""[\d.](?:ex|ch)\s*["';]""")
_ROOT = re.compile(rb"<(?:[\w.-]+:)?svg[\s>/]")
_BEZIER_KNOTS = {degree: np.repeat([0.0, 1.0], degree + 1) for degree in (2, 3)}
for _knots in _BEZIER_KNOTS.values():
    _knots.setflags(write=False)


def holds(head: bytes) -> bool:
    """Whether `head`, packed or not, looks like this format: an element svg near the begin of what starts with <."""
    if head.startswith(GZIP):
        try:
            head = zlib.decompressobj(zlib.MAX_WBITS | 16).decompress(head, len(head))
        except zlib.error:
            return False
    return head_text(head[:256]).lstrip()[:1] == "<" and _ROOT.search(head) is not None


def from_file(
    file: str | os.PathLike[str],
    *,
    tolerance: float | str = JOIN_TOLERANCE,
    layer: str | Sequence[str] | None = None,
    repair: bool = False,
) -> Contents:
    """The paths in a drawing: curves whose ends meet within `tolerance`, mm, in the order of the file.

    `layer` reads only what is in groups of these names (Inkscape's label, or id), a list or with commas between them.
    """
    allowed, wanted = join_tolerance(tolerance), layers_from(layer)
    source = os.fspath(file)
    content = unpacked(pathlib.Path(file).read_bytes(), source)
    findings: list[str] = []
    reader = _Reader(source, read_tree(content, source, findings), wanted, repair)
    reader.drawing.findings += findings
    if _OF_THE_FONT.search(content):
        reader.drawing.findings.append("ex and ch are read as half the size of the letters: the font is not known here")
    unit = reader.read()
    return Contents(reader.drawing.paths(pathlib.Path(file).stem, allowed, repair), unit)


class _Place(NamedTuple):
    """Where elements are drawn: the map to mm, what percentages are of, the uses around them, and whether they are."""

    map: Affine
    view: Viewport
    uses: tuple[str, ...]
    chosen: bool
    visible: bool


class _Reader:
    """Walks the tree and collects pieces, in mm."""

    def __init__(self, source: str, root: Node, layers: Sequence[str], repair: bool) -> None:
        self.source = source
        self.root = root
        self.repair = repair
        self.wanted = {name.casefold() for name in layers}
        self.drawing = Drawing(source)
        self.styles = Styles(root, source)
        self.drawing.findings += self.styles.findings
        self.cut: Counter[str] = Counter()
        self.drawn = self.depth = 0
        self._paths: dict[int, tuple[list[Subpath], str]] = {}
        self.named: dict[str, Node] = {}
        self.groups: dict[str, None] = {}
        for node in root.walk():
            if "id" in node.attributes:
                self.named.setdefault(node.attributes["id"], node)
            if node.tag == "g":
                self.groups |= dict.fromkeys(_labels(node))

    def read(self) -> str:
        """Read everything that is drawn; the unit of the page."""
        missing = [name for name in self.wanted if name not in {each.casefold() for each in self.groups}]
        if missing:
            listed = ", ".join(repr(each) for each in list(self.groups)[:12])
            raise FormatError(f"{self.source}: has no group {missing[0][:40]!r}; there are {listed or 'none'}")
        try:
            place, view, unit = self._page()
        except ShapeError as error:
            raise FormatError(f"{self.source}: {self.root.place()}: {error}") from None
        visible = _visible(self.styles.of(self.root), True)
        for child in self.root.children:
            self._node(child, _Place(place, view, (), chosen=not self.wanted, visible=visible))
        if self.cut:
            self.drawing.findings.append(
                f"clips and masks are not applied; what they cut is drawn whole: {counted(self.cut)}"
            )
        return unit

    def _page(self) -> tuple[Affine, Viewport, str]:
        """The map from user units to mm with y up, what percentages are of, and the unit of the page's size."""
        said = self.styles.of(self.root)
        font = svg_places.font_size(said.get("font-size", said.get("font", "")), Viewport(None, None))
        unknown = Viewport(None, None, font, font)
        # what a web page makes of its size counts only where the drawing says none
        given = {**said, **self.root.attributes}
        if given.get("transform", "").strip() not in ("", "none"):
            self.drawing.findings.append("the transform of the page itself is not applied")
        box = svg_places.view_box(given)
        sizes: list[float | None] = []
        unit = ""
        for name in ("width", "height"):
            text = given.get(name, "").strip()
            relative = text in ("", "auto") or text.endswith("%")
            sizes.append(None if relative else svg_places.length(text, name, unknown, "x"))
            unit = unit or ("" if relative else re.sub(r"[^a-zA-Z]", "", text.lower().lstrip("+-.0123456789e")) or "px")
        width, height = sizes
        if box is not None:  # a size that is not given follows from the other, or is that of the view box
            if width is None:
                width = box[2] if height is None else height * box[2] / box[3]
            if height is None:
                height = width * box[3] / box[2]
        if any(size is not None and size <= 0.0 for size in (width, height)):
            raise ShapeError("its width or height is not above 0")
        inner = Affine()
        if box is not None and width is not None and height is not None:
            inner = svg_places.fit_view_box(box, width, height, given.get("preserveAspectRatio", ""))
        if unit in ("", "px"):
            self.drawing.findings.append("the page has no size in mm or inch: 1 px is read as 1/96 inch")
        if height is None:
            self.drawing.findings.append("the page has no height: y is flipped about 0")
        x, y = 0.0, 0.0
        if ORIGIN in given:
            x, y = (*svg_places.numbers(given[ORIGIN], ORIGIN), 0.0, 0.0)[:2]
        up = Affine(_MM_PER_PIXEL, 0.0, 0.0, -_MM_PER_PIXEL, x, y + (height or 0.0) * _MM_PER_PIXEL)
        view = unknown._replace(width=width, height=height)
        view = view if box is None else view._replace(width=box[2], height=box[3])
        return up.after(inner), view, unit or "px"

    # --- the tree ---------------------------------------------------------------------------------------------------

    def _fault(self, node: Node, text: str, *, kept: str = "left out") -> None:
        """An error, or when repairing a finding."""
        if not self.repair:
            raise FormatError(f"{self.source}: {node.place()}: {text}")
        self.drawing.findings.append(f"{node.place()}: {text}; {kept}")

    def _node(self, node: Node, at: _Place, used: Mapping[str, str] | None = None) -> None:
        """Draw an element; `used` are the sizes that a use gives to a symbol or an inner svg."""
        tag = node.tag
        self.drawn += 1
        if self.drawn > MAX_DRAWN:
            raise FormatError(f"{self.source}: draws more than {MAX_DRAWN} elements, uses counted each time")
        if tag in _SILENT and not (tag == "symbol" and used is not None):
            return
        if not _meant(node):
            self.drawing.left_out[f"{tag[:40]} for programs with other extensions or of other languages"] += 1
            return
        given = self.styles.of(node)
        if given.get("display", "").lower() == "none":
            self.drawing.left_out[f"{tag} that is not displayed"] += 1
            return
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise FormatError(f"{self.source}: {node.place()}: elements and uses are nested more than {MAX_DEPTH} deep")
        try:
            view = at.view
            if "font-size" in given or "font" in given:
                view = view._replace(font=svg_places.font_size(given.get("font-size", given.get("font", "")), view))
            place = at.map.after(svg_places.placing(given, view))
            at = at._replace(map=place, view=view, visible=_visible(given, at.visible))
            if tag not in _HOLDERS and not (at.chosen and at.visible and tag in _SHAPES):
                if at.chosen:
                    self.drawing.left_out[f"{tag} that is hidden" if tag in _SHAPES else tag[:40]] += 1
                return
            for name in ("clip-path", "mask"):
                if given.get(name, "none").strip().lower() not in ("none", ""):
                    self.cut[f"{name} of {tag}"] += 1
            if tag == "use":
                self._use(node, given, at)
            elif tag in _HOLDERS:
                self._group(node, {**given, **(used or {})}, at)
            else:
                self._shape(node, given, at)
        except ShapeError as error:
            self._fault(node, str(error))
        finally:
            self.depth -= 1

    def _group(self, node: Node, given: Mapping[str, str], at: _Place) -> None:
        at = at._replace(chosen=at.chosen or any(name.casefold() in self.wanted for name in _labels(node)))
        if node.tag in ("svg", "symbol"):
            place, view = svg_places.nested(given, at.map, at.view)
            at = at._replace(map=place, view=view)
        children = node.children
        if node.tag == "switch":  # Illustrator puts its own data first, as a foreignObject that only it understands
            drawn = (child for child in children if child.tag not in _SILENT | {"foreignObject"} and _meant(child))
            children = [child for child, _ in zip(drawn, range(1), strict=False)]
        for child in children:
            self._node(child, at)

    def _use(self, node: Node, given: Mapping[str, str], at: _Place) -> None:
        target = given.get("href", given.get("xlink:href", "")).strip()
        if not target.startswith("#"):
            self.drawing.left_out[f"use of another file, {target[:60]!r}"] += 1
            return
        name = target[1:]
        found = self.named.get(name)
        if found is None:
            raise ShapeError(f"there is no element with id {name[:40]!r}")
        if name in at.uses:
            raise ShapeError(f"uses itself ({' > '.join([*at.uses[at.uses.index(name) :], name])[:120]})")
        if len(at.uses) >= MAX_USES:
            raise ShapeError(f"uses are nested more than {MAX_USES} deep")
        x, y = (svg_places.length(given.get(key) or "0", key, at.view, key) for key in ("x", "y"))
        sizes = {key: value for key, value in given.items() if key in ("width", "height") and value.strip() != "auto"}
        self._node(found, at._replace(map=at.map.after(Affine(e=x, f=y)), uses=(*at.uses, name)), used=sizes)

    # --- curves -----------------------------------------------------------------------------------------------------

    def _parsed(self, node: Node, data: str) -> tuple[list[Subpath], str]:
        """Subpaths and fault of a path; once for all of its uses."""
        key = id(node)
        if key not in self._paths:
            quoted = _QUOTED_DATA.fullmatch(data.strip())
            self._paths[key] = svg_paths.parse(data if quoted is None else quoted[2])
        return self._paths[key]

    def _shape(self, node: Node, given: Mapping[str, str], at: _Place) -> None:
        if node.tag == "path":
            found, fault = self._parsed(node, given.get("d", ""))
            if fault:
                self._fault(node, f"path data: {fault}", kept="what comes before it is kept")
        else:
            found = svg_shapes.subpaths(node.tag, given, at.view)
        name = node.attributes.get("label") or node.attributes.get("id") or node.tag
        for subpath in found:
            curves = _curves(subpath, at.map)
            if curves:
                self.drawing.add(curves, name)


def _meant(node: Node) -> bool:
    """Whether an element is for a reader that knows no extensions, and English. Source: W3C, SVG 1.1, section 5.8."""
    said = node.attributes
    languages = said.get("systemLanguage", "en").lower().replace(" ", "").split(",")
    return not said.get("requiredExtensions", "").strip() and any(each.split("-")[0] == "en" for each in languages)


def _visible(given: Mapping[str, str], above: bool) -> bool:
    said = given.get("visibility", "").strip().lower()
    return above if said in ("", "inherit") else said == "visible"


def _curves(subpath: Subpath, place: Affine) -> list[NurbsCurve]:
    """The curves of a subpath, placed; neighbouring straight lines are one curve of degree 1."""
    a, b, c, d, e, f = place
    flat = np.array([point for piece in subpath.pieces for point in piece.points])
    points = flat.view(np.float64).reshape(-1, 2) @ np.array([[a, b], [c, d]]) + (e, f)
    points.setflags(write=False)
    doubled = bool((points[1:] == points[:-1]).all(axis=1).sum() >= len(subpath.pieces))  # more than the joints
    curves: list[NurbsCurve] = []
    begin = row = 0  # of the straight run, and of the piece
    for piece in subpath.pieces:
        after = row + len(piece.points)
        if len(piece.points) > 2:
            curves += _straight(points[begin:row], doubled)
            curves += _bent(piece, points[row:after])
            begin = after
        row = after
    return curves + _straight(points[begin:row], doubled)


def _straight(run: Array, doubled: bool) -> list[NurbsCurve]:
    """One curve through pairs of points, each of which begins where the one before ends."""
    if not len(run):
        return []
    points = run if len(run) == 2 else np.concatenate([run[:1], run[1::2]])
    if doubled:  # points that were apart are one after the transform
        points = np.concatenate([points[:1], points[1:][np.any(points[1:] != points[:-1], axis=1)]])
    return [polyline(points)] if len(points) > 1 else []


def _bent(piece: Piece, points: Array) -> list[NurbsCurve]:
    if not (points[1:] != points[0]).any():
        return []
    if piece.knots is not None:
        return [NurbsCurve.trusted(2, piece.knots, points, piece.weights)]
    return [NurbsCurve.trusted(len(points) - 1, _BEZIER_KNOTS[len(points) - 1], points)]


def _labels(node: Node) -> list[str]:
    return [node.attributes[key] for key in ("label", "id") if node.attributes.get(key)]
