"""How far the axes of a machine are off: contour error, errors of responses too long to keep, and their spectra."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.checks.nearest import NearestOnPath
from splinefeed.checks.spans import spans_of
from splinefeed.errors import InputError
from splinefeed.paths.path import Path
from splinefeed.records import ROTARY_AXES, Array, Response, check_finite, positive, shown_by, unit_along

#: A coordinate beyond this, mm, has a square that is not a number.
FARTHEST = 1e150
#: Fewer samples than this give no useful spectrum.
LEAST_SAMPLES = 8


@dataclass(frozen=True, eq=False)
class Contour:
    """Contour error of each sample.

    Attributes
    ----------
    error : (n,) array
        Distance from the path over the linear axes, mm.
    s : (n,) array
        Arc length of the nearest point, mm; see `ContourMeter.measure`.

    References
    ----------
    .. [1] docs/math/contour-error.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> from splinefeed.analysis.following import ContourMeter
    >>> found = ContourMeter(sf.Path.polyline([[0, 0], [10, 0]])).measure([[5.0, 0.25], [6.0, -0.5]])
    >>> found.error
    array([0.25, 0.5 ])
    >>> found.max
    0.5
    """

    error: Array
    s: Array

    @property
    def max(self) -> float:
        """Largest error, mm, 0 without samples."""
        return float(np.max(self.error, initial=0.0))

    @property
    def rms(self) -> float:
        """Root mean square of the error, mm, 0 without samples."""
        return float(np.sqrt(np.mean(self.error**2))) if self.error.size else 0.0


class ContourMeter:
    """Measure positions against one path; its tables of the path are made once.

    Parameters
    ----------
    path : Path
        With linear axes, mm.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._rows = spans_of(path)
        self._search = NearestOnPath(self._rows, closed=path.closed)

    def measure(self, position: ArrayLike, *, s_hint: ArrayLike | None = None) -> Contour:
        """Measure the contour error of positions.

        Parameters
        ----------
        position : (n, axes) or (n, linear axes) array
            mm; rotary axes do not count. In the order of the motion they are fast.
        s_hint : (n,) array, optional
            The commanded arc length of each sample, mm: only the path near the commanded point counts. Without it the
            nearest point of the whole path does. Where the path crosses itself, or two of its parts run side by side,
            that may be a part where the tool must not be.

        Returns
        -------
        Contour
            Of the nearest points, to rounding.

        Raises
        ------
        InputError
            For shapes that do not fit, and values that are not finite.

        Notes
        -----
        With `s_hint`, arc lengths s_hint - h to s_hint + h count, with h four times the distance e of the position from
        the commanded point. For the nearest point is within 2 e of the commanded one, and the path may wind and turn
        back, by corners up to 150 degrees, before it is 4 e long. While the nearest point of the window is one of its
        ends, and that is not an end of the path, h is doubled. On a closed path the window continues across the seam.
        """
        path = self.path
        points = np.asarray(position, dtype=np.float64)
        hint = None if s_hint is None else np.ascontiguousarray(s_hint, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] not in (len(path.axes), path.linear):
            raise InputError(f"position has shape {points.shape}; expected (n, {path.linear}), the linear axes")
        if hint is not None and hint.shape != (len(points),):
            raise InputError(f"s_hint has shape {hint.shape}; expected ({len(points)},), one a position")
        q = np.ascontiguousarray(points[:, : path.linear].T)
        if not np.all(np.abs(q) <= FARTHEST) or not np.all(np.isfinite(0.0 if hint is None else hint)):
            raise InputError(f"a position or s_hint is beyond {FARTHEST:g} mm or not finite; its distance is no number")
        hint = None if hint is None else np.clip(hint, 0.0, self._rows.length)
        if not path.linear:  # nothing to be away from: every position is on the path
            return Contour(np.zeros(len(points)), np.zeros(len(points)) if hint is None else hint)
        found = self._search.whole(q) if hint is None else self._search.near(q, hint)
        return Contour(np.sqrt(found.square), self._rows.arc_length(found.row, found.t))


@dataclass
class Peak:
    """The largest |value| so far, and the root mean square of all values.

    Attributes
    ----------
    value : float
        In the unit of the values.
    t : float
        Its time, s.
    s : float or None
        Its commanded arc length, mm.
    count : int
        How many values there were.
    squares : float
        Sum of their squares.
    """

    value: float = 0.0
    t: float = 0.0
    s: float | None = None
    count: int = 0
    squares: float = 0.0

    def see(self, values: Array, t: Array, s: Array | None) -> None:
        """Take more values (n,), with their times, s, and commanded arc lengths, mm."""
        if not len(values):
            return
        at = int(np.argmax(np.abs(values)))
        if not self.count or abs(values[at]) > self.value:
            self.value, self.t = float(abs(values[at])), float(t[at])
            self.s = None if s is None else float(s[at])
        self.count += len(values)
        self.squares += float(np.dot(values, values))

    @property
    def rms(self) -> float:
        """Root mean square of all values."""
        return math.sqrt(self.squares / max(self.count, 1))


