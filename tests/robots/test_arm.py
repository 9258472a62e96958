"""An arm from a URDF: kinematics and torques against other derivations, limits, and what is refused."""

from __future__ import annotations

import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import splinefeed as sf
from docs_pages import ROOT

FILE = ROOT / "tests/data/two-link.urdf"
TEXT = FILE.read_text(encoding="utf-8")
RNG = np.random.default_rng(44)
#: Three joints askew to each other, the second one slides; a weight hangs on the last by a fixed joint.
SKEW = """<robot name="skew">
<link name="a"/>
<link name="b"><inertial><origin xyz="0.1 -0.05 0.2" rpy="0.3 0.2 -0.4"/><mass value="4"/>
<inertia ixx="0.05" ixy="0.004" ixz="-0.003" iyy="0.06" iyz="0.002" izz="0.04"/></inertial></link>
<link name="c"><inertial><origin xyz="0.02 0.1 0.1"/><mass value="2"/><inertia ixx="0.01" iyy="0.02" izz="0.015"/>
</inertial></link>
<link name="d"><inertial><origin xyz="0 0.05 0.1"/><mass value="1"/><inertia ixx="0.004" iyy="0.003" izz="0.002"/>
</inertial></link>
<link name="e"/>
<joint name="one" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0.1 0.2 0.3" rpy="0.4 -0.3 0.2"/>
<axis xyz="1 2 -1"/></joint>
<joint name="two" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0.2 0 0.1" rpy="-0.5 0.7 0.1"/>
<axis xyz="0.3 -1 0.5"/></joint>
<joint name="three" type="continuous"><parent link="c"/><child link="d"/><origin xyz="0 0.3 -0.1"
rpy="1.1 0.2 0.6"/><axis xyz="-1 0.4 0.6"/></joint>
<joint name="end" type="fixed"><parent link="d"/><child link="e"/>
<origin xyz="0.1 0.05 0.25" rpy="0.1 0.2 0.3"/></joint>
</robot>"""
ENOUGH = {"velocity": 1.0, "acceleration": 5.0, "jerk": 100.0, "minimum": -300.0, "maximum": 300.0, "torque": 50.0}
#: Where each joint of SKEW is in the one before, its axis, whether it turns; mass, centre and inertia of its body.
JOINTS = [
    ((0.1, 0.2, 0.3), (0.4, -0.3, 0.2), (1, 2, -1), True),
    ((0.2, 0, 0.1), (-0.5, 0.7, 0.1), (0.3, -1, 0.5), False),
    ((0, 0.3, -0.1), (1.1, 0.2, 0.6), (-1, 0.4, 0.6), True),
]
_turn = Rotation.from_euler("xyz", (0.3, 0.2, -0.4)).as_matrix()
BODIES = [
    (4, (0.1, -0.05, 0.2), _turn @ [[0.05, 0.004, -0.003], [0.004, 0.06, 0.002], [-0.003, 0.002, 0.04]] @ _turn.T),
    (2, (0.02, 0.1, 0.1), np.diag([0.01, 0.02, 0.015])),
    (1, (0, 0.05, 0.1), np.diag([0.004, 0.003, 0.002])),
]


def poses(q):
    """Rotation and place, m, of each link of SKEW, and of its tip: written anew, q in rad and m."""
    R, p, found = np.eye(3), np.zeros(3), []
    for (xyz, rpy, axis, turns), each in zip(JOINTS, q, strict=True):
        p, R = p + R @ np.array(xyz), R @ Rotation.from_euler("xyz", rpy).as_matrix()
        unit = np.array(axis) / np.linalg.norm(axis)
        if turns:
            R = R @ Rotation.from_rotvec(unit * each).as_matrix()
        else:
            p = p + R @ unit * each
        found.append((R, p))
    tip = R @ Rotation.from_euler("xyz", (0.1, 0.2, 0.3)).as_matrix(), p + R @ [0.1, 0.05, 0.25]
    return found, tip


