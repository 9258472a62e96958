"""Gains for a machine, by a rule or on a path: the contour error is minimised while loops keep their margins."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, overload

import numpy as np

from splinefeed.analysis.contour import Contour, ContourMeter
from splinefeed.errors import InputError
from splinefeed.geometry.path import Path
from splinefeed.machine.machine import Machine
from splinefeed.machine.parts import FEED_FORWARD, GAINS, Axis, Controller
from splinefeed.records import ROTARY_AXES, Array, Response, Setpoints
from splinefeed.simulation import tuning
from splinefeed.simulation.bound import Bound, BoundTest
from splinefeed.simulation.curves import (
    HUNTING,
    TunedAxis,
    hunts,
    rest_swing,
    seen_resolution,
    tuned_axis,
)
from splinefeed.simulation.follow import Follower
from splinefeed.simulation.linear import Margins, margins
from splinefeed.simulation.plant import force_per_volt

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
FIRST_STEP, LAST_STEP = 0.3, 1e-3
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

Progress = Callable[[int, int], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class AxisTuning:
    """One axis before and after; tracking_error: largest |error| on the path, mm or rad, infinite if it ran away.

    Source: docs/tune.md. Example: `sf.simulation.AxisTuning.__annotations__["tracking"]`
    """

    old: Axis
    axis: Axis
    before: Margins
    margins: Margins
    tracking_before: float
    tracking: float


@dataclass(frozen=True, kw_only=True, eq=False)
class PathTuning:
    """Gains found on a path.

    machine  the machine with the new gains; axes: each axis that moves, before and after
    before, contour  contour error with the old and with the new gains, mm; None if an axis ran away
    evaluations      runs of the path that were made
    Source: docs/tune.md.
    Example: `sf.tune(machine, setpoints=setpoints, path=path, evaluations=2).contour.max`
    """

    machine: Machine
    old: Machine
    period: float
    bound: Bound
    axes: Mapping[str, AxisTuning]
    before: Contour | None
    contour: Contour
    evaluations: int


@dataclass(frozen=True, eq=False)
class TunedMachine:
    """A machine with new gains.

    page    what was found: gains and margins of each axis before and after; curves  what figures show, made on request
    """

    machine: Machine
    page: dict[str, Any]
    curves: Callable[[], list[TunedAxis]]


@overload
def tune(what: Axis, rule: str = ..., **options: Any) -> tuning.Tuning: ...
@overload
def tune(what: Machine, rule: str = ..., *, setpoints: Setpoints, path: Path, **options: Any) -> PathTuning: ...
def tune(what: Axis | Machine, rule: str | None = None, **options: Any) -> tuning.Tuning | PathTuning:
    """Tune the gains of an axis by a rule, or of a machine's axes together on a path.

    With an axis, a rule of `simulation.tuning.RULES` ("ziegler-nichols" by default) and the options of
    `simulation.tuning.tune`: `period` in s, `kind`. With a Machine, rule "path" and the options of `tune_on_path`, of
    which `setpoints` and `path` are needed.

    Returns a Tuning or a PathTuning: gains in V/mm (rotary axes V/rad), margins in dB and deg.
    Raises InputError for anything but an axis or a Machine, a rule that does not fit it, and what the two raise.
    Source: J. G. Ziegler and N. B. Nichols, Trans. ASME 64 (1942) 759-768; the search on a path, see `tune_on_path`.
    Example: `sf.tune(sf.Machine.load("xytheta").axes["x"], "tyreus-luyben").controller.kp`
    """
    if isinstance(what, Machine) and rule in (None, PATH_RULE) and {"setpoints", "path"} <= options.keys():
        return tune_on_path(what, **options)
    if not isinstance(what, Axis) or rule == PATH_RULE:
        raise InputError(
            f"tune takes an axis, machine.axes[...], and a rule, or a Machine with setpoints=, path= and rule 'path'; "
            f"got {type(what).__name__} with rule {rule!r} and {', '.join(options) or 'nothing else'}"
        )
    return tuning.tune(what, rule or "ziegler-nichols", **options)


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
    on_progress: Progress | None = None,
) -> PathTuning:
    """Find gains that make the largest contour error on a path small, every loop within a bound on its margins.

    setpoints     on `path`; their period is the servo's
    axes          those to tune; all of the setpoints by default
    bound         gain margin 6 dB, phase margin 40 deg and |1 / (1 + L)| <= 2 by default
    evaluations   runs of the whole path at most; seed  of the random draws: the same seed gives the same gains
    feed_forward  whether the feed-forward of speed and acceleration is tuned too
    on_progress   called with the runs made and allowed

    Gains with which an axis of the full model does not come to rest (`simulation.curves.rest_swing`) are rejected too.
    Gains are drawn around those of Ziegler and Nichols, or the machine's where that rule has none; those outside the
    bound are rejected without simulation, and the best is improved by COBYLA (M. J. D. Powell, in Advances in
    Optimization and Numerical Analysis, Kluwer 1994, 51-67, doi:10.1007/978-94-015-8330-5_4) on the logarithms of the
    gains. Linear axes are tuned together for contour error; a rotary axis has no part in it and is tuned for its own
    following error. The old gains are kept where nothing better keeps the bound.
    Raises InputError where nothing keeps it. Source: as named, and docs/tune.md.
    Example: `sf.simulation.tune_on_path(machine, setpoints, path, evaluations=2).machine`
    """
    bound = bound or Bound()
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
    made, done = machine, 0

    def report(before: int, total: int, runs: int) -> None:
        if on_progress is not None:
            on_progress(min(before + runs, total), total)

    for i, group in enumerate(groups):
        search = _Search(made, group, setpoints, meter, bound, feed_forward)
        allowed = max((evaluations - done) // (len(groups) - i), 1)
        made = search.run(allowed, np.random.default_rng([seed, i]), partial(report, done, evaluations))
        done += search.runs
    last = _followed(setpoints, made)
    if last.stopped is not None:
        raise InputError(f"no gains within the bound follow this path on {machine.name!r}: {last.stopped}")
    report(0, evaluations, evaluations)
    period, hints = setpoints.period, np.clip(setpoints.s, 0.0, path.length)
    return PathTuning(
        machine=made,
        old=machine,
        period=period,
        bound=bound,
        axes={
            name: AxisTuning(
                old=machine.axes[name],
                axis=made.axes[name],
                before=margins(machine.axes[name], period),
                margins=margins(made.axes[name], period),
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


def along_path(machine: Machine, setpoints: Setpoints, path: Path, **options: Any) -> TunedMachine:
    """Gains of all axes together that make contour error small on a path; see `tune_on_path`."""
    found = tune_on_path(machine, setpoints, path, **options)
    axes = {
        name: {
            **_numbers(each.old, each.axis, each.before, each.margins, setpoints.period),
            "tracking_error_max_before": each.tracking_before,
            "tracking_error_max": each.tracking,
            "tracking_unit": "rad" if each.axis.rotary else "mm",
        }
        for name, each in found.axes.items()
    }
    page = {
        "period_s": setpoints.period,
        "path_name": path.name,
        "bound": found.bound.words,
        "runs": found.evaluations,
        "contour_error_max_before_mm": None if found.before is None else found.before.max,
        "contour_error_max_mm": found.contour.max,
        "contour_error_rms_mm": found.contour.rms,
        "axes": axes,
    }
    rule = f"rule path, {path.name}"
    return TunedMachine(
        found.machine, page, lambda: [tuned_axis(t.old, t.axis, rule, setpoints.period) for t in found.axes.values()]
    )


def by_rule(
    machine: Machine, names: Sequence[str], rule: str, *, period: float, kind: str = "pid",
    say: Callable[[str], None] = lambda words: None,
) -> TunedMachine:  # fmt: skip
    """Gains of single axes by a rule that starts from the ultimate point; see `simulation.tuning.tune`."""
    tunings = []
    for name in names:
        say(f"tuning axis {name}")
        tunings.append(tuning.tune(machine.axes[name], rule, period=period, kind=kind))
    axes = {
        each.axis.name: {
            **_numbers(each.old, each.axis, each.before, each.margins, period),
            "ultimate_gain": each.ultimate.gain,
            "ultimate_period_s": each.ultimate.period,
        }
        for each in tunings
    }
    return TunedMachine(
        replace(machine, axes={**machine.axes, **{each.axis.name: each.axis for each in tunings}}),
        {"period_s": period, "axes": axes},
        lambda: [tuned_axis(each.old, each.axis, each.rule, period) for each in tunings],
    )


def _numbers(old: Axis, new: Axis, before: Margins, after: Margins, period: float) -> dict[str, Any]:
    unit = "rad" if new.rotary else "mm"
    out: dict[str, Any] = {"unit": f"V/{unit}", "rest_swing_unit": unit}
    for ending, axis, each in (("_before", old, before), ("", new, after)):
        swing = rest_swing(axis, period)
        out[f"gains{ending}"] = axis.controller.gains
        out[f"kind{ending}"] = axis.controller.kind
        out[f"margins{ending}"] = each.as_dict()
        out[f"rest_swing{ending}"] = swing
        out[f"hunts{ending}"] = hunts(axis, swing)
    return out


def _followed(points: Setpoints, machine: Machine) -> Response:
    return Follower(machine, points.axes, points.period).follow(points)


def _largest(response: Response, axis: str) -> float:
    return float(np.max(np.abs(response.tracking_error[:, response.axes.index(axis)])))


class _Search:
    """The search for the gains of one group of axes, by contour error, or of a rotary axis by its following error.

    A place x holds for each axis the logarithms of its gains over those at the start, and shares of feed-forward.
    """

    def __init__(
        self, machine: Machine, names: tuple[str, ...], setpoints: Setpoints, meter: ContourMeter, bound: Bound,
        feed_forward: bool,
    ) -> None:  # fmt: skip
        self.machine, self.names, self.setpoints, self.meter, self.bound = machine, names, setpoints, meter, bound
        self.hints = np.clip(setpoints.s, 0.0, meter.path.length)
        self.runs = 0
        self.forward = len(FEED_FORWARD) if feed_forward else 0
        self.start = {name: _start(machine.axes[name], setpoints.period) for name in names}
        self.tests = {name: BoundTest(axis, setpoints.period, bound) for name, axis in self.start.items()}
        self.width = {name: len(GAINS[axis.controller.kind]) + self.forward for name, axis in self.start.items()}
        self.best = (math.inf, np.empty(0), machine)

    def run(self, allowed: int, rng: np.random.Generator, report: Callable[[int], None]) -> Machine:
        """The machine with the best gains that `allowed` runs find for these axes."""
        from scipy.optimize import minimize

        kept = all(np.min(self.tests[name].slacks(self.machine.axes[name])) >= 0.0 for name in self.names)
        own = self._error(self.machine) if kept else math.inf
        for calm in (True, False):
            if self.runs < allowed:
                self._try(np.concatenate([self._calmed(name, calm) for name in self.names]), report)
        for _ in range(max(math.ceil(DRAWN * allowed), 1 if not kept else 0) - self.runs):
            self._try(np.concatenate([self._drawn(name, rng) for name in self.names]), report)
        if not math.isfinite(min(own, self.best[0])):
            raise InputError(
                f"no gains of axis {', '.join(self.names)} were found that keep the bound ({self.bound.words}), "
                f"come to rest and follow the path; allow less margin, or a lower feed, a shorter period or less delay"
            )
        least = sum(self.width.values()) + 2  # that many runs COBYLA needs to take a first step
        while self.runs + least <= allowed and math.isfinite(self.best[0]):
            reached = self.best[0]
            minimize(
                lambda x: self._try(x, report),
                self.best[1],
                method="COBYLA",
                constraints=[{"type": "ineq", "fun": lambda x: self._slacks(x) - RESERVE}],
                options={"rhobeg": FIRST_STEP, "maxiter": allowed - self.runs, "tol": LAST_STEP},
            )
            if self.best[0] > reached * (1.0 - WORTHWHILE):
                break
        return self.best[2] if self.best[0] < own else self.machine

    def _axis(self, name: str, x: Array) -> Axis:
        axis = self.start[name]
        control = axis.controller
        keys = GAINS[control.kind]
        factors = np.exp(np.clip(x[: len(keys)], -FARTHEST, FARTHEST))
        gains: dict[str, Any] = {key: getattr(control, key) * float(f) for key, f in zip(keys, factors, strict=True)}
        new = replace(control, source="tuned on a path", **gains)
        if self.forward:
            whole = _whole_forward(axis, new)
            shares = np.clip(x[len(keys) :], 0.0, FORWARD)
            forward: dict[str, Any] = {
                key: value * float(share) for key, value, share in zip(FEED_FORWARD, whole, shares, strict=True)
            }
            new = replace(new, **forward)
        return replace(axis, controller=new)

    def _parts(self, x: Array) -> dict[str, Array]:
        ends = np.cumsum([self.width[name] for name in self.names])
        return dict(zip(self.names, np.split(np.asarray(x, dtype=np.float64), ends[:-1]), strict=True))

    def _slacks(self, x: Array) -> Array:
        return np.concatenate([self.tests[n].slacks(self._axis(n, part)) for n, part in self._parts(x).items()])

    def _try(self, x: Array, report: Callable[[int], None]) -> float:
        """The logarithm of the error at x; the best that keeps the bound is remembered."""
        axes = {name: self._axis(name, part) for name, part in self._parts(x).items()}
        machine = replace(self.machine, axes={**self.machine.axes, **axes})
        error = self._error(machine)
        report(self.runs)
        unrest = max(_unrest(axis, self.setpoints.period) for axis in axes.values())
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
            return _largest(response, self.names[0])
        return self.meter.measure(response.position, s_hint=self.hints).max

    def _calmed(self, name: str, calm: bool) -> Array:
        """The start, its gains lowered until they keep the bound; the place of no change if they never do.

        calm: with shares of the ultimate gain as Tyreus and Luyben have them, not Ziegler and Nichols.
        """
        axis = self.start[name]
        count = len(GAINS[axis.controller.kind])
        x = np.zeros(self.width[name])
        if calm and axis.controller.kind == "pid":
            x[:count] = CALMER
        for _ in range(CALMINGS):
            if np.min(self.tests[name].slacks(self._axis(name, x))) >= RESERVE:
                return x
            x[:count] -= CALMING * (np.array([1.0, 2.0, 1.0]) if axis.controller.kind == "pid" else 1.0)
        return np.zeros(self.width[name])

    def _drawn(self, name: str, rng: np.random.Generator) -> Array:
        """Gains drawn at random that keep the bound; the last ones drawn if none of MOST_DRAWS does."""
        x = np.zeros(self.width[name])
        count = len(x) - self.forward
        for _ in range(MOST_DRAWS):
            x[:count] = rng.uniform(math.log(SPREAD[0]), math.log(SPREAD[1]), count)
            x[count:] = rng.uniform(0.0, 1.0, self.forward)
            if np.min(self.tests[name].slacks(self._axis(name, x))) >= RESERVE:
                break
        return x


def _unrest(axis: Axis, period: float) -> float:
    """0 for an axis that comes to rest, else how far it is from that, as a logarithm."""
    swing = rest_swing(axis, period)
    return math.log(min(swing / (HUNTING * seen_resolution(axis)), RAN_AWAY)) if hunts(axis, swing) else 0.0


def _start(axis: Axis, period: float) -> Axis:
    """The axis with gains of which none is 0: those of Ziegler and Nichols, or its own where that rule has none."""
    if axis.controller.kind == "pid":
        try:
            found = tuning.tune(axis, "ziegler-nichols", period=period).axis
            return replace(found, controller=replace(found.controller, source=axis.controller.source))
        except InputError:
            pass
    least: dict[str, Any] = {
        key: getattr(axis.controller, key) or axis.controller.kp * share
        for key, share in zip(GAINS["pid"], (1.0, 10.0, 0.01), strict=True)
        if axis.controller.kind == "pid"
    }
    if axis.controller.kind == "p-pi" and axis.controller.velocity_ki == 0.0:
        least = {"velocity_ki": axis.controller.velocity_kp * axis.controller.position_gain}
    return replace(axis, controller=replace(axis.controller, **least))


def _whole_forward(axis: Axis, control: Controller) -> tuple[float, float]:
    """Feed-forward of speed and acceleration that makes the rigid linear drive follow by itself."""
    if axis.drive.mode == "velocity":
        per_speed = 1.0 / float(axis.drive.speed_per_volt or 1.0)
        per_acceleration = axis.drive.lag * per_speed
    else:
        volt = 1.0 / force_per_volt(axis)
        per_speed = axis.friction.viscous * volt
        per_acceleration = (axis.motor_inertia + axis.load_inertia) * volt
    return (control.velocity_kp if control.kind == "p-pi" else per_speed), per_acceleration
