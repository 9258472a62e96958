"""The servo loop of an axis without its nonlinear parts: frequency response, margins, poles and ultimate gain."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from splinefeed.errors import InputError
from splinefeed.kernels import mechanics
from splinefeed.machine.parts import Axis, Controller
from splinefeed.records import Array
from splinefeed.simulation.plant import plant, zero_order_hold

ComplexArray = NDArray[np.complex128]

#: Points of the grid on which crossings are searched, from LOWEST_SHARE of the Nyquist frequency up to it.
GRID = 4000
LOWEST_SHARE = 1e-6
#: Gain margins below this, or phase margins below this many degrees, are called close to unstable.
SMALL_GAIN_MARGIN = 2.0
SMALL_PHASE_MARGIN = 30.0


@dataclass(frozen=True, eq=False)
class Discrete:
    """The plant of an axis from volts to the position that closes its loop, sampled: x+ = Phi x + Gamma u, y = c x."""

    phi: Array
    gamma: Array
    output: Array
    period: float
    delay: int

    def response(self, omega: Array) -> ComplexArray:
        """G(e^{j w T}) = c (z - Phi)^-1 Gamma z^-delay at w (n,), rad/s: mm or rad a volt, complex (n,)."""
        z = np.exp(1j * np.asarray(omega, dtype=np.float64) * self.period)
        eye = np.eye(len(self.phi))
        right = np.broadcast_to(self.gamma[:, None], (z.size, len(self.gamma), 1))
        states = np.linalg.solve(z.reshape(-1, 1, 1) * eye - self.phi, right)[..., 0]
        out: ComplexArray = (states @ self.output).reshape(z.shape) * z ** (-self.delay)
        return out


@dataclass(frozen=True, kw_only=True)
class Margins:
    """How far a loop is from its stability limit.

    gain_margin         factor by which the gain may rise (infinite if no crossing); at gain_frequency, Hz
    gain_reduction      factor < 1 by which it may fall before the loop is unstable, 0 if it may fall to nothing
    phase_margin        deg, at phase_frequency, Hz (infinite if the loop gain never passes 1)
    delay_margin        further dead time that the loop tolerates, s (infinite if the loop gain never passes 1)
    sensitivity         largest |1 / (1 + L)|, M_s: 1 / M_s is the distance of L from -1
    bandwidth           of the closed loop from reference to position: where it is first 3 dB down, Hz
    spectral_radius     largest modulus of the closed loop's poles: stable below 1
    stable_below, stable_above  of an unstable loop: factor on the gain at which it becomes stable, or None
    Source: docs/machines.md. Example: `sf.simulation.margins(machine.axes["x"], 1e-3).phase_margin`
    """

    gain_margin: float
    gain_frequency: float
    gain_reduction: float
    phase_margin: float
    phase_frequency: float
    delay_margin: float
    sensitivity: float
    bandwidth: float
    spectral_radius: float
    stable_below: float | None = None
    stable_above: float | None = None

    @property
    def stable(self) -> bool:
        """Whether every closed-loop pole lies inside the unit circle."""
        return self.spectral_radius < 1.0

    @property
    def gain_margin_db(self) -> float:
        """The gain margin in decibels."""
        return 20.0 * math.log10(self.gain_margin)

    @property
    def close(self) -> bool:
        """Whether the loop is stable, but within SMALL_GAIN_MARGIN or SMALL_PHASE_MARGIN of not being so."""
        return self.stable and (
            self.gain_margin < SMALL_GAIN_MARGIN
            or self.phase_margin < SMALL_PHASE_MARGIN
            or self.gain_reduction > 1.0 / SMALL_GAIN_MARGIN
        )

    @property
    def verdict(self) -> str:
        """Stable, close to unstable, or unstable, with the margins, in a sentence."""
        if not self.stable:
            text = f"unstable: a closed-loop pole has modulus {self.spectral_radius:.4f}"
            if self.stable_below is not None:
                decibels = 20.0 * math.log10(self.stable_below)
                return f"{text}; stable only below {self.stable_below:.3g} of these gains ({decibels:.1f} dB)"
            if self.stable_above is not None:
                return f"{text}; stable only above {self.stable_above:.3g} times these gains"
            return f"{text}; no common factor on the gains makes it stable"
        numbers = f"gain margin {self.gain_margin:.3g}, phase margin {self.phase_margin:.3g} deg"
        if not self.close:
            return f"stable: {numbers}"
        if self.gain_margin < SMALL_GAIN_MARGIN or self.phase_margin < SMALL_PHASE_MARGIN:
            return f"stable, but close to unstable: {numbers}"
        return f"stable, but close to unstable: the gain may fall to {self.gain_reduction:.3g} only; {numbers}"

    @property
    def sentence(self) -> str:
        """The verdict, with the frequencies of the margins, the delay margin and the bandwidth of a stable loop."""
        if not self.stable:
            return self.verdict
        passing = (
            f"; gain margin at {self.gain_frequency:.4g} Hz, phase margin at {self.phase_frequency:.4g} Hz, "
            f"delay margin {self.delay_margin * 1e3:.3g} ms, bandwidth {self.bandwidth:.4g} Hz"
        )
        return self.verdict + passing

    def as_dict(self) -> dict[str, float | bool | str | None]:
        """Names and values, as `tune --json` prints them; what is infinite or is not there becomes null there."""
        return {
            **asdict(self),
            "gain_margin_db": self.gain_margin_db,
            "stable": self.stable,
            "close": self.close,
            "verdict": self.verdict,
        }


def discrete_plant(axis: Axis, period: float) -> Discrete:
    """The linear plant of an axis behind a zero-order hold, with its computing delay."""
    model = plant(axis)
    used = list(model.used)
    phi, gamma = zero_order_hold(model.A[np.ix_(used, used)], model.B[used], period)
    seen = mechanics.MOTOR
    if axis.controller.feedback == "scale" and mechanics.LOAD in used:
        seen = mechanics.LOAD
    output = (np.array(used) == seen).astype(np.float64)
    return Discrete(phi, gamma, output, period, axis.controller.delay)


def controller_response(controller: Controller, period: float, omega: Array) -> tuple[ComplexArray, ComplexArray]:
    """R and H in u = R r - H y, without feed-forward, at w (n,), rad/s; V/mm or V/rad, complex (n,).

    PID:  R = H = K_p + K_i T z / (z - 1) + K_d D,   D = (z - 1) / ((T_f + T) z - T_f)
    P-PI: R = P K, H = P (K + D),   P = K_vp + K_vi T z / (z - 1)
    """
    z = np.exp(1j * np.asarray(omega, dtype=np.float64) * period)
    slope = (z - 1.0) / ((controller.filter + period) * z - controller.filter)
    total = period * z / (z - 1.0)
    if controller.kind == "pid":
        both = controller.kp + controller.ki * total + controller.kd * slope
        return both, both
    inner = controller.velocity_kp + controller.velocity_ki * total
    return inner * controller.position_gain, inner * (controller.position_gain + slope)


def loop_response(axis: Axis, period: float, omega: Array) -> ComplexArray:
    """The loop opened at the controller's output, L = H G, at w (n,), rad/s, complex (n,)."""
    out: ComplexArray = controller_response(axis.controller, period, omega)[1] * discrete_plant(axis, period).response(
        omega
    )
    return out


