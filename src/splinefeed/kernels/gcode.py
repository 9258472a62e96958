"""Lines of a G-code program to moves: the lines that most programs consist of, byte by byte.

The state and the rows that are written are laid out in `formats.gcode.moves`; a line with anything else in it is left
to the interpreter there, which knows all of the language and writes the same rows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from splinefeed.kernels.jit import hot_kernel, kernel
from splinefeed.records import Array, IntArray

Bytes = NDArray[np.uint8]

#: What `scan` says when it returns: the data are used up, a line is not of the simple kind, the rows are full.
DONE, UNKNOWN, FULL = 0, 1, 2

# columns of the state of floats: position and offset of 9 axes, what one unit of each is, feed, tolerance
POSITION, OFFSET, SCALE, FEED, TOLERANCE, STATE = 0, 9, 18, 27, 28, 29
# entries of the state of integers
MOTION, RELATIVE, PLANE, INVERSE, EXTRUDER, LINE, EXACT_STOP, EXTRUDED, CENTRES, MODES = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
# columns of the rows of floats: end of 9 axes, centre, radius, turns, feed, tolerance
END, CENTER, RADIUS, TURNS, ROW_FEED, ROW_TOLERANCE, FLOATS = 0, 9, 12, 13, 14, 15, 16
# columns of what is said between moves, integers: before which move, line, M codes as decimal digits, bits of S and T;
# floats: the values of S and T
SAID_BEFORE, SAID_LINE, SAID_M, SAID_WORDS, SAID = 0, 1, 2, 3, 4
SAID_S, SAID_T, SPOKEN = 0, 1, 2
# columns of the rows of integers
KIND, ROW_LINE, ROW_PLANE, FLAGS, SPLINE, AXES, INTEGERS = 0, 1, 2, 3, 4, 5, 6
#: AXES has bits of the axes that a move concerns, and from this bit on of those whose place the program states.
STATED = 16
# bits of FLAGS: I, J, K, R given; centre absolute; feed is one over minutes; the tool rests at the end; inches
HAS_I, HAS_J, HAS_K, HAS_R, ABSOLUTE, INVERSE_FEED, STOPS, INCH = 1, 2, 4, 8, 16, 32, 64, 128

#: Longest line that is read, characters.
MAX_LINE = 4096
#: Most M codes of one line here, 3 to 9 each: the next digit would do, but lines of people have one or two.
_MOST_M = 4
#: Largest word, in mm or rad: beyond it the interpreter says what is wrong.
LARGEST = 1e9
#: Axis of each letter A to Z, -1 for those that are none: x y z a b c u v w.
_AXIS = np.array([3, 4, 5] + [-1] * 17 + [6, 7, 8, 0, 1, 2], dtype=np.int64)
_POWERS = 10.0 ** np.arange(23)
#: An integer up to this is exact in float64, and so is its quotient by an exact power of ten but for one rounding.
_EXACT = 2**53
#: Most significant digits that an integer of 64 bits holds.
_DIGITS = 18
_SPLIT = 134217729.0  # 2^27 + 1


@hot_kernel
def _quotient(mantissa: int, power: float) -> tuple[float, bool]:
    """The float64 nearest to mantissa / power, and whether that is certain.

    The mantissa is the sum of two floats; the remainder of the division of the first is exact by Dekker's product
    (Numerische Mathematik 18, 1971, doi:10.1007/BF01397083), so that one more division gives the quotient to twice the
    digits. Where that lies within 1e-9 of the middle of two floats, it is left open.
    """
    high = float(mantissa)
    low = float(mantissa - int(high))
    first = high / power
    product = first * power
    a = _SPLIT * first
    a_high = a - (a - first)
    a_low = first - a_high
    b = _SPLIT * power
    b_high = b - (b - power)
    b_low = power - b_high
    rounding = a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)
    second = ((high - product) - rounding + low) / power
    result = first + second
    rest = abs((first - result) + second)
    half = 0.5 * np.spacing(result)
    return result, rest < half * (1.0 - 1e-9)


@hot_kernel
def _number(data: Bytes, i: int) -> tuple[float, int]:
    """The number at data[i:] and the index behind it, or -1 for what is no plain decimal number."""
    negative = False
    c = int(data[i])
    if c == 43 or c == 45:
        negative = c == 45
        i += 1
    mantissa = 0
    digits = 0
    fraction = 0
    any_digit = False
    point = False
    while True:
        c = int(data[i])
        if 48 <= c <= 57:
            any_digit = True
            if mantissa > 0 or c > 48:
                digits += 1
                if digits > _DIGITS:
                    return 0.0, -1
                mantissa = 10 * mantissa + (c - 48)
            if point:
                fraction += 1
        elif c == 46 and not point:
            point = True
        else:
            break
        i += 1
    if not any_digit or fraction > 22:
        return 0.0, -1
    if fraction == 0:
        value = float(mantissa)
    elif mantissa <= _EXACT:
        value = mantissa / _POWERS[fraction]
    else:
        value, certain = _quotient(mantissa, _POWERS[fraction])
        if not certain:
            return 0.0, -1
    return (-value if negative else value), i


@kernel
def scan(
    data: Bytes,
    start: int,
    state: Array,
    modes: IntArray,
    rows: Array,
    marks: IntArray,
    count: int,
    said: IntArray,
    spoken: Array,
) -> tuple[int, int, int, int]:
    """Read lines from data[start:], which ends with a line feed, until one is not known here.

    state (29,), modes (9,) are read and kept up to date; moves are written to rows (n, 16) and marks (n, 6) from
    `count` on, what M, S and T say between them to said (m, 4) and spoken (m, 2) from 0 on. Returns where it stopped
    (the beginning of a line), the count of moves, that of what is said, and DONE, UNKNOWN or FULL.
    """
    size = len(data)
    words = np.empty(26)
    i = start
    heard = 0
    while i < size:
        if count >= len(rows) or heard >= len(said):
            return i, count, heard, FULL
        begin = i
        given = 0  # bits of the letters that stand in the line
        motion = -1
        outputs = 0  # M codes in their order, a digit each
        switched = 0  # bits of those among them that exclude each other: the spindle's, the tool's
        grouped = 0  # bits of the groups of G codes that the line names: motion, plane, distance, feed mode, units
        known = True
        while True:
            c = int(data[i])
            if c == 10:
                i += 1
                break
            if c == 32 or c == 9 or c == 13:
                i += 1
                continue
            if c == 59:  # a comment to the end of the line
                while int(data[i]) != 10:
                    i += 1
                continue
            if c == 40:  # a comment in brackets
                while int(data[i]) != 41 and int(data[i]) != 10:
                    i += 1
                if int(data[i]) == 10:
                    known = False
                    break
                i += 1
                continue
            if c >= 97:
                c -= 32
            letter = c - 65
            if letter < 0 or letter > 25:
                known = False
                break
            i += 1
            while int(data[i]) == 32 or int(data[i]) == 9:
                i += 1
            signed = int(data[i]) == 43 or int(data[i]) == 45
            value, behind = _number(data, i)
            if behind < 0 or (letter == 13 and signed):
                known = False
                break
            i = behind
            if letter == 13:  # N
                continue
            if letter == 12:  # M
                if not 3.0 <= value <= 9.0 or value != np.floor(value) or outputs >= 10 ** (_MOST_M - 1):
                    known = False
                    break
                outputs = 10 * outputs + int(value)
                group = 1 if value <= 5.0 else (2 if value == 6.0 else 0)
                if switched & group:
                    known = False
                    break
                switched |= group
                continue
            if letter == 6:  # G: what moves, or what says again how things are
                group = 0
                if value == 0.0 or value == 1.0 or value == 2.0 or value == 3.0:
                    motion = int(value)
                    group = 1
                elif value == modes[PLANE]:
                    group = 2
                elif value == (91.0 if modes[RELATIVE] else 90.0):
                    group = 4
                elif value == (93.0 if modes[INVERSE] else 94.0):
                    group = 8
                elif value == (21.0 if state[SCALE] == 1.0 else 20.0):
                    group = 16
                if group == 0 or grouped & group:
                    known = False
                    break
                grouped |= group
                continue
            if given >> letter & 1:
                known = False
                break
            given |= 1 << letter
            if _AXIS[letter] >= 0 or (8 <= letter <= 10) or letter == 5 or letter == 17 or letter == 15:
                words[letter] = value  # axes, I J K, F, R, P
            elif letter == 18 or letter == 19:  # S, T
                words[letter] = value
            elif letter == 4 and modes[EXTRUDER]:
                modes[EXTRUDED] = 1
            else:
                known = False
                break
        if not known or i - begin > MAX_LINE:
            return begin, count, heard, UNKNOWN
        axes = 0
        for letter in range(26):
            if given >> letter & 1 and _AXIS[letter] >= 0:
                axes |= 1 << _AXIS[letter]
        centre = given >> 8 & 7
        radius = given >> 17 & 1
        turns = given >> 15 & 1
        mode = motion if motion >= 0 else modes[MOTION]
        moves = axes != 0 or (mode >= 2 and centre != 0)
        has_feed = given >> 5 & 1
        if has_feed and not 0.0 <= words[5] <= LARGEST:
            return begin, count, heard, UNKNOWN
        if (not moves or (outputs and motion < 0)) and (centre or radius or turns):
            return begin, count, heard, UNKNOWN
        if moves:
            if mode < 0 or mode > 3:
                return begin, count, heard, UNKNOWN
            if mode < 2 and (centre or radius or turns):
                return begin, count, heard, UNKNOWN
            if mode >= 2:
                across = 4 if modes[PLANE] == 17 else (2 if modes[PLANE] == 18 else 1)
                if centre & across and words[10 if across == 4 else (9 if across == 2 else 8)] == 0.0:
                    centre &= ~across  # K0 beside I and J, as FreeCAD writes it
                if (centre != 0) == (radius != 0) or centre & across:
                    return begin, count, heard, UNKNOWN
                if modes[CENTRES] and centre and centre | across != 7:
                    return begin, count, heard, UNKNOWN
                if turns and not (words[15] >= 1.0 and words[15] == np.floor(words[15]) and words[15] <= 1e3):
                    return begin, count, heard, UNKNOWN
            if modes[INVERSE] and mode > 0 and not has_feed:
                return begin, count, heard, UNKNOWN
            for letter in range(26):
                axis = _AXIS[letter]
                if given >> letter & 1 and axis >= 0:
                    there = words[letter] * state[SCALE + axis]
                    base = state[POSITION + axis] if modes[RELATIVE] else state[OFFSET + axis]
                    if not abs(base + there) <= LARGEST:
                        return begin, count, heard, UNKNOWN
            for k in range(3):
                base = state[OFFSET + k] if modes[CENTRES] else 0.0
                if centre >> k & 1 and not abs(base + words[8 + k] * state[SCALE + k]) <= LARGEST:
                    return begin, count, heard, UNKNOWN
            if radius and not abs(words[17] * state[SCALE]) <= LARGEST:
                return begin, count, heard, UNKNOWN
        # nothing below can fail: from here on the state changes
        modes[LINE] += 1
        if motion >= 0:
            modes[MOTION] = motion
        if has_feed and not modes[INVERSE]:
            state[FEED] = words[5] * state[SCALE]
        if outputs or given >> 18 & 3:
            said[heard, SAID_BEFORE] = count
            said[heard, SAID_LINE] = modes[LINE]
            said[heard, SAID_M] = outputs
            said[heard, SAID_WORDS] = given >> 18 & 3
            spoken[heard, SAID_S] = words[18] if given >> 18 & 1 else 0.0
            spoken[heard, SAID_T] = words[19] if given >> 19 & 1 else 0.0
            heard += 1
        if not moves:
            continue
        for letter in range(26):
            axis = _AXIS[letter]
            if given >> letter & 1 and axis >= 0:
                there = words[letter] * state[SCALE + axis]
                base = state[POSITION + axis] if modes[RELATIVE] else state[OFFSET + axis]
                state[POSITION + axis] = base + there
        flags = centre | (HAS_R if radius else 0) | (STOPS if modes[EXACT_STOP] else 0)
        flags |= INCH if state[SCALE] != 1.0 else 0
        flags |= ABSOLUTE if modes[CENTRES] and centre else 0
        for axis in range(9):
            rows[count, END + axis] = state[POSITION + axis]
        for k in range(3):
            base = state[OFFSET + k] if modes[CENTRES] else 0.0
            rows[count, CENTER + k] = base + words[8 + k] * state[SCALE + k] if centre >> k & 1 else 0.0
        rows[count, RADIUS] = words[17] * state[SCALE] if radius else 0.0
        rows[count, TURNS] = words[15] if turns else 1.0
        rows[count, ROW_FEED] = state[FEED]
        if modes[INVERSE] and mode > 0:
            rows[count, ROW_FEED] = words[5]
            flags |= INVERSE_FEED
        rows[count, ROW_TOLERANCE] = state[TOLERANCE]
        marks[count, KIND] = mode
        marks[count, ROW_LINE] = modes[LINE]
        marks[count, ROW_PLANE] = modes[PLANE]
        marks[count, FLAGS] = flags
        marks[count, SPLINE] = -1
        stated = 0 if modes[RELATIVE] else axes
        if mode >= 2:
            # both axes of the plane belong to an arc, whether they are said or not
            axes |= 3 if modes[PLANE] == 17 else (5 if modes[PLANE] == 18 else 6)
        marks[count, AXES] = axes | stated << STATED
        count += 1
    return i, count, heard, DONE
