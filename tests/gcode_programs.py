"""Small programs as files, and what the reader makes of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import splinefeed as sf
from splinefeed.programs.gcode.dialects import Dialect, recognized


def program(folder: Path, *lines: str, name: str = "part.ngc") -> Path:
    """A file of the given lines."""
    file = folder / name
    file.write_text("\n".join(lines) + "\n")
    return file


def detect(head: bytes) -> Dialect:
    """The dialect of a program by its first bytes; LinuxCNC where nothing tells."""
    return recognized(head)[0]


def path_of(folder: Path, *lines: str, **options: Any) -> sf.Path:
    """The path of a program of the given lines, which starts at the origin by default."""
    return sf.read(program(folder, *lines), **{"start": (0, 0, 0), **options})


def refusal(folder: Path, *lines: str, **options: Any) -> str:
    """What the reader says of a program of the given lines, without the name of the file."""
    try:
        path_of(folder, *lines, **options)
    except sf.SplinefeedError as error:
        message = str(error)
        assert "\n" not in message
        return message.removeprefix(f"{folder / 'part.ngc'}: ")
    raise AssertionError(f"{lines} was read")


def said(path: sf.Path) -> list[str]:
    """Moves as T (rapid) or F with their end, and markers, in their order."""
    out = []
    feeds = path.feeds
    assert feeds is not None
    for i, curve in enumerate(path.curves):
        out += [each.text or f"P{each.dwell:g}" for each in path.markers if each.before == i]
        out.append(("T" if feeds[i] == float("inf") else "F") + " ".join(f"{v:g}" for v in curve.control_points[-1]))
    return out + [each.text or f"P{each.dwell:g}" for each in path.markers if each.before == len(path.curves)]
