"""The modal state of a program, in the arrays that `layout` shares, and the rows of moves that it fills."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.lines import Lines
from splinefeed.formats.gcode.moves import AXES, LETTERS, POLAR, RAPID, ROTARY, Mark, Moves, Spline
from splinefeed.formats.gcode.offsets import (
    G92_PARAMETERS,
    POSITION_PARAMETERS,
    SYSTEM_PARAMETER,
    SYSTEM_PARAMETERS,
    SYSTEM_STEP,
    TOOL_PARAMETER,
    Offsets,
)
from splinefeed.formats.gcode.tools import Tools
from splinefeed.formats.gcode.turned import Frame, from_polar
from splinefeed.records import Array, IntArray

#: Moves that are kept before they are handed on.
CAPACITY = 2**16
#: A line adds at most this many moves.
_ROOM = 4
#: Texts of markers that are kept, so that those alike are one.
_TEXTS = 2**16
INCH = 25.4
#: Tolerance of what says nothing of it, and of G64 without P, which sets no bound.
UNSAID, UNBOUNDED = -1.0, math.inf


#: Entries of the modes that M70 keeps, and what else a State keeps with them.
_KEPT_MODES = [layout.RELATIVE, layout.PLANE, layout.FEED_MODE, layout.EXACT_STOP, layout.CENTRES, layout.UNITS]
_KEPT = ("_speed", "feed_per_turn", "top_speed", "surface", "spindle", "coolant", "returns", "length_code")


@dataclass(frozen=True)
class Modal:
    """How things are but for places and the motion: what M70 keeps (LinuxCNC, "M70 Saved State")."""

    modes: IntArray
    values: Array
    system: int
    own: Mapping[str, Any]


class State:
    """Position, offsets, units and modes; `take` hands out the moves that were made since the last time.

    lines  no program has more of them, so that a short one needs less room
    """

    def __init__(self, offsets: Offsets, start: Array, extruder: bool, lines: int, tools: Tools | None = None) -> None:
        self.offsets, self.tools = offsets, tools
        self.selected, self.loaded = 0.0, 0.0  # tools, by T and by M6
        self.values = np.zeros(layout.STATE)
        self.modes = np.zeros(layout.MODES, dtype=np.int64)
        self._capacity = min(CAPACITY, lines + 2 * _ROOM)
        self.rows = np.zeros((self._capacity, layout.FLOATS))
        self.marks = np.zeros((self._capacity, layout.INTEGERS), dtype=np.int64)
        self.count = 0
        self._heard = np.zeros((self._capacity, layout.SAID), dtype=np.int64)
        self._spoken = np.zeros((self._capacity, layout.SPOKEN))
        self._texts: dict[tuple[int, int, float, float], str] = {}
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
        self.values[layout.TOLERANCE] = UNSAID
        self.modes[layout.MOTION] = -1
        self.modes[layout.PLANE] = 17
        self.modes[layout.EXTRUDER] = extruder
        self.position[:] = start
        self._frame = Frame(0.0, np.zeros(2))
        self._chunk_start = start.copy()
        self._turned, self._turned_at = 0, start.copy()  # rows that are turned already, and where they end, unturned
        self._taken = False
        self.set_units(0)
        self.set_offsets()

    @property
    def position(self) -> Array:
        """Where the tool is, (9,), mm and rad, a view that may be written to.

        In machine coordinates; in those turned back about the zero of a system that is turned (G10 L2 R).
        """
        view: Array = self.values[layout.POSITION : layout.POSITION + AXES]
        return view

    @property
    def busy(self) -> bool:
        """Whether there was a move or a marker yet."""
        return self._taken or self.count > 0 or bool(self.said)

    @property
    def full(self) -> bool:
        """Whether the moves should be taken before the next line."""
        return self.count > self._capacity - _ROOM and not self.held

    @property
    def across(self) -> int:
        """The axis across the plane in force."""
        return layout.ACROSS[int(self.modes[layout.PLANE])]

    @property
    def inch(self) -> bool:
        """Whether G20 is in force."""
        return bool(self.modes[layout.UNITS] == 20)

    def set_units(self, code: int) -> None:
        """G20 and G21, or 0 for mm unsaid: mm of one unit; degrees stay degrees."""
        self.modes[layout.UNITS] = code
        scale = self.values[layout.SCALE : layout.SCALE + AXES]
        scale[:] = INCH if self.inch else 1.0
        scale[list(ROTARY)] = math.pi / 180.0

    @property
    def place(self) -> Array:
        """Where the tool is, (9,), in machine coordinates."""
        return self._frame.to_machine(self.position)

    def turned_back(self, place: Array) -> Array:
        """A place (9,) of the machine as `position` has it."""
        return self._frame.from_machine(place)

    def set_offsets(self) -> None:
        """Take over what `offsets` says."""
        place = self.place
        self._turn_rows()
        self._frame = self.offsets.frame
        self.values[layout.OFFSET : layout.OFFSET + AXES] = self.offsets.total
        self.position[:] = self._turned_at = self.turned_back(place)

    def _turn_rows(self) -> None:
        """Turn what was added since the last time to the axes of the machine."""
        rows, marks = self.rows[self._turned : self.count], self.marks[self._turned : self.count]
        self._frame.turn_rows(self._turned_at, rows, marks, self.splines)
        self._turned, self._turned_at = self.count, self.position.copy()

    def turns(self, x: float) -> float:
        """The spindle's speed, turns a minute, with the tool `x` mm from its axis (which matters to G96)."""
        speed = self._speed or 0.0
        if not self.surface:
            return speed
        around = 2.0 * math.pi * abs(x)
        along = speed * (12.0 * INCH if self.inch else 1000.0)
        turns = along / around if around else math.inf
        if turns > self.top_speed or not math.isfinite(turns):
            turns = self.top_speed
        if not math.isfinite(turns):
            raise LineError("G96 at X0 turns without bound; write D, the highest speed of the spindle, with G96")
        return turns

    def set_feed(self, feed: float | None) -> None:
        """Take over F of G94 and G95, if there is one, and what the speed of the spindle makes of it."""
        mode = self.modes[layout.FEED_MODE]
        if feed is not None and mode == layout.PER_MINUTE:
            self.values[layout.FEED] = feed * self.values[layout.SCALE]
        if mode >= layout.PER_TURN:
            if feed is not None:
                self.feed_per_turn = float(feed * self.values[layout.SCALE])
            x = self.position[0] - self.values[layout.OFFSET]
            at_axis = mode == layout.SURFACE and not (x or math.isfinite(self.top_speed))
            self.values[layout.FEED] = 0.0 if at_axis else self.feed_per_turn * self.turns(float(x))

    def scaled(self, axis: int, value: float) -> float:
        """A word of an axis in mm or rad."""
        return float(value * self.values[layout.SCALE + axis])

    def parameter(self, number: int | str) -> float | None:
        """Value of a parameter that the interpreter knows by its number or name, in the units in force."""
        if isinstance(number, str):
            return self._named(number)
        if number in (SYSTEM_PARAMETER, TOOL_PARAMETER):
            return float(self.offsets.active) if number == SYSTEM_PARAMETER else self.loaded
        axis = number - POSITION_PARAMETERS
        if 0 <= axis < AXES:
            place = self.position[axis] - self.values[layout.OFFSET + axis]
            return float(place / self.values[layout.SCALE + axis])
        axis = number - G92_PARAMETERS
        if 0 <= axis < AXES:
            return float(self.offsets.g92[axis] / self.values[layout.SCALE + axis])
        system, axis = divmod(number - SYSTEM_PARAMETERS, SYSTEM_STEP)
        if 0 <= system < 9 and axis < AXES:
            return float(self.offsets.systems[system + 1][axis] / self.values[layout.SCALE + axis])
        if 0 <= system < 9 and axis == AXES:
            return math.degrees(self.offsets.angles.get(system + 1, 0.0))
        return None

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
            "_units_per_rev": modes[layout.FEED_MODE] >= layout.PER_TURN,
            "_plane": 10 * modes[layout.PLANE],
            "_feed": self.values[layout.FEED] / self.values[layout.SCALE], "_rpm": self._speed or 0.0,
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
            scale = float(self.values[layout.SCALE])
            x, y = ((there[:2] - self.values[layout.OFFSET : layout.OFFSET + 2]) / scale).tolist()
            words = from_polar(words, x, y, relative)
        for axis, letter in enumerate(LETTERS):
            if letter in words:
                base = there[axis] if relative else self.values[layout.OFFSET + axis]
                there[axis] = base + self.scaled(axis, words[letter])
                said |= 1 << axis
                check_size(letter, float(there[axis]))
        return there, said, 0 if relative else said

    def add(self, kind: int, end: Array, used: int, stated: int, line: int, **more: float) -> None:
        """One move to `end` (9,); `more` is centre, radius, turns, feed, flags and spline as the layout has them."""
        if self.count == len(self.rows):  # one line of a canned cycle stands for many
            self.rows, self.marks = (np.concatenate([each, np.zeros_like(each)]) for each in (self.rows, self.marks))
        if kind != RAPID and self.modes[layout.FEED_MODE] >= layout.PER_TURN and not self._speed:
            raise LineError("feed a revolution (G95) needs the speed of the spindle; write S before it")
        row, mark = self.rows[self.count], self.marks[self.count]
        row[:] = 0.0
        row[layout.END : layout.END + AXES] = end
        row[layout.TURNS] = more.get("turns", 1.0)
        row[layout.RADIUS] = more.get("radius", 0.0)
        for k, letter in enumerate("ijk"):
            row[layout.CENTER + k] = more.get(letter, 0.0)
        row[layout.ROW_FEED] = more.get("feed", self.values[layout.FEED])
        row[layout.ROW_TOLERANCE] = self.values[layout.TOLERANCE]
        flags = int(more.get("flags", 0)) | (layout.STOPS if self.modes[layout.EXACT_STOP] else 0)
        flags |= self.tip | (layout.INCH if self.inch else 0)
        spline = int(more.get("spline", -1))
        mark[:] = (kind, line, self.modes[layout.PLANE], flags, spline, used | stated << layout.STATED)
        self.position[:] = end
        self.count += 1

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
        """What M70 keeps."""
        own = {name: getattr(self, name) for name in _KEPT}
        values = self.values[[layout.FEED, layout.TOLERANCE]]
        return Modal(self.modes[_KEPT_MODES], values, self.offsets.active, own)

    def restore(self, kept: Modal, line: int) -> None:
        """M72: how things were; what that switches becomes a marker."""
        said = [f"S{number(kept.own['_speed'] or 0.0)}"] if kept.own["_speed"] != self._speed else []
        said += [f"M{kept.own['spindle'] or 5}"] if kept.own["spindle"] != self.spindle else []
        if kept.own["coolant"] != self.coolant:
            said += ["M9", *[f"M{code}" for code in kept.own["coolant"]]]
        self.modes[_KEPT_MODES] = kept.modes
        self.values[[layout.FEED, layout.TOLERANCE]] = kept.values
        for name, value in kept.own.items():
            setattr(self, name, value)
        self.set_units(int(self.modes[layout.UNITS]))
        self.offsets.select(kept.system)
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

    def select(self, tool: float, line: int) -> None:
        """T: the tool that M6 loads; LineError where the table of tools does not have it."""
        if self.tools is not None:
            try:
                self.tools.tool(tool)
            except LineError as fault:
                fault.line = line
                raise
        self.selected = tool

    def new_speed(self, speed: float) -> bool:
        """Take over the speed that S says; whether it is another one, for which a control waits at rest."""
        changed = speed != self._speed
        self._speed = speed
        self.set_feed(None)
        return changed

    def scan(self, lines: Lines, at: int) -> tuple[int, int]:
        """Take what is known of the lines from byte `at` on: where that stopped, and DONE, UNKNOWN or FULL."""
        before = self.count
        at, self.count, heard, why = lines.scan(
            at, self.values, self.modes, self.rows, self.marks, self.count, self._heard, self._spoken
        )
        self.marks[before : self.count, layout.FLAGS] |= self.tip
        if heard:
            self._hear(heard)
        return at, why

    def _hear(self, count: int) -> None:
        """Markers of the first `count` rows that `Lines` has written of M, S and T."""
        texts = self._texts
        for (before, line, codes, words), (speed, tool) in zip(
            self._heard[:count].tolist(), self._spoken[:count].tolist(), strict=True
        ):
            key = (codes, words, speed, tool)
            text = texts.get(key)
            if text is None:
                said = [f"S{number(speed)}"] if words & 1 else []
                said += [f"T{number(tool)}"] if words & 2 else []
                text = " ".join(said + [f"M{digit}" for digit in str(codes) if codes])
                if len(texts) < _TEXTS:
                    texts[key] = text
            changed = bool(words & 1) and self.new_speed(speed)
            if words & 2:
                self.select(tool, line)
            for digit in str(codes) if codes else "":
                self.switch(int(digit))
            self.said.append(Mark(before, line, text, 0.0, changed or words != 1 or codes != 0))

    def take(self) -> Moves:
        """The moves made since the last time."""
        self._turn_rows()
        made = Moves(
            self._chunk_start,
            self.rows[: self.count].copy(),
            self.marks[: self.count].copy(),
            tuple(self.splines),
            tuple(self.said),
        )
        self._taken = self.busy
        self.count = 0
        self.splines, self.said = [], []
        self._turned = 0
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
