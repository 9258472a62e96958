"""How long a program takes on a machine whose file says how its control plans: in all, per tool, and where."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.machine.control import PLAIN, AxisControl, Control, changed
from splinefeed.machine.machine import Machine
from splinefeed.machine.parts import values
from splinefeed.programs.blocks import Blocks, read_blocks
from splinefeed.programs.control_planning import KINDS, LIMITS, BlockTimes, block_times
from splinefeed.programs.gcode.moves import Mark
from splinefeed.programs.gcode.tools import Tools
from splinefeed.records import Array, IntArray

CUTTING, RAPID, CHANGE, SPINDLE, DWELL, START = range(len(KINDS))
#: Most places that are listed, and by how much each parameter is changed in `saves`.
PLACES, BETTER = 10, 0.2
#: A step of velocity that no corner reaches, mm/s.
_ANY_STEP = 1e9
#: Revolutions a minute of 1 rad/s.
RPM = 30.0 / np.pi
#: Parameters whose decrease saves time; all other numbers of a control save it by growing.
_LESS = ("stop_time", "block_time", "tool_change", "start_time", "spindle.start", "spindle.stop")
#: Numbers of a control that are not performance.
_NEITHER = ("arc_growth", "arc_kink", "look_ahead", "spindle.top_speed", "cruise_ratio", "arc_tolerance", "arc_segment")
_PLACES = ("home.", "change_place.", "fit.")
#: Half the width of a 95 % interval in standard deviations.
WIDTH = 1.96


@dataclass(frozen=True, eq=False)
class LineTimes:
    """The time of each of n lines of a program; a line that is carried out again counts each time.

    Parameters
    ----------
    line : array (n,)
        Number in the file.
    seconds, beyond : array (n,)
        In all, and of these what is not length over programmed feed, s.
    begin : array (n,)
        When it is first carried out, s from the start.
    limit : array (n,)
        What binds longest there: index of `CycleTime.limits`.
    place : array (n, 3)
        X, Y and Z when it has been carried out, mm.
    operation : array (n,)
        How many tool changes there were by then.
    """

    line: IntArray
    seconds: Array
    beyond: Array
    begin: Array
    limit: IntArray
    place: Array
    operation: IntArray


@dataclass(frozen=True, eq=False)
class CycleTime:
    """The time of a program, in all and of each block, wait, operation and tool; `cycle_time` makes it.

    Parameters
    ----------
    name : str
        Of the program.
    machine : Machine
        With the control that carries it out.
    blocks : Blocks
        What moves, arrays (n,).
    times : BlockTimes
        How long each block takes, arrays (n,), s.
    waits : tuple of tuple
        Before which block, of which line, s, and kind of each wait between blocks.
    changes : tuple of tuple
        Block, line, and name of the new tool, of each change.
    again : callable, optional
        Reads the program for other places of a control.

    Raises
    ------
    InputError
        By `cycle_time`, where the machine file has too little.

    References
    ----------
    .. [1] docs/cycle-time.md

    Examples
    --------
    >>> from pathlib import Path
    >>> import splinefeed as sf
    >>> _ = Path("part.nc").write_text("G21 G90 G1 X60 F600")
    >>> time = sf.cycle_time("part.nc", "hurco-04")
    >>> round(time.total, 3), round(time.by_kind()["cutting_s"], 3)
    (8.401, 6.148)
    """

    name: str
    machine: Machine
    blocks: Blocks
    times: BlockTimes
    waits: tuple[tuple[int, int, float, int], ...]
    changes: tuple[tuple[int, int, str], ...]
    again: Callable[[Control], Blocks] | None = None

    @cached_property
    def rows(self) -> tuple[IntArray, Array, IntArray, IntArray]:
        """All blocks and waits in the order of time: line, seconds, kind, and number of the block or -1, (m,) each."""
        blocks, numbers = self.blocks, np.arange(len(self.blocks))
        to_change = np.isin(blocks.line, [line for _, line, _ in self.changes])
        moving = np.where(blocks.rapid, np.where(to_change, CHANGE, RAPID), CUTTING)
        before, line, seconds, kind = (np.array(each) for each in zip(*self.waits, strict=True))
        order = np.argsort(np.concatenate([before - 0.5, numbers]), kind="stable")
        both = ((line, blocks.line), (seconds, self.times.seconds), (kind, moving), (np.full(len(line), -1), numbers))
        line, seconds, kind, number = (np.concatenate(each)[order] for each in both)
        return line, seconds, kind, number

    def by_kind(self, chosen: Any = slice(None)) -> dict[str, float]:
        """Sum seconds by kind: cutting, rapid moves, tool changes, spindle, dwells and start.

        Parameters
        ----------
        chosen : slice or array (m,), optional
            Which of the m `rows` are counted; all by default.

        Returns
        -------
        dict of str to float
            `total_s`, and the seconds of each kind, `cutting_s` and so on.
        """
        _, seconds, kind, _ = self.rows
        sums = np.bincount(kind[chosen], seconds[chosen], len(KINDS)).tolist()
        return {"total_s": sum(sums), **{f"{name}_s": value for name, value in zip(KINDS, sums, strict=True)}}

    @property
    def total(self) -> float:
        """Seconds from the start button to the end."""
        return self.by_kind()["total_s"]

    @cached_property
    def operations(self) -> list[dict[str, Any]]:
        """Times from each M6 to the next: its line, tool, and seconds by kind."""
        line, _, kind, number = self.rows
        starts = [0, *np.flatnonzero((kind == CHANGE) & (number < 0)).tolist(), len(line)]
        names = [("", 1), *[(name, at) for _, at, name in self.changes]]
        return [
            {"tool": name, "line": at, **self.by_kind(slice(low, high))}
            for (name, at), (low, high) in zip(names, pairwise(starts), strict=True)
            if high > low
        ]

    @property
    def tools(self) -> list[dict[str, Any]]:
        """Times of each tool, in the order of their first use; time before the first change belongs to tool ""."""
        found: dict[str, dict[str, Any]] = {}
        for each in self.operations:
            tool = found.setdefault(each["tool"], {"tool": each["tool"]})
            tool |= {key: tool.get(key, 0.0) + value for key, value in each.items() if key.endswith("_s")}
        return list(found.values())

    @cached_property
    def by_line(self) -> LineTimes:
        """The time of each line that takes any, in the order of the file."""
        line, seconds, kind, number = self.rows
        lines, first, of = np.unique(line, return_index=True, return_inverse=True)
        moving = number >= 0
        ideal = np.zeros(len(line))
        ideal[moving] = self.blocks.length[number[moving]] / self.blocks.feed[number[moving]]
        order = np.lexsort((-np.arange(len(line)), seconds, of))
        longest = order[np.searchsorted(of[order], np.arange(len(lines)), "right") - 1]
        limit = np.where(moving, self.times.limit[number], kind)[longest]
        last = np.zeros(len(lines), dtype=np.int64)
        np.maximum.at(last, of, np.arange(len(line)))
        block = np.maximum.accumulate(number)[last]
        place = self.blocks.trace[np.append(self.blocks.end, 0)[block]]
        operation = np.cumsum((kind == CHANGE) & ~moving)[last]
        sums: Array = np.bincount(of, seconds).astype(np.float64)
        beyond: Array = sums - np.bincount(of, ideal)
        return LineTimes(lines, sums, beyond, (np.cumsum(seconds) - seconds)[first], limit, place, operation)

    @property
    def limits(self) -> tuple[str, ...]:
        """What `by_line` numbers: kinds of waits, then limits of moves."""
        return LIMITS

    def places(self, most: int = PLACES) -> list[dict[str, Any]]:
        """List the lines that take longest.

        Parameters
        ----------
        most : int, optional
            How many there are at the most.

        Returns
        -------
        list of dict
            `line`, `seconds`, `beyond_feed_s`, those beyond length over programmed feed, and `limit`, which binds
            longest; the longest first.
        """
        of = self.by_line
        found = [k for k in np.argsort(-of.seconds, kind="stable")[:most].tolist() if of.seconds[k] > 0.0]
        return [
            {
                "line": int(of.line[k]), "seconds": float(of.seconds[k]), "beyond_feed_s": float(of.beyond[k]),
                "limit": LIMITS[int(of.limit[k])],
            }
            for k in found
        ]  # fmt: skip

    def bound_by(self) -> dict[str, float]:
        """Sum seconds of the blocks by the limit that binds.

        Returns
        -------
        dict of str to float
            s, the longest first.
        """
        sums = np.bincount(self.times.limit, self.times.seconds, len(LIMITS))
        return {LIMITS[k]: float(sums[k]) for k in np.argsort(-sums) if sums[k] > 0.0}

    def saves(self, better: float = BETTER) -> list[dict[str, Any]]:
        """Tell what each parameter of the control saves if it is better by a share: the program is planned again.

        Parameters
        ----------
        better : float, optional
            The share, 0.2 for 20 %; the programmed feeds are such a parameter, too.

        Returns
        -------
        list of dict
            `what`, the parameter, and `saves_s`, s; the most first.
        """
        control = self.machine.control
        assert control is not None
        faster = replace(self.blocks, feed=(1.0 + better) * self.blocks.feed)
        again = {"programmed feeds": timed(faster, self.machine)}
        for name, one, value, _ in values(control):
            if "kind" in one.metadata and value and name not in _NEITHER and not name.startswith(_PLACES):
                other = changed(control, {name: value * (1.0 - better if name in _LESS else 1.0 + better)})
                again[name] = timed(self.blocks, replace(self.machine, control=other))
        found = [{"what": name, "saves_s": self.total - time.total} for name, time in again.items()]
        return sorted(found, key=lambda each: -float(each["saves_s"]))

    @property
    def control(self) -> str:
        """How the control passes corners, in words."""
        control = self.machine.control
        assert control is not None
        if control.model != "general":
            known = "as 2.9 was measured" if control.model == "linuxcnc" else "by its published rules"
            return f"{control.model}, {known}"
        if control.mode == "exact stop":
            return "exact stop at each block"
        return f"blending, {control.passing}" if control.passing else "stops at corners, no [control] says otherwise"

    @cached_property
    def corner_stops(self) -> tuple[int, float]:
        """How many corners are stops, and the seconds that they add to passing them; (0, 0.0) where corners are passed.

        Passing is planned again, at the speed of the arc that the two lines stand for.
        """
        control = self.machine.control
        assert control is not None
        if control.model != "general" or control.passing:
            return 0, 0.0
        passing = replace(control, mode="blending", velocity_step=_ANY_STEP)
        free = timed(self.blocks, replace(self.machine, control=passing))
        stopped = (self.times.end_speed == 0.0) & (free.times.end_speed > 0.0)
        return int(np.count_nonzero(stopped)), self.total - free.total

    @cached_property
    def interval(self) -> tuple[float, float] | None:
        """The 95 % interval of the total, s, where the machine file says how well its numbers are known, else None.

        By the numbers' deviations s and correlation C: sum g_i C_ij g_j, g_i half the change of the time between
        value + s and value - s, planned again; and by the spread that the fit leaves.
        """
        control = self.machine.control
        assert control is not None
        fit = control.fit
        if fit is None:
            return None
        said = {name: value for name, _, value, _ in values(control)}
        changes = []
        for name, deviation in zip(fit.numbers, fit.deviation, strict=True):
            value, ends = float(said.get(name, 0.0)), []
            for side in (1.0, -1.0):
                new = value + side * deviation if name in PLAIN else value * math.exp(side * deviation)
                other = changed(control, {name: new})
                moved = name.startswith(_PLACES) and self.again is not None
                blocks = self.again(other) if moved and self.again is not None else self.blocks
                ends.append(timed(blocks, replace(self.machine, control=other)).total)
            changes.append(0.5 * (ends[0] - ends[1]))
        g = np.array(changes)
        variance = float(g @ np.asarray(fit.correlation, dtype=np.float64).reshape(len(g), len(g)) @ g)
        half = WIDTH * math.sqrt(max(variance, 0.0) + (fit.spread * self.total) ** 2)
        return max(self.total - half, 0.0), self.total + half

    def as_dict(self) -> dict[str, Any]:
        """The keys of `splinefeed time --json`."""
        stops, stopping = self.corner_stops
        return {
            "name": self.name,
            "machine": self.machine.name,
            "dialect": self.blocks.dialect,
            "control": self.control,
            "corner_stops": stops,
            "corner_stops_s": stopping,
            **self.by_kind(),
            "interval_s": None if self.interval is None else list(self.interval),
            "tools": self.tools,
            "operations": self.operations,
            "places": self.places(),
            "limits": self.bound_by(),
            "blocks": len(self.blocks),
            "notes": list(self.blocks.findings),
        }


def cycle_time(
    program: str | os.PathLike[str],
    machine: Machine | str,
    *,
    dialect: str | None = None,
    start: str | Sequence[float] | None = None,
    offsets: str | Mapping[str, Sequence[float]] | None = None,
    tools: str | os.PathLike[str] | Tools | None = None,
    increments: bool = False,
    units: str | None = None,
    repair: bool = False,
    from_line: int | str | None = None,
) -> CycleTime:
    """Time a program on a machine as its control plans it.

    Parameters
    ----------
    program : str or PathLike
        A file of G-code.
    machine : Machine or str
        A Machine or its name.
    dialect : str, optional
        The control's; recognized by the content if not given.
    start : str or sequence of float, optional
        Where the tool is before the first line, X,Y,Z,A,B,C,U,V,W in mm and degrees; fewer will do.
    offsets : str or mapping, optional
        Of coordinate systems, in mm and degrees: {"G54": (x, y, z)} or "G54=x,y,z;G55=x,y,z"; places of G28, G30.
    tools : str or PathLike or Tools, optional
        A tool table as LinuxCNC has it (.tbl).
    increments : bool, optional
        Whether a Fanuc's axis words without a decimal point count 0.001 mm (0.0001 in), not mm.
    units : str, optional
        "mm" or "in": of lengths and feeds until the program says its own.
    repair : bool, optional
        Whether what can be mended is, with a finding.
    from_line : int or str, optional
        Number of the line at which the program is resumed.

    Returns
    -------
    CycleTime
        Seconds in all, of each block (n,), tool and line.

    Raises
    ------
    FormatError
        For a program that cannot be read.
    InputError
        Where the machine file has too little.

    Notes
    -----
    Each block's time is that of a control that looks ahead: junction speeds v by v_next^2 <= v^2 + 2 a L forward and
    backward, then a trapezoid or S-curve between them (`programs.control_planning`). A machine without [control] is
    taken to blend within the limits of its axes, with exact stops at corners.

    References
    ----------
    .. [1] docs/cycle-time.md says what is modelled.

    Examples
    --------
    >>> from pathlib import Path
    >>> import splinefeed as sf
    >>> _ = Path("part.nc").write_text("G21 G90 G1 X60 F600")
    >>> time = sf.cycle_time("part.nc", "hurco-04")
    >>> time.places(most=1)[0]["limit"]
    'programmed feed'
    """
    model = Machine.load(machine) if isinstance(machine, str) else machine
    model = model if model.control is not None else replace(model, control=Control(axes=_limits(model)))
    assert model.control is not None
    read = partial(
        read_blocks, program, dialect=dialect, start=start, offsets=offsets, tools=tools, repair=repair,
        from_line=from_line, increments=increments, units=units,
    )  # fmt: skip
    blocks = read(model.control)
    return replace(timed(blocks, model, Path(program).stem), again=read)


def timed(blocks: Blocks, machine: Machine, name: str = "") -> CycleTime:
    """Time blocks that are read.

    Parameters
    ----------
    blocks : Blocks
        Of the program.
    machine : Machine
        With a control.
    name : str, optional
        Of the program.

    Returns
    -------
    CycleTime
        Seconds in all, of each block, tool and line.
    """
    assert machine.control is not None
    times = block_times(blocks, machine)
    between = _Between(blocks, np.concatenate([[0.0], np.cumsum(times.seconds)]), machine.control)
    return CycleTime(name, machine, blocks, times, tuple(between.waits), tuple(between.changes))


def _limits(model: Machine) -> dict[str, AxisControl]:
    """The axes of a machine without [control], as far as their limits are known."""
    return {
        name: AxisControl(rapid=one.velocity, acceleration=one.acceleration, jerk=one.jerk)
        for name, one in ((name, axis.limits) for name, axis in model.axes.items())
    }


class _Between:
    """What passes between blocks while a program runs: waits, and where tools change."""

    def __init__(self, blocks: Blocks, clock: Array, control: Control) -> None:
        self.clock, self.control = clock, control
        self.waits = [(0, 0, control.start_time, START)]
        self.changes: list[tuple[int, int, str]] = []
        self.passed = control.start_time
        self.commanded = self.speed = self.ready = 0.0  # the spindle: rad/s, and when it turns so, s
        self.turning = False
        tool = ""
        due: tuple[int, int] | None = None  # the block before which a start of the spindle is waited for
        last = max([int(blocks.line[-1]), *[mark.line for mark in blocks.marks[-1:]]])
        for mark in (*blocks.marks, Mark(len(blocks), last, "M2")):
            if due is not None and (due[0] < mark.move or mark.line > due[1]):
                block = min(due[0], mark.move)
                self.settle(block, int(blocks.line[block]) if block < mark.move else mark.line)
                due = None
            codes = mark.text.split()
            tool = next((each for each in codes if each[0] == "T"), tool)
            if any([self.run(code, mark, tool) for code in codes]):
                behind = blocks.line[mark.move :] != mark.line  # the start is waited for behind the moves of its line
                due = mark.move + int(np.argmax(np.append(behind, True))), mark.line
            self.wait(mark.move, mark.line, mark.dwell, DWELL)

    def run(self, code: str, mark: Mark, tool: str) -> bool:
        """Carry out a word; whether the spindle begins to turn as commanded."""
        if code[0] == "S":
            self.commanded = float(code[1:]) / RPM
        if code in ("M3", "M4") or (code[0] == "S" and self.turning):
            if code[0] == "M" and self.speed == 0.0:
                self.settle(mark.move, mark.line)  # it stops before it turns again
            self.spin(mark, self.commanded, turning=True)
            return True
        if code in ("M5", "M6", "M2", "M30", "M60"):
            self.spin(mark, 0.0, turning=False)
        if code in ("M6", "M0", "M1", "M2", "M30", "M60"):
            self.settle(mark.move, mark.line)
        if code == "M6":
            self.changes.append((mark.move, mark.line, tool))
            self.wait(mark.move, mark.line, self.control.tool_change, CHANGE)
        return False

    def wait(self, block: int, line: int, time: float, kind: int) -> None:
        """Let time pass before a block."""
        if time > 0.0 or kind == CHANGE:  # each change begins an operation
            self.waits.append((block, line, time, kind))
            self.passed += time

    def settle(self, block: int, line: int) -> None:
        """Wait until the spindle turns as commanded, or has stopped."""
        self.wait(block, line, self.ready - (self.clock[block] + self.passed), SPINDLE)

    def spin(self, mark: Mark, speed: float, *, turning: bool) -> None:
        """Begin to change the speed of the spindle."""
        spindle, self.turning = self.control.spindle, turning
        if spindle is not None and speed != self.speed:
            full = spindle.start if speed > self.speed else spindle.stop
            self.ready = float(self.clock[mark.move]) + self.passed + spindle.wait(full, self.speed, speed)
            self.speed = speed
