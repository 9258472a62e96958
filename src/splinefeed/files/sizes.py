"""How large a file may be before it is refused: a mistake ends in a sentence, not in a full memory."""

from __future__ import annotations

#: Largest text file that is read into memory, bytes.
MAX_FILE_BYTES = 64 * 2**20
#: Largest file of a CAD system, whose curves may stand among many solids, bytes.
MAX_CAD_BYTES = 256 * 2**20
#: Most that is taken from standard input, bytes.
MAX_STANDARD_INPUT_BYTES = 2**30
#: Most moves of G-code, or points of a table, of a path that is held as a whole.
MAX_MOVES = 1_000_000
#: Most control points of all curves in one file together.
MAX_POINTS = 200_000
#: Most curves in one file.
MAX_CURVES = 20_000
#: Largest drawing (DXF, SVG), bytes.
MAX_DRAWING_BYTES = 256 * 2**20
#: Most curves, and control points of all of them together, in a drawing with its blocks inserted.
MAX_DRAWING_CURVES = 200_000
MAX_DRAWING_POINTS = 2_000_000
#: Largest coordinate, mm: a thousand kilometres is not a workpiece, and beyond it squares and cubes begin to overflow.
MAX_COORDINATE = 1e9
#: Most axes of a curve or of setpoints.
MAX_AXES = 16
#: Most ticks in one file of setpoints: eighteen hours at 1 ms.
MAX_TICKS = 2**26
#: Most ticks in an HDF5 file, which is written and can be read chunk by chunk: above eleven days at 1 ms.
MAX_TICKS_IN_CHUNKS = 10**9
#: Most ticks in a file whose layout needs them in memory all at once: an hour at 1 ms, about 900 MB in MATLAB's.
MAX_TICKS_AT_ONCE = 3_600_000
