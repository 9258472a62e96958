"""What the reader makes of a program next to what LinuxCNC's own interpreter makes of it: the same, or both refuse."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rs274_twin import ROUNDED, Canon, Run, run
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import FormatError
from splinefeed.programs.gcode.arcs import arc_curve, find_arcs
from splinefeed.programs.gcode.dialects import named
from splinefeed.programs.gcode.moves import Flag, MoveKind, Moves, joined
from splinefeed.programs.gcode.reader import Reading
from splinefeed.programs.gcode.state import UNSAID
from splinefeed.programs.gcode.tools import Tool, Tools, read_tools

#: A tool table in inches, as rs274 takes it without an INI file; ours is the same in mm.
TOOLS = "T1 P1 Z2 D.25 ; a drill\nT2 P2 X.5 Z-.25 D1\nT7 P4 Z3\n"
PLACES = {1: np.zeros(9), 280: np.zeros(9), 300: np.zeros(9)}


def tool_table(folder: Path, text: str = TOOLS) -> tuple[Path, Tools]:
    """The file, and what it says, in mm."""
    file = folder / "tool.tbl"
    file.write_text(text)
    table = read_tools(file)
    in_mm = {n: Tool(25.4 * t.offset, 25.4 * t.diameter) for n, t in table.by_number.items()}
    return file, replace(table, by_number=in_mm)


def ours(file: Path, tools: Tools | None = None) -> tuple[Moves, str]:
    """All moves up to the first error, and the error."""
    parts: list[Moves] = []
    message = ""
    try:
        for part in Reading(dialect=named("linuxcnc"), offsets=PLACES, tools=tools).checked(file):
            parts.append(part)
    except FormatError as error:
        message = str(error)
    return joined(parts), message


def held_against(file: Path, tools: tuple[Path, Tools] | None = None) -> Run:
    """Compare every move, wait and switch of the program with those of LinuxCNC."""
    twin = run(file, tools[0] if tools else None)
    moves, message = ours(file, tools[1] if tools else None)
    assert bool(message) == bool(twin.error), (message, twin.error)
    if message:
        return twin
    compare(moves, twin, file)
    return twin


def limits(canon: Canon) -> np.ndarray:
    """How far its places are rounded, mm and rad, (6,)."""
    return np.array([canon.rounded] * 3 + [math.radians(ROUNDED)] * 3)


def compare(moves: Moves, twin: Run, file: Path) -> None:
    step = np.max(np.abs(moves.step), axis=1) if len(moves) else np.zeros(0)
    arcs = find_arcs(moves)
    number = {int(move): i for i, move in enumerate(arcs.move)}
    columns = np.arange(3)
    # LinuxCNC leaves out moves that lead nowhere in some places and not in others
    shown = ROUNDED * np.where(moves.has(Flag.INCH), 25.4, 1.0)  # the least move that it prints
    kept = [i for i in range(len(moves)) if i in number or moves["kind"][i] == MoveKind.SPLINE or step[i] > shown[i]]
    place, theirs = np.zeros((1, 6)), []
    for canon in twin.moves:
        leads = np.all(np.any(np.abs(canon.end - place) > limits(canon), axis=1))
        if canon.middle is not None or canon.kind == "NURBS" or leads:
            theirs.append(canon)
        # where a spline ends it does not print
        place = moves["end"][moves["kind"] == MoveKind.SPLINE][:, :6] if canon.kind == "NURBS" else canon.end[None]
    assert len(kept) == len(theirs)
    for i, canon in zip(kept, theirs, strict=True):
        said = f"line {moves['line'][i]}"
        spline = moves["kind"][i] == MoveKind.SPLINE and canon.middle is not None  # an arc across the plane of a turn
        kind = "ARC" if i in number or spline else "NURBS" if moves["kind"][i] == MoveKind.SPLINE else "TRAVERSE"
        kind = "FEED" if kind == "TRAVERSE" and moves["kind"][i] != MoveKind.RAPID else kind
        assert kind == canon.kind, said
        if kind != "NURBS":
            # the place, the offset of its system and that of G92 are rounded each
            assert np.all(np.abs(moves["end"][i, :6] - canon.end) <= 3.0 * limits(canon)), said
        if canon.middle is not None:
            if spline:
                made = moves.splines[moves["spline"][i]]
                curve = NurbsCurve(made.degree, made.knots, made.points[:, :3], made.weights)
            else:
                curve = arc_curve(moves.starts[i], moves["end"][i], arcs, number[i], columns)
            middle = curve(0.5 * sum(curve.domain))
            # the centre is rounded too, and on a flat arc that moves its middle as far
            # and where the radii of both ends differ it does not say where the middle of the spiral lies
            spiral = 0.0 if spline else 0.1 * abs(arcs.last[number[i]] - arcs.first[number[i]])
            assert np.abs(middle - canon.middle).max() <= 6.0 * canon.rounded + spiral, said
        tolerance = moves["tolerance"][i]
        # LinuxCNC stops exactly within some cycles, where the program says nothing of a tolerance
        assert tolerance == UNSAID or tolerance == pytest.approx(canon.tolerance, abs=1e-6), said
        if kind != "TRAVERSE" and not moves["flags"][i] & Flag.INVERSE_FEED:
            assert moves["feed"][i] == pytest.approx(canon.feed, abs=canon.feed_rounded), said
    waits = [mark.dwell for mark in moves.marks if mark.dwell]
    assert waits == pytest.approx([wait for wait in twin.waits if wait], abs=1e-4)
    words = [word for mark in moves.marks for word in mark.text.split() if word[0] == "M"]
    # a change of tool and the end of the program stop the spindle there without being told
    switches = [word for word in twin.switches if word != "M5"]
    assert [word for word in words if word in set(switches)] == switches
