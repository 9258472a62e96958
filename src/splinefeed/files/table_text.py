"""Lines of a table as spreadsheets, scanners and measuring machines write them: numbers, and names of columns."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence

from splinefeed import units
from splinefeed.errors import InputError, UnitError
from splinefeed.numbers import MOST
from splinefeed.records import ROTARY_AXES

#: Axes in the order in which a path has them, and what a column of times is called.
AXES = ("x", "y", "z", "a", "b", "c", "theta")
_TIMES = ("t", "time", "zeit")
#: What columns of joints are called, with a number from 1 to 9.
_JOINT = re.compile(r"(?P<name>q|j|joint)[\s_.-]?(?P<number>[1-9])(?![0-9])")
JOINTS = tuple(f"{name}{number}" for name in ("q", "j", "joint") for number in range(1, 10))
#: How a table of setpoints of ours begins.
OURS = "# splinefeed setpoints"
#: What begins a line that does not count.
COMMENTS = ("#", "%", "!", "//")
#: No line of names is longer, nor a name with its unit, characters.
MOST_NAMES, MOST_NAME = 2000, 80
_MARK = re.compile(r"\s*[,;\t]\s*")
_EITHER = re.compile(r"\s*,\s*|\s+")
#: Between names without marks: a unit in brackets belongs to the name before it.
_BLANKS = re.compile(r"(?<!\s)\s++(?![\[(])")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+(?:,\d+)?(?:[eE][+-]?\d+)?", re.ASCII)
_NUMBER = re.compile(
    r"[+-]?(?:\d++\.?\d*+|\.\d++)(?:[eEdD][+-]?\d++)?|[+-]?(?:nan|inf|infinity)", re.IGNORECASE | re.ASCII
)
#: What most tables consist of: plain numbers between commas.
_PLAIN = re.compile(r"[+-]?\d+\.\d+(?: ?, ?[+-]?\d+\.\d+)+", re.ASCII)
_UNIT = r"(?:\s*[\[(]\s*(?P<boxed>[^\])]*)\s*[\])]|[\s_/-]+(?P<bare>[a-z°]+))?"
_PLACE = r"(?:pos|position|coord|coordinate|axis|machine|actual|value|cmd)"
_NAME = re.compile(rf"(?:{_PLACE}[\s_.-]*)?(?P<name>[a-z]+?)(?:[\s_.-]*{_PLACE})?{_UNIT}")


def numbers(line: str) -> tuple[list[float], bool] | None:
    """Read the numbers of a line.

    Parameters
    ----------
    line : str
        Of a table.

    Returns
    -------
    tuple or None
        The numbers, and whether commas stand in place of their decimal points; None for anything else.

    Examples
    --------
    >>> from splinefeed.files import table_text
    >>> table_text.numbers("1,5; 2,25")
    ([1.5, 2.25], True)
    """
    if _PLAIN.fullmatch(line):
        return [_float(word) for word in line.split(",")], False
    text = line.strip().rstrip(",;").strip()
    # semicolons or tabs between columns, or quotes around them: a comma can only be a decimal point
    if '"' in text:
        mark = next((mark for mark in ";\t" if mark in text), ",")
        try:
            words = [word.strip() for word in next(csv.reader([text], delimiter=mark, skipinitialspace=True))]
        except csv.Error:
            return None
        decimal = any("," in word for word in words)
    elif ";" in text or "\t" in text:
        words = [word.strip().rstrip(",") for word in (text.split(";") if ";" in text else text.split("\t")) if word]
        decimal = any("," in word for word in words)
    else:
        words = text.split()
        decimal = len(words) > 1 and "," in text and all(_DECIMAL_COMMA.fullmatch(word) for word in words)
        words = words if decimal else _EITHER.split(text)
    if decimal:
        words = [word.replace(",", ".") if _DECIMAL_COMMA.fullmatch(word) else word for word in words]
    if not all(_NUMBER.fullmatch(word) for word in words):
        return None
    return [_float(re.sub("[dD]", "e", word)) for word in words], decimal


def _float(word: str) -> float:
    """The number that digits say; one beyond all bounds is infinite."""
    value = float(word)
    return math.copysign(math.inf, value) if abs(value) > MOST else value


def names(line: str) -> tuple[list[tuple[str, str]], bool]:
    """Read names of columns and their units from a line.

    Parameters
    ----------
    line : str
        Of a table.

    Returns
    -------
    found : list of tuple
        Name and unit of each column, as `name` gives them.
    marked : bool
        Whether marks stand between them.
    """
    if len(line) > MOST_NAMES:
        return [], False
    return [name(word) for word in words(line)], _MARK.search(line) is not None


def words(line: str) -> list[str]:
    """What stands between marks, or without any between blanks."""
    return _MARK.split(line.strip().rstrip(",;")) if _MARK.search(line) else _BLANKS.split(line.strip())


def name(word: str) -> tuple[str, str]:
    """Read name and unit of a column.

    Parameters
    ----------
    word : str
        Of the line of names.

    Returns
    -------
    tuple of str
        Both in small letters, "" where there is none; times are called t.

    Examples
    --------
    >>> from splinefeed.files import table_text
    >>> table_text.name("Time [ms]"), table_text.name("pos_x (mm)")
    (('t', 'ms'), ('x', 'mm'))
    """
    text = word.strip(" \"'").lower() if len(word) <= MOST_NAME else ""
    if joint := _JOINT.match(text):  # a joint is named by its number, and has a unit as any column has
        unit = _NAME.fullmatch(f"q{text[joint.end() :]}")
        called = f"{joint['name']}{joint['number']}"
        return (called, unit["boxed"] or unit["bare"] or "") if unit else ("", "")
    found = _NAME.fullmatch(text)
    if found is None:
        return "", ""
    return "t" if found["name"] in _TIMES else found["name"], found["boxed"] or found["bare"] or ""


def columns(found: Sequence[tuple[str, str]], wanted: Sequence[str] = AXES) -> dict[str, tuple[int, float]]:
    """Find columns by their names.

    Parameters
    ----------
    found : sequence of tuple
        Names and units of the columns; without a unit, they are in mm, deg and s.
    wanted : sequence of str, optional
        Names to be found.

    Returns
    -------
    dict of str to tuple
        Place of each that is there, and its factor to mm, rad or s.

    Raises
    ------
    InputError
        That names a column that is there twice or has a wrong unit.
    """
    columns: dict[str, tuple[int, float]] = {}
    for k, (name, unit) in enumerate(found):
        if name not in wanted:
            continue
        if name in columns:
            raise InputError(f"two columns are called {name}")
        kind, usual = ("time", "s") if name == "t" else ("angle", "deg") if name in ROTARY_AXES else ("length", "mm")
        if name in JOINTS:  # of a joint that turns rad, unless the column says otherwise
            kind, usual = ("length", "mm") if _is_length(unit) else ("angle", "rad")
        try:
            columns[name] = k, units.parse(f"1{unit or usual}", kind)
        except UnitError as error:
            raise InputError(f"column {name}: {error}") from None
    return columns


def _is_length(unit: str) -> bool:
    """Whether a unit is one of lengths, as that of a joint that slides is."""
    try:
        units.parse(f"1{unit or 'rad'}", "length")
    except UnitError:
        return False
    return True
