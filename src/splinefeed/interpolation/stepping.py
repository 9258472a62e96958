"""The steps of the published methods, and what they share: du/dt, the pull onto the arc length, the first steps.

Every method is one function, compiled by Numba:

    step(u, rate, law, period, curve, corrections, tolerance, memory) -> next u

    u, rate      (4,)  the last four parameters and du/dt there, newest first: u[0] = u_k, u[1] = u_{k-1}, ...
    law          (5,)  NEXT_S, FEED, HALF_FEED, NEXT_FEED, ACCELERATION: see below
    period             time from tick k to tick k+1, s
    curve              its table, cursor and shape: handed on to the functions below
    corrections, tolerance the user's settings of a predictor-corrector
    memory       (12,) the method's own, all zero at the start of every curve
"""

from __future__ import annotations

import math
from collections.abc import Callable

from splinefeed.kernels.jit import hot_kernel, kernel
from splinefeed.kernels.layout import HIGH, LOW, MIDDLE, SCALE, START, Shape
from splinefeed.kernels.pieces import arc_length, fitted_speed, parameter_in_row, secant, speed, walk_to
from splinefeed.records import Array, IntArray

#: Places in `law`: s at tick k+1, mm; feed at tick k, half-way and at k+1, mm/s; acceleration at tick k, mm/s^2.
NEXT_S, FEED, HALF_FEED, NEXT_FEED, ACCELERATION = 0, 1, 2, 3, 4
#: Chord over wanted length up to which 2 - r stands for 1 / r in Tsai and Cheng's corrector.
FAR_OFF = 1.5
#: Table of pieces, (3,) row and the first and the last one it can be, and shape; see `kernels.layout`.
Curve = tuple[Array, IntArray, Shape]
#: Docstring of a step that is made of coefficients.
_DOC = "{}.\n\nReferences\n----------\n.. [1] {}"
#: Weights of four values, newest first.
Four = tuple[float, float, float, float]


@hot_kernel
def rate_in_row(t: float, feed: float, table: Array, row: int, shape: Shape) -> float:
    """Return du/dt = V / |C'(u)|, the f of eq. (23) and (24), at feed V, mm/s, at t of one row; 0 at rest."""
    if feed == 0.0:
        return 0.0
    size = speed(table, row, shape, t)
    return feed / size if size > 0.0 else math.inf


@hot_kernel
def rate_at(u: float, feed: float, curve: Curve) -> float:
    """Return du/dt at parameter u and feed, mm/s: `rate_in_row` in the row that holds it."""
    table, cursor, shape = curve
    row = walk_to(table, cursor, LOW, u)
    return rate_in_row((u - table[row, MIDDLE]) * table[row, SCALE], feed, table, row, shape)


@hot_kernel
def step_length(law: Array, period: float) -> float:
    """Return the law's way from tick k to k+1, mm, by Simpson's rule on the feed: exact on pieces of constant jerk."""
    return period / 6.0 * (law[FEED] + 4.0 * law[HALF_FEED] + law[NEXT_FEED])


@hot_kernel
def anchored(u: float, s: float, curve: Curve) -> float:
    """Return the parameter whose arc length is s, mm: Newton on S(u) = s from the guess u.

    The row where it lies stays in the cursor of `curve`.
    """
    table, cursor, _ = curve
    row = walk_to(table, cursor, START, s)
    guess = (u - table[row, MIDDLE]) * table[row, SCALE]
    return table[row, MIDDLE] + parameter_in_row(table, row, s, guess) / table[row, SCALE]


@kernel
def placed(u: float, s: float, curve: Curve) -> float:
    """Call `anchored`, for what happens once a curve: copies of it everywhere would take long to compile."""
    return anchored(u, s, curve)


