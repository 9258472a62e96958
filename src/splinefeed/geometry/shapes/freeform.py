"""The butterfly of the interpolation literature, and a helix."""

from __future__ import annotations

import json
import math
from importlib.resources import files

import numpy as np

from splinefeed.errors import InputError
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.fitting import fit_function
from splinefeed.geometry.path import Path
from splinefeed.geometry.shapes.checks import number, positive
from splinefeed.records import Array

#: Most turns of a helix; each takes about twenty spans of degree 5, a hundred of degree 3.
MAX_TURNS = 1000


def butterfly(scale: float = 1.0) -> Path:
    """The butterfly: 51 control points, degree 3, rational, 382.86 mm long at scale 1, least radius 0.023 mm.

    |C'| runs from 40 to 802 mm: the hardest of the well-known tests of an interpolator. As its source gives it, the
    curve is open by 0.001 mm at the head. Source: Hu, Jiang, Huo et al., Int. J. Adv. Manuf. Technol. 129, 2843-2860,
    2023, doi 10.1007/s00170-023-12427-5.
    """
    factor = positive(scale, "scale", "")
    text = files("splinefeed").joinpath("data", "butterfly.json").read_text(encoding="utf-8")
    data = json.loads(text)
    curve = NurbsCurve(data["degree"], data["knots"], data["control_points"], data["weights"])
    return Path([curve if factor == 1.0 else curve.transformed(factor)], name="butterfly")


def helix(
    radius: float = 10.0, pitch: float = 5.0, turns: float = 3.0, tolerance: float = 1e-6, degree: int = 5
) -> Path:
    """A helix about z from (radius, 0, 0), counterclockwise seen from above; `pitch` is its rise a turn, mm.

    x = radius cos 2 pi v,  y = radius sin 2 pi v,  z = pitch v,  v from 0 to turns

    No NURBS is a helix: a curve of the given `degree` is fitted whose point at every parameter lies within `tolerance`,
    mm, of the helix's (z is exact, so that it rises in step with the angle). A negative pitch goes down.
    Raises InputError for sizes that cannot be used, CurveError if the tolerance cannot be held.
    """
    r, rise, count = positive(radius, "radius"), number(pitch, "pitch"), positive(turns, "turns", "")
    if rise == 0.0:
        raise InputError("pitch is 0 mm: that is one circle, repeated; use circle")
    if count > MAX_TURNS:
        raise InputError(f"turns is {count:g}; at most {MAX_TURNS} are possible")

    def place(u: Array) -> Array:
        angle = 2.0 * math.pi * count * u
        return np.column_stack([r * np.cos(angle), r * np.sin(angle), rise * count * u])

    curve, error = fit_function(place, tolerance, degree, (0.0, 1.0))
    finding = f"fitted by degree {degree} with {len(curve.breaks) - 1} spans; largest error {error:.3g} mm"
    return Path([curve], name="helix", findings=(finding,))
