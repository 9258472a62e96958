"""Streams: how fast rows are made, what streaming costs, how soon the override takes effect, and ten hours of rows."""

from __future__ import annotations

import json
import math
import os
import resource
import socket
import statistics
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

import splinefeed as sf
from benchmarks import cases, child
from benchmarks.hal_session import hal_session
from benchmarks.tables import Column, Headline, Report, Table
from splinefeed.live.hal_files import HalAxis, hal_text
from splinefeed.live.linuxcnc_sink import LinuxcncSink, installed
from splinefeed.live.motion import Motion, along
from splinefeed.live.operator import Operator, OperatorServer
from splinefeed.live.sinks import SetpointRows, Taken, UdpSink
from splinefeed.live.stream import StreamState, play
from splinefeed.planner.override.reserve import with_reserve

PERIOD, AHEAD = 1e-3, 300
LIMITS = sf.Limits(feed=60.0, axis_acceleration=500.0, axis_jerk=20000.0)
#: Rows of the throughput run, s of streaming in real time, turns of the operator, hours of the long stream.
ROWS, STREAMED, TURNS, HOURS = 300_000, 20.0, 1000, 10
#: Promised: times real time, share of a core, what a plan keeps growing by, bytes.
TIMES_REAL, CORE, GROWTH = 200.0, 0.03, 10e6


class Nowhere:
    """A sink that forgets."""

    paced = False

    def __init__(self) -> None:
        self.row = 0

    def open(self, axes: tuple[str, ...], period: float, start: Any) -> Any:
        return start

    def write(self, rows: SetpointRows) -> None:
        self.row = rows.first + len(rows) - 1

    def depth(self) -> int:
        return 0

    def restart(self) -> None:
        pass

    def abandon(self) -> None:
        pass

    def taken(self) -> Taken:
        return Taken(self.row)

    close = taken


#: OperatorServer points at both ends of a lap that lie in the plane.
FLAT = 4


def laps(seconds: float, axes: int = 2) -> Motion:
    """Butterflies in a row that last so long at 100 %; the third axis goes up and down along them."""
    lap = cases.butterfly()
    count = max(1, math.ceil(seconds / 9.0))
    curves = list(lap.curves) * count
    if axes == 3:
        spline = curves[0]
        height = 5.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, len(spline.control_points)))
        height[:FLAT] = height[-FLAT:] = 0.0  # curvature does not jump from lap to lap
        points = np.column_stack([spline.control_points, height])
        curves = [sf.NurbsCurve(spline.degree, spline.knots, points, spline.weights)] * count
    path = sf.Path(curves, axes=("x", "y", "z")[:axes], tolerance=0.01)
    return along(
        path, sf.plan(path, with_reserve(LIMITS), strategy="look-ahead", period=PERIOD), sf.Limits(**LIMITS_AT_200)
    )


LIMITS_AT_200 = {"feed": 120.0, "axis_acceleration": 500.0, "axis_jerk": 20000.0}


def throughput(text: bool) -> dict[str, float]:
    """Rows a second of processor time with an override that changes all the time, three axes."""
    motion = laps(ROWS * PERIOD, axes=3)
    rng = np.random.default_rng(1)
    motion.take(1, 1.0)
    start, rows = time.process_time(), 0
    while rows < ROWS and not motion.done:
        points = motion.take(256, rng.uniform(0.3, 2.0))
        if text:
            SetpointRows(rows + 1, points, motion.axes).text()
        rows += len(points)
    return {"rows": rows, "seconds": time.process_time() - start}


