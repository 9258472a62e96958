"""Siemens Sinumerik: BSPLINE with SD, PL and PW, and the words that differ from those of LinuxCNC.

Source: SINUMERIK 840D sl/828D, Programming Manual "NC programming", 12/2019, 6FC5398-2EP40-0BA0, 3.7 "Special motion
commands": SD is the degree, 3 unless given; PW the weight of a control point, 1 unless given; PL the interval between
knots. The first control point is where the tool is. Which interval a PL belongs to the manual does not spell out: here
PL of control point i is knot[SD + i] - knot[SD + i - 1], so that intervals come first and the last SD - 1 are 0. What
is read so was not checked on a control, and a finding says so.
"""

from __future__ import annotations

import re

import numpy as np

from splinefeed.programs.gcode.cycles import SIEMENS, parameters, siemens
from splinefeed.programs.gcode.expressions import Block, LineError, refuse, shown
from splinefeed.programs.gcode.interpreter import Interpreter
from splinefeed.programs.gcode.lines import UNKNOWN
from splinefeed.programs.gcode.moves import AXES, LETTERS
from splinefeed.programs.gcode.siemens_flow import HEAD, Values, without_remarks
from splinefeed.programs.gcode.spline_words import BSPLINE, order_of

DEFAULT_DEGREE = 3
#: A byte in place of CR=, and what becomes of letters that are no words of LinuxCNC here; values that are numbers.
_MARK = b"\x02"
_NOT_PLAIN = bytes.maketrans(b"(Rr" + _MARK, 3 * UNKNOWN + b"R")
_RADIUS = re.compile(rb"(?<![A-Z0-9_$])CR[ \t]*+=[ \t]*+(?=[-+.0-9])", re.IGNORECASE)
_EQUAL = re.compile(rb"(?<![A-Z0-9_$])([XYZABCIJKF])[ \t]*+=[ \t]*+(?=[-+.0-9])", re.IGNORECASE)
#: Components of the tool axis, from the tip to the spindle.
_TOOL_AXIS = ("A3", "B3", "C3")
#: What LinuxCNC calls what Siemens calls otherwise: exact stop, continuous path, cancelled offsets, units with feeds.
_CODES = {
    **dict.fromkeys(("G601", "G602", "G603", "G9", "G450", "G451"), ""),
    **dict.fromkeys(("G641", "G642", "G643", "G644", "G645"), "G64"),
    **{"G60": "G61", "G710": "G21", "G700": "G20"},  # G70 and G71 are of places alone, and leave F as it is
}
#: Words and calls that switch functions of the control, or set it up, and move nothing.
_IGNORED = frozenset(
    ("SOFT", "BRISK", "DRIVE", "FFWON", "FFWOF", "COMPOF", "COMPON", "COMPCURV", "COMPCAD", "UPATH", "SPATH", "STOPRE",
     "CUT2D", "CFIN", "CFTCP", "CFC", "FNORM", "FLIN", "ORIAXES", "ORIVECT", "ORIMKS", "ORIWKS", "RTLION", "RTLIOF",
     "CYCLE832", "MSG", "WORKPIECE", "FGROUP", "DISPLOF", "SETMS", "DIAMOF")
)  # fmt: skip
#: Words that shift the zero point.
_FRAMES = {"TRANS", "ATRANS"}
#: Values that a line has beside its words, and values that say nothing here: tools by name, corrections, tolerances.
_COLLECTED, _SILENT = ("SD", "PL", "PW", "LIMS", *_TOOL_AXIS), ("T", "D", "ADIS", "ADISPOS", "CTOL", "OTOL")
_CORNERS = {"RND": ",R", "CHR": ",C", "CHF": ",L"}
#: A cycle, and its parameters.
_Call = tuple[str, dict[str, float]]
#: Coordinates that say by themselves whether they are absolute or steps.
_NUMBER = r"[-+]?+(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)"
_OWN_WAY = re.compile(rf"([A-Z])\s*=\s*(AC|IC)\s*\(\s*({_NUMBER})\s*+\)")
#: A line that only moves, the usual one: G0 to G3, and words of axes, centres, feed and tool axis, which are numbers.
_MOVE = re.compile(
    rf"(?:N[0-9]++(?![0-9.])\s*+)?+(?:G0*(?P<g>[0-3])(?![0-9.])\s*+)?+(?P<words>(?:(?:[ABC]3\s*+=\s*+{_NUMBER}"
    rf"|[XYZABCIJK]\s*+=\s*+(?:AC|IC)\s*+\(\s*+{_NUMBER}\s*+\)|[XYZABCIJKF]\s*+=?+\s*+{_NUMBER})\s*+)++)"
)
_OF_MOVE = re.compile(rf"([ABC]3(?=\s*+=)|[A-Z])\s*+=?+\s*+(?:(AC|IC)\s*+\(\s*+)?+({_NUMBER})")
_DISTANCES = re.compile(r"(?<![A-Z0-9.])G9([01])(?![0-9.])")
_WORD = re.compile(
    r"\s*(?:(?P<name>[A-Z_]++[0-9]*+)\s*+=\s*+(?P<text>\"[^\"]*\"|[-+]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:EX[-+]?[0-9]+)?)"
    r"|(?P<letter>[A-Z])\s*(?P<number>[-+]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++))"
    r"|(?P<key>[A-Z_][A-Z_0-9]*)(?:\s*\((?P<inside>[^)]*)(?P<closed>\)?))?)"
)


