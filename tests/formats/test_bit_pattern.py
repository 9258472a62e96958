"""Pulse words: every pulse once, evenly spread, back to the rounded setpoints, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import motions
import splinefeed as sf
from splinefeed.errors import InputError, LimitsError
from splinefeed.formats import bit_pattern
from splinefeed.formats.bit_pattern import decode, encode
from splinefeed.records import Setpoints


def setpoints(position, axes=("x", "y"), first=0, period=1e-3):
    position = np.asarray(position, dtype=float)
    n = len(position)
    return Setpoints(
        t=(first + np.arange(n)) * period,
        curve=np.zeros(n),
        u=np.zeros(n),
        s=np.zeros(n),
        feed=np.zeros(n),
        position=position,
        axes=axes,
        period=period,
        method="test",
    )


def slots_of(pattern):
    """1, 0 or -1 of each slot in the order in which it is sent, (periods, axes, slots): the definition, spelled out."""
    words = pattern.words.astype(np.int64)
    bits = (words[..., None] >> np.arange(16)) & 1
    assert not np.any(bits[:, :, 0] & bits[:, :, 1])
    signed = bits[:, :, 0] - bits[:, :, 1]
    return signed.reshape(*signed.shape[:2], pattern.slots_per_period)


@pytest.mark.nojit
def test_bit_0_is_sent_first_and_pulses_stand_in_the_middle_of_their_share():
    """16 slots: one pulse in slot 8, two in 4 and 12, four in 2, 6, 10, 14, sixteen in all."""
    pattern = encode(setpoints([[0, 0], [1, -1], [3, -3], [7, -7], [23, -23], [23, -23]]), {"x": 1, "y": 1}, 16)
    expected = [1 << 8, 1 << 4 | 1 << 12, 1 << 2 | 1 << 6 | 1 << 10 | 1 << 14, 0xFFFF, 0]
    assert pattern.words[:, 0, 0, 0].tolist() == expected
    assert pattern.words[:, 1, 1, 0].tolist() == expected
    assert not pattern.words[:, 0, 1].any()
    assert not pattern.words[:, 1, 0].any()
    assert pattern.words.dtype == np.uint16
    assert (len(pattern), pattern.slots_per_period, pattern.pulse_clock) == (5, 16, 16e3)


@pytest.mark.nojit
def test_a_second_word_holds_the_later_slots():
    pattern = encode(setpoints([[0.0], [1.0], [3.0]], axes=("x",)), {"x": 1}, 32)
    assert pattern.words[:, 0, 0].tolist() == [[0, 1], [1 << 8, 1 << 8]]


@pytest.mark.parametrize("slots", [16, 48, 1024])
def test_every_number_of_pulses_is_spread_evenly(slots):
    """Every gap between two pulses is floor(S / d) or one more, and the first comes half a gap after the start."""
    pulses = np.arange(1, slots + 1)
    pattern = encode(setpoints(np.r_[0, np.cumsum(pulses)][:, None], axes=("x",)), {"x": 1}, slots)
    sent = slots_of(pattern)[:, 0]
    assert np.array_equal(sent.sum(axis=1), pulses)
    for d, row in zip(pulses, sent, strict=True):
        at = np.flatnonzero(row)
        assert at[0] == slots // (2 * d)
        if d > 1:
            assert set(np.diff(at)) <= {slots // d, slots // d + 1}


def test_a_steady_rate_runs_on_over_the_periods():
    pattern = encode(setpoints(np.arange(50)[:, None] * 4.0, axes=("x",)), {"x": 1}, 64)
    assert set(np.diff(np.flatnonzero(slots_of(pattern)[:, 0].ravel()))) == {16}


@settings(max_examples=100)
@given(
    position=arrays(np.float64, st.tuples(st.integers(1, 30), st.just(2)), elements=st.floats(-3, 3)),
    scale=st.floats(0.01, 500),
    words=st.integers(188, 200),
)
def test_no_pulse_is_lost_or_added(position, scale, words):
    points = setpoints(position)
    scales = {"x": scale, "y": 0.3 * scale}
    pattern = encode(points, scales, 16 * words)
    sent = slots_of(pattern)
    factor = np.array([scale, 0.3 * scale])
    counts = np.rint(position * factor).astype(np.int64)
    assert np.array_equal(counts[0] + np.r_[np.zeros((1, 2), int), np.cumsum(sent.sum(axis=2), axis=0)], counts)
    assert np.array_equal(decode(pattern), np.rint(position * factor) / factor)
    assert np.all(np.abs(decode(pattern) * factor - position * factor) <= 0.5 + 1e-9)


def test_a_whole_path_with_a_rotary_axis_in_degrees():
    """The butterfly and an axis that turns with it; the position is known to half a pulse at every tick."""
    path = motions.butterfly()
    curve = path.curves[0]
    points = np.column_stack([curve.control_points, np.linspace(0, 6, len(curve.control_points))])
    path = sf.Path([sf.NurbsCurve(curve.degree, curve.knots, points, curve.weights)], axes=("x", "y", "theta"))
    found = sf.interpolate(path, motions.constant(path, 60.0), period=1e-3)
    pattern = encode(found, {"x": 1000, "y": 500, "theta": 5000 / 360}, 128, rotary="deg")
    factor = np.array([1000, 500, 5000 / 360 * 180 / np.pi])
    assert pattern.pulses_per_unit == pytest.approx(factor, rel=1e-15)
    assert np.array_equal(decode(pattern), np.rint(found.position * pattern.pulses_per_unit) / pattern.pulses_per_unit)
    assert np.abs((decode(pattern) - found.position) * factor).max() <= 0.5 + 1e-9
    same = encode(found, {"x": 1000, "y": 500, "theta": factor[2]}, 128)
    assert np.array_equal(same.words, pattern.words)


def test_three_axes_are_one_card():
    axes = ("x", "y", "z", "a")
    pattern = encode(setpoints(np.zeros((2, 4)), axes), dict.fromkeys(axes, 1.0), 16)
    assert pattern.cards == (("x", "y", "z"), ("a",))
    assert encode(setpoints(np.zeros((2, 2))), {"x": 1, "y": 1}, 16).cards == (("x", "y"),)


def test_one_setpoint_makes_no_period():
    assert decode(encode(setpoints([[1.26, 2.0]]), {"x": 10, "y": 10}, 16)).tolist() == [[1.3, 2.0]]


def test_a_pattern_cannot_be_changed():
    pattern = encode(setpoints(np.zeros((2, 2))), {"x": 1, "y": 1}, 16)
    for name in ("words", "start", "pulses_per_unit"):
        with pytest.raises(ValueError, match=r"read-only"):
            getattr(pattern, name)[...] = 1


def some_pattern(ticks=500):
    rng = np.random.default_rng(5)
    return encode(setpoints(np.cumsum(rng.normal(size=(ticks, 2)), axis=0)), {"x": 10, "y": 7.5}, 64)


# --- refused ---


def test_too_fast():
    with pytest.raises(InputError) as caught:
        encode(setpoints([[0, 0], [0.01, 0], [0.02, -0.02], [0.02, -0.053]]), {"x": 1000, "y": 1000}, 32)
    assert str(caught.value) == (
        "tick 2, axis y: 33 pulses are needed before the next tick (33000 a second), at most 32 are possible (32000 a "
        "second); lower the feed, or take more slots per period or fewer than 1000 pulses per mm"
    )
    encode(setpoints([[0, 0], [0.032, -0.032]]), {"x": 1000, "y": 1000}, 32)


def test_too_fast_for_a_rotary_axis():
    points = setpoints(np.r_[np.zeros(9), 3.0, 3.0][:, None], axes=("theta",))
    with pytest.raises(InputError) as caught:
        encode(points, {"theta": 100}, 16)
    assert str(caught.value).startswith("tick 8, axis theta: 300 pulses are needed")
    assert str(caught.value).endswith("or fewer than 100 pulses per rad")


def test_more_words_than_memory_should_hold_are_refused(monkeypatch):
    monkeypatch.setattr(bit_pattern, "MAX_BYTES", 100)
    with pytest.raises(InputError, match="3 setpoints of 1024 slots make too many words"):
        encode(setpoints(np.zeros((3, 2))), {"x": 1, "y": 1}, 1024)


TWO = setpoints(np.zeros((2, 2)))
GOOD = {"x": 1, "y": 1}


@pytest.mark.parametrize("slots", [0, 8, 24, -16, 2**17, 16.0, True, "16", None])
def test_refused_slots(slots):
    with pytest.raises(InputError) as caught:
        encode(TWO, GOOD, slots)
    assert str(caught.value) == f"slots_per_period is {slots!r}; a multiple of 16 from 16 to 65536 is needed"


@pytest.mark.parametrize(
    ("points", "scales", "options", "message"),
    [
        (TWO, {"x": 1}, {}, "pulses_per_unit is {'x': 1}; give one scale for each of x, y"),
        (TWO, {**GOOD, "z": 1}, {}, "pulses_per_unit is {'x': 1, 'y': 1, 'z': 1}; give one scale for each of x, y"),
        (TWO, {"x": 1, "y": 0}, {}, "pulses_per_unit['y'] is 0; it must be greater than 0"),
        (TWO, {"x": 1, "y": -2.5}, {}, "pulses_per_unit['y'] is -2.5; it must be greater than 0"),
        (TWO, [1, 1], {}, "pulses_per_unit is [1, 1]; give one scale for each of x, y"),
        (TWO, GOOD, {"rotary": "grad"}, "rotary is 'grad'; choose 'rad' or 'deg'"),
        (setpoints(np.zeros((0, 2))), GOOD, {}, "there are no setpoints to make pulses of"),
        (setpoints([[0, np.nan]]), GOOD, {}, "Setpoints.position[0, 1] is nan; every value must be finite"),
        (setpoints([[0, 1e17]]), GOOD, {}, "tick 0, axis y: more than 2^53 pulses from zero"),
    ],
)
def test_refused(points, scales, options, message):
    with pytest.raises(InputError) as caught:
        encode(points, scales, 16, **options)
    assert str(caught.value).startswith(message)


def test_refused_scales_that_are_no_numbers():
    for scale, message in (
        ("ten", "pulses_per_unit['x'] is 'ten'; expected a number"),
        (np.inf, "pulses_per_unit['x'] is inf; it must be finite"),
    ):
        with pytest.raises(LimitsError) as caught:
            encode(TWO, {"x": scale, "y": 1}, 16)
        assert str(caught.value) == message


def test_plus_and_minus_in_one_slot_are_refused():
    pattern = some_pattern(20)
    words = pattern.words.copy()
    words[7, 1, :, 2] = 1 << 5
    broken = dataclasses.replace(pattern, words=words)
    with pytest.raises(InputError) as caught:
        decode(broken)
    assert str(caught.value) == "period 7, axis y, slot 37: plus and minus are both set"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"words": np.zeros((1, 2, 2, 1))},
            "BitPattern.words has shape (1, 2, 2, 1) of float64; expected (n, 2, 2, words) of uint16",
        ),
        (
            {"words": np.zeros((1, 3, 2, 1), dtype=np.uint16)},
            "BitPattern.words has shape (1, 3, 2, 1) of uint16; expected (n, 2, 2, words) of uint16",
        ),
        ({"start": [1]}, "BitPattern: expected one start and one scale"),
        (
            {"pulses_per_unit": [1.0, 2.0, 3.0]},
            "BitPattern: expected one start and one scale",
        ),
        ({"period": 0}, "period is 0; it must be greater than 0"),
    ],
)
def test_refused_patterns(changes, message):
    with pytest.raises(InputError) as caught:
        dataclasses.replace(some_pattern(3), **changes)
    assert str(caught.value).startswith(message)
