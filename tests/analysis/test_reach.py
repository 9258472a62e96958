"""How far the search for the nearest point reaches, where only a rotary axis turns."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.analysis.following import ContourMeter
from splinefeed.geometry.rows import Rows
from splinefeed.geometry.search import Search

#: 10 mm along x, a quarter turn of a at x = 10, which counts 90 mm, and 10 mm more.
PATH = sf.Path.polyline(np.array([[0, 0, 0], [10, 0, 0], [10, 0, np.pi / 2], [20, 0, np.pi / 2]]), ("x", "y", "a"))


def reached(path: sf.Path, hint: float, half: float, way: int) -> float:
    return float(Search(Rows(path.arc_pieces), closed=path.closed).reach(np.array([hint]), np.array([half]), way)[0])


@pytest.mark.parametrize(
    ("hint", "way", "reach"),
    [(5.0, 1, 5 + 90 + 3.0), (105.0, -1, 5 + 90 + 3.0), (1.0, 1, 8.0), (107.0, -1, 7 + 90 + 1.0), (101.0, 1, 8.0)],
)
def test_a_reach_of_8_mm_does_not_count_the_turn(hint, way, reach):
    assert reached(PATH, hint, 8.0, way) == pytest.approx(reach, abs=1e-9)


def test_without_rotary_axes_it_is_what_was_asked():
    path = sf.Path.polyline(np.array([[0.0, 0.0], [10.0, 0.0]]))
    assert reached(path, 5.0, 8.0, 1) == 8.0


@pytest.mark.parametrize("backwards", [False, True])
def test_a_window_whose_nearest_point_is_its_edge_is_doubled(backwards):
    """Round three corners and back towards where it began: 2.7 mm on, a place is near, and 3.1 mm on a nearer one."""
    points = np.array([[0, 0], [0, 1.1], [0.9, 1.1], [0.6, 0.1], [0.6, -3.0]])
    path = sf.Path.polyline(points[::-1].copy() if backwards else points)
    hint = path.length if backwards else 0.0
    rows = Rows(path.arc_pieces)
    search = Search(rows, closed=path.closed)
    found = search.near(np.array([[0.55], [0.0]]), np.array([hint]), 2.7)
    assert np.sqrt(found.square) == pytest.approx([0.05], rel=1e-9)  # beside the last line, 0.1 mm down it
    s = 2.0 + np.hypot(0.3, 1.0) + 0.1
    at = rows.arc_length(found.row, found.t)
    assert at == pytest.approx([path.length - s if backwards else s], rel=1e-9)
    # what is asked for of the window at least is not what is found within it
    near = search.near(np.array([[0.1], [0.5]]), np.array([hint]), 0.7)
    assert np.sqrt(near.square) == pytest.approx([0.1], rel=1e-9)


@pytest.mark.parametrize("hint", [4.0, 17.0])
def test_a_nearer_part_of_the_path_beyond_the_window_does_not_count(hint):
    """Out 10 mm and back 1 mm beside it: from 0.6 mm off one side the other is nearer, and is not where the tool is."""
    path = sf.Path.polyline(np.array([[0, 0], [10, 0], [10, 1], [0, 1]]))
    at = path(np.array([hint]))[0]
    q = at + [0.0, 0.6 if hint < 10.0 else -0.6]
    found = ContourMeter(path).measure(q[None], s_hint=np.array([hint]))
    assert found.error == pytest.approx([0.6], rel=1e-12)
    assert found.s == pytest.approx([hint], rel=1e-12)
    assert ContourMeter(path).measure(q[None]).error == pytest.approx([0.4], rel=1e-12)
