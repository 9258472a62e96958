"""The lines that most programs consist of, many at once: text to words to moves, by arrays.

What depends on the line before, position, motion and feed, is the last one said or a running sum. A line with anything
else in it is left to the interpreter, which knows all of the language and writes the same rows.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splinefeed.programs.gcode.moves import LARGEST, LETTERS, MAX_LINE, STATED, Flag, Mark, MoveKind
from splinefeed.programs.gcode.state import ProgramState
from splinefeed.records import Array, BoolArray, IntArray

#: A character that no line has which is read here.
UNKNOWN = b"?"
_WORDS = "GNXYZABCUVWIJKRFSME"
_COMMENT = re.compile(rb"\([^)\n]*+\)|;[^\n]*+|\([^;\n]*+")
#: Kinds of characters, and those that may follow each; a blank is between words alone.
_OTHER, _LETTER, _N, _DIGIT, _POINT, _SIGN, _BLANK, _END = range(8)
_KINDS = bytearray(256)
for _kind, _characters in (
    (_LETTER, b"GXYZABCUVWIJKRFSMEgxyzabcuvwijkrfsme"), (_N, b"Nn"), (_DIGIT, b"0123456789"), (_POINT, b"."),
    (_SIGN, b"+-"), (_BLANK, b" \t\r"), (_END, b"\n"),
):  # fmt: skip
    for _character in _characters:
        _KINDS[_character] = _kind
_FOLLOWS = np.zeros((8, 8), dtype=bool)
for _kind, _next in (
    (_LETTER, (_DIGIT, _POINT, _SIGN)), (_N, (_DIGIT, _POINT)), (_SIGN, (_DIGIT, _POINT)),
    (_DIGIT, (_DIGIT, _POINT, _LETTER, _N, _BLANK, _END)), (_POINT, (_DIGIT, _LETTER, _N, _BLANK, _END)),
    (_BLANK, (_LETTER, _N, _BLANK, _END)), (_END, (_LETTER, _N, _BLANK, _END)),
):  # fmt: skip
    _FOLLOWS[_kind, list(_next)] = True
_RIGHT = bytes(np.flatnonzero(_FOLLOWS).tolist())
_UPPER = bytes(range(256)).upper()
_NO_NUMBERS = bytes(each if each in b"+-.0123456789" else 32 for each in range(256))
#: Most digits of an integer that a float is exactly, and powers of ten that are floats exactly.
_DIGITS, _POWERS = 15, 10.0 ** np.arange(16)
#: M codes that a line may have here.
_M = (3, 4, 5, 7, 8, 9)


def _blanked(found: re.Match[bytes]) -> bytes:
    """A comment as blanks; a bracket that never closes is none and stays."""
    whole = found[0]
    return whole if whole[:1] == b"(" and whole[-1:] != b")" else b" " * len(whole)


class ProgramLines:
    """A block of whole lines, taken apart into words once.

    Parameters
    ----------
    block : bytes
        Its last byte is a line feed.
    printer : bool
        Whether a line is one command of a printer.

    Attributes
    ----------
    next_odd : array (n,)
        The next line from each one on that the interpreter must take, or their count.
    """

    def __init__(self, block: bytes, printer: bool) -> None:
        if b"(" in block or b";" in block:
            block = _COMMENT.sub(_blanked, block)
        kinds = np.frombuffer(block.translate(_KINDS), dtype=np.uint8)
        ends = np.flatnonzero(kinds == _END)
        lengths = np.diff(ends, prepend=-1)
        self.count = len(ends)
        odd = lengths > MAX_LINE + 1
        pairs = 8 * np.concatenate([[np.uint8(_END)], kinds[:-1]]) + kinds
        if pairs.tobytes().translate(None, _RIGHT):
            odd[np.searchsorted(ends, np.flatnonzero(~_FOLLOWS.ravel()[pairs]))] = True
        if odd.any():
            data = np.where(np.repeat(odd, lengths), np.uint8(32), np.frombuffer(block, dtype=np.uint8))
            data[ends] = ord("\n")
            block = data.tobytes()
        text = block.translate(_UPPER, b"+ \t\r")
        body = np.frombuffer(text, dtype=np.uint8)
        edges = np.flatnonzero((body - np.uint8(ord("0")) > 9) & (body != ord("-")))  # letters, points, line feeds
        marks = body[edges]
        is_letter = marks >= ord("A")
        line_of, codes = np.cumsum(marks == ord("\n"))[is_letter], marks[is_letter]
        try:
            values = _values(block, body, edges, is_letter)
        except ValueError:  # two points, or nothing but one: the interpreter says where
            line_of, codes, values, odd = line_of[:0], codes[:0], np.zeros(0), np.ones_like(odd)
        self._columns: dict[str, Array] = {}
        for each in _WORDS:
            if each.encode() in text:
                at = np.flatnonzero(codes == ord(each))
                lines = line_of[at]
                self._columns[each] = np.full(self.count, np.nan)
                self._columns[each][lines] = values[at]
                odd[lines[1:][lines[1:] == lines[:-1]]] = True
        self._none = np.full(self.count, np.nan)
        g, m = (self._columns.get(each, self._none) for each in "GM")
        odd |= ~(np.isnan(g) | np.isin(g, (0, 1, 2, 3))) | ~(np.isnan(m) | np.isin(m, () if printer else _M))
        self.extruded = ~np.isnan(self._columns.get("E", self._none))
        odd |= self.extruded & (not printer)
        behind = np.where(odd, np.arange(self.count), self.count)
        self.next_odd: IntArray = np.minimum.accumulate(behind[::-1])[::-1]

    def scan(self, state: ProgramState, low: int, high: int, number: int) -> int:
        """Carry out lines `low` to the one before `high` on the state, as many as are known here: how many.

        `number` is that of the first one in its file.
        """
        get = {letter: self._columns.get(letter, self._none)[low:high] for letter in _WORDS}
        inverse = state.feed_mode == 93
        if state.absolute_centres or state.feed_mode == 95:
            return 0  # centres are absolute; or feeds go with the spindle
        if state.motion not in (0, 10, 20, 30) and np.isnan(get["G"][0]):
            return 0
        with np.errstate(all="ignore"):  # behind a line that is not known anything may come
            mode = _last(10.0 * get["G"], state.motion).astype(np.int64) // 10
            axes = [axis for axis, letter in enumerate(LETTERS) if letter in self._columns] or [0]
            words = np.stack([get[LETTERS[axis]] for axis in axes]) * state.scale[axes, None]
            centre = np.stack([get[letter] for letter in "IJK"]) * state.scale[:3, None]
            radius, rate = get["R"] * state.scale[0], get["F"]
            said, fed, turning = ~np.isnan(words), ~np.isnan(rate), mode >= 2
            has_centre, has_radius = ~np.isnan(centre), ~np.isnan(radius)
            about = has_centre.any(axis=0)
            arc, moves = about | has_radius, said.any(axis=0) | (turning & about)
            across = centre[state.across]
            across[turning & (across == 0.0)] = np.nan  # as FreeCAD writes it beside I and J
            has_centre = ~np.isnan(centre)
            wrong = has_centre.any(axis=0) == has_radius
            known = ~arc | (moves & turning)
            known &= ~(moves & turning) | ~(wrong | has_centre[state.across])
            known &= ~fed | ((rate >= 0.0) & (rate <= LARGEST))
            known &= np.isnan(get["M"]) | ~np.isnan(get["G"]) | ~(arc | ~np.isnan(get["U"]))  # they would be words of M
            if inverse:
                known &= np.where(moves, fed | (mode == 0), ~fed)
            if state.relative:
                steps = np.concatenate([state.position[axes, None], np.where(said, words, 0.0)], axis=1)
                ends = np.cumsum(steps, axis=1)[:, 1:]
            else:
                ends = _last(words + state.offset[axes, None], state.position[axes, None])
            sizes = np.abs(np.concatenate([np.where(said, ends, 0.0), centre, radius[None]]))
            known &= ~(sizes > LARGEST).any(axis=0)
            done = len(known) if known.all() else int(np.argmin(known))
        if not done:
            return 0
        at = np.flatnonzero(moves[:done])
        feed = _last(np.full(len(mode), np.nan) if inverse else rate * (state.feed_unit * state.rate), state.feed)
        speaks = np.flatnonzero(~(np.isnan(get["M"]) & np.isnan(get["S"]))[:done])
        before = np.searchsorted(at, speaks) + state.count
        rows = state.room(len(at))
        rows["end"] = state.position
        rows["end"][:, axes] = ends[:, at].T
        rows["centre"] = np.where(has_centre, centre, 0.0)[:, at].T
        rows["radius"] = np.where(has_radius, radius, 0.0)[at]
        timed = inverse & (mode[at] > 0)
        rows["feed"] = np.where(timed, rate[at], feed[at])
        flags = np.array([Flag.I, Flag.J, Flag.K]) @ has_centre
        flags += np.where(has_radius, Flag.R, 0)
        bits = (1 << np.array(axes)) @ said
        stated = 0 if state.relative else bits << STATED
        bits |= np.where(turning, 7 & ~(1 << state.across), 0)  # an arc has both axes of its plane, said or not
        rows["kind"] = np.where(mode[at] == 0, state.rapid, mode[at])
        rows["line"], rows["axes"] = number + at, (bits | stated)[at]
        if state.rapid != MoveKind.RAPID:
            flags += np.where(mode == 0, Flag.G0_AT_F, 0)
        rows["flags"] = flags[at] | np.where(timed, Flag.INVERSE_FEED, 0) | state.flags
        rows["turns"], rows["tolerance"], rows["plane"], rows["spline"] = 1.0, state.tolerance, state.plane, -1
        for i, move in zip(speaks.tolist(), before.tolist(), strict=True):
            state.switched(number + i, move, get["S"][i], get["M"][i])
        if self.extruded[low : low + done].any():
            self._extrude(state, get["E"][:done], moves[:done], feed[:done], number)
        state.motion, state.feed = 10 * int(mode[done - 1]), float(feed[done - 1])
        state.position[axes] = ends[:, done - 1]
        return done

    def _extrude(self, state: ProgramState, filament: Array, moves: BoolArray, feed: Array, number: int) -> None:
        """Words E (n,) of a printer: alone on their line, they take their time while the tool holds its position."""
        places, state.extruded = filament * state.scale[0], True
        if state.relative or state.steps_of_filament:
            steps = np.nan_to_num(places)
        else:
            steps = np.diff(_last(places, state.filament), prepend=state.filament)
        state.filament += float(np.sum(steps))
        alone = np.flatnonzero(~moves & (steps != 0.0) & (feed > 0.0))
        first = state.count - int(np.sum(moves))
        before = first + np.searchsorted(np.flatnonzero(moves), alone)
        for i, move in zip(alone.tolist(), before.tolist(), strict=True):
            state.said.append(Mark(move, number + i, dwell=60.0 * abs(float(steps[i])) / float(feed[i])))
        state.said.sort(key=lambda mark: mark.move)  # S and E of one scan, each in their order


def _values(block: bytes, body: NDArray[np.uint8], edges: IntArray, is_letter: BoolArray) -> Array:
    """The nearest floats to the numbers of a block; ValueError if one is none.

    `body` has the bytes without blanks and +, `edges` the places of all in it but digits and -, `is_letter` which of
    these are letters. Digits behind each other are an integer; over a power of ten, both exact in float64, it is
    rounded once.
    """
    letters, points = edges[is_letter], body[edges] == ord(".")
    lengths = np.diff(edges, append=len(body)) - 1
    of, negative, places = np.cumsum(is_letter)[points] - 1, body[letters + 1] == ord("-"), np.zeros_like(letters)
    places[of] = lengths[points]
    digits = lengths[is_letter] - negative + places
    if not (digits.all() and 0 < digits.max(initial=0) <= _DIGITS and (np.diff(of) > 0).all()):
        return np.fromiter(map(float, block.translate(_NO_NUMBERS).split()), dtype=float)
    values = np.fromstring(block.translate(_NO_NUMBERS, b"+-."), dtype=np.int64, sep=" ") / _POWERS[places]
    return np.where(negative, -values, values)


def _last(values: Array, before: ArrayLike) -> Array:
    """Along the last axis the last of the values that is a number at or before each place, `before` if none is."""
    index = np.arange(1, values.shape[-1] + 1)
    places = np.maximum.accumulate(np.where(np.isnan(values), 0, index), axis=-1)
    first = np.broadcast_to(before, (*values.shape[:-1], 1))
    return np.take_along_axis(np.concatenate([first, values], axis=-1), places, axis=-1)
