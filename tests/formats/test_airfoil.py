"""Airfoil files: both orders, what is reported, what is refused and with which words."""

from __future__ import annotations

import re
from pathlib import Path as File

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from splinefeed.errors import FormatError, InputError, SplinefeedError
from splinefeed.formats import airfoil
from splinefeed.formats.registry import read
from splinefeed.paths.path import Path

UPPER = [(1.0, 0.0), (0.75, 0.05), (0.5, 0.08), (0.25, 0.07), (0.05, 0.03)]
LOWER = [(0.05, -0.02), (0.25, -0.04), (0.5, -0.04), (0.75, -0.02), (1.0, 0.0)]
SECTION = [*UPPER, (0.0, 0.0), *LOWER]


def lines(points: list[tuple[float, float]]) -> str:
    return "".join(f" {x:.5f}  {y:.5E}\n" for x, y in points)


def path_of(text: str, **options: float | str) -> Path:
    (path,) = airfoil.from_text(text, "wing.dat", **options)
    return path


LEDNICER = f"TEST 12\n 6. 6.\n\n{lines([(0.0, 0.0), *reversed(UPPER)])}\n{lines([(0.0, 0.0), *LOWER])}"


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("name", "title", "points", "gap"),
    [
        ("s1223", "S1223HiRes", 300, 0.0),
        ("naca0024", "NACA 0024", 35, 0.504),
        ("pygeo_naca0012_zeroLE", "pygeo_naca0012_zeroLE", 161, 0.252),
    ],
)
def test_real_sections_are_fitted_within_the_tolerance(
    data_dir: File, name: str, title: str, points: int, gap: float
) -> None:
    file = data_dir / "airfoil" / f"{name}.dat"
    path = read(file)
    given_points = np.array([row for row in map(airfoil._pair, file.read_text().splitlines()) if row]) * 100.0
    nearest = np.min([curve.nearest(given_points)[1] for curve in path.curves], axis=0)
    assert nearest.max() <= 1e-3
    assert path.name == title
    assert path.axes == ("x", "y")
    assert path.findings[0] == f"Selig order, {points} points; 1 unit of the file is 100 mm (option chord)"
    assert ("the trailing edge is open" in " ".join(path.findings)) == (gap > 0.0)
    assert np.linalg.norm(path(path.length) - path(0.0)) == pytest.approx(gap, abs=1e-9)
    # the outline is a little longer than the polygon of its points and never much
    polygon = np.sum(np.linalg.norm(np.diff(given_points, axis=0), axis=1))
    assert polygon * 0.9999 < path.length < polygon * 1.01


def test_both_orders_give_the_same_section() -> None:
    selig = path_of("TEST 12\n" + lines(SECTION))
    lednicer = path_of(LEDNICER)
    assert selig.findings[0] == "Selig order, 11 points; 1 unit of the file is 100 mm (option chord)"
    assert lednicer.findings[0] == "Lednicer order, 11 points; 1 unit of the file is 100 mm (option chord)"
    assert lednicer.curves == selig.curves
    assert lednicer.name == selig.name == "TEST 12"


def test_chord_tolerance_and_degree_are_the_users() -> None:
    path = path_of(lines(SECTION), chord="12in", tolerance="0.1mm", degree=5)
    assert path.name == "wing"
    assert path.bounding_box()[1][0] - path.bounding_box()[0][0] == pytest.approx(304.8, abs=0.5)
    assert "1 unit of the file is 304.8 mm" in path.findings[0]
    assert path.findings[-1].endswith("(tolerance 0.1 mm)")
    for wrong in (0.0, -1.0, "0mm"):
        with pytest.raises(InputError, match=r"chord is .* it must be greater than 0"):
            path_of(lines(SECTION), chord=wrong)


def test_open_edges_repeats_and_other_chords_are_reported() -> None:
    text = lines([(1.0, 0.002), *UPPER[1:], (0.0, 0.0), (0.0, 0.0), *LOWER[:-1], (1.0, -0.002)])
    findings = path_of(text).findings
    assert findings[1] == "repeated points are left out: 1"
    assert findings[2] == "the trailing edge is open by 0.4 mm; it is left open"
    percent = path_of(lines([(100 * x, 100 * y) for x, y in SECTION]), chord=1.0)
    assert percent.findings[1] == "the chord is 100 in the file, not 1, so the section is 100 mm long"


