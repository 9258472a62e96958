"""Heidenhain's conversational programs: L, CC with C, CR, and SPL.

Source: HEIDENHAIN iTNC 530, User Manual, 606 42x-04, 12.7 "Contour movements - Spline interpolation": every axis of an
SPL block follows K3 t^3 + K2 t^2 + K1 t + end, t from 1 to 0, from where the tool is, within 1 um, to the end.
"""

from __future__ import annotations

import math
import re

import numpy as np

from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.interpreter import Interpreter
from splinefeed.formats.gcode.moves import CLOCKWISE, COUNTERCLOCKWISE, LETTERS, LINE, RAPID, Spline
from splinefeed.records import Array

#: An SPL block may begin this far from where the tool is, mm or rad: 1 um by the manual, and the words' own rounding.
START_TOLERANCE = 2e-3
_NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:\s*E[-+]?[0-9]+)?"
_WORD = re.compile(
    rf"\s*(?P<name>K[123][XYZABCUVW]|I?[XYZABCUVW]|DR|R|F|S|M|T)\s*(?P<text>MAX|{_NUMBER}|[-+]|[0LR])?", re.I
)
_CYCLE = re.compile(r"CYCL DEF\s+(32(?:\.[0-9])?|247(?:\.[0-9])?)(?![0-9.])(.*)", re.I | re.S)
_TOLERANCE = re.compile(r"\bT\s*([0-9]*\.?[0-9]+)", re.I)
#: Blocks that say nothing of the path.
_SILENT = ("BEGIN PGM", "BLK FORM", "TOOL DEF", "*", ";")


