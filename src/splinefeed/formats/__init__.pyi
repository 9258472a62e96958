"""One file a format, in and out: drawings, CAD, G-code, curves and tables of points; records as HDF5 and others."""

from splinefeed.formats.bit_pattern import BitPattern as BitPattern
from splinefeed.formats.long_files import read_parts as read_parts
from splinefeed.paths.path_parts import PathParts as PathParts
