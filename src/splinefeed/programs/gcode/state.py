"""The modal state of a program, and the rows of moves that it fills."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from splinefeed.programs.gcode.faults import LineError, SpindleError, refuse
from splinefeed.programs.gcode.moves import (
    AXES,
    LARGEST,
    LETTERS,
    POLAR,
    ROTARY,
    ROW,
    STATED,
    Flag,
    Mark,
    MoveKind,
    Moves,
    SplineMove,
)
from splinefeed.programs.gcode.offsets import (
    FIRST_PARAMETER,
    POSITION_PARAMETERS,
    TOOL_PARAMETER,
    Offsets,
)
from splinefeed.programs.gcode.tools import Tools
from splinefeed.records import Array

#: Moves that are kept before they are handed on, and for how many there is room at first.
CAPACITY, _ROOM = 2**12, 64
INCH = 25.4
#: Tolerance of what says nothing of it, and of G64 without P, which sets no bound.
UNSAID, UNBOUNDED = -1.0, math.inf
#: What M70 keeps beside the coordinate system (LinuxCNC, "M70 Saved State").
_KEPT = (
    "relative", "plane", "feed_mode", "exact_stop", "absolute_centres", "units", "feed", "tolerance", "speed",
    "feed_per_turn", "feed_inch", "top_speed", "surface", "spindle", "coolant", "returns", "length_code",
)  # fmt: skip
Modal = Mapping[str, Any]


class ProgramState:
    """Position, offsets, units and modes; `take` hands out the moves that were made since the last time."""

    def __init__(self, offsets: Offsets, start: Array, tools: Tools | None = None) -> None:
        self.offsets, self.tools = offsets, tools
        self.selected, self.loaded = 0.0, 0.0  # tools, by T and by M6
        # (9,), mm and rad: where the tool is, what is added to a programmed place, what one unit is
        self.position, self.offset, self.scale = start.copy(), np.zeros(AXES), np.ones(AXES)
        self.motion = -1  # tenths of a G code
        self.relative = self.exact_stop = self.absolute_centres = False
        self.extruded = self.steps_of_filament = False  # M83 or G91: E is a step
        self.filament, self.rate = 0.0, 1.0  # of printers: place of E, mm, and what M220 multiplies feeds by
        self.geometry_alone = False  # Siemens' G70 and G71 leave the units of F alone
        self.feed_inch = False
        self.rapid = MoveKind.RAPID  # what G0 is: printers move it at F
        self.speed_stops = True  # whether the tool stops for another speed (S): not where S is the power of a laser
        self.plane, self.units = 17, 0  # 20 or 21, 0 while none was said
        self.inch_unsaid, self.moved = False, False  # what 0 is; whether moves were taken
        self.feed_mode, self.feed, self.tolerance = 94, 0.0, UNSAID  # as G codes say it
        self.speed: float | None = None
        self.feed_per_turn = 0.0  # mm, of G95
        self.top_speed = math.inf  # of G96, turns a minute
        self.surface = False  # S is a speed at the surface (G96), m or ft a minute
        self.spindle = 0  # 3 or 4 while it turns, as M codes say
        self.coolant: dict[int, None] = {}  # 7 and 8, as M codes say
        self.returns = 98  # or 99: where canned cycles end
        self.length_code = 490  # or 430, G43, to which G43.1 and G43.2 belong
        self.tip = 0  # Flag.TIP while X, Y and Z are the tool's tip
        self.count = 0  # of the rows that are moves
        self.rows = np.zeros(_ROOM, ROW)
        self.splines: list[SplineMove] = []
        self.said: list[Mark] = []
        self.held = False  # the last rows may still change
        self.chunk_start = start.copy()
        self.set_units(0)
        self.set_offsets()

    @property
    def full(self) -> bool:
        """Whether the moves should be taken before the next line."""
        return self.count >= CAPACITY and not self.held

    @property
    def across(self) -> int:
        """The axis across the plane in force."""
        return {17: 2, 18: 1, 19: 0}[self.plane]

    @property
    def inch(self) -> bool:
        """Whether lengths are in inches: by G20, or where nothing is said by the option."""
        return self.units == 20 or (self.inch_unsaid and not self.units)

    @property
    def feed_unit(self) -> float:
        """Mm of one unit of F."""
        return INCH if self.feed_inch else 1.0

    def set_units(self, code: int) -> None:
        """G20 and G21, G70 and G71, as tenths, or 0 while none was said: mm of one unit; degrees stay degrees."""
        self.units = {0: 0, 200: 20, 700: 20}.get(code, 21)
        if not (self.geometry_alone and code in (700, 710)):
            self.feed_inch = self.inch
        self.scale[:] = INCH if self.inch else 1.0
        self.scale[list(ROTARY)] = math.pi / 180.0

    def set_offsets(self) -> None:
        """Take over what `offsets` says."""
        self.offset[:] = self.offsets.total

    def turns(self, x: float) -> float:
        """The spindle's speed, turns a minute, with the tool `x` mm from its axis (which matters to G96)."""
        speed = self.speed or 0.0
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
        if self.feed_mode == 94 and feed is not None:
            self.feed = feed * self.feed_unit * self.rate
        if self.feed_mode == 95:
            self.feed_per_turn = self.feed_per_turn if feed is None else feed * self.feed_unit
            x = self.position[0] - self.offset[0]
            at_axis = self.surface and not (x or math.isfinite(self.top_speed))
            self.feed = 0.0 if at_axis else self.feed_per_turn * self.turns(float(x))

    def extrude(self, filament: float, line: int, *, alone: bool) -> None:
        """Take over an E word; `alone`, it takes its time while the tool holds its position."""
        self.extruded, value = True, self.scaled(0, filament)
        step = value if self.relative or self.steps_of_filament else value - self.filament
        self.filament += step
        if alone and step and self.feed > 0.0:
            self.say(line, dwell=60.0 * abs(step) / self.feed)

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
        known: dict[str, float] = {
            "_metric": not self.inch, "_imperial": self.inch,
            "_absolute": not self.relative, "_incremental": self.relative,
            "_inverse_time": self.feed_mode == 93, "_units_per_minute": self.feed_mode == 94,
            "_units_per_rev": self.feed_mode == 95, "_plane": 10 * self.plane,
            "_feed": self.feed / self.feed_unit, "_rpm": self.speed or 0.0,
            "_spindle_on": self.spindle != 0, "_spindle_cw": self.spindle == 3,
            "_current_tool": self.loaded, "_selected_tool": self.selected, "_task": 0.0,
        }  # fmt: skip
        return float(known[name]) if name in known else None

    def stated(self, axes: int) -> int:
        """Bits of a row for the axes that words name: absolute words state places."""
        return axes if self.relative else axes | axes << STATED

    def target(self, words: Mapping[str, float], origin: Array | None = None) -> tuple[Array, int]:
        """Compute where axis words lead.

        Parameters
        ----------
        words : mapping of str to float
            Values by letter.
        origin : array (9,), optional
            What axes without a word keep and relative words count from; the tool's place if None.

        Returns
        -------
        there : array (9,)
            mm and rad.
        stated : int
            Bits of a row for the axes that the words name.
        """
        there = (self.position if origin is None else origin).copy()
        said = 0
        if words.keys() & set(POLAR):
            x, y = ((there - self.offset) / self.scale)[:2].tolist()
            words = _from_polar(words, x, y, self.relative)
        for axis, letter in enumerate(LETTERS):
            if letter in words:
                base = there[axis] if self.relative else self.offset[axis]
                there[axis] = check_size(letter, float(base + self.scaled(axis, words[letter])))
                said |= 1 << axis
        return there, self.stated(said)

    def room(self, count: int) -> NDArray[np.void]:
        """Rows of that many more moves, to be written."""
        first, self.count = self.count, self.count + count
        if self.count > len(self.rows):
            self.rows = np.concatenate([self.rows, np.zeros(max(self.count, 2 * first) - len(self.rows), ROW)])
        return self.rows[first : self.count]

    @property
    def flags(self) -> int:
        """Bits that every move has as things are."""
        return self.tip | self.exact_stop * Flag.STOPS | self.feed_inch * Flag.INCH

    def add(
        self, kind: int, end: Array, axes: int, line: int, *, feed: float | None = None, flags: int = 0,
        centre: Sequence[float] = (0.0, 0.0, 0.0), radius: float = 0.0, turns: float = 1.0, spline: int = -1,
    ) -> None:  # fmt: skip
        """One move to `end` (9,), as ROW has it."""
        if kind != MoveKind.RAPID and self.feed_mode == 95 and not self.speed:
            raise SpindleError("feed a revolution (G95) needs the speed of the spindle; write S before it")
        feed = self.feed if feed is None else feed
        words = end, centre, radius, turns, feed, self.tolerance
        self.room(1)[0] = (*words, kind, line, self.plane, flags | self.flags, spline, axes)
        self.position[:] = end

    def add_spline(self, spline: SplineMove, axes: int, **more: Any) -> None:
        """One spline, from where the tool is to its last control point."""
        self.splines.append(spline)
        self.add(MoveKind.SPLINE, spline.points[-1], axes, spline.line, spline=len(self.splines) - 1, **more)

    def say(self, line: int, text: str = "", dwell: float = 0.0, stop: bool = True) -> None:
        """A marker before the next move."""
        self.said.append(Mark(self.count, line, text, dwell, stop))

    def control_tip(self, on: bool, line: int) -> None:
        """From here on X, Y and Z are the tool's tip, or the joints again."""
        self.tip = on * Flag.TIP
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
        """How things are but for places and the motion: what M70 keeps."""
        return {name: getattr(self, name) for name in _KEPT} | {"system": self.offsets.active}

    def restore(self, kept: Modal, line: int) -> None:
        """M72: how things were; what that switches becomes a marker."""
        said = [f"S{number(kept['speed'] or 0.0)}"] if kept["speed"] != self.speed else []
        said += [f"M{kept['spindle'] or 5}"] if kept["spindle"] != self.spindle else []
        said += ["M9", *[f"M{code}" for code in kept["coolant"]]] if kept["coolant"] != self.coolant else []
        for name in _KEPT:
            setattr(self, name, kept[name])
        self.set_units(10 * self.units)
        self.offsets.select(kept["system"])
        self.set_offsets()
        if said:
            self.say(line, " ".join(said))

    def summary(self) -> str:
        """Tool, spindle and coolant as they are, in words."""
        said = [f"T{number(self.loaded)} M6"] if self.loaded else []
        said += ["G96"] if self.surface else []
        said += [f"S{number(self.speed)}"] if self.speed else []
        said += [f"M{code}" for code in (self.spindle, *self.coolant) if code]
        return " ".join(said)

    def select(self, tool: float) -> None:
        """T: the tool that M6 loads; LineError where the table of tools does not have it."""
        if self.tools is not None:
            self.tools.tool(tool)
        self.selected = tool

    def new_speed(self, speed: float) -> bool:
        """Take over the speed that S says; whether it is another one, for which a control waits at rest."""
        changed = bool(speed != self.speed) and self.speed_stops
        self.speed = float(speed)
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
        made = Moves(self.chunk_start, self.rows[: self.count], tuple(self.splines), tuple(self.said))
        self.rows = np.empty_like(self.rows)
        self.count, self.splines, self.said = 0, [], []
        self.moved |= len(made) > 0
        if len(made):
            self.chunk_start = made["end"][-1].copy()
        return made


