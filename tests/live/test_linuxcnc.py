"""The real thing: LinuxCNC's HAL, headless, plays a stream from us; every row once, in order, to the last bit."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path as File

import numpy as np
import pytest
from benchmarks.hal_session import hal_session, run_in_hal
from click.testing import CliRunner

import splinefeed as sf
from live_rows import assert_limits
from splinefeed.cli.main import command_line
from splinefeed.live.hal_files import GAIN, LAG, VELOCITY, HalAxis, hal_text
from splinefeed.live.linuxcnc_sink import LinuxcncError, LinuxcncSink, installed
from splinefeed.live.motion import along
from splinefeed.live.operator import Operator
from splinefeed.live.stream import StreamState, play
from splinefeed.planner.override.reserve import with_reserve
from splinefeed.records import Array

pytestmark = [
    pytest.mark.slow,
    pytest.mark.linuxcnc,
    pytest.mark.skipif(not installed(), reason="no LinuxCNC; on Debian 12: apt-get install linuxcnc-uspace"),
]
PERIOD = 1e-3
AHEAD = 300
DEEP = 1500
"""What no pause of a busy machine that is not real-time outlasts, where no row may be missed."""


class Keep(LinuxcncSink):
    """Remembers what was sent, of a path that may be shifted."""

    shift: Array | float = 0.0

    def __init__(self, home: str, ahead: int = AHEAD) -> None:
        super().__init__(ahead, record=True, settle=0.1, home=home)
        self.sent: list[Array] = []

    def write(self, rows):  # type: ignore[no-untyped-def]
        self.sent.append(rows.position)
        super().write(replace(rows, position=rows.position + self.shift))

    def open(self, axes, period, start):  # type: ignore[no-untyped-def]
        return super().open(axes, period, start + self.shift) - self.shift


@cache
def motion_of(source: str) -> tuple[sf.Path, sf.Limits, sf.TimeLaw]:
    path = sf.shapes.from_text(source)
    limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
    return path, limits, sf.plan(path, with_reserve(limits), strategy="time-optimal", period=PERIOD)


def played(source: str, depth: int = 4000) -> tuple[StreamState, Array, Array]:
    """How it ended, what was sent (n, axes), and what HAL sampled (ticks, columns)."""
    motion = along(*_as_motion(source))
    with hal_session(hal_text((HalAxis("x"), HalAxis("y")), PERIOD, depth)) as home:
        sink = Keep(home, DEEP)
        state = play(motion, sink, Operator(), DEEP, here=True)
    return state, np.concatenate(sink.sent), sink.samples


def _as_motion(source: str) -> tuple[sf.Path, sf.TimeLaw, sf.Limits]:
    path, limits, law = motion_of(source)
    return path, law, limits


def assert_whole(state: StreamState, sent: Array, samples: Array) -> None:
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


def commanded(samples: Array) -> tuple[Array, Array]:
    """Rows that HAL took, each once, and the commands of those ticks, from the last tick before them on."""
    row = samples[:, 1].astype(int)
    begin = int(np.flatnonzero(np.diff(row))[0])
    return row[begin:], samples[begin:, 3:5]


def halcmd(home: str, *words: str) -> None:
    code, said = run_in_hal(["halcmd", *words], home)
    assert code == 0, said


def at_rows(orders: dict[int, Callable[[], object]]) -> Callable[[StreamState], None]:
    """Do each order once, when so many rows were confirmed."""
    waiting = dict(sorted(orders.items()))

    def seen(state: StreamState) -> None:
        for row in [row for row in waiting if state.confirmed >= row]:
            waiting.pop(row)()

    return seen


def test_pins_of_hal_turn_the_feed_hold_go_back_and_go_on_within_the_limits() -> None:
    motion, operator = along(*_as_motion("butterfly")), Operator()
    with hal_session(hal_text((HalAxis("x"), HalAxis("y")), PERIOD)) as home:
        sink = Keep(home, DEEP)
        pins = [
            (300, "override", "0.5"),
            (700, "hold", "1"),
            (1500, "hold", "0"),
            (1900, "reverse", "1"),
            (2600, "override", "1"),
            (2800, "reverse", "0"),
        ]
        orders = {row: partial(halcmd, home, "setp", f"splinefeed.feed-{pin}", value) for row, pin, value in pins}
        orders[4200] = partial(operator.obey, {"stop": True})
        rates: list[float] = []
        follow = at_rows(orders)

        def seen(state: StreamState) -> None:
            follow(state)
            rates.append(state.rate)

        state = play(motion, sink, operator, DEEP, here=True, seen=seen)
    assert not state.done and state.underruns == 0
    row, position = commanded(sink.samples)
    np.testing.assert_array_equal(np.diff(row[: state.row]), 1)
    assert_limits(position)
    assert {0.5, 0.0, -0.5, 1.0} <= set(rates)


def test_a_stall_and_a_consumer_that_dies_cost_no_row_and_a_resume_goes_to_the_end() -> None:
    source = "naca:0025?perimeter=33"
    stalls = [1.0]

    def stalled() -> None:
        time.sleep(stalls.pop())

    with hal_session(hal_text((HalAxis("x"), HalAxis("y")), PERIOD)) as home:
        sink = Keep(home)
        state = play(along(*_as_motion(source)), sink, Operator(), AHEAD, here=True, seen=at_rows({150: stalled}))
        assert state.done and 300 < state.underruns < 3000
        row, position = commanded(sink.samples)
        assert set(np.diff(row).tolist()) <= {0, 1}  # every row once, and in order
        assert row[-1] >= state.row - 1
        held = int(np.flatnonzero((np.diff(row) == 0) & (row[1:] < state.row - 1))[-1])
        assert_limits(position[held:])  # from where it was held

        sink = Keep(home)
        confirmed: list[StreamState] = []
        killed = at_rows({200: lambda: sink._child.kill()})  # type: ignore[union-attr]
        shift = position[-1]  # the path begins where the axes are
        with pytest.raises(LinuxcncError, match=r"HAL stopped taking rows after row \d+"):
            play(along(*_as_motion(source)), sink, Operator(), AHEAD, here=True, saved=confirmed.append, seen=killed)
        time.sleep(0.5)  # HAL plays what it has
        last = confirmed[-1]
        assert last.confirmed >= 200 and not last.done

        motion = along(*_as_motion(source))
        sink = Keep(home)
        sink.shift = shift - motion.origin
        state = play(motion, sink, Operator(), AHEAD, resume=(last.confirmed_tau, last.tau))
        assert state.done
        assert motion.start[0] != motion.origin[0]
        _, position = commanded(sink.samples)
        assert_limits(position)
        end = motion_of(source)[0]
        np.testing.assert_allclose(position[-1], end(end.length) + sink.shift, atol=1e-9)


def test_an_axis_that_does_not_follow_stops_the_stream_for_good_until_the_next() -> None:
    source = "naca:0025?perimeter=33"
    with hal_session(hal_text((HalAxis("x"), HalAxis("y")), PERIOD)) as home:
        sink = Keep(home)
        jam = at_rows({100: partial(halcmd, home, "setp", "limit-x.min", "-0.5")})
        with pytest.raises(LinuxcncError, match=r"x does not follow: it is .* mm from its commanded position"):
            play(along(*_as_motion(source)), sink, Operator(), AHEAD, here=True, seen=jam)
        row, position = sink.samples[:, 1], sink.samples[:, 3:7]
        away = np.abs(position[:, 0] - position[:, 2])
        over = int(np.argmax(away > 1.0))
        assert over and np.all(row[over + 2 :] == row[over + 2])  # the row holds from the next tick on
        assert np.max(away) < 1.2
        halcmd(home, "setp", "limit-x.min", "-100")
        time.sleep(1.0)
        sink = Keep(home)
        assert play(along(*_as_motion(source)), sink, Operator(), AHEAD, here=True).done


def test_the_command_line_approaches_records_and_says_how_it_went(tmp_path: File) -> None:
    words = "stream naca:0025?perimeter=33 --feed 60 --axis-accel 500 --axis-jerk 20000 --to linuxcnc --json"
    with hal_session(hal_text((HalAxis("x"), HalAxis("y")), PERIOD)):
        refused = CliRunner().invoke(command_line, words.split())
        assert refused.exit_code == 2
        assert "x is at 0, the path begins at 15.4966; move them there, or stream with --approach" in refused.output
        result = CliRunner().invoke(
            command_line, [*words.split(), "--approach", "--record", str(tmp_path / "run.h5"), "--ahead", f"{DEEP}ms"]
        )
        assert result.exit_code == 0, result.output
    page = json.loads(result.stdout)
    assert page["done"] and page["underruns"] == 0
    response = sf.load(tmp_path / "run.h5")
    assert response.axes == ("x", "y")
    np.testing.assert_array_equal(response.command[0], [0.0, 0.0])
    np.testing.assert_allclose(response.command[-1], motion_of("naca:0025?perimeter=33")[0](0.0), atol=1e-6)
    assert_limits(response.command)
    assert 0.001 < np.max(np.abs(response.tracking_error)) < 0.5
    assert response.row[-1] >= page["rows"] - 1
    assert set(np.diff(response.row).tolist()) == {0, 1}
    assert np.max(response.depth) <= DEEP and np.max(response.underruns) == 0
