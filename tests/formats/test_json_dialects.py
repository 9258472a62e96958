"""Curves that geomdl and verb wrote as JSON: the same curve, and what is refused with which words."""

from __future__ import annotations

import json
from pathlib import Path as File
from typing import Any

import numpy as np
import pytest

from splinefeed.errors import FormatError
from splinefeed.formats import json_curve
from splinefeed.formats.registry import read, read_all
from splinefeed.geometry.path import Path

KNOTS = [0.0, 0.0, 0.0, 0.3, 1.0, 1.0, 1.0]
POINTS = [[0.0, 0.0, 1.0], [1.0, 2.0, 0.0], [3.0, 0.1, 0.0], [4.0, -1.0, 2.0]]
WEIGHTS = [1.0, 0.5, 2.0, 1.0]
VERB = {"degree": 2, "knots": KNOTS, "controlPoints": POINTS, "weights": WEIGHTS}
WEIGHTED = {
    "degree": 2,
    "knots": KNOTS,
    "controlPoints": [[*(w * value for value in point), w] for point, w in zip(POINTS, WEIGHTS, strict=True)],
}


def geomdl_curve(rational: bool = True) -> Any:
    from geomdl import NURBS, BSpline

    curve = NURBS.Curve() if rational else BSpline.Curve()
    curve.degree, curve.ctrlpts, curve.knotvector = 2, POINTS, KNOTS
    if rational:
        curve.weights = WEIGHTS
    return curve


def paths_of(document: object) -> list[Path]:
    return json_curve.from_text(json.dumps(document), "part.json")


@pytest.mark.parametrize("rational", [True, False])
def test_what_geomdl_exports_is_the_same_curve(tmp_path: File, rational: bool) -> None:
    exchange = pytest.importorskip("geomdl.exchange", reason="geomdl is there for benchmarks only")
    theirs = geomdl_curve(rational)
    exchange.export_json(theirs, str(tmp_path / "part.json"))
    curve = read(tmp_path / "part.json").curves[0]
    assert (curve.degree, curve.knots.tolist(), curve.control_points.tolist()) == (2, KNOTS, POINTS)
    assert (None if curve.weights is None else curve.weights.tolist()) == (WEIGHTS if rational else None)
    u = np.linspace(0.0, 1.0, 11)
    assert np.allclose(curve(u), theirs.evaluate_list(u.tolist()), rtol=0.0, atol=1e-14)


def test_a_container_of_geomdl_holds_several(tmp_path: File) -> None:
    exchange = pytest.importorskip("geomdl.exchange", reason="geomdl is there for benchmarks only")
    multi = pytest.importorskip("geomdl.multi")
    exchange.export_json(multi.CurveContainer(geomdl_curve(), geomdl_curve()), str(tmp_path / "part.json"))
    assert len(read_all(tmp_path / "part.json")) == 2


def test_the_form_of_geomdl_is_known_without_it() -> None:
    (path,) = paths_of(geomdl(name="rib"))
    curve = path.curves[0]
    assert (curve.degree, curve.knots.tolist(), curve.control_points.tolist()) == (2, KNOTS, POINTS)
    assert curve.weights is not None and curve.weights.tolist() == WEIGHTS


@pytest.mark.parametrize("document", [VERB, WEIGHTED, [VERB], {"curves": [VERB]}])
def test_what_verb_says_is_the_same_curve(document: object) -> None:
    (path,) = paths_of(document)
    curve = path.curves[0]
    assert (curve.degree, curve.knots.tolist()) == (2, KNOTS)
    assert np.allclose(curve.control_points, POINTS, rtol=1e-15, atol=0.0)
    assert curve.weights is not None and curve.weights.tolist() == WEIGHTS


def test_three_numbers_without_weights_are_a_finding() -> None:
    (path,) = paths_of({**VERB, "weights": None})
    assert path.curves[0].control_points.tolist() == POINTS
    assert "controlPoints have three numbers and no weights; read as x, y, z" in path.findings


def geomdl(**changes: Any) -> dict[str, Any]:
    item = {
        "type": "spline",
        "rational": True,
        "dimension": 3,
        "degree": 2,
        "knotvector": KNOTS,
        "control_points": {"points": POINTS, "weights": WEIGHTS},
        "delta": 0.1,
    }
    return {"shape": {"type": "curve", "count": 1, "data": [{**item, **changes}]}}


@pytest.mark.parametrize(
    ("document", "reason"),
    [
        ({"shape": 3}, "shape: is no export of curves of geomdl"),
        ({"shape": {"type": "surface", "data": [1]}}, "shape: is no export of curves of geomdl"),
        (geomdl(control_points={"points": POINTS}), "shape.data[0]: is not a curve in space with its control points"),
        (geomdl(reversed=1), "shape.data[0]: is not a curve in space"),
        (geomdl(knotvector=KNOTS[1:]), "curves[0]: 6 knots for 4 control points of degree 2"),
        (geomdl(control_points={"points": [[1, "a", 2]] * 4, "weights": WEIGHTS}), "curves[0]: control_points[0]"),
        ({**VERB, "startKnot": 1}, 'key "startKnot" is not known; known are'),
        ({**WEIGHTED, "weights": WEIGHTS}, "controlPoints: points of four numbers have weights of their own"),
        ({**WEIGHTED, "controlPoints": [[1, 2, 3, 0]] * 4}, "controlPoints: points of four numbers have weights"),
        ({**WEIGHTED, "controlPoints": [[1, 2, 3, 1], [1, 2]]}, "controlPoints[1]: expected 4 numbers as in the first"),
        ({**WEIGHTED, "controlPoints": [[1, 2, True, 1]]}, "controlPoints[0][2]: true is not a number"),
        ([VERB, 3], "curves[1]: is not an object with degree, knots, control_points"),
        ([{"degree": 2}], "curves[0]: knots is missing; needed are degree, knots, control_points"),
    ],
)
def test_slips_are_named(document: object, reason: str) -> None:
    with pytest.raises(FormatError) as caught:
        paths_of(document)
    assert str(caught.value).startswith(f"part.json: {reason}")
