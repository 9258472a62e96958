"""A struct of a MATLAB file (level 5, .mat): read here, as libraries end the program over a damaged one.

What the file says of sizes is compared with the bytes that are there before anything is made of it. Fields that nobody
needs are passed over. Source: The MathWorks, "MAT-File Format", chapter 1 (level 5).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Collection
from typing import Any, NamedTuple

import numpy as np

from splinefeed.errors import InputError

#: The head of a file, bytes; its last two say the order of bytes.
_HEAD = 128
#: Types of data: numbers by NumPy's letters, texts by their encoding, a matrix, and packed data.
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {1: "utf-8", 2: "utf-8", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_MATRIX, _PACKED = 14, 15
#: Classes of matrices; the others are numbers.
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FIRST_NUMBER, _LAST_NUMBER = 1, 2, 3, 4, 5, 6, 15
_COMPLEX = 0x800
#: Structs and cells in each other, and entries of all of them together.
MAX_DEPTH, MAX_ENTRIES = 8, 100_000
#: What smooth columns pack to, rounded up generously: what claims to unpack to more holds nothing.
MOST_UNPACKED, NO_HARM_BYTES = 50, 2**26


def read_struct(content: bytes, name: str, wanted: Collection[str]) -> dict[str, Any]:
    """The fields `wanted` of the struct `name` in the bytes of a file, those that are there.

    Numbers are arrays as MATLAB has them, with two dimensions at least; texts of one row are str, cells are lists, and
    structs of one element are dicts of all their fields. Raises InputError for anything else, and for a file that is
    damaged.
    """
    if len(content) < _HEAD or content[_HEAD - 2 : _HEAD] not in (b"IM", b"MI"):
        raise InputError("is no MATLAB file of level 5 (save -v7)")
    order = "<" if content[_HEAD - 2 : _HEAD] == b"IM" else ">"
    reader = _MatReader(order, wanted, MOST_UNPACKED * len(content) + NO_HARM_BYTES)
    try:
        return reader.find(content[_HEAD:], name)
    except (struct.error, ValueError, UnicodeDecodeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError("is damaged: an element ends before its data") from None


class _MatElement(NamedTuple):
    """A piece of data, its type, and where the next one begins."""

    kind: int
    data: memoryview
    end: int


class _MatReader:
    """Reads elements in an order of bytes; `left` bytes may be unpacked."""

    def __init__(self, order: str, wanted: Collection[str], left: int) -> None:
        self.order, self.wanted, self.left = order, wanted, left
        self.entries = 0

    def find(self, content: bytes, name: str) -> dict[str, Any]:
        at, view = 0, memoryview(content)
        while at + 8 <= len(view):
            element = self._element(view, at)
            at = element.end
            data, kind = element.data, element.kind
            if kind == _PACKED:
                inner = self._element(memoryview(self._unpacked(data)), 0)
                data, kind = inner.data, inner.kind
            if kind == _MATRIX and self._parts(data)[2] == name:
                found = self._matrix(data, 0, chosen=True)
                if not isinstance(found, dict):
                    raise InputError(f"{name} is no struct")
                return found
        raise InputError(f"has no struct {name}; was this written by splinefeed?")

    def _unpacked(self, data: memoryview) -> bytes:
        packed = zlib.decompressobj()
        try:
            found = packed.decompress(data, self.left)
        except zlib.error as error:
            raise InputError(f"is damaged: {error}") from None
        self.left -= len(found)
        if packed.unconsumed_tail or self.left <= 0:
            raise InputError("unpacks to far more than it packs; it is damaged")
        return found

    def _element(self, view: memoryview, at: int) -> _MatElement:
        """The element at a place; a small one has its data within its head."""
        head, size = struct.unpack_from(f"{self.order}II", view, at)
        if head >> 16:
            size, begin = head >> 16, at + 4
            end = at + 8
            if size > 4:
                raise InputError("is damaged: a small element has more than 4 bytes")
            head &= 0xFFFF
        else:
            begin = at + 8
            # elements begin at multiples of 8 bytes, but for packed ones
            end = begin + size + (0 if head == _PACKED else -size % 8)
        if begin + size > len(view):
            raise InputError("is damaged: an element ends before its data")
        return _MatElement(head, view[begin : begin + size], end)

    def _parts(self, data: memoryview) -> tuple[int, tuple[int, ...], str, int]:
        """Class, dimensions, name of a matrix, and where its own data begins; checked against MAX_ENTRIES later."""
        flags = self._element(data, 0)
        shape = self._element(data, flags.end)
        label = self._element(data, shape.end)
        (what,) = struct.unpack_from(f"{self.order}I", flags.data)
        if what & _COMPLEX:
            raise InputError("holds complex numbers")
        sizes = tuple(int(each) for each in np.frombuffer(shape.data, f"{self.order}i4"))
        if shape.kind != 5 or not 2 <= len(sizes) <= 3 or min(sizes) < 0:
            raise InputError("is damaged: a matrix has no dimensions")
        return what & 0xFF, sizes, bytes(label.data).decode("ascii"), label.end

    def _count(self, sizes: tuple[int, ...]) -> int:
        """How many entries there are, each of which costs a step."""
        count = 1
        for each in sizes:
            count *= each
        self.entries += count
        if self.entries > MAX_ENTRIES:
            raise InputError(f"has more than {MAX_ENTRIES} cells and structs")
        return count

    def _matrix(self, data: memoryview, depth: int, *, chosen: bool = False) -> Any:
        if depth > MAX_DEPTH:
            raise InputError(f"has structs that are nested more than {MAX_DEPTH} deep")
        if not len(data):  # MATLAB's own way to say []
            return np.zeros((0, 0))
        kind, sizes, _, at = self._parts(data)
        if kind == _CELL:
            cells = []
            for _ in range(self._count(sizes)):
                element = self._matrix_at(data, at)
                cells.append(self._matrix(element.data, depth + 1))
                at = element.end
            return cells
        if kind == _STRUCT:
            if self._count(sizes) != 1:
                raise InputError("holds a list of structs; one is expected")
            return self._struct(data, at, depth, chosen)
        if kind == _CHAR:
            return self._text(self._element(data, at), sizes)
        if not _FIRST_NUMBER <= kind <= _LAST_NUMBER:
            raise InputError("holds something that is neither numbers nor texts")
        return self._numbers(self._element(data, at), sizes)

    def _matrix_at(self, data: memoryview, at: int) -> _MatElement:
        element = self._element(data, at)
        if element.kind != _MATRIX:
            raise InputError("is damaged: a matrix is missing")
        return element

    def _struct(self, data: memoryview, at: int, depth: int, chosen: bool) -> dict[str, Any]:
        width = self._element(data, at)
        names = self._element(data, width.end)
        (length,) = struct.unpack_from(f"{self.order}i", width.data)
        if not 1 <= length <= 64 or len(names.data) % length:
            raise InputError("is damaged: a struct has no names of fields")
        text, at = bytes(names.data), names.end
        self._count((len(text) // length,))
        found: dict[str, Any] = {}
        for start in range(0, len(text), length):
            name = text[start : start + length].split(b"\0")[0].decode("ascii")
            element = self._matrix_at(data, at)
            at = element.end
            if not chosen or name in self.wanted:
                found[name] = self._matrix(element.data, depth + 1)
        return found

    def _text(self, element: _MatElement, sizes: tuple[int, ...]) -> str:
        if element.kind not in _TEXTS:
            raise InputError("is damaged: a text is no text")
        way = _TEXTS[element.kind]
        text = bytes(element.data).decode(way if way == "utf-8" else f"{way}-{'le' if self.order == '<' else 'be'}")
        if len(sizes) != 2 or (text and sizes[0] > 1):
            raise InputError("holds a text of several rows")
        return text

    def _numbers(self, element: _MatElement, sizes: tuple[int, ...]) -> Any:
        if element.kind not in _NUMBERS:
            raise InputError("is damaged: numbers are of no kind that there is")
        values = np.frombuffer(element.data, self.order + _NUMBERS[element.kind])
        return values.reshape(sizes, order="F")