def taylor(order: int, source: str) -> Callable[..., float]:
    """Make the step by the first terms of u_{k+1} = u_k + T u' + T^2 u'' / 2 + T^3 u''' / 6.

    Parameters
    ----------
    order : int
        How many terms, 1 to 3.
    source : str
        The paper, for the step's docstring.

    Returns
    -------
    callable
        The step.

    Notes
    -----
    The derivatives of u by time are

        u' = V / g,  u'' = A / g - V^2 g' / g^3,  u''' = J / g - 3 A V g' / g^3 - V^3 g'' / g^4 + 3 V^3 g'^2 / g^5

    g = |C'| and its derivatives by u are those of the arc-length table; V, A and J the feed and its derivatives. J is
    2 (V_{k+1} - V_k - A T) / T^2, exact where the jerk is constant, of order T elsewhere: the order stays 3. Eq. (3) of
    the paper is order 2, without the slips of its print. Where C' = 0 the result is not finite: the loop replaces it.
    """

    def step(
        u: Array,
        rate: Array,
        law: Array,
        period: float,
        curve: Curve,
        corrections: int,
        tolerance: float,
        memory: Array,
    ) -> float:
        if order == 1:
            return u[0] + period * rate[0]
        table, cursor, _ = curve
        row = walk_to(table, cursor, LOW, u[0])
        scale = table[row, SCALE]
        size, slope, bend = fitted_speed(table, row, (u[0] - table[row, MIDDLE]) * scale)
        inverse = 1.0 / (size * scale)
        slope *= scale * scale
        feed = law[FEED]
        acceleration = law[ACCELERATION]
        ahead = feed * inverse
        terms = 0.5 * inverse * (acceleration - ahead * ahead * slope)
        if order == 3:
            bend *= scale * scale * scale
            jerk = 2.0 * (law[NEXT_FEED] - feed - acceleration * period) / (period * period)
            third = jerk - 3.0 * acceleration * ahead * inverse * slope
            third += ahead * ahead * ahead * (3.0 * slope * slope * inverse - bend)
            terms += period / 6.0 * inverse * third
        return u[0] + period * (rate[0] + period * terms)

    step.__doc__ = _DOC.format(f"Step by {order} term(s) of the Taylor series", source)
    return hot_kernel(step)


def predictor_corrector(
    before: Four, weights: Four, corrected: Four, new: float, old: Four, source: str
) -> Callable[..., float]:
    """Make the step that predicts by four past values, then corrects.

    Parameters
    ----------
    before, weights, corrected, old : tuple of 4 floats
        Coefficients of past values and rates, newest first.
    new : float
        Coefficient of the new rate.
    source : str
        The paper, for the step's docstring.

    Returns
    -------
    callable
        The step.

    Notes
    -----
    Predictor and corrector are

        u_{k+1} = sum_i before_i u_{k-i} + T sum_i weights_i f_{k-i}
        u_{k+1} = sum_i corrected_i u_{k-i} + T (new f_{k+1} + sum_i old_i f_{k-i})

    The step corrects `corrections` times, or until u moves by at most `tolerance`.
    """
    (a0, a1, a2, a3), (b0, b1, b2, b3) = before, weights
    (c0, c1, c2, c3), (d0, d1, d2, d3) = corrected, old

    def step(
        u: Array,
        rate: Array,
        law: Array,
        period: float,
        curve: Curve,
        corrections: int,
        tolerance: float,
        memory: Array,
    ) -> float:
        after = a0 * u[0] + a1 * u[1] + a2 * u[2] + a3 * u[3]
        after += period * (b0 * rate[0] + b1 * rate[1] + b2 * rate[2] + b3 * rate[3])
        known = c0 * u[0] + c1 * u[1] + c2 * u[2] + c3 * u[3]
        known += period * (d0 * rate[0] + d1 * rate[1] + d2 * rate[2] + d3 * rate[3])
        for _ in range(corrections):
            guess = after
            after = known + period * new * rate_at(guess, law[NEXT_FEED], curve)
            if abs(after - guess) <= tolerance:
                break
        return after

    step.__doc__ = _DOC.format("Predict by past values, then correct", source)
    return hot_kernel(step)


