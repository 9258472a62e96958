"""Siemens Sinumerik: BSPLINE with SD, PL and PW, and the words that differ from those of LinuxCNC.

SD is the degree, 3 unless given; PW the weight of a control point, 1 unless given; PL the interval between knots [1]_.
The first control point is where the tool is. Which interval a PL belongs to the manual does not spell out: here
PL of control point i is knot[SD + i] - knot[SD + i - 1], so that intervals come first and the last SD - 1 are 0. What
is read so was not checked on a control, and a finding says so.

References
----------
.. [1] SINUMERIK 840D sl/828D, Programming Manual "NC programming", 12/2019, 6FC5398-2EP40-0BA0, 3.7 "Special motion
       commands".
"""

from __future__ import annotations

import re

import numpy as np

from splinefeed.programs.gcode.cycles import siemens
from splinefeed.programs.gcode.expressions import Block
from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.interpreter import Interpreter
from splinefeed.programs.gcode.lines import UNKNOWN
from splinefeed.programs.gcode.moves import AXES, LETTERS
from splinefeed.programs.gcode.siemens_flow import HEAD, without_remarks
from splinefeed.programs.gcode.siemens_words import IGNORED, TOOL_AXIS, SiemensWords, Values
from splinefeed.programs.gcode.spline_words import BSPLINE, order_of

DEFAULT_DEGREE = 3
#: A byte in place of CR=, and what becomes of letters that are no words of LinuxCNC here; values that are numbers.
_MARK = b"\x02"
_NOT_PLAIN = bytes.maketrans(b"(Rr" + _MARK, 3 * UNKNOWN + b"R")
_RADIUS = re.compile(rb"(?<![A-Z0-9_$])CR[ \t]*+=[ \t]*+(?=[-+.0-9])", re.IGNORECASE)
_EQUAL = re.compile(rb"(?<![A-Z0-9_$])([XYZABCIJKF])[ \t]*+=[ \t]*+(?=[-+.0-9])", re.IGNORECASE)
_MESSAGE = re.compile(r"%|MSG\s*\(")
#: Exact stops of their own and corners of compensation, which change nothing; what LinuxCNC calls what Siemens calls
#: otherwise: exact stop, continuous path, units of feeds too (G70 and G71 are of places alone).
_LEFT_OUT = frozenset((90, 4500, 4510, 6010, 6020, 6030))
_CODES = {600: 610, **dict.fromkeys(range(6410, 6460, 10), 640), 7000: 200, 7100: 210}


#: Words that shift the zero point.
_FRAMES = {"TRANS", "ATRANS"}


