"""Splines with inner knots of multiplicity degree + 1, at which they may jump: their exact pieces, or an error."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import FormatError
from splinefeed.formats.cad_curves import curves_of
from splinefeed.formats.registry import read_all

LEFT, RIGHT = [(0, 0), (1, 2), (3, 2), (4, 0)], [(4, 0), (5, -2), (7, -2), (8, 0)]
KNOTS = [0] * 4 + [1] * 4 + [2] * 4
FINDING = "1 spline has a knot of multiplicity degree + 1, at which it may jump; each is the pieces between, exactly"


def dxf(file: Path, degree: int, knots: list[float], points: list[tuple[float, float]], weights: object = ()) -> Path:
    text = f"0\nSECTION\n2\nENTITIES\n0\nSPLINE\n8\n0\n70\n8\n71\n{degree}\n72\n{len(knots)}\n73\n{len(points)}\n"
    text += "".join(f"40\n{knot}\n" for knot in knots) + "".join(f"41\n{weight}\n" for weight in weights)
    text += "".join(f"10\n{x}\n20\n{y}\n30\n0\n" for x, y in points)
    file.write_text(text + "0\nENDSEC\n0\nEOF\n")
    return file


@pytest.mark.parametrize("more", [[], [(7, 7)], [(7, 7), (-5, 3)]])
def test_a_spline_of_dxf_that_may_jump_and_does_not_is_one_path(tmp_path: Path, more: list[tuple[int, int]]) -> None:
    knots = [0] * 4 + [1] * (4 + len(more)) + [2] * 4
    path = sf.read(dxf(tmp_path / "part.dxf", 3, knots, [*LEFT, *more, *RIGHT]))
    assert [curve.control_points.tolist() for curve in path.curves] == [
        [list(p) for p in LEFT],
        [list(p) for p in RIGHT],
    ]
    assert [curve.domain for curve in path.curves] == [(0.0, 1.0), (1.0, 2.0)] and FINDING in path.findings


def test_one_that_does_jump_is_two(tmp_path: Path) -> None:
    file = dxf(tmp_path / "part.dxf", 3, KNOTS, [*LEFT, (5, 0), *RIGHT[1:]], [1, 2, 1, 1, 3, 1, 1, 3])
    one, other = read_all(file)
    assert one.ends[-1, 1].tolist() == [4.0, 0.0] and other.ends[0, 0].tolist() == [5.0, 0.0]
    assert other.curves[0].weights is not None and other.curves[0].weights.tolist() == [3, 1, 1, 3]


def test_lines_of_degree_1_and_pieces_without_length(tmp_path: Path) -> None:
    file = dxf(tmp_path / "part.dxf", 1, [0, 0, 1, 1, 2, 2, 3, 3], [(0, 0), (1, 0), (1, 0), (1, 0), (1, 0), (2, 2)])
    assert sf.read(file).length == pytest.approx(1.0 + 5.0**0.5)


def test_knots_as_rhino_counts_them_are_mended_when_asked_for(tmp_path: Path) -> None:
    file = dxf(tmp_path / "part.dxf", 3, [0, 0, 0, 1, 1, 1], LEFT)
    with pytest.raises(FormatError, match="has no first and last knot, which Rhino leaves out"):
        sf.read(file)
    assert sf.read(file, repair=True).curves[0].knots.tolist() == [0] * 4 + [1] * 4


@pytest.mark.parametrize(
    ("first", "last", "x"), [(0.0, 2.0, 8.0), (0.5, 1.5, 4.0), (1.0, 2.0, 4.0), (0.25, 0.75, 2.1875)]
)
def test_what_rhino_describes_is_split_and_trimmed(first: float, last: float, x: float) -> None:
    points = [(*place, 0.0) for place in [*LEFT, *RIGHT]]
    said = {
        "type": "nurbs",
        "degree": 3,
        "knots": KNOTS,
        "points": points,
        "weights": None,
        "first": first,
        "last": last,
    }
    for backwards in (False, True):
        curves = curves_of({**said, "reversed": backwards})
        assert sum(abs(curve.ends[1][0] - curve.ends[0][0]) for curve in curves) == pytest.approx(x)
        assert all(np.allclose(a.ends[1], b.ends[0]) for a, b in pairwise(curves))
        assert (curves[0].ends[0][0] < curves[-1].ends[1][0]) != backwards


def test_step_says_which_spline_occt_would_leave_out(tmp_path: Path) -> None:
    file = tmp_path / "part.step"
    whole = sf.NurbsCurve(3, [0] * 4 + [1] * 3 + [2] * 4, [*LEFT, *RIGHT[1:]])
    for weights in (None, [1, 2, 1, 1, 1, 2, 1]):
        sf.write(sf.Path([sf.NurbsCurve(3, whole.knots, whole.control_points, weights)]), file)
        text = file.read_text()
        assert "(4,3,4)" in text and sf.read(file).length > 8.0
        file.write_text(text.replace("(4,3,4)", "(4,4,4)"))
        with pytest.raises(FormatError, match=r"line 33: #25: an inner knot stands 4 times, more than the degree"):
            sf.read(file)


def iges(file: Path, knots: list[int], points: list[tuple[float, float]]) -> Path:
    """One B-spline curve of degree 3 as IGES."""
    words = [126, len(points) - 1, 3, 0, 0, 1, 0, *map(float, knots), *[1.0] * len(points)]
    words += [float(value) for x, y in points for value in (x, y, 0)] + [
        float(knots[0]),
        float(knots[-1]),
        0.0,
        0.0,
        1.0,
    ]
    rows = [""]
    for word in [f"{word}," for word in words[:-1]] + [f"{words[-1]};"]:
        rows = [*rows, word] if len(rows[-1]) + len(word) > 64 else [*rows[:-1], rows[-1] + word]
    head = "1H,,1H;,1Ha,1Hb,1Hc,1Hd,32,38,6,308,15,1He,1.0,2,2HMM,1,0.01,15H20200101.000000,1e-7,1e3,1Hf,1Hg,11,0,"
    head = [head[i : i + 72] for i in range(0, len(head + "15H20200101.000000;"), 72)]
    head[-1] += "15H20200101.000000;"
    entry = f"{126:8d}{1:8d}{0:8d}{0:8d}{0:8d}{0:8d}{0:8d}{0:8d}00000000", f"{126:8d}{0:8d}{0:8d}{len(rows):8d}{0:8d}"
    lines = [f"{'':72}S      1", *(f"{row:72}G{i:7d}" for i, row in enumerate(head, 1))]
    lines += [f"{row:72}D{i:7d}" for i, row in enumerate(entry, 1)]
    lines += [f"{row:64}{1:8d}P{i:7d}" for i, row in enumerate(rows, 1)]
    counts = f"S{1:7d}G{len(head):7d}D{2:7d}P{len(rows):7d}"
    file.write_text("\n".join([*lines, f"{counts:72}T      1", ""]))
    return file


def test_iges_may_hold_a_full_knot_but_no_jump(tmp_path: Path) -> None:
    file = tmp_path / "part.igs"
    whole = sf.read(iges(file, [0] * 4 + [1] * 3 + [2] * 4, [*LEFT, *RIGHT[1:]]))
    assert sf.read(iges(file, KNOTS, [*LEFT, *RIGHT])).length == pytest.approx(whole.length, rel=1e-14)
    iges(file, KNOTS, [*LEFT, (5, 0), *RIGHT[1:]])
    with pytest.raises(
        FormatError, match="entity D1: a B-spline of degree 3 has the inner knot 1 4 times and jumps there"
    ):
        sf.read(file)