#: u_{k+1} = u_{k-3} + (4 T / 3) (2 f_k - f_{k-1} + 2 f_{k-2}), eq. (23)
_MILNE: tuple[Four, Four] = (0.0, 0.0, 0.0, 1.0), (8.0 / 3.0, -4.0 / 3.0, 8.0 / 3.0, 0.0)
#: Eq. (23), then eq. (24): u_{k+1} = u_{k-1} + (T / 3) (f_{k+1} + 4 f_k + f_{k-1}). Nothing damps its second root at
#: -1, so every kick stays as a ripple that changes sign at each tick; see docs/math/milne-simpson.md.
milne_simpson = predictor_corrector(
    *_MILNE, (0.0, 1.0, 0.0, 0.0), 1.0 / 3.0, (4.0 / 3.0, 1.0 / 3.0, 0.0, 0.0),
    "S. Alimohammadi, B. Motakef Imani, Modares Mechanical Engineering 15(13), 2015, p. 158-162, whose print of both "
    "equations has slips in signs and factors.",
)  # fmt: skip
#: u_{k+1} = (9 u_k - u_{k-2} + 3 T (f_{k+1} + 2 f_k - f_{k-1})) / 8: other roots die out. His modifier, which takes the
#: estimated error off, is left out, so that this method and `milne_simpson` differ in their corrector alone.
hamming = predictor_corrector(
    *_MILNE, (1.125, 0.0, -0.125, 0.0), 0.375, (0.75, -0.375, 0.0, 0.0),
    'R. W. Hamming, "Stable predictor-corrector methods for ordinary differential equations", Journal of the ACM 6(1), '
    "1959, doi 10.1145/320954.320958.",
)  # fmt: skip
adams_bashforth_moulton = predictor_corrector(
    (1.0, 0.0, 0.0, 0.0), (55.0 / 24.0, -59.0 / 24.0, 37.0 / 24.0, -9.0 / 24.0),
    (1.0, 0.0, 0.0, 0.0), 9.0 / 24.0, (19.0 / 24.0, -5.0 / 24.0, 1.0 / 24.0, 0.0),
    "Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., eq. III.1.5 and III.1.9.",
)  # fmt: skip


@hot_kernel
def milne_simpson_anchored(
    u: Array, rate: Array, law: Array, period: float, curve: Curve, corrections: int, tolerance: float, memory: Array
) -> float:
    """Step by eq. (23) and (24), then by Newton on S(u) = l(t_{k+1}) from there: drift and ripple go to rounding.

    Notes
    -----
    The history that the next step reads is that of the anchored points.

    References
    ----------
    .. [1] S. Alimohammadi, B. Motakef Imani, Modares Mechanical Engineering 15(13), 2015, p. 158-162; the
       correction by the arc length is this project's.
    """
    guess = milne_simpson(u, rate, law, period, curve, corrections, tolerance, memory)
    return anchored(guess, law[NEXT_S], curve)


@kernel
def runge_kutta_4(
    u: Array, rate: Array, law: Array, period: float, curve: Curve, corrections: int, tolerance: float, memory: Array
) -> float:
    """Step by the classical method of order 4 for du/dt = V(t) / |C'(u)|; it also starts the multistep methods.

    Notes
    -----
    u_{k+1} = u_k + (T / 6) (k_1 + 2 k_2 + 2 k_3 + k_4), with the feed taken at half a period.

    References
    ----------
    .. [1] Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., table 1.2.
    """
    k1 = rate[0]
    k2 = rate_at(u[0] + 0.5 * period * k1, law[HALF_FEED], curve)
    k3 = rate_at(u[0] + 0.5 * period * k2, law[HALF_FEED], curve)
    k4 = rate_at(u[0] + period * k3, law[NEXT_FEED], curve)
    return u[0] + period / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@hot_kernel
