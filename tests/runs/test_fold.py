"""One pass over chunks: every meter sees every tick once, however the motion is cut."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.runs import run as runs
from splinefeed.runs.fold import NEIGHBOURS, Chunk, fold, on_one_path

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000)


class Counter:
    """Counts what it is shown."""

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.t: list[np.ndarray] = []
        self.around: list[int] = []

    def start(self, chunk: Chunk) -> None:
        self.calls.append("start")

    def feed(self, chunk: Chunk) -> None:
        assert np.array_equal(chunk.around.t[chunk.inner], chunk.own.t)
        self.calls.append("feed")
        self.t.append(chunk.own.t)
        self.around.append(len(chunk.around) - len(chunk.own))

    def finish(self) -> None:
        self.calls.append("finish")


@pytest.mark.parametrize("cut", [1, 7, 400, 10**6])
def test_every_tick_is_seen_once(cut):
    path = sf.shapes.from_text("circle")
    law = sf.plan(path, LIMITS, period=5e-3)
    counter = Counter()
    count = fold(on_one_path(sf.interpolate(path, law, chunk=cut), path, law), [counter])
    whole = sf.interpolate(path, law)
    assert count == len(whole)
    assert np.array_equal(np.concatenate(counter.t), whole.t)
    assert counter.calls == ["start", *["feed"] * (len(counter.calls) - 2), "finish"]
    if cut >= NEIGHBOURS and len(counter.around) > 2:
        assert set(counter.around[1:-1]) == {2 * NEIGHBOURS}


def test_no_setpoints_are_said():
    path = sf.shapes.from_text("circle")
    with pytest.raises(sf.errors.InputError, match="there are no setpoints to measure"):
        fold(on_one_path(iter([]), path, sf.plan(path, LIMITS)), [])


def test_a_chunk_of_rapid_moves_alone_has_the_same_limits(monkeypatch):
    """A chunk in which no feed is said names the limit of the feed as all others do."""
    monkeypatch.setattr(runs, "CHUNK", 50)
    path = sf.Path.polyline([[0, 0], [40, 0], [40, 30]], ("x", "y"), feeds=[np.inf, 10.0])
    limits = sf.Limits(axis_velocity=100, axis_acceleration=500, axis_jerk=20000)
    run = sf.run(path, limits)
    assert run.ticks > 200
    assert run.use.names[0] == "feed"
    assert run.use.share.shape == (run.ticks, len(run.use.names))


def test_further_meters_see_the_run():
    counter = Counter()
    run = sf.run(sf.shapes.butterfly(), LIMITS, meters=[counter])
    assert np.array_equal(np.concatenate(counter.t), run.points.t)
