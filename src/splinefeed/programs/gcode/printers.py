"""Programs of 3-D printers, Marlin's and Klipper's: one command a line, whose words are its own.

M82 and M83 alone say how E counts, and G91 makes it steps too; Marlin's G90 also ends M83, which slicers write behind
it anyway.

References
----------
.. [1] Marlin, G-code index, marlinfw.org/meta/gcode at 9ceeb6e4, 2026-06-10, one page a code: G0 and G1 move at F, G4 S
       before P, G92, M3 to M5, M82, M83, M109, M190 to M193, M220 with B and R, M400.
.. [2] Klipper, "G-Codes", docs/G-Codes.md at 84104bbbd, 2026-08-07, and "Commands templates".
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from typing import Any

from splinefeed.programs.gcode.codes import g_name
from splinefeed.programs.gcode.faults import LineError, refuse, shown
from splinefeed.programs.gcode.interpreter import Interpreter
from splinefeed.programs.gcode.moves import LETTERS, MoveKind
from splinefeed.records import Array

#: G codes that are read as everywhere else; all others, with their words, are the printer's own.
_READ = frozenset(
    (0, 10, 20, 30, 40, 50, 170, 180, 190, 200, 210, 530, 540, 550, 560, 570, 580, 590, 591, 592, 593, 900, 910, 920)
)
#: G codes of the printer's own that move it: homing, levelling, parking, probing, and retraction by its own settings.
_MOVE = frozenset((100, 110, 120, 1610, 1620, 260, 270, 280, 290, 300, 310, 320, 330, 340, 350, 420, 800))
#: Codes of MakerBot's, whose filaments are A and B (Sailfish, "Supported G-codes": G161, G162; M132 to M135).
_OF_MAKERBOT, _M_OF_MAKERBOT = frozenset((1610, 1620)), frozenset(range(132, 136))
#: Marlin's G60 keeps a place, G61 goes back to it.
_KEEPS, _RETURNS = 600, 610
#: M codes at which the printer waits until it rests.
_WAITS = frozenset((0, 1, 25, 109, 116, 125, 190, 191, 192, 193, 226, 303, 400, 600, 601))
#: The spindle or laser, for which Marlin waits, too, but not with I, its inline mode.
_SPINDLE = frozenset((3, 4, 5))
#: Klipper's commands that set something and move nothing; what is not among them is a macro of the printer's owner.
_SETTINGS = ("SET_", "EXCLUDE_OBJECT", "M117", "RESPOND", "ACTIVATE_EXTRUDER", "TURN_OFF_HEATERS")

_NUMBER = re.compile(r"(?<!\s)\s*+N\s*+[0-9]++", re.IGNORECASE)
_CHECKSUM = re.compile(r"\*\s*[0-9]+\s*$")
_COMMAND = re.compile(r"\s*([GMT])\s*([0-9]+)(?:\.([0-9]))?(?![0-9.])", re.IGNORECASE)
_OTHER = re.compile(
    r"\s*(?:@|\{%|T[?xc]\s*$|P\s*[0-9]+(?:\s|$)|(?P<name>[A-Z_][A-Z_][A-Z0-9_]*)(?:\s|$))", re.IGNORECASE
)
_PARAMETER = re.compile(r"(?<!\w)(\w++)=(\S++)")
#: What Klipper's SAVE_GCODE_STATE keeps beside places ("G-Codes", gcode_move).
_STATE = ("relative", "steps_of_filament", "filament", "feed", "rate")
_WORD = re.compile(r"(?:(?<!\s)\s++|(?!\s))([A-Z])\s*+([-+]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?![0-9.]))?", re.IGNORECASE)
#: Letters that G codes of `_READ` have; others are lamps, lasers and the like.
_LETTERS = frozenset("XYZABCUVWIJKRPQFES")


class Printer(Interpreter):
    """Runs one command after the other; what moves nothing is counted, and named once at the end."""

    def __init__(self, *arguments: object, **options: bool) -> None:
        super().__init__(*arguments, **options)  # type: ignore[arg-type]
        self._settings, self._own, self._macros = Counter[str](), Counter[str](), Counter[str]()
        self._kept_rate = 1.0
        self._filament = "E"  # and A and B, of a MakerBot
        self._states: dict[str, tuple[dict[str, Any], Array, Array, dict[str, float]]] = {}
        self._places: dict[int, Array] = {}  # Marlin's G60
        self._offset: dict[str, float] = {}  # Klipper's SET_GCODE_OFFSET

    def run(self, text: str, line: int) -> None:
        """One line: a command, or words that go on with the motion before them."""
        self.line = line
        rest = _CHECKSUM.sub("", _NUMBER.sub("", text.partition(";")[0], count=1)).strip()
        while rest:
            command = _COMMAND.match(rest)
            if command is None:
                if (other := _OTHER.match(rest)) is not None:
                    name = (other["name"] or rest.split()[0]).upper()
                    if self._of_klipper(name, rest):
                        return
                    (self._settings if name.startswith(_SETTINGS) else self._macros)[name] += 1
                    return
                rest = self._words_of("", rest)
            elif command[1].upper() == "M":
                self._m_code(int(command[2]), int(command[3] or 0), rest)
                return
            elif command[1].upper() == "T":
                super().run(f"T{command[2]}", line)
                return
            else:
                code, rest = 10 * int(command[2]) + int(command[3] or 0), rest[command.end() :]
                if code in (_KEEPS, _RETURNS):
                    self._kept_place(code, rest)
                    return
                rest = self._words_of(g_name(code), rest) if code in _READ else self._own_code(code)

    def end(self) -> None:
        """The file is at its end: what was named, once."""
        for named, said in (
            (self._settings, "commands of the printer that move nothing"),
            (self._own, "moves of the printer's own (homing, levelling, retraction), left out with their time"),
            (self._macros, "macros, which only the printer knows and which are left out with their moves and time"),
        ):
            if named:
                self.findings.say(f"{said}: {', '.join(f'{name} ({count})' for name, count in named.items())}")
        super().end()

    def _words_of(self, name: str, text: str) -> str:
        """Do the command with its words, up to the next one on the line, which is handed back."""
        words, at, filament = [name], 0, None
        while match := _WORD.match(text, at):
            letter = match[1].upper()
            if letter in "GMT" and match[2] is not None:
                said = "commands on one line are read one after the other; Marlin reads the first"
                self.findings.count(said, self.line)
                break
            at = match.end()
            if letter in self._filament and match[2] is not None:
                filament = float(match[2])
            elif match[2] is None and letter in _LETTERS:
                raise LineError(f"{letter}: a number is missing")
            elif letter in _LETTERS - {"S"} or (letter == "S" and name == "G4"):
                words.append(letter + match[2])
            else:
                self.findings.count(f"{letter} beside a motion of a printer moves nothing", self.line)
        rest = text[at:].strip()
        refuse(rest and not match, f"expected a letter and a number, got {shown(rest)}")
        if name in ("G5", "G5.1") and len(words) == 1:  # as Cura writes it behind what it prints first
            self._settings[name] += 1
            return rest
        if name == "G92" and len(words) == 1 and filament is not None:
            self.state.filament = filament * float(self.state.scale[0])
            return rest
        if len(words) > 1 or words[0]:
            super().run(" ".join(words), self.line)
        if filament is not None and name == "G92":
            self.state.filament = filament * float(self.state.scale[0])
        elif filament is not None:
            moves = any(word[:1] in set("XYZABCUVWIJR") for word in words)
            self.state.extrude(filament, self.line, alone=not moves)
        return rest

    def _of_klipper(self, name: str, text: str) -> bool:
        """Klipper's commands that change where places are; whether this is one. None is a state that a macro kept."""
        given = {key.upper(): value for key, value in _PARAMETER.findall(text)}
        state, called = self.state, given.get("NAME", "default")
        if name == "SAVE_GCODE_STATE":
            kept = {key: getattr(state, key) for key in _STATE}
            self._states[called] = kept, state.position.copy(), state.offsets.g92.copy(), dict(self._offset)
        elif name == "RESTORE_GCODE_STATE" and called in self._states:
            kept, place, shift, offset = self._states[called]
            for key, value in kept.items():
                setattr(state, key, value)
            state.offsets.g92, self._offset = shift.copy(), dict(offset)
            self._go(given, place)
        elif name == "SET_GCODE_OFFSET":
            there = state.position.copy()
            for axis, letter in enumerate("XYZ"):
                before = self._offset.get(letter, 0.0)
                after = self._number(given, letter, before) + self._number(given, f"{letter}_ADJUST", 0.0)
                state.offsets.g92[axis] += after - before
                there[axis] += after - before
                self._offset[letter] = after
            self._go(given, there)
        else:
            return False
        return True

    def _number(self, given: Mapping[str, str], key: str, otherwise: float) -> float:
        try:
            return float(given[key]) if key in given else otherwise
        except ValueError:
            raise LineError(f"{key}={given[key][:40]} is not a number") from None

    def _go(self, given: Mapping[str, str], place: Array) -> None:
        """Take over the offsets, and with MOVE=1 move to a place (9,), at MOVE_SPEED mm/s or at F."""
        self.state.set_offsets()
        if given.get("MOVE", "0") not in ("0", ""):
            feed = 60.0 * self._number(given, "MOVE_SPEED", self.state.feed / 60.0)
            self.state.add(MoveKind.LINE, place, self.state.stated(0b111), self.line, feed=feed)

    def _kept_place(self, code: int, text: str) -> None:
        """Marlin's G60 S keeps the place, G61 S goes back along the axes that it names, or along all."""
        words = {letter.upper(): value for letter, value in _WORD.findall(text)}
        slot, state = int(float(words.get("S") or 0)), self.state
        if code == _KEEPS:
            self._places[slot] = state.position.copy()
            return
        refuse(slot not in self._places, f"G61 goes back to place {slot}, which no G60 has kept")
        if words.get("F"):
            state.set_feed(float(words["F"]))
        there, named = state.position.copy(), [axis for axis in range(3) if LETTERS[axis] in words] or [0, 1, 2]
        for axis in named:
            there[axis] = self._places[slot][axis] + state.scaled(axis, float(words.get(LETTERS[axis]) or 0.0))
        state.add(MoveKind.LINE, there, state.stated(sum(1 << axis for axis in named)), self.line)

    def _own_code(self, code: int) -> str:
        if code in _OF_MAKERBOT:
            self._filament = "EAB"
        (self._own if code in _MOVE else self._settings)[g_name(code)] += 1
        return ""

    def _m_code(self, code: int, tenth: int, text: str) -> None:
        """M: a marker, at which the printer waits or not; the words are its own, and what it sets of E and of F."""
        state, name = self.state, f"M{code}" + f".{tenth}" * (tenth > 0)
        self._begun = True
        words = {letter.upper(): float(value) for letter, value in _WORD.findall(text)[1:] if value}
        if code in (82, 83):
            state.steps_of_filament = code == 83
        if code == 220:
            self._kept_rate = state.rate if re.search(r"\bB", text, re.IGNORECASE) else self._kept_rate
            rate = self._kept_rate if re.search(r"\bR", text, re.IGNORECASE) else words.get("S", 100 * state.rate) / 100
            refuse(not 0.0 < rate <= 1e3, f"M220 S{100 * rate:g}: the part of the feed is a percentage above 0")
            state.feed, state.rate = state.feed * rate / state.rate, rate
            self.findings.count("M220 multiplies the feeds behind it", self.line)
        if code in _M_OF_MAKERBOT:
            self._filament = "EAB"
        (self._macros if code == 98 else self._settings)[name] += 1
        waits = code in _WAITS or (code in _SPINDLE and not re.search(r"\bI", text, re.IGNORECASE))
        state.say(self.line, " ".join(text.split())[:80], stop=waits)
