"""Robot arms: kinematics against pinocchio, a tip on its curve, limits at ticks, what a robot's own limiter changes."""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess
import sysconfig
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

import splinefeed as sf
from benchmarks.tables import Cell, Column, Headline, Report, Table

Array = NDArray[np.float64]
PERIOD = 1e-3
#: Where `example-robot-data` puts its robots, and the tips that are planned for.
FOLDER = Path("cmeel.prefix/share/example-robot-data/robots")
URDFS = {
    "panda": ("panda_description/urdf/panda.urdf", "panda_hand_tcp"),
    "ur5": ("ur_description/urdf/ur5_joint_limited_robot.urdf", "tool0"),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", "link7"),
}
INSTALL = "pip install pin example-robot-data"
#: Franka's "Robot and interface specifications"; a UR5 by its manual, with a jerk of our choice.
PANDA = {
    "velocity": [2.175] * 4 + [2.61] * 3,
    "acceleration": [15, 7.5, 10, 12.5, 15, 20, 20],
    "jerk": [7500, 3750, 5000, 6250, 7500, 10000, 10000],
    "torque": [87] * 4 + [12] * 3,
    "minimum": [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973],
    "maximum": [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973],
}
LIMITS: dict[str, dict[str, Any]] = {
    "panda": PANDA,
    "ur5": {"velocity": 3.14, "acceleration": 15, "jerk": 500},
    "xarm7": {"acceleration": 20, "jerk": 400},
}
HOLD = {"panda": "panda_joint3", "ur5": ()}
START = {"panda": [0, -0.785, 0, -2.356, 0, 1.571, 0.785], "ur5": [0, -1.6, 1.9, -1.9, -1.57, 0]}
DOWN = np.diag([1.0, -1.0, -1.0])
WAYPOINTS = [
    [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785],
    [0.6, -0.2, 0.3, -1.9, 0.4, 1.9, 1.3],
    [1.2, 0.4, 0.1, -1.3, -0.2, 2.2, 0.2],
    [0.3, 0.7, -0.5, -1.0, 0.6, 1.4, -0.6],
    [-0.7, 0.1, -0.2, -1.8, -0.5, 2.5, 0.4],
    [-1.1, -0.5, 0.4, -2.3, 0.3, 1.7, 1.5],
    [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785],
]
#: FR3 in libfranka's rate_limiting.h: limits, less its margins, and V(q) = min(top, -off + sqrt(k (end - q))).
FR3_ACCELERATION, FR3_JERK = 10.0 - 1e-3, 5000.0 - 1e-3
FR3_TOP = np.array([2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26])
FR3_OFF = np.array([0.30, 0.20, 0.20, 0.30, 0.35, 0.35, 0.35])
FR3_FACTOR = np.array([12.0, 5.17, 7.0, 8.0, 34.0, 11.0, 34.0])
FR3_HIGH = np.array([2.7501, 1.7918, 2.9065, -0.1458, 2.8101, 4.5205, 3.0196])
FR3_LOW = np.array([-2.7501, -1.7918, -2.9065, -3.0481, -2.8101, 0.54092, -3.0196])
#: Random paths of the FR3, and problems of the suite, that are planned.
PATHS, PROBLEMS = 10, 20
#: What COPP, 1000 nodes, takes for these problems once it is slowed until its setpoints hold, s, and to find that, s:
#: `python -m benchmarks suite` plans them again.
COPP_TIME, COPP_SECONDS = 106.356, 37.0


def measure() -> Report:
    """One row a measure: what was found, and what it must be."""
    measures = (_pinocchio, _tips, _suite, _torque, _franka, _controller, _pause)
    rows = [row for each in measures for row in _guarded(each)]
    columns = (Column("measure"), Column("found"), Column("must be"), Column("holds"))
    notes = (
        "Panda, UR5, xArm7 of example-robot-data; 1 kHz; TCP paths are the butterfly at twice its size and a loop of "
        "0.9 m whose orientation turns by 0.5 rad and back, feed 500 mm/s. Shares are by differences of setpoints with "
        "rest outside. FR3: libfranka's own `limitRate` from the wheel pylibfranka, velocity by position. A row whose "
        "packages are missing says which.",
    )
    return Report((Table("Robot arms.", columns, tuple(rows), notes),), tuple(_headlines(rows)))


