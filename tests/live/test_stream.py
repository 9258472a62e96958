"""The stream: rows in order, a stop on the path, a resume, and a socket that takes no orders from strangers."""

from __future__ import annotations

import json
import socket
import struct
import threading
from functools import cache
from pathlib import Path as File

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import InputError
from splinefeed.feed.reserve import with_reserve
from splinefeed.live.control import LONGEST_LINE, Control
from splinefeed.live.knob import Knob
from splinefeed.live.motion import along
from splinefeed.live.sink import Rows, Taken
from splinefeed.live.stream import StreamError, play
from splinefeed.live.text_sink import FileSink
from splinefeed.live.udp_sink import HEAD, UdpSink
from splinefeed.records import Array, Setpoints

LIMITS = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)


@cache
def planned() -> tuple[sf.Path, sf.TimeLaw, sf.Limits]:
    path = sf.shapes.from_text("naca:0025?perimeter=33")
    return path, sf.plan(path, with_reserve(LIMITS), "time-optimal", 1e-3), LIMITS


class Keeper:
    """A sink that remembers, and turns the knob at a row."""

    paced = False

    def __init__(self, at: int = 0, turn=lambda: None) -> None:  # type: ignore[no-untyped-def]
        self.rows: list[Rows] = []
        self._at, self._turn = at, turn

    def open(self, axes: tuple[str, ...], period: float, start: Array) -> Array:
        return start

    def write(self, rows: Rows) -> None:
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
    state = play(motion, FileSink(tmp_path / "rows.txt"), Knob(), 300)
    table = np.loadtxt(tmp_path / "rows.txt")
    np.testing.assert_array_equal(table[:, 0], np.arange(1, state.row + 1))
    points = sf.interpolate(planned()[0], planned()[1], method="arc-length")
    assert len(table) == len(points) + 1
    np.testing.assert_allclose(table[:-1, 1:3], points.position, atol=1e-11)
    np.testing.assert_array_equal(table[-1, 1:3], table[-2, 1:3])
    np.testing.assert_array_equal(table[-3:, 3], [0, 1, 1])


def test_a_stop_rests_on_the_path_and_a_resume_goes_on_to_the_end() -> None:
    knob = Knob()
    first, second = along(*planned()), None
    sink = Keeper(300, knob.stop)
    state = play(first, sink, knob, 300)
    assert not state.done
    assert 0.2 < state.tau < first.duration
    second = along(*planned(), tau=state.confirmed_tau)
    more = Keeper()
    assert play(second, more, Knob(), 300).done
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
        play(along(*planned()), sink, Knob(), 300)


def test_datagrams_come_numbered_and_in_order() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        listener.settimeout(5.0)
        found: list[tuple[int, int]] = []

        def listen() -> None:
            while not found or found[-1][1] == 0 or len(found) < 2 or found[-2][1] == 0:
                data = listener.recv(1000)
                _, number, last, axes = HEAD.unpack(data[: HEAD.size])
                struct.unpack(f"!{axes}d", data[HEAD.size :])
                found.append((number, last))

        thread = threading.Thread(target=listen)
        thread.start()
        state = play(along(*planned()), UdpSink(port=listener.getsockname()[1]), Knob(), 300)
        thread.join(10.0)
    assert [number for number, _ in found] == list(range(1, state.row + 1))


def ask(control: Control, *lines: bytes) -> list[dict[str, object]]:
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
    knob = Knob()
    with Control(knob) as control:
        assert ask(control, b'{"hold": true}') == [{"ok": False, "error": "the token is missing or wrong"}]
        assert ask(control, b'{"token": "no", "stop": true}')[0]["ok"] is False
        assert not knob.held and not knob.stopping
        token = control.token.encode()
        answers = ask(
            control,
            b'{"token": "%s", "override": 50}' % token,
            b'{"token": "%s", "override": 900}' % token,
            b'{"token": "%s", "hold": true}' % token,
            b'{"token": "%s", "jump": true}' % token,
        )
        assert [answer["ok"] for answer in answers] == [True, False, True, False]
        assert knob.rate == 0.5 and knob.held and knob.wanted == 0.0


@pytest.mark.parametrize("line", [b"", b"[1]", b"{", b'{"token": 1}', b"\xff\xfe", b"[" * 2000, b'"' + b"x" * 3000])
def test_lines_that_are_no_commands_change_nothing(line: bytes) -> None:
    knob = Knob()
    with Control(knob) as control:
        answers = ask(control, line)
        assert not answers or answers[0]["ok"] is False
        assert knob.wanted == 1.0
        assert len(line) > LONGEST_LINE or ask(control, b"{}")[0]["ok"] is False  # it goes on serving


def test_an_override_out_of_range_is_refused() -> None:
    with pytest.raises(InputError, match="from 0 to 200 %"):
        Knob().set_rate(2.5)
