"""Lines and arcs that lie on each other in part are found, and nothing else is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from splinefeed.geometry.arcs import arc, polyline
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.overlaps import overlaps


def line(*points: tuple[float, ...]) -> list[NurbsCurve]:
    return [polyline(np.array(points, dtype=float))]


def bow(radius: float, start: float, sweep: float, center: tuple[float, float] = (0.0, 0.0)) -> list[NurbsCurve]:
    x, y = np.array([radius, 0.0]), np.array([0.0, radius])
    return [arc(np.array(center), x, y, math.radians(start), math.radians(sweep))]


@pytest.mark.parametrize(
    ("pieces", "count"),
    [
        ([line((0, 0), (10, 0)), line((5, 0), (15, 0))], 1),
        ([line((0, 0), (10, 0)), line((15, 0), (5, 0))], 1),
        ([line((0, 0), (10, 0)), line((2, 0), (5, 0))], 1),
        ([line((0, 0), (10, 0)), line((10, 0), (15, 0))], 0),
        ([line((0, 0), (10, 0)), line((5, 1e-3), (15, 1e-3))], 0),
        ([line((0, 0), (10, 0)), line((5, 0), (5, 9))], 0),
        ([line((1, 1), (4, 4)), line((9, -1), (3, 3), (2, 2))], 1),
        ([line((0, 0), (9, 9), (3, 3))], 1),
        ([line((0, 0, 1), (9, 9, 4)), line((3, 3, 2), (12, 12, 5))], 1),
        ([line((0, 0, 1), (9, 9, 4)), line((3, 3, 2.1), (12, 12, 5.1))], 0),
        ([bow(5, 0, 90), bow(5, 45, 90)], 1),
        ([bow(5, 0, 90), bow(5, 135, -90)], 1),
        ([bow(5, 0, 360), bow(5, 200, 20)], 1),
        ([bow(5, 300, 90), bow(5, 10, 90)], 1),
        ([bow(5, 0, 90), bow(5, 90, 90), bow(5, 180, 180)], 0),
        ([bow(5, 0, 90), bow(5.001, 45, 90)], 0),
        ([bow(5, 0, 90), bow(5, 45, 90, (0.001, 0.0))], 0),
        ([bow(5, 0, 90)], 0),
        ([[NurbsCurve.bezier([(0, 0), (1, 2), (3, 0)])]], 0),
    ],
)
def test_what_is_shared_is_found(pieces: list[list[NurbsCurve]], count: int) -> None:
    found = overlaps(pieces, 1e-6)
    assert (0 if found is None else found.count) == count


def test_the_place_is_that_of_the_stretch() -> None:
    found = overlaps([line((0, 0), (0, 100)), line((5, 7), (9, 9)), line((0, 60), (0, 40))], 1e-6)
    assert found is not None and found.piece == 2
    assert sorted([found.begin.tolist(), found.end.tolist()]) == [[0.0, 40.0], [0.0, 60.0]]
    found = overlaps([bow(2, 0, 180), bow(2, 90, 180)], 1e-6)
    assert found is not None and np.allclose([found.begin, found.end], [[0, 2], [-2, 0]])


@given(
    st.floats(0, 7), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(0.01, 300), st.floats(0.01, 0.99),
    st.floats(0.1, 50), st.booleans(),
)  # fmt: skip
def test_any_line_is_found_on_itself(
    angle: float, x: float, y: float, length: float, part: float, more: float, turned: bool
) -> None:
    along, start = np.array([math.cos(angle), math.sin(angle)]), np.array([x, y])
    first = [start, start + length * along]
    second = [start + part * length * along, start + (length + more) * along]
    pieces = [
        line(*map(tuple, first)),
        line(*map(tuple, second[::-1] if turned else second)),
        line((-2e3, 5), (-2e3, 9)),
    ]
    found = overlaps(pieces, 1e-6)
    assert found is not None and found.count == 1
    assert np.linalg.norm(found.end - found.begin) == pytest.approx((1.0 - part) * length, abs=1e-5)
