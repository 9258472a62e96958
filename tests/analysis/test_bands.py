"""Bands over time: the least and the greatest of blocks, both edges included, whatever the pieces that they come in."""

from __future__ import annotations

import numpy as np
import pytest

from splinefeed.analysis.bands import Bands
from splinefeed.analysis.thinning import Kept


@pytest.mark.parametrize("count", [1, 2, 7, 8, 9, 63, 64, 65, 1000])
@pytest.mark.parametrize("seed", range(4))
def test_each_block_has_the_least_and_the_greatest_up_to_the_first_tick_of_the_next(count, seed):
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.random(count))
    one, two = rng.normal(size=count), rng.normal(size=(count, 2))
    two[rng.random(two.shape) < 0.05] = np.nan
    bands = Bands(most=8)
    for part in np.split(np.arange(count), np.sort(rng.integers(0, count + 1, 5))):
        bands.see(t[part], {"one": (one[part] - 0.5, one[part] + 0.5), "two": (two[part], two[part])})
    found, size = bands.finish(), bands.size
    assert -(-count // size) <= 8
    assert size == 1 or -(-count // (size // 2)) > 8
    starts = np.arange(0, count, size)
    assert np.array_equal(found["two"].edges, np.append(t[starts], t[-1]))
    for name, low, high in (("one", one[:, None] - 0.5, one[:, None] + 0.5), ("two", two, two)):
        for k, start in enumerate(starts):
            rows = slice(start, start + size + 1)
            assert np.array_equal(found[name].low[k], np.fmin.reduce(low[rows]).astype(np.float32), equal_nan=True)
            assert np.array_equal(found[name].high[k], np.fmax.reduce(high[rows]).astype(np.float32), equal_nan=True)


def test_what_is_kept_whole_has_no_bands():
    kept = Kept(most=100)
    t = np.arange(60.0)
    kept.see({"t": t}, {"y": t})
    assert kept.bands() == {}
    kept.see({"t": 60.0 + t}, {"y": 60.0 + t})
    band = kept.bands()["y"]
    assert len(kept.column("t")) < 120
    assert band.low.min() == 0.0
    assert band.high.max() == 119.0