def processor_share(linuxcnc: bool) -> dict[str, float]:
    """Share of a core that streaming in real time takes, all of its processes, behind the first second."""
    motion = laps(STREAMED + 10.0)
    operator = Operator()
    marks: list[tuple[float, float]] = []

    def used() -> float:
        own = resource.getrusage(resource.RUSAGE_SELF)
        return own.ru_utime + own.ru_stime + (_of_child(sink) if linuxcnc else 0.0)

    def seen(state: StreamState) -> None:
        if (not marks and state.confirmed > 1.0 / PERIOD) or (marks and state.confirmed > STREAMED / PERIOD):
            marks.append((time.monotonic(), used()))
        if len(marks) > 1:
            operator.obey({"stop": True})

    if linuxcnc:
        with hal_session(hal_text((HalAxis("x"), HalAxis("y")), PERIOD)) as home:
            sink: Any = LinuxcncSink(AHEAD, home=home)
            state = play(motion, sink, operator, AHEAD, here=True, seen=seen)
    else:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
            listener.bind(("127.0.0.1", 0))
            sink = UdpSink(port=listener.getsockname()[1], ahead=AHEAD)
            state = play(motion, sink, operator, AHEAD, seen=seen)
    (begin, first), (end, last) = marks[0], marks[1]
    return {"share": (last - first) / (end - begin), "underruns": state.underruns}


