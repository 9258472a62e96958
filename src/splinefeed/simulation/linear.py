"""The servo loop of an axis without its nonlinear parts: frequency response, margins, poles, and bounds on them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from splinefeed.errors import InputError
from splinefeed.kernels import mechanics
from splinefeed.machine.parts import GAINS, Controller, ServoAxis
from splinefeed.records import Array, IntArray
from splinefeed.simulation.plant import plant, zero_order_hold

ComplexArray = NDArray[np.complex128]

#: Points of the grid on which crossings are searched, from LOWEST_SHARE of the Nyquist frequency up to it; passes in
#: which what lies around a crossing is cut into PARTS. Straight lines between the last points are exact to rounding.
GRID = 4000
LOWEST_SHARE = 1e-6
PASSES, PARTS = 3, 32
#: Gain at which a closed loop is 3 dB down.
HALF_POWER = math.sqrt(0.5)
#: Gain margins below this, or phase margins below this many degrees, are called close to unstable.
SMALL_GAIN_MARGIN = 2.0
SMALL_PHASE_MARGIN = 30.0
#: A radius of the poles this far below 1 counts as one unit of slack, and more slack than the most as that.
RADIUS_SCALE, MOST_SLACK = 0.01, 3.0


@dataclass(frozen=True, eq=False)
class Discrete:
    """The plant of an axis from volts to the position that closes its loop, sampled: x+ = Phi x + Gamma u, y = c x.

    Attributes
    ----------
    phi : (n, n) array
        Phi.
    gamma : (n,) array
        Gamma, a volt.
    output : (n,) array
        c.
    period : float
        s.
    delay : int
        Computing delay, periods.
    """

    phi: Array
    gamma: Array
    output: Array
    period: float
    delay: int

    def response(self, omega: Array) -> ComplexArray:
        """Return G(e^{j w T}) = c (z - Phi)^-1 Gamma z^-delay.

        Parameters
        ----------
        omega : (n,) array
            w, rad/s.

        Returns
        -------
        (n,) complex array
            mm or rad a volt.
        """
        z = np.exp(1j * np.asarray(omega, dtype=np.float64) * self.period)
        eye = np.eye(len(self.phi))
        right = np.broadcast_to(self.gamma[:, None], (z.size, len(self.gamma), 1))
        states = np.linalg.solve(z.reshape(-1, 1, 1) * eye - self.phi, right)[..., 0]
        out: ComplexArray = (states @ self.output).reshape(z.shape) * z ** (-self.delay)
        return out


@dataclass(frozen=True, kw_only=True)
class Margins:
    """How far a loop is from its stability limit.

    Attributes
    ----------
    gain_margin : float
        Factor by which the gain may rise; infinite if no crossing.
    gain_frequency : float
        Where that is, Hz.
    gain_reduction : float
        Factor below 1 by which the gain may fall before the loop is unstable; 0 if it may fall to nothing.
    phase_margin : float
        deg; infinite if the loop gain never passes 1.
    phase_frequency : float
        Where that is, Hz.
    delay_margin : float
        Further dead time that the loop tolerates, s; infinite if the loop gain never passes 1.
    sensitivity : float
        M_s, largest |1 / (1 + L)|: 1 / M_s is the distance of L from -1.
    bandwidth : float
        Of the closed loop from reference to position: where it is first 3 dB down, Hz.
    spectral_radius : float
        Largest modulus of the closed loop's poles: stable below 1.
    stable_below, stable_above : float or None
        Of an unstable loop: factor on the gain at which it becomes stable.
    reduction_frequency : float
        Where `gain_reduction` is, Hz.

    References
    ----------
    .. [1] docs/machines.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> found = sf.simulation.margins(sf.Machine.load("router").axes["x"], 1e-3)
    >>> found.stable, round(found.phase_margin, 1)
    (True, 61.5)
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
    reduction_frequency: float = math.nan

    @property
    def stable(self) -> bool:
        """Whether every closed-loop pole lies inside the unit circle."""
        return self.spectral_radius < 1.0

    @property
    def gain_margin_db(self) -> float:
        """The gain margin in decibels."""
        return 20.0 * math.log10(self.gain_margin)

    @property
    def gain_fall_db(self) -> float:
        """By how many decibels the gain may fall before the loop is unstable; infinite if it may fall to nothing."""
        return -20.0 * math.log10(self.gain_reduction) if self.gain_reduction > 0.0 else math.inf

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
        if self.gain_reduction > 1.0 / SMALL_GAIN_MARGIN:
            numbers += f", the gain may fall to {self.gain_reduction:.3g} only"
        return f"stable{', but close to unstable' if self.close else ''}: {numbers}"

    @property
    def sentence(self) -> str:
        """The verdict, with the frequencies of the margins, the delay margin and the bandwidth of a stable loop."""
        if not self.stable:
            return self.verdict
        fall = ""
        if self.gain_reduction > 0.0:
            fall = f"the gain may fall by {self.gain_fall_db:.3g} dB (at {self.reduction_frequency:.4g} Hz), "
        return (
            f"{self.verdict}; gain margin at {self.gain_frequency:.4g} Hz, {fall}phase margin at "
            f"{self.phase_frequency:.4g} Hz, delay margin {self.delay_margin * 1e3:.3g} ms, bandwidth "
            f"{self.bandwidth:.4g} Hz"
        )

    def as_dict(self) -> dict[str, float | bool | str | None]:
        """Return names and values, as `tune --json` prints them; what is infinite or not there becomes null there."""
        return {
            **asdict(self),
            "gain_margin_db": self.gain_margin_db,
            "gain_fall_db": self.gain_fall_db,
            "stable": self.stable,
            "close": self.close,
            "verdict": self.verdict,
        }


