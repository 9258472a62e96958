"""SVG drawings: every path and shape exactly, in mm with y up; see docs/formats.md.

x = 0, y = 0 is the lower left corner of the page; where that has no known height, y is only turned about. The elements
are read here and not by svgelements, which mends silently what a machine should not cut; tests compare the two.
"""

from __future__ import annotations

import math
import os
import re
import zlib
from collections.abc import Mapping, Sequence
from string import ascii_lowercase
from typing import NamedTuple

import numpy as np

from splinefeed import units as units_of
from splinefeed.curves.arcs import polyline
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import InputError
from splinefeed.files.source import head_text
from splinefeed.formats import svg_paths, svg_places
from splinefeed.formats.drawing import DASHED, Drawing
from splinefeed.formats.svg_paths import SvgPiece
from splinefeed.formats.svg_places import Affine, ShapeError, View
from splinefeed.formats.svg_tree import GZIP, MAX_DEPTH, Node, Styles, read_tree, unpacked
from splinefeed.formats.svg_write import ORIGIN
from splinefeed.formats.svg_write import write as write
from splinefeed.numbers import finite
from splinefeed.paths.contents import Contents

#: Elements drawn by uses, all within a used element counted each time, and how deep uses may be nested.
MAX_USED, MAX_USES = 100_000, 32
_MM_PER_PIXEL = 25.4 / 96.0
_SHAPES = {"path", "rect", "circle", "ellipse", "line", "polyline", "polygon"}
_HOLDERS = {"g", "a", "svg", "switch", "symbol", "use"}
#: What draws nothing by itself.
_SILENT = {
    "", "title", "desc", "metadata", "style", "defs", "symbol", "clipPath", "mask", "marker", "pattern", "filter",
    "linearGradient", "radialGradient", "view", "cursor", "animate", "animateTransform", "animateMotion", "set",
    "font", "font-face",
}  # fmt: skip
_DECIMALS = re.compile(r"\.([0-9]+(?:[eE][-+0-9]+)?)")
#: Properties of fill and stroke that are inherited.
_PAINT = ("fill", "stroke", "fill-opacity", "stroke-opacity", "stroke-width", "stroke-dasharray")
_ROOT = re.compile(rb"<(?:[\w.-]+:)?svg[\s>/]")
_BEZIER_KNOTS = {degree: np.repeat([0.0, 1.0], degree + 1) for degree in (2, 3)}
for _knots in _BEZIER_KNOTS.values():
    _knots.setflags(write=False)


def holds(head: bytes) -> bool:
    """Tell whether the first bytes of a file, `head`, packed or not, look like this format.

    That is an element svg near the begin of what starts with <.
    """
    if head.startswith(GZIP):
        try:
            head = zlib.decompressobj(zlib.MAX_WBITS | 16).decompress(head, len(head))
        except zlib.error:
            return False
    return head_text(head[:256]).lstrip()[:1] == "<" and _ROOT.search(head) is not None


#: How much of a drawing is looked at for the program that wrote it, bytes, and how that says so.
_GENERATOR = 16384
_INKSCAPE = re.compile(rb"inkscape:version\s*=\s*[\"']0\.([0-9]{2})")
_ILLUSTRATOR = re.compile(rb"<!--\s*Generator: Adobe Illustrator|ns\.adobe\.com/AdobeIllustrator/")


def from_file(
    file: str | os.PathLike[str],
    *,
    tolerance: float | str | None = None,
    layer: str | Sequence[str] | None = None,
    units: str | None = None,
    hidden: bool = False,
    repair: bool = False,
) -> Contents:
    """Read the paths in a drawing.

    Parameters
    ----------
    file : path
        The file.
    tolerance : float or str, optional
        Curves whose ends meet within it make one path, mm. By default ends join that are as far apart as the last
        decimal of the file's numbers allows.
    layer : str or sequence of str, optional
        Reads only what is in groups of these names (Inkscape's label, or id): a list, or names between commas.
    units : str, optional
        What one px of a page without a size in mm or inch is: "pt" (1/72 inch), "0.01in", "mm". By default what the
        program that wrote the file takes it for: Adobe Illustrator 1/72 inch, Inkscape before 0.92 1/90 inch, all
        others 1/96 inch.
    hidden : bool, optional
        Whether what the drawing does not show is read, too: display, visibility, opacity, no fill and no stroke.
    repair : bool, optional
        Whether faults are repaired where that is safe, each a finding.

    Returns
    -------
    Contents
        Paths in the order of the file, mm, and its units.

    Raises
    ------
    FormatError, InputError
        For what cannot be read, with its place.
    """
    drawing = Drawing(file, tolerance, repair, layer, hidden)
    content = unpacked(drawing.file.read_bytes())
    return drawing.contents(_SvgReader(drawing, read_tree(content), units, _pixels_of(content)).read())


