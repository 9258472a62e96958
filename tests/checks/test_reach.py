"""How far the search for the nearest point reaches, where only a rotary axis turns."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.analysis.following import ContourMeter
from splinefeed.checks.nearest import NearestOnPath
from splinefeed.checks.spans import spans_of

#: 10 mm along x, a quarter turn of a at x = 10, which counts 90 mm, and 10 mm more.
PATH = sf.Path.polyline(np.array([[0, 0, 0], [10, 0, 0], [10, 0, np.pi / 2], [20, 0, np.pi / 2]]), ("x", "y", "a"))


@pytest.mark.parametrize("lag", [3.0, 8.0])
def test_a_window_does_not_count_the_turn(lag):
    """Commanded `lag` mm behind the turn, still as far in front of it and 1 mm beside it."""
    found = ContourMeter(PATH).measure([[10.0 - lag, 1.0]], s_hint=[100.0 + lag])
    assert found.error == pytest.approx([1.0], rel=1e-12)
    assert found.s == pytest.approx([10.0 - lag], rel=1e-12)


@pytest.mark.parametrize("backwards", [False, True])
def test_a_window_whose_nearest_point_is_its_edge_is_doubled(backwards):
    """Round three corners and back towards where it began: 2.7 mm on, a place is near, and 3.1 mm on a nearer one."""
    points = np.array([[0, 0], [0, 1.1], [0.9, 1.1], [0.6, 0.1], [0.6, -3.0]])
    path = sf.Path.polyline(points[::-1].copy() if backwards else points)
    hint = path.length if backwards else 0.0
    rows = spans_of(path)
    search = NearestOnPath(rows, closed=path.closed)
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
