"""Feed moves of a program by a reader of its own, for holding ours against it: length, box, and time at the feeds.

    python tests/gcode_truth.py build/public-files   # writes tests/data/public_programs.json anew

It shares nothing with the package, knows only what the programs in that file need, and stops at what it does not know.
An arc is a thousand chords of its circle, and a spiral's length is that of the chords times what a circle's is longer.
"""

from __future__ import annotations

import hashlib
import json
import math
import pathlib
import re
import sys
from itertools import pairwise
from typing import Any

DATA = pathlib.Path(__file__).parent / "data" / "public_programs.json"
CHORDS = 1000
_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
_BITS = 0.5 * math.pi / CHORDS


class UnknownError(Exception):
    """A word or code that this reader does not know."""


class Tool:
    """Where the tool is, and what it has cut."""

    def __init__(self) -> None:
        self.at: list[float | None] = [None, None, None]
        self.length = self.seconds = 0.0
        self.low, self.high = [math.inf] * 3, [-math.inf] * 3

    def see(self, point: list[float]) -> None:
        self.low = [min(a, b) for a, b in zip(self.low, point, strict=True)]
        self.high = [max(a, b) for a, b in zip(self.high, point, strict=True)]

    def line(self, to: list[float | None], feed: float | None) -> None:
        """A straight move, in mm and mm/min; None for a rapid one, which is not counted."""
        if not feed:  # rapid, or before the first F
            self.at = to
            return
        begin, end = ([value or 0.0 for value in each] for each in (self.at, to))
        self.count([begin, end], feed)
        self.at = list(end)

    def arc(self, to: list[float | None], centre: tuple[float, float], axes: tuple[int, int], sense: int, turns: int,
            feed: float) -> None:  # fmt: skip
        if not feed:
            self.at = to
            return
        begin, end = ([value or 0.0 for value in each] for each in (self.at, to))
        a, b = axes
        first = math.atan2(begin[b] - centre[1], begin[a] - centre[0])
        last = math.atan2(end[b] - centre[1], end[a] - centre[0])
        sweep = (last - first) * sense % (2.0 * math.pi)
        if math.hypot(begin[a] - end[a], begin[b] - end[b]) < 1e-9:
            sweep = 2.0 * math.pi
        sweep += 2.0 * math.pi * (turns - 1)
        radii = [math.hypot(p[a] - centre[0], p[b] - centre[1]) for p in (begin, end)]
        points = []
        for k in range(CHORDS + 1):
            part = k / CHORDS
            angle, radius = first + sense * sweep * part, radii[0] + (radii[1] - radii[0]) * part
            point = [p + (q - p) * part for p, q in zip(begin, end, strict=True)]
            point[a], point[b] = centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)
            points.append(point)
        self.count(points, feed)
        self.at = list(end)

    def count(self, points: list[list[float]], feed: float) -> None:
        length = sum(math.dist(p, q) for p, q in pairwise(points))
        if length > 0.0:
            for point in points:
                self.see(point)
        self.length += length
        self.seconds += 60.0 * length / feed if length else 0.0


def words_of(line: str) -> list[tuple[str, float]]:
    line = re.sub(r"\([^)]*\)", "", line).partition(";")[0].upper()
    left = _WORD.sub("", line).strip()
    if left.strip("/% "):
        raise UnknownError(left)
    return [(letter, float(value)) for letter, value in _WORD.findall(line)]


IGNORED_G = {17, 40, 49, 54, 55, 61, 64, 69, 80, 90.1, 91.1, 94, 43, 98, 99, 15, 50, 50.1}
PLANES = {17: (0, 1), 18: (2, 0), 19: (1, 2)}


