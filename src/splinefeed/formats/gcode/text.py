"""The text of a program while it is written: numbers, words that change, and what is to be said of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from splinefeed.formats.gcode.moves import Findings
from splinefeed.records import Array

#: Decimals of numbers where a control does not read all digits of a float; LinuxCNC, which does, gets them all.
DECIMALS = {"linuxcnc": 17, "fanuc": 6, "siemens": 9, "mach3": 6, "printer": 5}
#: Highest degree of a spline: Fanuc's P is 2 to 4, Siemens' SD 2 or 3.
HIGHEST_DEGREE = {"linuxcnc": 12, "fanuc": 3, "siemens": 3}


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
        rounded = float(value) + 0.0
        text = np.format_float_positional(rounded, unique=True, precision=self.decimals, trim="-")
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
            if said != self.feed:
                line.append(f"F{said}")
                self.feed = said
        self.motion = motion
        if line:
            self.lines.append(" ".join(line))

    def set_plane(self, plane: str) -> None:
        """G17, G18 or G19 where it changes."""
        if plane != self.plane:
            self.lines.append(plane)
            self.plane = plane

    def break_motion(self) -> None:
        """The next line of motion says its G word again."""
        self.motion = ""

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
