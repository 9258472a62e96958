"""Pulses over whole paths: within a pulse of the setpoint after every period, whatever the path."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import splinefeed as sf
from splinefeed.errors import InputError
from splinefeed.formats.bit_pattern import decode, encode
from splinefeed.machine import Machine
from splinefeed.pipeline.pulses import Tally, encoded, per_degree, pulses_of, survey
from splinefeed.records import Setpoints


def setpoints(position, axes, first=0):
    position = np.asarray(position, dtype=float)
    n = len(position)
    nothing = np.zeros(n)
    return Setpoints(
        t=(first + np.arange(n)) * 1e-3,
        curve=nothing.astype(int),
        u=nothing,
        s=nothing,
        feed=nothing,
        position=position,
        axes=axes,
        period=1e-3,
        method="test",
    )


def pieces(points, *cuts):
    ends = [0, *sorted(cuts), len(points)]
    for a, b in pairwise(ends):
        if b > a:
            yield setpoints(points.position[a:b], points.axes, a)


MOVES = {
    "tiny": 1e-4,  # in pulses a tick: hours of nothing, then one pulse
    "slow": 0.3,
    "fast": 40.0,
}


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    move=st.sampled_from(sorted(MOVES)),
    count=st.integers(1, 6),
    offset=st.floats(-1e4, 1e4),
    drift=st.sampled_from([-1.0, 0.0, 1.0]),
    cuts=st.lists(st.integers(1, 2999), max_size=4),
)
def test_no_pulse_is_lost_or_added_over_a_long_path(seed, move, count, offset, drift, cuts):
    """3000 ticks of 1 to 6 axes, from anywhere, to and fro or one way: counted from the bits themselves."""
    rng = np.random.default_rng(seed)
    axes = ("x", "y", "z", "a", "b", "theta")[:count]
    scale = rng.uniform(1.0, 5000.0, count)
    steps = MOVES[move] * (rng.normal(size=(3000, count)) + drift)
    position = offset + np.cumsum(steps, axis=0) / scale
    points = setpoints(position, axes)
    scales = dict(zip(axes, scale, strict=True))
    asked = survey(pieces(points, *cuts), scales)
    counts = np.rint(position * scale)
    assert asked.fastest == np.max(np.abs(np.diff(counts, axis=0)))
    if asked.fastest:
        i = axes.index(asked.axis)
        assert abs(np.diff(counts[:, i])[asked.at]) == asked.fastest
    tally = Tally()
    done = np.array(counts[0])
    for pattern in encoded(pieces(points, *cuts), scales, asked.slots, tally):
        bits = np.unpackbits(pattern.words.view(np.uint8), axis=-1).sum(axis=-1).astype(int)
        at = done + np.cumsum(bits[:, :, 0] - bits[:, :, 1], axis=0)
        wanted = position[pattern.first + 1 : pattern.first + 1 + len(pattern)] * scale
        assert np.all(np.abs(at - wanted) < 1.0)
        done = at[-1] if len(at) else done
    assert tally.periods == 2999
    assert tally.off <= 0.5 + 1e-6
    assert [tally.plus[a] - tally.minus[a] for a in axes] == (counts[-1] - counts[0]).tolist()


def test_a_closed_path_comes_back_to_its_start():
    path = sf.shapes.circle(radius=12.3)
    law = sf.plan(path, sf.Limits(feed=60, acceleration=500, jerk=20_000), period=1e-3)
    points = sf.interpolate(path, law, period=1e-3)
    scales = pulses_of(Machine.load("xytheta"), points.axes)
    assert scales["x"] == pytest.approx(4000.0)
    asked = survey([points], scales)
    assert asked.rate <= 60.0 * 4000.0 * 1.001
    found = decode(encode(points, scales, asked.slots))
    np.testing.assert_array_equal(found[0], found[-1])
    with pytest.raises(InputError, match="pulses are needed before the next tick"):
        encode(points, scales, asked.slots - 16)


def test_scales_of_machines():
    assert per_degree(pulses_of(Machine.load("xytheta"), ("theta",)))["theta"] == pytest.approx(20000 * 5 / 360)
    with pytest.raises(InputError) as caught:
        pulses_of(Machine.load("lintable"), ("x",))
    assert str(caught.value) == (
        "machine 'lintable': axis x has no encoder to take pulses from; give them yourself, such as --pulses x=1000"
    )
    with pytest.raises(InputError, match="machine 'xytheta' has no axis 'z'; its axes are x, y, theta"):
        pulses_of(Machine.load("xytheta"), ("z",))
    with pytest.raises(InputError, match="there are no setpoints"):
        survey([], {"x": 1.0})