def milling(lines: list[str], printer: bool = False) -> Tool:
    """A program of a mill, a laser or a printer: lines, arcs, G81, G82 and G83."""
    tool, unit, steps, motion, feed, plane = Tool(), 1.0, False, -1.0, 0.0, 17
    cycle: dict[str, float] = {}
    back, moved = True, False
    if printer:
        tool.at = [0.0, 0.0, 0.0]
    for number, text in enumerate(lines, 1):
        try:
            if printer:
                text = text.partition(";")[0].strip()
                if not re.match(r"(?:G0*[0123]|G9[012]|G2[01])(?!\d)", text):
                    continue  # everything else of a printer moves nothing that is known
                if re.match(r"G92", text):
                    if re.search(r"[XYZ]", text):
                        raise UnknownError(text)
                    continue
            elif text.lstrip().startswith(("$", "?", "O", ":")) or (
                re.match(r"\s*(N\d+\s*)?\(", text) and not words_of(text)
            ):
                continue
            words = words_of(text)
        except UnknownError as error:
            raise UnknownError(f"line {number}: {error}") from None
        codes = [value for letter, value in words if letter == "G"]
        said = {letter: value for letter, value in words if letter not in "GMN"}
        home = 28 in codes or 53 in codes or 30 in codes
        for code in codes:
            if code in (20, 21):
                unit = 25.4 if code == 20 else 1.0
            elif code in (90, 91):
                steps = code == 91
            elif code in (0, 1, 2, 3, 81, 82, 83):
                motion = code
                cycle = {} if code > 3 else cycle
            elif code in PLANES:
                plane = int(code)
            elif code == 80:
                motion, cycle = 0, {}
            elif code in (98, 99):
                back = code == 98
            elif (
                code == 4 or code in IGNORED_G or code in (28, 30, 53) or (code == 92 and set(said) <= {"X", "Y", "S"})
            ):
                pass
            else:
                raise UnknownError(f"line {number}: G{code:g}")
        if any(letter == "M" and value in (2, 30, 98, 99) for letter, value in words):
            if any(letter == "M" and value in (98, 99) for letter, value in words) and number < len(lines) - 2:
                raise UnknownError(f"line {number}: M98")
            break
        if 4 in codes or home or 92 in codes:
            continue
        if "F" in said:
            feed = said["F"] * unit
        places = {"XYZ".index(letter): value * unit for letter, value in said.items() if letter in "XYZ"}
        if motion > 3 and places:
            cycle |= {letter: said[letter] * unit for letter in "RZQ" if letter in said}
            if steps:
                raise UnknownError(f"line {number}: a cycle by steps")
            there = [places.get(0, tool.at[0]), places.get(1, tool.at[1])]
            cycle.setdefault("I", tool.at[2] or 0.0)
            tool.at = [*there, tool.at[2]]
            low, depth = cycle["R"], cycle["Z"]
            if motion == 83 and "Q" in cycle:
                while low - cycle["Q"] > depth + 1e-9:  # rapid to 0.254 mm above the last peck
                    begin = low if low == cycle["R"] else low + 0.254
                    tool.line([*there, begin], None)
                    tool.line([*there, low - cycle["Q"]], feed)
                    low -= cycle["Q"]
                tool.line([*there, low if low == cycle["R"] else low + 0.254], None)
            else:
                tool.line([*there, low], None)
            tool.line([*there, depth], feed)
            tool.line([*there, max(cycle["I"], cycle["R"]) if back else cycle["R"]], None)
            continue
        if not places and motion < 2:
            continue
        to = [
            (tool.at[k] or 0.0) * steps + places[k] if k in places else tool.at[k]
            for k in range(3)
        ]  # fmt: skip
        if motion in (0, 1):
            tool.line(to, feed if motion or (printer and moved) else None)  # a first G0 comes from nobody knows where
            moved = True
        elif motion in (2, 3):
            a, b = PLANES[plane]
            if "R" in said:
                radius = said["R"] * unit
                begin = [value or 0.0 for value in tool.at]
                dx, dy = (to[a] or 0.0) - begin[a], (to[b] or 0.0) - begin[b]
                chord = math.hypot(dx, dy)
                high = math.sqrt(max(radius * radius - 0.25 * chord * chord, 0.0))
                side = 1.0 if (motion == 3) == (radius > 0) else -1.0
                centre = begin[a] + 0.5 * dx - side * high * dy / chord, begin[b] + 0.5 * dy + side * high * dx / chord
            elif any(letter in said for letter in "IJK"):
                centre = tuple((tool.at[k] or 0.0) + said.get("IJK"[k], 0.0) * unit for k in (a, b))
            else:
                continue
            tool.arc(to, centre, (a, b), 1 if motion == 3 else -1, int(said.get("P", 1)), feed)
    return tool


def siemens(lines: list[str]) -> Tool:
    """A program for a Sinumerik: what is not a plain block is taken out by hand."""
    plain = []
    for text in lines:
        text = re.sub(r"^N\d+\s*", "", text.strip()).partition(";")[0]
        if re.match(r"DEF|_|MSG|TRAFOOF|CYCLE800|SETMS|SUPA|T=|T0|M6\b|$", text) or "SUPA" in text:
            continue
        text = text.replace("CR=", "R")
        plain.append(re.sub(r"\b(FNORM|G710|G71|G4[12])\b|\bD\d+\b", "", text))  # as programmed: without G41
    return milling(plain)


