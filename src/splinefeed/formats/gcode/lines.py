"""The lines that most programs consist of, many at once: bytes to words by arrays, words to moves by arrays.

What depends on the line before, position, motion and feed, is the last one said or a running sum. A line with anything
else in it is left to the interpreter, which knows all of the language and writes the same rows; see `layout`.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.layout import (
    CENTRES,
    DONE,
    EXACT_STOP,
    EXTRUDED,
    EXTRUDER,
    FEED_MODE,
    FULL,
    INVERSE,
    LARGEST,
    LINE,
    MAX_LINE,
    MOTION,
    OFFSET,
    PER_TURN,
    PLANE,
    POSITION,
    RELATIVE,
    SCALE,
    SURFACE,
    UNITS,
    UNKNOWN,
)
from splinefeed.records import Array, BoolArray, IntArray

Bytes = NDArray[np.uint8]

#: Most M codes of one line here, 3 to 9 each: the next digit would do, but lines of people have one or two.
_MOST_M = 4
#: Longest number that is read by arrays, characters: its digits, and the point as one more, are exact in float64.
_WIDTH = 15
#: Lines looked at together at first, behind a line for the interpreter, and at most.
_FIRST, _MOST = 512, 16384
#: Kinds of characters; a comment becomes one MARK and blanks.
_OTHER, _LETTER, _DIGIT, _POINT, _SIGN, _BLANK, _MARK, _END = range(8)
_KINDS = np.zeros(256, dtype=np.uint8)
for _characters, _kind in (
    (b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz", _LETTER),
    (b"0123456789", _DIGIT),
    (b".", _POINT),
    (b"+-", _SIGN),
    (b" \t", _BLANK),
    (b"\r\x01", _MARK),
    (b"\n", _END),
):
    _KINDS[list(_characters)] = _kind
#: Which kind may follow which: 1 always, 2 if a letter stands before the blanks.
_FOLLOWS = np.zeros((8, 8), dtype=np.uint8)
for _kind, _next in (
    (_LETTER, (_DIGIT, _POINT, _SIGN, _BLANK)),
    (_DIGIT, (_DIGIT, _POINT, _LETTER, _BLANK, _MARK, _END)),
    (_POINT, (_DIGIT, _POINT, _LETTER, _BLANK, _MARK, _END)),
    (_SIGN, (_DIGIT, _POINT)),
    (_BLANK, (_LETTER, _BLANK, _MARK, _END)),
    (_MARK, (_LETTER, _BLANK, _MARK, _END)),
    (_END, (_LETTER, _BLANK, _MARK, _END)),
):
    _FOLLOWS[_kind, list(_next)] = 1
_FOLLOWS[_BLANK, [_DIGIT, _POINT, _SIGN]] = 2
#: A byte 1 in each byte; the last n bytes of 8, (9,); powers of ten that are exact.
_ONES = np.uint64(0x0101010101010101)
_KEPT = np.array([[0xFF * (n > 7 - k) for k in range(8)] for n in range(9)], dtype=np.uint8).view("<u8").ravel()
_POWERS = 10.0 ** np.arange(23)
#: Eight digits, the first in the lowest byte, to a number: pairs, then fours, then all. Factor, shift, mask behind it.
_STEPS = (
    (np.uint64(10 * 2**8 + 1), np.uint64(8), np.uint64(0x00FF00FF00FF00FF)),
    (np.uint64(100 * 2**16 + 1), np.uint64(16), np.uint64(0x0000FFFF0000FFFF)),
    (np.uint64(10000 * 2**32 + 1), np.uint64(32), np.uint64(0x00000000FFFFFFFF)),
)
_COMMENT = re.compile(rb"\([^)\n]*\)?|;[^\n]*")
#: Axis of each letter: x y z a b c u v w are 0 to 8.
_AXES = dict(zip("XYZABCUVW", range(9), strict=True))
_WORDS = "XYZABCUVWIJKFRPST"


def _blanked(found: re.Match[bytes]) -> bytes:
    """Blanks for a comment; one that is not closed stays as it is, so that its line is not known."""
    text = found[0]
    return b"\x01" + b" " * (len(text) - 1) if text[:1] == b";" or text[-1:] == b")" else text


class Lines:
    """A block of whole lines (the last byte is a line feed), taken apart into words once."""

    def __init__(self, block: bytes) -> None:
        if b"\x01" in block:
            block = block.replace(b"\x01", b"\x02")
        if b"(" in block or b";" in block:
            block = _COMMENT.sub(_blanked, block)
        data = np.frombuffer(block, dtype=np.uint8)
        kinds = _KINDS[data]
        ends = np.flatnonzero(kinds == _END)
        self.begins: IntArray = np.concatenate([[0], ends + 1])
        count = self.count = len(ends)
        self._known: BoolArray = np.diff(self.begins) <= MAX_LINE
        self._mark(_misplaced(kinds))
        letters, begins, behind = self._words(kinds)
        lines = self._line_of(letters, ends)
        values, right, signed = _numbers(data, begins, behind)
        self._known[lines[~right]] = False
        codes = (data[letters] & 0xDF).astype(np.uint8)
        self.extruded, self.values = np.zeros(count, dtype=bool), dict[str, Array]()
        self.given: dict[str, BoolArray] = {}
        for code in np.flatnonzero(np.bincount(codes, minlength=1)).tolist():
            at = np.flatnonzero(codes == code)
            self._take(chr(code), lines[at], values[at], signed[at])

    def _mark(self, places: IntArray) -> None:
        """The lines in which bytes are misplaced are not known."""
        self._known[np.searchsorted(self.begins, places, side="right") - 1] = False

    def _words(self, kinds: Bytes) -> tuple[IntArray, IntArray, IntArray]:
        """Of the words of known lines: places of the letter, and where the number begins and ends behind it."""
        in_number = (kinds >= _DIGIT) & (kinds <= _SIGN)
        edges = np.flatnonzero(in_number[1:] != in_number[:-1]) + 1
        if len(in_number) and in_number[0]:
            edges = np.concatenate([[0], edges])
        letters, begins, behind = np.flatnonzero(kinds == _LETTER), edges[::2], edges[1::2]
        places = self.begins[1:]
        many, numbers = (np.diff(np.searchsorted(each, places), prepend=0) for each in (letters, begins))
        self._known &= many == numbers
        return (
            letters[np.repeat(self._known, many)],
            begins[np.repeat(self._known, numbers)],
            behind[np.repeat(self._known, numbers)],
        )

    def _line_of(self, places: IntArray, ends: IntArray) -> IntArray:
        """Line of each of the places, in order."""
        lines: IntArray = np.repeat(np.arange(self.count), np.diff(np.searchsorted(places, ends), prepend=0))
        return lines

    def _take(self, letter: str, lines: IntArray, values: Array, signed: BoolArray) -> None:
        """The words of one letter in lines (n,), in order."""
        again = lines[1:][lines[1:] == lines[:-1]]
        if letter == "N":
            self._known[lines[signed]] = False
        elif letter == "G":
            self._take_g(lines, values)
        elif letter == "M":
            self._take_m(lines, values)
        elif letter == "E":
            self.extruded[lines] = True
            self._known[again] = False
        elif letter in _WORDS:
            self._known[again] = False
            self.values[letter], self.given[letter] = np.zeros(self.count), np.zeros(self.count, dtype=bool)
            self.values[letter][lines], self.given[letter][lines] = values, True
        else:
            self._known[lines] = False

    def _take_g(self, lines: IntArray, values: Array) -> None:
        """G: what moves, (count,), -1 for none, and those that say again how things are, once known what is."""
        moves = (values == 0.0) | (values == 1.0) | (values == 2.0) | (values == 3.0)
        self._motion = np.full(self.count, -1, dtype=np.int64)
        self._motion[lines[moves]] = values[moves].astype(np.int64)
        self._twice(lines[moves])
        self._modal = lines[~moves], values[~moves]

    def _take_m(self, lines: IntArray, values: Array) -> None:
        """M3 to M9, a digit each, in their order; those that exclude each other are not known."""
        self._known[lines[(values < 3.0) | (values > 9.0) | (values != np.floor(values))]] = False
        first = np.searchsorted(lines, lines)
        rank = np.arange(len(lines)) - first
        self._known[lines[rank >= _MOST_M]] = False
        self._twice(lines[(values <= 5.0)])
        self._twice(lines[values == 6.0])
        codes = np.zeros(self.count, dtype=np.int64)
        for k in range(min(int(rank.max(initial=-1)) + 1, _MOST_M)):
            at = rank == k
            codes[lines[at]] = 10 * codes[lines[at]] + np.clip(values[at], 0.0, 9.0).astype(np.int64)
        self._outputs = codes

    def _twice(self, lines: IntArray) -> None:
        """Lines (n,) in order that are there twice are not known."""
        self._known[lines[1:][lines[1:] == lines[:-1]]] = False

    _motion: IntArray | None = None
    _outputs: IntArray | None = None
    _modal: tuple[IntArray, Array] | None = None

    def scan(
        self,
        start: int,
        state: Array,
        modes: IntArray,
        rows: Array,
        marks: IntArray,
        count: int,
        said: IntArray,
        spoken: Array,
    ) -> tuple[int, int, int, int]:
        """Read lines from the byte `start` on, the beginning of one, until one is not known here.

        state (29,), modes (10,) are read and kept up to date; moves are written to rows (n, 16) and marks (n, 6) from
        `count` on, what M, S and T say between them to said (m, 4) and spoken (m, 2) from 0 on. Returns where it
        stopped (the beginning of a line), the count of moves, that of what is said, and DONE, UNKNOWN or FULL.
        """
        line, heard, size = int(np.searchsorted(self.begins, start)), 0, _FIRST
        while line < self.count:
            if count >= len(rows) or heard >= len(said):
                return int(self.begins[line]), count, heard, FULL
            part = slice(line, min(line + size, self.count))
            wanted = part.stop - line
            known = self._known[part] & self._said_again(part, modes)
            if not modes[EXTRUDER]:
                known &= ~self.extruded[part]
            with np.errstate(all="ignore"):  # behind a line that is not known anything may come
                some = _Part(self, part, known, state, modes)
            done, count, heard, full = some.write(rows, marks, count, said, spoken, heard)
            if self.extruded[line : line + done].any():
                modes[EXTRUDED] = 1
            line += done
            if done < wanted and not full:
                return int(self.begins[line]), count, heard, UNKNOWN
            size = min(8 * size, _MOST)
        return int(self.begins[-1]), count, heard, DONE

    def _said_again(self, part: slice, modes: IntArray) -> BoolArray:
        """Lines of a part whose G codes, but those that move, only say how things are."""
        known = np.ones(part.stop - part.start, dtype=bool)
        if self._modal is None:
            return known
        here = slice(*np.searchsorted(self._modal[0], [part.start, part.stop]).tolist())
        lines, values = self._modal[0][here] - part.start, self._modal[1][here]
        there = np.zeros(len(lines), dtype=bool)
        for value in (
            float(modes[PLANE]),
            91.0 if modes[RELATIVE] else 90.0,
            (94.0, 93.0, 95.0, 95.0)[modes[FEED_MODE]],
            float(modes[UNITS]),
        ):
            same = values == value
            there |= same
            again = lines[same]
            known[again[1:][again[1:] == again[:-1]]] = False
        known[lines[~there]] = False
        return known


def _misplaced(kinds: Bytes) -> IntArray:
    """Places of bytes that may not follow the one before them."""
    pairs = np.empty(len(kinds), dtype=np.uint8)
    pairs[:1] = 8 * _END
    pairs[1:] = kinds[:-1] << 3
    pairs += kinds
    allowed = _FOLLOWS.ravel()[pairs]
    odd = np.flatnonzero(allowed != 1)
    if not len(odd):
        return odd
    behind_blanks = odd[allowed[odd] == 2]
    wrong: IntArray = odd[allowed[odd] == 0]
    if len(behind_blanks):  # right only if the blanks stand between a letter and its number
        solid = np.maximum.accumulate(np.where(kinds != _BLANK, np.arange(len(kinds)), -1))
        before = solid[behind_blanks - 1]
        wrong = np.concatenate([wrong, behind_blanks[(before < 0) | (kinds[before] != _LETTER)]])
    return wrong


def _numbers(data: Bytes, begins: IntArray, behind: IntArray) -> tuple[Array, BoolArray, BoolArray]:
    """The nearest floats (n,) to the numbers at data[begins : behind], which are plain ones, and which have a sign.

    The last 8 or 16 bytes of each as one word or two, the point and the sign as digits 0: an integer below 2^53. With f
    digits behind the point it is h 10^(f+1) + l, exactly, and (h 10^f + l) / 10^f is rounded once. Longer ones one by
    one.
    """
    length, first = behind - begins, data[begins]
    words = 1 if length.max(initial=0) <= 8 else 2
    padded = np.concatenate([np.zeros(8 * words, dtype=np.uint8), data])
    windows = np.lib.stride_tricks.sliding_window_view(padded, 8 * words)[behind].view("<u8")
    whole, points, place = np.zeros(len(length)), np.zeros(len(length), dtype=np.uint8), np.zeros(len(length), np.uint8)
    for k in range(words):
        behind_it = 8 * (words - 1 - k)
        text = windows[:, k] & _KEPT[np.clip(length - behind_it, 0, 8)]
        four = text >> 4
        point = text >> 5  # of the characters that are there only 0x2e has bit 5, not bit 4, not bit 0
        point &= ~(four | text)
        point &= _ONES
        four &= _ONES  # digits are 0x30 to 0x39
        four *= np.uint64(15)
        text &= four
        for factor, bits, mask in _STEPS:  # neighbours become one number of twice the digits
            text *= factor
            text >>= bits
            text &= mask
        whole *= 1e8
        whole += text
        here = np.bitwise_count(point)
        points += here
        place += here * (np.uint8(7 + behind_it) - np.bitwise_count(point - np.uint64(1)) // 8)
    one = points == 1
    power = _POWERS[np.where(one, place, 0)]
    high = np.floor(whole / (10.0 * power))
    value = np.where(one, (whole - 9.0 * high * power) / power, whole)
    signed = (first == 43) | (first == 45)
    np.negative(value, out=value, where=first == 45)
    right = (points <= 1) & (length > points + signed)
    for k in np.flatnonzero(length - signed > _WIDTH).tolist():
        try:
            value[k], right[k] = float(data[begins[k] : behind[k]].tobytes()), True
        except ValueError:
            right[k] = False
    return value, right, signed


class _Part:
    """Some lines in a row, with the modes that hold before the first: which are known, and what they mean."""

    def __init__(self, lines: Lines, part: slice, known: BoolArray, state: Array, modes: IntArray) -> None:
        self.size = part.stop - part.start
        self._lines, self._part, self._state, self._modes = lines, part, state, modes
        known = known.copy()
        motion = self._column(lines._motion, -1)
        self.motion = motion
        self.mode = _last(motion >= 0, motion, int(modes[MOTION]))
        self.axes = {letter: axis for letter, axis in _AXES.items() if self._has(letter).any()}
        self.bits = np.zeros(self.size, dtype=np.int64)
        for letter, axis in self.axes.items():
            self.bits |= self._has(letter).astype(np.int64) << axis
        across = 1 << layout.ACROSS[int(modes[PLANE])]
        self.centre = np.zeros(self.size, dtype=np.int64)
        for k, letter in enumerate("IJK"):
            self.centre |= self._has(letter).astype(np.int64) << k
        turning, any_centre = self.mode >= 2, self.centre != 0
        self.moves = (self.bits != 0) | (turning & any_centre)
        radius, turns, feed = self._has("R"), self._has("P"), self._has("F")
        self.outputs = self._column(lines._outputs, 0)
        rate = self._value("F")
        known &= ~feed | ((rate >= 0.0) & (rate <= LARGEST))
        arcs = any_centre | radius | turns
        known &= ~arcs | ~(~self.moves | ((self.outputs != 0) & (motion < 0)))
        known &= ~self.moves | ((self.mode >= 0) & (self.mode <= 3) & (turning | ~arcs))
        if turning.any() and arcs.any():
            self.centre[turning & (self.centre & across != 0) & (self._value("IJK"[across // 2]) == 0.0)] &= ~across
        wrong = ((self.centre != 0) == radius) | (self.centre & across != 0)
        if modes[CENTRES]:
            wrong |= (self.centre != 0) & (self.centre | across != 7)
        number = self._value("P")
        wrong |= turns & ~((number >= 1.0) & (number == np.floor(number)) & (number <= 1e3))
        known &= ~(self.moves & turning & wrong)
        if modes[FEED_MODE] == INVERSE:
            known &= ~(self.moves & (self.mode > 0) & ~feed)
        if modes[FEED_MODE] >= PER_TURN:  # the feed goes with the spindle's speed, and with G96 with the place
            known &= ~(feed | self._has("S"))
            if modes[FEED_MODE] == SURFACE or not state[layout.FEED]:
                known &= ~self.moves
        self.ends: dict[int, Array] = {}
        for letter, axis in self.axes.items():
            has, there = self._has(letter), self._value(letter) * state[SCALE + axis]
            if modes[RELATIVE]:
                self.ends[axis] = np.cumsum(np.append(state[POSITION + axis], np.where(has, there, 0.0)))[1:]
            else:
                self.ends[axis] = _last(has, state[OFFSET + axis] + there, float(state[POSITION + axis]))
            known &= ~has | (np.abs(self.ends[axis]) <= LARGEST)
        self.centres: dict[int, Array] = {}
        for k, letter in enumerate("IJK"):
            if self._has(letter).any():
                base = state[OFFSET + k] if modes[CENTRES] else 0.0
                self.centres[k] = base + self._value(letter) * state[SCALE + k]
                known &= ~(self.moves & (self.centre >> k & 1 != 0)) | (np.abs(self.centres[k]) <= LARGEST)
        self.radius = self._value("R") * state[SCALE]
        known &= ~(self.moves & radius) | (np.abs(self.radius) <= LARGEST)
        self.known = self.size if known.all() else int(np.argmin(known))

    def _column(self, values: IntArray | None, empty: int) -> IntArray:
        return np.full(self.size, empty, dtype=np.int64) if values is None else values[self._part]

    def _has(self, letter: str) -> BoolArray:
        has = self._lines.given.get(letter)
        return np.zeros(self.size, dtype=bool) if has is None else has[self._part]

    def _value(self, letter: str) -> Array:
        values = self._lines.values.get(letter)
        return np.zeros(self.size) if values is None else values[self._part]

    def write(
        self, rows: Array, marks: IntArray, count: int, said: IntArray, spoken: Array, heard: int
    ) -> tuple[int, int, int, bool]:
        """Write what the known lines mean; lines done, moves, what is said, and whether there was no room."""
        speaks = (self.outputs != 0) | self._has("S") | self._has("T")
        before, heard_before = (np.cumsum(each) - each for each in (self.moves, speaks))
        fits = (before < len(rows) - count) & (heard_before < len(said) - heard)
        room = self.size if fits.all() else int(np.argmin(fits))
        done = min(self.known, room)
        if not done:
            return 0, count, heard, room <= self.known
        state, modes, first_line = self._state, self._modes, int(self._modes[LINE]) + 1
        modes[LINE] += done
        at = np.flatnonzero(self.moves[:done])
        spoke = np.flatnonzero(speaks[:done])
        here = slice(heard, heard + len(spoke))
        said[here, layout.SAID_BEFORE] = count + before[spoke]
        said[here, layout.SAID_LINE] = first_line + spoke
        said[here, layout.SAID_M] = self.outputs[spoke]
        said[here, layout.SAID_WORDS] = self._has("S")[spoke] + 2 * self._has("T")[spoke]
        spoken[here, layout.SAID_S], spoken[here, layout.SAID_T] = self._value("S")[spoke], self._value("T")[spoke]
        feed = self._feed()
        self._write_moves(at, feed, first_line, rows[count : count + len(at)], marks[count : count + len(at)])
        modes[MOTION], state[layout.FEED] = self.mode[done - 1], feed[done - 1]
        for axis, ends in self.ends.items():
            state[POSITION + axis] = ends[done - 1]
        return done, count + len(at), heard + len(spoke), room <= self.known and done < self.size

    def _feed(self) -> Array:
        """The feed that holds behind each line, (n,), mm/min."""
        feed = float(self._state[layout.FEED])
        if self._modes[FEED_MODE] == INVERSE or not self._has("F").any():
            return np.full(self.size, feed)
        return _last(self._has("F"), self._value("F") * self._state[SCALE], feed)

    def _write_moves(self, at: IntArray, feed: Array, first_line: int, rows: Array, marks: IntArray) -> None:
        """The rows of the moves in lines `at` (n,): rows (n, 16) and marks (n, 6)."""
        state, modes, mode, centre = self._state, self._modes, self.mode[at], self.centre[at]
        for axis in range(9):
            rows[:, layout.END + axis] = self.ends[axis][at] if axis in self.ends else state[POSITION + axis]
        for k in range(3):
            rows[:, layout.CENTER + k] = (
                np.where(centre >> k & 1 != 0, self.centres[k][at], 0.0) if k in self.centres else 0.0
            )
        radius, turns = self._has("R")[at], self._has("P")[at]
        rows[:, layout.RADIUS] = np.where(radius, self.radius[at], 0.0)
        rows[:, layout.TURNS] = np.where(turns, self._value("P")[at], 1.0)
        rows[:, layout.ROW_FEED] = feed[at]
        rows[:, layout.ROW_TOLERANCE] = state[layout.TOLERANCE]
        flags = centre | np.where(radius, layout.HAS_R, 0) | (layout.STOPS if modes[EXACT_STOP] else 0)
        flags |= layout.INCH if state[SCALE] != 1.0 else 0
        if modes[CENTRES]:
            flags |= np.where(centre != 0, layout.ABSOLUTE, 0)
        if modes[FEED_MODE] == INVERSE:
            inverse = mode > 0
            rows[inverse, layout.ROW_FEED] = self._value("F")[at][inverse]
            flags |= np.where(inverse, layout.INVERSE_FEED, 0)
        marks[:, layout.KIND], marks[:, layout.ROW_LINE] = mode, first_line + at
        marks[:, layout.ROW_PLANE], marks[:, layout.FLAGS], marks[:, layout.SPLINE] = modes[PLANE], flags, -1
        # both axes of the plane belong to an arc, whether they are said or not
        both = 7 & ~(1 << layout.ACROSS[int(modes[PLANE])])
        stated = 0 if modes[RELATIVE] else self.bits[at]
        marks[:, layout.AXES] = self.bits[at] | np.where(mode >= 2, both, 0) | stated << layout.STATED


def _last(given: BoolArray, values: NDArray[Any], before: float) -> NDArray[Any]:
    """The last of the values (n,) that is given at or before each place, `before` where there is none."""
    index = np.maximum.accumulate(np.where(given, np.arange(len(given)), -1))
    return np.where(index >= 0, values[index], before)