def discrete_plant(axis: ServoAxis, period: float) -> Discrete:
    """Sample the linear plant of an axis behind a zero-order hold, with its computing delay.

    Parameters
    ----------
    axis : ServoAxis
        The axis.
    period : float
        Of the servo, s.

    Returns
    -------
    Discrete
        The plant.
    """
    model = plant(axis)
    used = np.flatnonzero(model.A.any(axis=1))  # the states that matter
    phi, gamma = zero_order_hold(model.A[np.ix_(used, used)], model.B[used], period)
    on_load = axis.controller.feedback == "scale" and mechanics.LOAD in used
    output = (used == (mechanics.LOAD if on_load else mechanics.MOTOR)).astype(np.float64)
    return Discrete(phi, gamma, output, period, axis.controller.delay)


def controller_response(controller: Controller, period: float, omega: Array) -> tuple[ComplexArray, ComplexArray]:
    """Return R and H in u = R r - H y, without feed-forward.

    Parameters
    ----------
    controller : Controller
        Of the axis.
    period : float
        T, s.
    omega : (n,) array
        w, rad/s.

    Returns
    -------
    R, H : (n,) complex array
        V/mm or V/rad.

    Notes
    -----
    With D the filtered derivative:

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


def loop_responses(controller: Controller, period: float, omega: Array, plant: ComplexArray) -> ComplexArray:
    """Return L = G H, opened at the controller's output, and T = G R / (1 + L) from reference to position.

    Parameters
    ----------
    controller : Controller
        Of the axis.
    period : float
        Of the servo, s.
    omega : (n,) array
        w, rad/s.
    plant : (n,) complex array
        G there, as `Discrete.response` returns it.

    Returns
    -------
    (2, n) complex array
        L and T.
    """
    forward, back = (each * plant for each in controller_response(controller, period, omega))
    return np.array([back, forward / (1.0 + back)])


def closed_loop(axis: ServoAxis, period: float) -> tuple[Array, Array, Array]:
    """Return the state equations x+ = F x + g r, y = h x of the closed loop without feed-forward.

    Parameters
    ----------
    axis : ServoAxis
        The axis.
    period : float
        T, s.

    Returns
    -------
    F : (n, n) array
        A period on.
    g : (n,) array
        By the reference, a mm or rad.
    h : (n,) array
        The position that closes the loop.

    Notes
    -----
    States: plant, integral, last input and filtered slope of the controller, and the output that waits if delayed.
    Controller: with e = r - y, s its input (e, or y for P-PI), f+ = a f + (1 - a) (s - s_last) / T.
    """
    part, control = discrete_plant(axis, period), axis.controller
    n = len(part.gamma)
    integral, last, slope, pending = range(n, n + 4)
    size = n + 3 + part.delay
    x_and_r = np.eye(size + 1)  # a row over (x, r) for each of them
    seen = np.zeros(size + 1)
    seen[:n] = part.output
    error = x_and_r[size] - seen
    cascade = control.kind == "p-pi"
    source = seen if cascade else error
    keep = control.filter / (control.filter + period)
    slope_row = keep * x_and_r[slope] + (1.0 - keep) / period * (source - x_and_r[last])
    if cascade:
        wanted = control.position_gain * error - slope_row
        proportional, gain = control.velocity_kp * wanted, control.velocity_ki * period * wanted
    else:
        proportional, gain = control.kp * error + control.kd * slope_row, control.ki * period * error
    integral_row = x_and_r[integral] + gain
    volts = proportional + integral_row
    rows = np.zeros((size, size + 1))
    rows[integral], rows[last], rows[slope] = integral_row, source, slope_row
    if part.delay:
        rows[pending] = volts
    rows[:n] = part.phi @ x_and_r[:n] + np.outer(part.gamma, x_and_r[pending] if part.delay else volts)
    return rows[:, :size], rows[:, size], seen[:size]


def spectral_radius(axis: ServoAxis, period: float) -> float:
    """Return the largest modulus of the closed loop's poles; integrators that nothing drives (gain 0) are left out."""
    F, _, _ = closed_loop(axis, period)
    control = axis.controller
    if (control.velocity_ki if control.kind == "p-pi" else control.ki) == 0.0:  # the integral is no mode of the loop
        kept = np.arange(len(F)) != len(F) - 3 - control.delay
        F = F[np.ix_(kept, kept)]
    return float(np.max(np.abs(np.linalg.eigvals(F))))