def tsai_cheng(
    u: Array, rate: Array, law: Array, period: float, curve: Curve, corrections: int, tolerance: float, memory: Array
) -> float:
    """Predict by differences, then compensate the parameter `corrections` times by the feed that its chord has.

    Notes
    -----
    Predictor and compensation are

        u_{k+1} = 3 u_k - 3 u_{k-1} + u_{k-2}
        u_{k+1} = u_{k+1} + (1 - r) (u_{k+1} - u_k),  r = |C(u_{k+1}) - C(u_k)| / (V T)

    r = V_i / V is the feed of the last pass over the feed wanted, V T the law's way from tick to tick. A prediction
    that is not ahead is replaced by u_k + V T / |C'(u_k)|, and a step more than half too long is divided by r. As the
    chord is shorter than its arc, the tool runs ahead by kappa^2 (V T)^3 / 24 each tick: order 2. This is a reading
    of the published scheme: the paper's own predictor has settings that are not used here.

    References
    ----------
    .. [1] M.-C. Tsai, C.-W. Cheng, "A real-time predictor-corrector interpolator for CNC machining", ASME Journal of
       Manufacturing Science and Engineering 125(3), 2003, p. 449-460, doi 10.1115/1.1578670 (the
       journal's page was seen, the DOI itself was not).
    """
    table, cursor, shape = curve
    wanted = step_length(law, period)
    if wanted <= 0.0:
        return u[0]
    now = walk_to(table, cursor, LOW, u[0])
    t = (u[0] - table[now, MIDDLE]) * table[now, SCALE]
    ahead = 2.0 * (u[0] - u[1]) - (u[1] - u[2])
    if ahead <= 0.0:
        ahead = rate_at(u[0], wanted, curve)
    for _ in range(corrections):
        row = walk_to(table, cursor, LOW, u[0] + ahead)
        t_ahead = (u[0] + ahead - table[row, MIDDLE]) * table[row, SCALE]
        chord, _, _ = secant(table, now, t, row, t_ahead, shape)
        ratio = math.sqrt(chord) / wanted
        before = ahead
        ahead = before * (2.0 - ratio) if ratio <= FAR_OFF else before / ratio
        if abs(ahead - before) <= tolerance:
            break
    return u[0] + ahead


@hot_kernel
def runge_kutta_2_compensated(
    u: Array, rate: Array, law: Array, period: float, curve: Curve, corrections: int, tolerance: float, memory: Array
) -> float:
    """Predict by Runge-Kutta 2, then move u, `corrections` times, so that the chord of the step is V T.

    Notes
    -----
    Predictor and compensation are

        u_{k+1} = u_k + (T / 2) (f(u_k) + f(u_k + T f(u_k)))
        u_{k+1} = u_{k+1} + (-D.C' + sqrt((D.C')^2 - C'.C' (D.D - (V T)^2))) / C'.C'

    D = C(u_{k+1}) - C(u_k), C' at u_{k+1}: the place where the tangent there cuts the circle of radius V T about the
    last point; V T is the law's way from tick to tick. As the chord is shorter than its arc, the tool runs ahead by
    kappa^2 (V T)^3 / 24 each tick: order 2. The compensation is that of [2]_.

    References
    ----------
    .. [1] K. Erwinski, A. Wawrzak, M. Paprocki, "Real-time jerk limited feedrate profiling and interpolation for linear
       motor multiaxis machines using NURBS toolpaths", IEEE Transactions on Industrial Informatics 18(11), 2022,
       p. 7560-7571, doi 10.1109/TII.2022.3147806.
    .. [2] S.-S. Yeh, P.-L. Hsu, "The speed-controlled interpolator for machining parametric curves", Computer-Aided
       Design 31(5), 1999, p. 349-357.
    """
    table, cursor, shape = curve
    wanted = step_length(law, period)
    now = walk_to(table, cursor, LOW, u[0])
    t = (u[0] - table[now, MIDDLE]) * table[now, SCALE]
    after = u[0] + 0.5 * period * (rate[0] + rate_at(u[0] + period * rate[0], law[NEXT_FEED], curve))
    for _ in range(corrections):
        row = walk_to(table, cursor, LOW, after)
        chord, product, square = secant(table, now, t, row, (after - table[row, MIDDLE]) * table[row, SCALE], shape)
        inside = product * product - square * (chord - wanted * wanted)
        if not inside >= 0.0 or square == 0.0:
            break  # the tangent misses the circle, or there is none: nothing to compensate by
        moved = (math.sqrt(inside) - product) / square
        after += moved
        if abs(moved) <= tolerance:
            break
    return after


#: Coefficients of a polynomial of degree 7.
TERMS = 8
#: Places inside a piece, evenly spread over its parameter, at which the two free coefficients are fitted.
SAMPLES = 15
#: Places in `memory` behind the coefficients: the row that they belong to, plus 1, and its length, mm.
FITTED, LENGTH = TERMS, TERMS + 1


