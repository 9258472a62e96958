"""Amplitude spectra: sines read their amplitude, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.signal

from splinefeed.analysis.following import spectrum, tracking_spectra
from splinefeed.errors import InputError, LimitsError
from splinefeed.records import Response

PERIOD = 1e-3


@pytest.mark.nojit
@pytest.mark.parametrize("n", [1000, 1001])
def test_a_sine_that_fits_reads_its_amplitude(n):
    line = 50
    t = np.arange(n) * PERIOD
    frequency = line / (n * PERIOD)
    found = spectrum(-3.0 + 0.25 * np.sin(2 * np.pi * frequency * t + 0.3), PERIOD)
    assert found.frequency[line] == pytest.approx(frequency, rel=1e-14)
    assert found.amplitude[line] == pytest.approx(0.25, rel=1e-12)
    assert found.amplitude[0] == pytest.approx(3.0, rel=1e-12)
    assert np.delete(found.amplitude, np.r_[0, line - 4 : line + 5]).max() < 1e-9
    assert len(found.frequency) == len(found.amplitude) == n // 2 + 1


def test_the_highest_frequency_reads_its_amplitude():
    found = spectrum(0.5 * (-1.0) ** np.arange(200), PERIOD)
    assert found.frequency[-1] == pytest.approx(500.0)
    assert found.amplitude[-1] == pytest.approx(0.5, rel=1e-12)


def test_the_loss_between_two_lines_is_as_stated():
    n = 1000
    signal = np.sin(2 * np.pi * 100.5 * np.arange(n) / n)
    assert spectrum(signal, PERIOD).amplitude.max() == pytest.approx(0.848, abs=3e-3)


def test_noise_reads_as_by_scipy():
    signal = np.random.default_rng(3).normal(size=256)
    weights = scipy.signal.get_window("hann", 256)
    expected = 2 * np.abs(np.fft.rfft(weights * (signal - signal.mean()))) / weights.sum()
    assert spectrum(signal, PERIOD).amplitude[1:-1] == pytest.approx(expected[1:-1], rel=1e-9)


def test_nothing_moves():
    assert np.all(spectrum(np.zeros(64), PERIOD).amplitude == 0.0)
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
    found = tracking_spectra(response)
    assert found["x"].frequency[np.argmax(found["x"].amplitude)] == pytest.approx(50.0)
    assert np.all(found["theta"].amplitude == 0.0)


@pytest.mark.parametrize(
    ("signal", "message"),
    [
        (np.zeros(7), "signal has 7 sample(s); at least 8 are needed for a spectrum"),
        (np.array([0.0] * 8 + [np.nan]), "signal[8] is nan; every value must be finite"),
    ],
)
def test_refused(signal, message):
    with pytest.raises(InputError) as caught:
        spectrum(signal, PERIOD)
    assert str(caught.value) == message


def test_refused_periods():
    with pytest.raises(LimitsError, match=r"^period is 0; it must be greater than 0$"):
        spectrum(np.zeros(8), 0.0)
