"""A machine file that is being written: sections, lines with where each value comes from, and what is assumed."""

from __future__ import annotations

import json
import math
import re

from splinefeed.errors import FormatError

#: Letters of axes in the order in which controls number them.
AXES = "xyzabcuvw"
#: Axes that turn.
TURNS = "abc"
_NUMBER = re.compile(r"[-+]?(?:\d++\.?\d*+|\.\d++)(?:[eE][-+]?\d++)?")


class Plain(str):
    """The text of a number without a unit."""


class Page:
    """Write the text of a machine file, with a comment beside each value; assumptions stand in its notes.

    Parameters
    ----------
    source : str
        The file that it is made from.
    control : str
        What that is the configuration of.
    """

    def __init__(self, source: str, control: str) -> None:
        self.source, self.control = source, control
        self.title = ""
        self.assumed: list[str] = []
        self.facts: list[str] = []
        self._sections: dict[str, list[str]] = {}

    def assume(self, words: str) -> None:
        """Say what is assumed, once."""
        if words not in self.assumed:
            self.assumed.append(words)

    def tell(self, words: str) -> None:
        """Say what the configuration has and a machine file does not."""
        if words not in self.facts:
            self.facts.append(words)

    def set(self, section: str, key: str, value: str | int, comment: str = "") -> None:
        """Add a line to a section, with where it comes from."""
        quoted = isinstance(value, str) and not isinstance(value, Plain)
        text = json.dumps(value, ensure_ascii=False) if quoted else str(value)
        self._sections.setdefault(section, []).append(f"{key} = {text}" + (f"  # {comment}" if comment else ""))

    def comment(self, section: str, words: str) -> None:
        """Add a comment to a section."""
        self._sections.setdefault(section, []).append(f"# {words}")

    def text(self) -> str:
        """Return the text of the machine file."""
        notes = [f"From {self.source}, the configuration of {self.control}.", *self.facts]
        notes += [f"Assumed: {words}." for words in self.assumed]
        head = [
            f"# A machine for splinefeed, made from {self.source} ({self.control}).",
            "# Values are those of that file, in its units; edit them here, or make the file again.",
            f"title = {json.dumps(self.title or self.source, ensure_ascii=False)}",
            "notes = [",
            *(f"    {json.dumps(each, ensure_ascii=False)}," for each in notes),
            "]",
        ]
        sections = [line for name, lines in self._sections.items() for line in ("", f"[{name}]", *lines)]
        return "\n".join([*head, *sections]) + "\n"


def no_times(page: Page) -> None:
    """Say that a configuration holds no times of tool changes and of the spindle."""
    page.assume("tool changes and the spindle take no time; add [control] tool_change and [control.spindle]")


def number(text: str, source: str, place: str) -> tuple[str, float]:
    """Read the number that a text begins with.

    Parameters
    ----------
    text : str
        Of a configuration.
    source, place : str
        File, and place in it, for messages.

    Returns
    -------
    text : str
        The number as it is written.
    value : float
        The number.

    Raises
    ------
    FormatError
        For any other text.
    """
    found = _NUMBER.match(text.strip())
    if found is None or not math.isfinite(value := float(found[0])):
        raise FormatError(f"{source}: {place}: {text.strip()[:40]!r} is not a number")
    return found[0], value


def positive(text: str, source: str, place: str, *, or_zero: bool = False) -> tuple[str, float]:
    """Read a number above 0, or not below it.

    Parameters
    ----------
    text, source, place : str
        As for `number`.
    or_zero : bool, optional
        Whether it may be 0.

    Returns
    -------
    text : str
        The number as it is written.
    value : float
        The number.

    Raises
    ------
    FormatError
        For any other number or text.
    """
    written, value = number(text, source, place)
    if value < 0.0 or (value == 0.0 and not or_zero):
        raise FormatError(f"{source}: {place}: {written}; must {'not be negative' if or_zero else 'be greater than 0'}")
    return written, value


def short(value: float) -> str:
    """Return a number in few letters."""
    return f"{value:.12g}"
