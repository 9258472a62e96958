"""Pulses over whole paths: within a pulse of the setpoint after every period, whatever the path."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import splinefeed as sf
from splinefeed.errors import InputError
from splinefeed.formats.bit_pattern import decode, encode
from splinefeed.machine import Machine
from splinefeed.records import Setpoints
from splinefeed.runs.pulses import per_degree, pulse_words, pulses_of


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
)
def test_no_pulse_is_lost_or_added_over_a_long_path(seed, move, count, offset, drift):
    """3000 ticks of 1 to 6 axes, from anywhere, to and fro or one way: counted from the bits themselves."""
    rng = np.random.default_rng(seed)
    axes = ("x", "y", "z", "a", "b", "theta")[:count]
    scale = rng.uniform(1.0, 5000.0, count)
    steps = MOVES[move] * (rng.normal(size=(3000, count)) + drift)
    position = offset + np.cumsum(steps, axis=0) / scale
    pattern, numbers = pulse_words(setpoints(position, axes), dict(zip(axes, scale, strict=True)))
    counts = np.rint(position * scale)
    fastest = numbers["fastest"]
    assert fastest["pulses"] == np.max(np.abs(np.diff(counts, axis=0)))
    if fastest["pulses"]:
        assert abs(np.diff(counts[:, axes.index(fastest["axis"])])[fastest["tick"]]) == fastest["pulses"]
    bits = np.unpackbits(pattern.words.view(np.uint8), axis=-1).sum(axis=-1).astype(int)
    at = counts[0] + np.cumsum(bits[:, :, 0] - bits[:, :, 1], axis=0)
    assert np.all(np.abs(at - position[1:] * scale) < 1.0)
    assert len(pattern) == 2999
    assert numbers["off_max_pulses"] <= 0.5 + 1e-6
    sent = [numbers["pulses_plus"][a] - numbers["pulses_minus"][a] for a in axes]
    assert sent == (counts[-1] - counts[0]).tolist()


def test_a_closed_path_comes_back_to_its_start():
    path = sf.shapes.circle(radius=12.3)
    law = sf.plan(path, sf.Limits(feed=60, acceleration=500, jerk=20_000), period=1e-3)
    points = sf.interpolate(path, law, period=1e-3)
    scales = pulses_of(Machine.load("xytheta"), points.axes)
    assert scales["x"] == pytest.approx(4000.0)
    pattern, numbers = pulse_words(points, scales)
    assert numbers["fastest"]["rate_hz"] <= 60.0 * 4000.0 * 1.001
    found = decode(pattern)
    np.testing.assert_array_equal(found[0], found[-1])
    with pytest.raises(InputError, match="pulses are needed before the next tick"):
        encode(points, scales, pattern.slots_per_period - 16)


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
        pulse_words(setpoints(np.zeros((0, 1)), ("x",)), {"x": 1.0})
