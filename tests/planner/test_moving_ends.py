"""Time-optimal plans that begin or end in motion: the feeds are met, every limit holds, periods are whole."""

from __future__ import annotations

import numpy as np
import pytest

import motions
import splinefeed as sf

PERIOD = 1e-3
BUTTERFLY = motions.butterfly()
LINE = sf.Path([sf.NurbsCurve(1, [0, 0, 1, 1], [[0, 0], [30, 10]])])
CORNER = sf.Path(
    [
        sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[0, 0], [10, 0], [15, 8]]),
        sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[15, 8], [15, 2], [30, 0]]),
    ]
)


def limits(start: float, end: float, feed: float = 60.0) -> sf.Limits:
    return sf.Limits(
        feed=feed, axis_velocity=feed, axis_acceleration=500, axis_jerk=20000, start_feed=start, end_feed=end
    )


@pytest.mark.parametrize(
    ("path", "start", "end"),
    [(BUTTERFLY, 20, 0), (BUTTERFLY, 12, 22), (LINE, 20, 0), (LINE, 5, 40), (CORNER, 30, 0), (CORNER, 25, 35)],
)
def test_feeds_at_the_ends_are_met_within_every_limit_in_whole_periods(path: sf.Path, start: float, end: float) -> None:
    given = limits(start, end)
    law = sf.plan(path, given, strategy="time-optimal", period=PERIOD, bound=True)
    rest = sf.plan(path, limits(0, 0), strategy="time-optimal", period=PERIOD, bound=True)
    assert sf.check(sf.interpolate(path, law), path, given, law=law).ok
    assert law.feed(np.array([0.0, law.duration])) == pytest.approx([start, end], rel=1e-12, abs=1e-9)
    assert law.acceleration(np.array([0.0, law.duration])) == pytest.approx([0, 0], abs=1e-6 * 500)
    assert law.duration / PERIOD == pytest.approx(round(law.duration / PERIOD), abs=1e-9)
    assert not law.notes
    assert law.settings["lower_bound_s"] < law.duration < rest.duration
    assert law.settings["lower_bound_s"] < rest.settings["lower_bound_s"]


@pytest.mark.slow
def test_a_plan_backwards_takes_as_long() -> None:
    forwards, backwards = (
        sf.plan(BUTTERFLY, limits(*f), strategy="time-optimal", period=None) for f in ((20, 0), (0, 20))
    )
    rest = sf.plan(BUTTERFLY, limits(0, 0), strategy="time-optimal", period=None)
    saved = rest.duration - forwards.duration
    # the butterfly is its own mirror image
    assert backwards.duration == pytest.approx(forwards.duration, rel=1e-3)
    # what the start from rest to 20 mm/s takes, bar the way: at 500 mm/s2 and 20000 mm/s3 at most
    assert 0.01 < saved < 20 / 500 + 500 / 20000


def test_between_two_feeds_without_room_to_slow_down_the_last_period_is_a_short_one() -> None:
    line = sf.Path([sf.NurbsCurve(1, [0, 0, 1, 1], [[0, 0], [0.3, 0.1]])])
    law = sf.plan(line, limits(60, 60), strategy="time-optimal", period=PERIOD)
    assert law.duration == pytest.approx(line.length / 60, rel=1e-12)
    assert law.notes[0].startswith(
        "the last period is short, 0.000270463 s of 0.001 s: the motion begins and ends at a feed"
    )
    assert sf.check(sf.interpolate(line, law), line, limits(60, 60), law=law).ok


def test_a_feed_that_cannot_be_met_is_an_error_that_names_one_that_can() -> None:
    with pytest.raises(sf.errors.PlanError, match=r"end_feed is 25 mm/s; .* allow at most (\d+\.\d+) mm/s") as caught:
        sf.plan(BUTTERFLY, limits(5, 25), strategy="time-optimal", period=PERIOD)
    most = float(str(caught.value).split("at most ")[1].split()[0])
    assert sf.plan(BUTTERFLY, limits(5, most * (1 - 1e-3)), strategy="time-optimal", period=PERIOD).duration > 0


def test_the_bound_holds_where_the_way_to_the_feed_is_much_shorter_than_a_cell() -> None:
    given = sf.Limits(feed=3.3, axis_acceleration=4000, start_feed=0.7, end_feed=1.6)
    law = sf.plan(motions.smooth(), given, strategy="time-optimal", period=PERIOD, bound=True)
    assert law.settings["lower_bound_s"] < law.duration
