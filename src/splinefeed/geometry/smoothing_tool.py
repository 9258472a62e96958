"""Smoothing of tool paths: tip and tool axis together, each within a tolerance of its own, and both proven."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.path import Path
from splinefeed.geometry.smoothing import ANGULAR_TOLERANCE, PROGRAM, UNBOUNDED_TOLERANCE
from splinefeed.geometry.smoothing_proven import PRECISION, Proof, proven
from splinefeed.geometry.tool_path import ANGLES, POINTS, VECTORS, ToolPath, beside
from splinefeed.records import Array

#: Names under which the columns of the tool axis go through the smoothing, beside x, y, z.
_COLUMNS = ("a", "b", "c")
#: Largest tolerance of the tool axis, rad: beyond it there is little left of a direction.
LARGEST_ANGLE = math.radians(30.0)
#: A curve's tool axis turns by less than this, rad, from its middle: otherwise its shortest vector is not bounded.
MOST_TURN = math.radians(80.0)


def proven_tool(
    path: ToolPath, tolerance: float | str, *, angular_tolerance: float = ANGULAR_TOLERANCE, **how: Any
) -> tuple[ToolPath, Proof]:
    """The tool path with continuous tangent and curvature of tip and tool axis, and the proof of both tolerances.

    tolerance          of the tip, mm, or "program"; how  as for `smoothed`
    angular_tolerance  of the tool axis, rad

    Tip and tool axis are one curve of up to six columns, (r, w): w holds vectors k / m, where m is the shortest of
    them all, or angles of rotary joints, rad. That curve is smoothed as any path with rotary axes is, and `order` runs
    both paths through side by side: at each place of the result there is one of the original, in the same order, with

        |r - r0| <= tolerance  and  |w - w0| <= sin(angular_tolerance)   (angles: <= angular_tolerance).

    As |w0| >= 1, the angle between the tool axes is at most asin |w - w0|, which is within the tolerance. m is no
    sample: each curve lies in the hull of its control points, so that |k| >= min_i (p_i . d) for any unit vector d.
    Of angles, the tool axis of two joints that turn about crossing axes has dk^2 = dA^2 + sin^2(A) dC^2: it turns by
    no more than the joints do. Both bounds hold with what the chords of that proof cut off.
    Raises InputError for a tolerance that cannot be used, and for curves whose tool axis has other knots than the tip.
    """
    if not (isinstance(angular_tolerance, int | float) and 0.0 < angular_tolerance <= LARGEST_ANGLE):
        raise InputError(
            f"the tolerance of the tool axis is {angular_tolerance!r} rad; it must be above 0 and at most "
            f"{math.degrees(LARGEST_ANGLE):g} deg"
        )
    packed = _packed(path)
    angular = angular_tolerance if path.kind == ANGLES else math.sin(angular_tolerance)
    least = 1.0 + PRECISION  # the proof tells distances to this: what it says is within the tolerances themselves
    within: float | str = PROGRAM
    if tolerance == PROGRAM and packed.tolerances is not None:
        said = np.where(np.isfinite(packed.tolerances), packed.tolerances, UNBOUNDED_TOLERANCE) / least
        packed = Path(packed.curves, packed.axes, **{**packed._said(), "tolerances": said}, tolerance=packed.tolerance)
    elif tolerance != PROGRAM:
        within = float(tolerance) / least
    proof = proven(packed, within, angular_tolerance=angular / least, **how)
    largest = float(tolerance) if tolerance != PROGRAM else proof.tolerance * least
    said_of = replace(proof, tolerance=largest, angular_tolerance=angular_tolerance)
    if proof.path is packed:
        return path, said_of
    return _unpacked(proof.path, path).with_findings(*proof.path.findings[:-1], said_of.sentence), said_of


def _packed(path: ToolPath) -> Path:
    """Tip and tool axis as one path of x, y, z and up to three columns that are looked at as rotary axes."""
    said = {**path._said(), "tolerance": path.tolerance}
    if path.tool_axis is None:
        return Path(path.curves, **said)
    columns = []
    for i, (tip, axis) in enumerate(zip(path.curves, path.tool_axis, strict=True)):
        same = tip.degree == axis.degree and np.array_equal(tip.knots, axis.knots)
        one, other = (np.ones(1) if each.weights is None else each.weights for each in (tip, axis))
        if not same or not np.array_equal(one, other):
            raise InputError(
                f"{path.name}: curve {i} has other knots or weights for the tool axis than for the tip; give both the "
                "same to smooth them together"
            )
        columns.append(axis.control_points - tip.control_points if path.kind == POINTS else axis.control_points)
    scale = 1.0 if path.kind == ANGLES else 1.0 / _shortest(columns, path)
    curves = [
        beside(tip, np.column_stack([tip.control_points, scale * rows]))
        for tip, rows in zip(path.curves, columns, strict=True)
    ]
    axes = ("x", "y", "z", *_COLUMNS[: path.columns])
    if all(curve.degree == 1 and len(curve.control_points) == 2 for curve in curves):
        points = np.stack([curve.control_points for curve in curves])
        if np.array_equal(points[:-1, 1], points[1:, 0]):
            return Path.polyline(np.concatenate([points[:1, 0], points[:, 1]]), axes, **path._said())
    return Path(curves, axes, **said)


def _shortest(columns: list[Array], path: ToolPath) -> float:
    """A length that no vector of the tool axis is shorter than."""
    least = math.inf
    for i, rows in enumerate(columns):
        sizes = np.linalg.norm(rows, axis=1)
        units = rows / np.maximum(sizes, np.finfo(float).tiny)[:, None]
        middle = units.sum(axis=0)
        along = rows @ (middle / max(float(np.linalg.norm(middle)), np.finfo(float).tiny))
        if np.any(along < math.cos(MOST_TURN) * sizes) or not np.all(sizes > 0.0):
            raise InputError(
                f"{path.name}: the tool axis turns too far along curve {i} to be smoothed, at "
                f"{path.place(float(path.curve_starts[i + 1]))}; split the curve"
            )
        least = min(least, float(along.min()))
    return least


def _unpacked(smooth: Path, path: ToolPath) -> ToolPath:
    curves = [NurbsCurve(c.degree, c.knots, c.control_points[:, :3], c.weights) for c in smooth.curves]
    said = {**smooth._said(), "tolerance": smooth.tolerance, "tool_length": path.tool_length}
    if path.lines is not None:  # the curve of the original that is as far along, but for what smoothing cuts off
        share = smooth.curve_starts[:-1] * (path.length / smooth.length)
        at = np.searchsorted(path.curve_starts, share, side="right") - 1
        said["lines"] = path.lines[np.clip(at, 0, len(path.lines) - 1)]
    if path.tool_axis is None:
        return ToolPath(curves, **said)
    axes = [beside(c, c.control_points[:, 3:].copy()) for c in smooth.curves]
    kind = ANGLES if path.kind == ANGLES else VECTORS
    return ToolPath(curves, axes, kind=kind, rotary=path.rotary, **said)
