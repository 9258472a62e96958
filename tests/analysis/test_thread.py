"""The line of a motion of any length: no cell is drawn twice, none is left out, memory stays."""

from __future__ import annotations

import numpy as np

from splinefeed.analysis import thinning
from splinefeed.analysis.thinning import Thread


def turns(count: int, start: int = 0) -> np.ndarray:
    """Points (count, 2) of a circle of 10 mm, a thousand a turn."""
    angle = 2 * np.pi * (start + np.arange(count)) / 1000
    return 10 * np.column_stack([np.cos(angle), np.sin(angle)])


def test_the_same_way_again_adds_nothing():
    thread = Thread(np.full(2, -10.37), np.full(2, 10.11))
    assert thread.line.shape == (0, 2)
    thread.see(turns(1001))
    once = thread.line
    cell = 20.48 / thinning.THREAD_CELLS
    gaps = np.min(np.linalg.norm(turns(1000)[:, None] - once[None], axis=2), axis=1)
    assert np.max(gaps) <= 2 * cell
    for start in (1001, 1500, 3000):
        thread.see(turns(2000, start))
    assert np.array_equal(thread.line, once, equal_nan=True)


def test_a_branch_begins_where_it_leaves_what_is_drawn():
    thread = Thread(np.zeros(2), np.full(2, 100.0))
    x = np.linspace(0, 100, 2001)
    thread.see(np.column_stack([x, np.zeros(2001)]))
    thread.see(np.column_stack([x[::-1], np.zeros(2001)]))
    thread.see(np.column_stack([np.zeros(2001), x]))
    breaks = np.flatnonzero(np.isnan(thread.line[:, 0]))
    assert len(breaks) == 1
    cell = 100.0 / thinning.THREAD_CELLS
    assert np.max(np.abs(thread.line[breaks[0] + 1])) <= 2 * cell


def test_cells_double_when_there_are_too_many(monkeypatch):
    monkeypatch.setattr(thinning, "MOST_CELLS", 50)
    thread = Thread(np.zeros(3), np.full(3, 64.0))
    x = np.linspace(0, 64, 4001)[:, None] * np.ones(3)
    for part in np.array_split(x, 9):
        thread.see(part)
    line = thread.line
    assert len(line) < 600
    assert np.max(np.abs(np.diff(line, axis=0)), where=np.isfinite(np.diff(line, axis=0)), initial=0.0) < 64 / 10
    assert np.nanmax(line) > 60
