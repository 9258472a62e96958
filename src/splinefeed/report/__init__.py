"""Figures of records, and the files that a run leaves behind; draws what others computed."""