def _headlines(rows: list[tuple[Cell, ...]]) -> Iterator[Headline]:
    for what, found, target, holds in rows:
        if holds in ("yes", "no"):
            yield Headline(f"robot arms: {what}", str(found), str(target), holds == "yes")


def _guarded(each: Callable[[], list[tuple[Cell, ...]]]) -> list[tuple[Cell, ...]]:
    """Rows, or one that says what they need."""
    try:
        return each()
    except ImportError as error:
        return [(str(each.__doc__), f"not measured: {error}", "", "-")]


def _row(what: str, found: float, most: float, form: str = ".3g", unit: str = "") -> tuple[Cell, ...]:
    return what, f"{found:{form}}{unit}", f"<= {most:{form}}{unit}", "yes" if found <= most else "no"


def urdf(name: str) -> str:
    """The file of a robot; ImportError with what to install."""
    found = Path(sysconfig.get_path("purelib")) / FOLDER / URDFS[name][0]
    if not found.exists():
        raise ImportError(INSTALL)
    return str(found)


def arm_of(name: str, **how: Any) -> Any:
    """One of URDFS with its limits."""
    return sf.robot(urdf(name), tip=URDFS[name][1], limits=LIMITS[name], **how)


def _pinocchio() -> list[tuple[Cell, ...]]:
    """Against pinocchio."""
    try:
        import pinocchio as pin
    except ImportError:
        raise ImportError(INSTALL) from None
    rng = np.random.default_rng(44)
    torques, places = 0.0, 0.0
    for name, (_, tip) in URDFS.items():
        arm = arm_of(name)
        whole = pin.buildModelFromUrdf(urdf(name))
        locked = [k for k in range(1, whole.njoints) if whole.names[k] not in arm.joints]
        model = pin.buildReducedModel(whole, locked, pin.neutral(whole)) if locked else whole
        data, frame = model.createData(), model.getFrameId(tip)
        q, v, a = rng.uniform(-2, 2, (3, 1000, len(arm.joints)))
        own, (place, _) = arm.torque(q, v, a), arm.forward(q)
        for k in range(len(q)):
            torques = max(torques, float(np.max(np.abs(pin.rnea(model, data, q[k], v[k], a[k]) - own[k]))))
            pin.framesForwardKinematics(model, data, q[k])
            places = max(places, float(np.max(np.abs(data.oMf[frame].translation - 1e-3 * place[k]))))
    return [
        _row("torque of rigid bodies against pinocchio, 3 arms, 1,000 states", torques, 1e-11, ".1e", " N m"),
        _row("forward kinematics against pinocchio", places, 1e-12, ".1e", " m"),
    ]


def curve(kind: str) -> sf.Path:
    """The butterfly at twice its size, or a loop, mm."""
    if kind == "butterfly":
        own = sf.shapes.butterfly().curves[0]
        points = own.control_points - 0.5 * (own.control_points.max(0) + own.control_points.min(0))
        net = np.column_stack([2 * points[:, 1] + 450, 2 * points[:, 0], np.full(len(points), 300.0)])
        return sf.Path([sf.NurbsCurve(own.degree, own.knots, net, own.weights)], name=kind)
    u = np.linspace(0, 2 * np.pi, 25)
    net = np.column_stack([450 + 90 * np.cos(u), 140 * np.sin(u), 350 + 60 * np.sin(2 * u)])
    spline = make_interp_spline(np.linspace(0, 1, 25), net, 5)
    return sf.Path([sf.NurbsCurve(5, spline.t, spline.c)], name=kind)


def turns() -> Array:
    """Quaternions along the loop: 0.5 rad about a slanted axis and back."""
    from scipy.spatial.transform import Rotation

    axis = np.array([1, 0.3, 0.2]) / np.linalg.norm([1, 0.3, 0.2])
    down = Rotation.from_matrix(DOWN)
    return np.array(
        [(Rotation.from_rotvec(axis * 0.5 * np.sin(np.pi * k / 12) ** 2) * down).as_quat() for k in range(13)]
    )


