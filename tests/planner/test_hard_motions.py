"""Motions that once were refused, slow, or over a limit: whatever is planned, the independent check finds nothing.

Each is data, not a seed: what it is, its curves, feeds and limits, so that it stays what it is.
"""

from __future__ import annotations

import json
from typing import Any

import pytest

import splinefeed as sf
from docs_pages import ROOT
from splinefeed.paths.each_curve import Marker

MOTIONS = json.loads((ROOT / "tests/data/hard_motions.json").read_text(encoding="utf-8"))


def path_of(given: dict[str, Any]) -> sf.Path:
    curves = [sf.NurbsCurve(c["degree"], c["knots"], c["points"], c.get("weights")) for c in given["curves"]]
    said = {name: given[name] for name in ("feeds", "tolerances", "lines", "times", "by_tip") if name in given}
    markers = [Marker(*each) for each in given.get("markers", ())]
    return sf.Path(curves, given["axes"], tolerance=given["tolerance"], markers=markers, **said)


def motions() -> list[Any]:
    each = [pytest.param(m, marks=[pytest.mark.slow] * m.get("slow", False)) for m in MOTIONS]
    return [pytest.param(*m.values, marks=m.marks, id=f"{k} {m.values[0]['what']}") for k, m in enumerate(each)]


@pytest.mark.parametrize("given", motions())
def test_a_motion_that_once_failed_is_planned_within_its_limits(given: dict[str, Any]) -> None:
    path, limits, how = path_of(given), sf.Limits.from_dict(given["limits"]), {"strategy": given["strategy"]}
    if "start" in given:  # a state of another law, in which the path was longer
        start = sf.planner.State(*given["start"])
        again = sf.plan(path, limits, period=given["period"], start=start, **how)
        verdict = sf.check(sf.interpolate(path, again), path, limits, law=again, start=start)
        assert verdict.ok and again.duration <= given["most_s"], verdict.problems
        return
    law = sf.plan(path, limits, period=given["period"], **how)
    if "start_s" in given:  # from a state of its own law it goes on, and loses little
        t = given["start_s"]
        start = sf.planner.State(float(law.feed(t)), float(law.acceleration(t)), float(law(t)))
        again = sf.plan(path, limits, period=given["period"], start=start, **how)
        assert float(again.feed(0.0)) == pytest.approx(start.feed, rel=1e-9)
        assert t + again.duration <= 1.05 * law.duration + 2.0 * given["period"]
        verdict = sf.check(sf.interpolate(path, again), path, limits, law=again, start=start)
        assert verdict.ok, verdict.problems
        return
    assert law.duration <= given.get("most_s", float("inf"))
    verdict = sf.check(sf.interpolate(path, law), path, limits, law=law)
    assert verdict.ok, verdict.problems
