"""Random five-axis paths on every kind of machine: tips, tool axes, poles, travel, limits of many kinds, one a seed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

import splinefeed as sf
from splinefeed.errors import CurveError, LimitsError, SplinefeedError
from splinefeed.kinematics import KINDS, kinematics
from splinefeed.records import Array
from tool_paths import TILTING, random_limits

SHAPES = ("spline", "lines", "arcs", "dome", "knots", "points", "angles")
#: Joints that have no travel of their own go no further than this: mm, and turns of the last one.
FAR, TURNS = 3000.0, 40.0
#: Places at which a refusal is looked at; what is nearer to the pole than this, rad, has no direction.
PLACES, POLE = 4001, 1.2e-5
#: How far the tip may be off its curve: roundings of the largest joint.
TIP_ROUNDINGS = 64.0


@dataclass(frozen=True)
class ToolMotion:
    """What is planned: a tool path, a machine, where its joints may be and begin, limits, period and strategy."""

    tool: sf.ToolPath
    machine: sf.kinematics.Kinematics
    travel: dict[str, tuple[float, float]]
    start: dict[str, float]
    limits: sf.Limits
    period: float
    strategy: str

    def joints(self) -> sf.kinematics.JointPath:
        return sf.kinematics.JointPath(self.tool, self.machine, travel=self.travel, start=self.start)


def tool_motion(seed: int) -> ToolMotion:
    """The motion of a seed; machines go by turns."""
    random = np.random.default_rng([seed, 5])
    machine = random_machine(TILTING[seed % len(TILTING)], random)
    tool = random_tool(SHAPES[int(random.integers(len(SHAPES)))], machine, random)
    rotary = machine.joints[machine.linear :]
    limits, period = random_limits(seed, machine.joints)
    strategy = "time-optimal" if random.random() < 0.25 else "look-ahead"
    start = {rotary[1]: float(random.uniform(-7.0, 7.0))} if random.random() < 0.3 else {}
    return ToolMotion(tool, machine, random_travel(tool, machine, random), start, limits, period, strategy)


def random_machine(kind: str, random: np.random.Generator) -> sf.kinematics.Kinematics:
    """A machine with offsets, one of five without any."""
    scale = 0.0 if random.random() < 0.2 else 1.0
    given = {name: scale * random.uniform(-60.0, 60.0) for name in kinematics_of(kind) if name != "pivot_length"}
    if "pivot_length" in kinematics_of(kind):
        given["pivot_length"] = random.uniform(50.0, 300.0)
    given["tool_offset"] = scale * random.uniform(20.0, 150.0)
    return kinematics(kind, **given)


def kinematics_of(kind: str) -> list[str]:
    return [name.replace("-", "_") for name in KINDS[kind].lengths.split()]


def random_tool(shape: str, machine: sf.kinematics.Kinematics, random: np.random.Generator) -> sf.ToolPath:
    """A tool path of some decimetres."""
    count = int(random.integers(5, 15))
    tip = np.cumsum(random.normal(size=(count, 3)) * [25.0, 25.0, 6.0], axis=0)
    axis = random_axis(count, random)
    knots = clamped(3, count)
    if shape == "lines":
        rows = int(random.integers(2, 7))
        lines = [[sf.NurbsCurve(1, [0, 0, 1, 1], pair) for pair in pairwise(each[:rows])] for each in (tip, axis)]
        return sf.ToolPath(lines[0], lines[1], kind="vectors", name=shape)
    if shape == "arcs":
        return arcs(random)
    if shape == "dome":
        return dome(random)
    if shape == "knots":
        degree, other = int(random.integers(2, 6)), int(random.integers(6, 20))
        weights = random.uniform(0.3, 3.0, count)
        tip_curve = sf.NurbsCurve(3, knots, tip, weights)
        return sf.ToolPath(
            tip_curve,
            sf.NurbsCurve(degree, clamped(degree, other), random_axis(other, random)),
            kind="vectors",
            name=shape,
        )
    tip_curve = sf.NurbsCurve(3, knots, tip)
    if shape == "points":
        return sf.ToolPath(tip_curve, sf.NurbsCurve(3, knots, tip + random.uniform(5.0, 50.0) * axis), name=shape)
    if shape == "angles":
        turns = np.cumsum(random.normal(size=(count, 2)) * [0.15, 0.6], axis=0)
        return sf.ToolPath(tip_curve, sf.NurbsCurve(3, knots, turns), kind="angles", name=shape)
    return sf.ToolPath(tip_curve, sf.NurbsCurve(3, knots, axis), kind="vectors", name=shape)


def random_axis(count: int, random: np.random.Generator) -> Array:
    """Tool axes (count, 3): leaning, near the pole, straight through it, turning off there, or below the horizon."""
    lean = np.radians(random.uniform(5.0, 60.0, count))
    phi = np.cumsum(random.normal(scale=0.6, size=count)) + random.uniform(-3.0, 3.0)
    kind = random.random()
    if kind < 0.15:
        lean, phi = np.radians(random.uniform(0.3, 20.0, count)), phi + np.cumsum(random.normal(size=count))
    elif kind < 0.25:  # beside the pole, nearer and nearer
        plane = random.uniform(-0.4, 0.4, count)
        beside = np.full(count, 10.0 ** random.uniform(-4.5, -1.0))
        return turned(np.column_stack([plane, beside, np.ones(count)]), random.uniform(-3.0, 3.0))
    elif kind < 0.32:  # through it
        plane = np.linspace(-0.4, 0.5, count) + random.uniform(-0.02, 0.02, count)
        return turned(np.column_stack([plane, np.zeros(count), np.ones(count)]), random.uniform(-3.0, 3.0))
    elif kind < 0.335:  # stays there
        lean[: count - 1] = 0.0
    elif kind < 0.4:
        lean = np.radians(random.uniform(60.0, 120.0, count))
    found: Array = np.column_stack([np.sin(lean) * np.cos(phi), np.sin(lean) * np.sin(phi), np.cos(lean)])
    return found * np.linspace(1.0, random.uniform(1.1, 3.0), count)[:, None]


def turned(vectors: Array, by: float) -> Array:
    """Vectors turned about z by an angle, rad."""
    s, c = math.sin(by), math.cos(by)
    return vectors @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def clamped(degree: int, count: int) -> Array:
    """Even clamped knots over [0, 1]."""
    return np.concatenate([[0.0] * degree, np.linspace(0.0, 1.0, count - degree + 1), [1.0] * degree])


def arcs(random: np.random.Generator) -> sf.ToolPath:
    """Quarters of circles, one behind the other, the tool leaning outwards: the last joint winds on."""
    quarters = int(random.integers(1, 14))
    radius, lean, rise = random.uniform(3.0, 60.0), random.uniform(0.05, 1.0), random.uniform(-2.0, 4.0)
    way = random.choice([-1.0, 1.0])
    weights, knots = [1.0, math.sqrt(0.5), 1.0], [0, 0, 0, 1, 1, 1]
    tips, axes = [], []
    for k in range(quarters):
        corner = np.array([[1.0, 0.0], [1.0, way], [0.0, way]])
        by = way * 0.5 * math.pi * k
        ring = corner @ np.array([[math.cos(by), math.sin(by)], [-math.sin(by), math.cos(by)]])
        height = rise * (k + np.array([0.0, 0.5, 1.0]))
        tips.append(sf.NurbsCurve(2, knots, np.column_stack([radius * ring, height]), weights))
        axes.append(sf.NurbsCurve(2, knots, np.column_stack([lean * ring, np.ones(3)]), weights))
    return sf.ToolPath(tips, axes, kind="vectors", name="arcs")


def dome(random: np.random.Generator) -> sf.ToolPath:
    """A spiral on a sphere, from near its top downwards, the tool along its normal."""
    turns, radius, count = random.uniform(0.5, 6.0), random.uniform(20.0, 80.0), 120
    phi = np.linspace(0.0, 2.0 * math.pi * turns, count)
    down = np.linspace(10.0 ** random.uniform(-2.0, -0.5), random.uniform(0.6, 1.7), count)
    normal: Array = np.column_stack([np.sin(down) * np.cos(phi), np.sin(down) * np.sin(phi), np.cos(down)])
    knots = clamped(3, count)
    return sf.ToolPath(
        sf.NurbsCurve(3, knots, radius * normal), sf.NurbsCurve(3, knots, normal), kind="vectors", name="dome"
    )


def random_travel(
    tool: sf.ToolPath, machine: sf.kinematics.Kinematics, random: np.random.Generator
) -> dict[str, tuple[float, float]]:
    """Travel of joints: none, wide, on one side alone, or tight around one way to go."""
    kind, rotary = random.random(), machine.joints[machine.linear :]
    wide = {
        **dict.fromkeys("xyz", (-FAR, FAR)),
        rotary[0]: (-2.2, 2.2),
        rotary[1]: (-math.tau * TURNS, math.tau * TURNS),
    }
    if kind < 0.3:
        return {}
    if kind < 0.75:
        return wide
    if kind < 0.94:
        return (
            {**wide, rotary[0]: (-2.2, 0.1) if random.random() < 0.5 else (-0.1, 2.2)}
            if tool.kind != "angles"
            else wide
        )
    try:
        way = ways(tool, machine)[int(random.integers(2)) if tool.kind != "angles" else 0]
    except SplinefeedError:
        return wide
    low, high = np.min(way, axis=0), np.max(way, axis=0)
    k, span = int(random.integers(len(low))), high - low + 1e-3
    return {**wide, machine.joints[k]: (low[k] - random.uniform(-0.1, 0.5) * span[k], high[k] + 0.3 * span[k])}


def ways(tool: sf.ToolPath, machine: sf.kinematics.Kinematics) -> list[Array]:
    """Joints (PLACES, joints) on each of the two ways to turn, or on the one of angles that are given."""
    path = sf.kinematics.JointPath(tool, machine)
    s = np.linspace(0.0, tool.length, PLACES)
    one = path(s)
    if tool.kind == "angles":
        return [one]
    turns = one[:, 3] * -1.0, one[:, 4] + math.pi
    slides = machine.slides(tuple(tool(s).T), turns)
    other = np.column_stack([*slides, *turns])
    tip, axis = machine.forward(other)
    assert np.allclose(tip, tool(s), atol=1e-9)
    assert np.allclose(axis, machine.forward(one)[1], atol=1e-9)
    return [one, other]


def assert_out_of_reach(motion: ToolMotion, error: Exception) -> str:
    """What a refusal is: "pole" or "travel"; AssertionError unless no way of the joints is inside the travel."""
    tool, machine = motion.tool, motion.machine
    if isinstance(error, CurveError):
        assert "the tool axis is that of joint" in str(error), str(error)
        curve, u = tool.samples
        k = tool.orientation(curve, u)[:, 0]
        assert float(np.min(np.hypot(k[:, 0], k[:, 1]) / np.linalg.norm(k, axis=1))) < POLE, str(error)
        return "pole"
    assert isinstance(error, LimitsError), repr(error)
    assert str(error).startswith("travel."), str(error)
    for way in ways(tool, machine):
        low, high = np.min(way, axis=0), np.max(way, axis=0)
        for turn in range(-2 * int(TURNS) - 2, 2 * int(TURNS) + 3) if tool.kind != "angles" else (0,):
            shift = np.array([0.0] * (len(low) - 1) + [math.tau * turn])
            ends = [motion.travel.get(name, (-math.inf, math.inf)) for name in machine.joints]
            inside = [a <= x + y and z + y <= b for (a, b), x, z, y in zip(ends, low, high, shift, strict=True)]
            assert not all(inside), f"{error}, and {turn} turns further it stays inside"
    return "travel"


def differences(points: sf.Setpoints, limits: sf.Limits) -> Array:
    """Largest |difference| of the joints over each of their limits, (3, joints), standing still before and after."""
    q = np.concatenate([points.position[:1].repeat(3, axis=0), points.position, points.position[-1:].repeat(3, axis=0)])
    found = []
    for order, name in enumerate(("axis_velocity", "axis_acceleration", "axis_jerk"), start=1):
        seen = np.max(np.abs(np.diff(q, n=order, axis=0)), axis=0) / points.period**order
        found.append(seen / limits.of_axes(name, points.axes))
    return np.array(found)


def roundings(points: sf.Setpoints, limits: sf.Limits) -> Array:
    """What rounding of a joint, and of the arc length where it is steep, makes of those differences, (3, joints)."""
    moved = np.abs(np.diff(points.s))[:, None]
    steps = np.abs(np.diff(points.position, axis=0))
    steep = np.max(np.where(moved > 1e-2 * np.max(moved), steps / np.maximum(moved, 1e-300), 0.0), axis=0)
    known = 8.0 * np.finfo(float).eps * (np.max(np.abs(points.position), axis=0) + steep * points.s[-1])
    names = ("axis_velocity", "axis_acceleration", "axis_jerk")
    return np.array(
        [(2.0 / points.period) ** k * known / limits.of_axes(n, points.axes) for k, n in enumerate(names, start=1)]
    )


def check_motion(seed: int) -> tuple[str, float]:
    """What came of a seed, "ok", "pole" or "travel", and the largest share of a joint's limit; AssertionError else."""
    motion = tool_motion(seed)
    try:
        path = motion.joints()
    except (CurveError, LimitsError) as error:
        return assert_out_of_reach(motion, error), math.nan
    law = sf.plan(path, motion.limits, period=motion.period, strategy=motion.strategy)
    points = sf.interpolate(path, law)
    verdict = sf.check(points, path, motion.limits, law=law)
    assert verdict.ok, verdict.problems
    shares = differences(points, motion.limits)
    assert np.all(shares <= 1.0 + 1e-6 + roundings(points, motion.limits)), shares
    tip, _ = motion.machine.forward(points.position)
    off = np.linalg.norm(tip - path.tool.evaluate(points.curve, points.u, 0)[:, 0], axis=1)
    size = float(np.max(np.abs(points.position))) + path.length
    assert np.max(off) <= TIP_ROUNDINGS * np.finfo(float).eps * size, np.max(off)
    return "ok", float(np.max(shares))
