"""The text of a program while it is written: numbers, words that change, and what is to be said of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from splinefeed.formats.gcode.moves import Findings
from splinefeed.records import Array


@dataclass(frozen=True)
class Control:
    """How programs of a control are written.

    forms     its spline words, the default first; header  first lines, by which a reader recognizes the dialect
    decimals  of numbers, 17 where it reads all digits of a float; degree  the highest of its splines
    dwell     letter of a wait in seconds; exact  its exact stop; footer  last lines
    """

    forms: tuple[str, ...]
    header: tuple[str, ...]
    decimals: int
    degree: int = 0
    dwell: str = "P"
    exact: str = "G61"
    footer: tuple[str, ...] = ("M2",)


#: Fanuc's P, the order of a spline, is 2 to 4, Siemens' SD 2 or 3.
CONTROLS = {
    "linuxcnc": Control(("g5.2", "g6.2", "arcs", "g1"), ("G17 G21 G40 G49 G80 G90 G91.1 G94",), 17, 12),
    "fanuc": Control(
        ("g6.2", "arcs", "g1"), ("%", "O0001", "G17 G21 G40 G49 G80 G90 G94"), 6, 3, dwell="X", footer=("M30", "%")
    ),
    "siemens": Control(
        ("bspline", "arcs", "g1"), ("; SINUMERIK", "G17 G71 G40 G90 G94"), 9, 3, "F", "G60", footer=("M30",)
    ),
    "mach3": Control(("arcs", "g1"), ("(Mach3)", "G17 G21 G40 G49 G80 G90 G91.1 G94"), 6),
    "printer": Control(("g1", "arcs"), (";FLAVOR:Marlin", "G21", "G90"), 5, dwell="S"),
}


@dataclass
class Text:
    """The program so far: its lines, the words in force, and what is to be said of it."""

    dialect: str
    decimals: int
    lines: list[str] = field(default_factory=list)
    at: dict[str, str] = field(default_factory=dict)
    motion: str = ""
    feed: str = ""
    plane: str = "G17"
    control: str = ""
    ended: bool = False
    worst: float = 0.0
    said: Findings = field(default_factory=Findings)

    def number(self, value: float) -> str:
        """A number as the control reads it: no exponent, all digits that count, a point."""
        text = np.format_float_positional(float(value) + 0.0, unique=True, precision=self.decimals, trim="-")
        text = "0" if text in ("-0", "-0.", "0.") else text
        return text if "." in text or self.dialect != "fanuc" else f"{text}."

    def places(self, letters: Sequence[str], point: Array, *, every: bool = False) -> list[str]:
        """Words of the axes that change, or of all of them."""
        words = []
        for letter, value in zip(letters, point, strict=True):
            text = self.number(float(value))
            if every or self.at.get(letter) != text:
                words.append(f"{letter}{text}")
            self.at[letter] = text
        return words

    def move(self, motion: str, words: Sequence[str], feed: float | None) -> None:
        """A line of motion; G word and F only where they change."""
        line = [] if motion == self.motion else [motion]
        line += words
        if feed is not None and motion != "G0":
            said = self.number(60.0 * feed)
            line += [f"F{said}"] if said != self.feed else []
            self.feed = said
        self.motion = motion
        if line:
            self.lines.append(" ".join(line))

    def change(self, name: str, said: str) -> None:
        """A line that says `plane` or `control` where it changes."""
        if said != getattr(self, name):
            self.lines.append(said)
            setattr(self, name, said)

    def approximate(self, what: str, curve: int, error: float) -> None:
        """Curve number `curve` is not what it was."""
        self.said.count(what, curve)
        self.worst = max(self.worst, error)

    def findings(self) -> list[str]:
        """All that is to be said of the program."""
        found = self.said.all("curve")
        if self.worst > 0.0:
            found.append(f"what is approximated is at most {self.worst:.3g} mm from the curves, measured both ways")
        if self.decimals < 15:
            found.append(f"numbers have {self.decimals} decimals, so that places are rounded")
        return found