def frequencies(period: float) -> Array:
    """Return the grid up to the Nyquist frequency of a period, s: (GRID,), rad/s."""
    top = math.pi / period
    out: Array = np.geomspace(LOWEST_SHARE * top, top * (1.0 - 1e-9), GRID)
    return out


def read_margins(grid: Array, loop: ComplexArray, closed: ComplexArray, radius: float) -> tuple[Margins, list[float]]:
    """Read the margins of a loop L and its closed loop off a grid, straight between its points.

    Parameters
    ----------
    grid : (n,) array
        Up to the Nyquist frequency, rad/s.
    loop, closed : (n,) complex array
        L and T there.
    radius : float
        Largest modulus of the poles.

    Returns
    -------
    Margins
        Without `stable_below` and `stable_above`.
    list of float
        All factors on the gain that put L on -1 somewhere.
    """
    at, share = _crossings(loop.imag)
    real, omega = (each[at] + share * (each[at + 1] - each[at]) for each in (loop.real, grid))
    gains = [(-1.0 / x, w) for x, w in zip(real.tolist(), omega.tolist(), strict=True) if x < 0.0]
    if loop.real[-1] < 0.0:  # L is real at the Nyquist frequency: it counts when negative
        gains.append((-1.0 / float(loop.real[-1]), float(grid[-1])))
    gain, gain_at = min((pair for pair in gains if pair[0] > 1.0), default=(math.inf, math.nan))
    fall, fall_at = max((pair for pair in gains if pair[0] < 1.0), default=(0.0, math.nan))
    at, share = _crossings(np.abs(loop) - 1.0)
    angles = np.degrees(np.angle(-(loop[at] + share * (loop[at + 1] - loop[at])))).tolist()
    phases = list(zip(angles, (grid[at] + share * (grid[at + 1] - grid[at])).tolist(), strict=True))
    phase, phase_at = min(phases, key=lambda pair: abs(pair[0]), default=(math.inf, math.nan))
    fallen = np.flatnonzero(np.abs(closed) < HALF_POWER)
    found = Margins(
        gain_margin=gain,
        gain_frequency=gain_at / (2.0 * math.pi),
        gain_reduction=fall,
        reduction_frequency=fall_at / (2.0 * math.pi),
        phase_margin=phase,
        phase_frequency=phase_at / (2.0 * math.pi),
        delay_margin=min((math.radians(each % 360.0) / w for each, w in phases), default=math.inf),
        sensitivity=float(1.0 / np.min(np.abs(1.0 + loop))),
        bandwidth=float(grid[fallen[0]]) / (2.0 * math.pi) if len(fallen) and fallen[0] else math.inf,
        spectral_radius=radius,
    )
    return found, sorted(factor for factor, _ in gains)


