"""Amplitude spectra: sines read their amplitude, peaks lie where they were put, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.signal
from hypothesis import given
from hypothesis import strategies as st

from splinefeed.analysis.spectrum import WINDOWS, spectrum, tracking_spectra
from splinefeed.errors import InputError, LimitsError
from splinefeed.records import Response

PERIOD = 1e-3


@pytest.mark.nojit
@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("n", [1000, 1001])
def test_a_sine_that_fits_reads_its_amplitude(window, n):
    line = 50
    t = np.arange(n) * PERIOD
    frequency = line / (n * PERIOD)
    found = spectrum(-3.0 + 0.25 * np.sin(2 * np.pi * frequency * t + 0.3), PERIOD, unit="mm", window=window)
    assert found.frequency[line] == pytest.approx(frequency, rel=1e-14)
    assert found.amplitude[line] == pytest.approx(0.25, rel=1e-12)
    assert found.amplitude[0] == pytest.approx(3.0, rel=1e-12)
    assert np.delete(found.amplitude, np.r_[0, line - 4 : line + 5]).max() < 1e-9
    assert len(found.frequency) == len(found.amplitude) == n // 2 + 1
    assert (found.unit, found.window) == ("mm", window)
    assert found.resolution == pytest.approx(1 / (n * PERIOD))


@pytest.mark.parametrize("window", WINDOWS)
def test_the_highest_frequency_reads_its_amplitude(window):
    found = spectrum(0.5 * (-1.0) ** np.arange(200), PERIOD, window=window)
    assert found.frequency[-1] == 500.0
    assert found.amplitude[-1] == pytest.approx(0.5, rel=1e-12)


@pytest.mark.parametrize(("window", "least"), [("none", 0.636), ("hann", 0.848), ("flat-top", 0.9988)])
def test_the_loss_between_two_lines_is_as_stated(window, least):
    n = 1000
    signal = np.sin(2 * np.pi * 100.5 * np.arange(n) / n)
    assert spectrum(signal, PERIOD, window=window).amplitude.max() == pytest.approx(least, abs=3e-3)


def test_windows_are_those_of_scipy():
    rng = np.random.default_rng(3)
    signal = rng.normal(size=256)
    for window, name in (("none", "boxcar"), ("hann", "hann"), ("flat-top", "flattop")):
        weights = scipy.signal.get_window(name, 256)
        expected = 2 * np.abs(np.fft.rfft(weights * (signal - signal.mean()))) / weights.sum()
        assert spectrum(signal, PERIOD, window=window).amplitude[1:-1] == pytest.approx(expected[1:-1], rel=1e-9)


@given(
    frequency=st.floats(20.0, 480.0),
    amplitude=st.floats(1e-6, 1e3),
    phase=st.floats(0, 6.28),
    mean=st.floats(-10, 10),
)
def test_a_peak_between_lines_is_told_from_its_neighbours(frequency, amplitude, phase, mean):
    t = np.arange(2000) * PERIOD
    found = spectrum(amplitude * (mean + np.sin(2 * np.pi * frequency * t + phase)), PERIOD).peaks()[0]
    assert found.frequency == pytest.approx(frequency, abs=1e-3)
    assert found.amplitude == pytest.approx(amplitude, rel=1e-3)


def test_several_peaks_highest_first():
    t = np.arange(4000) * PERIOD
    parts = {37.3: 0.5, 120.0: 2.0, 333.3: 0.1, 410.0: 1e-5}
    signal = sum(a * np.sin(2 * np.pi * f * t) for f, a in parts.items())
    found = spectrum(signal, PERIOD).peaks()
    assert [round(peak.frequency, 1) for peak in found] == [120.0, 37.3, 333.3]
    assert [peak.amplitude for peak in found] == pytest.approx([2.0, 0.5, 0.1], rel=1e-3)
    assert len(spectrum(signal, PERIOD).peaks(2)) == 2
    low = spectrum(signal, PERIOD).peaks(9, share=1e-7)
    assert any(peak.frequency == pytest.approx(410.0, abs=0.1) for peak in low)


def test_nothing_moves():
    found = spectrum(np.zeros(64), PERIOD)
    assert np.all(found.amplitude == 0.0)
    assert found.peaks() == []
    assert spectrum(np.full(64, -2.0), PERIOD).amplitude[0] == 2.0


def test_of_a_response():
    error = np.column_stack([np.sin(2 * np.pi * 50 * np.arange(500) * PERIOD), np.zeros(500)])
    response = Response(
        t=np.arange(500) * PERIOD,
        command=error,
        position=np.zeros((500, 2)),
        measured=np.zeros((500, 2)),
        output=np.zeros((500, 2)),
        saturated=np.zeros((500, 2), dtype=bool),
        axes=("x", "theta"),
        period=PERIOD,
    )
    found = tracking_spectra(response, window="flat-top")
    assert [found[axis].unit for axis in ("x", "theta")] == ["mm", "rad"]
    assert found["x"].peaks(1)[0].frequency == pytest.approx(50.0)
    assert found["theta"].peaks() == []


@pytest.mark.parametrize(
    ("signal", "options", "message"),
    [
        (np.zeros((9, 2)), {}, "signal has shape (9, 2); expected (n,): one axis at a time"),
        (np.zeros(7), {}, "signal has 7 sample(s); at least 8 are needed for a spectrum"),
        ([0.0] * 8 + [np.nan], {}, "signal[8] is nan; every value must be finite"),
        (["a"], {}, "signal: expected numbers, got list (could not convert string to float: 'a')"),
        (np.zeros(8), {"window": "hamming"}, "window is 'hamming'; choose one of none, hann, flat-top"),
    ],
)
def test_refused(signal, options, message):
    with pytest.raises(InputError) as caught:
        spectrum(signal, PERIOD, **options)
    assert str(caught.value) == message


def test_refused_periods_and_numbers_of_peaks():
    with pytest.raises(LimitsError, match=r"^period is 0; it must be greater than 0$"):
        spectrum(np.zeros(8), 0.0)
    for most in (0, 1.5, True):
        with pytest.raises(InputError) as caught:
            spectrum(np.zeros(8), PERIOD).peaks(most)
        assert str(caught.value) == f"most is {most!r}; expected a whole number from 1 up"
