"""Curves as JSON: what is read, what is refused and with which words."""

from __future__ import annotations

import json
import math
from pathlib import Path as File
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import SplinefeedError
from splinefeed.formats import json_curve
from splinefeed.formats.registry import read, read_all, write
from splinefeed.paths.path import Path

LINE = {"degree": 1, "knots": [0, 0, 1, 1], "control_points": [[0, 0], [3, 4]], "units": "mm"}


def paths_of(document: object) -> list[Path]:
    text = document if isinstance(document, str) else json.dumps(document)
    return json_curve.from_text(text, "part.json")


def changed(**changes: Any) -> dict[str, Any]:
    return {**LINE, **changes}


@pytest.mark.nojit
def test_the_butterfly_has_its_published_length(data_dir: File) -> None:
    path = read(data_dir / "curves" / "butterfly.json")
    assert path.name == "butterfly"
    assert path.findings == ()
    assert path.curves[0].degree == 3
    assert path.curves[0].control_points.shape == (51, 2)
    assert path.length == pytest.approx(382.8595583013, abs=1e-9)


def test_every_curve_of_a_list_is_read(data_dir: File) -> None:
    paths = read_all(data_dir / "json" / "bezier_curves_even.json")
    assert len(paths) == 39
    assert paths[0].axes == ("x", "y", "z")
    assert paths[0].findings == ("no units are given; read as mm",)
    assert {curve.degree for path in paths for curve in path.curves} == {1, 2, 3}