def shares(q: Array, arm: Any, *, torque: bool = False) -> float:
    """Largest share of velocity, acceleration, jerk and torque by differences of setpoints (n, joints)."""
    whole = np.concatenate([np.ones((3, 1)) * q[0], q, np.ones((3, 1)) * q[-1]])
    bounds = (arm.velocity, arm.acceleration, arm.jerk)
    found = [np.max(np.abs(np.diff(whole, k, axis=0)) / PERIOD**k / most) for k, most in enumerate(bounds, 1)]
    if torque:
        v, a = (whole[2:] - whole[:-2]) / (2 * PERIOD), np.diff(whole, 2, axis=0) / PERIOD**2
        found.append(np.max(np.abs(arm.torque(whole[1:-1], v, a)) / arm.most_torque))
    return float(max(found))


def _tips() -> list[tuple[Cell, ...]]:
    """A tip on its curve."""
    off, worst, rows = 0.0, 0.0, []
    for name in ("panda", "ur5"):
        arm = arm_of(name, torque=False)
        for kind in ("butterfly", "loop"):
            tip = curve(kind)
            start = arm.inverse(tip(0.0), DOWN, START[name], hold=HOLD[name])
            turn = DOWN if kind == "butterfly" else turns()
            path = arm.along(tip, start=start, orientation=turn, hold=HOLD[name], feed=500.0)
            law = sf.plan(path, arm.limits, period=PERIOD, bound=True)
            points = sf.interpolate(path, law)
            place, _ = arm.forward(points.position)
            wanted = tip.evaluate(points.curve, points.u)[:, 0]
            off = max(off, 1e3 * float(np.max(np.linalg.norm(place - wanted, axis=1))))
            worst = max(worst, shares(points.position, arm))
            if not sf.check(points, path, arm.limits, law=law).ok:
                worst = np.inf
            most = 1.011 if (name, kind) == ("ur5", "butterfly") else 1.005
            ratio = law.duration / law.settings["lower_bound_s"]
            rows.append(_row(f"T over its lower bound, {name}, {kind} ({law.duration:.3f} s)", ratio, most, ".4f"))
    return [
        _row("TCP off the curve at setpoints, butterfly and turning loop, Panda and UR5", off, 1e-6, ".1e", " um"),
        _row("worst share of velocity, acceleration, jerk, those four", worst, 1 + 1e-6, ".6f"),
        *rows,
    ]


def _suite() -> list[tuple[Cell, ...]]:
    """20 seven-axis splines of the suite."""
    from benchmarks.suite.__main__ import path_of

    total, spent = 0.0, 0.0
    for k in range(PROBLEMS):
        file = Path(__file__).parent / f"suite/problems/random7-{k:02}.json"
        problem = json.loads(file.read_text(encoding="utf-8"))
        path, limits, period = path_of(problem), sf.Limits(**problem["limits"]), problem["period"]
        sf.plan(path, limits, strategy="time-optimal", period=period)
        began = time.process_time()
        law = sf.plan(path, limits, strategy="time-optimal", period=period)
        spent += time.process_time() - began
        total += law.duration
    what = "20 seven-axis splines of the suite, sum of T, against COPP slowed until it holds"
    return [
        _row(what, total, COPP_TIME, ".3f", " s"),
        _row("... processor time of all, against that of COPP", spent, COPP_SECONDS, ".1f", " s"),
    ]


def _torque() -> list[tuple[Cell, ...]]:
    """Waypoints with torque."""
    arm = arm_of("panda", payload=3.0)
    path = arm.through(WAYPOINTS)
    sf.plan(path, arm.limits, period=PERIOD)
    began = time.process_time()
    law = sf.plan(path, arm.limits, period=PERIOD)
    spent = time.process_time() - began
    worst = shares(sf.interpolate(path, law).position, arm, torque=True)
    bound = sf.plan(path, arm.limits, period=PERIOD, bound=True).settings["lower_bound_s"]
    rate = sf.robot(urdf("panda"), tip=URDFS["panda"][1], limits={**PANDA, "torque_rate": 1000.0}, payload=3.0)
    slower = sf.plan(path, rate.limits, period=PERIOD)
    q = sf.interpolate(path, slower).position
    whole = np.concatenate([np.ones((3, 1)) * q[0], q, np.ones((3, 1)) * q[-1]])
    v, a = (whole[2:] - whole[:-2]) / (2 * PERIOD), np.diff(whole, 2, axis=0) / PERIOD**2
    changed = float(np.max(np.abs(np.diff(rate.torque(whole[1:-1], v, a), axis=0)))) / PERIOD / 1000.0
    return [
        _row(f"plan with torque, 7 joints, {law.duration:.3f} s of motion, processor time", spent, 1.0, ".2f", " s"),
        _row("... worst share of velocity, acceleration, jerk, torque", worst, 1 + 1e-6, ".6f"),
        _row("... T over its lower bound", law.duration / bound, 1.005, ".4f"),
        _row(f"... rate of torque of 1000 N m/s, worst share (T {slower.duration:.3f} s)", changed, 1 + 1e-6, ".6f"),
    ]


