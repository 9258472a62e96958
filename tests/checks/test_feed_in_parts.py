"""A feed that a program gives after a long run of rapid moves is checked, and binds, as one that it begins with."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.checks.check import Check


@pytest.fixture(scope="module")
def parts() -> list[sf.Path]:
    # 20,000 ticks of the first: more than a block
    rapid, milled = (sf.Path.polyline([[x, 0], [x + 3000, 0]]).curves for x in (0, 3000))
    return [sf.Path(rapid, feeds=[np.inf]), sf.Path(milled, feeds=[10.0])]


def verdict_of(parts: list[sf.Path], feed: float) -> sf.Verdict:
    """Of a motion that drives the second part at `feed`, mm/s."""
    limits, period = sf.Limits(axis_velocity=200, axis_acceleration=2000, axis_jerk=50000), 1e-3
    check = Check(limits)

    def chunks() -> Iterator[sf.Setpoints]:
        begin, length = 0, 0.0
        for k, part in enumerate(parts):
            own = replace(limits, feed=feed if k else 150.0)
            part = sf.Path(part.curves)
            each = sf.interpolate(part, sf.plan(part, own, period=period), period=period)
            t = (begin + np.arange(len(each))) * period
            each = replace(each, t=t, s=each.s + length, curve=each.curve + k)
            yield each if k else each.part(0, len(each) - 1)  # where one part ends, the next begins
            begin, length = begin + len(each) - 1, length + part.length

    for part in parts:
        check.part(part)
    for chunk in chunks():
        check.see(chunk)
    return check.verdict()


def test_a_feed_that_comes_behind_rapid_moves_is_checked(parts: list[sf.Path]) -> None:
    assert verdict_of(parts, 10.0).ok
    assert not verdict_of(parts, 20.0).limits["feed"].holds