def closed_loop(axis: Axis, period: float) -> tuple[Array, Array, Array]:
    """State equations x+ = F x + g r, y = h x of the closed loop without feed-forward: F (n, n), g (n,), h (n,).

    States: plant, integral, last input and filtered slope of the controller, and the output that waits if delayed.
    Controller: with e = r - y, s its input (e, or y for P-PI), f+ = a f + (1 - a) (s - s_last) / T.
    """
    part = discrete_plant(axis, period)
    control = axis.controller
    n = len(part.gamma)
    integral, last, slope, pending = n, n + 1, n + 2, n + 3
    size = n + 3 + part.delay
    cascade = control.kind == "p-pi"
    seen = np.zeros(size + 1)  # as a row over (x, r)
    seen[:n] = part.output
    error = -seen
    error[size] = 1.0
    source = seen if cascade else error
    keep = control.filter / (control.filter + period)
    slope_row = (1.0 - keep) / period * source
    slope_row[slope] += keep
    slope_row[last] -= (1.0 - keep) / period
    if cascade:
        wanted = control.position_gain * error - slope_row
        proportional, gain = control.velocity_kp * wanted, control.velocity_ki * period * wanted
    else:
        proportional, gain = control.kp * error + control.kd * slope_row, control.ki * period * error
    integral_row = gain.copy()
    integral_row[integral] += 1.0
    volts = proportional + integral_row
    rows = np.zeros((size, size + 1))
    rows[:n, :n] = part.phi
    rows[integral], rows[last], rows[slope] = integral_row, source, slope_row
    if part.delay:
        rows[:n, pending] += part.gamma
        rows[pending] = volts
    else:
        rows[:n] += np.outer(part.gamma, volts)
    return rows[:, :size], rows[:, size], seen[:size]


def spectral_radius(axis: Axis, period: float) -> float:
    """Largest modulus of the closed loop's poles; integrators that nothing drives (gain 0) are left out."""
    F, _, _ = closed_loop(axis, period)
    control = axis.controller
    idle = (control.velocity_ki if control.kind == "p-pi" else control.ki) == 0.0
    if idle:  # an integral that never moves is not a mode of the loop
        place = len(discrete_plant(axis, period).gamma)
        F = np.delete(np.delete(F, place, axis=0), place, axis=1)
    return float(np.max(np.abs(np.linalg.eigvals(F))))