class Heidenhain(Interpreter):
    """Lines of a conversational program; a ~ at the end goes on in the next line."""

    def __init__(self, *arguments: object, **options: bool) -> None:
        super().__init__(*arguments, **options)  # type: ignore[arg-type]
        self._waiting = ""
        self._pole: Array | None = None

    def run(self, text: str, line: int) -> None:
        """One line of the file."""
        self.line = line
        text = self._waiting + text.partition(";")[0].strip()
        if text.endswith("~"):
            if len(text) > layout.MAX_LINE:
                raise LineError(f"a block of more than {layout.MAX_LINE} characters")
            self._waiting = text[:-1] + " "
            return
        self._waiting = ""
        block = re.sub(r"^\d+\s*", "", text).strip()
        upper = block.upper()
        if not block or upper.startswith(_SILENT):
            if upper.startswith("BEGIN PGM") and upper.endswith("INCH"):
                self.state.set_units(200)
            return
        if upper.startswith("END PGM"):
            self.ended = True
        elif upper.startswith("TOOL CALL"):
            self._tool(block[9:])
        elif (cycle := _CYCLE.match(block)) is not None:
            self._settings(cycle[1], cycle[2])
        elif upper == "STOP":
            self.state.say(self.line, "M0")
        else:
            self._block(block)

    def end(self) -> None:
        """The file is at its end."""
        if self._waiting:
            raise LineError("the block goes on (~), but the file ends")

    def _tool(self, rest: str) -> None:
        number = re.match(r"\s*(\d+)", rest)
        speed = re.search(r"\bS\s*(\d+)", rest, re.IGNORECASE)
        words = [f"T{number[1]} M6"] if number else []
        self.state.say(self.line, " ".join(words + ([f"S{speed[1]}"] if speed else [])))

    def _settings(self, cycle: str, rest: str) -> None:
        """Cycle 32 says how far smoothing may leave the path, 247 which datum is in force; both move nothing."""
        if cycle.partition(".")[0] == "247":
            self.findings.say(f"line {self.line}: the datum of CYCL DEF 247 is not known: taken as 0")
        elif cycle in ("32.1", "32"):
            bound = _TOLERANCE.search(rest)
            self.state.values[layout.TOLERANCE] = 0.0 if bound is None else self.state.scaled(0, float(bound[1]))

    def _block(self, block: str) -> None:
        kind, rest = re.match(r"([A-Z]*)(.*)", block, re.IGNORECASE | re.DOTALL).groups()  # type: ignore[union-attr]
        kind = kind.upper()
        for known in ("SPL", "CC", "CR", "C", "L", "M"):
            if kind.startswith(known) and (
                len(kind) == len(known) or kind[len(known) :] in (*LETTERS, "IX", "IY", "IZ")
            ):
                rest = block[len(known) :]
                kind = known
                break
        else:
            raise LineError(
                f"{kind or block[:20]!r} is not supported in a Heidenhain program; write L, CC, C, CR and SPL"
            )
        if kind == "M":
            rest = f"M{rest}"
        words, markers = self._words_of(rest)
        if kind == "CC":
            self._pole = self._target(words)[0]
        elif kind == "SPL":
            self._spline(words)
        elif kind != "M":
            self._move(kind, words)
        for marker in markers:
            self.state.say(self.line, f"M{marker}")
            self.ended |= marker in (2, 30)

    def _words_of(self, rest: str) -> tuple[dict[str, str], list[int]]:
        """Words by name, and M codes; LineError for what is none."""
        words: dict[str, str] = {}
        markers: list[int] = []
        at = 0
        rest = rest.rstrip()
        while at < len(rest):
            match = _WORD.match(rest, at)
            if match is None or match.end() == at:
                raise LineError(f"expected a word of a Heidenhain program, got {rest[at : at + 20].strip()!r}")
            at = match.end()
            name, text = match["name"].upper(), match["text"] or ""
            if name == "M":
                markers.append(int(float(text or "nan")) if text.isdigit() else _refuse_number("M", text))
            elif name in words:
                raise LineError(f"{name} appears twice")
            else:
                words[name] = text.upper()
        return words, markers

    def _target(self, words: dict[str, str]) -> tuple[Array, int]:
        """Where the axis words lead, (9,), and the bits of the axes said."""
        there, said = self.state.position.copy(), 0
        for axis, letter in enumerate(LETTERS):
            for name in (letter, f"I{letter}"):
                if name in words:
                    value = self.state.scaled(axis, _value(name, words.pop(name)))
                    there[axis] = there[axis] + value if len(name) > 1 else value
                    said |= 1 << axis
                    if not abs(there[axis]) <= layout.LARGEST:
                        raise LineError(f"{name} leads to {there[axis]:g}, which is out of range")
        return there, said

    def _feed_of(self, words: dict[str, str]) -> bool:
        """Take F; whether it is FMAX."""
        feed = words.pop("F", None)
        if feed is None or feed == "MAX":
            return feed == "MAX"
        value = _value("F", feed)
        if not 0.0 <= value <= layout.LARGEST:
            raise LineError(f"F{value:g} is not a feed")
        self.state.values[layout.FEED] = value * self.state.values[layout.SCALE]
        return False

    def _move(self, kind: str, words: dict[str, str]) -> None:
        there, said = self._target(words)
        rapid = self._feed_of(words)
        radius, turn = words.pop("R", ""), words.pop("DR", "")
        if radius in ("L", "R"):
            raise LineError("RL and RR are cutter compensation, which needs the tool's radius; write R0")
        if words:
            raise LineError(f"{next(iter(words))} does not belong to a {kind} block")
        if kind == "L":
            if said:
                self.state.add(RAPID if rapid else LINE, there, said, said, self.line)
            return
        if turn not in ("+", "-"):
            raise LineError(f"{kind} needs DR+ or DR-")
        arc = COUNTERCLOCKWISE if turn == "+" else CLOCKWISE
        more: dict[str, float] = {}
        if kind == "CR":
            more = {"radius": self.state.scaled(0, _value("R", radius)), "flags": layout.HAS_R}
        elif self._pole is None:
            raise LineError("C needs the centre of its circle, CC, before it")
        else:
            more = {"i": float(self._pole[0]), "j": float(self._pole[1]), "flags": layout.ABSOLUTE | 3}
        self.state.add(arc, there, said | 3, said, self.line, **more)

    def _spline(self, words: dict[str, str]) -> None:
        """The cubic as a Bezier curve: in v = 1 - t from 0 to 1 its coefficients turn into control points."""
        there, said = self._target(words)
        self._feed_of(words)
        start = self.state.position.copy()
        points = np.tile(start, (4, 1))
        for axis, letter in enumerate(LETTERS):
            if not said >> axis & 1:
                continue
            cubic, square, linear = (
                self.state.scaled(axis, _value(f"K{k}{letter}", words.pop(f"K{k}{letter}", ""))) for k in (3, 2, 1)
            )
            end = float(there[axis])
            # Bezier ordinates of a polynomial in t on [0, 1]: b_k = sum_j C(k, j)/C(3, j) a_j; t runs backwards
            points[:, axis] = end + np.array(
                [cubic + square + linear, (2.0 * linear + square) / 3.0, linear / 3.0, 0.0]
            )
            off = abs(points[0, axis] - start[axis])
            if off > START_TOLERANCE:
                raise LineError(
                    f"SPL begins {off:.6g} from where the tool is in {letter}; at most {START_TOLERANCE:g} is allowed"
                )
        if words:
            raise LineError(f"{next(iter(words))} is not an axis of the SPL block")
        if not said:
            raise LineError("SPL needs the end point of its axes")
        points[0] = start
        self.findings.say("SPL is read as the manual describes it; it was not checked on a control")
        self.state.add_spline(Spline.bezier(points, self.line), said, said)


def _value(name: str, text: str) -> float:
    """A number, whose exponent may stand apart."""
    try:
        value = float(re.sub(r"\s", "", text))
    except ValueError:
        return _refuse_number(name, text)
    if not math.isfinite(value):
        _refuse_number(name, text)
    return value


def _refuse_number(name: str, text: str) -> int:
    raise LineError(f"{name} needs a number, got {text!r}")