class _Place(NamedTuple):
    """Where elements are drawn, and whether they are.

    Parameters
    ----------
    map : Affine
        To mm.
    view : View
        What percentages are of.
    uses : tuple of str
        Uses around the elements.
    chosen, visible : bool
        Whether the layer is read, and whether they are shown.
    paint : mapping of str to str, optional
        What is said of fill and stroke, which elements within inherit.
    unseen : str, optional
        Why the author's program does not show them.
    """

    map: Affine
    view: View
    uses: tuple[str, ...]
    chosen: bool
    visible: bool
    paint: Mapping[str, str] = {}
    unseen: str = ""  # why nothing in here is shown, or ""


class _SvgReader:
    """Walks the tree and collects pieces, in mm."""

    def __init__(self, drawing: Drawing, root: Node, pixel: str | None, written: tuple[int, str]) -> None:
        self.root, self.drawing, self.pixel, self.written = root, drawing, pixel, written
        self.styles = Styles(root)
        self.drawing.findings += self.styles.findings
        self.depth = self.used = 0
        self.named: dict[str, Node] = {}
        groups: dict[str, None] = {}
        for node in root.walk():
            if "id" in node.attrib:
                self.named.setdefault(node.attrib["id"], node)
            if node.tag == "g":
                groups |= dict.fromkeys(_labels(node))
        self.drawing.check_layers(groups, "group")

    def read(self) -> str:
        """Read everything that is drawn; the unit of the page."""
        # what a web page makes of its size counts only where the drawing says none
        given = {**self.styles.of(self.root), **self.root.attrib}
        findings = self.drawing.findings
        if given.get("transform", "none").strip() not in ("", "none"):
            findings.append("the transform of the page itself is not applied")
        try:
            inner, view, size = svg_places.viewport(given, View())
            x, y = (*svg_places.numbers(given.get(ORIGIN, ""), ORIGIN), 0.0, 0.0)[:2]
        except ShapeError as error:
            raise InputError(f"{self.root.place()}: {error}") from None
        units = [
            re.sub(r"[^a-z]", "", re.sub(r"[\d.]e", "", given.get(name, "").lower())) for name in ("width", "height")
        ]
        unit = next((each for each in units if each not in ("", "auto")), "px")
        each_px = page_px = _MM_PER_PIXEL
        per_inch, program = self.written
        if self.pixel is not None:
            if unit != "px":
                raise InputError(f"the page has its size in {unit}; option units is for pages in px")
            each_px = page_px = _pixel(self.pixel)
        elif unit == "px":
            each_px = page_px = 25.4 / per_inch
            said = f"1/{per_inch} inch{program and f', as {program} has it'} (option units)"
            findings.append(f"the page has no size in mm or inch: 1 px is read as {said}")
        elif program and "viewBox" not in given:  # the page has a size, its numbers have none
            each_px = 25.4 / per_inch
            findings.append(f"numbers without a unit are read as 1/{per_inch} inch, as {program} has it")
        if size.height is None:
            findings.append("the page has no height: y is flipped about 0")
        up = Affine(each_px, 0.0, 0.0, -each_px, x, y + (size.height or 0.0) * page_px)
        at = _Place(up.after(inner), view, (), chosen=not self.drawing.wanted, visible=_visible(given, True),
                    paint={key: said for key in _PAINT if (said := _said(given, key)) != "inherit"})  # fmt: skip
        for child in self.root.children:
            self._node(child, at)
        return unit

    def _node(self, node: Node, at: _Place, used: Mapping[str, str] | None = None) -> None:
        """Draw an element; `used` are the sizes that a use gives to a symbol or an inner svg."""
        tag = node.tag
        self.used += bool(at.uses)
        if self.used > MAX_USED:
            raise InputError(f"{node.place()}: more than {MAX_USED} elements are drawn by uses; write them out")
        if self.depth > MAX_DEPTH:
            raise InputError(f"{node.place()}: elements are nested more than {MAX_DEPTH} deep")
        if tag in _SILENT and not (tag == "symbol" and used is not None):
            return
        given = self.styles.of(node)
        paint = {**at.paint, **{key: said for key in _PAINT if (said := _said(given, key)) != "inherit"}}
        visible = _visible(given, at.visible)
        unseen = at.unseen
        if _said(given, "display") == "none" and not (self.drawing.wanted & {e.casefold() for e in _labels(node)}):
            unseen = unseen or "that is not displayed"
        elif _number(given.get("opacity", "")) == 0.0:
            unseen = unseen or "of opacity 0"
        if not _meant(node) or (at.chosen and tag not in _HOLDERS | _SHAPES):
            self.drawing.left_out[f"{tag[:40]}{'' if _meant(node) else ' for other programs'}"] += 1
            return
        if tag not in _HOLDERS and not at.chosen:
            return
        if tag in _SHAPES:
            unseen = unseen or ("" if visible else "that is hidden") or ("" if _painted(paint) else "without paint")
            if not self.drawing.reads(f"{tag} {unseen}" if unseen else ""):
                return
            if _painted(paint, ("stroke",)) and paint.get("stroke-dasharray", "none") not in ("none", "0"):
                self.drawing.notes[DASHED] += 1
        for name in ("clip-path", "mask"):
            if given.get(name, "none").strip().lower() not in ("none", ""):
                self.drawing.left_out[f"{name} of {tag}, which is drawn whole"] += 1
        self.depth += 1
        try:
            at = at._replace(map=at.map.after(svg_places.transform(given, at.view)), visible=visible, paint=paint,
                             unseen=unseen)  # fmt: skip
            if tag == "use":
                self._use(given, at)
            elif tag in _HOLDERS:
                self._group(node, {**given, **(used or {})}, at)
            else:
                self._shape(node, given, at)
        except ShapeError as error:
            self.drawing.fault(f"{node.place()}: {error}")
        finally:
            self.depth -= 1

    def _group(self, node: Node, given: Mapping[str, str], at: _Place) -> None:
        at = at._replace(chosen=at.chosen or any(name.casefold() in self.drawing.wanted for name in _labels(node)))
        if node.tag in ("svg", "symbol"):
            inner, view, _ = svg_places.viewport(given, at.view)
            at = at._replace(map=at.map.after(_corner(given, at)).after(inner), view=view)
        children = node.children
        if node.tag == "switch":  # Illustrator puts its own data first, as a foreignObject that only it understands
            children = [each for each in children if each.tag in _SHAPES | _HOLDERS and _meant(each)][:1]
        for child in children:
            self._node(child, at)

    def _use(self, given: Mapping[str, str], at: _Place) -> None:
        target = given.get("href", given.get("xlink:href", "")).strip()
        if not target.startswith("#"):
            self.drawing.left_out[f"use of another file, {target[:60]!r}"] += 1
            return
        name = target[1:]
        found = self.named.get(name)
        if found is None:
            raise ShapeError(f"there is no element with id {name[:40]!r}")
        if name in at.uses or len(at.uses) >= MAX_USES:
            raise ShapeError(f"uses itself, or more than {MAX_USES} deep: {' > '.join([*at.uses, name])[-120:]}")
        sizes = {key: value for key, value in given.items() if key in ("width", "height") and value.strip() != "auto"}
        self._node(found, at._replace(map=at.map.after(_corner(given, at)), uses=(*at.uses, name)), used=sizes)

    def _shape(self, node: Node, given: Mapping[str, str], at: _Place) -> None:
        if node.tag == "path":
            runs, fault = svg_paths.parse(given.get("d", ""))
            if fault:
                self.drawing.fault(f"{node.place()}: path data: {fault}", "what comes before it is kept")
        else:
            runs = svg_paths.shape(node.tag, given, at.view)
        scale = math.sqrt(abs(at.map.a * at.map.d - at.map.b * at.map.c))  # mm of a unit here
        written = " ".join(given.get(key, "") for key in ("d", "points", "x1", "x2", "y1", "y2"))
        self.drawing.written(max(map(len, _DECIMALS.findall(written)), default=0), scale)
        name = node.get("label") or node.get("id") or node.tag
        for run in runs:
            if curves := _curves(run, at.map):
                self.drawing.add(curves, name)


