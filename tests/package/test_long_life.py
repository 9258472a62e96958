"""A process that lives long: its memory, its threads, and processes that it starts after use."""

from __future__ import annotations

import gc
import multiprocessing
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000)
#: Paths and strategies that threads plan at once.
TASKS = [(radius, strategy) for radius in (1.5, 2.0, 2.5, 3.0) for strategy in ("seven-phase", "time-optimal")]


def resident() -> int:
    """Bytes of memory that this process holds."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def planned(task: tuple[float, str]) -> bytes:
    """The bits of a law and its setpoints."""
    radius, strategy = task
    path = sf.shapes.circle(radius)
    law = sf.plan(path, LIMITS, strategy=strategy, period=1e-3)
    points = sf.interpolate(path, law)
    return b"".join(each.tobytes() for each in (law.breaks, law.coefficients, points.position, points.feed))


def test_eight_threads_plan_the_same_bits_as_one() -> None:
    alone = [planned(task) for task in TASKS]
    with ThreadPoolExecutor(8) as pool:
        for _ in range(3):
            assert list(pool.map(planned, TASKS)) == alone


@pytest.mark.skipif(sys.platform != "linux", reason="as Linux has it")
@pytest.mark.parametrize("way", ["fork", "spawn"])
def test_processes_that_begin_after_use_plan_the_same_bits(way: str, tmp_path: Path) -> None:
    alone = planned(TASKS[0])
    points = sf.interpolate(sf.shapes.circle(2.0), sf.plan(sf.shapes.circle(2.0), LIMITS, period=1e-3))
    sf.save(points, tmp_path / "p.h5")
    assert len(sf.load(tmp_path / "p.h5", sf.Setpoints)) == len(points)  # its process runs
    with multiprocessing.get_context(way).Pool(2) as pool:
        assert pool.map(planned, [TASKS[0]] * 4) == [alone] * 4
        assert pool.map(ticks, [str(tmp_path / "p.h5")] * 4) == [len(points)] * 4
    assert ticks(str(tmp_path / "p.h5")) == len(points)


def ticks(file: str) -> int:
    """How many setpoints a file holds."""
    return len(sf.load(file, sf.Setpoints))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="as Linux has it")
def test_memory_stays_over_five_hundred_runs() -> None:
    def run(k: int) -> None:
        made = sf.run(sf.shapes.circle(1.5 + 0.01 * (k % 50)), LIMITS, period=1e-3)
        assert made.ok and np.isfinite(made.points.position).all()

    for k in range(100):
        run(k)
    before = resident()
    for k in range(400):
        run(k)
    assert resident() < 1.05 * before
