"""A five-axis path beside LinuxCNC's own planner: short lines for it on xyzac-trt, our setpoints streamed into it."""

from __future__ import annotations

from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import splinefeed as sf
from benchmarks.linuxcnc_planner import PERIOD, Mill, recorded, watched
from benchmarks.tables import Cell, Column, Headline, Report, Table
from benchmarks.tool import flank, limits
from splinefeed.curves.differential import by_arc_length
from splinefeed.live.hal_files import SAMPLES, HalAxis, hal_text, sampler_cfg
from splinefeed.live.linuxcnc_sink import LinuxcncSink, installed
from splinefeed.live.motion import along, approach
from splinefeed.live.operator import Operator
from splinefeed.live.stream import play
from splinefeed.planner.override.reserve import with_reserve
from splinefeed.records import AXIS_LIMITS, Limits

Array = NDArray[np.float64]
#: Lines that stand for the path, as a CAM system cuts it; what G64 P allows, mm; rows kept ahead of HAL.
LINES, BLENDING, AHEAD = (40, 150), 0.01, 1500
#: What the stream may leave the tip off its curve by, mm: rounding of the rows, as LinuxCNC's kinematics see it.
ALLOWED = 1e-6
JOINTS = "xyzac"


@lru_cache(maxsize=1)
def paper() -> Limits:
    """The limits that the paper prints, without its chord error, which never binds."""
    return limits(500.0, 3000.0, 0.4, 0.8, 0.5, 1.5, None)


def mill(given: Limits) -> Mill:
    """LinuxCNC's machine of these limits: it has none of jerk, and takes those of axes for the tip, not for joints."""
    scale = np.where([each in "ac" for each in JOINTS], 180.0 / np.pi, 1.0)
    velocity, acceleration = (scale * given.of_axes(name, tuple(JOINTS)) for name in AXIS_LIMITS[:2])
    return Mill(tuple(velocity.tolist()), tuple(acceleration.tolist()), JOINTS, "xyzac-trt-kins")


def by_linuxcnc(path: sf.kinematics.JointPath, lines: int) -> Array:
    """Joints (n, 5), mm and rad, that LinuxCNC commands for the path as lines; the way to the start is left out."""
    s = np.linspace(0.0, path.length, lines + 1)
    poses = np.column_stack([path.tool(s), np.degrees(path(s)[:, 3:])])
    rows = ["G1 " + " ".join(f"{axis.upper()}{x:.6f}" for axis, x in zip(JOINTS, pose, strict=True)) for pose in poses]
    head = ["G21 G90 G94 G40 G49 G54", f"G64 P{BLENDING:g}", rows[0].replace("G1", "G0"), "G4 P0.2"]
    program = "\n".join([*head, f"F{60.0 * paper().feed:g}", *rows[1:], "M2", ""])
    joints = recorded(program, mill(paper())).moving(first_line=len(head) + 2)
    return np.column_stack([joints[:, :3], np.radians(joints[:, 3:])])


def streamed(path: sf.kinematics.JointPath, given: Limits, brought: Path | None = None) -> tuple[Array, Array]:
    """Our plan, with the reserve that lets it be overridden, streamed into LinuxCNC on xyzac-trt, one row a servo tick.

    Gives joints (n, 5), mm and rad, as HAL has commanded them, and poses (n, 5), mm and deg: tip and rotary axes as
    LinuxCNC's motion controller has seen them by its own forward kinematics, from the start of the path on. With
    `brought`, an INI file that LinuxCNC brings, that is the machine.
    """
    law = sf.plan(path, with_reserve(given), period=PERIOD)
    text, count = hal_text(tuple(HalAxis(axis) for axis in path.axes), PERIOD, motion=True), len(path.axes)
    own = sampler_cfg(count)
    text = text.replace(f"depth={SAMPLES} cfg={own}", f"depth={SAMPLES},{SAMPLES} cfg={own},{'f' * count}")
    for k, axis in enumerate(path.axes):
        # a joint is where it is told to be, as in the simulated machines that LinuxCNC brings
        text = text.replace(f"net spf-position-{k} joint.", f"net spf-command-{k} joint.")
        text += f"net seen-{k} axis.{axis}.pos-cmd sampler.1.pin.{k}\n"
    text += "addf sampler.1 servo-thread\nsetp sampler.1.enable 0\n"
    with watched(mill(given), text, brought=brought) as (home, found):
        sink = LinuxcncSink(AHEAD, record=True, settle=0.1, home=home)
        there = partial(approach, axes=path.axes, limits=given, period=PERIOD)
        state = play(along(path, law, given, highest=1.0), sink, Operator(), AHEAD, approach=there)
    assert state.done
    assert state.underruns == 0
    turns = np.degrees(path(0.0)[3:])
    commands = sink.samples[:, 3 : 3 + count]
    joints = commands[_last_at(commands, np.append(path(0.0)[:3], turns)) :]
    poses = found[0][_last_at(found[0], np.append(path.tool(0.0), turns)) :]
    return np.column_stack([joints[:, :3], np.radians(joints[:, 3:])]), poses