def _meant(node: Node) -> bool:
    """Tell whether an element is for a reader that knows no extensions (W3C, SVG 1.1, section 5.8)."""
    return not node.get("requiredExtensions").strip()


def _pixels_of(content: bytes) -> tuple[int, str]:
    """Pixels an inch of the program that wrote a drawing, and its name where they are not those of a browser.

    SVG, 8.9 "Units" (CSS: 96); Inkscape 0.92, release notes, "Important changes"; Illustrator's px are points.
    """
    head = content[:_GENERATOR]
    if (found := _INKSCAPE.search(head)) and int(found[1]) < 92:
        return 90, "Inkscape before 0.92"
    return (72, "Adobe Illustrator") if _ILLUSTRATOR.search(head) else (96, "")


def _pixel(text: str) -> float:
    """What one px is, mm: a unit or a length."""
    name = text.strip()
    if name == "pt":
        return 25.4 / 72.0
    size = units_of.parse(name if name[:1].isdigit() or name[:1] == "." else f"1{name}", "length")
    if not size > 0.0:
        raise InputError(f"units is {text!r}; one px is a length above 0")
    return size


def _said(given: Mapping[str, str], name: str) -> str:
    """A property in small letters, "inherit" where nothing is said."""
    return given.get(name, "").strip().lower() or "inherit"


