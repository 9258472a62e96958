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
@pytest.mark.parametrize("strategy", ["seven-phase", "time-optimal"])
def test_a_sample(strategy):
    seeds = range(5000, 5060 if strategy == "seven-phase" else 5012)
    found = [judge(seed, (strategy,)) for seed in seeds]
    assert found.count("ok") > 0.8 * len(found)


@pytest.mark.slow
def test_a_sample_of_corners_in_passing_and_moving_ends():
    found = [held(seed, random_motions.passing(seed)) for seed in range(14, 32)]
    assert found.count("ok") > 0.5 * len(found)
