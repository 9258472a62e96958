"""Programs of lathes, which are recognized to be refused: as a mill's they would be another motion.

X is a diameter there, U and W are steps of X and Z, F is a feed per revolution, G50 S bounds the speed, and G70 to G76,
G90, G92 and G94 are turning and threading cycles. Source: Fanuc Series 30i-MODEL B, User's Manual (Lathe System),
B-64484EN-1, "Canned cycle" and "Multiple repetitive canned cycle"; "Constant surface speed control". On Siemens' lathes
X is a diameter unless DIAMOF is said (SINUMERIK 840D sl/828D, Programming Manual Fundamentals, "Channel-specific
diameter/radius programming").
"""

from __future__ import annotations

import re

_FLAGS = re.IGNORECASE | re.MULTILINE
#: What no mill has, whatever the dialect. Words that follow each other in a line are each the first behind the one
#: before, (?>...): a line of such words alone is read in a time in proportion to its length.
_CERTAIN = {
    "G50 S": r"G50\s*S\s*[0-9]",
    "a cycle from P to Q": r"G7[0-3]\s*P\s*[0-9]+\s*Q\s*[0-9]+",
    "a roughing cycle": r"G7[123]\s*[UW]\s*[-+.0-9]+\s*(?:W\s*[-+.0-9]+\s*)?R",
    "a thread by G76": r"G76\s*P\s*[0-9]{6}(?![0-9])",
    "a thread by G92": r"^(?>[^\n]*?G92(?![0-9.]))(?>[^\n]*?[XU])[^\n]*?F\s*[0-9.]|"
    r"G92(?![0-9.])\s*[XU]\s*[-+.0-9]+\s*Z\s*[-+.0-9]+\s*F",
}
#: What a mill of that kind hardly has where it moves no Y.
_LIKELY = {
    "G96": r"G96(?![0-9.])",
    "steps by U and W": r"(?<![A-Z#])[UW]\s*[-+]?[.0-9]",
    "a turning cycle": r"^(?![^\n]*G0?[0-3](?![0-9.]))(?>[^\n]*?G9[04](?![0-9.])\s*[XUZW])(?>[^\n]*?[XUZW])[^\n]*?F",
    "a tool with its offset": r"^(?![^\n]*M0?6(?![0-9]))[^\n]*(?<![A-Z])T[0-9]{4}(?![0-9])",
}
#: What no mill of Siemens has; G96 and LIMS where nothing says that X is a radius.
_OF_SIEMENS = {
    "DIAMON": r"^[^;\n\"]*?\b(?:DIAMON|DIAM90)\b",
    "a turning cycle": r"^[^;\n\"]*?\bCYCLE9(?:[3-9]|[2-5][0-9])[ \t]*\(",
    "LIMS=": r"^[^;\n\"]*?\bLIMS[ \t]*=",
    "G96": r"^[^;\n\"]*?\bG96(?![0-9.])",
}
_RADIUS = re.compile(r"^[^;\n\"]*?\bDIAMOF\b", _FLAGS)
#: An arc in the plane of Z and X, which is the one in force on a lathe.
_ARC = re.compile(r"^(?>[^\n]*?G0?[23](?![0-9.]))(?>[^\n]*?X)(?>[^\n]*?Z)[^\n]*?(?<![A-Z])K\s*[-+.0]*[1-9]", _FLAGS)
_PLANE = re.compile(r"G1[89](?![0-9])", re.IGNORECASE)
_COMMENT = re.compile(r"\([^()\n]*\)|;.*")
_Y, _CHANGE = re.compile(r"Y\s*[-+]?[.0-9#\[]", re.IGNORECASE), re.compile(r"M0?6(?![0-9])", re.IGNORECASE)


def siemens_lathe_sign(text: str) -> tuple[int, str] | None:
    """Line and kind of what shows a program of Siemens' lathes, or None."""
    of_radius = _RADIUS.search(text)
    for name, sign in _OF_SIEMENS.items():
        if name in ("LIMS=", "G96") and of_radius:
            continue
        if found := re.search(sign, text, _FLAGS):
            return text.count("\n", 0, found.end()) + 1, name
    return None


def lathe_sign(text: str, likely: bool) -> tuple[int, str] | None:
    """Line and kind of what shows a lathe's program, or None; a program that moves Y is a mill's.

    likely  whether the dialect is Fanuc's or near to it, so that signs count that others write, too
    """
    code = _COMMENT.sub("", text)
    if _Y.search(code):
        return None
    if not _PLANE.search(code) and (found := _ARC.search(code)):
        return code.count("\n", 0, found.start()) + 1, "an arc of X, Z and K without G18"
    signs = _CERTAIN | (_LIKELY if likely else {})
    if _CHANGE.search(code):
        signs.pop("a tool with its offset", None)
    for name, sign in signs.items():
        if found := re.search(sign, code, _FLAGS):
            return code.count("\n", 0, found.start()) + 1, name
    return None
