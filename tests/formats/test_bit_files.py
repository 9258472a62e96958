"""Bare pulse words: in the order in which they are sent, back again, and refused where words and page do not fit."""

from __future__ import annotations

import json

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import FormatError, InputError
from splinefeed.formats import bit_pattern
from splinefeed.formats.bit_pattern import BitPattern, decode, encode
from splinefeed.records import Setpoints


def setpoints(position, axes=("x", "y"), first=0):
    position = np.asarray(position, dtype=float)
    n = len(position)
    return Setpoints(
        t=(first + np.arange(n)) * 1e-3,
        curve=np.zeros(n),
        u=np.zeros(n),
        s=np.zeros(n),
        feed=np.zeros(n),
        position=position,
        axes=axes,
        period=1e-3,
        method="test",
    )


@pytest.fixture
def pattern() -> BitPattern:
    walk = np.cumsum(np.random.default_rng(8).normal(size=(400, 3)), axis=0)
    return encode(setpoints(walk, ("x", "y", "theta")), {"x": 9, "y": 7.5, "theta": 4}, 64)


def test_words_stand_in_the_order_of_time(tmp_path):
    """One period of 32 slots, x +2 and y -32: first the words of slots 0 to 15, x plus, x minus, y plus, y minus."""
    made = encode(setpoints([[0, 0], [2, -32]]), {"x": 1, "y": 1}, 32)
    bit_pattern.write(made, tmp_path / "w.bits")
    sent = np.fromfile(tmp_path / "w.bits", dtype="<u2")
    assert sent.tolist() == [1 << 8, 0, 0, 0xFFFF, 1 << 8, 0, 0, 0xFFFF]
    page = json.loads((tmp_path / "w.bits.json").read_text())
    assert (page["axes"], page["periods"], page["words_per_period"]) == (["x", "y"], 1, 2)
    assert (page["slots_per_period"], page["pulse_clock_hz"], page["period_s"]) == (32, 32e3, 1e-3)
    assert (page["start_pulses"], page["units"]) == ([0, 0], ["mm", "mm"])


def test_save_and_load_know_pulse_words(pattern, tmp_path):
    name = "w.bits"
    sf.save(pattern, tmp_path / name)
    found = sf.load(tmp_path / name)
    assert isinstance(found, BitPattern)
    for field in ("words", "start", "pulses_per_unit"):
        np.testing.assert_array_equal(getattr(found, field), getattr(pattern, field))
    assert (found.axes, found.period) == (pattern.axes, pattern.period)
    np.testing.assert_array_equal(decode(found), decode(pattern))


def test_one_setpoint_makes_an_empty_file_that_can_be_read(tmp_path):
    bit_pattern.write(encode(setpoints([[1.26, 2.0]]), {"x": 10, "y": 10}, 16), tmp_path / "w.bits")
    assert decode(bit_pattern.read(tmp_path / "w.bits")).tolist() == [[1.3, 2.0]]


def test_a_failed_write_leaves_nothing(tmp_path, pattern):
    with pytest.raises(FormatError, match=r"are written as \.bits"):
        bit_pattern.write(pattern, tmp_path / "w.bin")
    with pytest.raises(InputError, match="are written from BitPattern, got list"):
        bit_pattern.write([pattern], tmp_path / "w.bits")
    assert list(tmp_path.iterdir()) == []


def test_words_and_page_must_belong_together(pattern, tmp_path):
    file, page = tmp_path / "w.bits", tmp_path / "w.bits.json"
    bit_pattern.write(pattern, file)
    good, words = json.loads(page.read_text()), file.read_bytes()

    def refused(**changes):
        page.write_text(json.dumps(good | changes))
        with pytest.raises(FormatError) as caught:
            bit_pattern.read(file)
        return str(caught.value)

    file.write_bytes(words[:-2])
    assert refused() == f"{file}: has {len(words) - 2} bytes, w.bits.json says {len(words)}; was it cut off?"
    file.write_bytes(words[:-2] + b"\x01\x00")
    assert refused() == f"{file}: the words are not those that w.bits.json describes"
    file.write_bytes(words)
    assert refused(record="Setpoints") == f"{page}: does not describe pulse words in the order that is known here"
    assert refused(order="another") == f"{page}: does not describe pulse words in the order that is known here"
    assert refused(axes=[3]) == f"{page}: axes[0]: 3 is not text"
    assert refused(periods=-1) == f"{page}: says -1 periods of 4 words; that is no file of pulse words"
    assert refused(words_per_period=0) == f"{page}: says 399 periods of 0 words; that is no file of pulse words"
    assert refused(pulses_per_unit=[1.0, 0.0, 1.0]).startswith(f"{page}: BitPattern: expected one start and one scale")
    assert refused(pulses_per_unit=[1, 2]).startswith(f"{page}: BitPattern: expected one start and one scale")
    assert refused(period_s=0.0).startswith(f"{page}: period")
    assert refused(start_pulses=None) == f"{page}: start_pulses: is not a list of numbers"
    assert refused(start_pulses=[1, 2, "3"]) == f'{page}: start_pulses[2]: "3" is not a number'
    page.write_text("{")
    with pytest.raises(FormatError, match="is it JSON"):
        bit_pattern.read(file)
    page.write_text("x" * 100_000)
    with pytest.raises(FormatError, match="is larger than"):
        bit_pattern.read(file)
    page.unlink()
    with pytest.raises(FormatError) as caught:
        bit_pattern.read(file)
    assert str(caught.value) == f"{file}: needs w.bits.json beside it, which says what the words are"


def test_plus_and_minus_at_once_are_refused(tmp_path):
    made = encode(setpoints([[0, 0], [16, 0]]), {"x": 1, "y": 1}, 16)
    bad = np.array(made.words)
    bad[0, 0, 1, 0] = 1
    clash = BitPattern(words=bad, start=made.start, axes=made.axes, period=1e-3, pulses_per_unit=[1, 1])
    with pytest.raises(InputError, match="period 0, axis x, slot 0: plus and minus are both set"):
        bit_pattern.write(clash, tmp_path / "w.bits")
    assert list(tmp_path.iterdir()) == []
