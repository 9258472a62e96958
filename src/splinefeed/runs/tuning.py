"""Gains for a machine, by a rule or on a path: the contour error is minimised while loops keep their margins."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, overload

import numpy as np

from splinefeed.analysis.following import Contour, ContourMeter
from splinefeed.errors import InputError
from splinefeed.machine.machine import Machine
from splinefeed.machine.parts import FEED_FORWARD, GAINS, Controller, ServoAxis
from splinefeed.paths.path import Path
from splinefeed.records import ROTARY_AXES, Array, Response, Setpoints
from splinefeed.simulation import tuning
from splinefeed.simulation.curves import HUNTING, rest_swing
from splinefeed.simulation.follow import Follower
from splinefeed.simulation.linear import Bound, quick_slacks
from splinefeed.simulation.plant import force_per_volt, seen_resolution
from splinefeed.simulation.shaping import GAIN_DIGITS, REQUIRED, rounded

PATH_RULE = "path"
#: Runs of the whole path that the optimiser may make, by default, and at most.
EVALUATIONS = 300
MOST_EVALUATIONS = 100_000
#: Share of them that goes to gains drawn at random; the rest improves the best of these step by step.
DRAWN = 0.4
#: Gains are drawn, in equal shares of their logarithm, between these factors of those that a rule or the machine gives.
SPREAD = (1.0 / 20.0, 4.0)
#: Feed-forward is searched between 0 and this many times what would make the drive follow by itself.
FORWARD = 1.5
#: First step of the improvement, in natural logarithms of the gains, and the one at which it ends.
FIRST_STEP, LAST_STEP = 0.3, 0.02
#: Steps of the gains, in logarithms, and of the shares of feed-forward; digits of errors that are compared, and
#: decimals of margins: coarse enough that the last bits of a computer's arithmetic decide nothing.
GAIN_STEP, SHARE_STEP = 0.02, 0.01
ERROR_DIGITS, SLACK_DECIMALS = 4, 4
#: The improvement restarts from its best as long as that makes the error smaller by this share.
WORTHWHILE = 0.02
#: The quick test asks for this much more than the bound, so that the exact one holds too.
RESERVE = 1e-3
#: Draws for one that keeps the bound.
MOST_DRAWS = 2000
#: Gains go no farther than this from their start, in logarithms; what a run-away counts as, and the least
#: error that counts, mm or rad.
FARTHEST = 8.0
RAN_AWAY = 1e3
SMALLEST = 1e-9
#: Gains that a rule gives are lowered in steps of this, in logarithms, until they keep the bound.
CALMING, CALMINGS = 0.1, 60
#: Logarithms of Tyreus and Luyben's gains over those of Ziegler and Nichols.
CALMER = (math.log(1.0 / 2.2 / 0.6), math.log(1.0 / 2.2 / 2.2 / 1.2), math.log(1.0 / 2.2 / 6.3 / 0.075))


@dataclass(frozen=True, kw_only=True, eq=False)
class AxisTuning(tuning.TunedAxis):
    """One axis before and after.

    Parameters
    ----------
    rule : str
        By which its gains were found.
    old, axis : ServoAxis
        Before and after.
    period : float
        Of the servo, s.
    tracking_before, tracking : float
        Largest |error| on the path, mm or rad, infinite if it ran away.

    References
    ----------
    .. [1] docs/tune.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.circle(radius=10)
    >>> setpoints = sf.interpolate(path, sf.plan(path, sf.Limits(feed=20, acceleration=200, jerk=5000), period=1e-3))
    >>> tuned = sf.runs.tune_on_path(sf.Machine.load("xytheta"), setpoints, path, evaluations=2)
    >>> x = tuned.axes["x"]
    >>> x.tracking <= x.tracking_before, x.numbers()["tracking_unit"]
    (True, 'mm')
    """

    tracking_before: float
    tracking: float

    def numbers(self) -> dict[str, Any]:
        """Those of a tuned axis, and its following error."""
        unit = "rad" if self.axis.rotary else "mm"
        tracking = {"tracking_error_max_before": self.tracking_before, "tracking_error_max": self.tracking}
        return {**super().numbers(), **tracking, "tracking_unit": unit}


@dataclass(frozen=True, kw_only=True, eq=False)
class TunedMachine:
    """A machine with new gains.

    Parameters
    ----------
    machine : Machine
        With the new gains.
    period : float
        Of the servo, s.
    axes : mapping of str to TunedAxis
        Each tuned axis, before and after.
    """

    machine: Machine
    period: float
    axes: Mapping[str, tuning.TunedAxis]

    def numbers(self) -> dict[str, Any]:
        """What `--json` prints."""
        return {"period_s": self.period, "axes": {name: each.numbers() for name, each in self.axes.items()}}


@dataclass(frozen=True, kw_only=True, eq=False)
class PathTuning(TunedMachine):
    """Gains found on a path.

    Parameters
    ----------
    machine : Machine
        With the new gains.
    axes : mapping of str to AxisTuning
        Each axis that moves, before and after.
    period : float
        Of the servo, s.
    path_name : str
        Name of the path.
    bound : Bound
        That the margins of every loop keep.
    before, contour : Contour
        Contour error with the old and with the new gains, mm; `before` is None where an axis ran away.
    evaluations : int
        Runs of the path that were made.

    References
    ----------
    .. [1] docs/tune.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.circle(radius=10)
    >>> setpoints = sf.interpolate(path, sf.plan(path, sf.Limits(feed=20, acceleration=200, jerk=5000), period=1e-3))
    >>> tuned = sf.runs.tune(sf.Machine.load("xytheta"), setpoints=setpoints, path=path, evaluations=2)
    >>> tuned.evaluations, tuned.contour.max <= tuned.before.max
    (2, True)
    """

    axes: Mapping[str, AxisTuning]
    path_name: str
    bound: Bound
    before: Contour | None
    contour: Contour
    evaluations: int

    def numbers(self) -> dict[str, Any]:
        """What `--json` prints."""
        return {
            **super().numbers(),
            "path_name": self.path_name,
            "bound": self.bound.words,
            "runs": self.evaluations,
            "contour_error_max_before_mm": None if self.before is None else self.before.max,
            "contour_error_max_mm": self.contour.max,
            "contour_error_rms_mm": self.contour.rms,
        }


@overload
def tune(what: ServoAxis, rule: str = ..., **options: Any) -> tuning.Tuning: ...
@overload
def tune(what: Machine, rule: str = ..., *, setpoints: Setpoints, path: Path, **options: Any) -> PathTuning: ...
def tune(what: ServoAxis | Machine, rule: str | None = None, **options: Any) -> tuning.Tuning | PathTuning:
    """Tune the gains of an axis by a rule, or of a machine's axes together on a path.

    Parameters
    ----------
    what : ServoAxis or Machine
        Whose gains are tuned.
    rule : str, optional
        Of an axis "margins" (the default) or one of `simulation.tuning.RULES`; of a Machine "path".
    **options : object
        Of an axis those of `simulation.tuning.tune`: `period` in s, `kind`, `bound`; of a Machine those of
        `tune_on_path`, of which `setpoints` and `path` are needed.

    Returns
    -------
    Tuning or PathTuning
        Gains in V/mm (rotary axes V/rad), margins in dB and deg.

    Raises
    ------
    InputError
        For anything but an axis or a Machine, a rule that does not fit it, and what the two raise.

    References
    ----------
    .. [1] J. G. Ziegler and N. B. Nichols, Trans. ASME 64 (1942) 759-768.
    .. [2] B. D. Tyreus and W. L. Luyben, Ind. Eng. Chem. Res. 31 (1992) 2625-2628, doi:10.1021/ie00011a029.
    .. [3] docs/tune.md; for the search on a path see `tune_on_path`.

    Examples
    --------
    >>> import splinefeed as sf
    >>> axis = sf.Machine.load("xytheta").axes["x"]
    >>> tuned = sf.runs.tune(axis, "tyreus-luyben")
    >>> round(tuned.controller.kp / tuned.ultimate.gain, 6)  # the rule's 1 / 2.2
    0.454545
    """
    if isinstance(what, Machine) and rule in (None, PATH_RULE) and {"setpoints", "path"} <= options.keys():
        return tune_on_path(what, **options)
    if not isinstance(what, ServoAxis) or rule == PATH_RULE:
        raise InputError(
            f"tune takes an axis, machine.axes[...], and a rule, or a Machine with setpoints=, path= and rule 'path'; "
            f"got {type(what).__name__} with rule {rule!r} and {', '.join(options) or 'nothing else'}"
        )
    return tuning.tune(what, rule or tuning.MARGINS, **options)


def tune_on_path(
    machine: Machine,
    setpoints: Setpoints,
    path: Path,
    *,
    axes: Sequence[str] | None = None,
    bound: Bound | None = None,
    evaluations: int = EVALUATIONS,
    seed: int = 0,
    feed_forward: bool = False,
    on_progress: Callable[[int, int], None] | None = None,
) -> PathTuning:
    """Find gains that make the largest contour error on a path small, every loop within a bound on its margins.

    Parameters
    ----------
    machine : Machine
        Whose gains are tuned.
    setpoints : Setpoints
        On `path`; their period is the servo's.
    path : Path
        That contour errors are measured against.
    axes : sequence of str, optional
        Those to tune; all of the setpoints by default.
    bound : Bound, optional
        Gain margin 6 dB, phase margin 45 deg and |1 / (1 + L)| <= 2 by default.
    evaluations : int, optional
        Runs of the whole path at most.
    seed : int, optional
        Of the random draws: the same seed gives the same gains.
    feed_forward : bool, optional
        Whether the feed-forward of speed and acceleration is tuned too.
    on_progress : callable, optional
        Called with the runs made and allowed.

    Returns
    -------
    PathTuning
        The old gains where nothing better keeps the bound.

    Raises
    ------
    InputError
        Where nothing keeps it.

    Notes
    -----
    Gains are drawn around those of Ziegler and Nichols [1]_, or the machine's where that rule has none; those outside
    the bound are rejected without simulation, and the best is improved by COBYLA [2]_ on the logarithms of the gains.
    Gains with which an axis of the full model does not come to rest (`simulation.curves.rest_swing`) are rejected too.
    Linear axes are tuned together for contour error; a rotary axis has no part in it and is tuned for its own following
    error.

    References
    ----------
    .. [1] J. G. Ziegler and N. B. Nichols, Trans. ASME 64 (1942) 759-768.
    .. [2] M. J. D. Powell, in Advances in Optimization and Numerical Analysis, Kluwer 1994, 51-67,
           doi:10.1007/978-94-015-8330-5_4.
    .. [3] docs/tune.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.circle(radius=10)
    >>> setpoints = sf.interpolate(path, sf.plan(path, sf.Limits(feed=20, acceleration=200, jerk=5000), period=1e-3))
    >>> tuned = sf.runs.tune_on_path(sf.Machine.load("xytheta"), setpoints, path, evaluations=2)
    >>> tuned.contour.max <= tuned.before.max
    True
    """
    bound = bound or REQUIRED
    if isinstance(evaluations, bool) or not isinstance(evaluations, int) or not 1 <= evaluations <= MOST_EVALUATIONS:
        raise InputError(f"evaluations is {evaluations!r}; it must be a whole number from 1 to {MOST_EVALUATIONS}")
    if path.axes != setpoints.axes:
        raise InputError(f"the path has axes {', '.join(path.axes)}, the setpoints {', '.join(setpoints.axes)}")
    first = _followed(setpoints, machine)
    meter = ContourMeter(path)
    chosen = setpoints.axes if axes is None else tuple(axes)
    for name in chosen:
        if name not in setpoints.axes:
            raise InputError(f"axis {name!r} does not move on this path; its axes are {', '.join(setpoints.axes)}")
    linear = tuple(name for name in chosen if name not in ROTARY_AXES)
    groups = [*([linear] if linear else []), *((name,) for name in chosen if name in ROTARY_AXES)]
    say = on_progress or (lambda done, allowed: None)
    made, done = machine, 0
    for i, group in enumerate(groups):

        def report(runs: int, before: int = done) -> None:
            say(min(before + runs, evaluations), evaluations)

        search = _Search(made, group, setpoints, meter, bound, feed_forward, report)
        allowed = max((evaluations - done) // (len(groups) - i), 1)
        made = search.run(allowed, np.random.default_rng([seed, i]))
        done += search.runs
    last = _followed(setpoints, made)
    if last.stopped is not None:
        raise InputError(f"no gains within the bound follow this path on {machine.name!r}: {last.stopped}")
    say(evaluations, evaluations)
    period, hints = setpoints.period, np.clip(path.lengths_of(setpoints), 0.0, path.length)
    return PathTuning(
        machine=made,
        period=period,
        path_name=path.name,
        bound=bound,
        axes={
            name: AxisTuning(
                rule=f"rule path, {path.name}",
                old=machine.servo_axis(name),
                axis=made.servo_axis(name),
                period=period,
                tracking_before=math.inf if first.stopped else _largest(first, name),
                tracking=_largest(last, name),
            )
            for name in setpoints.axes
            if name in chosen
        },
        before=None if first.stopped is not None else meter.measure(first.position, s_hint=hints),
        contour=meter.measure(last.position, s_hint=hints),
        evaluations=done,
    )


def by_rule(
    machine: Machine, names: Sequence[str], rule: str, *, period: float, kind: str | None = None,
    bound: Bound | None = None, say: Callable[[str], None] = lambda words: None,
) -> TunedMachine:  # fmt: skip
    """Tune single axes of a machine by a rule, each by `simulation.tuning.tune`.

    Parameters
    ----------
    machine : Machine
        Whose gains are tuned.
    names : sequence of str
        Axes to tune.
    rule : str
        One of `simulation.tuning.RULES`.
    period : float
        Of the servo, s.
    kind, bound : str, Bound, optional
        As `simulation.tuning.tune` takes them.
    say : callable, optional
        Called with what is being done, in words.

    Returns
    -------
    TunedMachine
        With the new gains.
    """
    tuned = {}
    for name in names:
        say(f"tuning axis {name}")
        tuned[name] = tuning.tune(machine.servo_axis(name), rule, period=period, kind=kind, bound=bound)
    made = replace(machine, axes={**machine.axes, **{name: each.axis for name, each in tuned.items()}})
    return TunedMachine(machine=made, period=period, axes=tuned)


def _followed(points: Setpoints, machine: Machine) -> Response:
    return Follower(machine, points.axes, points.period).follow(points)


def _largest(response: Response, axis: str) -> float:
    return float(np.max(np.abs(response.tracking_error[:, response.axes.index(axis)])))


class _Gains:
    """The gains of one axis as a place x: their logarithms over those at the start, then shares of feed-forward."""

    def __init__(self, axis: ServoAxis, period: float, bound: Bound, feed_forward: bool) -> None:
        self.start = _start(axis, period)
        self.keys = GAINS[axis.controller.kind]
        self.pid = axis.controller.kind == "pid"
        self.width = len(self.keys) + (len(FEED_FORWARD) if feed_forward else 0)
        self.slacks_of = quick_slacks(self.start, period, bound)

    def axis(self, x: Array) -> ServoAxis:
        """The axis with the gains of a place."""
        control, count = self.start.controller, len(self.keys)
        steps = np.round(np.clip(x[:count], -FARTHEST, FARTHEST) / GAIN_STEP)
        factors = np.exp(GAIN_STEP * steps).tolist()
        new: dict[str, Any] = {
            key: rounded(getattr(control, key) * f, GAIN_DIGITS) for key, f in zip(self.keys, factors, strict=True)
        }
        if not self.pid:  # of the reference's speed the speed loop gets the same share
            share = control.velocity_feed_forward / control.velocity_kp
            new["velocity_feed_forward"] = rounded(share * new["velocity_kp"], GAIN_DIGITS)
        if self.width > count:
            shares = (SHARE_STEP * np.round(np.clip(x[count:], 0.0, FORWARD) / SHARE_STEP)).tolist()
            whole = _whole_forward(self.start, replace(control, **new))
            forward = zip(FEED_FORWARD, whole, shares, strict=True)
            new |= {key: rounded(value * share, GAIN_DIGITS) for key, value, share in forward}
        return replace(self.start, controller=replace(control, source="tuned on a path", **new))

    def slacks(self, x: Array) -> Array:
        """How far the loop of a place is within the bound, (5,)."""
        out: Array = np.round(self.slacks_of(self.axis(x)), SLACK_DECIMALS)
        return out

    def calmed(self, calm: bool) -> Array:
        """The start, its gains lowered until they keep the bound; the place of no change if they never do.

        calm: with shares of the ultimate gain as Tyreus and Luyben have them, not Ziegler and Nichols.
        """
        x, count = np.zeros(self.width), len(self.keys)
        if calm and self.pid:
            x[:count] = CALMER
        for _ in range(CALMINGS):
            if np.min(self.slacks(x)) >= RESERVE:
                return x
            x[:count] -= CALMING * (np.array([1.0, 2.0, 1.0]) if self.pid else 1.0)
        return np.zeros(self.width)

    def drawn(self, rng: np.random.Generator) -> Array:
        """Gains drawn at random that keep the bound; the last ones drawn if none of MOST_DRAWS does."""
        x, count = np.zeros(self.width), len(self.keys)
        for _ in range(MOST_DRAWS):
            x[:count] = rng.uniform(math.log(SPREAD[0]), math.log(SPREAD[1]), count)
            x[count:] = rng.uniform(0.0, 1.0, self.width - count)
            if np.min(self.slacks(x)) >= RESERVE:
                break
        return x


class _Search:
    """The search for the gains of one group of axes, by contour error, or of a rotary axis by its following error.

    A place x has those of `_Gains` of each axis; `runs` counts the runs of the path for `report`.
    """

    def __init__(
        self, machine: Machine, names: tuple[str, ...], setpoints: Setpoints, meter: ContourMeter, bound: Bound,
        feed_forward: bool, report: Callable[[int], None],
    ) -> None:  # fmt: skip
        self.machine, self.names, self.setpoints, self.meter = machine, names, setpoints, meter
        self.bound, self.report, self.runs = bound, report, 0
        self.hints = np.clip(meter.path.lengths_of(setpoints), 0.0, meter.path.length)
        self.gains = [_Gains(machine.servo_axis(name), setpoints.period, bound, feed_forward) for name in names]
        self.ends = np.cumsum([each.width for each in self.gains])
        self.best = (math.inf, np.empty(0), machine)

    def run(self, allowed: int, rng: np.random.Generator) -> Machine:
        """The machine with the best gains that `allowed` runs find for these axes."""
        from scipy.optimize import minimize

        old = [self.machine.servo_axis(name) for name in self.names]
        kept = all(np.min(each.slacks_of(axis)) >= 0.0 for each, axis in zip(self.gains, old, strict=True))
        own = self._error(self.machine) if kept else math.inf
        for calm in (True, False):
            if self.runs < allowed:
                self._try(np.concatenate([each.calmed(calm) for each in self.gains]))
        for _ in range(max(math.ceil(DRAWN * allowed), 1 if not kept else 0) - self.runs):
            self._try(np.concatenate([each.drawn(rng) for each in self.gains]))
        if not math.isfinite(min(own, self.best[0])):
            raise InputError(
                f"no gains of axis {', '.join(self.names)} were found that keep the bound ({self.bound.words}), "
                f"come to rest and follow the path; allow less margin, or a lower feed, a shorter period or less delay"
            )
        least = int(self.ends[-1]) + 2  # that many runs COBYLA needs to take a first step
        while self.runs + least <= allowed and math.isfinite(self.best[0]):
            reached = self.best[0]
            minimize(
                self._try,
                self.best[1],
                method="COBYLA",
                constraints=[{"type": "ineq", "fun": lambda x: self._slacks(x) - RESERVE}],
                options={"rhobeg": FIRST_STEP, "maxiter": allowed - self.runs, "tol": LAST_STEP},
            )
            if self.best[0] > reached * (1.0 - WORTHWHILE):
                break
        return self.best[2] if self.best[0] < own else self.machine

    def _slacks(self, x: Array) -> Array:
        parts = np.split(x, self.ends[:-1])
        return np.concatenate([each.slacks(part) for each, part in zip(self.gains, parts, strict=True)])

    def _try(self, x: Array) -> float:
        """The logarithm of the error at x; the best that keeps the bound is remembered."""
        axes = [each.axis(part) for each, part in zip(self.gains, np.split(x, self.ends[:-1]), strict=True)]
        machine = replace(self.machine, axes={**self.machine.axes, **{axis.name: axis for axis in axes}})
        error = self._error(machine)
        self.report(self.runs)
        # 0 where all axes come to rest, else how far one is from that, as a logarithm
        swings = (rest_swing(axis, self.setpoints.period) / (HUNTING * seen_resolution(axis)) for axis in axes)
        unrest = math.log(min(max(1.0, *swings), RAN_AWAY))
        if error < self.best[0] and unrest == 0.0 and np.min(self._slacks(x)) >= 0.5 * RESERVE:
            self.best = (error, np.array(x), machine)
        return math.log(min(error, RAN_AWAY) + SMALLEST) + unrest

    def _error(self, machine: Machine) -> float:
        """Largest contour error of the linear axes, mm, or following error of a rotary one, rad; of one run."""
        self.runs += 1
        response = _followed(self.setpoints, machine)
        if response.stopped is not None:
            return math.inf
        if self.names[0] in ROTARY_AXES:
            return rounded(_largest(response, self.names[0]), ERROR_DIGITS)
        return rounded(self.meter.measure(response.position, s_hint=self.hints).max, ERROR_DIGITS)


def _start(axis: ServoAxis, period: float) -> ServoAxis:
    """The axis with gains of which none is 0: those of Ziegler and Nichols, or its own where that rule has none."""
    control = axis.controller
    least: dict[str, Any] = {"velocity_ki": control.velocity_kp * control.position_gain}
    if control.kind == "pid":
        with suppress(InputError):
            found = tuning.tune(axis, "ziegler-nichols", period=period).axis
            return replace(found, controller=replace(found.controller, source=control.source))
        least = {"ki": 10.0 * control.kp, "kd": 0.01 * control.kp}
    least = {key: getattr(control, key) or value for key, value in least.items()}
    return replace(axis, controller=replace(control, **least))


def _whole_forward(axis: ServoAxis, control: Controller) -> tuple[float, float]:
    """Feed-forward of speed and acceleration that makes the rigid linear drive follow by itself."""
    if axis.drive.mode == "velocity":
        per_speed = 1.0 / float(axis.drive.speed_per_volt or 1.0)
        per_acceleration = axis.drive.lag * per_speed
    else:
        volt = 1.0 / force_per_volt(axis)
        per_speed = axis.friction.viscous * volt
        per_acceleration = (axis.motor_inertia + axis.load_inertia) * volt
    return (control.velocity_kp if control.kind == "p-pi" else per_speed), per_acceleration
