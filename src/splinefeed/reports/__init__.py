"""Figures of records (`plot`), and the files that a run leaves behind; draws what others computed.

In come a Run and other records; out come figures and a folder. `folder` writes a run (`sf.report`): numbers by
`record`, then `files`. A figure is data (`figure`, `marks`), made by `path_figures`, `motion_figures`,
`servo_figures`, `time_figures`; `layout` places it on paper for `svg` and `raster`, `interactive` on the page that
`html`, `program` and `sweep_page` write, with `detail` for zooming; `library` brings plotly's JavaScript, `page/` has
our own, `theme` its colours.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