def heidenhain(lines: list[str]) -> Tool:
    """Lines and arcs of a conversational program."""
    tool, feed, pole, shift = Tool(), 0.0, [0.0, 0.0], [0.0, 0.0, 0.0]
    number = r"([-+]?\d+\.?\d*)"
    for text in lines:
        text = re.sub(r"^\s*\d+\s+", "", text.strip()).partition(";")[0].upper().strip()
        if said := re.match(rf"CYCL DEF 7\.\d\s+([XYZ]){number}", text):
            shift["XYZ".index(said[1])] = float(said[2])
            continue
        kind = re.match(r"(CC|CP|C|L)(?=\s)", text)
        if kind is None or "M91" in text:
            continue
        if re.search(r"\bI[XYZ]|\bR[LR]\b|M99|\bQ|NAN", text):
            raise UnknownError(text)
        rapid = "FMAX" in text
        if said := re.search(rf"\bF{number}", text):
            feed = float(said[1])
        found = [("XYZ".index(k), float(v)) for k, v in re.findall(rf"(?<![A-Z])([XYZ]){number}", text)]
        places = {k: v + shift[k] for k, v in found}
        if kind[1] == "CC":
            pole = [places.get(k, tool.at[k] or 0.0) for k in (0, 1)]
            continue
        to = [places.get(k, tool.at[k]) for k in range(3)]
        if kind[1] == "L":
            if places:
                tool.line(to, None if rapid else feed)
            continue
        sense = 1 if "DR+" in text else -1
        turns = 1
        if kind[1] == "CP":
            turned = float(re.search(rf"IPA{number}", text)[1])  # type: ignore[index]
            angle = math.atan2((tool.at[1] or 0) - pole[1], (tool.at[0] or 0) - pole[0]) + math.radians(turned)
            radius = math.hypot((tool.at[1] or 0) - pole[1], (tool.at[0] or 0) - pole[0])
            to[0], to[1] = pole[0] + radius * math.cos(angle), pole[1] + radius * math.sin(angle)
            turns = math.ceil(abs(turned) / 360.0 - 1e-9)
            if z := re.search(rf"IZ{number}", text):
                to[2] = (tool.at[2] or 0.0) + float(z[1])
        tool.arc(to, (pole[0], pole[1]), (0, 1), sense, turns, feed)
    return tool


READERS = {"siemens": siemens, "heidenhain": heidenhain}


def inlined(lines: list[str], sub: list[str]) -> list[str]:
    """A program with its one subprogram in place of M98 P L."""
    body = [text for text in sub if not re.match(r"\s*(?:%|O\d|M99)", text)]
    out: list[str] = []
    for text in lines:
        called = re.search(r"M98\s*P\d+(?:\s*L(\d+))?", text)
        out += body * int(called[1] or 1) if called else [text]
    return out


def truth(file: pathlib.Path, dialect: str, sub: pathlib.Path | None = None) -> dict[str, Any]:
    """Length, mm, box, mm, and time, s, of the feed moves of a program."""
    lines = file.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    if sub is not None:
        lines = inlined(lines, sub.read_text().splitlines())
    printer = dialect in ("printer", "marlin", "klipper")
    tool = READERS[dialect](lines) if dialect in READERS else milling(lines, printer)
    return {
        "feed_length_mm": round(tool.length, 4), "feed_time_s": round(tool.seconds, 3),
        "low_mm": [round(value, 3) for value in tool.low], "high_mm": [round(value, 3) for value in tool.high],
    }  # fmt: skip


if __name__ == "__main__":
    page = json.loads(DATA.read_text())
    for name, said in page.items():
        file = pathlib.Path(sys.argv[1]) / name
        said["sha256"] = hashlib.sha256(file.read_bytes()).hexdigest()
        try:
            sub = pathlib.Path(sys.argv[1]) / said["sub"] if "sub" in said else None
            said |= truth(file, said["dialect"], sub)
        except (UnknownError, TypeError, KeyError, ZeroDivisionError) as error:
            print(name, "unknown:", repr(error))
    DATA.write_text(json.dumps(page, indent=1) + "\n")