BAD = [
    ("one line\nanother line\n", "line 2: expected two finite numbers x y, got 'another line'"),
    ("NAME\n1 2 3\n", "line 2: expected two finite numbers x y, got '1 2 3'"),
    ("NAME\n1.0 nan\n", "line 2: expected two finite numbers x y, got '1.0 nan'"),
    ("NAME\n1e999 0\n", "line 2: expected two finite numbers x y, got '1e999 0'"),
    (lines(SECTION[:3]), "has 3 points; a section has 5 to 20000"),
    (lines([(1.0, 0.0)] * 9), "1 different point(s) along a chord of 0 in the file are not a section"),
    (lines(SECTION[5:] + SECTION[:5]), "begins at x = 0, at its nose; points must begin at the trailing edge"),
    (lines(SECTION[:-1]), "begins at x = 1 but ends at x = 0.75; points are missing, is the file complete?"),
    (LEDNICER.replace("6. 6.", "6. 7."), "line 2: says 6 and 7 points, but 12 follow; is the file complete?"),
    (LEDNICER.replace("6. 6.", "7. 5."), "line 4: the side does not run from the nose backwards"),
]


@pytest.mark.parametrize(("text", "reason"), BAD, ids=[reason[:40] for _, reason in BAD])
def test_what_is_no_section_is_refused_with_its_line(tmp_path: File, text: str, reason: str) -> None:
    file = tmp_path / "wing.dat"
    file.write_text(text)
    with pytest.raises(FormatError) as caught:
        read(file)
    assert str(caught.value) == f"{file}: {reason}"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (lines([(0.0, y) for y in (0, 1, 2, 3, 4)]), "along a chord of 0 in the file are not a section"),
        (lines([(1e99 * x, y) for x, y in SECTION]), "along a chord of 1e+99 in the file are not a section"),
        (lines([(1e8 * x, y) for x, y in SECTION]), "the section is larger than 1e+09 mm; give a smaller chord"),
    ],
)
def test_what_does_not_even_look_like_a_section_is_none(text: str, reason: str) -> None:
    assert not airfoil.holds(text.encode())
    with pytest.raises(InputError, match=re.escape(reason)):
        path_of(text)


def test_commas_may_stand_between(tmp_path: File) -> None:
    file = tmp_path / "wing.dat"
    file.write_text("NAME\n" + "".join(f"{x}, {y}\n" for x, y in SECTION))
    assert read(file).findings[0].startswith("Selig order")


def test_a_million_points_are_refused_in_one_line(tmp_path: File) -> None:
    file = tmp_path / "cloud.dat"
    file.write_text("1.0 0.0\n0.5 0.1\n" * 500_000)
    with pytest.raises(FormatError) as caught:
        read(file)
    assert str(caught.value) == f"{file}: has 1000000 lines; a section has 5 to 20000 points"


def test_words_behind_the_points_are_left_out_and_said(data_dir: File, tmp_path: File) -> None:
    text = (data_dir / "airfoil" / "naca0024.dat").read_text().rstrip("\n")
    file = tmp_path / "wing.dat"
    file.write_text(f"{text}\np= 10.5 alfa0= -4\n\nsource: a letter of 1931\n")
    count = len(text.splitlines())
    assert f"text behind the points, from line {count + 1} on, is left out" in read(file).findings
    assert read(file).length == read(data_dir / "airfoil" / "naca0024.dat").length
    file.write_text(f"{text}\nlower side\n1 0\n")
    with pytest.raises(FormatError, match=f"line {count + 2}: holds a point, but line {count + 1} above it is text"):
        read(file)


@pytest.mark.parametrize("name", ["naca0024", "lednicer"])
def test_a_file_cut_off_before_its_last_points_is_refused(data_dir: File, name: str) -> None:
    text = LEDNICER if name == "lednicer" else (data_dir / "airfoil" / f"{name}.dat").read_text()
    last_point = text.rstrip().rindex("\n")
    for end in range(0, last_point, 10):
        with pytest.raises(InputError):
            path_of(text[:end])


coordinates = st.floats(-2.0, 2.0) | st.floats(allow_nan=True) | st.sampled_from([0.0, 1.0, 0.5, 3.0])


@settings(max_examples=60)
@given(
    st.text(alphabet="0123456789.eE+- \n", max_size=80)
    | st.lists(st.tuples(coordinates, coordinates), max_size=12).map(
        lambda rows: "\n".join(f"{x!r} {y!r}" for x, y in rows)
    )
    | st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(-1.0, 1.0)), min_size=3, max_size=12).map(
        lambda rows: lines([(1.0, 0.0), *rows, (1.0, 0.0)])
    )
)
def test_any_text_gives_a_path_or_an_error_of_ours(text: str) -> None:
    message = ""
    try:
        path_of(text, tolerance=0.01)
    except SplinefeedError as error:
        message = str(error)
    assert "\n" not in message


def test_coordinates_beyond_all_bounds_are_no_numbers(tmp_path: File) -> None:
    file = tmp_path / "wing.dat"
    file.write_text("wing\n1 0\n0.5 0.1\n0 0\n0.5 -1e300\n1 0\n")
    with pytest.raises(FormatError, match=r"line 5: expected two finite numbers x y, got .0\.5 -1e300."):
        read(file)