def _crossings(values: Array) -> tuple[IntArray, Array]:
    """Where values (n,) change sign, the place before and how far on, 0 to 1; also where one of them is 0."""
    at = np.flatnonzero((values[:-1] < 0.0) != (values[1:] < 0.0))
    share: Array = values[at] / (values[at] - values[at + 1])
    return at, share


def margins(axis: ServoAxis, period: float) -> Margins:
    """Return gain and phase margin, bandwidth and poles of the loop of an axis.

    Parameters
    ----------
    axis : ServoAxis
        With its controller, without feed-forward.
    period : float
        Of the servo, s.

    Returns
    -------
    Margins
        Of the linear loop, sampled, with its computing delay.

    Raises
    ------
    InputError
        For a period that is not positive and finite.

    Notes
    -----
    L = G H is the loop opened at the controller's output, G the plant behind a zero-order hold.

    References
    ----------
    .. [1] docs/machines.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> found = sf.simulation.margins(sf.Machine.load("router").axes["x"], 1e-3)
    >>> found.verdict
    'stable: gain margin 14.8, phase margin 61.5 deg'
    """
    if not (math.isfinite(period) and period > 0.0):
        raise InputError(f"period is {period} s; it must be greater than 0 and finite")
    part = discrete_plant(axis, period)

    def measured(omega: Array) -> ComplexArray:
        return loop_responses(axis.controller, period, omega, part.response(omega))

    grid = frequencies(period)
    both = measured(grid)
    for _ in range(PASSES):
        loop, closed = both
        nearest = int(np.argmin(np.abs(1.0 + loop)))
        signs = (loop.imag, np.abs(loop) - 1.0, np.abs(closed) - HALF_POWER)
        beside = [max(nearest - 1, 0), min(nearest, len(grid) - 2)]
        near = np.unique(np.concatenate([beside, *(_crossings(values)[0] for values in signs)]))
        between = np.linspace(grid[near], grid[near + 1], PARTS + 1)[1:-1].ravel()
        order = np.argsort(np.append(grid, between))
        grid = np.append(grid, between)[order]
        both = np.append(both, measured(between), axis=1)[:, order]
    found, factors = read_margins(grid, both[0], both[1], spectral_radius(axis, period))
    if found.stable:
        return found
    below = next((g for g in reversed(factors) if g < 1.0 and _is_stable(axis, period, g, -1)), None)
    above = next((g for g in factors if g > 1.0 and _is_stable(axis, period, g, 1)), None)
    return replace(found, stable_below=below, stable_above=above)


def _is_stable(axis: ServoAxis, period: float, factor: float, side: int) -> bool:
    """Whether the loop is stable with its gains times a little more (side 1) or less (-1) than `factor`."""
    return spectral_radius(scaled(axis, factor * (1.0 + 1e-3 * side)), period) < 1.0