def fr3(k: int) -> Callable[[Array], tuple[Array, Array]]:
    """The velocity law of a joint of the FR3, with libfranka's margin."""

    def law(q: Array) -> tuple[Array, Array]:
        up, low = (np.sqrt(np.maximum(FR3_FACTOR[k] * each, 0.0)) for each in (FR3_HIGH[k] - q, q - FR3_LOW[k]))
        most = [np.clip(each - FR3_OFF[k], 0.0, FR3_TOP[k]) - 1e-3 for each in (low, up)]
        return -most[0], most[1]

    return law


def _limiter() -> Any:
    """libfranka's limitRate as a function; ImportError where it cannot be had."""
    try:
        import pylibfranka
    except ImportError:
        raise ImportError("pip install pylibfranka") from None
    compiler = shutil.which("g++")
    if compiler is None:
        raise ImportError("g++ is missing")
    libraries = Path(pylibfranka.__file__).parents[1] / "pylibfranka.libs"
    franka = next(libraries.glob("libfranka-*.so*"))
    for name in ("libfmt", "libPocoFoundation", "libPocoNet", "libpcre"):
        for file in libraries.glob(f"{name}-*"):
            with suppress(OSError):
                ctypes.CDLL(str(file), ctypes.RTLD_GLOBAL)
    folder = Path(tempfile.mkdtemp())
    shim = folder / "shim.so"
    source = Path(__file__).with_name("franka.cpp")
    linked = [str(franka), f"-Wl,-rpath,{libraries}", "-Wl,--allow-shlib-undefined"]
    subprocess.run(
        [compiler, "-O2", "-std=c++17", "-shared", "-fPIC", str(source), "-o", str(shim), *linked], check=True
    )
    return ctypes.CDLL(str(shim))


def _franka() -> list[tuple[Cell, ...]]:
    """Ticks that franka's limiter changes."""
    limiter = _limiter()
    joints = tuple(sf.records.Joint(f"fr3_joint{k}", "rad") for k in range(1, 8))
    laws = sf.records.VelocityByPosition({joint: fr3(k) for k, joint in enumerate(joints)})
    room = sf.records.Approach(laws, dict.fromkeys(joints, FR3_JERK / FR3_ACCELERATION))
    limits = sf.Limits(
        axis_velocity=dict(zip(joints, FR3_TOP - 1e-3, strict=True)),
        axis_acceleration=dict.fromkeys(joints, FR3_ACCELERATION),
        axis_jerk=dict.fromkeys(joints, FR3_JERK),
        modelled=[laws, room],
    )
    rng = np.random.default_rng(7)
    middle, half = 0.5 * (FR3_HIGH + FR3_LOW), 0.5 * (FR3_HIGH - FR3_LOW)
    changed, ticks, ok = 0, 0, True
    for _ in range(PATHS):
        points = middle + 0.6 * half * rng.uniform(-1, 1, (9, 7))
        u = np.append(0.0, np.cumsum(np.sqrt(np.linalg.norm(np.diff(points, axis=0), axis=1))))
        spline = make_interp_spline(u / u[-1], points, 5)
        while True:  # the spline goes beyond its points
            path = sf.Path([sf.NurbsCurve(5, spline.t, spline.c)], axes=joints)
            inside = path(np.linspace(0, path.length, 4000))
            if np.all((inside > FR3_LOW + 0.05 * half) & (inside < FR3_HIGH - 0.05 * half)):
                break
            spline.c = middle + 0.9 * (spline.c - middle)
        law = sf.plan(path, limits, period=PERIOD)
        setpoints = sf.interpolate(path, law)
        ok &= sf.check(setpoints, path, limits, law=law).ok
        q = np.ascontiguousarray(np.concatenate([setpoints.position, np.repeat(setpoints.position[-1:], 300, axis=0)]))
        last = np.concatenate([q[:1], q[:-1]])
        both = [fr3(k)(last[:, k]) for k in range(7)]
        low, up = (np.ascontiguousarray(np.stack([each[side] for each in both], axis=1)) for side in (0, 1))
        out, fixed = np.empty_like(q), [np.full(7, FR3_ACCELERATION), np.full(7, FR3_JERK)]
        pointers = [each.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for each in (q, up, low, *fixed, out)]
        limiter.limit(ctypes.c_long(len(q)), *pointers)
        changed += int(np.sum(np.any(np.abs(out - q) > 1e-9, axis=1)))
        ticks += len(q)
    found = float(changed) if ok else np.inf
    what = f"ticks of {ticks:,} that libfranka's limitRate changes, FR3, {PATHS} random paths, velocity by position"
    return [_row(what, found, 0.0, ".0f")]


