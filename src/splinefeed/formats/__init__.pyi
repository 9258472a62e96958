"""One file a format, in and out: drawings, CAD, curves and tables of points; records as HDF5 and others."""

from .bit_pattern import BitPattern as BitPattern
from .long_files import read_parts as read_parts
