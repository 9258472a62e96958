"""The modal state of a program, in the arrays that `layout` shares, and the rows of moves that it fills."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.moves import AXES, LETTERS, POLAR, RAPID, ROTARY, Mark, Moves, Spline
from splinefeed.formats.gcode.offsets import (
    FIRST_PARAMETER,
    POSITION_PARAMETERS,
    TOOL_PARAMETER,
    Frame,
    Offsets,
    from_polar,
)
from splinefeed.formats.gcode.tools import Tools
from splinefeed.records import Array, IntArray

#: Moves that are kept before they are handed on, and for how many there is room at first.
CAPACITY, _ROOM = 2**16, 64
INCH = 25.4
#: Tolerance of what says nothing of it, and of G64 without P, which sets no bound.
UNSAID, UNBOUNDED = -1.0, math.inf
#: Entries of the modes that M70 keeps, and what else a State keeps with them.
_KEPT_MODES = [layout.RELATIVE, layout.PLANE, layout.FEED_MODE, layout.EXACT_STOP, layout.CENTRES, layout.UNITS]
_KEPT_VALUES = [layout.FEED, layout.TOLERANCE]
_KEPT = ("_speed", "feed_per_turn", "top_speed", "surface", "spindle", "coolant", "returns", "length_code")
Modal = tuple[IntArray, Array, int, Mapping[str, Any]]


class State:
    """Position, offsets, units and modes; `take` hands out the moves that were made since the last time."""

    def __init__(self, offsets: Offsets, start: Array, tools: Tools | None = None) -> None:
        self.offsets, self.tools = offsets, tools
        self.selected, self.loaded = 0.0, 0.0  # tools, by T and by M6
        self.values = np.zeros(layout.STATE)
        # views of it (9,), mm and rad: where the tool is, in machine coordinates or, in a system that is turned (G10 L2
        # R), in those turned back about its zero; what is added to a programmed place; what one unit is
        self.position = self.values[layout.POSITION : layout.OFFSET]
        self.offset, self.scale = self.values[layout.OFFSET : layout.SCALE], self.values[layout.SCALE : layout.FEED]
        self.modes = np.zeros(layout.MODES, dtype=np.int64)
        self.modes[[layout.MOTION, layout.PLANE]] = -1, 17
        self.values[layout.TOLERANCE] = UNSAID
        self.count = 0  # of the rows and marks that are moves
        self.rows = np.zeros((_ROOM, layout.FLOATS))
        self.marks = np.zeros((_ROOM, layout.INTEGERS), dtype=np.int64)
        self._speed: float | None = None
        self.feed_per_turn = 0.0  # mm, of G95
        self.top_speed = math.inf  # of G96, turns a minute
        self.surface = False  # S is a speed at the surface (G96), m or ft a minute
        self.splines: list[Spline] = []
        self.said: list[Mark] = []
        self.held = False  # the last rows may still change
        self.tip = 0  # layout.TIP while X, Y and Z are the tool's tip
        self.spindle = 0  # 3 or 4 while it turns, as M codes say
        self.coolant: dict[int, None] = {}  # 7 and 8, as M codes say
        self.returns = 98  # or 99: where canned cycles end
        self.length_code = 490  # or 430, G43, to which G43.1 and G43.2 belong
        self.position[:] = start
        self.frame = Frame(0.0, np.zeros(2))  # how the rows behind `_turned` are turned
        self._chunk_start = start.copy()
        self._turned, self._turned_at = 0, start.copy()  # rows that are turned already, and where they end, unturned
        self.set_units(0)
        self.set_offsets()

    @property
    def full(self) -> bool:
        """Whether the moves should be taken before the next line."""
        return self.count >= CAPACITY and not self.held

    @property
    def across(self) -> int:
        """The axis across the plane in force."""
        return layout.ACROSS[int(self.modes[layout.PLANE])]

    @property
    def inch(self) -> bool:
        """Whether G20 is in force."""
        return bool(self.modes[layout.UNITS] == 20)

    def set_units(self, code: int) -> None:
        """G20 and G21, G70 and G71, as tenths, or 0 for mm unsaid: mm of one unit; degrees stay degrees."""
        self.modes[layout.UNITS] = {0: 0, 200: 20, 700: 20}.get(code, 21)
        self.scale[:] = INCH if self.inch else 1.0
        self.scale[list(ROTARY)] = math.pi / 180.0

    @property
    def place(self) -> Array:
        """Where the tool is, (9,), in machine coordinates."""
        return self.frame.to_machine(self.position)

    def set_offsets(self) -> None:
        """Take over what `offsets` says."""
        place = self.place
        self._turn_rows()
        self.frame = self.offsets.frame
        self.offset[:] = self.offsets.total
        self.position[:] = self._turned_at = self.frame.from_machine(place)

    def _turn_rows(self) -> None:
        """Turn what was added since the last time to the axes of the machine."""
        rows, marks = self.rows[self._turned : self.count], self.marks[self._turned : self.count]
        self.frame.turn_rows(self._turned_at, rows, marks, self.splines)
        self._turned, self._turned_at = self.count, self.position.copy()

    def turns(self, x: float) -> float:
        """The spindle's speed, turns a minute, with the tool `x` mm from its axis (which matters to G96)."""
        speed = self._speed or 0.0
        if not self.surface:
            return speed
        around = 2.0 * math.pi * abs(x)
        along = speed * (12.0 * INCH if self.inch else 1000.0)
        turns = min(along / around if around else math.inf, self.top_speed)
        if not math.isfinite(turns):
            raise LineError("G96 at X0 turns without bound; write D, the highest speed of the spindle, with G96")
        return turns

    def set_feed(self, feed: float | None) -> None:
        """Take over F of G94 and G95, if there is one, and what the speed of the spindle makes of it."""
        mode = self.modes[layout.FEED_MODE]
        if mode == layout.PER_MINUTE:
            self.values[layout.FEED] = self.values[layout.FEED] if feed is None else self.scaled(0, feed)
        if mode == layout.PER_TURN:
            self.feed_per_turn = self.feed_per_turn if feed is None else self.scaled(0, feed)
            x = self.position[0] - self.offset[0]
            at_axis = self.surface and not (x or math.isfinite(self.top_speed))
            self.values[layout.FEED] = 0.0 if at_axis else self.feed_per_turn * self.turns(float(x))

    def scaled(self, axis: int, value: float) -> float:
        """A word of an axis in mm or rad."""
        return float(value * self.scale[axis])

    def parameter(self, number: int | str) -> float | None:
        """Value of a parameter that the interpreter knows by its number or name, in the units in force."""
        if isinstance(number, str):
            return self._named(number)
        if number == TOOL_PARAMETER or number < FIRST_PARAMETER:
            return self.loaded if number == TOOL_PARAMETER else None
        return self.offsets.parameters(self.position - self.offset, self.scale).get(number)

    def _named(self, name: str) -> float | None:
        """Value of a predefined named parameter; LinuxCNC, "Predefined Named Parameters"."""
        if len(name) == 2 and name[0] == "_" and name[1].upper() in LETTERS:
            return self.parameter(POSITION_PARAMETERS + LETTERS.index(name[1].upper()))
        modes = self.modes
        known: dict[str, float] = {
            "_metric": not self.inch, "_imperial": self.inch,
            "_absolute": not modes[layout.RELATIVE], "_incremental": modes[layout.RELATIVE],
            "_inverse_time": modes[layout.FEED_MODE] == layout.INVERSE,
            "_units_per_minute": modes[layout.FEED_MODE] == layout.PER_MINUTE,
            "_units_per_rev": modes[layout.FEED_MODE] == layout.PER_TURN,
            "_plane": 10 * modes[layout.PLANE],
            "_feed": self.values[layout.FEED] / self.scale[0], "_rpm": self._speed or 0.0,
            "_spindle_on": self.spindle != 0, "_spindle_cw": self.spindle == 3,
            "_current_tool": self.loaded, "_selected_tool": self.selected, "_task": 0.0,
        }  # fmt: skip
        return float(known[name]) if name in known else None

    def target(self, words: Mapping[str, float], origin: Array | None = None) -> tuple[Array, int, int]:
        """Where axis words lead, (9,), with the bits of the axes said, and of those whose place is stated.

        origin  (9,) what axes without a word keep and relative words count from; the tool's place if None
        """
        there = (self.position if origin is None else origin).copy()
        said = 0
        relative = bool(self.modes[layout.RELATIVE])
        if words.keys() & set(POLAR):
            x, y = ((there - self.offset) / self.scale)[:2].tolist()
            words = from_polar(words, x, y, relative)
        for axis, letter in enumerate(LETTERS):
            if letter in words:
                base = there[axis] if relative else self.offset[axis]
                there[axis] = base + self.scaled(axis, words[letter])
                said |= 1 << axis
                check_size(letter, float(there[axis]))
        return there, said, 0 if relative else said

    def room(self, count: int) -> tuple[Array, IntArray]:
        """Rows and marks of that many more moves, to be written."""
        first, self.count = self.count, self.count + count
        if self.count > len(self.rows):
            more = max(self.count, 2 * first) - len(self.rows)
            self.rows = np.concatenate([self.rows, np.zeros((more, layout.FLOATS))])
            self.marks = np.concatenate([self.marks, np.zeros((more, layout.INTEGERS), dtype=np.int64)])
        return self.rows[first : self.count], self.marks[first : self.count]

    @property
    def flags(self) -> int:
        """Bits that every move has as things are."""
        stops = layout.STOPS if self.modes[layout.EXACT_STOP] else 0
        return self.tip | stops | (layout.INCH if self.inch else 0)

    def add(self, kind: int, end: Array, used: int, stated: int, line: int, **more: float) -> None:
        """One move to `end` (9,); `more` is centre, radius, turns, feed, flags and spline as the layout has them."""
        if kind != RAPID and self.modes[layout.FEED_MODE] == layout.PER_TURN and not self._speed:
            raise LineError("feed a revolution (G95) needs the speed of the spindle; write S before it")
        rows, marks = self.room(1)
        row = rows[0]
        row[:] = 0.0
        row[layout.END : layout.END + AXES] = end
        row[layout.CENTER : layout.CENTER + 3] = [more.get(letter, 0.0) for letter in "ijk"]
        row[layout.RADIUS], row[layout.TURNS] = more.get("radius", 0.0), more.get("turns", 1.0)
        row[layout.ROW_FEED] = more.get("feed", self.values[layout.FEED])
        row[layout.ROW_TOLERANCE] = self.values[layout.TOLERANCE]
        flags = int(more.get("flags", 0)) | self.flags
        axes = used | stated << layout.STATED
        marks[0] = kind, line, self.modes[layout.PLANE], flags, int(more.get("spline", -1)), axes
        self.position[:] = end

    def add_spline(self, spline: Spline, used: int, stated: int, **more: float) -> None:
        """One spline, from where the tool is to its last control point."""
        self.splines.append(spline)
        self.add(4, spline.points[-1], used, stated, spline.line, spline=len(self.splines) - 1, **more)

    def say(self, line: int, text: str = "", dwell: float = 0.0, stop: bool = True) -> None:
        """A marker before the next move."""
        self.said.append(Mark(self.count, line, text, dwell, stop))

    def control_tip(self, on: bool, line: int) -> None:
        """From here on X, Y and Z are the tool's tip, or the joints again."""
        self.tip = layout.TIP if on else 0
        self.offsets.tip = on
        self.set_offsets()
        if on:
            length = math.nan if self.tools is None else float(self.offsets.tool[2])
            self.said.append(Mark(self.count, line, length=length))

    def switch(self, code: int) -> None:
        """Take over what M3, M4, M5 and M6 say of spindle and tool."""
        if 3 <= code <= 5:
            self.spindle = code % 5
        if 7 <= code <= 9:
            self.coolant = {} if code == 9 else self.coolant | {code: None}
        if code == 6:
            self.loaded = self.selected

    def modal(self) -> Modal:
        """How things are but for places and the motion: what M70 keeps (LinuxCNC, "M70 Saved State")."""
        own = {name: getattr(self, name) for name in _KEPT}
        return self.modes[_KEPT_MODES], self.values[_KEPT_VALUES], self.offsets.active, own

    def restore(self, kept: Modal, line: int) -> None:
        """M72: how things were; what that switches becomes a marker."""
        self.modes[_KEPT_MODES], self.values[_KEPT_VALUES], system, own = kept
        said = [f"S{number(own['_speed'] or 0.0)}"] if own["_speed"] != self._speed else []
        said += [f"M{own['spindle'] or 5}"] if own["spindle"] != self.spindle else []
        said += ["M9", *[f"M{code}" for code in own["coolant"]]] if own["coolant"] != self.coolant else []
        for name, value in own.items():
            setattr(self, name, value)
        self.set_units(10 * int(self.modes[layout.UNITS]))
        self.offsets.select(system)
        self.set_offsets()
        if said:
            self.say(line, " ".join(said))

    def summary(self) -> str:
        """Tool, spindle and coolant as they are, in words."""
        said = [f"T{number(self.loaded)} M6"] if self.loaded else []
        said += ["G96"] if self.surface else []
        said += [f"S{number(self._speed)}"] if self._speed else []
        said += [f"M{code}" for code in (self.spindle, *self.coolant) if code]
        return " ".join(said)

    def select(self, tool: float) -> None:
        """T: the tool that M6 loads; LineError where the table of tools does not have it."""
        if self.tools is not None:
            self.tools.tool(tool)
        self.selected = tool

    def new_speed(self, speed: float) -> bool:
        """Take over the speed that S says; whether it is another one, for which a control waits at rest."""
        changed = bool(speed != self._speed)
        self._speed = float(speed)
        self.set_feed(None)
        return changed

    def switched(self, line: int, move: int, speed: float, code: float) -> None:
        """The marker before a move of S and one of M3 to M9, not a number where the line says none of it."""
        said, stop = [], not math.isnan(code)
        if not math.isnan(speed):
            stop |= self.new_speed(speed)
            said.append(f"S{number(speed)}")
        if not math.isnan(code):
            self.switch(int(code))
            said.append(f"M{int(code)}")
        self.said.append(Mark(move, line, " ".join(said), 0.0, stop))

    def take(self) -> Moves:
        """The moves made since the last time."""
        self._turn_rows()
        rows, marks = self.rows[: self.count], self.marks[: self.count]
        made = Moves(self._chunk_start, rows, marks, tuple(self.splines), tuple(self.said))
        self.rows, self.marks = np.empty_like(self.rows), np.empty_like(self.marks)
        self.count, self._turned, self.splines, self.said = 0, 0, [], []
        if len(made):
            self._chunk_start = made.ends[-1].copy()
        return made


def check_size(letter: str, value: float) -> None:
    """LineError for a place too far out."""
    if not abs(value) <= layout.LARGEST:
        raise LineError(
            f"{letter} leads to {value:g}; at most {layout.LARGEST:g} mm or rad from the zero point is possible"
        )


def number(value: float) -> str:
    """A number as words have it: no exponent, no more digits than it needs."""
    text = f"{value:.10f}".rstrip("0").rstrip(".")
    return text if text not in ("-0", "") else "0"
