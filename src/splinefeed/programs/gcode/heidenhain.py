"""Heidenhain's conversational programs, as far as they are lines and arcs.

Words are those of [1]_: L, CC, C, CR, CT, RND and CHF, polar LP and CP, TOOL CALL, F, FMAX, which holds in its block
alone, M91, cycles 7 (datum shift) and 9 (dwell time). DR+ is counterclockwise, R of CR is below 0 for more than half a
circle, the side of CHF is its way from the corner. Labels, jumps and Q parameters are those of `klartext`. What calls
cycles or other programs, reads the control (FN 18) or turns planes is refused by its name, as are programs in inches,
whose F has a unit of its own.

References
----------
.. [1] HEIDENHAIN TNC 640, User's Manual Klartext Programming: "Path contours - Cartesian coordinates", "Path contours -
       polar coordinates", "Entering tool-related data", "M functions".
"""

from __future__ import annotations

import math
import re

import numpy as np

from splinefeed.programs.gcode.expressions import Block
from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.interpreter import Interpreter
from splinefeed.programs.gcode.klartext import BLOCK, Quantities
from splinefeed.programs.gcode.klartext_cycles import STEPS as CYCLES
from splinefeed.programs.gcode.klartext_cycles import drill, old_name
from splinefeed.programs.gcode.lines import UNKNOWN
from splinefeed.programs.gcode.moves import LETTERS
from splinefeed.records import Array

_NUMBER = r"[-+]?(?:[0-9]++[.,]?[0-9]*+|[.,][0-9]++)"
_BEGIN = re.compile(r"BEGIN\s+PGM\s+\S+(?:\s+(MM|INCH))?")
#: What says nothing of the motion: the blank, tools by their measures, structure, modes that are off.
_IGNORED = re.compile(r"BLK\s+FORM|TOOL\s+DEF|LBL\b|\*|PLANE\s+RESET|FUNCTION\s+(?:RESET|MODE\s+MILL)|PRESET\s+SELECT")
_CALL = re.compile(r"CYCL\s+CALL(?!\s*PAT)(\s+POS)?\s*(.*)")
_DATUM = re.compile(r"TRANS\s+DATUM\s+(?:RESET|AXIS(?P<places>(?:\s+[XYZABC]\s*[-+0-9.,QLR]+)+))\s*")
_LAST = re.compile(rf"(?:(?<![0-9.,])|(?=[-+]))({_NUMBER}|Q[LR]?[0-9]++)\s*+$")
_PARAMETER = re.compile(r"(Q[0-9]+)\s*+=\s*+(\S+)")
_CYCLE = re.compile(r"CYCLE?\s+DEF\s*([0-9]+)\s*(?:\.([0-9]+))?\s*(.*)")
#: Cycles that say nothing of the places: presets, tolerances.
_OF_NO_PLACE = (32, 247, 392)
_SPACED = re.compile(r"(?<=[XYZABC])[ \t]*+([-+])[ \t]*+(?=[0-9.,])")
_SHIFT = re.compile(rf"(I?)([XYZABC])\s*({_NUMBER})")
_MOVE = re.compile(
    r"(LP|LN|L|CP|CTP|CT|CR|CC|C|RND|CHF|APPR|DEP|FL|FCT|FC|FPOL|SPL)(?![A-Z])\s*+|(?=I?[XYZABC]\s*[-+0-9.,Q])"
)
_WORD = re.compile(
    rf"\s*(?:(?P<axis>I?(?:[XYZABCUVW]|PA|PR))\s*(?P<place>{_NUMBER})|DR\s*(?P<turn>[-+])|R\s*(?P<radius>{_NUMBER})"
    rf"|R(?P<side>[0LR])(?![0-9.,])|F\s*(?P<max>MAX|AUTO)|F\s*(?P<feed>{_NUMBER})|M\s*(?P<m>[0-9]+)|(?P<bare>{_NUMBER}))"
)
#: The usual blocks, which only move, without parameters.
_USUAL = re.compile(r"(CC|CR|C|L)\s++(?=I?[XYZABC]\s*+[-+0-9])(?!.*Q)")
#: Blocks whose words may be parameters.
_WITH_PLACES = re.compile(rf"(?:{_MOVE.pattern}|TOOL\s+CALL)[^\"]*Q")
_TOOL = re.compile(r"TOOL\s+CALL\s*(?P<name>[0-9]+|\"[^\"]*\")?\s*(?P<axis>[XYZUVW])?(?P<rest>.*)")
#: Cycles that are in force without a call (mirror, turn, scale, plane), and the value that ends them.
_AT_ONCE = {8: 0.0, 10: 0.0, 11: 1.0, 19: 0.0, 26: 1.0}
#: A line of L that says all of itself: places, R0, F or FMAX.
_PLACES = rb"(?P<places>(?:[ \t]*+[XYZABC][-+]?+(?:[0-9]++\.?+[0-9]*+|\.[0-9]++))+)"
_LINE = re.compile(
    rb"[ \t]*+(?:[0-9]++[ \t]++)?L" + _PLACES + rb"(?:[ \t]++R0)?"
    rb"(?:[ \t]++F(?:(?P<max>MAX)|(?P<feed>[0-9]++\.?+[0-9]*+)))?[ \t\r]*+"
)
#: M codes that change nothing of the path, and those of planes and tips, which do.
_NO_PLACE, _TURNED = 91, frozenset((92, 114, 120, 128, 136, 138, 144))
_REFUSED = {
    "FN": "is a function of the control", "CALL": "calls", "CYCL": "is a cycle", "PLANE": "turns the plane",
    "FUNCTION": "is a function of the control or of a lathe", "SEL": "selects a file", "TCH": "probes", "IF": "jumps",
}  # fmt: skip


