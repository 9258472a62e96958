"""Points of a file as curves: fitted, and every point measured anew by means that the fit does not share."""

from __future__ import annotations

import os
from collections.abc import Sequence

from splinefeed.errors import FormatError
from splinefeed.geometry.path import Path
from splinefeed.records import Array


def fitted_path(
    points: Array,
    tolerance: float,
    source: str | os.PathLike[str],
    *,
    axes: Sequence[str],
    name: str,
    findings: Sequence[str],
    degree: int = 3,
    closed: bool = False,
) -> Path:
    """The path near points (n, axes), mm, within `tolerance`, mm; its findings tell the distance that was measured."""
    from splinefeed.geometry.fitting import fit
    from splinefeed.geometry.nearest import Nearest

    made = fit(points, tolerance, degree=degree, closed=closed)
    path = Path(made.curves, axes, name=name)
    far = float(Nearest(path.table, path.shape).find(points[:, : path.linear])[2].max())
    if far > tolerance:
        raise FormatError(f"{source}: the fit is {far:.6g} mm from a point, not {tolerance:g} mm; please report it")
    controls = sum(len(curve.control_points) for curve in made.curves)
    told = (
        f"fitted by {len(made.curves)} curve(s) of degree {degree} with {controls} control points; largest distance of "
        f"a point {max(far, made.error) if path.linear < len(axes) else far:.3g} mm (tolerance {tolerance:g} mm)"
    )
    return Path(made.curves, axes, name=name, findings=(*findings, told))
