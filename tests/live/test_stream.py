"""The stream: rows in order, a stop on the path, a resume, and a socket that takes no orders from strangers."""

from __future__ import annotations

import contextlib
import json
import socket
import threading
import time
from functools import cache
from pathlib import Path as File

import numpy as np
import pytest

import splinefeed as sf
from live_rows import Datagrams, assert_limits
from splinefeed.errors import InputError
from splinefeed.live.motion import along, approach
from splinefeed.live.operator import LONGEST_LINE, MOST_CLIENTS, Operator, OperatorServer
from splinefeed.live.sinks import SetpointRows, Taken, TextSink, UdpSink
from splinefeed.live.stream import StreamError, StreamState, play
from splinefeed.planner.override.reserve import with_reserve
from splinefeed.records import Array, Setpoints

LIMITS = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)


@cache
def planned() -> tuple[sf.Path, sf.TimeLaw, sf.Limits]:
    path = sf.shapes.from_text("naca:0025?perimeter=33")
    return path, sf.plan(path, with_reserve(LIMITS), strategy="time-optimal", period=1e-3), LIMITS


class Keeper:
    """A sink that remembers, and changes the override at a row."""

    paced = False

    def __init__(self, at: int = 0, turn=lambda: None) -> None:  # type: ignore[no-untyped-def]
        self.rows: list[SetpointRows] = []
        self._at, self._turn = at, turn

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        return start

    def write(self, rows: SetpointRows) -> None:
        self.rows.append(rows)
        if rows.first <= self._at < rows.first + len(rows):
            self._turn()

    def depth(self) -> int:
        return 0

    def taken(self) -> Taken:
        return Taken(self.rows[-1].first + len(self.rows[-1]) - 1 if self.rows else 0)

    close = taken

    def restart(self) -> None:
        pass

    def abandon(self) -> None:
        pass


def test_a_file_holds_every_row_once_and_the_last_one_twice(tmp_path: File) -> None:
    motion = along(*planned())
    state = play(motion, TextSink(tmp_path / "rows.txt"), Operator(), 300)
    table = np.loadtxt(tmp_path / "rows.txt")
    np.testing.assert_array_equal(table[:, 0], np.arange(1, state.row + 1))
    points = sf.interpolate(planned()[0], planned()[1], method="arc-length")
    assert len(table) == len(points) + 1
    np.testing.assert_allclose(table[:-1, 1:3], points.position, atol=1e-11)
    np.testing.assert_array_equal(table[-1, 1:3], table[-2, 1:3])
    np.testing.assert_array_equal(table[-3:, 3], [0, 1, 1])


def test_a_stop_rests_on_the_path_and_a_resume_goes_on_to_the_end() -> None:
    operator = Operator()
    first, second = along(*planned()), None
    sink = Keeper(300, lambda: operator.obey({"stop": True}))
    state = play(first, sink, operator, 300)
    assert not state.done
    assert 0.2 < state.tau < first.duration
    second = along(*planned())
    second.begin_at(state.confirmed_tau)
    more = Keeper()
    assert play(second, more, Operator(), 300).done
    stopped, went_on = (np.concatenate([rows.position for rows in each.rows]) for each in (sink, more))
    np.testing.assert_array_equal(stopped[-1], went_on[0])
    both = np.concatenate([stopped, went_on])
    nan = np.full(len(both), np.nan)
    points = Setpoints(
        t=np.arange(len(both)) * 1e-3,
        curve=np.zeros(len(both), dtype=np.int64),
        u=nan,
        s=nan,
        feed=nan,
        position=both,
        axes=first.axes,
        period=1e-3,
        method="sent",
    )
    verdict = sf.check(points, planned()[0], LIMITS)
    assert all(result.holds for result in verdict.limits.values()), verdict.problems


def test_axes_that_are_elsewhere_are_not_taken_by_surprise() -> None:
    sink = Keeper()
    sink.open = lambda axes, period, start: start + 0.5  # type: ignore[method-assign]
    with pytest.raises(StreamError, match=r"x is at .* move them there, or stream with --approach"):
        play(along(*planned()), sink, Operator(), 300)


def test_datagrams_come_numbered_and_in_order() -> None:
    with Datagrams() as there:
        state = play(along(*planned()), UdpSink(port=there.port, ahead=300), Operator(), 300)
    assert there.numbers == list(range(1, state.row + 1))


