"""Lines of a table as spreadsheets, scanners and measuring machines write them: numbers, and names of columns."""

from __future__ import annotations

import re

#: What begins a line that does not count.
COMMENTS = ("#", "%", "!", "//")
#: No line of names is longer, characters.
MOST_NAMES = 2000
_EITHER = re.compile(r"\s*,\s*|\s+")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+(?:,\d+)?(?:[eE][+-]?\d+)?", re.ASCII)
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?|[+-]?(?:nan|inf|infinity)", re.IGNORECASE | re.ASCII)
#: What most tables consist of: plain numbers between commas.
_PLAIN = re.compile(r"[+-]?\d+\.\d+(?: ?, ?[+-]?\d+\.\d+)+", re.ASCII)
_UNIT = r"(?:\s*[\[(]\s*(?P<boxed>[^\])]*)\s*[\])]|[\s_/-]+(?P<bare>mm|cm|um|m|in|inch|inches|ft|mil|deg|rad))?"
_PLACE = r"(?:pos|position|coord|coordinate|axis|machine|actual|value)"
_NAME = re.compile(rf"(?:{_PLACE}[\s_.-]*)?(?P<name>[a-z]+?)(?:[\s_.-]*{_PLACE})?{_UNIT}")


def numbers(line: str) -> tuple[list[float], bool] | None:
    """The numbers of a line, and whether commas stand in place of their decimal points; None for anything else."""
    if _PLAIN.fullmatch(line):
        return [float(word) for word in line.split(",")], False
    text = line.strip().rstrip(",;").strip()
    # semicolons or tabs between columns: a comma can only be a decimal point
    if ";" in text or "\t" in text:
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
    return [float(re.sub("[dD]", "e", word)) for word in words], decimal


def names(line: str) -> tuple[list[tuple[str, str]], bool]:
    """Names of columns and their units, "" if not a name, in small letters; and whether marks stand between."""
    if len(line) > MOST_NAMES:
        return [], False
    marked = re.search(r"[,;\t]", line) is not None
    words = re.split(r"\s*[,;\t]\s*", line.strip().rstrip(",;")) if marked else line.split()
    found = [_NAME.fullmatch(word.strip(" \"'").lower()) for word in words]
    return [(m["name"], m["boxed"] or m["bare"] or "") if m else ("", "") for m in found], marked
