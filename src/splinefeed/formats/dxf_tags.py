"""The tags of a DXF file, text or binary: group codes and values, cut into sections and entities.

A file is a list of pairs: a group code that says what follows, and a value. Code 0 begins something: a section, an
entity, a block, the end of one. Source: Autodesk, DXF Reference (AutoCAD 2012), chapters 1, 2 and 11.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass

from splinefeed.errors import FormatError

BINARY_MARK = b"AutoCAD Binary DXF\r\n\x1a\x00"
#: Most tags in one file; a drawing of a hundred thousand entities has about three million.
MAX_TAGS = 20_000_000

#: Value types of binary DXF by group code, first and last code of each range.
_TYPES = (
    (0, 9, "s"), (10, 59, "d"), (60, 79, "h"), (90, 99, "i"), (100, 109, "s"), (110, 149, "d"), (160, 169, "q"),
    (170, 179, "h"), (210, 239, "d"), (270, 289, "h"), (290, 299, "?"), (300, 309, "s"), (310, 319, "b"),
    (320, 369, "s"), (370, 389, "h"), (390, 399, "s"), (400, 409, "h"), (410, 419, "s"), (420, 429, "i"),
    (430, 439, "s"), (440, 459, "i"), (460, 469, "d"), (470, 481, "s"), (999, 1003, "s"), (1004, 1004, "b"),
    (1005, 1009, "s"), (1010, 1059, "d"), (1060, 1070, "h"), (1071, 1071, "i"),
)  # fmt: skip
#: What Python takes for a number and DXF does not: 1_0, and digits of other scripts.
_ODD_NUMBER = re.compile(r"[0-9]_[0-9]|(?![0-9])\d")
_KIND = {code: kind for low, high, kind in _TYPES for code in range(low, high + 1)}
_FIXED = {"d": struct.Struct("<d"), "h": struct.Struct("<h"), "i": struct.Struct("<i"), "q": struct.Struct("<q")}


@dataclass(frozen=True)
class Entity:
    """What one code 0 begins: its type, and the range of its tags behind that."""

    kind: str
    low: int
    high: int


@dataclass
class Tags:
    """Group codes and values of a whole file; values are text, in a binary file numbers where the code says so."""

    source: str
    codes: list[int]
    values: list[str | float]
    binary: bool
    odd: bool = False  # whether there is a text such as 1_0, which Python takes for a number

    def place(self, index: int) -> str:
        """Where tag `index` stands, for a message."""
        return f"tag {index + 1}" if self.binary else f"line {2 * index + 1}"

    def error(self, index: int, text: str) -> FormatError:
        """A FormatError that names the file and the place of tag `index`."""
        return FormatError(f"{self.source}: {self.place(min(index, len(self.codes) - 1))}: {text}")

    def text(self, index: int) -> str:
        """The value of tag `index` as text without blanks around it."""
        return str(self.values[index]).strip()


def read_tags(content: bytes, source: str) -> Tags:
    """All tags of a file; FormatError for what is no DXF."""
    if content.startswith(BINARY_MARK):
        return _binary(content, source)
    if b"\0" in content:
        raise FormatError(f"{source}: byte {content.index(0)}: is binary; expected a text or binary DXF drawing")
    text = _decoded(content)
    if "\n" not in text:
        text = text.replace("\r", "\n")  # as on old Macs
    lines = text.split("\n")
    while lines and not lines[-1].strip():
        lines.pop()
    if len(lines) > 2 * MAX_TAGS:
        raise FormatError(f"{source}: has more than {MAX_TAGS} tags; that is no drawing for a tool path")
    try:
        codes = list(map(int, lines[0::2]))
    except ValueError:
        number, line = next((2 * i + 1, line) for i, line in enumerate(lines[0::2]) if not _is_code(line))
        raise FormatError(f"{source}: line {number}: expected a group code, got {line.strip()[:40]!r}") from None
    values: list[str | float] = [line.rstrip("\r") for line in lines[1::2]]
    if len(values) < len(codes):
        if not (codes[-1] == 0 or len(codes) < 2):
            raise FormatError(f"{source}: line {len(lines)}: a group code without a value; is the file complete?")
        codes.pop()
    return Tags(source, codes, values, binary=False, odd=_odd(text))


def _odd(text: str) -> bool:
    return ("_" in text or not text.isascii()) and _ODD_NUMBER.search(text) is not None


def _is_code(line: str) -> bool:
    try:
        int(line)
    except ValueError:
        return False
    return True


def _decoded(content: bytes) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        pass
    head = content[:20_000]
    at = head.find(b"ANSI_")
    page = head[at + 5 : at + 9].strip().decode("ascii", "ignore") if at >= 0 else ""
    try:
        return content.decode(f"cp{page}" if page.isdigit() else "cp1252")
    except (LookupError, UnicodeDecodeError):
        return content.decode("latin-1")


def _binary(content: bytes, source: str) -> Tags:
    """The tags of a binary file: codes of one byte in R12 (255 announces two), of two bytes later."""
    at, end = len(BINARY_MARK), len(content)
    wide = content[at : at + 3] == b"\0\0S"
    codes: list[int] = []
    values: list[str | float] = []
    try:
        while at < end:
            if wide:
                code = content[at] | content[at + 1] << 8
                at += 2
            else:
                code = content[at]
                at += 1
                if code == 255:
                    code = content[at] | content[at + 1] << 8
                    at += 2
            kind = _KIND.get(code)
            if kind is None:
                raise FormatError(f"{source}: byte {at}: {code} is no group code of DXF; is the file damaged?")
            if kind == "s":
                stop = content.index(0, at)
                values.append(content[at:stop].decode("utf-8", "replace"))
                at = stop + 1
            elif kind == "b":
                values.append("")
                at += 1 + content[at]
            elif kind == "?":
                values.append(content[at])
                at += 1
            else:
                form = _FIXED[kind]
                values.append(form.unpack_from(content, at)[0])
                at += form.size
            codes.append(code)
            if len(codes) > MAX_TAGS:
                raise FormatError(f"{source}: has more than {MAX_TAGS} tags; that is no drawing for a tool path")
            if code == 0 and values[-1] == "EOF":
                break
    except (IndexError, ValueError, struct.error) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"{source}: byte {at}: ends inside a tag; is the file complete?") from None
    return Tags(source, codes, values, binary=True)


@dataclass
class Sections:
    """Entities of each section by its name, whether the file ends as it should, and the section it is cut in."""

    header: dict[str, int]
    entities: dict[str, list[Entity]]
    complete: bool = False
    open_section: str = ""


def sections(tags: Tags) -> Sections:
    """The sections of a file; strict about what begins and ends where, but not about a file that stops early."""
    starts = [i for i, code in enumerate(tags.codes) if code == 0]
    starts.append(len(tags.codes))
    found = Sections({}, {})
    name = ""
    inside: list[Entity] | None = None
    for k in range(len(starts) - 1):
        low, high = starts[k], starts[k + 1]
        kind = tags.text(low)
        if kind == "SECTION":
            if inside is not None:
                raise tags.error(low, f"a section begins inside section {name}; its ENDSEC is missing")
            if high - low < 2 or tags.codes[low + 1] != 2:
                raise tags.error(low, "a section without a name; is the file complete?")
            name = tags.text(low + 1).upper()
            inside = found.entities.setdefault(name, [])
            if name == "HEADER":
                found.header = {tags.text(i): i + 1 for i in range(low + 2, high - 1) if tags.codes[i] == 9}
        elif kind == "ENDSEC":
            inside = None
        elif kind == "EOF":
            found.complete = inside is None
            break
        elif inside is not None:
            inside.append(Entity(kind, low + 1, high))
        else:
            raise tags.error(low, f"expected a section, got {kind[:40]!r}")
    found.open_section = name if inside is not None else ""
    return found


def fields(tags: Tags, entity: Entity) -> dict[int, str | float]:
    """Value by group code; of a code that stands twice the last one."""
    return dict(zip(tags.codes[entity.low : entity.high], tags.values[entity.low : entity.high], strict=True))
