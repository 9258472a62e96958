"""How the modal state of a program and the rows of its moves are laid out in arrays."""

from __future__ import annotations

# columns of the state of floats: position and offset of 9 axes, what one unit of each is, feed, tolerance
POSITION, OFFSET, SCALE, FEED, TOLERANCE, STATE = 0, 9, 18, 27, 28, 29
# entries of the state of integers
MOTION, RELATIVE, PLANE, FEED_MODE, EXACT_STOP, EXTRUDED, CENTRES, UNITS, MODES = range(9)
# MOTION is a G code as tenths, -1 for none; UNITS is 20 or 21, 0 (mm) while none was said; FEED_MODE: G94, G93, G95
PER_MINUTE, INVERSE, PER_TURN = 0, 1, 2
# columns of the rows of floats: end of 9 axes, centre, radius, turns, feed, tolerance
END, CENTER, RADIUS, TURNS, ROW_FEED, ROW_TOLERANCE, FLOATS = 0, 9, 12, 13, 14, 15, 16
# columns of the rows of integers
KIND, ROW_LINE, ROW_PLANE, FLAGS, SPLINE, AXES, INTEGERS = 0, 1, 2, 3, 4, 5, 6
#: AXES has bits of the axes that a move concerns, and from this bit on of those whose place the program states.
STATED = 16
# bits of FLAGS: I, J, K, R given; centre absolute; feed is one over minutes; the tool stops at the end; inches; X Y Z
# are the tool's tip; the columns of the centre hold the tool axis at the end
HAS_I, HAS_J, HAS_K, HAS_R, ABSOLUTE, INVERSE_FEED, STOPS, INCH, TIP, VECTOR = 1, 2, 4, 8, 16, 32, 64, 128, 256, 512

#: First and second axis of each plane, counterclockwise from the first to the second, and the axis across it.
PLANES = {17: (0, 1), 18: (2, 0), 19: (1, 2)}
ACROSS = {17: 2, 18: 1, 19: 0}

#: Longest line that is read, characters.
MAX_LINE = 4096
#: Largest word, in mm or rad: beyond it the interpreter says what is wrong.
LARGEST = 1e9