def _of_child(sink: LinuxcncSink) -> float:
    """Processor time of the player in LinuxCNC's Python, s."""
    assert sink._child is not None
    words = Path(f"/proc/{sink._child.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def reactions(ahead: int, turns: int) -> dict[str, list[float]]:
    """Seconds from a line on the socket to the tick of the first row that obeys, and to the new rate."""
    motion, operator = laps(turns * 0.35 + 20.0), Operator()
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listener.bind(("127.0.0.1", 0))
    sink = UdpSink(port=listener.getsockname()[1], ahead=ahead)
    answers: list[float] = []
    lands: list[float] = []
    run = motion.override.run
    log: list[tuple[float, np.ndarray]] = []

    def logged(wanted: Any) -> Any:
        ticks = run(wanted)
        log.append((time.monotonic(), ticks.rate))
        return ticks

    motion.override.run = logged  # type: ignore[method-assign]

    def due(row: int) -> float:
        with sink._lock:
            assert sink._next is not None
            return sink._next + (row - sink._taken - 1) * PERIOD

    def turn() -> None:
        try:
            with socket.create_connection(("127.0.0.1", control.port), 10.0) as client, client.makefile("rb") as lines:
                time.sleep(1.0)
                for k in range(turns):
                    before, wanted = motion.override.rate, (0.6, 0.9)[k % 2]
                    begin = len(log)
                    row = sum(len(rate) for _, rate in log[:begin]) + 1
                    sent = time.monotonic()
                    client.sendall(json.dumps({"token": control.token, "override": 100.0 * wanted}).encode() + b"\n")
                    lines.readline()
                    end = time.monotonic() + 5.0
                    answered = False
                    place = begin
                    while time.monotonic() < end:
                        while place < len(log):
                            rate = log[place][1]
                            changed = np.flatnonzero(rate != before)
                            if not answered and len(changed):
                                answers.append(due(row + int(changed[0]) + 1) - sent)
                                answered = True
                            there = np.flatnonzero(rate == wanted)
                            if len(there):
                                lands.append(due(row + int(there[0]) + 1) - sent)
                                end = 0.0
                                break
                            row += len(rate)
                            place += 1
                        time.sleep(0.001)
        finally:
            operator.obey({"stop": True})

    with OperatorServer(operator) as control:
        thread = threading.Thread(target=turn)
        thread.start()
        play(motion, sink, operator, ahead)
        thread.join()
    listener.close()
    return {"answers": answers, "lands": lands}


def long_stream() -> dict[str, float]:
    """Memory after one hour of rows and after all hours, without a clock, at an override of about 10 %."""
    motion, operator = laps(HOURS * 420.0), Operator(0.1)  # more than ten hours at a tenth of the feed
    rng = np.random.default_rng(2)
    hour = round(3600.0 / PERIOD)
    memory: list[int] = []

    def seen(state: StreamState) -> None:
        if state.row % 100_000 < 256:
            operator.obey({"override": rng.uniform(8.0, 12.0)})
        if state.row >= hour * (1 if not memory else HOURS) and len(memory) < 2:
            memory.append(_resident())
        if len(memory) > 1:
            operator.obey({"stop": True})

    start = time.process_time()
    state = play(motion, Nowhere(), operator, AHEAD, seen=seen)
    return {
        "rows": state.row,
        "seconds": time.process_time() - start,
        "first": memory[0],
        "last": memory[1],
    }


def _resident() -> int:
    """Memory of this process now, bytes."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))


def measure() -> Report:
    """Everything, each in a process of its own."""
    made = {text: child.outcome("live", "throughput", text) for text in (False, True)}
    rates = {text: each["rows"] / each["seconds"] for text, each in made.items()}
    shares = {"UDP": child.outcome("live", "processor_share", False)}
    if installed():
        shares["LinuxCNC's HAL, its player included"] = child.outcome("live", "processor_share", True)
    answered = {ahead: child.outcome("live", "reactions", ahead, TURNS) for ahead in (AHEAD, 50)}
    long = child.outcome("live", "long_stream")
    rows = Table(
        "Rows made, override changed every 256 rows, three axes, one core.",
        (Column("what"), Column("rows a second", ",.0f"), Column("times real time at 1 ms", ",.0f")),
        tuple(
            ("with the text that HAL gets" if text else "positions", rate, rate * PERIOD)
            for text, rate in rates.items()
        ),
    )
    cost = Table(
        "Streaming in real time, two axes, 1 ms.",
        (Column("into"), Column("share of a core, %", ".2f"), Column("underruns", "d")),
        tuple((name, 100.0 * each["share"], each["underruns"]) for name, each in shares.items()),
    )
    operator = Table(
        f"From a line on the socket to the tick of the first row that obeys, {TURNS:,} changes between 60 and 90 %.",
        (
            Column("rows ahead", "d"),
            Column("begins, median, ms", ".1f"),
            Column("begins, worst, ms", ".1f"),
            Column("at the new feed, median, ms", ".0f"),
            Column("at the new feed, worst, ms", ".0f"),
        ),
        tuple(
            (
                ahead,
                1e3 * statistics.median(each["answers"]),
                1e3 * max(each["answers"]),
                1e3 * statistics.median(each["lands"]),
                1e3 * max(each["lands"]),
            )
            for ahead, each in answered.items()
        ),
    )
    grown = long["last"] - long["first"]
    hours = Table(
        "A long stream, without a clock.",
        (
            Column("rows", ",d"),
            Column("s", ".0f"),
            Column("memory after an hour, MB", ".1f"),
            Column(f"after {HOURS} hours, MB", ".1f"),
        ),
        ((long["rows"], long["seconds"], long["first"] / 1e6, long["last"] / 1e6),),
        ("Butterflies in a row at an override of about 10 %, which changes every 100,000 rows.",),
    )
    worst = max(each["share"] for each in shares.values())
    first = answered[AHEAD]["answers"]
    return Report(
        (rows, cost, operator, hours),
        (
            Headline(
                "rows of a stream, override changed all the time, three axes",
                f"{rates[False] * PERIOD:,.0f} times real time; {rates[True] * PERIOD:,.0f} with HAL's text",
                f"{TIMES_REAL:g} times",
                rates[False] * PERIOD >= TIMES_REAL,
            ),
            Headline(
                "processor while streaming one machine at 1 ms",
                f"{100.0 * worst:.1f} %",
                f"{100.0 * CORE:g} %",
                worst < CORE,
            ),
            Headline(
                f"from a change of the override to the first tick that obeys, {AHEAD} ms ahead",
                f"{1e3 * statistics.median(first):.0f} ms median, {1e3 * max(first):.0f} ms worst of {len(first):,}",
            ),
            Headline(
                f"memory of a stream of {HOURS} hours behind its first",
                f"{grown / 1e6:+.1f} MB at {long['last'] / 1e6:.0f} MB",
                "flat",
                grown < GROWTH,
            ),
        ),
    )