class Siemens(Interpreter):
    """Makes every line one of LinuxCNC's words, but for splines, which it collects itself."""

    def __init__(self, *arguments: object, **options: bool) -> None:
        super().__init__(*arguments, **options)  # type: ignore[arg-type]
        self.state.geometry_alone = True
        self._shift, self._fine_shift = np.zeros(AXES), np.zeros(AXES)  # of TRANS and G58, of G59
        self._degree = DEFAULT_DEGREE
        self.values = Values()
        self._modal_call: tuple[str, dict[str, float]] | None = None  # of MCALL: behind each line that moves

    def run(self, text: str, line: int) -> None:
        """One line: its words, a control point, or what is behind a label."""
        self.line = line
        text = without_remarks(text).strip().upper()
        head = HEAD.match(text)
        text = text[head.end() :] if head else text
        said = SiemensWords("" if _MESSAGE.match(text) or self.values.declare(text) else text, self.values)
        said.read()
        block, extra, keys = said.block, said.extra, said.keys
        block.g[:] = [_CODES.get(code, code) for code in block.g if code not in _LEFT_OUT]
        relative = 910 in block.g or (self.state.relative and 900 not in block.g)
        for letter, absolute in said.ways.items():
            block.words[letter] = self._by_mode(letter, absolute, block.words[letter], relative)
        if keys or {580, 590}.intersection(block.g):
            self._frame(block, keys)
        for key in sorted(keys - IGNORED - _FRAMES - {"BSPLINE", "MCALL"}):
            if key == "TRAORI":
                self.tool_tip.begin(key, line)
            elif key == "TRAFOOF":
                self.tool_tip.end(line)
            elif key == "SUPA":
                block.g.append(530)
            else:
                raise LineError(f"{key} is not supported in a Siemens program; write plain lines")
        self.state.top_speed = extra.get("LIMS", self.state.top_speed)
        self._splines(block, extra, "BSPLINE" in keys)
        if extra.keys() & set(TOOL_AXIS):
            x, y, z = (extra.get(name, 0.0) for name in TOOL_AXIS)
            self.tool_tip.given = x, y, z
        self.carry_out(block.checked())
        if self.tool_tip.given is not None:
            self._do(Block())  # the tool turns about its tip
        if self.tool_tip.given is not None:
            self.tool_tip.given = None
            raise LineError("A3= B3= C3= need a G0 or G1 on the line")
        call = said.call
        if "MCALL" in keys:
            self._modal_call, call = call, None
        elif self._modal_call and block.words.keys() & set(LETTERS):
            call = call or self._modal_call
        if call is not None:
            siemens(*call, self.state, line, self.findings)

    @property
    def busy(self) -> bool:
        """Also where MCALL drills behind every line that moves."""
        return super().busy or self._modal_call is not None

    def plain_lines(self, block: bytes) -> bytes:
        """Brackets are no comments here, and R is no radius; CR=5 and X=5 are words."""
        if b"=" in block:
            block = _RADIUS.sub(_MARK, block)
            block = _EQUAL.sub(rb"\1", block)
        return block.translate(_NOT_PLAIN)

    def _dwell(self) -> float:
        """G4 F, in s, is a P here, and G4 S, in turns of the spindle, a U."""
        if "U" not in self._words:
            return super()._dwell()
        turns = self.state.turns(0.0) if not self.state.surface else 0.0
        refuse(not turns, "G4 S counts turns of the spindle, whose speed is not known; write S and M3 before it")
        return 60.0 * self._words.pop("U") / turns

    def end(self) -> None:
        """The file is at its end."""
        self._close()
        super().end()

    def _frame(self, block: Block, keys: set[str]) -> None:
        """TRANS and G58 shift the zero point by their words, ATRANS and G59 beside that; the words are done with.

        Without words TRANS ends all of it, and G58 and G59 are systems whose offsets the control has.
        """
        axes = [letter for letter in LETTERS if letter in block.words]
        code = next((code for code in block.g if code in (580, 590) and axes), 0)
        name = next(iter(sorted(keys & _FRAMES)), "")
        if not (name or code):
            return
        self._close()
        shift = self._fine_shift if code == 590 and not name else self._shift
        if name == "TRANS":
            self._shift[:] = self._fine_shift[:] = 0.0
        for letter in axes:
            axis = LETTERS.index(letter)
            shift[axis] = self.state.scaled(axis, block.words.pop(letter)) + (shift[axis] if name == "ATRANS" else 0.0)
        self.state.offsets.shift(dict(enumerate((self._shift + self._fine_shift).tolist())))
        self.state.set_offsets()
        if code and not name:
            block.g.remove(code)

    def _by_mode(self, letter: str, absolute: bool, value: float, relative: bool) -> float:
        """A word that says itself whether it is absolute or a step, as G90 and G91 have it."""
        axis = "IJK".index(letter) if letter in "IJK" else LETTERS.index(letter)
        steps = relative or letter in "IJK"
        # where the tool, or the control point before, is on an axis, in the words of the program
        place = (self.splines.points[-1] if self.splines.open else self.state.position)[axis]
        place = (place - self.state.offset[axis]) / self.state.scale[axis]
        return value + (0.0 if absolute != steps else float(-place if absolute else place))

    def _splines(self, block: Block, extra: dict[str, float], begins: bool) -> None:
        """Open or close a BSPLINE, and take the axis words of the line as a control point."""
        splines, line = self.splines, self.line
        if begins:
            self._close()
            splines.begin(BSPLINE, line)
            splines.here(1.0)
        elif splines.open and ({0, 10, 20, 30}.intersection(block.g) or {2, 17, 30}.intersection(block.m)):
            self._close()
        if "SD" in extra:
            self._degree = order_of(extra["SD"] + 1.0) - 1
        splines.order = self._degree + 1
        if not splines.open:
            refuse(extra.keys() & {"PL", "PW"}, "PL and PW belong to BSPLINE")
            return
        axes = {letter: block.words.pop(letter) for letter in LETTERS if letter in block.words}
        interval = extra.get("PL")
        if not axes:
            return
        splines.point(axes, extra.get("PW", 1.0))
        if len(splines.points) == 2 and interval == 0.0 and not np.ptp(splines.points, axis=0).any():
            del splines.points[1], splines.weights[0]  # the place of the tool, said again
        else:
            splines.steps.append(interval)

    def _close(self) -> None:
        """The spline that is open is complete."""
        splines = self.splines
        if len(splines.points) == 1:
            splines.clear()
        if splines.open:
            self.findings.say("BSPLINE is read as the manual describes it; it was not checked on a control")
            splines.end()
        self._degree = DEFAULT_DEGREE
