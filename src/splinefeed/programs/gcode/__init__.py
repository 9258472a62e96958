"""G-code: programs of machine tools, read to paths with feeds and markers, and written again.

In comes a file; `dialects` recognizes its control, `reader` runs it into rows of `moves`, `to_path` makes a path of
them. Lines: `lines` takes simple ones by arrays, `expressions` all others as words, with `formulas`; `flow` says which
comes next, `faults` what is wrong with one. `interpreter` knows what a line, its `line_words`, does to the `state`, by
`codes`, `places` with `offsets`, `tools`, `cutter`, `cycles`, `corner_words`, `threads`, `spline_words` and `tool_tip`;
other controls derive from it: `siemens` with `siemens_words` and `siemens_flow`, `heidenhain` with `klartext` and
`klartext_cycles`, `printers`; `lathe` recognizes what is refused. Curves: `arcs`, `piece`, `tool_paths`; `overview`
counts without making any. `writer` goes the other way, with `write_curves` and `fit_arcs`. docs/gcode-dialects.md says
what each dialect holds, docs/programs.md what of a shop's program is modelled.
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
