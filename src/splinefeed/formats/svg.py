"""SVG drawings: every path and shape exactly, in mm with y up; see docs/formats.md.

SVG counts y downwards from the upper left corner of the page. Here x = 0, y = 0 is the lower left corner of the page,
as on a machine; where the page has no known height, y is only turned about. 1 px is 1/96 inch. The elements are read
here and not by svgelements, which mends silently what a machine should not cut; the tests hold both against each other.
"""

from __future__ import annotations

import os
import pathlib
import re
from collections.abc import Sequence

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats import svg_paths, svg_shapes
from splinefeed.formats.contents import Contents
from splinefeed.formats.drawing import Drawing, join_tolerance, layers_from
from splinefeed.formats.source import head_text
from splinefeed.formats.svg_paths import Piece, Subpath
from splinefeed.formats.svg_shapes import Affine, ShapeError, Viewport
from splinefeed.formats.svg_tree import MAX_DEPTH, Node, Styles, read_tree
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
_SHAPES = {"rect", "circle", "ellipse", "line", "polyline", "polygon"}
_GROUPS = {"g", "a", "svg", "switch"}
#: What draws nothing by itself, and what draws something that is no curve.
_SILENT = {
    "", "title", "desc", "metadata", "style", "defs", "symbol", "clipPath", "mask", "marker", "pattern", "filter",
    "linearGradient", "radialGradient", "view", "cursor", "animate", "animateTransform", "animateMotion", "set",
    "font", "font-face",
}  # fmt: skip
_ROOT = re.compile(rb"<(?:[\w.-]+:)?svg[\s>/]")
_BEZIER_KNOTS = {degree: np.repeat([0.0, 1.0], degree + 1) for degree in (2, 3)}
for _knots in _BEZIER_KNOTS.values():
    _knots.setflags(write=False)


def holds(head: bytes) -> bool:
    """Whether `head` looks like this format: an element svg near the beginning of something that begins with <."""
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
    root = read_tree(pathlib.Path(file).read_bytes(), source)
    reader = _Reader(source, root, wanted, repair)
    unit = reader.read()
    return Contents(reader.drawing.paths(pathlib.Path(file).stem, allowed, repair), unit)