def energies(q):
    """Mass matrix and potential energy of SKEW, the velocities of its bodies by central differences of their poses."""
    h, M = 1e-5, np.zeros((3, 3))
    ahead, behind = ([poses(q + way * h * unit)[0] for unit in np.eye(3)] for way in (1, -1))
    here = poses(q)[0]
    for k, (mass, center, inertia) in enumerate(BODIES):
        places = [np.array([R @ center + p for R, p in (each[k] for each in side)]) for side in (ahead, behind)]
        v = ((places[0] - places[1]) / (2 * h)).T
        turns = [(a[k][0] - b[k][0]) / (2 * h) @ here[k][0].T for a, b in zip(ahead, behind, strict=True)]
        w = np.array([[S[2, 1], S[0, 2], S[1, 0]] for S in turns]).T
        M += mass * v.T @ v + w.T @ (here[k][0] @ inertia @ here[k][0].T) @ w
    return M, 9.81 * sum(mass * (R @ c + p)[2] for (mass, c, _), (R, p) in zip(BODIES, here, strict=True))


def test_torques_are_those_of_lagranges_equations():
    """M q'' + (dM/dt) q' - 1/2 d/dq (q' M q') + dV/dq, all by differences of energies."""
    arm = sf.robot(SKEW, limits=ENOUGH)
    h = 1e-4
    for _ in range(5):
        q, v, a = RNG.uniform(-1, 1, (3, 3)) * [[1], [2], [5]]
        sides = [(energies(q + h * unit), energies(q - h * unit)) for unit in np.eye(3)]
        dM = np.array([(x[0] - y[0]) / (2 * h) for x, y in sides])
        dV = np.array([(x[1] - y[1]) / (2 * h) for x, y in sides])
        wanted = energies(q)[0] @ a + np.einsum("k,kij,j->i", v, dM, v) - 0.5 * np.einsum("kij,i,j->k", dM, v, v) + dV
        mm = np.array([1, 1000, 1])
        np.testing.assert_allclose(arm.torque(q * mm, v * mm, a * mm), wanted, rtol=2e-6, atol=2e-6)


def test_the_tip_is_where_another_chain_puts_it():
    arm = sf.robot(SKEW, limits=ENOUGH)
    for q in RNG.uniform(-3, 3, (20, 3)):
        R, p = poses(q)[1]
        place, rotation = arm.forward(q * [1, 1000, 1])
        np.testing.assert_allclose(place, 1000 * p, atol=1e-11)
        np.testing.assert_allclose(rotation, R, atol=1e-14)


def test_derivatives_to_the_third_and_the_jacobian_are_those_of_differences():
    arm = sf.robot(SKEW, limits=ENOUGH)
    c = RNG.normal(size=(4, 3)) * [1, 100, 1]  # q(t) = sum c_k t^k
    t = np.linspace(-0.02, 0.02, 9)
    place, rotation = arm.forward(t[:, None] ** np.arange(4) @ c)
    exact = arm.derivatives((c * [[1], [1], [2], [6]])[:, None, :])
    for values, found in zip((place, rotation.reshape(9, 9)), exact, strict=True):
        fit = np.polynomial.Polynomial.fit
        for k in range(values.shape[1]):
            series = fit(t, values[:, k], 8).convert().coef[:4] * [1, 1, 2, 6]
            own = found.reshape(4, -1)[:, k]
            np.testing.assert_allclose(series, own, rtol=1e-5, atol=1e-5 * np.abs(own).max())
    J = arm.jacobian(c[0])
    np.testing.assert_allclose(J[:3] @ c[1], exact[0][1, 0], rtol=1e-12)
    S = exact[1][1, 0] @ exact[1][0, 0].T
    np.testing.assert_allclose(J[3:] @ c[1], [S[2, 1], S[0, 2], S[1, 0]], atol=1e-12)


