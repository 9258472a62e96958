"""Programs of lathes, which are recognized to be refused: as a mill's they would be another motion.

X is a diameter there, U and W are steps of X and Z, F is a feed per revolution, G50 S bounds the speed, and G70 to G76,
G90, G92 and G94 are turning and threading cycles [1]_. On Siemens' lathes X is a diameter unless DIAMOF is said [2]_.

References
----------
.. [1] Fanuc Series 30i-MODEL B, User's Manual (Lathe System), B-64484EN-1, "Canned cycle" and "Multiple repetitive
canned
       cycle"; "Constant surface speed control".
.. [2] SINUMERIK 840D sl/828D, Programming Manual Fundamentals, "Channel-specific diameter/radius programming".
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
#: What a mill hardly has where it moves no Y and changes no tool by M6.
_PER_TURN, _OFFSET = "a feed per revolution (G95)", "a tool with its offset"
_UNLIKELY = {_PER_TURN: r"G95(?![0-9.])"}
#: And what a mill of Fanuc's kind hardly has.
_RETURN = "G98 or G99 without a drilling cycle"
_LIKELY = {
    _RETURN: r"(?<![A-Z0-9])G9[89](?![0-9.])",
    "a thread by G32": r"(?<![A-Z0-9])G32(?![0-9.])",
    "a pecking cycle": r"G7[45]\s*R\s*[.0-9]",
    "G96": r"G96(?![0-9.])",
    "steps by U and W": r"(?<![A-Z#])[UW]\s*[-+]?[.0-9]",
    "a turning cycle": r"^(?![^\n]*G0?[0-3](?![0-9.]))(?>[^\n]*?G9[04](?![0-9.])\s*[XUZW])(?>[^\n]*?[XUZW])[^\n]*?F",
    _OFFSET: r"^(?![^\n]*M0?6(?![0-9]))[^\n]*(?<![A-Z])T(?:[0-9]{4}|([0-9])0\1)(?![0-9])",
}
#: What programs of LinuxCNC have, which is read where nothing shows a control.
_OF_LINUXCNC = ("G96", "steps by U and W", "a pecking cycle")
#: What no mill of Mach3 has: its G76 is a thread, G77 and G78 turn and face.
_OF_MACH3 = {"a turning cycle": r"(?<![A-Z0-9])G7[678](?![0-9.])", "Mach3Turn": r"\bMach3\s?Turn\b"}
#: What no mill of Siemens has; the feed, G96 and LIMS where nothing says that X is a radius.
_OF_SIEMENS = {
    "DIAMON": r"^[^;\n\"]*?\b(?:DIAMON|DIAM90)\b",
    "a turning cycle": r"^[^;\n\"]*?\bCYCLE9(?:[3-9]|[2-5][0-9])[ \t]*\(",
    "LIMS=": r"^[^;\n\"]*?\bLIMS[ \t]*=",
    "G96": r"^[^;\n\"]*?\bG96(?![0-9.])",
    _PER_TURN: r"^[^;\n\"]*?\bG95(?![0-9.])",
}
_RADIUS = re.compile(r"^[^;\n\"]*?\bDIAMOF\b", _FLAGS)
#: An arc in the plane of Z and X, which is the one in force on a lathe.
_ARC = re.compile(r"^(?>[^\n]*?G0?[23](?![0-9.]))(?>[^\n]*?X)(?>[^\n]*?Z)[^\n]*?(?<![A-Z])K\s*[-+.0]*[1-9]", _FLAGS)
_PLANE = re.compile(r"G1[89](?![0-9])", re.IGNORECASE)
_COMMENT = re.compile(r"\([^()\n]*\)|;.*")
_Y, _CHANGE = re.compile(r"Y\s*+(?:=\s*+)?[-+]?[.0-9#\[]", re.IGNORECASE), re.compile(r"M0?6(?![0-9])", re.IGNORECASE)
#: What says that a program of Fanuc's kind is a mill's where it has G98 and G99.
_OF_MILL = re.compile(r"(?<![A-Z0-9])G(?:17|90|91|73|76|8[1-9])(?![0-9])", re.IGNORECASE)
#: By what `Dialect.lathe` says. Some count where no line moves Y, or where nothing says that X is a radius.
SIGNS = {
    "certain": _CERTAIN,
    "mach3": _OF_MACH3 | _CERTAIN | _UNLIKELY,
    "fanuc": _CERTAIN | _LIKELY | _UNLIKELY,
    "siemens": _OF_SIEMENS,
    "untold": _CERTAIN | {name: sign for name, sign in _LIKELY.items() if name not in _OF_LINUXCNC},
}
#: What says that a tool with its offset is a mill's; and the most that a lathe feeds in a turn, mm or inches.
_OF_MILLS_TOOL = re.compile(r"(?<![A-Z0-9])G(?:17|43)(?![0-9])", re.IGNORECASE)
_FEED, _MOST_PER_TURN = re.compile(r"(?<![A-Z])F\s*([0-9]*\.?[0-9]+)", re.IGNORECASE), 2.0
#: Beside feeds of a turn, what leaves open which machine a program is for: X, Z and a speed; and what says what F is.
_TURNS = tuple(
    re.compile(word, re.IGNORECASE)
    for word in (r"(?<![A-Z])X\s*[-+.0-9]", r"(?<![A-Z])Z\s*[-+.0-9]", r"(?<![A-Z])S\s*[1-9]")
)
_SAID = re.compile(r"(?<![A-Z0-9])G(?:0?[78]|9[35])(?![0-9.])", re.IGNORECASE)
_LATHE = "shows a lathe's program (diameters, turning cycles, feeds per revolution), which is not read"
_OPEN = "where no line moves Y may be a lathe's or a mill's; if it is a mill's name its control (option dialect)"
_MEND = "a mill's program moves Y: write Y0 in its first move"
_MEND_OF_SIEMENS = "where X is a radius, write DIAMOF"


def lathe_sign(text: str, kind: str, *, given: bool = False) -> tuple[int, str] | None:
    """Find what shows a lathe's program.

    Parameters
    ----------
    text : str
        The beginning of the program.
    kind : str
        The entry of SIGNS that the dialect of the program names, "untold" where nothing shows one; "" for none.
    given : bool, optional
        Whether the user named the dialect, which answers what the program leaves open.

    Returns
    -------
    tuple or None
        Its line, with what is to be said of it; None for a mill's program.
    """
    if not kind:
        return None
    code, unsure = _COMMENT.sub("", text), set[str]()
    if kind == "siemens":
        code, mend = text, _MEND_OF_SIEMENS
        unsure |= {_PER_TURN} if _Y.search(_COMMENT.sub("", text)) else set()
        unsure |= {"LIMS=", "G96", _PER_TURN} if _RADIUS.search(text) else set()
    else:
        mend = _MEND
        if _Y.search(code):
            return None
        if not _PLANE.search(code) and (found := _ARC.search(code)):
            return code.count("\n", 0, found.start()) + 1, f"an arc of X, Z and K without G18 {_LATHE}; {mend}"
        unsure |= {_RETURN} if _OF_MILL.search(code) else set()
    unsure |= {_OFFSET, _PER_TURN} if _CHANGE.search(code) else set()
    open_ = max((float(feed[1]) for feed in _FEED.finditer(code)), default=0.0) > _MOST_PER_TURN
    unsure |= {_OFFSET} if _OF_MILLS_TOOL.search(code) or (open_ and given) else set()
    for name, sign in SIGNS[kind].items():
        looked_at = text if name == "Mach3Turn" else code
        if name not in unsure and (found := re.search(sign, looked_at, _FLAGS)):
            said = f"{name} {_OPEN}" if open_ and name == _OFFSET else f"{name} {_LATHE}; {mend}"
            return code.count("\n", 0, found.start()) + 1, said
    settled = given or open_ or any(each.search(code) for each in (_CHANGE, _OF_MILLS_TOOL, _SAID))
    feed = None if settled or kind not in ("fanuc", "untold") else _FEED.search(code)
    if feed and all(each.search(code) for each in _TURNS):
        return code.count("\n", 0, feed.start()) + 1, f"F{feed[1]} {_OPEN}"
    return None