def scaled(axis: ServoAxis, factor: float) -> ServoAxis:
    """Return the axis with the gain of its loop times `factor`: gains of a PID, of a P-PI those of the speed loop."""
    names = GAINS["pid"] if axis.controller.kind == "pid" else ("velocity_kp", "velocity_ki")
    gains: dict[str, Any] = {name: factor * getattr(axis.controller, name) for name in names}
    return replace(axis, controller=replace(axis.controller, **gains))


@dataclass(frozen=True)
class Bound:
    """Least margins of a loop; all of them must hold, and the loop must be stable.

    Parameters
    ----------
    gain_margin : float, optional
        Factor by which the gain may rise, and fall where a fall can make it unstable; 2 is 6 dB.
    phase_margin : float, optional
        deg.
    sensitivity : float, optional
        Largest |1 / (1 + L)|: 1 / sensitivity is the least distance of L from -1.

    Raises
    ------
    InputError
        For a gain margin or sensitivity that is not above 1, and a phase margin that is not between 0 and 90 deg.

    References
    ----------
    .. [1] docs/tune.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.simulation.Bound(phase_margin=50).words
    'gain margin at least 6.02 dB, phase margin at least 50 deg, sensitivity at most 2'
    """

    gain_margin: float = 2.0
    phase_margin: float = 40.0
    sensitivity: float = 2.0

    def __post_init__(self) -> None:
        for name, least, most in (
            ("gain_margin", 1.0, math.inf),
            ("phase_margin", 0.0, 90.0),
            ("sensitivity", 1.0, math.inf),
        ):
            if not least < getattr(self, name) < most:
                raise InputError(f"{name} is {getattr(self, name)}; it must lie between {least:g} and {most:g}")

    def slacks(self, found: Margins) -> Array:
        """Return how far margins are within the bound.

        Parameters
        ----------
        found : Margins
            Of a loop.

        Returns
        -------
        (5,) array
            Of gain margin, gain reduction, phase margin, sensitivity and poles: 0 or more where the bound holds.
            Natural logarithms of the ratios of gains and sensitivity, the ratio less 1 of the phase margin.
        """
        over = (1.0 - found.spectral_radius) / RADIUS_SCALE
        slacks = (
            math.log(found.gain_margin / self.gain_margin),
            -math.log(found.gain_reduction * self.gain_margin) if found.gain_reduction > 0.0 else MOST_SLACK,
            abs(found.phase_margin) / self.phase_margin - 1.0,
            math.log(self.sensitivity / found.sensitivity),
            over if found.stable else over - RADIUS_SCALE,
        )
        out: Array = np.clip(np.array(slacks), -MOST_SLACK, MOST_SLACK)
        return out

    @property
    def words(self) -> str:
        """The bound in words."""
        return (
            f"gain margin at least {20.0 * math.log10(self.gain_margin):.3g} dB, phase margin at least "
            f"{self.phase_margin:g} deg, sensitivity at most {self.sensitivity:g}"
        )


def quick_slacks(axis: ServoAxis, period: float, bound: Bound) -> Callable[[ServoAxis], Array]:
    """Make a function that gives the slacks of an axis with any gains in half a millisecond.

    Parameters
    ----------
    axis : ServoAxis
        The axis.
    period : float
        Of the servo, s.
    bound : Bound
        See `Bound.slacks`.

    Returns
    -------
    callable
        From a ServoAxis that differs in its controller's gains to slacks (5,).

    Notes
    -----
    Crossings are straight between the points of the grid, some 1e-4 off; `Bound.slacks` of `margins` is exact.
    """
    grid = frequencies(period)
    plant_response = discrete_plant(axis, period).response(grid)

    def slacks(other: ServoAxis) -> Array:
        loop, closed = loop_responses(other.controller, period, grid, plant_response)
        return bound.slacks(read_margins(grid, loop, closed, spectral_radius(other, period))[0])

    return slacks
