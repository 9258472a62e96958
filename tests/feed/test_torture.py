"""Random paths and limits of every kind: whatever is planned, the independent check finds nothing to say."""

from __future__ import annotations

import os
import time

import pytest

import random_motions
import splinefeed as sf
from splinefeed.errors import CurveError, LimitsError, PlanError

#: What a plan may be refused for, and how the message then begins or what it contains.
REFUSALS = (
    "the linear axes stand still while",  # a rotary axis turns on where no law s(t) can hold its limits
    "would take",  # the same but for rounding: longer than thirty years
    "too short to",
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
    30065: "another, which ends behind it",
}


def judge(seed: int, strategies: tuple[str, ...]) -> str:
    """Plan, interpolate and check the motion of a seed: "ok", or why it was refused; anything else is a failure."""
    motion = random_motions.motion(seed, strategies)
    try:
        law = sf.plan(motion.path, motion.limits, motion.strategy, period=motion.period)
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


@pytest.mark.parametrize("seed", KEPT)
def test_what_once_failed(seed):
    assert judge(seed, ("time-optimal",)) == "ok"


@pytest.mark.parametrize("strategy", ["seven-phase", "time-optimal"])
def test_a_sample(strategy):
    seeds = range(5000, 5060 if strategy == "seven-phase" else 5012)
    found = [judge(seed, (strategy,)) for seed in seeds]
    assert found.count("ok") > 0.8 * len(found)


@pytest.mark.torture
@pytest.mark.timeout(24 * 3600)
def test_a_hundred_thousand():
    """As many as the time allows: SPLINEFEED_TORTURE_SECONDS, an hour by default, from SPLINEFEED_TORTURE_SEED."""
    first = int(os.environ.get("SPLINEFEED_TORTURE_SEED", "100000"))
    until = time.monotonic() + float(os.environ.get("SPLINEFEED_TORTURE_SECONDS", "3600"))
    done, failed = 0, []
    for seed in range(first, first + 100_000):
        if time.monotonic() > until:
            break
        done += 1
        try:
            judge(seed, ("seven-phase", "time-optimal"))
        except Exception as error:
            failed.append((seed, str(error)[:300]))
    print(f"{done} motions from seed {first}, {len(failed)} failed")
    assert not failed, failed[:20]
