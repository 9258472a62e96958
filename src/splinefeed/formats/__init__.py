"""One file a format, in and out: drawings, CAD, curves and tables of points; records as HDF5 and others.

`registry` reads and writes by content and name (G-code is in `programs`), `long_files` reads part by part. Drawings:
`dxf*`, `svg*`, gathered by `drawing` and `same_contours`; CAD in a process of its own: `step`, `iges`, `threedm`
through `cad_process`, `occt_shapes`, `rhino_objects`; `json_curve`, `airfoil`, `points`; setpoints: `setpoint_table`,
`setpoints*`, `hdf5`, `positions_csv`, `rows_parquet`, `bit_pattern`. docs/how-to/add-a-format.md adds one.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
