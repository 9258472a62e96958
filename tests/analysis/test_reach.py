"""How far the search for the nearest point reaches, where only a rotary axis turns."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.kernels.contour import _reach

pytestmark = pytest.mark.nojit

#: 10 mm along x, a quarter turn of a at x = 10, which counts 90 mm, and 10 mm more.
PATH = sf.Path.polyline(np.array([[0, 0, 0], [10, 0, 0], [10, 0, np.pi / 2], [20, 0, np.pi / 2]]), ("x", "y", "a"))


@pytest.mark.parametrize(
    ("hint", "way", "reach"),
    [(5.0, 1, 5 + 90 + 3.0), (105.0, -1, 5 + 90 + 3.0), (1.0, 1, 8.0), (107.0, -1, 7 + 90 + 1.0), (101.0, 1, 8.0)],
)
def test_a_reach_of_8_mm_does_not_count_the_turn(hint, way, reach):
    assert _reach(PATH.table, PATH.shape, hint, 8.0, way) == pytest.approx(reach, abs=1e-9)


def test_without_rotary_axes_it_is_what_was_asked():
    path = sf.Path.polyline(np.array([[0.0, 0.0], [10.0, 0.0]]))
    assert _reach(path.table, path.shape, 5.0, 8.0, 1) == 8.0
