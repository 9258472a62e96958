"""Parts of a path and paths joined: they have the tables of their curves."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.paths.parts import cut, joined
from splinefeed.paths.path import Path


def row(count: int = 12) -> Path:
    """Half circles, lines and cubics in a row."""
    w, curves = 0.5**0.5, []
    for k in range(count):
        x = 2.0 * k
        middle = [[[x, 1], [x + 1, 1], [x + 2, 1]], [], [[x, 0.3], [x + 2, -0.3]]][k % 3]
        points = np.array([[x, 0], *middle, [x + 2, 0]])
        if k % 3 == 0:
            curves.append(sf.NurbsCurve(2, [0, 0, 0, 1, 1, 2, 2, 2], points, [1, w, 1, w, 1]))
        else:
            curves.append(sf.NurbsCurve.bezier(points))
    markers = [sf.paths.Marker(4, "M3", 0.25, True), sf.paths.Marker(count, "M5", 0.5, True)]
    return Path(curves, feeds=np.arange(1.0, count + 1), tolerances=np.full(count, 0.1), markers=markers)


def assert_same(path: Path, wanted: Path) -> None:
    """Of the same bits, those of its tables included."""
    for name in ("table", "curve_starts", "ends", "feeds"):
        assert np.array_equal(getattr(path, name), getattr(wanted, name)), name
    assert np.array_equal(path.span_pieces.table, wanted.span_pieces.table)
    assert np.array_equal(path.span_pieces.rows, wanted.span_pieces.rows)
    assert np.array_equal(path.arc_pieces.rows, wanted.arc_pieces.rows)
    assert path.length == wanted.length
    s = np.linspace(0.0, path.length, 101)
    assert np.array_equal(path(s), wanted(s))


@pytest.mark.parametrize(("first", "last"), [(0, 12), (3, 9), (1, 2), (6, 12)])
def test_a_part_has_the_tables_of_its_curves(first, last):
    path = row()
    piece = cut(path, first, last)
    assert_same(piece, Path(path.curves[first:last], feeds=path.feeds[first:last]))
    assert np.array_equal(piece.tolerances, path.tolerances[first:last])
    assert [m.before for m in piece.markers] == [
        m.before - first for m in path.markers if first <= m.before < last or m.before == last == 12
    ]


def test_parts_joined_are_the_path_again():
    path = row()
    parts = [cut(path, 0, 3), cut(path, 3, 7), cut(path, 7, 12)]
    assert sum(part.length for part in parts) == pytest.approx(path.length)
    whole = joined(parts)
    assert_same(whole, row())
    assert whole.markers == path.markers
    assert joined(parts[:1]) is parts[0]


def test_parts_of_other_shapes_are_joined():
    line = Path.polyline([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], ("x", "y"))
    bent = Path([sf.NurbsCurve.bezier(np.array([[2.0, 0.0], [3.0, 0.0], [4.0, 1.0]]))], ("x", "y"))
    assert line.length + bent.length > 4.0
    whole = joined([line, bent])
    assert whole.length == pytest.approx(line.length + bent.length, abs=1e-15)
    assert cut(line, 1, 2).length == 1.0