def test_a_producer_that_stalls_a_second_loses_no_row_and_goes_on_from_rest() -> None:
    stalls = [1.0]

    def seen(state: StreamState) -> None:
        if state.row > 400 and stalls:
            time.sleep(stalls.pop())

    with Datagrams() as there:
        state = play(along(*planned()), UdpSink(port=there.port, ahead=100), Operator(), 100, seen=seen)
    assert state.done
    assert 800 < state.underruns < 1500
    assert there.numbers == list(range(1, state.row + 1))
    rows = np.array(there.rows)
    broken = int(np.flatnonzero(np.array(there.numbers) > 400)[0])
    # where it held it stood on a row; what comes behind begins there, at rest
    for held in range(broken, broken + 200):
        behind = rows[held:]
        if np.max(np.abs(np.diff(np.concatenate([behind[:1]] * 3 + [behind]), 3, axis=0))) < 20000e-9 * (1 + 1e-4):
            break
    assert_limits(rows[held:])
    np.testing.assert_allclose(rows[-1], planned()[0](planned()[0].length), atol=1e-9)


def test_a_straight_way_is_planned_from_where_the_axes_are_to_the_first_row() -> None:
    sink = Keeper()
    sink.open = lambda axes, period, start: start + [-3.0, 4.0]  # type: ignore[method-assign,operator,return-value]
    motion = along(*planned())
    state = play(motion, sink, Operator(), 300, approach=lambda a, b: approach(a, b, motion.axes, LIMITS, 1e-3))
    assert state.done
    position = np.concatenate([rows.position for rows in sink.rows])
    assert [rows.first for rows in sink.rows] == list(np.cumsum([1, *map(len, sink.rows[:-1])]))
    np.testing.assert_allclose(position[0], motion.origin + [-3.0, 4.0], atol=1e-12)
    there = int(np.argmin(np.max(np.abs(position - motion.origin), axis=1)))
    assert there > 100
    way = position[: there + 1] - position[0]
    np.testing.assert_allclose(way[:, 1], -4.0 / 3.0 * way[:, 0], atol=1e-12)
    assert_limits(position)


def test_the_way_back_retraces_the_path_to_its_start_and_forward_again() -> None:
    operator = Operator()
    sink = Keeper(300, lambda: operator.obey({"reverse": True}))
    thread = threading.Timer(1.0, operator.obey, [{"hold": False, "reverse": False}])
    thread.start()
    state = play(along(*planned()), sink, operator, 300)
    assert state.done
    position = np.concatenate([rows.position for rows in sink.rows])
    turn = int(np.argmax(position[:700, 0] if position[0, 0] < position[200, 0] else -position[:700, 0]))
    assert np.any(np.all(np.abs(position[turn:] - position[0]) < 1e-12, axis=1))  # back at the start
    assert_limits(position)


def test_a_flood_of_lines_and_clients_neither_stops_the_stream_nor_changes_the_override() -> None:
    operator = Operator()
    motion = along(*planned())
    over = threading.Event()

    def flood(port: int, line: bytes) -> None:
        while not over.is_set():
            try:
                with socket.create_connection(("127.0.0.1", port), 1.0) as client:
                    for _ in range(200):
                        client.sendall(line)
            except OSError:
                continue

    with Datagrams() as there, OperatorServer(operator) as control:
        wrong = b'{"token": "0123456789abcdef", "override": 200}\n'
        lines = [wrong, b"[" * 900 + b"\n", b"x" * 5000, b'{"hold": true}\n', b"\xff\x00\n", wrong]
        threads = [threading.Thread(target=flood, args=(control.port, line)) for line in lines]
        for thread in threads:
            thread.start()
        try:
            state = play(motion, UdpSink(port=there.port, ahead=1500), operator, 1500)
        finally:
            over.set()
            for thread in threads:
                thread.join(10.0)
        # on a busy machine the last of the flood may still be there
        for _ in range(400):
            found = ask(control, b'{"token": "%s", "status": true}' % control.token.encode())
            if found:
                break
            time.sleep(0.05)
        assert found[0]["ok"], found
    assert state.done
    assert state.underruns == 0
    assert operator.wanted == 1.0
    assert there.numbers == list(range(1, state.row + 1))


