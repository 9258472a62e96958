"""An axis as the kernels take it: state equations, exact step matrices for every sub-step, and parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.kernels import mechanics
from splinefeed.machine.parts import ServoAxis
from splinefeed.records import Array

#: Sub-steps of a period for the nonlinear model by default: at 1 ms a step of half a millisecond,
#: exact for all that is linear and of fourth order for the curve of friction.
SUB_STEPS = 2
#: Norm of a matrix below which TAYLOR_TERMS terms give its exponential to rounding: 2^-60 / 10! < 1e-24.
SMALL_NORM = 2.0**-6
TAYLOR_TERMS = 9


@dataclass(frozen=True, eq=False)
class Plant:
    """State equations of an axis: dz/dt = A z + B u + N n(y),  y = C z + D u; states as in `kernels.mechanics`.

    Attributes
    ----------
    A : (6, 6) array
        Of states, 1/s.
    B : (6,) array
        Of the input, a volt.
    N : (6, 3) array
        Of forces that are not linear, a newton or N*m.
    C : (3, 6) array
        Outputs of states.
    D : (3,) array
        Outputs of the input.
    """

    A: Array
    B: Array
    N: Array
    C: Array
    D: Array


def plant(axis: ServoAxis) -> Plant:
    """Return the state equations of an axis, in mm or rad, N or N*m, s and V.

    Parameters
    ----------
    axis : ServoAxis
        With motor, drive, transmission and load.

    Returns
    -------
    Plant
        A (6, 6), B (6,), N (6, 3), C (3, 6), D (3,).

    Notes
    -----
    Velocity drive: w' = (k u - w) / lag is the speed wanted, f = m w' + K (w - v) + K_i i the force, i' = w - v the
    integral; with K = m b and K_i = m b^2 / 4 for the bandwidth b both closed-loop poles lie at -b / 2. Without
    friction v = w holds exactly: gain and first-order lag. A cut-off force e = clamp(f) - f also goes into i' as e / K.
    Torque drive: f' = (k u - f) / lag. Two masses: spring and damper between motor and load.
    """
    A = np.zeros((mechanics.STATES, mechanics.STATES))
    B = np.zeros(mechanics.STATES)
    N = np.zeros((mechanics.STATES, mechanics.CHANNELS))
    C = np.zeros((mechanics.CHANNELS, mechanics.STATES))
    D = np.zeros(mechanics.CHANNELS)
    stiffness = axis.transmission.stiffness
    total = axis.motor_inertia + axis.load_inertia
    driven = total if stiffness is None else axis.motor_inertia
    motor, speed, drive, integral = mechanics.MOTOR, mechanics.MOTOR_SPEED, mechanics.DRIVE, mechanics.DRIVE_INTEGRAL
    A[motor, speed] = 1.0
    force, force_of_volts = np.zeros(mechanics.STATES), 0.0
    if axis.drive.mode == "velocity":
        gain = float(axis.drive.speed_per_volt or 0.0)
        bandwidth = float(axis.drive.bandwidth or 0.0)
        A[drive, drive] = -1.0 / axis.drive.lag
        B[drive] = gain / axis.drive.lag
        stiff = total * bandwidth
        force[drive] = stiff - total / axis.drive.lag
        force[speed] = -stiff
        force[integral] = 0.25 * total * bandwidth * bandwidth
        force_of_volts = total * gain / axis.drive.lag
        A[integral, drive] = 1.0
        A[integral, speed] = -1.0
        N[integral, mechanics.LIMIT] = 1.0 / stiff
    else:
        A[drive, drive] = -1.0 / axis.drive.lag
        B[drive] = force_per_volt(axis) / axis.drive.lag
        force[drive] = 1.0
    A[speed] += force / driven
    B[speed] += force_of_volts / driven
    N[speed, mechanics.LIMIT] = 1.0 / driven
    C[mechanics.LIMIT] = force
    D[mechanics.LIMIT] = force_of_volts
    rubbing, mass = speed, driven  # what rubs on the guide
    if stiffness is not None:
        load, rubbing, mass = mechanics.LOAD, mechanics.LOAD_SPEED, axis.load_inertia
        A[load, rubbing] = 1.0
        for row, inertia, sign in ((speed, axis.motor_inertia, -1.0), (rubbing, mass, 1.0)):
            A[row, motor] += sign * stiffness / inertia
            A[row, load] -= sign * stiffness / inertia
            A[row, speed] += sign * axis.transmission.damping / inertia
            A[row, rubbing] -= sign * axis.transmission.damping / inertia
            N[row, mechanics.PLAY] = -sign / inertia
        C[mechanics.PLAY, [motor, load]] = 1.0, -1.0
    A[rubbing, rubbing] -= axis.friction.viscous / mass
    N[rubbing, mechanics.FRICTION] = 1.0 / mass
    C[mechanics.FRICTION, rubbing] = 1.0
    return Plant(A, B, N, C, D)


def force_per_volt(axis: ServoAxis) -> float:
    """Return the force at the axis for one volt of a torque drive, N/V or N*m/V."""
    return float(axis.drive.force_per_volt or 0.0) * axis.force_per_motor_force


def seen_resolution(axis: ServoAxis) -> float:
    """Return one count of what closes the loop, the scale or the encoder, mm or rad."""
    if axis.controller.feedback == "scale" and axis.scale is not None:
        return axis.scale.resolution
    return axis.encoder_resolution


def exponentials_less_one(matrix: Array, halvings: int) -> list[Array]:
    """Return exp(M / 2^k) - 1 for k = 0 ... halvings.

    Parameters
    ----------
    matrix : (n, n) array
        M.
    halvings : int
        The last k.

    Returns
    -------
    list of (n, n) array
        The largest part first.

    Notes
    -----
    The Taylor series of a small enough part, then exp(2 X) - 1 = 2 D + D^2 with D = exp(X) - 1: small parts keep all
    their digits, and there is no linear system to solve: scaling and squaring, methods 1 and 3 of [1]_.

    References
    ----------
    .. [1] C. Moler and C. Van Loan, SIAM Review 45 (2003) 3-49, doi:10.1137/S00361445024180.
    """
    norm = float(np.max(np.sum(np.abs(matrix), axis=1)))
    depth = max(halvings, math.ceil(math.log2(max(norm / SMALL_NORM, 1.0))))
    part = matrix / 2.0**depth
    rest = part.copy()
    for k in range(TAYLOR_TERMS, 1, -1):  # Horner: X (1 + X/2 (1 + X/3 (...)))
        rest = part + (part @ rest) / k
    found = [rest]
    for _ in range(depth):
        found.append(2.0 * found[-1] + found[-1] @ found[-1])
    return found[::-1][: halvings + 1]


def zero_order_hold(A: Array, B: Array, period: float) -> tuple[Array, Array]:
    """Return Phi = exp(A T) and Gamma = int_0^T exp(A s) ds B, from one exponential of the augmented matrix [1]_.

    Parameters
    ----------
    A : (n, n) array
        1/s.
    B : (n,) array
        Of the input.
    period : float
        T, s.

    Returns
    -------
    Phi : (n, n) array
        Of the state.
    Gamma : (n,) array
        Of the input.

    References
    ----------
    .. [1] C. F. Van Loan, IEEE Trans. Automatic Control 23 (1978) 395-404, doi:10.1109/TAC.1978.1101743.
    """
    n = len(B)
    augmented = np.zeros((n + 1, n + 1))
    augmented[:n, :n] = A * period
    augmented[:n, n] = B * period
    both = exponentials_less_one(augmented, 0)[0]
    return np.eye(n) + both[:n, :n], both[:n, n]


def _interpolated(whole: Array, shape: tuple[int, int], step: float) -> tuple[Array, Array, Array]:
    """Phi (6, 6), Gamma (6,) and weights (node, 6, channel) of inputs that are quadratic over [0, step].

    whole: exp(chain t) - 1 of dz/dt = A z + N n + B u, dn/dt = n', dn'/dt = n'' at the end, or middle, of the step.
    n' = (-3 n_0 + 4 n_m - n_1) / h,  n'' = 4 (n_0 - 2 n_m + n_1) / h^2.
    """
    states, channels = shape
    value, slope, bend = (
        whole[:states, states + i * channels : states + (i + 1) * channels] / step**i for i in range(3)
    )
    weights = np.array([value - 3.0 * slope + 4.0 * bend, 4.0 * slope - 8.0 * bend, 4.0 * bend - slope])
    return np.eye(states) + whole[:states, :states], whole[:states, -1], weights


def step_table(model: Plant, period: float, sub_steps: int = SUB_STEPS) -> Array:
    """Return the step matrices of `kernels.mechanics`, a row each: the whole period, then each halving of a sub-step.

    Parameters
    ----------
    model : Plant
        Of the axis.
    period : float
        Of the servo, s.
    sub_steps : int, optional
        Of a period.

    Returns
    -------
    (TABLE_ROWS, TABLE_WIDTH) array
        As the kernel reads it.
    """
    C, D = model.C, model.D
    between = np.zeros(mechanics.OUTPUTS - mechanics.WEIGHTS)  # a whole period has no nonlinear inputs
    phi, gamma = zero_order_hold(model.A, model.B, period)
    rows = [np.concatenate([phi.T.ravel(), gamma, between, C.ravel(), D])]
    rubbing = int(np.flatnonzero(C[mechanics.FRICTION])[0])
    states, channels = model.N.shape
    chain = np.zeros((states + 3 * channels + 1, states + 3 * channels + 1))
    chain[:states, :states] = model.A
    chain[:states, states : states + channels] = model.N
    chain[:states, -1] = model.B
    chain[states : states + 2 * channels, states + channels : -1] = np.eye(2 * channels)
    for sticking in (False, True):
        if sticking:  # the mass that friction holds does not move
            chain[rubbing] = 0.0
        step = period / sub_steps
        wholes = exponentials_less_one(chain * step, mechanics.LEVELS + 1)
        for level in range(mechanics.LEVELS + 1):
            phi, gamma, weights = _interpolated(wholes[level], model.N.shape, step)
            half_phi, half_gamma, half_weights = _interpolated(wholes[level + 1], model.N.shape, step)
            middle, end = (np.einsum("ci,nij->cnj", C, each) for each in (half_weights, weights))
            row = [phi.T, gamma, weights.transpose(0, 2, 1), C @ half_phi, C @ half_gamma + D, middle, end, C, D]
            rows.append(np.concatenate([each.ravel() for each in row]))
            step *= 0.5
    return np.array(rows)


def parameters(axis: ServoAxis, period: float, sub_steps: int = SUB_STEPS, *, linear: bool = False) -> Array:
    """Return the parameters of an axis in the order of `kernels.mechanics`.

    Parameters
    ----------
    axis : ServoAxis
        The axis.
    period : float
        Of the servo, s.
    sub_steps : int, optional
        Of a period.
    linear : bool, optional
        Whether dry friction, backlash, counts, codes and limits of torque, speed and output are left out; the error
        limit stays.

    Returns
    -------
    (PARAMETERS,) array
        As the kernel reads it.
    """
    control, friction = axis.controller, axis.friction
    out = np.zeros(mechanics.PARAMETERS)
    cascade = control.kind == "p-pi"
    out[mechanics.PERIOD] = period
    out[mechanics.CASCADE] = cascade
    out[mechanics.KP] = control.position_gain if cascade else control.kp
    out[mechanics.KI] = control.ki
    out[mechanics.KD] = control.kd
    out[mechanics.FILTER] = control.filter / (control.filter + period)
    out[mechanics.VELOCITY_FORWARD] = control.velocity_feed_forward / (control.velocity_kp if cascade else 1.0)
    out[mechanics.ACCELERATION_FORWARD] = control.acceleration_feed_forward
    out[mechanics.VELOCITY_KP] = control.velocity_kp
    out[mechanics.VELOCITY_KI] = control.velocity_ki
    out[mechanics.OUTPUT_LIMIT] = control.output_limit
    out[mechanics.OUTPUT_STEP] = 2.0 * control.output_limit / 2**control.output_bits if control.output_bits else 0.0
    peak = axis.motor.peak_force * axis.force_per_motor_force
    velocity = axis.drive.mode == "velocity"
    if velocity:
        top_speed = axis.motor.rated_speed * axis.travel_per_motor
        out[mechanics.DRIVE_LIMIT] = top_speed / float(axis.drive.speed_per_volt or 1.0)
    else:
        out[mechanics.DRIVE_LIMIT] = peak / force_per_volt(axis)
    out[mechanics.DELAY] = control.delay
    out[mechanics.ON_LOAD] = control.feedback == "scale"
    out[mechanics.RESOLUTION] = seen_resolution(axis)
    out[mechanics.ERROR_LIMIT] = control.error_limit
    out[mechanics.SUB_STEPS] = sub_steps
    out[mechanics.COMPLIANT] = axis.transmission.stiffness is not None
    out[mechanics.COULOMB] = friction.coulomb
    static = friction.coulomb if friction.static is None else friction.static
    out[mechanics.STICTION] = static - friction.coulomb
    out[mechanics.INVERSE_STRIBECK] = 1.0 / friction.stribeck_speed if friction.stribeck_speed is not None else 0.0
    out[mechanics.FORCE_LIMIT] = peak if velocity else math.inf
    out[mechanics.HALF_PLAY] = 0.5 * axis.transmission.backlash
    out[mechanics.STIFFNESS] = axis.transmission.stiffness or 0.0
    out[mechanics.DAMPING] = axis.transmission.damping
    out[mechanics.NONLINEAR] = static > 0.0 or velocity or axis.transmission.backlash > 0.0
    if linear:
        out[[mechanics.NONLINEAR, mechanics.OUTPUT_STEP, mechanics.RESOLUTION, mechanics.HALF_PLAY]] = 0.0
        out[[mechanics.OUTPUT_LIMIT, mechanics.DRIVE_LIMIT, mechanics.FORCE_LIMIT]] = math.inf
    return out
