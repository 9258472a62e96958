"""The table of interpolation methods, and how to add one."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass, field

from splinefeed.errors import MethodError, nearest
from splinefeed.interpolation import arc_length, stepping
from splinefeed.interpolation.loop import STARTING_STEPS, loop_for
from splinefeed.kernels.jit import Kernel, Leaf
from splinefeed.kernels.layout import Shape
from splinefeed.records import Array, IntArray

#: What every step takes, in this order; see `interpolation.stepping` for what each of them is.
STEP_PARAMETERS = ("u", "rate", "law", "period", "curve", "corrections", "tolerance", "memory")
#: As exact as `milne-simpson-anchored`, and faster; the paper's experiment names its own methods.
DEFAULT_METHOD = "arc-length"


@dataclass(frozen=True)
class Method:
    """One interpolation method: its step, its name, and what the shared loop must know of it.

    Parameters
    ----------
    name : str
        By which it is chosen.
    title : str
        A few words for tables.
    step : callable or None
        A function of STEP_PARAMETERS, see `register`; None for a method with `fill`.
    order : int or None
        Observed order of convergence; None if the error does not depend on the period: that of rounding or a fit.
    history : int, optional
        Earlier steps that the step reads: 0 for one-step methods, 3 for the predictor-correctors.
    half : bool, optional
        Whether the step reads the feed at half a period.
    anchor : bool, optional
        Whether its points lie on the law's arc length: its starting steps then do, too.
    fill : callable, optional
        In place of the step, where no tick needs the one before: `arc_length.fill`, many ticks at once.
    """

    name: str
    title: str
    step: Callable[..., float] | None = field(repr=False)
    order: int | None
    history: int = 0
    half: bool = False
    anchor: bool = False
    fill: Callable[..., tuple[IntArray, Array, Array, Array, Array]] | None = field(default=None, repr=False)

    def loop(self, shape: Shape) -> Leaf[Callable[..., None]]:
        """Return the shared loop around this step.

        Parameters
        ----------
        shape : Shape
            Of the path; see `kernels.layout`.

        Returns
        -------
        Leaf
            The loop; see `loop.loop_for`.

        Raises
        ------
        MethodError
            For a method without a step.
        """
        if self.step is None:
            raise MethodError(f"method {self.name!r} has no step from tick to tick; it takes many ticks at once")
        return loop_for(self.step, self.name, shape)


_FAROUKI = (
    'R. T. Farouki, Y.-F. Tsai, "Exact Taylor series coefficients for variable-feedrate CNC curve interpolators", '
    "Computer-Aided Design 33(2), 2001, doi 10.1016/S0010-4485(00)00085-3."
)
_SHPITALNI = (
    'M. Shpitalni, Y. Koren, C. C. Lo, "Realtime curve interpolators", Computer-Aided Design 26(11), 1994, '
    "doi 10.1016/0010-4485(94)90097-3."
)
_BUILT_IN = (
    Method("taylor-1", "Taylor, first order", stepping.taylor(1, _SHPITALNI), 1),
    Method("taylor-2", "Taylor, second order (eq. 3)", stepping.taylor(2, _FAROUKI), 2),
    Method("runge-kutta-4", "Runge-Kutta, fourth order", stepping.runge_kutta_4, 4, half=True),
    Method("adams-bashforth-moulton", "Adams-Bashforth-Moulton PECE", stepping.adams_bashforth_moulton, 4, 3),
    Method("hamming", "Hamming predictor-corrector", stepping.hamming, 4, 3),
    Method("milne-simpson", "Milne-Simpson, as the paper (eq. 23, 24)", stepping.milne_simpson, 4, 3),
    Method(
        "milne-simpson-anchored", "Milne-Simpson, pulled onto the arc length", stepping.milne_simpson_anchored, None, 3,
        anchor=True,
    ),
    Method("arc-length", "Newton on the arc length", None, None, anchor=True, fill=arc_length.fill),
    Method("taylor-3", "Taylor, third order", stepping.taylor(3, _FAROUKI), 3),
    Method("feed-correction", "Feed-correction polynomial of degree 7", stepping.feed_correction, None),
    Method("tsai-cheng", "Tsai-Cheng, parameter compensated", stepping.tsai_cheng, 2, 2, half=True),
    Method(
        "runge-kutta-2-compensated", "Runge-Kutta, second order, compensated", stepping.runge_kutta_2_compensated, 2,
        half=True,
    ),
)  # fmt: skip
_methods: dict[str, Method] = {each.name: each for each in _BUILT_IN}


def methods() -> tuple[str, ...]:
    """Return the names of all interpolation methods, built-in ones first.

    Returns
    -------
    tuple of str
        Names as `interpolate` takes them.

    References
    ----------
    .. [1] docs/math/interpolators.md, which names the paper of each method.

    Examples
    --------
    >>> import splinefeed as sf
    >>> "milne-simpson" in sf.interpolation.methods()
    True
    """
    return tuple(_methods)


def method(name: str) -> Method:
    """Return the method of a name.

    Parameters
    ----------
    name : str
        As it was registered.

    Returns
    -------
    Method
        Its step, and what the loop must know of it.

    Raises
    ------
    MethodError
        For a name that no method has, with the nearest one.
    """
    if name not in _methods:
        raise MethodError(f"unknown interpolation method {name!r}; {nearest(name, methods(), 'choose one of {}')}")
    return _methods[name]


def register(
    name: str,
    step: Callable[..., float],
    *,
    title: str = "",
    order: int | None = None,
    history: int = 0,
    half: bool = False,
    anchor: bool = False,
) -> Method:
    """Add an interpolation method of your own.

    Parameters
    ----------
    name : str
        Of lower-case letters, digits and hyphens.
    step : callable
        step(u, rate, law, period, curve, corrections, tolerance, memory) -> the next u, as Numba can compile it. u and
        rate (4,) are the last four parameters and du/dt there, newest first, in units of u and of u per s; law (5,) has
        s at the next tick, mm, the feeds now, half-way and at the next tick, mm/s, and the acceleration now, mm/s^2;
        period is in s; memory (12,) is the method's own. `interpolation.stepping` has what a curve is handed to.
    title : str, optional
        A few words for tables; by default the name.
    order : int, optional
        Observed order of convergence; None if the error does not depend on the period.
    history : int, optional
        Earlier steps that the step reads, 0 to 3.
    half : bool, optional
        Whether the step reads the feed at half a period.
    anchor : bool, optional
        Whether its points lie on the law's arc length: its starting steps then do, too.

    Returns
    -------
    Method
        As the table of methods has it now.

    Raises
    ------
    MethodError
        For a name that is taken or has other letters, a step with other parameters, and a history out of range.

    References
    ----------
    .. [1] docs/add-a-method.md, which has one to copy.

    Examples
    --------
    >>> import splinefeed as sf
    >>> def step(u, rate, law, period, curve, corrections, tolerance, memory):
    ...     return u[0] + 0.5 * period * (3.0 * rate[0] - rate[1])
    >>> sf.interpolation.register("adams-bashforth-2", step, order=2, history=1).title
    'adams-bashforth-2'
    """
    if not re.fullmatch(r"[a-z][a-z0-9-]*", name):
        raise MethodError(f"method name {name!r}: use lower-case letters, digits and hyphens, as in 'my-method'")
    if name in _methods:
        raise MethodError(f"method {name!r} is registered already; choose another name")
    plain = getattr(step, "py_func", step)
    parameters = tuple(inspect.signature(plain).parameters)
    if parameters != STEP_PARAMETERS:
        raise MethodError(f"method {name!r}: step takes ({', '.join(parameters)}); it must take {STEP_PARAMETERS}")
    if not 0 <= history <= STARTING_STEPS:
        raise MethodError(f"method {name!r}: history is {history}; 0 to {STARTING_STEPS} earlier steps are kept")
    of_ours = step if isinstance(step, Kernel) else Kernel(plain)
    _methods[name] = Method(name, title or name, of_ours, order, history, half, anchor)
    return _methods[name]
