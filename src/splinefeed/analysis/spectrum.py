"""Amplitude spectra of what was sampled at the servo period."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import InputError
from splinefeed.records import Array, Response, check_finite, positive

#: Fewer samples than this give no useful spectrum.
LEAST_SAMPLES = 8


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One-sided amplitude spectrum of a signal.

    frequency  (m,)  Hz, from 0 to half the sampling rate, m = n // 2 + 1
    amplitude  (m,)  of the sine at each frequency, in the unit of the signal; at 0 Hz the |mean| of the signal
    """

    frequency: Array
    amplitude: Array


def spectrum(signal: Array, period: float) -> Spectrum:
    """One-sided amplitude spectrum of a signal (n,) sampled every `period` s, by the Hann window.

    A_k = 2 |sum_j w_j (x_j - mean) exp(-2 pi i j k / n)| / sum_j w_j,  half of that at half the sampling rate

    so that a sine of amplitude A that fits a whole number of times reads A; between two lines it reads down to 85 % of
    it. A line spreads over 3 lines. The mean is taken off first, so that it does not spread, and stands at 0 Hz.
    Raises InputError for fewer than 8 samples and values that are not finite.
    """
    from scipy.signal.windows import hann

    count, step = len(signal), positive(period, "period")
    if count < LEAST_SAMPLES:
        raise InputError(f"signal has {count} sample(s); at least {LEAST_SAMPLES} are needed for a spectrum")
    check_finite(signal, "signal")
    weights, mean = hann(count, sym=False), float(np.mean(signal))
    amplitude = 2.0 * np.abs(np.fft.rfft(weights * (signal - mean))) / float(np.sum(weights))
    amplitude[0] = abs(mean)
    if count % 2 == 0:
        amplitude[-1] *= 0.5
    return Spectrum(np.arange(len(amplitude)) / (count * step), amplitude)


def tracking_spectra(response: Response) -> Mapping[str, Spectrum]:
    """Spectrum of the following error of each axis, in mm, rotary axes rad; see `spectrum`."""
    error = response.tracking_error
    return {axis: spectrum(error[:, column], response.period) for column, axis in enumerate(response.axes)}