def test_the_two_links_carry_their_weight_and_a_payload():
    """At rest and stretched out: m g times the arms of the levers."""
    arm, zero = sf.robot(FILE), np.zeros(2)
    assert arm.joints == ("shoulder", "elbow")
    assert (arm.base, arm.tip, arm.units) == ("base", "tip", ("rad", "rad"))
    np.testing.assert_allclose(arm.forward(zero)[0], [700, 0, 0], atol=1e-12)
    weight = 9.81 * np.array([3 * 0.2 + 2 * 0.55, 2 * 0.15])
    np.testing.assert_allclose(arm.torque(zero, zero, zero), weight, rtol=1e-13)
    loaded = sf.robot(FILE, payload=sf.robots.Payload(1.5, center=(100, 0, 0)))
    np.testing.assert_allclose(loaded.torque(zero, zero, zero), weight + 9.81 * 1.5 * np.array([0.8, 0.4]), rtol=1e-13)
    floating = sf.robot(FILE, gravity=(0, 0, 0))
    np.testing.assert_allclose(floating.torque(zero, zero, zero), 0.0, atol=1e-15)


def test_limits_are_those_of_the_urdf_unless_a_mapping_or_a_yaml_says_otherwise(tmp_path):
    arm = sf.robot(FILE)
    np.testing.assert_array_equal(arm.jerk, [800, 1200])
    np.testing.assert_array_equal([arm.minimum, arm.maximum], [[-1.5, -2.6], [2.5, 2.6]])
    own = sf.robot(FILE, limits={"jerk": [1, 2], "velocity": {"elbow": 0.5}, "acceleration": 9})
    np.testing.assert_array_equal([own.jerk, own.velocity, own.acceleration], [[1, 2], [3, 0.5], [9, 9]])
    pytest.importorskip("yaml")
    file = tmp_path / "joint_limits.yaml"
    file.write_text(
        "default_velocity_scaling_factor: 0.1\njoint_limits:\n  elbow:\n    has_velocity_limits: true\n"
        "    max_velocity: 1.25\n    has_acceleration_limits: false\n    max_acceleration: 0\n    max_jerk: 77\n",
        encoding="utf-8",
    )
    read = sf.robot(FILE, limits=file)
    np.testing.assert_array_equal([read.velocity, read.acceleration, read.jerk], [[3, 1.25], [20, 30], [800, 77]])
    assert read.notes == (f"{file}: default_velocity_scaling_factor 0.1 is not applied",)


