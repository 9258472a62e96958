"""Splines with inner knots of multiplicity degree + 1, at which they may jump: their exact pieces, or an error."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import FormatError
from splinefeed.formats.cad_process import _curves
from splinefeed.formats.registry import read_all

LEFT, RIGHT = [(0, 0), (1, 2), (3, 2), (4, 0)], [(4, 0), (5, -2), (7, -2), (8, 0)]
KNOTS = [0] * 4 + [1] * 4 + [2] * 4
FINDING = "1 x spline with a knot of multiplicity degree + 1, at which it may jump; it is the pieces between, exactly"


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


def test_what_rhino_describes_is_split() -> None:
    points = [(*place, 0.0) for place in [*LEFT, *RIGHT]]
    said = {"degree": 3, "knots": KNOTS, "points": points, "weights": None}
    for backwards in (False, True):
        curves = _curves({**said, "reversed": backwards})
        assert sum(abs(curve.ends[1][0] - curve.ends[0][0]) for curve in curves) == pytest.approx(8.0)
        assert all(np.allclose(a.ends[1], b.ends[0]) for a, b in pairwise(curves))
        assert (curves[0].ends[0][0] < curves[-1].ends[1][0]) != backwards


RATIONAL = [1.0, 2.0, 1.0, 0.5, 0.5, 1.0, 3.0, 2.0]
FIVE, SIX = [0] * 4 + [1] * 5 + [2] * 4, [0] * 4 + [1] * 6 + [2] * 4


def step(file: Path, knots: list[int], points: list[tuple[float, float]], weights: list[float] | None) -> Path:
    """One B-spline curve of degree 3 as STEP, with comments, line breaks and strings wherever they may stand."""
    sf.write(sf.Path([sf.NurbsCurve.bezier([(0, 0), (1, 1)])]), file)
    frame = file.read_text().replace("(#20)", "(#50)").partition("#18=")[0]
    listed = ", ".join(f"#{i} /* (#1, {i}) */\n" for i in range(100, 100 + len(points)))
    shape = f"3, ({listed}), .UNSPECIFIED., .{'T' if points[0] == points[-1] else 'F'}., .F."
    values = sorted(set(knots))
    counts, places = " , ".join(str(knots.count(value)) for value in values), ",".join(f"{value}." for value in values)
    if weights is None:
        text = f"B_SPLINE_CURVE_WITH_KNOTS('it''s; (4,4,4),(' , {shape}, /* ; */ ({counts}),\n({places}),.UNSPECIFIED.)"
    else:
        text = (
            f"(BOUNDED_CURVE() /* it's */ B_SPLINE_CURVE({shape})\n"
            f"B_SPLINE_CURVE_WITH_KNOTS ( ( {counts} ),({places}),.UNSPECIFIED.)CURVE()\n"
            f"GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE((/*)*/{','.join(map(str, weights))}))\n"
            f"REPRESENTATION_ITEM('RATIONAL_B_SPLINE_CURVE((1.,2.))'))"
        )
    rows = [f"#{i} = CARTESIAN_POINT('a;b', ({x}.0,{y}.0E0,0.));\n" for i, (x, y) in enumerate(points, 100)]
    file.write_text(f"{frame}/* #50=A(); */\n#50 = {text};\n{''.join(rows)}ENDSEC;\nEND-ISO-10303-21;\n")
    return file


WHY = "a B-spline has an inner knot of multiplicity degree + 1, which OCCT cannot hold; let the CAD split it there"


@pytest.mark.parametrize(
    ("knots", "points", "weights"),
    [
        (KNOTS, LEFT + RIGHT, None),
        (KNOTS, LEFT + RIGHT, RATIONAL),
        (SIX, [*LEFT, (7, 7), (-5, 3), *RIGHT], [*RATIONAL[:4], 9.0, 7.0, *RATIONAL[4:]]),
        (KNOTS, [*LEFT, *RIGHT[:-1], LEFT[0]], RATIONAL),
        (KNOTS, [*LEFT, (5, 0), *RIGHT[1:]], None),
        (FIVE, [*LEFT, *RIGHT[:1], (5, 0), *RIGHT[1:]], None),
    ],
)
def test_step_with_a_full_knot_is_refused_by_name(
    tmp_path: Path, knots: list[int], points: list[tuple[float, float]], weights: list[float] | None
) -> None:
    file = step(tmp_path / "part.step", knots, points, weights)
    with pytest.raises(FormatError) as caught:
        sf.read(file)
    assert str(caught.value) == f"{file}: entity 18: {WHY}"


def iges(file: Path, knots: list[int], points: list[tuple[float, float]], weights: list[float] | None = None) -> Path:
    """One B-spline curve of degree 3 as IGES."""
    weights = weights or [1.0] * len(points)
    words = [126, len(points) - 1, 3, 0, 0, int(len(set(weights)) == 1), 0, *map(float, knots), *map(float, weights)]
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


@pytest.mark.parametrize(
    ("knots", "points"), [(KNOTS, LEFT + RIGHT), (KNOTS, [*LEFT, (5, 0), *RIGHT[1:]]), (FIVE, [*LEFT, (5, 0), *RIGHT])]
)
def test_iges_with_a_full_knot_is_refused_by_name(
    tmp_path: Path, knots: list[int], points: list[tuple[float, float]]
) -> None:
    file = tmp_path / "part.igs"
    assert len(sf.read(iges(file, [0] * 4 + [1] * 3 + [2] * 4, [*LEFT, *RIGHT[1:]])).curves) == 1
    with pytest.raises(FormatError) as caught:
        sf.read(iges(file, knots, points))
    assert str(caught.value) == f"{file}: entity D1: {WHY}"