@pytest.mark.nojit
@pytest.mark.parametrize(("unit", "millimetres"), [("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("in", 25.4)])
def test_units_scale_linear_axes_and_degrees_become_radians(unit: str, millimetres: float) -> None:
    (path,) = paths_of(changed(control_points=[[0, 0, 0], [3, 4, 90]], units=unit, axes=["x", "y", "theta"]))
    assert path.axes == ("x", "y", "theta")
    assert path.curves[0].control_points[1].tolist() == [3 * millimetres, 4 * millimetres, math.pi / 2]
    assert path.tip_end == pytest.approx(5 * millimetres, rel=1e-14)


def test_curves_that_meet_make_one_path_and_others_keep_their_names() -> None:
    here = {key: LINE[key] for key in ("degree", "knots")}
    curves = [
        {**here, "control_points": [[0, 0], [1, 0]], "name": "first"},
        {**here, "control_points": [[1, 0], [1, 1]]},
        {**here, "control_points": [[5, 5], [6, 6]], "units": "cm"},
    ]
    joined, alone = paths_of({"units": "mm", "curves": curves})
    assert (joined.name, len(joined.curves)) == ("first", 2)
    assert (alone.name, alone.curves[0].control_points[0, 0]) == ("part#2", 50.0)
    (only,) = paths_of({"units": "mm", "curves": curves[:2], "name": "frame"})
    assert only.name == "frame"
    (wide,) = json_curve.from_text(json.dumps({"curves": curves[1:]}), "part.json", tolerance="1m")
    assert len(wide.curves) == 2


@given(
    points=st.lists(st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3), min_size=4, max_size=8, unique_by=tuple),
    weights=st.lists(st.floats(0.1, 10), min_size=8, max_size=8),
    count=st.integers(1, 2),
)
def test_what_is_written_is_read_back_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory, points: list[list[float]], weights: list[float], count: int
) -> None:
    n = len(points)
    knots = [0.0, 0.0, 0.0, *np.linspace(0, 1 / 3, n - 1)[1:-1], *[1 / 3] * 3]
    curve = NurbsCurve(2, knots, points, weights[:n])
    path = Path([curve] if count == 1 else [curve, curve.reversed()], name="wing")
    file = tmp_path_factory.mktemp("json") / "wing.json"
    write(path, file)
    back = read(file)
    assert back.curves == path.curves
    assert (back.name, back.axes, back.findings) == (path.name, path.axes, ())


LIST_KEYS = "axes, curves, ground_truth, name, notes, source, units"
CURVE_KEYS = (
    "after, axes, before, control_points, degree, feed, ground_truth, knots, name, notes, source, tolerance, units, "
    "weights"
)
BAD = [
    ("{", "line 1, column 2: Expecting property name enclosed in double quotes; is the file complete, and is it JSON?"),
    ("[1, 2]", "curves[0]: is not an object with degree, knots, control_points"),
    ('{"degree": NaN}', "NaN is not a number that JSON has"),
    ('{"degree": -Infinity}', "-Infinity is not a number that JSON has"),
    ('{"degree": 1, "degree": 2}', 'key "degree" appears twice in one object; leave one of them out'),
    ("[" * 100_000, "is nested too deeply to be a curve"),
    ('{"degree": ' + "9" * 5000 + "}", f"line 1: '{'9' * 20}'... is too large for a number"),
    ({"degree": 1}, "knots is missing; needed are degree, knots, control_points"),
    ({"curves": []}, "curves: is not a list of 1 to 20000 curves"),
    ({"curves": [3]}, "curves[0]: is not an object with degree, knots, control_points"),
    ({"curves": [LINE, {"degree": 1}]}, "curves[1]: knots is missing; needed are degree, knots, control_points"),
    ({"curves": [LINE], "degree": 1}, f'key "degree" is not known; known are {LIST_KEYS}'),
    (changed(weigths=[1, 1]), f'key "weigths" is not known; known are {CURVE_KEYS}'),
    (changed(degree="1"), 'degree: "1" is not a whole number'),
    (changed(degree=True), "degree: true is not a whole number"),
    (changed(degree=13), "degree is 13; expected a whole number from 1 to 12"),
    (changed(units="inch"), 'units: "inch" is not known; write one of mm, cm, m, in'),
    (changed(units=["mm"]), "units: a list is not known; write one of mm, cm, m, in"),
    (changed(knots={}), "knots: is not a list of numbers"),
    (changed(knots=[0, 0, "1", 1]), 'knots[2]: "1" is not a number'),
    (changed(knots=[0, 0, True, 1]), "knots[2]: true is not a number"),
    (changed(knots=[0, 0, 1]), "3 knots for 2 control points of degree 1; exactly 4 (points + degree + 1) expected"),
    (changed(knots=[0, 1, 0, 1]), "knots decrease from knots[1] = 1 to knots[2] = 0"),
    (changed(control_points=[]), "control_points: is not a list of 1 to 200000 points"),
    (changed(control_points=[1, 2]), "control_points[0]: expected a list of 1 to 16 numbers"),
    (changed(control_points=[[0, 0], [1]]), "control_points[1]: expected 2 numbers as in the first point"),
    (changed(control_points=[[0, 0], [1, None]]), "control_points[1][1]: null is not a number"),
    (changed(control_points=[[0] * 17, [1] * 17]), "control_points[0]: expected a list of 1 to 16 numbers"),
    (
        changed(control_points=[[0] * 7, [1] * 7], axes=list("xyzabc")),
        "axes: has 6 names for control points of 7 columns; give one for each",
    ),
    (changed(control_points=[[0, 0], [10**400, 1]]), "control_points[1][0]: is too large for a number"),
    (changed(control_points=[[0, 0], [1e300, 1]]), "control_points[1]: is beyond 1e+09 mm; check the units"),
    (changed(weights=[1, 0]), "weights[1] is 0; weights must be greater than 0"),
    (changed(weights=[1, 1, 1]), "3 weights for 2 control points; expected one each"),
    (changed(axes="xy"), "axes: is not a list of names"),
    (changed(axes=["x"]), "axes: has 1 names for control points of 2 columns; give one for each"),
    (changed(name=["a"]), "name: a list is not text"),
    (changed(control_points=[[0, 0]] * 200_001), "control_points: is not a list of 1 to 200000 points"),
    ({"curves": [3] * 20_001}, "curves: is not a list of 1 to 20000 curves"),
]


@pytest.mark.parametrize(("document", "reason"), BAD, ids=[reason[:40] for _, reason in BAD])
def test_what_is_no_curve_is_refused_with_its_place(tmp_path: File, document: object, reason: str) -> None:
    file = tmp_path / "part.json"
    file.write_text(document if isinstance(document, str) else json.dumps(document))
    with pytest.raises(SplinefeedError) as caught:
        read(file)
    assert str(caught.value) == f"{file}: {reason}"


def test_axes_that_a_path_cannot_have_name_the_file(tmp_path: File) -> None:
    file = tmp_path / "part.json"
    file.write_text(json.dumps(changed(axes=["a", "x"])))
    with pytest.raises(SplinefeedError, match=r"part\.json: axes \('a', 'x'\)"):
        read(file)


def test_a_million_points_are_refused_in_one_line(tmp_path: File) -> None:
    file = tmp_path / "cloud.json"
    file.write_text('{"degree": 1, "knots": [], "control_points": [' + ",".join(["[0.5,1.25]"] * 1_000_000) + "]}")
    with pytest.raises(SplinefeedError) as caught:
        read(file)
    assert str(caught.value) == f"{file}: control_points: is not a list of 1 to 200000 points"


def test_a_file_cut_off_anywhere_is_refused(data_dir: File) -> None:
    text = (data_dir / "curves" / "butterfly.json").read_text().rstrip()
    for end in range(0, len(text), 10):
        with pytest.raises(SplinefeedError, match=r"part\.json: .*is the file complete"):
            paths_of(text[:end])


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.sampled_from(["mm", "x", "a"]),
    lambda inner: (
        st.lists(inner, max_size=5)
        | st.dictionaries(st.sampled_from([*LINE, "weights", "axes", "curves", "name"]), inner, max_size=6)
    ),
    max_leaves=30,
)


@given(
    st.text(alphabet='{}[],:"0123456789.eE+-NaInfity \n', max_size=60) | st.text(max_size=60) | values.map(json.dumps)
)
def test_any_text_gives_paths_or_an_error_of_ours(text: str) -> None:
    message = "part.json: "
    try:
        paths = paths_of(text)
    except SplinefeedError as error:
        paths, message = [], str(error)
    assert message.startswith("part.json: ")
    assert "\n" not in message
    assert all(len(path.curves) > 0 for path in paths)


numbers = st.floats(allow_nan=False, allow_infinity=False) | st.integers(-10, 10)


@given(
    degree=st.integers(0, 4),
    points=st.lists(st.lists(numbers, min_size=2, max_size=2), min_size=1, max_size=6),
    knots=st.lists(numbers, max_size=10).map(sorted),
    weights=st.none() | st.lists(st.floats(0.0, allow_infinity=False), min_size=1, max_size=6),
)
def test_any_numbers_give_a_curve_or_an_error_of_ours(
    degree: int, points: list[list[float]], knots: list[float], weights: list[float] | None
) -> None:
    document = {"degree": degree, "points": points, "knots": knots, "weights": weights}
    document["control_points"] = document.pop("points")
    try:
        paths = paths_of(document)
    except SplinefeedError:
        paths = []
    assert len(paths) <= 1
