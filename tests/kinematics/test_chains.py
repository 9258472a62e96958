"""Every kind of kinematics against rotation matrices of SciPy about the axes that its entry states."""

from __future__ import annotations

from pathlib import Path as File

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import splinefeed as sf
from splinefeed.kinematics import KINDS, Kinematics
from splinefeed.kinematics.chains import Chain
from splinefeed.records import Array
from tool_paths import flank, machine_of

POINT = "x-rot-point y-rot-point z-rot-point"
#: What users may add as one entry: every order of joints, each sign of a head, A and B.
MADE = {
    **{
        f"table {a}c": Chain(f"x y z {a} c", f"{POINT} {b}-offset z-offset tool-offset", f"c {a}")
        for a, b in ("ay", "bx")
    },
    **{
        f"head {a}c": Chain(f"x y z {a[-1]} c", "pivot-length tool-offset", head=f"{a} c")
        for a in ("a", "-a", "b", "-b")
    },
    **{f"head {a} -c": Chain(f"x y z {a} c", "pivot-length tool-offset", head=f"{a} -c") for a in ("a", "b")},
    **{
        f"head {a} table c": Chain(f"x y z {a[-1]} c", f"{POINT} pivot-length tool-offset", "c", a)
        for a in ("a", "-a", "b", "-b")
    },
}
ALL = {**KINDS, **MADE}
ABOUT = {"a": [1.0, 0.0, 0.0], "b": [0.0, 1.0, 0.0], "c": [0.0, 0.0, 1.0], "theta": [0.0, 0.0, 1.0]}


@pytest.fixture
def made(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Kinematics:
    monkeypatch.setitem(KINDS, request.param, ALL[request.param])
    return machine_of(request.param)


def moved(by: Array) -> Array:
    out = np.eye(4)
    out[:3, 3] = by
    return out


def turned(name: str, angle: float) -> Array:
    out = np.eye(4)
    sign = -1.0 if name.startswith("-") else 1.0
    out[:3, :3] = Rotation.from_rotvec(sign * angle * np.array(ABOUT[name.lstrip("-")])).as_matrix()
    return out


def composed(machine: Kinematics, joints: Array) -> tuple[Array, Array]:
    """Tip and tool axis on the workpiece: where the slides carry the tool, in the frame of what the table turns."""
    chain, at = KINDS[machine.kind], dict(zip(machine.joints, joints, strict=True))
    point, beside = (
        np.array([machine.lengths.get(f"{k}-{name}", 0.0) for k in "xyz"]) for name in ("rot-point", "offset")
    )
    pivot, tool = (machine.lengths.get(name, 0.0) for name in ("pivot-length", "tool-offset"))
    work = np.eye(4)
    for name in chain.table.split():
        centre = point + (beside if name in "ab" else 0.0)
        work = moved(centre) @ turned(name, at[name]) @ moved(-centre) @ work
    head = moved(np.array([at["x"], at["y"], at["z"] + pivot]))
    for name in reversed(chain.head.split()):
        head = head @ turned(name, at[name.lstrip("-")])
    pose = np.linalg.inv(work) @ head @ moved(np.array([0.0, 0.0, -pivot - tool]))
    return pose[:3, 3], pose[:3, 2]


@pytest.mark.parametrize("made", ALL, indirect=True)
def test_forward_is_the_composition_of_the_turns(made: Kinematics) -> None:
    random = np.random.default_rng(11)
    slides = random.uniform(-500.0, 500.0, (200, made.linear))
    if "y2" in made.joints:
        slides[:, made.joints.index("y2")] = slides[:, 1] + made.lengths["skew"]
    joints = np.column_stack([slides, random.uniform(-6.0, 6.0, (200, made.rotary))])
    tips, axes = made.forward(joints)
    for row, tip, axis in zip(joints, tips, axes, strict=True):
        right, along = composed(made, row)
        assert np.max(np.abs(tip - right)) <= 2e-12 * 500.0
        assert np.max(np.abs(axis - along)) <= 1e-14


@pytest.mark.parametrize("made", MADE, indirect=True)
def test_a_new_kind_carries_a_tool_path(made: Kinematics, data_dir: File) -> None:
    tool = flank(data_dir)
    path = sf.kinematics.JointPath(tool, made)
    s = np.linspace(0.0, tool.length, 51)
    wanted = tool.orientation(*tool.locate(s))[:, 0]
    wanted /= np.linalg.norm(wanted, axis=1)[:, None]
    for row, tip, axis in zip(path(s), tool(s), wanted, strict=True):
        right, along = composed(made, row)
        assert np.max(np.abs(tip - right)) <= 2e-12 * 500.0
        assert np.max(np.abs(axis - along)) <= 1e-13


@pytest.mark.parametrize(
    ("joints", "how"),
    [
        ("x y z a c", {"table": "a c"}),
        ("x y z a c", {"head": "c a"}),
        ("x y z a b", {"table": "b", "head": "a"}),
        ("x y z a c", {"head": "a"}),
    ],
)
def test_turns_whose_formulas_are_not_there_are_refused(joints, how):
    with pytest.raises(ValueError, match="from the tool to the workpiece"):
        Chain(joints, "", **how)
