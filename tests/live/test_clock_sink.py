"""Rows that a clock takes: one a period, none lost, late ones counted, and the motion that was planned."""

from __future__ import annotations

import time

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.live.motion import Motion, along
from splinefeed.live.operator import Operator
from splinefeed.live.sinks import ClockSink, SetpointRows
from splinefeed.live.stream import play
from splinefeed.planner.override.reserve import with_reserve

PERIOD = 2e-3
LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000)


class Keep(ClockSink):
    """Keeps what it is given besides."""

    def __init__(self) -> None:
        super().__init__(fill=10**6)  # the clock starts with the last row: a machine that is busy must not come late
        self.kept: list[np.ndarray] = []

    def write(self, rows: SetpointRows) -> None:
        self.kept.append(rows.position)
        super().write(rows)


def motion() -> Motion:
    path = sf.shapes.circle(radius=2.0)
    return along(path, sf.plan(path, with_reserve(LIMITS), period=PERIOD), LIMITS)


@pytest.mark.slow
def test_it_takes_as_long_as_the_motion_and_gets_each_row_of_it() -> None:
    sink, made = Keep(), motion()
    start = time.monotonic()
    state = play(made, sink, Operator(), 2000)
    took = time.monotonic() - start
    assert state.done
    assert state.row == state.confirmed == len(np.concatenate(sink.kept))
    assert took >= made.duration - PERIOD
    again = motion()
    rows = [again.take(1, 1.0)]
    while not again.done:
        rows.append(again.take(64, 1.0))
    expected = np.concatenate(rows)
    assert np.array_equal(np.concatenate(sink.kept)[:-1], expected)
    assert np.array_equal(sink.now()[1], expected[-1])


def test_a_hold_rests_on_the_path_and_goes_on() -> None:
    sink, made, operator = ClockSink(fill=40), motion(), Operator()
    operator.obey({"hold": True})
    seen: list[float] = []

    def look(state) -> None:
        seen.append(state.rate)
        if state.rate == 0.0:
            operator.obey({"hold": False})

    state = play(made, sink, operator, 50, seen=look)
    assert state.done
    assert min(seen) == 0.0
    assert seen[-1] > 0.5


def test_where_a_row_is_missing_the_axes_wait_until_they_are_told_to_go_on() -> None:
    sink = ClockSink()
    sink.open(("x",), PERIOD, np.zeros(1))
    sink.write(SetpointRows(1, np.array([[1.0], [2.0]]), ("x",)))
    time.sleep(5 * PERIOD)
    taken = sink.taken()
    assert (taken.row, taken.underruns, taken.dry) == (2, 1, True)
    sink.write(SetpointRows(3, np.array([[9.0]]), ("x",)))
    time.sleep(2 * PERIOD)
    assert sink.now()[1] == 2.0
    sink.restart()
    assert not sink.taken().dry
    sink.write(SetpointRows(3, np.array([[3.0]]), ("x",)))
    time.sleep(2 * PERIOD)
    assert sink.now() == (3, 3.0)
