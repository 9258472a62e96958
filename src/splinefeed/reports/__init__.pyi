"""Figures of records (`plot`), and the files that a run leaves behind; draws what others computed."""

from . import plot as plot
