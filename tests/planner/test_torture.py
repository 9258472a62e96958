"""Random paths and limits of every kind: whatever is planned, the independent check finds nothing to say."""

from __future__ import annotations

import pytest

import random_motions
import splinefeed as sf
from splinefeed.errors import CurveError, LimitsError, PlanError

#: What a plan may be refused for, and how the message then begins or what it contains.
REFUSALS = (
    "seven-phase cannot plan linear and rotary axes together",
    "would take",  # the same but for rounding: longer than thirty years
    "too short to",
    "which is rounding; give its linear axes one position",
    "however slow it is",  # a rotary axis that turns on where the tip rests
    "allow at most",  # feeds at the ends that are too high
    "make them equal or move them apart",  # knots that differ by a rounding
    "leaves almost no feed",  # a rotary axis, or a chord error below the resolution of 1 nm
    "a limit leaves almost none",
    "no motion within the limits was found",  # next to rounding, as a rotary axis between places that all but coincide
)
#: Seeds that once failed, and what they were.
KEPT = {
    1: "a curvature jump between Beziers",
    20: "a cusp, but for rounding, inside the curve",
    26: "a cusp, but for rounding, under a chord error",
    28: "two stops a rounding apart",
    80: "a loop of 1e-5 that its samples do not show",
    91: "a cusp next to the start",
    1001: "two stops so near that cells between them have no length",
    1077: "a ramp that runs over a span of 1e-6",
    209: "a cusp next to the start, where r''' is 0/0 for most of the ramp",
    30013: "a rotary axis that turns while the other all but stands still: look-ahead passes",
    501060: "a rotary axis that turns over the rounding of far coordinates",
    9001126: "a rotary axis that turns over 1e-16 mm at the end",
    20022620: "a velocity of an axis that peaks between places while jerk along the path is level",
    70055760: "a tip between two of the places at which the distance from a chord is looked at",
    60031100: "a velocity of an axis at the tip of a bend of 1e-8 mm, between all places of a cell",
    60047540: "speeding up that turns into slowing down, where less jerk is allowed, between two places of a piece",
    9009840: "a turn of 1e-7, which is no corner, that ticks see",
}
KEPT_SEVEN_PHASE = {
    30448: "two dwells with one period of motion between them",
    30022475: "a rest at a knot, a rounding of time behind which nobody can tell how the feed goes",
}
KEPT_LOOK_AHEAD = {
    440002442: "an axis that turns next to rest, between places looked at: 25 % over its acceleration",
    440010621: "a jerk between them, 0.005 % over",
    450004883: "a deceleration between them, in a piece below what another one seemed to be",
    470004384: "an acceleration between them, in a piece whose places tell of no peak, 1 % over",
    470008301: "rotary axes that turn where the tip hardly moves",
    490007606: "a cusp whose tip was taken 1.5 um beside itself: 75 % over",
    440007601: "a rotary axis that turns on 1e-9 mm behind a knot",
    450001903: "a dwell of one period where a rotary axis turns as the other stops",
}
KEPT_PASSING = {
    31: "a corner in the middle of speeding up",
    147: "a corner of a polyline in one curve, from a moving start",
    167: "a curvature jump inside the ramp at an end",
    70161: "a dip of the feed at a corner, between two ticks",
    70076: "a lower top feed under which other cells speed up, and two limits of jerk",
}


def judge(seed: int, strategies: tuple[str, ...]) -> str:
    """Plan, interpolate and check the motion of a seed: "ok", or why it was refused; anything else is a failure."""
    try:
        motion = random_motions.motion(seed, strategies)
    except CurveError as error:
        assert any(reason in str(error) for reason in REFUSALS), (seed, str(error))
        return str(error)
    return held(seed, motion)


def held(seed: int, motion: random_motions.Motion) -> str:
    """The same for any motion."""
    try:
        law = sf.plan(motion.path, motion.limits, strategy=motion.strategy, period=motion.period, bound=True)
    except (CurveError, LimitsError, PlanError) as error:
        assert any(reason in str(error) for reason in REFUSALS), (seed, str(error))
        return str(error)
    if law.duration > 1e6 * motion.period:
        return "long"
    points = sf.interpolate(motion.path, law)
    verdict = sf.check(points, motion.path, motion.limits, law=law)
    assert verdict.ok, (seed, motion.strategy, verdict.problems)
    if "lower_bound_s" in law.settings:
        waits = sum(seconds for _, seconds in motion.path.dwells)
        assert law.settings["lower_bound_s"] <= (law.duration + waits) * (1 + 1e-9), seed
    return "ok"


@pytest.mark.slow
@pytest.mark.parametrize("seed", KEPT)
def test_what_once_failed(seed):
    found = judge(seed, ("time-optimal",))
    assert (found != "ok") == KEPT[seed].rsplit(": ", 1)[-1].startswith("refused")


@pytest.mark.parametrize("seed", KEPT_SEVEN_PHASE)
def test_what_once_failed_in_seven_phases(seed):
    assert judge(seed, ("seven-phase",)) == "ok"


@pytest.mark.parametrize("seed", KEPT_LOOK_AHEAD)
def test_what_once_failed_in_windows(seed):
    assert (judge(seed, ("look-ahead",)) == "ok") == (not KEPT_LOOK_AHEAD[seed].endswith("refused"))


@pytest.mark.slow
@pytest.mark.parametrize("seed", KEPT_PASSING)
def test_what_once_failed_beside_corners_in_passing(seed):
    assert held(seed, random_motions.passing(seed)) == "ok"


@pytest.mark.slow
@pytest.mark.parametrize("strategy", ["seven-phase", "time-optimal"])
def test_a_sample(strategy):
    seeds = range(5000, 5060 if strategy == "seven-phase" else 5012)
    found = [judge(seed, (strategy,)) for seed in seeds]
    assert found.count("ok") > 0.8 * len(found)


@pytest.mark.slow
def test_a_sample_of_corners_in_passing_and_moving_ends():
    found = [held(seed, random_motions.passing(seed)) for seed in range(14, 32)]
    assert found.count("ok") > 0.5 * len(found)
