"""Dialects of G-code: which a file is in, and in what they differ."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import NamedTuple

from splinefeed.errors import InputError
from splinefeed.files.source import head_text

#: How names of programs end.
SUFFIXES = (".ngc", ".nc", ".gcode", ".tap", ".cnc", ".mpf", ".spf", ".gc", ".g")
#: How much of a file is looked at to tell what it is.
HEAD_BYTES = 2**16


@dataclass(frozen=True)
class Dialect:
    """What a control reads differently from LinuxCNC. To add one: a row in DIALECTS, and what shows it in SIGNS.

    Parameters
    ----------
    name, title : str
        As an option has it, and in words.
    language : str, optional
        Whose lines it has: rs274, or those of a row of `reader.LANGUAGES`.
    extruder : bool, optional
        Of 3-D printers: E words are filament and no motion, and G0 moves at F.
    laser : bool, optional
        Whether S is the power of a laser, for which the tool does not rest.
    own : frozenset of int, optional
        G codes that not every control has, as tenths; those that are not read are refused as its own.
    m_codes : frozenset of int or None, optional
        Those that it has; the words beside another one are that one's. None where the builder adds codes.
    dwell : float, optional
        s of one unit of G4's P.
    dwell_words : str, optional
        Other letters of G4 in s (whole as P where no increments count).
    dwell_pointed : float or None, optional
        s of one unit of P with a decimal point, of G4 and of cycles; None where a point changes nothing.
    dwell_said : str, optional
        What a finding says of that unit, where the manual leaves it open.
    metric : bool, optional
        Whether lengths are mm where no line says it; to others it is a setting.
    units_by_70 : bool, optional
        Whether G70 and G71 are inches and mm; to others they are cycles of lathes, or rows of holes.
    modes : frozenset of int, optional
        Codes that switch functions of the control on and off and move nothing.
    increments : bool, optional
        Whether words of axes without a decimal point may count least increments.
    silent : tuple of str, optional
        How lines begin that are for the control alone: directives, texts.
    percent_ends : bool, optional
        Whether a second % ends the program; to others a line that begins with it is a comment.
    returns : int, optional
        98 or 99: where canned cycles end unless the program says it.
    repeats : str, optional
        Letters of a canned cycle's repeats.
    cycles : str, optional
        Whose canned cycles it has, by the name that `cycles.KINDS` has for them.
    keeps_cycles : bool, optional
        Whether R, Z, P and Q stay in force from one kind of cycle to the next.
    corners : tuple of str, optional
        What it calls a rounded corner, a chamfer by its way and a chamfer by its length; nothing for none.
    jumps, calls_lines : bool, optional
        Whether O-words, M98 and M99 are read, and whether M97 calls lines of the same program.
    systems : frozenset of int, optional
        Codes of coordinate systems beyond G54 to G59.3.
    of_fanuc : bool, optional
        Whether systems are G54.1 P (G154 P), which G10 L20 sets, G10 adds with G91, R and Z of a cycle stay where they
        were said, G80 brings G0 to G3 from before the cycle back, and macros are Fanuc's.
    of_linuxcnc : bool, optional
        Whether words that LinuxCNC alone has are read: G76 as a thread, M70 to M73, M128, F before units.
    lead : str, optional
        Letter of the way a revolution of G33.
    lathe : str, optional
        By which signs a lathe's program is recognized, as `lathe.SIGNS` calls them; nothing for none.
    """

    name: str
    title: str
    language: str = "rs274"
    extruder: bool = False
    laser: bool = False
    own: frozenset[int] = frozenset()
    m_codes: frozenset[int] | None = None
    dwell: float = 1.0
    dwell_words: str = ""
    dwell_pointed: float | None = None
    dwell_said: str = ""
    metric: bool = False
    units_by_70: bool = False
    modes: frozenset[int] = frozenset()
    increments: bool = False
    silent: tuple[str, ...] = ()
    percent_ends: bool = True
    returns: int = 98
    repeats: str = "L"
    cycles: str = "linuxcnc"
    keeps_cycles: bool = False
    corners: tuple[str, ...] = ()
    jumps: bool = False
    calls_lines: bool = False
    systems: frozenset[int] = frozenset()
    of_fanuc: bool = False
    of_linuxcnc: bool = False
    lead: str = "K"
    lathe: str = ""

    @property
    def units(self) -> str:
        """The codes that say units."""
        return "G70 or G71" if self.language == "siemens" else "G20 or G21"


def _tenths(*codes: int) -> frozenset[int]:
    """G codes as tenths."""
    return frozenset(10 * code for code in codes)


#: LinuxCNC documentation, "M-Codes" (M100 to M199 are the user's, with P and Q), and "M98 and M99"; Grbl 1.1,
#: "Supported G-codes", with the coolant, override and outputs of its variants.
_OF_LINUXCNC = frozenset(
    (*range(10), 19, 30, *range(48, 54), *range(60, 69), *range(70, 74), *range(96, 200), 428, 429)
)
_OF_GRBL = frozenset((*range(10), 30, 56, *range(62, 68)))
#: What Marlin and Klipper have in common.
_PRINTER = Dialect(
    "printer", "3-D printer", language="printer", extruder=True, laser=True, dwell=1e-3, dwell_words="S", metric=True
)

_FANUC = Dialect(
    "fanuc",
    "Fanuc",
    own=frozenset((51, 71, 75, 106, 121, 131, 434, 435, 501, 511, 541, 681, 682, 800, 810, 2340))
    | _tenths(9, 22, 23, 27, 31, 45, 46, 47, 48, 60, 62, 63, 65, 66, 67, 68, 69, 75, 77),
    dwell=1e-3,
    dwell_words="XU",
    dwell_pointed=1.0,
    dwell_said="P of G4 and of cycles with a decimal point is taken in s, as a Haas does; Fanuc has none",
    # G05 P10000 and G05.1 Q1 look ahead, G08 P1 does too; G50.1 and G69 end what is refused when it begins;
    # G13.1 does too, but G13 is a round pocket to a Haas, whose G103 and G187 say how far to look ahead and
    # how smooth to be
    modes=frozenset((50, 51, 80, 501, 620, 630, 690, 150, 131, 1030, 1870)),
    increments=True,
    silent=("//", "POPEN", "PCLOS", "DPRNT", "BPRNT"),
    repeats="KL",
    cycles="fanuc",
    keeps_cycles=True,
    corners=(",R", ",C", ",L"),
    jumps=True,
    systems=frozenset((541, 1540)),
    of_fanuc=True,
    lead="F",
    lathe="fanuc",
)

DIALECTS = {
    each.name: each
    for each in (
        Dialect(
            "linuxcnc", "LinuxCNC", m_codes=_OF_LINUXCNC, returns=99, jumps=True, of_linuxcnc=True, lathe="certain"
        ),
        _FANUC,
        replace(
            _FANUC,
            name="haas",
            title="Haas",
            own=frozenset((682, 2340))
            | _tenths(12, 13, 31, 35, 36, 37, 47, 65, 68, 69, 70, 71, 72, *range(101, 104), *range(107, 130), 136,
                      141, 143, 150, 153, 154, 155, 160, 161, 167, 174, 184, 187),
            dwell_said="",
            repeats="L",
            cycles="haas",
            calls_lines=True,
            systems=frozenset((541, 1540)) | _tenths(*range(110, 130)),
        ),
        Dialect(
            "mach3",
            "Mach3",
            own=_tenths(12, 13, 15, 16, 31, 50, 51, 68, 69, 77, 78),
            dwell_said="times P are taken in s; a setting of Mach3 makes them ms (General Config, G04 Dwell param)",
            units_by_70=True,
            modes=frozenset((150, 501, 690)),
            percent_ends=False,
            jumps=True,
            lathe="mach3",
        ),
        replace(
            _FANUC,
            name="mach4",
            title="Mach4",
            own=_tenths(9, 12, 13, 15, 16, 31, 32, 50, 51, 60, 66, 67, 68, 69) | frozenset((842, 843)),
            dwell_said="",
            modes=frozenset((110, 150, 401, 402, 501, 690)),
            increments=False,
            silent=(),
            repeats="L",
            systems=frozenset((541,)),
        ),
        Dialect(
            "grbl",
            "Grbl",
            m_codes=_OF_GRBL,
            modes=frozenset((150, 690)),
            silent=("$", "?", "!", "~", "[ESP", "%"),
            laser=True,
            metric=True,
        ),
        replace(_PRINTER, own=_tenths(26, 27, 29, 32, 34, 35, 60, 61, 76, 425)),
        replace(_PRINTER, name="marlin", title="Marlin"),
        replace(_PRINTER, name="klipper", title="Klipper", dwell_words=""),
        Dialect(
            "siemens",
            "Siemens Sinumerik",
            language="siemens",
            own=_tenths(25, 26, 63, 70, 71, 74, 75, *range(110, 113), 147, 148, 153, 247, 248, *range(331, 334), 347,
                        348, 450, 451, 500, *range(505, 600), 601, 602, 603, *range(641, 646), 700, 710),
            units_by_70=True,
            corners=("RND=", "CHR=", "CHF="),
            lathe="siemens",
        ),
        Dialect("heidenhain", "Heidenhain", language="klartext", corners=("RND", "CHF", "CHF"), metric=True),
    )
}  # fmt: skip


def _re(pattern: str) -> re.Pattern[str]:
    return re.compile(pattern, re.IGNORECASE | re.MULTILINE)


class Sign(NamedTuple):
    """What shows in which dialect a program is.

    Parameters
    ----------
    dialect : str
        Its name.
    pattern : re.Pattern
        That a program has.
    in_comments : bool, optional
        Whether a comment may show it; else comments are not looked at.
    alone : re.Pattern, optional
        What only programs of that kind have, outside of comments: where two kinds show, none is recognized.
    sure : bool, optional
        Whether a program that has it is of no other kind, whatever else it has.
    lines : bool, optional
        Whether lines that have it count as lines of a program, where a file is set apart from other text.
    """

    dialect: str
    pattern: re.Pattern[str]
    in_comments: bool = False
    alone: re.Pattern[str] | None = None
    sure: bool = False
    lines: bool = False


_SIEMENS = _re(
    r"\b[ABC]SPLINE\b|\b(?:PL|PW|SD|CR)[ \t]*=|\b[XYZ][ \t]*=|^[ \t]*;(?:\$PATH|\s*SINUMERIK)|^%_N_"
    r"|\bCYCLE\d+[ \t]*\(|\bG(?:500|505|64[12])\b|\bTRA(?:ORI|FOOF)\b|\b[ABC]3[ \t]*="
    r"|^[ \t]*(?:N\d+[ \t]*)?(?:EXTERN|PROC)[ \t]+[A-Z_]+\d*|\bSUPA\b|\bLIMS[ \t]*="
)
#: What tells a dialect, the first that is found; G6.2 with a method is what LinuxCNC alone has.
SIGNS = (
    Sign("heidenhain", _re(r"^[ \t]*(?:\d+[ \t]+)?BEGIN[ \t]+PGM\b"), sure=True),
    Sign(
        "klipper",
        _re(
            r"^;FLAVOR:\s*Klipper|^[ \t]*(?:START_PRINT|PRINT_START|SET_VELOCITY_LIMIT|SET_PRESSURE_ADVANCE"
            r"|EXCLUDE_OBJECT\w*|BED_MESH_\w+|SET_GCODE_OFFSET|SAVE_GCODE_STATE|SET_RETRACTION"
            r"|SET_KINEMATIC_POSITION)\b"
        ),
        sure=True,
        lines=True,
    ),
    Sign("siemens", _SIEMENS, alone=_SIEMENS, lines=True),
    Sign(
        "grbl",
        _re(r"^[ \t]*\$(?:N?\d+[ \t]*=|J=|[$#GIXCH](?![A-Z0-9]))"),
        alone=_re(r"^[ \t]*\$\d+[ \t]*="),
        lines=True,
    ),
    Sign(
        "linuxcnc",
        _re(
            r"^(?>[^\n]*?\bG0?6\.2\b)[^\n]*Q\s*[123]\b"
            r"|^[ \t]*O(?:<\w+>|\d+)[ \t]*(?:sub|call|if|while|do|repeat)\b"
            r"|\bM6[78][ \t]*E\d|\bM6[2-6][ \t]*P\d|#[ \t]*<\w|\bM0?[345][ \t]*\$[ \t]*-?\d"
        ),
        alone=_re(r"^[ \t]*O(?:<\w+>|\d+)[ \t]*(?:sub|call|if|while|do|repeat)\b|\bM6[78][ \t]*E\d"),
    ),
    Sign("mach3", _re(r"\bmach\s?[23](?![0-9])(?:/[34])?"), in_comments=True),
    Sign("mach4", _re(r"\bmach\s?4(?![0-9])"), in_comments=True),
    Sign("haas", _re(r"\bhaas\b|\bG154[ \t]*P\d|\bG187\b|\bG103[ \t]*P\d"), in_comments=True),
    Sign(
        "fanuc",
        _re(  # a number of four digits, or of fewer where the program begins
            r"^[ \t]*(?:O\d{4,5}|:O?\d+)\b(?![ \t]*[a-z\[#])|\A[%\s]*+O\d{1,3}\b(?![ \t]*[a-z\[#<])"
            r"|^[ \t]*//|\bG0?5\.1\s*Q[013]\b"
            r"|\bG0?5\s*P(?:10000|0)\s*$|\bG0?6\.2\b|\bG43\.[45]\b|\bG234\b|^(?>[^\n]*?\bIF[ \t]*\[)[^\n]*"
            r"\b(?:GOTO|THEN)|^(?>[^\n]*?\bWHILE[ \t]*\[)[^\n]*\][ \t]*DO[ \t]*[123]\b|\bG65[ \t]*P\d"
        ),
        alone=_re(
            r"^[ \t]*(?:O\d{4,5})\b(?![ \t]*[a-z\[#])|^(?>[^\n]*?\bIF[ \t]*\[)[^\n]*\b(?:GOTO|THEN)"
            r"|^(?>[^\n]*?\bWHILE[ \t]*\[)[^\n]*\][ \t]*DO[ \t]*[123]\b|\bG65[ \t]*P\d"
        ),
    ),
    Sign("mach3", _re(r"^[ \t]*M1[01]\s*P[0-3]\b")),
    Sign("grbl", _re(r"\bgrbl\b|\bM0?[34][ \t]*S0\b"), in_comments=True),
    Sign("marlin", _re(r"^;FLAVOR:\s*Marlin")),
    Sign(
        "printer",
        _re(
            r"^;FLAVOR:|^[ \t]*(?:N\d+[ \t]*)?"
            r"(?:G[0123]\b[^;(\nM]*\sE-?[\d.]|G92\s*E|G28\s+[WXYZ]\s*(?:[XYZ]\s*)*$"
            r"|M73\s+[PQR]|M(?:82|83|84|10[4679]|11[57]|140|190|20[1-5]|22[01]|400|486|555|862|900|906)\b)"
        ),
        alone=_re(r"^;FLAVOR:|^[ \t]*G[01]\b[^;(\nM]*\sE-?[\d.]"),
        lines=True,
    ),
    Sign("fanuc", _re(r"^[^(;\n]*+[(;][^\n]*?\bfanuc\b"), in_comments=True),
)
#: What shows a control whose programs are not read: they look like others, and mean something else.
_NOT_READ = {
    "an Okuma OSP": r"^[ \t]*\$[\w.-]+%|^[ \t]*(?:N\w+[ \t]+)?G15[ \t]*H\d|\bVC\d+[ \t]*=|\bCALL[ \t]+O\w",
    "a Centroid": r"\bG65[ \t]*\"|^[ \t]*<PREVENT_LOOK_AHEAD>|^[ \t]*#INCLUDE[ \t]*<|\bM11[56][ \t]*/[XYZAB]"
    r"|^[ \t]*(?:N\d+[ \t]*)?IF[ \t]+#[^\n;\[\]]*\bTHEN\b",
    "a Fadal": r"^[ \t]*#(?:V\d+[ \t]*=|PRINT\b|INPUT\b|IF\b|GOTO\b|:\w)",
    "a Sinumerik 810 to 880": r"^%(?:MPF|SPF)[ \t]*\d",
    "a Heidenhain in DIN/ISO": r"^%[^\s*]+[ \t]+G7[01][ \t]*\*|^[ \t]*N\d+[ \t]+G30[ \t]+G1[789]\b",
    "WinCNC": r"^[ \t]*\[[A-Z]+ [^\]\n=#:]*\][ \t\r]*$",
}
_UNREAD = {name: _re(sign) for name, sign in _NOT_READ.items()}
#: Where G4's P is in s, where a whole P is in ms, and from which P on the dialect has to be known.
IN_SECONDS = tuple(each.name for each in DIALECTS.values() if each.language == "rs274" and each.dwell == 1.0)
IN_MILLISECONDS = tuple(each.name for each in DIALECTS.values() if each.dwell == 1e-3)
UNSURE_FROM = 100.0

#: Klipper's macros, whose values may look like Siemens' words: PARK_AT X=10.
_MACRO = re.compile(r"^[ \t]*(?=\w*_)[A-Z_]\w*[ \t]+\w+=.*", re.IGNORECASE | re.MULTILINE)

#: Comments, but for those that show a dialect, and calls of Siemens' cycles, whose brackets are none.
_COMMENT = re.compile(
    r"(?P<call>\bCYCLE[0-9]+[ \t]*+\()|\([^()\n]*+\)|;(?!\$PATH|\s*SINUMERIK|FLAVOR).*", re.IGNORECASE
)

#: Axis words with a decimal point and without, and how many of these are counted.
_POINTED = re.compile(r"(?<![A-Z#\[])[XYZUVWABCIJKR][-+]?[0-9]*\.", re.IGNORECASE)
_WHOLE = re.compile(r"(?<![A-Z#\[])[XYZUVWABCIJKR]([-+]?[0-9]+)(?![0-9.])", re.IGNORECASE)
#: What makes K of a line a place: arcs and threads; elsewhere it counts the repeats of a cycle.
_WITH_K = re.compile(r"[IJ]|G0?[235](?![0-9])|G33|G76|G6\.2|G87", re.IGNORECASE)
_MOST_WHOLE = 1000

#: A line of a program, for telling one from other text: words, or a comment, or %.
_WORDS = re.compile(r"^[ \t]*+/?\d?\s*+(?:[A-Z]\s*+[-+]?[\d.#\[][-+\d.]*+\s*+)+(?:[;(].*)?$", re.I)
_CODE = re.compile(r"^[ \t]*+/?\s*+(?:N\s*+\d++[ \t]*+)?(?:[GMT]\s*\d|[ABC]SPLINE\b)", re.I)
#: Lines that are looked at to tell whether a file is a program.
_LOOKED_AT = 400


#: How a program ends, and how much of it is looked at.
_END, _TRAILER = re.compile(rb"(?:^|[\r\n])[^\r\n]*(?:%|M0?2|M30|M99)\s*$", re.IGNORECASE), 4096


def named(name: str) -> Dialect:
    """Find a dialect by its name.

    Parameters
    ----------
    name : str
        Of a row of DIALECTS, in any case.

    Returns
    -------
    Dialect
        Of that name.

    Raises
    ------
    InputError
        That lists them.
    """
    try:
        return DIALECTS[name.lower()]
    except (KeyError, AttributeError):
        raise InputError(f"dialect {name!r} is not known; there are {', '.join(DIALECTS)}") from None


def without_leader(content: bytes) -> bytes:
    """The program without the zero bytes before it, as of a punched tape, and behind its end; others are damage."""
    content = content.lstrip(b"\0")
    if content.endswith(b"\0") and _END.search(content[-_TRAILER:].rstrip(b"\0") or content.rstrip(b"\0")):
        return content.rstrip(b"\0")
    return content


def recognized(head: bytes) -> tuple[Dialect, str]:
    """The dialect of a program by its first bytes, and what tells it, with its line; "" where nothing does."""
    sign, place = first_sign(head)
    return DIALECTS["linuxcnc" if sign is None else sign.dialect], place


def first_sign(head: bytes) -> tuple[Sign | None, str]:
    """The first of SIGNS that a program has, and its place; None and "" where it has none."""
    text, code = _text_and_code(head)
    for sign in SIGNS:
        looked_at = text if sign.in_comments else _code_for(sign, code)
        if found := sign.pattern.search(looked_at):
            return sign, _place(looked_at, found)
    return None, ""


def _code_for(sign: Sign, code: str) -> str:
    return _MACRO.sub("", code) if sign.dialect == "siemens" else code


def contradiction(head: bytes) -> str:
    """What a program says that shows two kinds of dialects, with their lines; "" where it shows one or none."""
    _, code = _text_and_code(head)
    if any(sign.sure and sign.pattern.search(code) for sign in SIGNS):
        return ""
    kinds = {
        sign.dialect: _place(code, found)
        for sign in SIGNS
        if sign.alone is not None and (found := sign.alone.search(_code_for(sign, code)))
    }
    said = " and ".join(f"{name} ({place})" for name, place in kinds.items())
    return f"shows {said} at once; name the control (option dialect: {', '.join(kinds)})" if len(kinds) > 1 else ""


def not_read(head: bytes) -> str:
    """What is to be said of a program of a control that is recognized to be refused; "" for others."""
    _, code = _text_and_code(head)
    for name, sign in _UNREAD.items():
        if found := sign.search(code):
            readable = ", ".join(DIALECTS)
            return f"is a program for {name} ({_place(code, found)}), which is not read; post it for one of {readable}"
    return ""


def _text_and_code(head: bytes) -> tuple[str, str]:
    """The text of a program, and the same without comments."""
    text = head_text(head.strip(b"\0"))
    return text, _COMMENT.sub(lambda found: found["call"] or "", text)


def _place(text: str, found: re.Match[str]) -> str:
    """What was found, and in which line."""
    said = found[0].rstrip()
    words = said.rpartition("\n")[2].split()
    return f"{' '.join(words)[:24]!r} in line {text.count(chr(10), 0, found.start() + len(said)) + 1}"


def whole_numbers(text: str) -> tuple[str, list[int], bool]:
    """The first axis word without a decimal point, the lines of them all, and whether others have one."""
    code = re.sub(r"\([^()\n]*\)|;.*", "", text)
    whole = [
        each
        for each in _WHOLE.finditer(code)
        if float(each[1]) and (each[0][0] not in "Kk" or _WITH_K.search(_line_of(code, each.start())))
    ]
    lines = [code.count("\n", 0, each.start()) + 1 for each in whole[:_MOST_WHOLE]]
    return (whole[0][0] if whole else ""), lines, bool(_POINTED.search(code))


def _line_of(text: str, at: int) -> str:
    """The line of a text in which a letter stands."""
    end = text.find("\n", at)
    return text[text.rfind("\n", 0, at) + 1 : end if end >= 0 else len(text)]


def holds(head: bytes) -> bool:
    """Whether `head` looks like a program: words of G-code on most of its lines, and G, M or T among them."""
    head = without_leader(head)
    if b"\0" in head:
        return False
    text = head_text(head)
    lines = [line.strip() for line in text.splitlines()[:_LOOKED_AT]]
    if len(head) >= HEAD_BYTES:  # the last line may be cut
        lines = lines[:-1] or lines
    counted = [line for line in lines if line and line[0] not in "%;(:" and line[:2] != "//"]
    codes = sum(1 for line in counted if _CODE.match(line))
    klartext = any(DIALECTS[sign.dialect].language == "klartext" and sign.pattern.search(text) for sign in SIGNS)
    if klartext or (codes and not_read(head)):
        return True
    others = [sign.pattern for sign in SIGNS if sign.lines]
    words = sum(1 for line in counted if _WORDS.match(line) or any(sign.search(line) for sign in others))
    return codes > 0 and words >= 0.7 * len(counted)
