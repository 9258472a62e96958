"""Time-optimal plans of curves that were hard to plan well: as fast as references, or as exact solutions, say."""

from __future__ import annotations

import pytest
from benchmarks import cases
from benchmarks.curves import ALLOWED, CURVES, REFERENCE

import random_motions
import splinefeed as sf

PERIOD = 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(("name", "setting"), REFERENCE)
def test_as_fast_as_other_planners_within_a_half_percent(name: str, setting: str) -> None:
    path, limits = CURVES[name](), cases.axis_limits(setting)
    law = sf.plan(path, limits, strategy="time-optimal", period=PERIOD)
    assert law.duration <= ALLOWED * REFERENCE[name, setting]
    assert law.duration >= 0.99 * REFERENCE[name, setting]
    assert sf.check(sf.interpolate(path, law), path, limits, law=law).ok
    assert not law.notes


#: Seconds of random motions; before, each was much slower, or had a stretch at one slow feed.
RANDOM = {500394: 0.181, 500251: 1.457, 30266: 0.516, 70243: 0.316, 7009220: 14.131}


@pytest.mark.slow
@pytest.mark.parametrize("seed", RANDOM)
def test_cusps_tight_loops_and_uneven_jerk_do_not_force_a_crawl(seed: int) -> None:
    made = random_motions.motion(seed)
    law = sf.plan(made.path, made.limits, strategy="time-optimal", period=made.period, bound=True)
    assert law.duration <= 1.005 * RANDOM[seed] + made.period
    assert not law.notes
    assert sf.check(sf.interpolate(made.path, law), made.path, made.limits, law=law).ok


@pytest.mark.slow
def test_a_rotary_axis_that_turns_on_next_to_where_x_stands() -> None:
    """One slow feed would take 5e11 s; 0.45 s is the bound on the cells of a plan."""
    made = random_motions.motion(30000, ("time-optimal",))
    law = sf.plan(made.path, made.limits, strategy="time-optimal", period=made.period, bound=True)
    assert law.settings["lower_bound_s"] < law.duration < 0.49
    assert sf.check(sf.interpolate(made.path, law), made.path, made.limits, law=law).ok


def test_an_axis_that_turns_back_where_it_is_looked_at_is_not_still() -> None:
    made = random_motions.motion(5006840, ("time-optimal",))
    law = sf.plan(made.path, made.limits, strategy="time-optimal", period=made.period)
    verdict = sf.check(sf.interpolate(made.path, law), made.path, made.limits, law=law)
    assert verdict.ok, verdict.problems