class Siemens(Interpreter):
    """Turns every line into words of LinuxCNC, but for splines, which it collects itself."""

    def __init__(self, *arguments: object, **options: bool) -> None:
        super().__init__(*arguments, **options)  # type: ignore[arg-type]
        self.state.geometry_alone = True
        self._shift, self._fine_shift = np.zeros(AXES), np.zeros(AXES)  # of TRANS and G58, of G59
        self._degree = DEFAULT_DEGREE
        self.values = Values()
        self._modal_call: _Call | None = None  # of MCALL: behind each line that moves

    def run(self, text: str, line: int) -> None:
        """One line: translated, or taken as a control point."""
        self.line = line
        text = without_remarks(text).strip().upper()
        move = None if self.splines.open or self._modal_call else _MOVE.fullmatch(text)
        if move is not None and self._only_moves(move):
            return
        head = HEAD.match(text)
        text = text[head.end() :] if head else text
        if text.startswith("%") or re.match(r"MSG\s*\(", text) or self.values.declare(text):
            text = ""
        text = self.values.filled(text)
        said = _DISTANCES.findall(text)
        relative = said[-1] == "1" if said else self.state.relative
        text = _OWN_WAY.sub(lambda match: self._in_force(match, relative), text).rstrip()
        words, extra, keys, call = _translated(text)
        self._frame(words, keys)
        for key in sorted(keys - _IGNORED - _FRAMES - {"BSPLINE", "MCALL"}):
            if key == "TRAORI":
                self.tool_tip.begin(key, line)
            elif key == "TRAFOOF":
                self.tool_tip.end(line)
            elif key == "SUPA":
                words.append("G53")
            else:
                raise LineError(f"{key} is not supported in a Siemens program; write plain lines")
        self.state.top_speed = extra.get("LIMS", self.state.top_speed)
        self._splines(words, extra, "BSPLINE" in keys)
        if extra.keys() & set(_TOOL_AXIS):
            x, y, z = (extra.get(name, 0.0) for name in _TOOL_AXIS)
            self.tool_tip.given = x, y, z
        super().run(" ".join(words), line)
        if not words and self.tool_tip.given is not None:
            self._do(Block())  # the tool turns about its tip
        self._check_axis_used()
        if "MCALL" in keys:
            self._modal_call = call
        elif any(word[0] in LETTERS for word in words):
            call = call or self._modal_call
        if call is not None and "MCALL" not in keys:
            siemens(*call, self.state, line, self.findings)

    def _only_moves(self, line: re.Match[str]) -> bool:
        """Do the usual line, word by word; False where a word comes twice, which is said elsewhere."""
        words: dict[str, float] = {}
        axis: dict[str, float] = {}
        for name, way, value in _OF_MOVE.findall(line["words"]):
            if name in words or name in axis:
                return False
            if len(name) > 1:
                axis[name] = float(value)
            else:
                number = float(value)
                words[name] = self._by_mode(name, way == "AC", number, self.state.relative) if way else number
        if self._modal not in self.cycles.known:
            self.cycles.forget()
        if axis:
            x, y, z = (axis.get(name, 0.0) for name in _TOOL_AXIS)
            self.tool_tip.given = x, y, z
        self._do(Block(words, [10 * int(line["g"])] if line["g"] else []))
        self._check_axis_used()
        return True

    def _check_axis_used(self) -> None:
        if self.tool_tip.given is not None:
            self.tool_tip.given = None
            raise LineError("A3= B3= C3= need a G0 or G1 on the line")

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

    def _frame(self, words: list[str], keys: set[str]) -> None:
        """TRANS and G58 shift the zero point by their words, ATRANS and G59 beside that; the words are done with.

        Without words TRANS ends all of it, and G58 and G59 are systems whose offsets the control has.
        """
        values = {LETTERS.index(word[0]): float(word[1:]) for word in words if word[0] in LETTERS}
        name = next(iter(sorted(keys & _FRAMES)), "") or next((w for w in words if w in ("G58", "G59") and values), "")
        if not name:
            return
        self._close()
        shift = self._fine_shift if name == "G59" else self._shift
        if name == "TRANS":
            self._shift[:] = self._fine_shift[:] = 0.0
        for axis, value in values.items():
            shift[axis] = self.state.scaled(axis, value) + (shift[axis] if name == "ATRANS" else 0.0)
        self.state.offsets.shift(dict(enumerate((self._shift + self._fine_shift).tolist())))
        self.state.set_offsets()
        words[:] = [word for word in words if word[0] not in LETTERS and word != name]

    def _in_force(self, match: re.Match[str], relative: bool) -> str:
        """X=IC(5) or I=AC(5) as the word that means the same by the modes in force."""
        refuse(match[1] not in LETTERS + "IJK", f"{match[1]}={match[2]}( is not supported in a Siemens program")
        return f"{match[1]}={self._by_mode(match[1], match[2] == 'AC', float(match[3]), relative):.17f} "

    def _by_mode(self, letter: str, absolute: bool, value: float, relative: bool) -> float:
        """A word that says itself whether it is absolute or a step, as G90 and G91 have it."""
        axis = "IJK".index(letter) if letter in "IJK" else LETTERS.index(letter)
        steps = relative or letter in "IJK"
        # where the tool, or the control point before, is on an axis, in the words of the program
        place = (self.splines.points[-1] if self.splines.open else self.state.position)[axis]
        place = (place - self.state.offset[axis]) / self.state.scale[axis]
        return value + (0.0 if absolute != steps else float(-place if absolute else place))

    def _splines(self, words: list[str], extra: dict[str, float], begins: bool) -> None:
        """Open or close a BSPLINE, and take the axis words of the line as a control point."""
        splines, line = self.splines, self.line
        if begins:
            self._close()
            splines.begin(BSPLINE, line)
            splines.here(1.0)
        elif splines.open and any(re.fullmatch(r"G0*[0123]|M(0*2|30|17)", word) for word in words):
            self._close()
        if "SD" in extra:
            self._degree = order_of(extra["SD"] + 1.0) - 1
        splines.order = self._degree + 1
        if not splines.open:
            refuse(extra.keys() & {"PL", "PW"}, "PL and PW belong to BSPLINE")
            return
        axes = {word[0]: float(word[1:]) for word in words if word[0] in LETTERS}
        interval = extra.get("PL")
        if not axes:
            return
        splines.point(axes, extra.get("PW", 1.0))
        if len(splines.points) == 2 and interval == 0.0 and not np.ptp(splines.points, axis=0).any():
            del splines.points[1], splines.weights[0]  # the place of the tool, said again
        else:
            splines.steps.append(interval)
        words[:] = [word for word in words if word[0] not in LETTERS]

    def _close(self) -> None:
        """The spline that is open is complete."""
        splines = self.splines
        if len(splines.points) == 1:
            splines.clear()
        if splines.open:
            self.findings.say("BSPLINE is read as the manual describes it; it was not checked on a control")
            splines.end()
        self._degree = DEFAULT_DEGREE


