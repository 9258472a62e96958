"""Tool paths and machines that several tests plan."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path as File

import numpy as np

import splinefeed as sf
from splinefeed.kinematics import KINDS, Kinematics, kinematics
from splinefeed.records import Array

#: Lengths of machines, mm, no two of them alike.
LENGTHS = {
    "x-rot-point": 3.0,
    "y-rot-point": -7.0,
    "z-rot-point": -20.0,
    "x-offset": 6.0,
    "y-offset": 4.0,
    "z-offset": -15.0,
    "tool-offset": 60.0,
    "pivot-length": 150.0,
    "skew": 0.25,
}
#: Every kind of machine that tilts the tool.
TILTING = tuple(kind for kind, chain in KINDS.items() if chain.rotary == 2)


def machine_of(kind: str) -> Kinematics:
    """A machine of a kind, with offsets."""
    return kinematics(kind, **{name: LENGTHS[name] for name in KINDS[kind].lengths.split()})


#: One of each.
MACHINES = tuple(map(machine_of, TILTING))


def flank(data_dir: File) -> sf.ToolPath:
    """The flank-milling path of the data, from its numbers."""
    said = json.loads((data_dir / "five-axis" / "flank_milling_2022.json").read_text())
    tip, point = (np.array(said[name], dtype=float) for name in ("tool_tip", "second_point_on_tool_axis"))
    return sf.ToolPath(sf.NurbsCurve(3, said["knots"], tip), sf.NurbsCurve(3, said["knots"], point), name="flank")


def random_tool_path(seed: int) -> sf.ToolPath:
    """A tip of some decimetres and a tool axis that leans by up to 60 degrees, in a direction that wanders.

    Every fourth one comes near the pole, where the last joint turns fast; every fifth one is lines with corners, the
    others are cubic splines.
    """
    random = np.random.default_rng(seed)
    count, near = int(random.integers(5, 15)), seed % 4 == 3
    tip = np.cumsum(random.normal(size=(count, 3)) * [25.0, 25.0, 6.0], axis=0)
    lean = np.radians(random.uniform(0.3 if near else 5.0, 20.0 if near else 60.0, count))
    phi = np.cumsum(random.normal(scale=1.5 if near else 0.6, size=count)) + random.uniform(-3.0, 3.0)
    axis: Array = np.column_stack([np.sin(lean) * np.cos(phi), np.sin(lean) * np.sin(phi), np.cos(lean)])
    name = f"random {seed}"
    if seed % 5 == 4:
        lines = [[sf.NurbsCurve(1, [0, 0, 1, 1], pair) for pair in pairwise(rows[:6])] for rows in (tip, axis)]
        return sf.ToolPath(lines[0], lines[1], kind="vectors", name=name)
    knots = np.concatenate([[0.0] * 3, np.linspace(0.0, 1.0, count - 2), [1.0] * 3])
    return sf.ToolPath(sf.NurbsCurve(3, knots, tip), sf.NurbsCurve(3, knots, axis), kind="vectors", name=name)


def of_kinds(axes: tuple[str, ...], linear: float, rotary: float) -> dict[str, float]:
    """One value for each linear joint and one for each rotary one."""
    return {axis: rotary if axis in "abc" else linear for axis in axes}


#: The limits that the paper of the flank-milling path prints, and its period, s.
FLANK_PERIOD = 2e-3
FLANK = sf.Limits(
    feed=100.0,
    chord_error=0.000125,
    axis_velocity={"x": 100.0, "y": 100.0, "z": 100.0, "a": 0.4, "c": 0.8},
    axis_acceleration=of_kinds(("x", "y", "z", "a", "c"), 500.0, 0.5),
    axis_jerk=of_kinds(("x", "y", "z", "a", "c"), 3000.0, 1.5),
)


def random_limits(seed: int, axes: tuple[str, ...]) -> tuple[sf.Limits, float]:
    """Limits of joints, tip feed and chord error over decades, and a period, s."""
    random = np.random.default_rng(seed + 1000)
    limits = sf.Limits(
        feed=random.uniform(20.0, 200.0),
        chord_error=10.0 ** random.uniform(-4.0, -2.0),
        orientation_error=10.0 ** np.random.default_rng(seed + 2000).uniform(-6.0, -4.0) if seed % 3 == 1 else None,
        axis_velocity=of_kinds(axes, random.uniform(50.0, 300.0), random.uniform(0.3, 3.0)),
        axis_acceleration=of_kinds(axes, random.uniform(300.0, 3000.0), random.uniform(1.0, 10.0)),
        axis_jerk=of_kinds(axes, 10.0 ** random.uniform(3.7, 5.0), 10.0 ** random.uniform(0.7, 2.0)),
    )
    return limits, float(random.choice([1e-3, 2e-3]))
