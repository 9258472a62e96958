"""Where along the path setpoints are that know only their positions."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.checks.place import Placer
from splinefeed.records import Setpoints

#: A square of 10 mm, closed, and a rotary axis that turns by 1 rad along each side.
CORNERS = np.array([[0, 0, 0], [10, 0, 1], [10, 10, 2], [0, 10, 3], [0, 0, 4]], dtype=float)
SQUARE = sf.Path.polyline(CORNERS, ("x", "y", "a"), by_tip=True)


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


def test_how_far_beside_a_path_of_rotary_axes_alone_they_are_is_known_too() -> None:
    turn = sf.Path([sf.NurbsCurve.bezier([[0.0, 0.0], [1.0, 0.0]])], axes=("a", "b"))
    placer = Placer(turn)
    placer.place(foreign([[0.0, 0.0], [0.5, 0.02], [1.0, 0.0]], axes=("a", "b")))  # rad
    assert placer.apart == pytest.approx(0.02)


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


@pytest.mark.parametrize("phase", np.linspace(0.0, 1.0, 8, endpoint=False))
def test_around_a_bend_sharper_than_a_step_positions_stay_on_their_way(phase):
    """A hairpin of a tenth of a millimetre, taken in steps of 0.4 mm: there the chord is shorter than the path."""
    path = sf.Path([sf.NurbsCurve.bezier([[0.0, 0.0], [20.0, 0.0], [20.0, 0.1], [0.0, 0.15]])])
    s = np.concatenate([[0.0], np.arange(0.4 * phase, path.length, 0.4)])
    found = Placer(path).locate(foreign(path(s)), 1e-9)
    assert found.s == pytest.approx(s, abs=1e-7)
    assert np.max(found.apart) < 1e-12


def test_where_linear_axes_stand_still_rotary_axes_say_the_place():
    """x = 5 cos, a = 0.5 sin: at the ends of x its position says the place to the root of a rounding alone."""
    half = np.sqrt(0.5)
    points = np.array([[5, 0], [5, 0.5], [0, 0.5], [-5, 0.5], [-5, 0], [-5, -0.5], [0, -0.5], [5, -0.5], [5, 0]])
    curve = sf.NurbsCurve(2, [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4], points, [1, half] * 4 + [1])
    path = sf.Path([curve], ("x", "a"))
    near = np.array([0.0, 1e-5, 1e-4, 1e-3])
    u = np.sort(np.concatenate([k + side * near for k in (0, 2, 4) for side in (-1, 1)]))
    u = np.unique(np.clip(np.concatenate([u, np.linspace(0.0, 4.0, 81)]), 0.0, 4.0))
    found = Placer(path).locate(foreign(path.evaluate(np.zeros(len(u), dtype=int), u)[:, 0], ("x", "a")), 1e-9)
    assert np.max(found.turned) <= 1e-9
