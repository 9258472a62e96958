"""Drawings of several contours as one motion: order, starts, links, against hand-made truths."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import InputError
from splinefeed.paths.jobs import DEFAULT_FEED, Job, job


def circle(x: float, y: float, radius: float, name: str = "circle") -> sf.Path:
    base = sf.shapes.from_text(f"circle?radius={radius}")
    middle = 0.5 * np.sum(base.bounding_box(), axis=0)
    moved = base.transformed(np.eye(2), np.array([x, y]) - middle)
    return sf.Path(moved.curves, name=name)


def polygon(*points: tuple[float, ...], name: str = "polygon") -> sf.Path:
    return sf.Path.polyline(np.array([*points, points[0]], dtype=float), name=name)


def square(x: float, y: float, side: float, name: str = "square") -> sf.Path:
    return polygon((x, y), (x + side, y), (x + side, y + side), (x, y + side), name=name)


def names(made: Job) -> list[str]:
    return [made.contours[i].name for i in made.order]


def cut_length(made: sf.Path) -> float:
    lengths = np.diff(made.curve_starts)
    return float(lengths[np.isfinite(made.feeds)].sum())


def rapid_length(made: sf.Path) -> float:
    lengths = np.diff(made.curve_starts)
    return float(lengths[np.isinf(made.feeds)].sum())


def test_what_lies_in_another_comes_before_it_however_deep():
    rings = [circle(100.0, 0.0, r, f"r{r}") for r in (40.0, 10.0, 30.0, 20.0)]
    beside = [square(0.0, 0.0, 5.0, "near")]
    assert names(job([*rings, *beside])) == ["near", "r10.0", "r20.0", "r30.0", "r40.0"]


def test_a_slit_within_an_outline_comes_first_and_may_be_cut_from_either_end():
    slit = sf.Path.polyline(np.array([[80.0, 50.0], [20.0, 50.0]]), name="slit")
    made = job([square(0.0, 0.0, 100.0, "outline"), slit])
    assert names(made) == ["slit", "outline"]
    # from (0, 0) its end at (20, 50) is nearer; from (80, 50) the nearest corners of the outline are 53.85 mm away
    assert np.allclose(made(0.0), [20.0, 50.0])
    assert rapid_length(made) == pytest.approx(math.hypot(20.0, 50.0))


def test_the_nearest_is_next_and_a_closed_contour_begins_at_its_nearest_corner():
    # drawn from the right to the left, each from its upper right corner
    squares = [
        polygon((x + 10, 10), (x, 10), (x, 0), (x + 10, 0), name=f"x{x}") for x in (60, 30, 0)
    ]  # fmt: skip
    made = job(squares)
    assert names(made) == ["x0", "x30", "x60"]
    # a contour ends where it begins: from (0, 0) to (30, 0) to (60, 0)
    assert rapid_length(made) == pytest.approx(60.0)
    assert cut_length(made) == pytest.approx(120.0)


def test_a_contour_without_corners_begins_at_its_nearest_place_and_stays_the_same_curve():
    made = job([circle(0.0, 0.0, 1.0, "middle"), circle(30.0, 40.0, 5.0, "far")])
    assert names(made) == ["middle", "far"]
    # from the unit circle to the nearest of 128 places of the other: the way between circles is 50 - 1 - 5 mm at least
    assert 44.0 <= rapid_length(made) < 46.2
    on_far = made.evaluate(np.repeat([len(made.curves) - 1], 9), np.linspace(*made.curves[-1].domain, 9))[:, 0]
    assert np.allclose(np.linalg.norm(on_far - [30.0, 40.0], axis=1), 5.0, atol=1e-12)
    assert cut_length(made) == pytest.approx(2.0 * math.pi * 6.0, rel=1e-9)


def test_rapid_moves_go_at_the_clearance_and_the_tool_goes_down_at_the_feed():
    made = job([square(0.0, 0.0, 10.0), square(40.0, 0.0, 10.0)], clearance="5mm", feed=20.0)
    assert made.axes == ("x", "y", "z")
    ends = made.ends
    assert np.array_equal(ends[0], [[0, 0, 5], [0, 0, 0]])
    assert made.feeds[0] == 20.0
    assert np.array_equal(ends[-1, 1], [40, 0, 5])
    rapids = np.isinf(made.feeds)
    assert rapids.sum() == 3  # up, over, and up at the end
    assert np.all(ends[rapids].max(axis=(0, 1))[2] == 5.0)
    over = [k for k in np.flatnonzero(rapids) if np.ptp(ends[k, :, 2]) == 0.0]
    assert len(over) == 1
    assert np.allclose(ends[over[0], :, 2], 5.0)
    # 5 down, 40 around, 5 up, 40 over, 5 down, 40 around, 5 up
    assert made.length == pytest.approx(5 + 40 + 5 + 40 + 5 + 40 + 5)
    assert not made.markers


def test_without_a_clearance_the_laser_is_off_in_rapid_moves():
    made = job([square(0.0, 0.0, 10.0), square(40.0, 0.0, 10.0)])
    assert [(marker.before, marker.text) for marker in made.markers] == [(0, "M3"), (4, "M5"), (5, "M3"), (9, "M5")]
    assert np.isinf(made.feeds).tolist() == [False] * 4 + [True] + [False] * 4
    assert made.feeds[0] == DEFAULT_FEED
    assert any("laser off (M5, M3)" in each for each in made.findings)
    assert any("offset of a tool's radius is CAM's" in each for each in made.findings)


def test_the_order_of_the_file_stays_if_it_is_wanted_and_another_contour_may_be_first():
    plate, hole = square(0.0, 0.0, 50.0, "plate"), square(40.0, 40.0, 5.0, "hole")
    far = square(90.0, 0.0, 5.0, "far")
    assert names(job([plate, hole, far])) == ["hole", "plate", "far"]
    kept = job([plate, hole, far], keep_order=True)
    assert names(kept) == ["plate", "hole", "far"]
    assert np.allclose(kept(0.0), plate(0.0))
    assert names(job([plate, hole, far], first="far"))[0] == "far"
    assert names(job([plate, hole, far], first=1)) == ["plate", "hole", "far"]
    assert names(job([plate, hole, far], first="3", keep_order=True)) == ["far", "plate", "hole"]
    assert names(kept.job()) == ["hole", "plate", "far"]


def test_greedy_order_of_many_is_that_of_a_plain_search():
    rng = np.random.default_rng(3)
    places = rng.uniform(0.0, 1000.0, (400, 2))
    made = job([square(x, y, 0.5) for x, y in places.tolist()])
    left, here, order = list(range(len(places))), np.zeros(2), []
    corners = places[:, None] + 0.5 * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    while left:
        away = np.linalg.norm(corners[left] - here, axis=2)
        k, corner = np.unravel_index(np.argmin(away), away.shape)
        order.append(left.pop(int(k)))
        here = corners[order[-1], corner]
    assert list(made.order) == order


def test_contours_that_touch_are_linked_without_a_rapid_move():
    made = job([square(0.0, 0.0, 10.0), square(-10.0, -10.0, 10.0)])
    assert rapid_length(made) == 0.0
    assert [marker.text for marker in made.markers] == ["M3", "M5"]


def test_a_contour_drawn_twice_is_cut_twice_and_holds_nobody_up():
    made = job([square(0.0, 0.0, 10.0, "a"), square(0.0, 0.0, 10.0, "b")])
    assert names(made) == ["a", "b"]


def test_a_job_is_planned_and_keeps_its_limits_and_is_pickled():
    limits = sf.Limits(feed=200.0, axis_acceleration=2000.0, axis_jerk=100000.0)
    made = job([square(0.0, 0.0, 10.0), circle(60.0, 5.0, 5.0)], clearance=2.0, feed=30.0)
    run = sf.run(made, limits)
    assert run.ok
    feeds = run.points.feed
    rapid = np.isinf(made.feeds)[run.points.curve]
    assert feeds[~rapid].max() <= 30.0 * (1.0 + 1e-6)
    assert feeds[rapid].max() > 60.0
    again = pickle.loads(pickle.dumps(made))
    assert isinstance(again, Job)
    assert again.order == made.order
    assert again.length == made.length


@pytest.mark.parametrize(
    ("contours", "linking", "words"),
    [
        ([square(0, 0, 1)], {"clearance": 0.0}, "clearance is 0 mm; it must be above the contours, whose z reaches 0"),
        ([polygon((0, 0, 7), (1, 0, 3), (1, 1, 2))], {"clearance": 5.0}, "whose z reaches 7 mm"),
        ([square(0, 0, 1)], {"first": "hole"}, "there is no contour 'hole'"),
        ([square(0, 0, 1)], {"first": 2}, "there are 1 to 1"),
        ([square(0, 0, 1)], {"feed": 0.0}, "feed is 0 mm/s"),
        ([sf.Path.polyline([[0.0, 0.0], [1.0, 1.0]], ("x", "a"))], {}, "has axes x a: only contours in x and y"),
        ([], {}, "at least one contour"),
    ],
)
def test_what_cannot_be_linked_is_refused(contours, linking, words):
    with pytest.raises(InputError, match=words):
        job(contours, **linking)