def _last_at(rows: Array, place: Array) -> int:
    """The last of rows that is at a place, to rounding."""
    return int(np.flatnonzero(np.max(np.abs(rows - place), axis=1) < 1e-9)[-1])


def off(tool: sf.ToolPath, tip: Array) -> tuple[Array, Array]:
    """Distances (n,) of tips (n, 3) from their curve, mm, and the arc lengths of its nearest points: Newton steps."""
    s = np.linspace(0.0, tool.length, 20001)
    s = s[cKDTree(tool(s)).query(tip)[1]]
    for _ in range(5):
        r = by_arc_length(tool.evaluate(*tool.locate(s), 3), 3)
        away = r[:, 0] - tip
        s = np.clip(s - np.sum(away * r[:, 1], axis=1) / (1.0 + np.sum(away * r[:, 2], axis=1)), 0.0, tool.length)
    return np.asarray(np.linalg.norm(tool(s) - tip, axis=1)), s


def judged(
    who: str, path: sf.kinematics.JointPath, joints: Array, period: float, tip: Array | None = None
) -> tuple[Cell, ...]:
    """A row of the table from joints (n, 5) of a motion; tip (n, 3) where somebody else has said where it is."""
    moves = np.flatnonzero(np.any(np.diff(joints, axis=0) != 0.0, axis=1))
    joints = joints[moves[0] : moves[-1] + 2]
    own, axis = path.kinematics.forward(joints)
    distance, s = off(path.tool, own)
    _, wanted = path.kinematics.forward(path(s))
    q = np.concatenate([joints[:1].repeat(3, axis=0), joints, joints[-1:].repeat(3, axis=0)])
    jerk = np.max(np.abs(np.diff(q, 3, axis=0)), axis=0) / period**3
    shares = [
        float(np.max(np.abs(np.diff(q, order, axis=0)) / period**order / paper().of_axes(name, path.axes)))
        for order, name in enumerate(AXIS_LIMITS, start=1)
    ]
    tip_off = distance if tip is None else off(path.tool, tip)[0]
    return (
        who,
        (len(joints) - 1) * period,
        *shares,
        float(np.max(jerk[:3])),
        float(np.max(jerk[3:])),
        1e3 * float(np.max(tip_off)),
        float(np.max(np.degrees(np.linalg.norm(axis - wanted, axis=1)))),
    )


def measure() -> Report:
    """Run each on LinuxCNC where it is installed; else the report has our plans alone, and says so."""
    path, rows = flank(), []
    if installed():
        rows += [judged(f"LinuxCNC, {n} lines, G64 P{BLENDING:g}", path, by_linuxcnc(path, n), PERIOD) for n in LINES]
        joints, poses = streamed(path, paper())
        rows.append(judged("ours, streamed into LinuxCNC, with a reserve", path, joints, PERIOD, poses[:, :3]))
    for strategy in ("look-ahead", "time-optimal"):
        law = sf.plan(path, paper(), period=PERIOD, strategy=strategy)
        rows.append(judged(f"ours, {strategy}", path, sf.interpolate(path, law).position, PERIOD))
    columns = (
        Column("who plans"),
        Column("time, s", ".3f"),
        Column("joint velocity, share", ".3f"),
        Column("joint acceleration, share", ".3f"),
        Column("joint jerk, share", ",.3f"),
        Column("jerk of X, Y, Z, mm/s^3", ",.0f"),
        Column("jerk of A, C, rad/s^3", ",.2f"),
        Column("tip off, um", ".3g"),
        Column("tool axis off, deg", ".1g"),
    )
    notes = (
        "The flank-milling path under the limits of joints that its paper prints, 1 ms, on LinuxCNC's xyzac-trt-kins "
        "without offsets, headless. LinuxCNC 2.9 is given lines of X, Y, Z, A, C of equal length, and as limits of its "
        "axes those of the joints; it knows no jerk. Joints as HAL has them at each servo tick; shares: their largest "
        "differences over the limits of the paper. Streamed: the tip is what LinuxCNC's own motion controller tells at "
        "each tick, by its forward kinematics from the joints in HAL; a reserve is what a stream keeps to be slowed. "
        "Without limits of jerk the best known motion takes 7.112 s, with them 8.031 s.",
    )
    table = Table("Five axes beside LinuxCNC's own planner.", columns, tuple(rows), notes)
    if not installed():
        return Report((table,), ())
    peer, stream, ours = rows[1], rows[2], rows[-1]
    outcome = (
        f"{ours[1]:.2f} s, jerk {ours[4]:.2f} of its limit; LinuxCNC's planner, {LINES[-1]} lines: {peer[1]:.1f} s, "
        f"{peer[4]:,.0f}, tip off {peer[7]:.0f} um"
    )
    return Report(
        (table,),
        (
            Headline("five axes beside LinuxCNC's planner", outcome),
            Headline(
                "a five-axis stream, the tip by LinuxCNC's own kinematics",
                f"off its curve by {1e-3 * float(stream[7]):.0e} mm",
                f"at most {ALLOWED:.0e} mm",
                1e-3 * float(stream[7]) <= ALLOWED,
            ),
        ),
    )