class Heidenhain(Interpreter):
    """Turns every block into words of LinuxCNC; a block that goes over several lines ends them with ~."""

    def __init__(self, *arguments: object, **options: bool) -> None:
        super().__init__(*arguments, **options)  # type: ignore[arg-type]
        self._pole: Array | None = None  # CC
        self._tangent = np.zeros(2)  # of the last move at its end
        self.quantities = Quantities()
        self._cycle, self._given = 0, dict[str, float]()  # the cycle that is defined, and its parameters
        self._calls = False  # whether M89 calls it behind each block that moves
        self._open, self._parts = False, ""  # whether a block goes on, and what it said so far

    def run(self, text: str, line: int) -> None:
        """One line: a block, or a part of one."""
        self.line = line
        block = BLOCK.match(text.partition(";")[0].replace("\ufeff", ""))
        plain = (block["plain"] if block else "").strip().upper()
        self._open = text.rstrip().endswith("~")  # a comment may stand before it
        plain, self._parts = f"{self._parts} {plain.rstrip('~')}".strip(), ""
        if self._open:
            self._parts = plain
            return
        if not plain or plain == "%":
            return
        if block and block["skip"]:
            self.findings.count("blocks with / are carried out: skipping them is off", line)
        if usual := _USUAL.match(plain):
            self._do_words(usual[1], plain[usual.end() :])
        elif begin := _BEGIN.match(plain):
            refuse(
                begin[1] == "INCH", "a program in inches, whose F is in units of its own, is not read; write it in mm"
            )
        elif plain.startswith("END PGM"):
            self.ended = True
            self.corners.end()
        elif cycle := _CYCLE.match(plain):
            self._define(int(cycle[1]), int(cycle[2] or 0), cycle[3])
        elif call := _CALL.match(plain):
            self._do_words("POS" if call[1] else "CALL", f"{self.quantities.filled(call[2])} M99")
        elif datum := _DATUM.fullmatch(plain):
            places = _SHIFT.findall(self.quantities.filled(datum["places"] or ""))
            self._shift(places or [("", axis, "0") for axis in "XYZABC"])
        elif not (_IGNORED.match(plain) or self.quantities.take(plain)):
            self._do_block(self.quantities.filled(plain) if _WITH_PLACES.match(plain) else plain)

    @property
    def busy(self) -> bool:
        """Also where M89 calls a cycle behind every block that moves."""
        return super().busy or self._calls

    def plain_lines(self, block: bytes) -> bytes:
        """L as G0 and G1; not the last one before another block, which may go on tangent to it, nor behind ~."""
        texts = block.split(b"\n")[:-1]
        plain = [_as_words(text) for text in texts]
        for i in range(len(plain)):
            if texts[i - 1].rstrip().endswith(b"~") if i else self._open:
                plain[i] = UNKNOWN
        ends = [i for i, after in enumerate([*plain[1:], UNKNOWN]) if after == UNKNOWN]
        for i in ends:
            plain[i] = UNKNOWN
        return b"\n".join([*plain, b""])

    def _do_block(self, plain: str) -> None:
        """A block that moves, or switches something."""
        if tool := _TOOL.match(plain):
            self._change(tool)
        elif plain.startswith("STOP"):
            super().run("M0", self.line)
        elif re.match(r"M\s*[0-9]", plain):
            self._do_words("", plain)
        elif move := _MOVE.match(plain):
            self._do_words(move[1] or "L", plain[move.end() :])
        else:
            name = re.match(r"[A-Z]+", plain)
            why = f"{reason}, which" if (reason := _REFUSED.get(name[0] if name else "")) else "is not known, and"
            raise LineError(f"{plain[:24]!r} {why} is not read in a Heidenhain program; let the post write its moves")

    def _define(self, number: int, part: int, words: str) -> None:
        """CYCL DEF: a shift, a wait, or a cycle that a call carries out, with its parameters."""
        if number in CYCLES:
            if number != self._cycle or part == 0:
                self._cycle, self._given, self._calls = number, {}, False
            for name, value in _PARAMETER.findall(words) if part == 0 else ():
                self.quantities.take(f"{name}={value}")
                self._given[name] = self.quantities.get(name)
            said = _LAST.search(words) if part else None
            if said and (name := old_name(number, part)):
                self._given[name] = self.quantities.value(said[1].replace(",", "."))
            return
        words = self.quantities.filled(words) if part else ""
        if number == 7:
            refuse("#" in words, "a datum shift by a line of a table is not read; write its place")
            words = _SPACED.sub(r"\1", words)
            rest = _SHIFT.sub("", words).strip()
            refuse(rest, f"a datum shift by {rest[:20]!r} is not read; write places of its axes")
            self._shift(_SHIFT.findall(words))
        elif number == 9:
            if wait := re.search(rf"(?:(?<![0-9.,])|(?=[-+]))({_NUMBER})\s*+$", words):
                self.state.say(self.line, dwell=_value(wait[1]))
        elif number in _AT_ONCE:
            plain = all(float(_value(each)) == _AT_ONCE[number] for each in re.findall(_NUMBER, words))
            refuse(words and (number == 8 or not plain), f"cycle {number} turns, mirrors or scales what follows, which "
                   "is not read; let the post write the places")  # fmt: skip
        elif number not in _OF_NO_PLACE:
            self._cycle = number
            self.findings.count(f"cycle {number} is defined; it is not read", self.line)

    def _shift(self, places: list[tuple[str, str, str]]) -> None:
        """Shift the datum to places of axes, or by steps (I)."""
        for step, axis, value in places:
            number = LETTERS.index(axis)
            before = float(self.state.offsets.g92[number]) if step else 0.0
            self.state.offsets.shift({number: before + self.state.scaled(number, _value(value))})
        self.state.set_offsets()

    def _change(self, tool: re.Match[str]) -> None:
        """TOOL CALL: another tool, or another speed of the same one."""
        refuse(tool["axis"] not in (None, "Z"), f"TOOL CALL {tool['axis']}: the tool must lie along Z")
        name, rest = tool["name"] or "", tool["rest"]
        said = re.search(rf"S\s*({_NUMBER})", rest)
        speed = f"S{_value(said[1]):.6f}" if said else ""
        number = name if name.isdigit() else ""
        if name:
            super().run(f"T{number} M6 {speed}" if number else f"M6 {speed}", self.line)
        elif speed:
            super().run(speed, self.line)
        if feed := re.search(rf"\bF\s*({_NUMBER})", rest):
            self.state.set_feed(_value(feed[1]))

    def _do_words(self, name: str, text: str) -> None:
        """A block of a path function, with its words."""
        refuse(name in ("APPR", "DEP", "LN", "FL", "FCT", "FC", "FPOL", "SPL", "CTP"),
               f"{name} is not read in a Heidenhain program; let the post write lines and arcs")  # fmt: skip
        places: dict[str, float] = {}
        turn, radius, feed, rapid, size, codes, at = 0, math.nan, math.nan, False, math.nan, list[int](), 0
        while at < len(text):
            word = _WORD.match(text, at)
            if word is None:
                raise LineError(f"expected a word of a Heidenhain program, got {text[at : at + 20].strip()!r}")
            at, said = word.end(), word[word.lastgroup or 0]
            match word.lastgroup:
                case "place":
                    places[word["axis"]] = _value(said)
                case "turn":
                    turn = 1 if said == "+" else -1
                case "radius" if not (name in ("L", "LP", "") and float(_value(said)) == 0.0):
                    radius = _value(said)
                case "side" if said != "0":
                    raise LineError(f"R{said} is compensation of the tool's radius; write the compensated path (R0)")
                case "max":
                    rapid = said == "MAX"
                case "feed":
                    feed = _value(said)
                case "m":
                    codes.append(int(said))
                case "bare":
                    size = _value(said)
        wrong = next((code for code in codes if code in _TURNED), 0)
        refuse(wrong, f"M{wrong} is not read in a Heidenhain program; let the post write places of the axes")
        calls, given = {89, 99}.intersection(codes), self._given
        refuse(calls and not self._cycle, "no cycle is defined for the call")
        unread = self._cycle and self._cycle not in CYCLES
        refuse(calls and unread, f"M99 calls cycle {self._cycle}, which is not read; write its moves")
        if not math.isnan(feed):
            self.state.set_feed(feed)
        if switches := [f"M{code}" for code in codes if code not in (_NO_PLACE, 89, 99, 2, 30)]:
            super().run(" ".join(switches), self.line)
        if _NO_PLACE in codes:
            self.findings.count("places of the machine (M91) are left out: its zero is unknown here", self.line)
        elif name in ("RND", "CHF"):
            self.corners.begin(",R" if name == "RND" else ",C", size if math.isnan(radius) else radius)
        elif name == "CC":
            self._set_pole(places)
        elif places or name in ("C", "CP"):
            above = places.pop("Z", 0.0) if name == "POS" else 0.0  # a shift of the workpiece's surface
            self._move("L" if name in ("POS", "CALL") else name, places, turn, radius, rapid)
            given = self._given | {"Q203": self._given.get("Q203", 0.0) + above} if name == "POS" else given
        if 89 in codes or 99 in codes:
            self._calls = 89 in codes
        if calls or (self._calls and places and name != "CC"):
            drill(self._cycle, given, self.state, self.line, self.findings)
            self._tangent = np.zeros(2)
        if not {2, 30}.isdisjoint(codes):
            super().run("M30", self.line)

    def _here(self) -> Array:
        """Where the tool is, in words of the program, (9,)."""
        here: Array = (self.state.position - self.state.offset) / self.state.scale
        return here

    def _set_pole(self, places: dict[str, float]) -> None:
        here = self._here()[:2]
        pole = here if self._pole is None or not places else self._pole
        self._pole = np.array([
            places.get(axis, here[k] + places[f"I{axis}"] if f"I{axis}" in places else pole[k])
            for k, axis in enumerate("XY")
        ])  # fmt: skip

    def _move(self, name: str, places: dict[str, float], turn: int, radius: float, rapid: bool) -> None:
        """A line or an arc to places that are absolute, steps (I), or polar."""
        here = self._here()
        there = here.copy()
        moved = set[int]()
        for word, value in places.items():
            if word in ("PR", "PA", "IPA", "IPR"):
                continue
            axis = LETTERS.index(word[-1])
            there[axis] = here[axis] + value if word[0] == "I" and len(word) > 1 else value
            moved.add(axis)
        if name in ("LP", "CP"):
            pole = self._known_pole(name)
            away = here[:2] - pole
            angle = math.atan2(away[1], away[0])
            if "PA" in places or "IPA" in places:
                angle = math.radians(places["PA"]) if "PA" in places else angle + math.radians(places["IPA"])
            length = places.get("PR", float(np.hypot(*away)) + places.get("IPR", 0.0))
            there[:2] = pole + length * np.array([math.cos(angle), math.sin(angle)])
            moved |= {0, 1}
        words = {LETTERS[axis]: float(there[axis]) for axis in sorted(moved)}
        if name in ("L", "LP"):
            code = 0 if rapid else 10
            self._tangent = (there - here)[:2]
        else:
            refuse(rapid, f"{name} FMAX: an arc has a feed; write F")
            code = self._arc_words(name, here, there, places, turn, radius, words)
        self._do(Block(words, [code]))

    def _arc_words(
        self, name: str, here: Array, there: Array, places: dict[str, float], turn: int, radius: float,
        words: dict[str, float],
    ) -> int:  # fmt: skip
        """G2 or G3 of C and CP about the pole, CR by its radius, CT tangent to the move before, with its words."""
        if name == "CT":
            way, t = (there - here)[:2], self._tangent
            refuse(not t.any(), "CT needs a move before it, to which it is tangent")
            normal = np.array([-t[1], t[0]]) / float(np.hypot(*t))
            across = float(normal @ way)
            refuse(not across, "CT leads straight on; write L")
            middle, turn = here[:2] + normal * (float(way @ way) / (2.0 * across)), 1 if across > 0.0 else -1
        elif name == "CR":
            refuse(not turn, "CR needs DR+ or DR-")
            refuse(math.isnan(radius), "CR needs R")
            self._tangent = np.zeros(2)  # by which side the centre lies: CT behind CR is rare
            words["R"] = radius
            return 30 if turn > 0 else 20
        else:
            refuse(not turn, f"{name} needs DR+ or DR-")
            middle = self._known_pole(name)
        away = there[:2] - middle
        self._tangent = turn * np.array([-away[1], away[0]])
        words["I"], words["J"] = (middle - here[:2]).tolist()
        if "IPA" in places and abs(places["IPA"]) > 360.0:  # whole turns, and the rest
            refuse(places["IPA"] * turn < 0.0, "IPA and DR have different signs")
            words["P"] = float(math.ceil(abs(places["IPA"]) / 360.0 - 1e-9))
        return 30 if turn > 0 else 20

    def _known_pole(self, name: str) -> Array:
        if self._pole is None:
            raise LineError(f"{name} needs its centre, CC, before it")
        return self._pole


def _as_words(text: bytes) -> bytes:
    """A line of L as words of G0 or G1; `UNKNOWN` for all else."""
    said = _LINE.fullmatch(text)
    if said is None:
        return UNKNOWN
    feed = said["feed"]
    return (b"G0" if said["max"] else b"G1") + said["places"] + (b"F" + feed if feed else b"")


def _value(text: str) -> float:
    return float(text.replace(",", "."))