def edited(*pairs):
    text = TEXT
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize(
    ("text", "more", "message"),
    [
        ("<!DOCTYPE r [<!ENTITY a 'b'>]><robot/>", {}, "URDF: line 1: entities are not read; write out"),
        ("<!DOCTYPE r [<!ATTLIST link name CDATA 'a'>]><robot/>", {}, "URDF: line 1: gives every <link> the attribute"),
        ("<robot><link></robot>", {}, "URDF: line 1, column 16: mismatched tag; expected URDF, is the file complete?"),
        ('<?xml version="1.0" encoding="klingon"?><robot/>', {}, "URDF: its encoding is not known: unknown encoding"),
        ('<?xml version="1.0" encoding="hex"?><robot/>', {}, "URDF: its encoding is not known: 'hex' is not a text"),
        (edited(('upper="2.6"', 'upper="2_6"')), {}, "URDF: line 18: joint 'elbow'"),
        (edited(('velocity="', 'velocity="1e-308" was="')), {}, "shoulder: velocity is 1e-308; it must be at least"),
        ("<model/>", {}, "URDF: line 1: the root is <model>; expected <robot>"),
        ("<robot/>", {}, "URDF: there is no <link>; is it a URDF?"),
        ("<robot><xacro:macro/></robot>", {}, "URDF: line 1: <xacro:macro>: expand it first"),
        ("<robot>" + "".join(f"<link name='{k}'/>" for k in range(1001)) + "</robot>", {}, "URDF: line 1: more than"),
        ("<a>" * 40, {}, "URDF: line 1: more than 100000 elements, or more than 32 deep"),
        (edited(('type="fixed"', 'type="floating"')), {}, "URDF: line 20: joint 'flange' is floating; an arm has"),
        (edited(('<limit lower="-2.6"', '<mimic joint="shoulder"/><limit lower="-2.6"')), {},
         "URDF: line 16: joint 'elbow' mimics another; a serial arm moves each joint by itself"),
        (edited(('<parent link="fore"/><child link="tip"/>', '<parent link="fore"/><child link="upper"/>')), {},
         "URDF: line 20: link 'upper' hangs on 'shoulder' and on 'flange'; a closed loop is no serial arm"),
        (edited(('<parent link="base"/>', '<parent link="fore"/>')), {"tip": "tip"}, "URDF: links hang on each"),
        (edited(('<parent link="base"/>', '<parent link="bse"/>')), {}, "URDF: line 12: joint 'shoulder' names"),
        (edited(('xyz="0.4 0 0"', 'xyz="0.4 nan 0"')), {}, 'URDF: line 17: joint \'elbow\': origin xyz="0.4 nan'),
        (edited(('<mass value="3.0"/>', "")), {}, "URDF: line 6: <inertial> of link 'upper' lacks <mass> or"),
        (edited(("inertial>", "ignored>")), {}, "URDF: link 'upper' has no <inertial>; torque needs it"),
        (edited((' jerk="1200"', "")), {}, "no limit of jerk of elbow: none is guessed; give limits={'jerk'"),
        (edited((' effort="60"', ' effort="0"')), {}, "no limit of torque of shoulder: none is guessed; give"),
        (TEXT, {"tip": "tap"}, "URDF: there is no link 'tap'; did you mean 'tip'?"),
        (TEXT, {"tip": "base"}, "URDF: no joint moves link 'base'; name a link at the end of the arm"),
        (TEXT, {"limits": {"speed": 1}}, "limits: 'speed' is not known; known are minimum, maximum"),
        (TEXT, {"limits": {"jerk": [1, 2, 3]}}, "limits: jerk has 3 values; the arm has 2 joints"),
        (TEXT, {"limits": {"jerk": -1}}, "limits: jerk of shoulder is -1; expected a finite number greater than 0"),
        (TEXT, {"limits": {"joint_limits": {"elbo": {}}}}, "limits: joint_limits.elbo: the robot has no"),
        (TEXT, {"payload": -1}, "payload: mass is -1 kg; it must not be negative"),
        (TEXT, {"payload": 1, "torque": False}, "payload: it counts for torque alone, and torque=False is given"),
        (TEXT, {"gravity": (0, 9.81)}, "gravity is (0, 9.81); expected 3 finite numbers, m/s^2"),
    ],
)  # fmt: skip
def test_what_is_no_arm_is_refused_with_place_and_mend(text, more, message):
    with pytest.raises(sf.errors.InputError) as error:
        sf.robot(text, **more)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


def test_without_torque_no_inertia_is_needed():
    arm = sf.robot(edited(("inertial>", "ignored>")), torque=False)
    with pytest.raises(sf.errors.InputError, match="two-link: was read with torque=False; leave that out for torques"):
        arm.torque([0, 0], [0, 0], [0, 0])
    with pytest.raises(sf.errors.InputError, match=r"joints have shape \(3,\); the last is 2: shoulder, elbow"):
        arm.forward([0, 0, 0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "tip"),
    [
        ("panda_description/urdf/panda.urdf", "panda_hand_tcp"),
        ("ur_description/urdf/ur5_joint_limited_robot.urdf", "tool0"),
        ("xarm_description/urdf/xarm7.urdf", "link7"),
    ],
)
def test_arms_of_the_trade_agree_with_pinocchio(file, tip):
    """1,000 random states; pinocchio (pin) and example-robot-data are not among the extras: install them for this."""
    pin = pytest.importorskip("pinocchio")
    places = [Path(each) / f"cmeel.prefix/share/example-robot-data/robots/{file}" for each in sys.path]
    urdf = next((each for each in places if each.exists()), None)
    if urdf is None:
        pytest.skip("example-robot-data is not installed")
    whole = pin.buildModelFromUrdf(str(urdf))
    fingers = [k for k in range(1, whole.njoints) if "finger" in whole.names[k]]
    model = pin.buildReducedModel(whole, fingers, pin.neutral(whole))
    data, frame = model.createData(), model.getFrameId(tip)
    arm = sf.robot(urdf, tip, limits={"acceleration": 10.0, "jerk": 500.0})
    assert list(model.names)[1:] == list(arm.joints)
    q, v, a = RNG.uniform(-3, 3, (3, 1000, model.nq)) * np.array([1, 1, 5])[:, None, None]
    torque, (place, rotation) = arm.torque(q, v, a), arm.forward(q)
    for k in range(len(q)):
        np.testing.assert_allclose(torque[k], pin.rnea(model, data, q[k], v[k], a[k]), rtol=0, atol=1e-11)
        pin.framesForwardKinematics(model, data, q[k])
        np.testing.assert_allclose(place[k], 1000 * data.oMf[frame].translation, rtol=0, atol=1e-9)
        np.testing.assert_allclose(rotation[k], data.oMf[frame].rotation, rtol=0, atol=1e-12)


