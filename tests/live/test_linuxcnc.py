"""The real thing: LinuxCNC's HAL, headless, plays a stream from us; every row once, in order, to the last bit."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.feed.reserve import with_reserve
from splinefeed.live.hal_files import GAIN, LAG, VELOCITY, HalAxis, hal_text
from splinefeed.live.hal_session import hal_session
from splinefeed.live.knob import Knob
from splinefeed.live.linuxcnc_sink import LinuxcncSink, installed
from splinefeed.live.motion import along
from splinefeed.live.stream import State, play
from splinefeed.records import Array

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(not installed(), reason="LinuxCNC is not installed; `make test-linuxcnc` installs it from apt"),
]
PERIOD = 1e-3
AHEAD = 300


class Keep(LinuxcncSink):
    """Remembers what was sent."""

    def __init__(self, home: str) -> None:
        super().__init__(AHEAD, record=True, settle=0.1, home=home)
        self.sent: list[Array] = []

    def write(self, rows):  # type: ignore[no-untyped-def]
        self.sent.append(rows.position)
        super().write(rows)


@cache
def motion_of(source: str) -> tuple[sf.Path, sf.Limits, sf.TimeLaw]:
    path = sf.shapes.from_text(source)
    limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
    return path, limits, sf.plan(path, with_reserve(limits), "time-optimal", PERIOD)


def played(source: str, depth: int = 4000) -> tuple[State, Array, Array]:
    """How it ended, what was sent (n, axes), and what HAL sampled (ticks, columns)."""
    motion = along(*_as_motion(source))
    with hal_session(hal_text((HalAxis("x"), HalAxis("y")), PERIOD, depth)) as home:
        sink = Keep(home)
        state = play(motion, sink, Knob(), AHEAD, here=True)
    return state, np.concatenate(sink.sent), sink.samples


def _as_motion(source: str) -> tuple[sf.Path, sf.TimeLaw, sf.Limits]:
    path, limits, law = motion_of(source)
    return path, law, limits


def assert_whole(state: State, sent: Array, samples: Array) -> None:
    """Every row arrived once, in order, bit for bit, and none was missed."""
    assert state.done
    assert state.underruns == 0
    assert np.all(np.diff(samples[:, 0]) == 1)  # the recorder itself missed no tick
    row = samples[:, 1].astype(int)
    begin = int(np.argmax(row > 0))
    count = len(sent) - 1  # the repetition of the last row is what may stay in the FIFO
    np.testing.assert_array_equal(row[begin : begin + count], np.arange(1, count + 1))
    np.testing.assert_array_equal(samples[begin : begin + count, 3:5], sent[:count])
    assert samples[-1, -1] == 0.0


def chain(command: Array) -> Array:
    """pid, limit1, lowpass and integ of HAL for one axis, in its order; the position after every tick."""
    lag = 1.0 - np.exp(-PERIOD / LAG)
    before = feedback = drive = 0.0
    out = []
    for value in command.tolist():
        # HAL's pid takes the error of the command before (error-previous-target)
        velocity = GAIN * (before - feedback) + (value - before) / PERIOD
        velocity = min(max(velocity, -VELOCITY), VELOCITY)
        drive += (velocity - drive) * lag
        feedback += drive * PERIOD
        before = value
        out.append(feedback)
    return np.array(out)


@pytest.mark.parametrize("source", ["butterfly", "naca:0025?perimeter=33"])
def test_hal_gets_every_row_once_and_its_servo_chain_is_ours(source: str) -> None:
    state, sent, samples = played(source)
    assert_whole(state, sent, samples)
    for k in range(2):
        np.testing.assert_allclose(chain(samples[:, 3 + k]), samples[:, 5 + k], rtol=0.0, atol=1e-12)


def test_a_number_of_rows_that_is_a_multiple_of_the_depth_loses_none() -> None:
    _, _, law = motion_of("naca:0025?perimeter=33")
    rows = round(law.duration / PERIOD) + 1
    # with the repetition of the last row, and without it, one of the two is a multiple of the depth
    state, sent, samples = played("naca:0025?perimeter=33", depth=rows)
    assert len(sent) == rows + 1
    assert_whole(state, sent, samples)