def margins(axis: Axis, period: float) -> Margins:
    """Gain and phase margin, bandwidth and poles of the loop of an axis at a servo period, s.

    period in s. Source: docs/machines.md. Example: `sf.simulation.margins(machine.axes["x"], 1e-3).sentence`
    """
    if not (math.isfinite(period) and period > 0.0):
        raise InputError(f"period is {period} s; it must be greater than 0 and finite")
    part = discrete_plant(axis, period)
    control = axis.controller

    def loop(w: float) -> complex:
        at = np.array([w])
        return complex((controller_response(control, period, at)[1] * part.response(at))[0])

    top = math.pi / period
    grid = np.geomspace(LOWEST_SHARE * top, top * (1.0 - 1e-9), GRID)
    reference, feedback = controller_response(control, period, grid)
    plant_values = part.response(grid)
    values = feedback * plant_values
    crossings = [w for w in _roots(lambda w: loop(w).imag, grid, values.imag) if loop(w).real < 0.0]
    gains = [(1.0 / abs(loop(w)), w) for w in crossings]
    at_nyquist = loop(top).real  # L is real at the Nyquist frequency: it counts when negative
    if at_nyquist < 0.0:
        gains.append((-1.0 / at_nyquist, top))
    upper = min((pair for pair in gains if pair[0] > 1.0), default=(math.inf, math.nan))
    lower = max((pair for pair in gains if pair[0] < 1.0), default=(0.0, math.nan))
    passing = _roots(lambda w: abs(loop(w)) - 1.0, grid, np.abs(values) - 1.0)
    phases = [(math.degrees(math.atan2(loop(w).imag, loop(w).real)) + 180.0, w) for w in passing]
    delays = [math.radians(phase % 360.0) / w for phase, w in phases]
    phases = [(phase if phase <= 180.0 else phase - 360.0, w) for phase, w in phases]
    phase = min(phases, key=lambda pair: abs(pair[0]), default=(math.inf, math.nan))
    radius = spectral_radius(axis, period)
    below = above = None
    if radius >= 1.0:
        below = next((g for g, _ in sorted(gains, reverse=True) if g < 1.0 and _is_stable(axis, period, g, -1)), None)
        above = next((g for g, _ in sorted(gains) if g > 1.0 and _is_stable(axis, period, g, 1)), None)
    return Margins(
        gain_margin=upper[0],
        gain_frequency=upper[1] / (2.0 * math.pi),
        gain_reduction=lower[0],
        phase_margin=phase[0],
        phase_frequency=phase[1] / (2.0 * math.pi),
        delay_margin=min(delays, default=math.inf),
        sensitivity=_sensitivity(loop, grid, values),
        bandwidth=_bandwidth(grid, np.abs(reference * plant_values / (1.0 + values))),
        spectral_radius=radius,
        stable_below=below,
        stable_above=above,
    )


def _is_stable(axis: Axis, period: float, factor: float, side: int) -> bool:
    """Whether the loop is stable with its gains times a little more (side 1) or less (-1) than `factor`."""
    return spectral_radius(scaled(axis, factor * (1.0 + 1e-3 * side)), period) < 1.0


def scaled(axis: Axis, factor: float) -> Axis:
    """The axis with the gain of its loop times `factor`: all gains of a PID, those of the speed loop of a P-PI."""
    names = ("kp", "ki", "kd") if axis.controller.kind == "pid" else ("velocity_kp", "velocity_ki")
    gains: dict[str, Any] = {name: factor * getattr(axis.controller, name) for name in names}
    return replace(axis, controller=replace(axis.controller, **gains))


def _sensitivity(loop: Callable[[float], complex], grid: Array, values: ComplexArray) -> float:
    """Largest |1 / (1 + L)| of the loop with `values` over the grid, rad/s, refined between its neighbours."""
    at = int(np.argmin(np.abs(1.0 + values)))
    ends = (float(grid[max(at - 1, 0)]), float(grid[min(at + 1, len(grid) - 1)]))
    least = minimize_scalar(
        lambda w: abs(1.0 + loop(w)), bounds=ends, method="bounded", options={"xatol": 1e-9 * ends[1]}
    )
    return float(1.0 / min(least.fun, abs(1.0 + values[at])))


def _bandwidth(grid: Array, closed: Array) -> float:
    """Where |closed loop| over the grid, rad/s, first falls below 3 dB, Hz; infinite if it never does."""
    level = math.sqrt(0.5)
    below = np.flatnonzero(closed < level)
    if not below.size or below[0] == 0:
        return math.inf
    i = int(below[0])
    share = (level - closed[i - 1]) / (closed[i] - closed[i - 1])
    return float(grid[i - 1] + share * (grid[i] - grid[i - 1])) / (2.0 * math.pi)


def _roots(function: object, grid: Array, values: Array) -> list[float]:
    """Roots of a function of frequency between grid points where its values change sign, or at one of them."""
    roots = []
    for i in np.flatnonzero((values[:-1] < 0.0) != (values[1:] < 0.0)):
        known = grid[i : i + 2][values[i : i + 2] == 0.0]
        roots.append(float(known[0] if len(known) else brentq(function, grid[i], grid[i + 1], rtol=1e-13)))
    return roots