class _Reader:
    """Walks the tree and collects pieces, in mm."""

    def __init__(self, source: str, root: Node, layers: Sequence[str], repair: bool) -> None:
        self.source = source
        self.root = root
        self.repair = repair
        self.wanted = {name.casefold() for name in layers}
        self.drawing = Drawing(source)
        self.styles = Styles(root)
        self.drawn = self.depth = 0
        self._paths: dict[int, tuple[list[Subpath], str]] = {}
        self.named: dict[str, Node] = {}
        self.groups: dict[str, None] = {}
        pending = [root]
        while pending:
            node = pending.pop()
            pending += reversed(node.children)
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
        for child in self.root.children:
            self._node(child, place, view, (), chosen=not self.wanted, visible=self._visible(self.root, True))
        return unit

    def _page(self) -> tuple[Affine, Viewport, str]:
        """The map from user units to mm with y up, what percentages are of, and the unit of the page's size."""
        given = self.root.attributes
        box = _view_box(given)
        sizes: list[float | None] = []
        unit = ""
        for name in ("width", "height"):
            text = given.get(name, "").strip()
            relative = text in ("", "auto") or text.endswith("%")
            sizes.append(None if relative else svg_shapes.length(text, name, Viewport(None, None), "x"))
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
            inner = svg_shapes.fit_view_box(box, width, height, given.get("preserveAspectRatio", ""))
        if unit in ("", "px"):
            self.drawing.findings.append("the page has no size in mm or inch: 1 px is read as 1/96 inch")
        if height is None:
            self.drawing.findings.append("the page has no height: y is turned about, and 0 stays 0")
        x, y = 0.0, 0.0
        if ORIGIN in given:
            x, y = (*svg_shapes.numbers(given[ORIGIN], ORIGIN), 0.0, 0.0)[:2]
        up = Affine(_MM_PER_PIXEL, 0.0, 0.0, -_MM_PER_PIXEL, x, y + (height or 0.0) * _MM_PER_PIXEL)
        view = Viewport(width, height) if box is None else Viewport(box[2], box[3])
        return up.after(inner), view, unit or "px"

    # --- the tree ---------------------------------------------------------------------------------------------------

    def _fault(self, node: Node, text: str, *, kept: str = "left out") -> None:
        """An error, or when repairing a finding."""
        if not self.repair:
            raise FormatError(f"{self.source}: {node.place()}: {text}")
        self.drawing.findings.append(f"{node.place()}: {text}; {kept}")

    def _visible(self, node: Node, above: bool) -> bool:
        said = self.styles.of(node, "visibility")
        return above if said in (None, "inherit") else said == "visible"

    def _node(
        self, node: Node, place: Affine, view: Viewport, uses: tuple[str, ...], *, chosen: bool, visible: bool
    ) -> None:
        tag = node.tag
        self.drawn += 1
        if self.drawn > MAX_DRAWN:
            raise FormatError(f"{self.source}: draws more than {MAX_DRAWN} elements, uses counted each time")
        if tag in _SILENT:
            return
        if self.styles.of(node, "display") == "none":
            self.drawing.left_out[f"{tag} that is not displayed"] += 1
            return
        visible = self._visible(node, visible)
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise FormatError(f"{self.source}: {node.place()}: elements and uses are nested more than {MAX_DEPTH} deep")
        try:
            if node.attributes.get("transform", "").strip():
                place = place.after(svg_shapes.transform(node.attributes["transform"]))
            if tag in _GROUPS:
                self._group(node, place, view, uses, chosen=chosen, visible=visible)
            elif tag == "use":
                self._use(node, place, view, uses, chosen=chosen, visible=visible)
            elif not chosen:
                return
            elif tag == "path" or tag in _SHAPES:
                if not visible:
                    self.drawing.left_out[f"{tag} that is hidden"] += 1
                    return
                self._shape(node, place, view)
            else:
                self.drawing.left_out[tag[:40]] += 1
        except ShapeError as error:
            self._fault(node, str(error))
        finally:
            self.depth -= 1

    def _group(
        self, node: Node, place: Affine, view: Viewport, uses: tuple[str, ...], *, chosen: bool, visible: bool
    ) -> None:
        chosen = chosen or any(name.casefold() in self.wanted for name in _labels(node))
        if node.tag == "svg":
            place, view = self._nested(node, place, view, node.attributes)
        children = node.children
        if node.tag == "switch":
            children = next(([child] for child in children if child.tag not in _SILENT), [])
        for child in children:
            self._node(child, place, view, uses, chosen=chosen, visible=visible)

    def _nested(self, node: Node, place: Affine, view: Viewport, sizes: dict[str, str]) -> tuple[Affine, Viewport]:
        """Where the contents of an inner svg or a symbol lie; `sizes` has x, y, width and height."""
        values = [
            svg_shapes.length(sizes.get(name, default), name, view, of)
            for name, default, of in (("x", "0", "x"), ("y", "0", "y"))
        ]
        place = place.after(Affine(e=values[0], f=values[1]))
        box = _view_box(node.attributes)
        if box is None:
            return place, view
        width, height = (
            svg_shapes.length(sizes.get(name, "100%"), name, view, of) for name, of in (("width", "x"), ("height", "y"))
        )
        if width <= 0.0 or height <= 0.0:
            raise ShapeError("its width or height is not above 0")
        aspect = node.attributes.get("preserveAspectRatio", "")
        return place.after(svg_shapes.fit_view_box(box, width, height, aspect)), Viewport(box[2], box[3])

    def _use(
        self, node: Node, place: Affine, view: Viewport, uses: tuple[str, ...], *, chosen: bool, visible: bool
    ) -> None:
        target = node.attributes.get("href", node.attributes.get("xlink:href", "")).strip()
        if not target.startswith("#"):
            self.drawing.left_out[f"use of another file, {target[:60]!r}"] += 1
            return
        name = target[1:]
        found = self.named.get(name)
        if found is None:
            self._fault(node, f"there is no element with id {name[:40]!r}")
            return
        if name in uses:
            self._fault(node, f"uses itself ({' > '.join([*uses[uses.index(name) :], name])[:120]})")
            return
        if len(uses) >= MAX_USES:
            self._fault(node, f"uses are nested more than {MAX_USES} deep")
            return
        x, y = (svg_shapes.length(node.attributes.get(key, "0"), key, view, key) for key in ("x", "y"))
        place = place.after(Affine(e=x, f=y))
        uses = (*uses, name)
        if found.tag in ("symbol", "svg"):
            sizes = dict(found.attributes) if found.tag == "svg" else {}
            sizes |= {key: value for key, value in node.attributes.items() if key in ("width", "height")}
            inner, view = self._nested(found, place, view, sizes)
            for child in found.children:
                self._node(child, inner, view, uses, chosen=chosen, visible=self._visible(found, visible))
            return
        self._node(found, place, view, uses, chosen=chosen, visible=visible)

    # --- curves -----------------------------------------------------------------------------------------------------

    def _parsed(self, node: Node) -> tuple[list[Subpath], str]:
        """Subpaths and fault of a path; once for all of its uses."""
        key = id(node)
        if key not in self._paths:
            self._paths[key] = svg_paths.parse(node.attributes.get("d", ""))
        return self._paths[key]

    def _shape(self, node: Node, place: Affine, view: Viewport) -> None:
        if node.tag == "path":
            found, fault = self._parsed(node)
            if fault:
                self._fault(node, f"path data: {fault}", kept="what stands before it is kept")
        else:
            found = svg_shapes.subpaths(node.tag, node.attributes, view)
        name = node.attributes.get("label") or node.attributes.get("id") or node.tag
        for subpath in found:
            curves = _curves(subpath, place)
            if curves:
                self.drawing.add(curves, name)


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


def _view_box(given: dict[str, str]) -> list[float] | None:
    text = given.get("viewBox", "").strip()
    if not text:
        return None
    box = svg_shapes.numbers(text, "viewBox")
    if len(box) != 4:
        raise ShapeError(f"viewBox has {len(box)} numbers; expected x, y, width and height")
    if not (box[2] > 0.0 and box[3] > 0.0):
        raise ShapeError(f"viewBox is {text[:40]!r}; its width and height must be above 0")
    return box