def test_a_yaml_may_say_once_what_holds_for_several_joints(tmp_path):
    pytest.importorskip("yaml")
    file = tmp_path / "joint_limits.yaml"
    each = "&each {has_jerk_limits: yes, max_jerk: 500, max_acceleration: 10, max_deceleration: 8}"
    file.write_text(f"joint_limits:\n  shoulder: {each}\n  elbow: *each\n", encoding="utf-8")
    arm = sf.robot(FILE, limits=file)
    assert arm.jerk.tolist() == [500.0, 500.0]
    assert arm.acceleration.tolist() == [8.0, 8.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "a: &a [1]\n" + "".join(f"{x}: &{x} [{f'*{w}, ' * 9}*{w}]\n" for w, x in pairwise("abcdefghij"))
            + "joint_limits: {elbow: *j}\n",
            "joint_limits.elbow is [[[[[[[...]",
        ),
        ("joint_limits: {elbow: {max_jerk: " + "9" * 5000 + "}}", "joint_limits.elbow.max_jerk is '999999999999999"),
        ("joint_limits: {elbow: {max_jerk: " + "9" * 4000 + "}}", "joint_limits.elbow.max_jerk is '999999999999999"),
        ("joint_limits: {elbow: {max_jerk: 1" + ":1" * 40_000 + "}}", "joint_limits.elbow.max_jerk is '1:1:1:1"),
        ("joint_limits: " + "[" * 20_000, "is not YAML: cannot be parsed"),
        ("joint_limits: {elbow: {max_jerk: .inf}}", "joint_limits.elbow.max_jerk is '.inf'; expected a number"),
        ("#" * 2**18, "is larger than 128 kB; that is no joint_limits.yaml"),
    ],
)  # fmt: skip
def test_a_yaml_that_asks_for_much_is_refused_in_one_short_line(tmp_path, text, message):
    pytest.importorskip("yaml")
    file = tmp_path / "joint_limits.yaml"
    file.write_text(text, encoding="utf-8")
    begin = time.process_time()
    with pytest.raises(sf.SplinefeedError) as caught:
        sf.robot(FILE, limits=file)
    assert str(caught.value).startswith(f"{file}: {message}") and len(str(caught.value)) < 500
    assert time.process_time() - begin < 10.0


def test_a_robot_of_several_ends_lists_them_by_how_many_joints_move_them():
    text = """<robot name="r"><link name="base"/><link name="aside"/><link name="arm"/><link name="hand"/>
<joint name="a" type="fixed"><parent link="base"/><child link="aside"/></joint>
<joint name="b" type="revolute">
<parent link="base"/><child link="arm"/><limit velocity="1" lower="-1" upper="1"/></joint>
<joint name="c" type="revolute">
<parent link="arm"/><child link="hand"/><limit velocity="1" lower="-1" upper="1"/></joint>
</robot>"""
    with pytest.raises(sf.errors.FormatError, match=r"2 ends; name one as tip: hand \(2 joints\), aside \(0 joints\)"):
        sf.robot(text, limits={"acceleration": 5, "jerk": 50}, torque=False)
    with pytest.raises(sf.errors.FormatError, match="link 'aside' does not hang on link 'arm'; name another base"):
        sf.robot(text, "aside", base="arm", limits={"acceleration": 5, "jerk": 50}, torque=False)
