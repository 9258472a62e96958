"""Setpoints through a machine with their path: contour error, tally, kept samples, chunks, axes that one side lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import motions
import splinefeed as sf
from splinefeed.analysis.following import ContourMeter, ErrorTally
from splinefeed.analysis.thinning import Kept
from splinefeed.checks.place import Placer
from splinefeed.errors import InputError
from splinefeed.runs.following import Servo, follow_chunks

TABLE = sf.Machine.load("xytheta")


@pytest.fixture(scope="module")
def motion() -> sf.Setpoints:
    return sf.run(motions.smooth(), sf.Limits(feed=60, acceleration=500, jerk=20000)).points


def without_places(points: sf.Setpoints) -> sf.Setpoints:
    nothing = np.full(len(points), np.nan)
    return replace(points, s=nothing, u=nothing, feed=nothing, curve=np.full(len(points), -1))


def test_the_contour_error_is_attached_where_the_path_is_known(motion: sf.Setpoints) -> None:
    path = motions.smooth()
    response = sf.runs.follow(motion, TABLE, path=path)
    np.testing.assert_array_equal(
        response.contour_error, ContourMeter(path).measure(response.position, s_hint=motion.s).error
    )
    assert sf.runs.follow(motion, TABLE).contour_error is None
    assert np.all(response.contour_error <= np.linalg.norm(response.tracking_error, axis=1) + 1e-12)


def test_pieces_give_the_bits_and_the_tally_of_one_run(motion: sf.Setpoints) -> None:
    path = motions.smooth()
    whole = sf.runs.follow(motion, TABLE, path=path)
    servo = Servo(TABLE, motion, path)
    parts = list(follow_chunks((motion.part(i, i + 97) for i in range(0, len(motion), 97)), servo))
    for name in ("t", "command", "position", "measured", "output", "saturated", "contour_error"):
        np.testing.assert_array_equal(np.concatenate([getattr(part, name) for part in parts]), getattr(whole, name))
    numbers = servo.tally.numbers()
    for axis, error in zip(whole.axes, (whole.command - whole.position).T, strict=True):
        worst = int(np.argmax(np.abs(error)))
        assert numbers["tracking_error_max"][axis] == abs(error[worst])
        assert numbers["tracking"][axis]["rms"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)
        assert numbers["tracking"][axis]["at_t_s"] == whole.t[worst]
        assert numbers["tracking"][axis]["at_s_mm"] == pytest.approx(motion.s[worst], rel=1e-12)
    assert numbers["contour_error_max_mm"] == np.max(whole.contour_error)
    assert numbers["contour_error_rms_mm"] == pytest.approx(np.sqrt(np.mean(whole.contour_error**2)), rel=1e-12)
    worst = int(np.argmax(whole.contour_error))
    assert numbers["contour_error_at"] == {"t_s": whole.t[worst], "s_mm": motion.s[worst]}
    assert numbers["followed_ticks"] == len(motion)


def test_rotary_axes_are_tallied_in_degrees() -> None:
    points = sf.run(sf.paths.tangential(motions.smooth()), sf.Limits(feed=20, acceleration=100, jerk=5000)).points
    path = sf.paths.tangential(motions.smooth())
    servo = Servo(TABLE, points, path)
    response = servo.follow(points)
    each = servo.tally.numbers()["tracking"]["theta"]
    assert each["unit"] == "deg"
    assert each["max"] == pytest.approx(np.degrees(np.max(np.abs(response.tracking_error[:, 2]))), rel=1e-12)
    planar = replace(points, axes=("x", "y"), position=points.position[:, :2])
    np.testing.assert_array_equal(sf.runs.follow(planar, TABLE, path=path).contour_error, response.contour_error)


def test_setpoints_without_arc_lengths_are_placed_in_order(motion: sf.Setpoints) -> None:
    """The figure of eight crosses itself; the nearest point alone would jump to the other branch there."""
    t = np.linspace(0.0, 2.0 * np.pi, 33)
    eight = sf.paths.fit(np.column_stack([20.0 * np.sin(t), 10.0 * np.sin(2.0 * t)]), 1e-3)
    path = sf.Path(eight.curves)
    points = sf.run(path, sf.Limits(feed=40, acceleration=300, jerk=10000)).points
    placed = Placer(path)
    np.testing.assert_allclose(placed.place(without_places(points)), points.s, rtol=0, atol=1e-6)
    assert placed.apart < 1e-9
    both = [sf.runs.follow(each, TABLE, path=path).contour_error for each in (points, without_places(points))]
    np.testing.assert_allclose(both[1], both[0], rtol=0, atol=1e-9)


def test_axes_that_one_side_lacks(motion: sf.Setpoints) -> None:
    still = replace(
        motion, axes=("x", "y", "z"), position=np.column_stack([motion.position, np.full(len(motion), 3.0)])
    )
    servo = Servo(TABLE, still, motions.smooth())
    response = servo.follow(still)
    assert response.axes == ("x", "y")
    np.testing.assert_array_equal(response.position, sf.runs.follow(motion, TABLE).position)
    assert servo.notes == [
        "axis z does not move and xytheta has none: left out",
        "theta: no setpoints; this axis of xytheta holds its position",
    ]
    moving = replace(still, position=still.position + [[0.0, 0.0, 1.0]] * np.linspace(0, 2, len(still))[:, None])
    with pytest.raises(InputError) as caught:
        sf.runs.follow(moving, TABLE)
    assert str(caught.value) == (
        "the setpoints move axis z by 2 mm, and machine 'xytheta' has no such axis; its axes are x, y, theta"
    )
    spatial = sf.Path([sf.NurbsCurve.bezier([[0, 0, 0], [1, 1, 1]])])
    with pytest.raises(InputError) as caught:
        sf.runs.follow(motion, TABLE, path=spatial)
    assert str(caught.value) == "the path has an axis z; the setpoints have only x, y"
    none = replace(motion, axes=("a", "b"))
    with pytest.raises(InputError) as caught:
        sf.runs.follow(none, TABLE)
    assert str(caught.value) == "machine 'xytheta' has none of the axes a, b; its axes are x, y, theta"
    with pytest.raises(
        InputError, match="has none of the axes x, y; its axes are none, only a control for cycle times"
    ):
        sf.runs.follow(motion, "hurco-02")


def test_bad_setpoints_are_refused_with_their_place(motion: sf.Setpoints) -> None:
    bad = motion.position.copy()
    bad[70, 1] = np.nan
    with pytest.raises(InputError) as caught:
        sf.runs.follow(replace(motion, position=bad), TABLE, path=motions.smooth())
    assert str(caught.value).startswith("at t = 0.07 s axis y is nan")
    with pytest.raises(InputError) as caught:
        sf.runs.follow(motion.part(0, 0), TABLE)
    assert str(caught.value) == "no setpoints; at least one is needed"


def test_a_run_away_ends_the_response_and_is_tallied(motion: sf.Setpoints) -> None:
    x = TABLE.axes["x"]
    wild = replace(
        TABLE, axes={**TABLE.axes, "x": replace(x, controller=replace(x.controller, kd=20.0, error_limit=1.0))}
    )
    servo = Servo(wild, motion, motions.smooth())
    parts = list(follow_chunks((motion.part(i, i + 50) for i in range(0, len(motion), 50)), servo))
    ticks = sum(len(part) for part in parts)
    assert 0 < ticks < len(motion)
    assert servo.stopped is not None
    assert servo.stopped.startswith("axis x ran away at ")
    assert servo.notes[-1].startswith("axis x: gains unstable: a closed-loop pole has modulus ")
    assert servo.tally.numbers()["stopped"] == servo.stopped
    assert servo.tally.numbers()["tracking"]["x"]["saturated_ticks"] > 0
    whole = sf.runs.follow(motion, wild, path=motions.smooth())
    assert (len(whole), whole.stopped) == (ticks, servo.stopped)
    assert len(whole.contour_error) == ticks


def test_every_peak_of_a_response_is_kept_in_bounded_room(motion: sf.Setpoints) -> None:
    path = motions.smooth()
    whole = sf.runs.follow(motion, TABLE, path=path)
    servo = Servo(TABLE, motion, path, keep=Kept(most=300))
    for _ in follow_chunks((motion.part(i, i + 170) for i in range(0, len(motion), 170)), servo):
        pass
    seen = servo.response
    assert len(seen) <= 300 < len(motion) / 3
    assert (seen.t[0], seen.t[-1]) == (0.0, whole.t[-1])
    for column in range(2):
        errors, kept = whole.tracking_error[:, column], seen.tracking_error[:, column]
        assert (np.max(kept), np.min(kept)) == (np.max(errors), np.min(errors))
    assert np.max(seen.contour_error) == np.max(whole.contour_error)
    assert np.all(np.diff(seen.t) > 0)
    beside = servo.deviation()
    np.testing.assert_allclose(np.linalg.norm(beside.offset, axis=1), seen.contour_error, rtol=0, atol=1e-9)


def test_a_tally_wants_the_axes_it_was_made_for(motion: sf.Setpoints) -> None:
    response = sf.runs.follow(motion, TABLE)
    with pytest.raises(InputError, match="the response has axes"):
        ErrorTally(("x",)).see(response)
