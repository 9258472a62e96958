"""SVG drawings out (mm, y down as SVG has it): lines, Beziers and arcs exactly, other curves within a tolerance."""

from __future__ import annotations

import gzip
import math
import os
from collections.abc import Sequence
from xml.sax.saxutils import quoteattr

import numpy as np

from splinefeed import units
from splinefeed.curves.arcs import as_circle
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import CurveError, FormatError
from splinefeed.files.atomic import atomic_write
from splinefeed.formats.drawing import losses, three_axes
from splinefeed.paths.fitting.function import fit_function
from splinefeed.paths.path import Path
from splinefeed.records import Array

#: Largest distance of a curve that SVG cannot hold from what is written in its place, mm.
DEFAULT_TOLERANCE = 1e-3
#: Ends closer than this share of the page are one point.
SAME_POINT = 1e-14
#: Width of the lines on the page, as a share of its diagonal.
_LINE_WIDTH = 2e-3
#: Attribute of the root element that keeps where the page lies, x and y of its lower left corner, mm.
ORIGIN = "data-splinefeed-origin"


def write(
    paths: Sequence[Path], target: str | os.PathLike[str], *, tolerance: float | str = DEFAULT_TOLERANCE
) -> list[str]:
    """Write paths to a drawing, one element each; 1 user unit is 1 mm, coordinates keep every digit.

    Parameters
    ----------
    paths : sequence of Path
        Contours, mm.
    target : path
        The file.
    tolerance : float or str, optional
        Of curves that become cubics: those of a degree above 3 and rational ones that are no arcs, mm.

    Returns
    -------
    list of str
        What was approximated, with the distance that was checked, and what SVG has no place for.

    Notes
    -----
    The page is the box around all curves; where it lies is kept in an attribute that the reader here understands.
    """
    allowed, errors = units.parse(tolerance, "length"), list[float]()
    flat = [[_flat(curve, path) for curve in path.curves] for path in paths]
    boxes = np.array([curve.bounding_box() for curves in flat for curve in curves])
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    least = 1e-3 * float((high - low).max()) or 1.0  # a page needs an area, though a straight line has none
    width, height = np.maximum(high - low, least).tolist()
    elements = []
    for path, curves in zip(paths, flat, strict=True):
        # on the page: x to the right from its left edge, y down from its upper edge
        drawn = [
            NurbsCurve(each.degree, each.knots, (each.control_points - low) * (1.0, -1.0) + (0.0, height), each.weights)
            for each in curves
        ]
        name = "".join(c if c.isprintable() and not c.isspace() else "_" for c in path.name) or "path"
        shape = _element(drawn, allowed, SAME_POINT * max(width, height), errors)
        elements.append(f"<{shape} id={quoteattr(name)}/>")
    stroke = _LINE_WIDTH * math.hypot(width, height)
    text = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width!r}mm" height="{height!r}mm" '
        f'viewBox="0 0 {width!r} {height!r}" {ORIGIN}="{_pair(low)}">\n'
        f'<g fill="none" stroke="black" stroke-width="{stroke:.3g}">\n' + "\n".join(elements) + "\n</g>\n</svg>\n"
    )
    with atomic_write(target) as temporary:
        content = text.encode()
        packed = os.fspath(target).lower().endswith("z")  # .svgz; without the time, so that it is the same each time
        temporary.write_bytes(gzip.compress(content, mtime=0) if packed else content)
    said = f"{len(errors)} curve(s) approximated by cubics, at most {max(errors, default=0.0):.3g} mm away"
    return [f"{said} (tolerance {allowed:g} mm)"] * bool(errors) + losses(paths, "SVG", depth=False)


def _flat(curve: NurbsCurve, path: Path) -> NurbsCurve:
    points = three_axes(curve.control_points, path)[:, :2]
    if np.all(points == points[0]):
        raise FormatError(f"path {path.name!r} has a curve along z alone, which SVG cannot show")
    return NurbsCurve(curve.degree, curve.knots, points, curve.weights)


def _element(curves: list[NurbsCurve], tolerance: float, same: float, errors: list[float]) -> str:
    """The name of an element with all curves of a path and where they lie; `errors` get the distance of each fit."""
    circle = as_circle(curves[0]) if len(curves) == 1 else None
    if circle is not None and circle[3] <= -2.0 * math.pi and circle[2] == 0.0:
        (x, y), radius = circle[:2]
        return f'circle cx="{x!r}" cy="{y!r}" r="{radius!r}"'
    data: list[str] = []
    here: Array | None = None
    for curve in curves:
        begin, end = curve.ends
        if here is None or np.linalg.norm(begin - here) > same:
            data.append(f"M{_pair(begin)}")  # a gap stays one; readers that join gaps join this one too
        data += _commands(curve, tolerance, errors)
        here = end
    if np.array_equal(curves[-1].ends[1], curves[0].ends[0]):
        data.append("Z")
    return f'path d="{" ".join(data)}"'


def _commands(curve: NurbsCurve, tolerance: float, errors: list[float]) -> list[str]:
    circle = as_circle(curve)
    if circle is not None and abs(circle[3]) < 2.0 * math.pi:
        _, radius, _, sweep = circle
        large = int(abs(sweep) > math.pi)
        return [f"A{radius!r} {radius!r} 0 {large} {int(sweep > 0.0)} {_pair(curve.ends[1])}"]
    whole = curve.with_clamped_ends()
    if curve.degree == 1 and not curve.rational:
        return [f"L{_pair(point)}" for point in whole.control_points[1:]]
    inner = whole.breaks[1:-1]
    exact = [_exact(piece) for piece in (whole.split(*inner) if inner.size else [whole])]
    found = [each for each in exact if each is not None]
    if len(found) == len(exact):
        return found
    try:
        near, error = fit_function(curve, tolerance, 3, curve.domain, inner.tolist())
    except CurveError as error_of_fit:
        raise FormatError(f"a curve cannot be written as cubics: {error_of_fit}") from None
    errors.append(error)
    cubics = near.split(*near.breaks[1:-1]) if len(near.breaks) > 2 else [near]
    return [_bezier(piece.control_points) for piece in cubics]


def _exact(piece: NurbsCurve) -> str | None:
    """The command of one Bezier piece; None if SVG has none for it."""
    points = piece.control_points
    if piece.weights is None:
        return _bezier(points) if piece.degree <= 3 else None
    if piece.degree != 2:
        return None
    w = piece.weights[1] / math.sqrt(piece.weights[0] * piece.weights[2])
    if not w < 1.0:
        return None
    # an ellipse about C with conjugate radii: half the chord / sin h, and towards the middle point, where cos h = w
    middle = 0.5 * (points[0] + points[2])
    center = middle + (middle - points[1]) * w * w / (1.0 - w * w)
    radii = np.column_stack([0.5 * (points[2] - points[0]) / math.sqrt(1.0 - w * w), (points[1] - center) * w])
    axes, lengths, _ = np.linalg.svd(radii)
    if not lengths[1] > 1e-9 * lengths[0]:
        return None
    angle = math.degrees(math.atan2(axes[1, 0], axes[0, 0]))
    sweep = int(np.linalg.det(np.column_stack([points[1] - points[0], points[2] - points[1]])) > 0.0)
    return f"A{float(lengths[0])!r} {float(lengths[1])!r} {angle!r} 0 {sweep} {_pair(points[2])}"


def _bezier(points: Array) -> str:
    letter = {2: "L", 3: "Q", 4: "C"}[len(points)]
    return letter + " ".join(_pair(point) for point in points[1:])


def _pair(point: Array) -> str:
    x, y = point.tolist()
    return f"{x!r} {y!r}"