def _number(text: str) -> float:
    """A number, percentages as parts of 1; 1 for what is none."""
    try:
        return finite(text.strip().removesuffix("%")) / (100.0 if text.strip().endswith("%") else 1.0)
    except InputError:
        return 1.0


#: No paint, or a colour whose last part, how opaque it is, is 0 (CSS Color 4).
_NO_COLOUR = re.compile(
    r"\s*+(?:none|transparent|#[0-9a-f]{3}0|#[0-9a-f]{6}00"
    r"|(?:rgb|hsl)a?\([^()/,]*+,[^()/,]*+,[^()/,]*+,\s*+\+?(?:0*+\.)?0++%?\s*+\)"
    r"|[a-z]+\([^()/,]*+/\s*+\+?(?:0*+\.)?0++%?\s*+\))\s*+",
    re.IGNORECASE,
)


def _painted(paint: Mapping[str, str], ways: Sequence[str] = ("fill", "stroke")) -> bool:
    """Whether a fill or stroke is drawn: black fill and no stroke unless something is said."""
    for way in ways:
        colour = paint.get(way, "black" if way == "fill" else "none")
        width = _number(paint.get("stroke-width", "1").rstrip(ascii_lowercase)) if way == "stroke" else 1.0
        if not _NO_COLOUR.fullmatch(colour) and _number(paint.get(f"{way}-opacity", "1")) and width:
            return True
    return False


def _visible(given: Mapping[str, str], above: bool) -> bool:
    said = given.get("visibility", "").strip().lower()
    return above if said in ("", "inherit") else said == "visible"


def _curves(run: list[SvgPiece], place: Affine) -> list[NurbsCurve]:
    """The curves of pieces that are joined end to end, placed."""
    a, b, c, d, e, f = place
    flat = np.array([point for piece in run for point in piece.points])
    points = flat.view(np.float64).reshape(-1, 2) @ np.array([[a, b], [c, d]]) + (e, f)
    points.setflags(write=False)
    apart = np.append(True, (points[1:] != points[:-1]).any(axis=1))  # points that were apart may be one when placed
    curves: list[NurbsCurve] = []
    row = 0
    for piece in run:
        part = slice(row, row + len(piece.points))
        row = part.stop
        moves = apart[part][1:]
        if not moves.any():
            continue
        own = points[part]
        if piece.straight:
            curves.append(polyline(own if moves.all() else own[np.append(True, moves)]))
        elif piece.knots is not None:
            curves.append(NurbsCurve.trusted(2, piece.knots, own, piece.weights))
        else:
            curves.append(NurbsCurve.trusted(len(own) - 1, _BEZIER_KNOTS[len(own) - 1], own))
    return curves


def _corner(given: Mapping[str, str], at: _Place) -> Affine:
    return Affine(e=svg_places.length(given, "x", at.view), f=svg_places.length(given, "y", at.view))


def _labels(node: Node) -> list[str]:
    return [node.attrib[key] for key in ("label", "id") if node.get(key)]