@kernel
def fit_feed_correction(table: Array, row: int, out: Array) -> float:
    """Fit the coefficients of t(x) = sum_k c_k x^k, x = (s - START) / L in [0, 1], of one row.

    Parameters
    ----------
    table : array
        Of pieces; see `kernels.layout`.
    row : int
        The row.
    out : (8,) array
        Filled with the coefficients.

    Returns
    -------
    float
        Length L of the row, mm.

    Notes
    -----
    Value, slope and second derivative are those of the inverse of S at both ends, dt/dx = L / S' and d2t/dx2 =
    -L^2 S'' / S'^3: a quintic q. What is left, x^3 (1 - x)^3 (a + b x), goes by least squares through the places
    t_i, x_i = (S(t_i) - START) / L. Where S' = 0 at an end the numbers are not finite.
    """
    low = (table[row, LOW] - table[row, MIDDLE]) * table[row, SCALE]
    high = (table[row, HIGH] - table[row, MIDDLE]) * table[row, SCALE]
    length = arc_length(table, row, high) - table[row, START]
    speed, bend, _ = fitted_speed(table, row, low)
    slope_low = length / speed
    bend_low = -slope_low * slope_low * bend / speed
    speed, bend, _ = fitted_speed(table, row, high)
    slope_high = length / speed
    bend_high = -slope_high * slope_high * bend / speed

    # the quintic with these six values
    rise = high - low - slope_low - 0.5 * bend_low
    turn = slope_high - slope_low - bend_low
    curl = bend_high - bend_low
    out[0] = low
    out[1] = slope_low
    out[2] = 0.5 * bend_low
    out[3] = 10.0 * rise - 4.0 * turn + 0.5 * curl
    out[4] = -15.0 * rise + 7.0 * turn - curl
    out[5] = 6.0 * rise - 3.0 * turn + 0.5 * curl

    # normal equations of a and b
    plain, mixed, steep, rest, rest_steep = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(SAMPLES):
        t = low + (high - low) * (i + 1) / (SAMPLES + 1)
        x = (arc_length(table, row, t) - table[row, START]) / length
        quintic = out[5]
        for k in range(4, -1, -1):
            quintic = quintic * x + out[k]
        bump = (x * (1.0 - x)) ** 3
        plain += bump * bump
        mixed += bump * bump * x
        steep += bump * bump * x * x
        rest += bump * (t - quintic)
        rest_steep += bump * x * (t - quintic)
    below = plain * steep - mixed * mixed
    a = (rest * steep - rest_steep * mixed) / below
    b = (rest_steep * plain - rest * mixed) / below
    out[3] += a
    out[4] += b - 3.0 * a
    out[5] += 3.0 * (a - b)
    out[6] = 3.0 * b - a
    out[7] = -b
    return length


@hot_kernel
def feed_correction(
    u: Array, rate: Array, law: Array, period: float, curve: Curve, corrections: int, tolerance: float, memory: Array
) -> float:
    """Step by u_{k+1} = p(l(t_{k+1})), p of degree 7, the inverse of S.

    Notes
    -----
    p has value, slope and second derivative of the inverse of S at both ends of a piece.
    The published method fits one polynomial a spline segment and splits those that are too far off; here it is one a
    piece of the arc-length table, when a tick first meets it.

    References
    ----------
    .. [1] K. Erkorkmaz, Y. Altintas, "Quintic spline interpolation with minimal feed fluctuation", ASME Journal of
       Manufacturing Science and Engineering 127(2), 2005, p. 339-349, doi 10.1115/1.1830493 (the
       journal's page was seen, the DOI itself was not).
    """
    table, cursor, _ = curve
    s = law[NEXT_S]
    row = walk_to(table, cursor, START, s)
    if memory[FITTED] != row + 1.0:
        memory[LENGTH] = fit_feed_correction(table, row, memory[:TERMS])
        memory[FITTED] = row + 1.0
    x = (s - table[row, START]) / memory[LENGTH]
    t = memory[TERMS - 1]
    for k in range(TERMS - 2, -1, -1):
        t = t * x + memory[k]
    return table[row, MIDDLE] + t / table[row, SCALE]