class ErrorTally:
    """Gather following error of each axis and contour error over all that was seen; memory does not grow with it.

    Parameters
    ----------
    axes : tuple of str
        Of the responses.

    Attributes
    ----------
    ticks : int
        How many were seen.
    tracking : list of Peak
        Following error of each axis, mm or rad.
    saturated : (axes,) array of int
        Ticks at which the output of each axis was at its limit.
    contour : Peak or None
        Contour error, mm, where it was measured.
    stopped : str or None
        Why the machine stopped.
    """

    def __init__(self, axes: tuple[str, ...]) -> None:
        self.axes, self.ticks = axes, 0
        self.tracking, self.saturated = [Peak() for _ in axes], np.zeros(len(axes), dtype=int)
        self.contour: Peak | None = None
        self.stopped: str | None = None

    def see(self, response: Response, s: Array | None = None) -> None:
        """Take the next piece of a response.

        Parameters
        ----------
        response : Response
            n ticks, in order.
        s : (n,) array, optional
            Its commanded arc length, mm.

        Raises
        ------
        InputError
            For other axes.
        """
        if response.axes != self.axes:
            raise InputError(f"the response has axes {response.axes}; expected {self.axes}")
        for worst, error in zip(self.tracking, np.ascontiguousarray(response.tracking_error.T), strict=True):
            worst.see(error, response.t, s)
        self.saturated += np.count_nonzero(response.saturated, axis=0)
        if response.contour_error is not None:
            self.contour = self.contour or Peak()
            self.contour.see(response.contour_error, response.t, s)
        self.ticks += len(response)
        self.stopped = response.stopped

    def worst_linear(self) -> tuple[str, Peak]:
        """Return the linear axis with the largest following error; "" and a peak of 0 where there is none."""
        linear = [each for each in zip(self.axes, self.tracking, strict=True) if each[0] not in ROTARY_AXES]
        return max(linear, key=lambda each: each[1].value, default=("", Peak()))

    def numbers(self) -> dict[str, Any]:
        """Return what `--json` prints: lengths in mm, rotary axes in deg; contour errors are None without a path."""
        tracking = {}
        for axis, worst, saturated in zip(self.axes, self.tracking, self.saturated.tolist(), strict=True):
            factor = shown_by("", axis)
            tracking[axis] = {
                "unit": unit_along([axis]),
                "max": factor * worst.value,
                "rms": factor * worst.rms,
                "at_t_s": worst.t,
                "at_s_mm": worst.s,
                "saturated_ticks": saturated,
            }
        contour = self.contour
        return {
            "followed_ticks": self.ticks,
            "contour_error_max_mm": None if contour is None else contour.value,
            "contour_error_rms_mm": None if contour is None else contour.rms,
            "contour_error_at": None if contour is None else {"t_s": contour.t, "s_mm": contour.s},
            "tracking_error_max": {axis: each["max"] for axis, each in tracking.items()},
            "tracking": tracking,
            "stopped": self.stopped,
        }


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One-sided amplitude spectrum of a signal.

    Attributes
    ----------
    frequency : (m,) array
        Hz, from 0 to half the sampling rate, m = n // 2 + 1.
    amplitude : (m,) array
        Of the sine at each frequency, in the unit of the signal; at 0 Hz the |mean| of the signal.
    """

    frequency: Array
    amplitude: Array


def spectrum(signal: Array, period: float) -> Spectrum:
    """Compute the one-sided amplitude spectrum of a signal, by the Hann window.

    Parameters
    ----------
    signal : (n,) array
        Values.
    period : float
        Between two of them, s.

    Returns
    -------
    Spectrum
        m = n // 2 + 1 frequencies, Hz.

    Raises
    ------
    InputError
        For fewer than 8 samples and values that are not finite.

    Notes
    -----
    With Hann's weights w the amplitudes are

        A_k = 2 |sum_j w_j (x_j - mean) exp(-2 pi i j k / n)| / sum_j w_j,  half of that at half the sampling rate

    so that a sine of amplitude A that fits a whole number of times reads A; between two lines it reads down to 85 % of
    it. A line spreads over 3 lines. The mean is taken off first, so that it does not spread, and stands at 0 Hz.

    Examples
    --------
    >>> import numpy as np
    >>> from splinefeed.analysis.following import spectrum
    >>> found = spectrum(0.5 * np.sin(2 * np.pi * 50 * np.arange(200) * 1e-3), 1e-3)  # 50 Hz
    >>> k = int(np.argmax(found.amplitude))
    >>> float(found.frequency[k]), round(float(found.amplitude[k]), 9)
    (50.0, 0.5)
    """
    count, step = len(signal), positive(period, "period")
    if count < LEAST_SAMPLES:
        raise InputError(f"signal has {count} sample(s); at least {LEAST_SAMPLES} are needed for a spectrum")
    check_finite(signal, "signal")
    weights, mean = np.hanning(count + 1)[:-1], float(np.mean(signal))  # Hann's, periodic
    amplitude = 2.0 * np.abs(np.fft.rfft(weights * (signal - mean))) / float(np.sum(weights))
    amplitude[0] = abs(mean)
    if count % 2 == 0:
        amplitude[-1] *= 0.5
    return Spectrum(np.arange(len(amplitude)) / (count * step), amplitude)


def tracking_spectra(response: Response) -> Mapping[str, Spectrum]:
    """Compute the spectrum of the following error of each axis.

    Parameters
    ----------
    response : Response
        Of a machine.

    Returns
    -------
    mapping of str to Spectrum
        mm, of rotary axes rad.

    Raises
    ------
    InputError
        As `spectrum`.
    """
    error = response.tracking_error
    return {axis: spectrum(error[:, column], response.period) for column, axis in enumerate(response.axes)}
