"""What `info` says of a G-code program: from its moves, so that a hundred megabytes take seconds."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from typing import Any

from splinefeed.cli.output import number, print_text

#: Programs with at most this many moves are made into a path; of longer ones as many curves are listed.
FEW = 5_000


def program_page(
    source: str, reading: Mapping[str, Any], every: bool = False
) -> tuple[dict[str, Any] | None, dict[str, Any] | None]:
    """The page of a program too long to be made into a path, and what only a program has; None without one.

    `every` lists all of its curves, and not the first ones alone.
    """
    from splinefeed.formats import registry
    from splinefeed.geometry import shapes

    if shapes.is_shape(source) or not os.path.isfile(source) or registry.format_of(source).module != "gcode":
        return None, None
    from splinefeed.formats.gcode.overview import summary

    known = {"dialect", "start", "offsets", "tools", "from_line", "repair"}
    if set(reading) - known:
        return None, None  # the registry says which option is none of a program's
    counted = summary(source, **reading, most_listed=sys.maxsize if every else FEW)
    program = counted.program()
    if sum(counted.moves.values()) <= FEW:
        return None, program
    return {**counted.page(source), "format": "G-code"}, program


def print_program(program: Mapping[str, Any]) -> None:
    """Lines, moves, lengths, feeds and times of a program."""
    counts = ", ".join(f"{count} {kind}" for kind, count in program["motion_blocks"].items())
    lengths = ", ".join(f"{number(length, 7)} mm {kind}" for kind, length in program["lengths_mm"].items())
    print_text(f"program of {program['lines']} lines, dialect {program['dialect']}")
    print_text(f"  moves     {counts}; {program['markers']} lines with M, S or T")
    print_text(f"  lengths   {lengths}")
    if program["feed_max_mm_s"] is not None:
        low, high = number(program["feed_min_mm_s"], 4), number(program["feed_max_mm_s"], 4)
        feeds = f"{low} mm/s" if low == high else f"{low} to {high} mm/s"
        print_text(
            f"  feeds     {feeds}; {number(program['feed_time_s'], 4)} s at them, "
            f"{number(program['dwell_s'], 4)} s of dwells, without rapid moves"
        )
    if not program["ends"]:
        print_text("  note      no M2 or M30 ends it")