def test_two_clients_are_both_obeyed_and_the_last_word_counts() -> None:
    operator = Operator()
    with OperatorServer(operator) as control:
        token = control.token.encode()
        with (
            socket.create_connection(("127.0.0.1", control.port), 5.0) as one,
            socket.create_connection(("127.0.0.1", control.port), 5.0) as two,
        ):
            for client, line in (
                (one, b'"override": 50'),
                (two, b'"override": 70, "reverse": true'),
                (one, b'"hold": true'),
            ):
                client.sendall(b'{"token": "%s", %s}\n' % (token, line))
                assert json.loads(client.makefile("rb").readline())["ok"]
        assert (operator.rate, operator.back, operator.held) == (0.7, True, True)


def ask(control: OperatorServer, *lines: bytes) -> list[dict[str, object]]:
    with socket.create_connection(("127.0.0.1", control.port), 5.0) as client, client.makefile("rb") as answers:
        found = []
        for line in lines:
            client.sendall(line + b"\n")
            answer = answers.readline()
            if not answer:
                break
            found.append(json.loads(answer))
        return found


def test_the_socket_takes_commands_with_the_token_alone() -> None:
    operator = Operator()
    with OperatorServer(operator) as control:
        assert ask(control, b'{"hold": true}') == [{"ok": False, "error": "the token is missing or wrong"}]
        assert ask(control, b'{"token": "no", "stop": true}')[0]["ok"] is False
        assert not operator.held and not operator.stopping
        token = control.token.encode()
        answers = ask(
            control,
            b'{"token": "%s", "override": 50}' % token,
            b'{"token": "%s", "override": 900}' % token,
            b'{"token": "%s", "hold": true}' % token,
            b'{"token": "%s", "jump": true}' % token,
        )
        assert [answer["ok"] for answer in answers] == [True, False, True, False]
        assert operator.rate == 0.5 and operator.held and operator.wanted == 0.0


@pytest.mark.parametrize("line", [b"", b"[1]", b"{", b'{"token": 1}', b"\xff\xfe", b"[" * 2000, b'"' + b"x" * 3000])
def test_lines_that_are_no_commands_change_nothing(line: bytes) -> None:
    operator = Operator()
    with OperatorServer(operator) as control:
        answers = ask(control, line)
        assert not answers or answers[0]["ok"] is False
        assert operator.wanted == 1.0
        assert len(line) > LONGEST_LINE or ask(control, b"{}")[0]["ok"] is False  # it goes on serving


def test_an_override_out_of_range_is_refused() -> None:
    with pytest.raises(InputError, match="from 0 to 200 %"):
        Operator().obey({"override": 250})


def test_silent_and_slow_connections_do_not_lock_the_operator_out() -> None:
    operator = Operator()
    with OperatorServer(operator) as control, contextlib.ExitStack() as stack:
        there = "127.0.0.1", control.port
        silent = [stack.enter_context(socket.create_connection(there, 5.0)) for _ in range(100)]
        token = control.token.encode()
        held = [stack.enter_context(socket.create_connection(there, 5.0)) for _ in range(MOST_CLIENTS)]
        for client in held:
            client.sendall(b'{"token": "%s", "status": true}\n' % token)
            assert json.loads(client.recv(1000))["ok"]
        begin = time.monotonic()
        assert ask(control, b'{"token": "%s", "override": 50}' % token)[0]["ok"]
        assert time.monotonic() - begin < 5.0 and operator.rate == 0.5
        # what says nothing, or letter by letter, is gone after the time that a token has
        slow = stack.enter_context(socket.create_connection(there, 5.0))
        with contextlib.suppress(OSError):
            for _ in range(80):
                slow.sendall(b" ")
                time.sleep(0.1)
        slow.settimeout(5.0)
        with contextlib.suppress(ConnectionError):
            assert slow.recv(10) == b""
        for client in silent:
            client.settimeout(5.0)
            with contextlib.suppress(ConnectionError):
                assert client.recv(10) == b""
        held[0].sendall(b'{"token": "%s", "override": 70}\n' % token)
        assert json.loads(held[0].recv(1000))["ok"] and operator.rate == 0.7
