"""Joints of LinuxCNC's kinematics modules: our formulas against the modules, and machines that have them, in motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.linuxcnc_kinematics import HAL, JERK, KEPT, TOOLS, machine, program
from benchmarks.linuxcnc_planner import PERIOD, module_missing, recorded

from linuxcnc_kinematics import asked
from linuxcnc_machine import mill
from splinefeed.live import linuxcnc_wire as wires
from splinefeed.live.linuxcnc_joints import LETTERS, MODULES, PROBES

pytestmark = [
    pytest.mark.slow,
    pytest.mark.linuxcnc,
    pytest.mark.skipif(bool(missing := module_missing()), reason=missing),
]


@pytest.mark.parametrize("kinematics", MODULES)
def test_lengths_come_from_what_the_module_answers_and_joints_are_its_own(kinematics: str):
    module = MODULES[kinematics]
    moved = mill(axes=module.order, kinematics=kinematics).moved
    assert moved is not None
    rng = np.random.default_rng(5)
    poses = rng.uniform(-100.0, 100.0, (50, wires.AXES))
    units = np.array([np.degrees(1.0) if axis in "abc" else 1.0 for axis in LETTERS])
    rows = [*(PROBES * units).tolist(), *poses.tolist()]
    for _ in range(3):
        pins = {f"{kinematics}.{name}": float(rng.uniform(-200.0, 200.0)) for name in module.lengths}
        answers = np.array(asked(kinematics, [{"pins": pins, "inverse": True, "rows": rows}])[0])[:, : len(moved.names)]
        joints = moved.answering(answers[: len(PROBES)])
        assert joints.bend == module.bend
        np.testing.assert_allclose(moved.at(joints, poses / units), answers[len(PROBES) :], atol=1e-8)


@pytest.mark.parametrize("kinematics", HAL)
def test_joints_keep_their_limits_where_stock_does_not(kinematics: str):
    ours = machine(kinematics, JERK)
    stock = recorded(program(kinematics), replace(ours, jerk=()))
    turned = "0.5:feed=60,1.2:feed=150,2.0:pause,2.6:resume,3.0:most=20,3.8:most=60,4.2:feed=30,5:feed=100"
    for actions in ("", turned):
        found = recorded(program(kinematics), ours, actions=actions)
        assert max(shares(found.position, ours)) <= 1.0 + KEPT
        np.testing.assert_allclose(found.position[-1], stock.position[-1], atol=1e-6)
    assert max(shares(stock.position, ours)[:2]) > 1.2  # velocity or acceleration of some joint


def shares(position, of) -> list[float]:
    """The largest velocity, acceleration and jerk of a joint at any tick, as shares of the limits."""
    given = (of.velocity, of.acceleration, of.jerk)
    return [
        float((np.abs(np.diff(position, n=n, axis=0)) / PERIOD**n / limit).max()) for n, limit in enumerate(given, 1)
    ]


def test_a_table_that_is_switched_to_trivial_kinematics_and_back_keeps_its_limits():
    ours = machine("xyzac-trt-kins", JERK)
    ours = replace(ours, hal=ours.hal + "net kind motion.analog-out-03 => motion.switchkins-type\n")
    assert ours.tools == TOOLS
    text = program("xyzac-trt-kins").replace(
        "M2\n", "M68 E3 Q1\nM66 E0 L0\nG1 X20 Y10 A-10 C40 F3000\nG1 X0 Y0 A0 C0\nM2\n"
    )
    found = recorded(text, ours)
    assert max(shares(found.position, ours)) <= 1.0 + KEPT
    assert np.max(np.abs(found.position[-1][[0, 1, 3, 4]])) < 1e-6
