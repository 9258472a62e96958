"""G-code: programs of machine tools, read to paths with feeds and markers, and written again.

`expressions` reads a line, `interpreter` knows what it does to the state (`state`, `codes`, `offsets`, `cycles`,
`tools`), `reader` runs a whole file into rows of moves (`moves`), `arcs`, `spline_words`, `piece` and `to_path` make
curves of them, `overview` counts them without making any; `dialects` tells controls apart. `writer` goes the other way,
with `write_curves` and `fit_arcs`. docs/gcode-dialects.md says what each dialect holds, docs/programs.md what
of a shop's program is modelled.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from splinefeed.programs.gcode.dialects import holds as holds

#: Where the rest lives; it needs the kernels, and telling formats apart does not.
_LATER = {"from_file": "to_path", "in_parts": "to_path", "summary": "overview", "write": "writer"}

__all__ = ["from_file", "holds", "in_parts", "summary", "write"]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LATER[name]}"), name)
