"""Bad and extreme input, by every strategy: what `check` accepts comes out, or one of our errors, and never a hang."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import sample_curves
import splinefeed as sf
from splinefeed.errors import CurveError, SplinefeedError
from splinefeed.planner import planning

STRATEGIES = ("seven-phase", "look-ahead", "time-optimal")
#: Servo period, s, and that of paths that take hours: planning looks at their ticks one by one.
PERIOD, LONG_PERIOD = 1e-3, 2e-2
bezier = sf.NurbsCurve.bezier
WAVE = np.array([[0, 0], [1, 2], [3, -1], [4, 0]])


def lines(*points) -> list[sf.NurbsCurve]:
    return [bezier([a, b]) for a, b in itertools.pairwise(points)]


def straight(*x: float) -> np.ndarray:
    return np.column_stack([x, np.zeros(len(x))])


def turning(*points, axes=("a",)) -> sf.Path:
    return sf.Path([bezier(np.asarray(points, dtype=float).reshape(len(points), -1))], axes)


PATHS = {
    "all but no length between": sf.Path(lines([0, 0], [10, 0], [10 + 1e-9, 1e-9], [20, 0])),
    "spans without length": sf.Path(
        [sf.NurbsCurve(1, [0, 0, 1, 2, 3, 4, 4], [[0, 0], [10, 0], [10, 0], [10, 0], [20, 5]])]
    ),
    "cusp": sf.Path([bezier([[0, 0], [20, 20], [0, 20], [20, 0]])]),
    "cusp in space": sf.Path([sample_curves.with_cusp(0.6, 5, 3, 4).transformed(50 * np.eye(3))]),
    "C' = 0 at both ends": sf.Path([bezier(20 * straight(0, 0, 0, 1, 1, 1))]),
    "C' = 0 inside": sf.Path([bezier(100 * straight(0, 1 / 12, 0, 1 / 12))]),
    "there and back in one curve": sf.Path([bezier([[0, 0], [20, 0], [0, 0]])]),
    "corner without a rule": sf.Path(lines([0, 0], [10, 0], [10, 10])),
    "corner straight back": sf.Path(lines([0, 0], [10, 0], [2, 0])),
    "many tiny lines": sf.Path(lines(*[[1e-6 * k, 1e-6 * (k % 2)] for k in range(30)])),
    "nearly the same curve back": sf.Path(
        [bezier([[0, 0], [10, 10], [20, 0]]), bezier([[20, 0], [10, 10 + 1e-9], [0, 1e-9]])]
    ),
    "nearly the same loop again": sf.Path([bezier([[0, 0], [10, e], [10, 10], [0, 0]]) for e in (0, 1e-9)]),
    "1e-6 mm line": sf.Path(lines([0, 0], [1e-6, 0])),
    "1e-6 mm curve": sf.Path([bezier(2.5e-7 * WAVE)]),
    "1e-6 mm curve far away": sf.Path([bezier(2.5e-7 * WAVE + 1e3)]),
    "1e6 mm line": sf.Path(lines([0, 0], [1e6, 0])),
    "1e6 mm curve": sf.Path([bezier(2.5e5 * WAVE)]),
    "1e6 mm and then 1e-6": sf.Path(lines([0, 0], [1e6, 0], [1e6, 1e-6], [1e6 + 1, 1e-6])),
    "rotary alone": turning(0, 1),
    "rotary there and back": turning(0, 1, 0),
    "two rotary": turning([0, 0], [1, 2], [2, 0], axes=("a", "b")),
    "rotary 1e-6 degrees": turning(0, math.radians(1e-6)),
    "rotary 1e6 degrees": turning(0, math.radians(1e6)),
    "rotary between linear": sf.Path(lines([0, 0], [10, 0], [10, 1], [20, 1]), axes=("x", "a")),
    "rotary standing inside": turning(0, 1, 1, 1, 2),
}  # fmt: skip

ALONG = {"acceleration": 500, "jerk": 20000}
AXES = {"axis_acceleration": 500, "axis_jerk": 20000}
LIMITS = {
    "tangential": {"feed": 60, **ALONG},
    "axes": {"feed": 60, **AXES},
    "all": {"feed": 60, **ALONG, **AXES, "axis_velocity": 50, "chord_error": 1e-3, "centripetal": 400},
    "feed next to nothing": {"feed": 1e-9, **ALONG},
    "jerk next to nothing": {"feed": 60, "acceleration": 500, "jerk": 1e-9},
    "axis jerk next to nothing": {"feed": 60, "axis_acceleration": 500, "axis_jerk": 1e-9},
    "slowing down next to nothing": {"feed": 60, **ALONG, "deceleration": 1e-6, "deceleration_jerk": 1e-6},
    "everything huge": {"feed": 1e12, "acceleration": 1e15, "jerk": 1e20},
    "axes huge": {"feed": 1e12, "axis_acceleration": 1e15, "axis_jerk": 1e20},
    "acceleration out of reach": {"feed": 60, "acceleration": 1e12, "jerk": 1},
    "centripetal next to nothing": {"feed": 60, **ALONG, "centripetal": 1e-9},
    "corners in passing": {"feed": 60, **AXES, "axis_velocity_step": 5},
    "corners in passing at next to nothing": {"feed": 60, **AXES, "axis_velocity_step": 1e-12},
    "moving ends at the top feed": {"feed": 60, **ALONG, "start_feed": 60, "end_feed": 60},
    "moving ends": {"feed": 60, **AXES, "start_feed": 30, "end_feed": 1e-3},
}
#: Longer motions are planned only: their setpoints would take minutes. Paths larger than LONG, mm, take hours.
MOST_TICKS, LONG = 60_000, 1e5


def outcome(path: sf.Path, given: dict, strategy: str) -> str:
    """What comes of it: "ok", the kind of error, or "long"; all else, and what check refuses, is a failure."""
    try:
        limits = sf.Limits(**given)
        period = LONG_PERIOD if path.size > LONG else PERIOD
        law = sf.plan(path, limits, strategy=strategy, period=period)
        points = sf.interpolate(path, law) if law.duration <= MOST_TICKS * period else None
    except SplinefeedError as error:
        assert str(error).strip()
        return type(error).__name__
    if points is None:
        return "long"
    verdict = sf.check(points, path, limits, law=law)
    assert verdict.ok, verdict.problems
    return "ok"


#: What the strategies that take every limit, and much longer than seven-phase, are given in the normal run.
FEW = ("tangential", "everything huge")
CASES = [
    pytest.param(limits, strategy, marks=[pytest.mark.slow] if strategy != "seven-phase" and limits not in FEW else [])
    for limits in LIMITS
    for strategy in STRATEGIES
    if set(LIMITS[limits]) <= planning.STRATEGIES[strategy].holds
]


@pytest.mark.timeout(900)
@pytest.mark.parametrize(("limits", "strategy"), CASES)
def test_every_path_under_limits(limits, strategy):
    found = {name: outcome(path, LIMITS[limits], strategy) for name, path in PATHS.items()}
    if limits == "tangential":
        mixed = {"LimitsError"} if strategy == "seven-phase" else set()  # linear and rotary axes together
        assert set(found.values()) == {"ok", "long"} | mixed
        assert found["1e-6 mm curve far away"] == found["cusp"] == found["rotary alone"] == "ok"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sf.Path([bezier([[1, 1], [1, 1], [1, 1]])]), "all 3 control points are the same"),
        (lambda: sf.Path([*lines([0, 0], [10, 0]), bezier([[10, 0], [10, 0]])]), "the curve has no length"),
        (lambda: turning(1, 1), "the curve has no length"),
        (lambda: sf.Path([bezier(10 * WAVE)] * 2), "gap of 40 mm between the end of curve 0 and the start of curve 1"),
        (lambda: sf.Path([bezier([[0, np.nan], [1, 1]])]), "nan"),
    ],
)  # fmt: skip
def test_paths_that_cannot_be(make, message):
    with pytest.raises(CurveError, match=message):
        make()


@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"feed": 0, **ALONG}, "feed"),
        ({"feed": math.nan, **ALONG}, "feed is nan; it must be finite"),
        ({"feed": 60, "acceleration": -1, "jerk": 1}, "acceleration is -1"),
        ({"feed": 60, **ALONG, "axis_velocity": {"x": 0}}, "axis_velocity.x is 0"),
        ({"feed": 60, **ALONG, "start_feed": 61}, "start_feed"),
        ({"feed": 60, **ALONG, "end_feed": 61}, "end_feed"),
        ({"feed": 60, **ALONG, "axis_minimum": {"x": 1}, "axis_maximum": {"x": 0}}, "x"),
        ({"feed": 60, **ALONG, "axis_minimum": {"x": 0}, "axis_maximum": {"x": 1}}, "its travel allows at most 1 mm"),
        ({"feed": 60}, "needs a limit on acceleration"),
    ],
)
def test_limits_that_contradict_each_other_or_allow_no_motion(strategy, given, message):
    with pytest.raises(SplinefeedError, match=message):
        sf.plan(sf.Path(lines([0, 0], [10, 0])), sf.Limits(**given), strategy=strategy, period=PERIOD)


def test_an_axis_that_nothing_limits_turns_alone_by_the_limits_of_the_others():
    path, limits = PATHS["rotary between linear"], sf.Limits(feed=60, **AXES)
    law = sf.plan(path, limits, strategy="time-optimal", period=PERIOD)
    assert sf.check(sf.interpolate(path, law), path, limits, law=law).ok
