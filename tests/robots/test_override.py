"""An override of an arm keeps torques, too, at ticks and between them, whatever is wanted."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from docs_pages import ROOT

FILE = ROOT / "tests/data/two-link.urdf"
WAYPOINTS = np.array([[0, 0.5], [0.8, -0.4], [1.5, 0.9], [0.4, 1.6], [-0.6, 0.7], [0, 0.5]])
PERIOD = 1e-3


def torques(arm, path, law, tau, friction):
    q = path(law(tau))
    v, a = (q[2:] - q[:-2]) / (2 * PERIOD), np.diff(q, 2, axis=0) / PERIOD**2
    found = arm.torque(q[1:-1], v, a)
    for name, size in (("coulomb", np.sign(v) * (np.abs(v) > 1e-6)), ("viscous", v)):
        found = found + size * friction.get(name, 0.0)
    return np.abs(found)


@pytest.mark.parametrize("friction", [{}, {"coulomb": 2.0, "viscous": 1.0}], ids=["free", "rough"])
def test_pauses_and_reversals_keep_the_torque(friction):
    most = np.array([58.0, 25.0])
    arm = sf.robot(FILE, payload=2.0, limits={"torque": most}, friction=friction)
    path = arm.through(WAYPOINTS)
    law = sf.plan(path, sf.planner.with_reserve(arm.limits), period=PERIOD)
    course = sf.planner.LawSource(path, law)
    rng = np.random.default_rng(44)
    worst, without = 0.0, 0.0
    for _ in range(6):
        wanted = np.repeat(rng.choice([-1.0, 0.0, 0.3, 1.0, 1.0, 2.0], 30), rng.integers(20, 400, 30))
        ran = sf.planner.Override(course, arm.limits).run(wanted)
        worst = max(worst, float(np.max(torques(arm, path, law, ran.tau, friction) / most)))
        q = path(law(ran.tau))
        for order, limit in enumerate((arm.velocity, arm.acceleration, arm.jerk), 1):
            assert np.max(np.abs(np.diff(q, order, axis=0)) / PERIOD**order / limit) <= 1 + 1e-6
        free = sf.planner.Override(sf.planner.LawSource(path, law), no_torque(arm)).run(wanted)
        without = max(without, float(np.max(torques(arm, path, law, free.tau, friction) / most)))
    assert worst <= 1 + 1e-6
    assert without > 1.02  # an override that does not count torques
    assert worst > 0.9


def no_torque(arm):
    from dataclasses import replace

    return replace(arm.limits, torque=None)
