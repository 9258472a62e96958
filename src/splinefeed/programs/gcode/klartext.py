"""Labels, jumps and Q parameters of Heidenhain's conversational programs.

They are LBL, LBL 0, CALL LBL and REP (the section runs once more than REP says), and FN 0 to FN 13, formulas, and
angles in degrees [1]_ [2]_ [3]_. SGN is not read: manuals differ on what it makes of 0 and less. A parameter that the
program has not set is refused: the control keeps its value from the program before.

References
----------
.. [1] HEIDENHAIN TNC 640, User's Manual Klartext Programming: "Subprograms and program-section repeats", "Programming Q
       parameters".
.. [2] HEIDENHAIN TNC 320, 3/2014, p. 274: FN 6 to FN 13.
.. [3] HEIDENHAIN TNC 407, p. 7-15: formulas.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import numpy as np

from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.flow import ProgramText, Walk
from splinefeed.programs.gcode.formulas import ARITHMETIC, FUNCTIONS, Formula, Operations, computed
from splinefeed.programs.gcode.interpreter import Interpreter

_NUMBER = r"(?:[0-9]++[.,]?[0-9]*+|[.,][0-9]++)"
_LABEL = r"(?:\"(?P<{0}>[^\"]+)\"|(?P<{1}>[0-9]+))"
_JUMP = re.compile(
    rf"(?:LBL\s*{_LABEL.format('name', 'number')}|CALL\s+LBL\s*{_LABEL.format('called', 'call')}"
    rf"(?:\s*REP\s*(?P<rep>[0-9]+)(?:/[0-9]+)?)?|(?:FN\s*(?P<fn>[0-9]+)\s*:\s*)?IF\s*+"
    r"(?>(?P<first>.+?)(?<!\s)\s*+(?P<is>EQU|NE|GT|LT))\s*+(?>(?P<second>.+?)(?<!\s)\s*+GOTO)"
    rf"\s+LBL\s*{_LABEL.format('aim', 'goto')})\s*+$"
)
_LIKELY = re.compile(
    rb"^[ \t/]*(?:[0-9]+[ \t]*)?(?:LBL|CALL[ \t]+LBL|END[ \t]+PGM|(?:FN[ \t]*[0-9]+[ \t]*:[ \t]*)?IF\b)",
    re.MULTILINE | re.IGNORECASE,
)
#: `/` of a block that may be skipped, its number, and what follows.
BLOCK = re.compile(r"\s*(?P<skip>/?)\s*(?:[0-9]+\s+|[0-9]+$)?(?P<plain>.*)", re.DOTALL)
_SET = re.compile(r"(?:FN\s*(?P<fn>[0-9]+)\s*:\s*)?(?P<name>Q[LR]?[0-9]+)\s*=\s*(?P<value>.*)")
_SIGNED = re.compile(r"([-+]?)(?<!\s)\s*+(Q[LR]?[0-9]+)")
#: Subprograms within subprograms.
MAX_CALLS = 19
_COMPUTES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 13)


_FUNCTION: dict[str, Callable[[float], float]] = FUNCTIONS | {
    "ATAN": lambda v: math.degrees(math.atan(v)), "SQ": lambda v: v * v, "NEG": lambda v: -v, "INT": math.trunc,
    "FRAC": lambda v: v - math.trunc(v), "LOG": math.log10,
}  # fmt: skip
_OPERATIONS: Operations = {
    "+": (1, ARITHMETIC["+"]), "-": (1, ARITHMETIC["-"]), "*": (2, ARITHMETIC["*"]), "/": (2, ARITHMETIC["/"]),
    "DIV": (2, ARITHMETIC["/"]), "LEN": (2, math.hypot), "^": (3, math.pow),
    "ANG": (2, lambda a, b: math.degrees(math.atan2(a, b)) % 360.0),
}  # fmt: skip
_HOLDS: dict[str, Callable[[float, float], bool]] = {
    "EQU": lambda a, b: a == b, "NE": lambda a, b: a != b, "GT": lambda a, b: a > b, "LT": lambda a, b: a < b,
}  # fmt: skip


class Quantities:
    """Values of Q, QL and QR parameters, by name."""

    def __init__(self) -> None:
        self._values: dict[str, float] = {}

    def take(self, text: str) -> bool:
        """Set a parameter, if that is what the block does; LineError for what does not compute."""
        found = _SET.match(text)
        if found is None or (found["fn"] and int(found["fn"]) not in _COMPUTES):
            return False
        self._values[found["name"]] = self.value(found["value"])
        return True

    def get(self, name: str) -> float:
        """Value of a parameter; LineError if it has none."""
        if name not in self._values:
            raise LineError(f"{name} has no value; set it in the program before it is used")
        return self._values[name]

    def filled(self, text: str) -> str:
        """The block with numbers in place of its parameters."""
        return _SIGNED.sub(lambda found: f"{self.get(found[2]) * (-1.0 if found[1] == '-' else 1.0):+.9f}", text)

    def value(self, text: str) -> float:
        """A formula, or the two values of FN 0 to FN 13."""
        formula = _KlartextFormula(text, self)
        value = formula.chain()
        refuse(formula.peek(), f"expected a formula, got {text[formula.at :].strip()[:20]!r}")
        return value


class _KlartextFormula(Formula):
    operations = _OPERATIONS
    operator = re.compile(r"\s*+([-+*/^]|(?:DIV|LEN|ANG)(?![A-Z]))")
    token = re.compile(rf"\s*+({_NUMBER}|Q[LR]?[0-9]+|[A-Z]+|[-+*/^()])")

    def __init__(self, text: str, quantities: Quantities) -> None:
        super().__init__(text)
        self._quantities = quantities

    def _one(self) -> float:
        token = self.take()
        if token in ("+", "-"):
            return (-1.0 if token == "-" else 1.0) * self.value()
        if token == "(":
            value = self.chain()
            self.take(")", "a bracket of the formula is not closed")
            return value
        if token in _FUNCTION:
            return computed(f"{token} {{:g}}", _FUNCTION[token], self.value())
        if token == "PI":
            return math.pi
        if re.fullmatch("Q[LR]?[0-9]+", token):
            return self._quantities.get(token)
        refuse(token[0] not in "0123456789.,", f"{token!r} is not known in a formula")
        return computed(token, float, float(token.replace(",", ".")))


class KlartextFlow(Walk):
    """Where a program is; `arrives` is called with the number of a line before it jumps."""

    def __init__(
        self, text: ProgramText, run: Interpreter, quantities: Quantities, arrives: Callable[[int], None]
    ) -> None:
        super().__init__(text, run, arrives)
        self._quantities = quantities
        self._said: dict[int, re.Match[str] | None] = {}
        self._labels: dict[str, int] = {}
        self._ends = set[int]()
        for found in _LIKELY.finditer(text.text):
            at = int(np.searchsorted(text.begins, found.start(), "right")) - 1
            plain = BLOCK.match(text.jumping(at).decode("utf-8-sig", errors="replace").partition(";")[0])
            said = (plain["plain"] if plain else "").strip().upper()
            jump = _JUMP.match(said)
            self._said[at] = jump
            if said.startswith("END"):
                self._ends.add(at)
            if jump and (label := jump["name"] or jump["number"]):
                self._labels.setdefault(_plain(label), at)
        text.order = [*sorted(self._said), text.count]
        self._returns: list[tuple[int, str]] = []
        self._left: dict[int, int] = {}

    def _jump(self, at: int) -> None:
        if at in self._ends:  # what follows it is no part of the program
            within = self._returns[-1][1] if self._returns else ""
            refuse(self._returns, f"the program ends within LBL {within}, which has no LBL 0")
            self._run.run(self.text.jumping(at).decode("utf-8-sig", errors="replace"), at + 1)
            self.at = self.text.count
        else:
            self.at = self._behind(at)

    def _behind(self, at: int) -> int:
        """The line that follows a line that jumps."""
        jump = self._said[at]
        if jump is None:
            raise LineError("LBL, CALL LBL and IF need the number of a label, or its name in quotes")
        if (label := jump["name"] or jump["number"]) is not None:
            return self._returns.pop()[0] if _plain(label) == "0" and self._returns else at + 1
        if jump["is"]:
            refuse(jump["fn"] and int(jump["fn"]) not in (9, 10, 11, 12), f"FN {jump['fn']} does not jump")
            values = [self._quantities.value(jump[part]) for part in ("first", "second")]
            return self._begin(jump["aim"] or jump["goto"]) if _HOLDS[jump["is"]](*values) else at + 1
        label = jump["called"] or jump["call"]
        if jump["rep"] is None:
            refuse(len(self._returns) >= MAX_CALLS, f"LBL {label}: more than {MAX_CALLS} calls within calls")
            begin = self._begin(label)
            self._returns.append((at + 1, label))
            return begin
        left = self._left.pop(at, int(jump["rep"]))
        if left <= 0:
            return at + 1
        self._left[at] = left - 1
        return self._begin(label)

    def _begin(self, label: str) -> int:
        refuse(_plain(label) == "0", "LBL 0 ends a subprogram; it cannot be called")
        if _plain(label) not in self._labels:
            raise LineError(f"LBL {label} is called, and is not in the program")
        return self._labels[_plain(label)] + 1


def _plain(label: str) -> str:
    return str(int(label)) if label.isdigit() else label