def _translated(text: str) -> tuple[list[str], dict[str, float], set[str], _Call | None]:
    """Words of LinuxCNC, values of SD, PL and PW, words without a value, and a cycle; LineError for what is none."""
    words: list[str] = []
    extra: dict[str, float] = {}
    keys: set[str] = set()
    call: _Call | None = None
    at = 0
    while at < len(text):
        match = _WORD.match(text, at)
        if match is None:
            raise LineError(f"expected a word of a Siemens program, got {shown(text[at:])}")
        at = match.end()
        name, value, key, inside = match["name"], match["text"], match["key"], match["inside"]
        if match["letter"]:
            word = match["letter"] + match["number"]
            refuse(word[0] == "L", f"{word} calls a subprogram, which is not read; write the program in one piece")
            if word[0] == "G":
                word = _CODES.get(f"G{word[1:].lstrip('0') or '0'}", word)
            words += [word] if word and word[0] != "D" else []
        elif name:
            if name in _SILENT or value.startswith('"'):
                continue
            number = float(value.replace("EX", "E"))
            refuse(name == "RNDM", "RNDM= rounds all corners, which is not supported; write RND= on each line")
            if name in _CORNERS:
                words.append(f"{_CORNERS[name]}{number:.17f}")
            elif name in _COLLECTED:
                extra[name] = number
            elif name in ("CR", "TURN") or (len(name) == 1 and name not in "RN"):
                words.append(f"{ {'CR': 'R', 'TURN': 'P'}.get(name, name) }{number + (name == 'TURN'):.17f}")
            else:
                raise LineError(f"{name}= is not supported in a Siemens program")
        elif inside is None or key in _IGNORED or key == "TRAORI":
            keys.add(key)
        elif key == "CYCLE800" and not inside.strip():
            continue  # ends a turned plane
        elif key not in SIEMENS:
            raise LineError(f"{key}( is a call, which is not supported; write plain lines")
        elif not match["closed"]:
            raise LineError(f"{key}( is not closed by )")
        else:
            call = key, parameters(key, inside)
    if "G4" in words or "G04" in words:  # F is in seconds there, S in turns of the spindle
        words = [{"F": "P", "S": "U"}.get(word[0], word[0]) + word[1:] for word in words]
    return words, extra, keys, call
