"""NACA 4-digit sections: the symmetric ones exactly as two spans of degree 8, the cambered ones fitted."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import InputError
from splinefeed.paths.corners import CORNER_ANGLE
from splinefeed.paths.fitting import fit_function
from splinefeed.paths.fitting.grid import check_degree
from splinefeed.paths.path import Path
from splinefeed.paths.shapes.curves import positive
from splinefeed.records import Array

#: Coefficients of y / (5 t c) as a polynomial in tau = sqrt(x / c). The last one closes the edge; the original -0.1015
#: leaves it 0.0021 t c thick.
THICKNESS: Array = np.array([0.0, 0.2969, -0.1260, 0.0, -0.3516, 0.0, 0.2843, 0.0, -0.1036])
HALF_THICKNESS = np.polynomial.Polynomial(THICKNESS)
#: Degree of the exact section.
EXACT_DEGREE = 8
#: Degree of fitted sections by default.
FITTED_DEGREE = 5
#: Chord if neither chord nor perimeter is given, mm.
DEFAULT_CHORD = 100.0


def naca(
    code: str = "0025",
    *,
    chord: float | None = None,
    perimeter: float | None = None,
    degree: int | None = None,
    tolerance: float = 1e-6,
) -> Path:
    """Make a NACA 4-digit section with a closed edge, from the edge over the upper side to the nose and back below.

    Parameters
    ----------
    code : str, optional
        Four digits m p tt: camber in percent of the chord, its place in tenths, thickness t in percent.
    chord : float, optional
        c, mm (100 unless chord or perimeter is given).
    perimeter : float, optional
        Length of the path, mm, met by scaling.
    degree : int, optional
        Of a fitted section; None: exact if symmetric, 5 if cambered.
    tolerance : float, optional
        Largest error of a fit at equal parameter, mm; an exact section needs none.

    Returns
    -------
    Path
        The paper's airfoil is naca("0025", perimeter=33).

    Raises
    ------
    InputError
        For a code or sizes that cannot be used.
    CurveError
        If a fit cannot hold the tolerance.

    Notes
    -----
    The section is

        y = 5 t c (0.2969 tau - 0.1260 tau^2 - 0.3516 tau^4 + 0.2843 tau^6 - 0.1036 tau^8),  x = c tau^2

    A symmetric section (00tt) is a polynomial in tau, hence exactly two spans of degree 8. They meet at the nose, where
    the radius is 1.1019 t^2 c, with C1 and equal curvature; the derivative of the curvature by arc length jumps there.
    A cambered section carries the thickness normal to its mean line. By that definition both sides have a kink where
    the mean line has its crest (3e-4 rad for 2412), which the fit rounds within the tolerance.

    References
    ----------
    .. [1] Jacobs, Ward, Pinkerton, NACA Report 460, 1933.
    .. [2] Abbott, von Doenhoff, Theory of Wing Sections, 1959, ch. 6.

    Examples
    --------
    >>> import splinefeed as sf
    >>> print(f"{sf.shapes.naca('0025', perimeter=33).length:.6f} mm")
    33.000000 mm
    """
    camber, place, thickness = _digits(code)
    if chord is not None and perimeter is not None:
        raise InputError("chord and perimeter are both given; each follows from the other")
    length = None if perimeter is None else positive(perimeter, "perimeter")
    size = positive(DEFAULT_CHORD if chord is None else chord, "chord")
    allowed = positive(tolerance, "tolerance")
    wanted = None if degree is None else check_degree(degree)
    unit = _exact(thickness)
    findings: tuple[str, ...] = ()
    if camber == 0.0 and (wanted is None or wanted >= EXACT_DEGREE):
        unit = unit if wanted is None else unit.elevated(wanted - EXACT_DEGREE)
        curve = unit.transformed(size)
    else:
        section = _Section(camber, place, thickness)
        # camber adds at most half to the perimeter; half the tolerance is kept for the scaling behind the fit
        size = size if length is None else length / unit.length
        curve, error = fit_function(
            lambda u: size * section(u),
            allowed if length is None else 0.5 * allowed,
            FITTED_DEGREE if wanted is None else wanted,
            (0.0, 1.0),
            (section.nose,),
            smoothness=2,
        )
        if length is not None:
            error *= length / curve.length
        spans = len(curve.breaks) - 1
        findings = (f"fitted by degree {curve.degree} with {spans} spans; largest error {error:.3g} mm",)
        if section.kink > CORNER_ANGLE:
            findings += (
                f"by its definition the section has a kink of {math.degrees(section.kink):.2g} deg at the crest of its "
                f"mean line; it is rounded within {allowed:g} mm, more gently with a larger tolerance",
            )
    if length is not None:
        for _ in range(2):  # twice, for the last digit
            curve = curve.transformed(length / curve.length)
    return Path([curve], name=f"naca{code}", findings=findings)


def _digits(code: str) -> tuple[float, float, float]:
    """Camber, its place and the thickness, as shares of the chord; InputError for what is no such code."""
    if not isinstance(code, str) or len(code) != 4 or not (code.isascii() and code.isdigit()):
        raise InputError(f"NACA code is {code!r}; expected four digits such as '0025' or '2412'")
    camber, place, thickness = int(code[0]) / 100.0, int(code[1]) / 10.0, int(code[2:]) / 100.0
    if thickness == 0.0:
        raise InputError(f"NACA code {code!r} has no thickness; its last two digits must be 01 or more")
    if camber > 0.0 and place == 0.0:
        raise InputError(f"NACA code {code!r} has camber but no position of it; its second digit must be 1 or more")
    return camber, place, thickness


def _exact(thickness: float) -> NurbsCurve:
    """The symmetric section of chord 1: two spans of degree 8 in v = -tau above and v = tau below, joined with C1."""
    power = np.zeros((EXACT_DEGREE + 1, 2))
    power[2, 0] = 1.0
    power[:, 1] = -5.0 * thickness * THICKNESS
    # Bernstein coefficients of the lower side: b_i = sum_k C(i, k) / C(8, k) a_k
    orders = range(EXACT_DEGREE + 1)
    lower = np.array([[math.comb(i, k) / math.comb(EXACT_DEGREE, k) for k in orders] for i in orders]) @ power
    lower[-1, 1] = 0.0  # the closed edge, where the coefficients cancel but for rounding
    upper = lower[::-1] * [1.0, -1.0]
    # the nose is the middle of its neighbours, and so no control point over a knot of multiplicity 7
    knots = np.repeat([0.0, 0.5, 1.0], [EXACT_DEGREE + 1, EXACT_DEGREE - 1, EXACT_DEGREE + 1])
    return NurbsCurve(EXACT_DEGREE, knots, np.concatenate([upper[:-1], lower[1:]]))


class _Section:
    """A section of chord 1 as a function of u in [0, 1], with a parameter in which it is as smooth as it can be.

    On either side tau = w + g w^2, which makes C'' continuous at the nose: there the second derivative by tau jumps
    along the tangent, in the ratio g = 0.1260 / 0.2969 to the first. Behind the crest of the mean line w runs by
    another factor that keeps |C'| continuous across the kink.
    """

    def __init__(self, camber: float, place: float, thickness: float) -> None:
        self.camber, self.place, self.thickness = camber, place, thickness
        self.bend = -float(THICKNESS[2] / THICKNESS[1])
        edge = self._inverse(1.0)
        self.crest = self._inverse(math.sqrt(place)) if camber > 0.0 else edge
        self.factors, self.kink = self._across_crest()
        upper, lower = (self.crest + (edge - self.crest) / factor for factor in self.factors)
        self.span = upper + lower
        self.nose = upper / self.span

    def _inverse(self, tau: float) -> float:
        """The w >= 0 with w + g w^2 = tau."""
        return (math.sqrt(1.0 + 4.0 * self.bend * tau) - 1.0) / (2.0 * self.bend)

    def _across_crest(self) -> tuple[tuple[float, float], float]:
        """|dC/dx| before over |dC/dx| behind the crest, on the upper and the lower side, and the larger kink, rad.

        At the crest the mean line is level, theta = 0, so that dC/dx = (1 -+ y theta', +- y') with theta' = yc''.
        """
        if self.camber == 0.0:
            return (1.0, 1.0), 0.0
        tau = math.sqrt(self.place)
        half = 5.0 * self.thickness * HALF_THICKNESS
        y, slope = half(tau), half.deriv()(tau) / (2.0 * tau)
        bends = -2.0 * self.camber / self.place**2, -2.0 * self.camber / (1.0 - self.place) ** 2
        factors, kinks = [], []
        for side in (1.0, -1.0):
            before, behind = (1.0 - side * y * bend for bend in bends)
            factors.append(math.hypot(before, slope) / math.hypot(behind, slope))
            kinks.append(abs(math.atan2(slope, before) - math.atan2(slope, behind)))
        return (factors[0], factors[1]), max(kinks)

    def __call__(self, u: Array) -> Array:
        """Points (n, 2) at u (n,)."""
        along = self.span * (u - self.nose)
        above = along < 0.0
        w = np.abs(along)
        behind = w > self.crest
        w = np.where(behind, self.crest + (w - self.crest) * np.where(above, *self.factors), w)
        tau = np.minimum(w + self.bend * w * w, 1.0)
        x = tau * tau
        y = np.where(above, 1.0, -1.0) * 5.0 * self.thickness * HALF_THICKNESS(tau)
        if self.camber == 0.0:
            return np.column_stack([x, y])
        m, p = self.camber, self.place
        scale = np.where(behind, m / (1.0 - p) ** 2, m / p**2)
        mean = scale * np.where(behind, (1.0 - x) * (1.0 + x - 2.0 * p), x * (2.0 * p - x))
        angle = np.arctan(2.0 * scale * (p - x))
        return np.column_stack([x - y * np.sin(angle), mean + y * np.cos(angle)])
