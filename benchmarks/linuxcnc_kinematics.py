"""Machines inside LinuxCNC whose joints are no axes: joints over their limits, by LinuxCNC's planner and by ours."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.linuxcnc_planner import PERIOD, Mill, module_missing, recorded
from benchmarks.tables import Cell, Column, Headline, Report, Table
from splinefeed.live.linuxcnc_joints import MODULES
from splinefeed.live.linuxcnc_sink import LinuxcncError

#: Limits of linear axes and joints, mm and s, and of rotary ones, deg and s.
VELOCITY, ACCELERATION, JERK = (60.0, 90.0), (1000.0, 1200.0), (50_000.0, 60_000.0)
#: Limits are kept up to this share of them.
KEPT = 1e-6
TOOLS = "T1 P1 Z50 D1\n"
_TABLE = """\
setp {name}.{side}-offset 20
setp {name}.z-offset 10
setp {name}.x-rot-point 3
net tool motion.tooloffset.z {name}.tool-offset
"""
#: Rotary axes of each machine, and what HAL says of it.
TURNS = {
    "corexykins": "",
    "rotatekins": "C",
    "xyzac-trt-kins": "AC",
    "xyzbc-trt-kins": "BC",
    "5axiskins": "BC",
}
HAL = {
    "corexykins": "",
    "rotatekins": "",
    "xyzac-trt-kins": _TABLE.format(name="xyzac-trt-kins", side="y"),
    "xyzbc-trt-kins": _TABLE.format(name="xyzbc-trt-kins", side="x"),
    "5axiskins": "setp 5axiskins.pivot-length 150\n",
}
#: What an operator does meanwhile.
ACTIONS = (
    "0.5:feed=60,1.2:feed=150,2:pause,2.6:resume,3:most=20,3.8:most=60,4.2:feed=30,5:feed=120,6:rapid=40,"
    "7:pause,7.3:step,7.6:step,8:resume,8.5:feed=70,9.2:feed=100,11:rapid=100"
)


def machine(name: str, jerk: tuple[float, float]) -> Mill:
    """A simulated machine with such kinematics; jerk  of linear and rotary axes."""
    axes = "xyz" if name == "corexykins" else MODULES[name].order
    kinds = [axis in "abc" for axis in axes]
    velocity, acceleration, jerks = (tuple(limit[kind] for kind in kinds) for limit in (VELOCITY, ACCELERATION, jerk))
    tools = TOOLS if "tool" in HAL[name] else "T1 P1 D1\n"
    return Mill(velocity, acceleration, axes, name, jerks, hal=HAL[name], tools=tools)


def program(name: str) -> str:
    """Short lines that turn all rotary axes, lines, an arc, and with a table a tool of 50 mm."""
    turns = TURNS[name]

    def words(tilt: float, turn: float) -> str:
        return "".join(f" {axis}{angle:.4f}" for axis, angle in zip(turns[::-1], (turn, tilt), strict=False))

    lines = [
        f"G1 X{10 + 0.3 * k:.4f} Y{5 + 4 * np.sin(0.08 * k):.4f} Z{2 * np.sin(0.02 * k):.4f}"
        + words(-5 - 20 * np.sin(0.015 * k), 40 * np.sin(0.02 * k))
        for k in range(1, 201)
    ]
    tool = ["T1 M6 G43"] if "tool" in HAL[name] else []
    along = ["G1 W5", f"G1 X45 W0{words(-20, 90)}"] if name == "5axiskins" else []
    return "\n".join([
        *tool, "G21 G90 G17 G64 P0.01", "F3000", f"G0 X10 Y5 Z0{words(-5, 0)}", *lines, f"G1 X40 Y30{words(-10, 90)}",
        *along, "G1 X40", "G2 X0 Y20 I-20 J-5", "G61", "G1 X20 Y0", "G3 X40 Y20 I0 J20", f"G0 X0 Y0{words(0, 0)}",
        "M2", "",
    ])  # fmt: skip


def shares(position: NDArray[np.float64], of: Mill) -> list[float]:
    """The largest velocity, acceleration and jerk of a joint at any tick, as shares of the limits."""
    jerk = of.jerk or machine(of.kinematics, JERK).jerk
    given = (of.velocity, of.acceleration, jerk)
    return [
        float((np.abs(np.diff(position, n=n, axis=0)) / PERIOD**n / limit).max()) for n, limit in enumerate(given, 1)
    ]


def measure() -> Report:
    """Each machine by LinuxCNC's planner, by ours, and by ours while the operator turns, pauses and steps."""
    if missing := module_missing():
        raise LinuxcncError(missing)
    rows: list[tuple[Cell, ...]] = []
    failed, worst = [], 0.0
    for name in HAL:
        print(f"  {name}", file=sys.stderr, flush=True)
        ours = machine(name, JERK)
        try:
            stock = recorded(program(name), replace(ours, jerk=()))
            plain, turned = (recorded(program(name), ours, actions=actions) for actions in ("", ACTIONS))
        except LinuxcncError as error:
            failed.append(f"{name}: {error}.")
            continue
        cells = [shares(found.position, ours) for found in (stock, plain, turned)]
        times = [PERIOD * len(found.moving()) for found in (stock, plain)]
        rows.append((name, times[0], *cells[0], times[1], *cells[1], *cells[2]))
        worst = max(worst, *cells[1], *cells[2])
    what = (("velocity", ".3f"), ("acceleration", ".3f"), ("jerk", ".3f"))
    columns = (
        Column("kinematics"),
        *(Column(f"{who}: {kind}", form) for who in ("stock", "splinefeed") for kind, form in (("s", ".2f"), *what)),
        *(Column(f"turned: {kind}", form) for kind, form in what),
    )
    caption = (
        "Largest velocity, acceleration and jerk of a joint's command at any servo tick, as shares of its limits: 60 "
        "mm/s, 1,000 mm/s^2, 50,000 mm/s^3, and 90 deg/s, 1,200 deg/s^2, 60,000 deg/s^3; axes have the same."
    )
    notes = (
        "LinuxCNC 2.9, headless, without a real-time kernel. 200 short lines that turn the rotary axes, lines, an arc "
        "in G64 P0.01, a line and an arc in G61; the tables with a tool of 50 mm (G43). LinuxCNC's own planner knows "
        "only the limits of axes. Turned: overrides, pauses and steps meanwhile.",
        *failed,
    )
    line = Headline(
        "inside LinuxCNC: joints that are no axes over their limits, five kinematics", f"{worst:.3f}", "at most 1.000",
        worst <= 1.0 + KEPT and not failed,
    )  # fmt: skip
    return Report((Table(caption, columns, tuple(rows), notes),), (line,))
