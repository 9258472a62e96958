"""Where along the path setpoints are that know only their positions."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.analysis.place import Placer
from splinefeed.records import Setpoints

#: A square of 10 mm, closed, and a rotary axis that turns by 1 rad along each side.
CORNERS = np.array([[0, 0, 0], [10, 0, 1], [10, 10, 2], [0, 10, 3], [0, 0, 4]], dtype=float)
SQUARE = sf.Path.polyline(CORNERS, ("x", "y", "a"))


def foreign(position, axes=("x", "y"), s=None) -> Setpoints:
    n = len(position)
    unknown = np.full(n, np.nan)
    return Setpoints(
        t=1e-3 * np.arange(n),
        curve=np.zeros(n, dtype=np.int64),
        u=unknown,
        s=unknown if s is None else np.asarray(s),
        feed=np.zeros(n),
        position=np.asarray(position, dtype=float),
        axes=axes,
        period=1e-3,
        method="foreign",
    )


def test_positions_around_a_closed_path_count_on_and_begin_at_its_start():
    s = np.arange(0.0, 40.5, 0.5)
    position = np.column_stack([np.interp(s, 10.0 * np.arange(5), CORNERS[:, k]) for k in range(2)])
    placer = Placer(SQUARE)
    first, rest = foreign(position[:30]), foreign(position[30:])
    found = np.concatenate([placer.place(first), placer.place(rest)])
    assert found == pytest.approx(s, abs=1e-9)
    assert placer.apart < 1e-12


def test_how_far_beside_the_path_they_are_is_known():
    placer = Placer(SQUARE)
    assert placer.place(foreign([[1.0, -0.25], [2.0, -0.5], [3.0, -0.25]])) == pytest.approx([1.0, 2.0, 3.0])
    assert placer.apart == pytest.approx(0.5)


def test_what_setpoints_say_of_their_arc_length_stands():
    assert Placer(SQUARE).place(foreign([[7.0, 7.0], [8.0, 8.0]], s=[-1e-9, 41.0])).tolist() == [0.0, 40.0]


def test_of_two_places_as_near_the_one_where_the_tool_is_counts():
    """Out and straight back: next to the turn, both ways lie within the reach of the search."""
    path = sf.Path.polyline(np.array([[0.0, 0.0], [10.0, 0.0], [2.0, 0.0]]), ("x", "y"))
    for ahead in (1e-3, 1e-2, 0.1):
        s = 10.0 + ahead * np.linspace(-1.0, 1.0, 9) ** 3
        position = np.column_stack([np.where(s <= 10.0, s, 20.0 - s), np.zeros(9)])
        found = Placer(path).locate(foreign(np.vstack([[[0.0, 0.0], [9.0, 0.0]], position])), 1e-9)
        assert found.s[2:] == pytest.approx(s, abs=1e-12)
