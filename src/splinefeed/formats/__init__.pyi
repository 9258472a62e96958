"""One file a format, in and out: drawings, CAD, G-code, curves and tables of points; records as HDF5 and others."""

from splinefeed.formats.bit_pattern import BitPattern as BitPattern
from splinefeed.formats.path_parts import PathParts as PathParts
from splinefeed.formats.path_parts import read_parts as read_parts