def _controller() -> list[tuple[Cell, ...]]:
    """JointTrajectory after its controller's interpolation: at ticks, and at any time, under whole limits, too."""
    slow = {**PANDA, "jerk": (np.array(PANDA["jerk"]) / 20.0).tolist()}
    at_ticks, off, between, count, duration = _interpolated(slow)
    whole = _interpolated(PANDA)
    return [
        _row("JointTrajectory after its controller's quintics at 1 kHz: worst share", at_ticks, 1.001, ".4f"),
        _row("... at any time, and with 20 times the jerk", max(between, whole[2]), 1.001, ".4f"),
        _row("... off the motion", max(off, whole[1]), 2e-6, ".1e", " rad"),
        _row(f"... points for {duration:.2f} s, and {whole[4]:.2f} s", float(max(count, whole[3])), 200.0, ".0f"),
    ]


def _interpolated(limits: dict[str, Any]) -> tuple[float, float, float, int, float]:
    """Worst share at ticks, distance from the motion, worst share at any time, points and duration."""
    from scipy.interpolate import BPoly

    arm = sf.robot(urdf("panda"), tip=URDFS["panda"][1], limits=limits, torque=False)
    path = arm.through(WAYPOINTS)
    law = sf.plan(path, arm.limits, period=PERIOD)
    points = sf.robots.joint_trajectory(path, law, arm.limits)
    message = points.as_dict()["points"]
    times = np.array([each["time_from_start"]["sec"] + 1e-9 * each["time_from_start"]["nanosec"] for each in message])
    q, v, a = (np.array([each[key] for each in message]) for key in ("positions", "velocities", "accelerations"))
    joined = BPoly.from_derivatives(times, np.stack([q, v, a], axis=1), orders=5)  # that is the controller's quintic
    ticks = np.minimum(np.arange(round(law.duration / PERIOD) + 1) * PERIOD, times[-1])
    out = joined(ticks)
    off = float(np.max(np.abs(out - sf.interpolate(path, law).position)))
    any_time = (times[:-1] + np.diff(times) * np.linspace(0.0, 1.0 - 1e-9, 101)[:, None]).T.ravel()
    kinds = enumerate((arm.velocity, arm.acceleration, arm.jerk), 1)
    between = max(float(np.max(np.abs(joined.derivative(k)(any_time)) / most)) for k, most in kinds)
    return shares(out, arm), off, between, len(points), law.duration


def _pause() -> list[tuple[Cell, ...]]:
    """A pause with torque."""
    arm = arm_of("panda", payload=3.0)
    path = arm.through(WAYPOINTS)
    law = sf.plan(path, sf.planner.with_reserve(arm.limits), period=PERIOD)
    course = sf.planner.LawSource(path, law)
    worst, longest = 0.0, 0
    for part in np.linspace(0.05, 0.95, 19):
        run = sf.planner.Override(course, arm.limits)
        before = round(part * law.duration / PERIOD)
        ran = run.run(np.repeat([1.0, 0.0], [before, 1500]))
        moving = np.flatnonzero(np.diff(ran.tau) > 0.0)
        longest = max(longest, int(moving[-1]) + 1 - before)
        q = path(law(np.concatenate([ran.tau, run.run(np.ones(200)).tau])))
        worst = max(worst, shares(q[: len(ran.tau)], arm, torque=True))
    return [
        _row("pause from full speed with torque, 19 places: the longest", 1e3 * PERIOD * longest, 400.0, ".0f", " ms"),
        _row("... worst share of velocity, acceleration, jerk, torque", worst, 1 + 1e-6, ".6f"),
    ]
