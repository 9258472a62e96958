"""Curves of real files through every format that can hold them, and back: the same to 1e-12 of their size."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from splinefeed.formats.registry import read_all
from splinefeed.runs.convert import convert

SOURCES = [
    "dxf/trimesh_ae_r2000a.dxf", "svg/svgpathtools_transforms.svg", "iges/igesio_sample_curves.igs",
    "3dm/rhino_nurbscurve.3dm", "gcode/linuxcnc_nurbs.ngc", "curves/butterfly.json", "step/tigl_nacelle.stp",
]  # fmt: skip
TARGETS: list[tuple[str, dict[str, Any]]] = [
    (".json", {}), (".dxf", {}), (".step", {}), (".ngc", {"as_": "g6.2", "feed": 10.0}),
]  # fmt: skip


@pytest.mark.parametrize("source", SOURCES)
def test_every_curve_comes_back(tmp_path: Path, data_dir: Path, source: str) -> None:
    paths = read_all(data_dir / source)
    size = max(float(np.abs(curve.control_points).max()) for path in paths for curve in path.curves)
    for suffix, options in TARGETS:
        _, curves, distance = convert(paths, tmp_path / f"out{suffix}", writing=options)
        assert distance is not None and distance <= 1e-12 * max(size, 1.0), suffix
        count = sum(len(path.curves) for path in paths)
        # in a program every straight line is a curve, and rapid moves lead from path to path
        assert curves >= count if suffix == ".ngc" else curves == count, suffix