def check_size(letter: str, value: float) -> float:
    """The value; LineError for a place too far out."""
    if not abs(value) <= LARGEST:
        raise LineError(f"{letter} leads to {value:g}; at most {LARGEST:g} mm or rad from the zero point is possible")
    return value


def number(value: float) -> str:
    """A number as words have it: no exponent, no more digits than it needs."""
    text = f"{value:.10f}".rstrip("0").rstrip(".")
    return text if text not in ("-0", "") else "0"


def _from_polar(words: Mapping[str, float], x: float, y: float, relative: bool) -> dict[str, float]:
    """Axis words with X and Y in place of @, the distance from zero, and ^, the angle in degrees, at the place x, y.

    What is not said stays; `relative` (G91) both are steps, and so are X and Y then. LineError where they say nothing.
    """
    refuse(words.keys() & {"X", "Y"}, "X or Y beside polar coordinates (@, ^); write one or the other")
    distance, angle = math.hypot(x, y), math.degrees(math.atan2(y, x))
    if distance == 0.0 and (relative or "^" not in words):
        raise LineError("polar coordinates (@, ^) have no angle at the zero point; write X and Y")
    if relative:
        distance, angle = distance + words.get("@", 0.0), angle + words.get("^", 0.0)
    else:
        distance, angle = words.get("@", distance), words.get("^", angle)
    there = distance * math.cos(math.radians(angle)), distance * math.sin(math.radians(angle))
    rest = {letter: value for letter, value in words.items() if letter not in POLAR}
    return rest | {"X": there[0] - x * relative, "Y": there[1] - y * relative}
