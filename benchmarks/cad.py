"""Reading CAD files: ours, checks and process included, against OCCT's and rhino3dm's own reading in this process."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import splinefeed as sf
from benchmarks.tables import Column, Report, Table
from benchmarks.timing import interleaved
from splinefeed.formats.registry import read_all

#: Splines of the file that is made, and control points of each.
SPLINES, POINTS = 400, 50
ROUNDS = 5
DATA = Path(__file__).parents[1] / "tests" / "data"


def measure() -> Report:
    """Milliseconds for files of the tests and one of many splines, libraries loaded before."""
    rows = []
    with tempfile.TemporaryDirectory(prefix="splinefeed-bench-") as folder:
        many = Path(folder, "many.stp")
        sf.write(splines(), many)
        for file in (
            DATA / "step/trimesh_featuretype.STEP",
            DATA / "step/tigl_nacelle.stp",
            many,
            DATA / "iges/tigl_D150_wing.igs",
            DATA / "3dm/rhino_nurbscurve.3dm",
        ):
            times = interleaved({"ours": partial(read_all, file), "theirs": theirs(file)}, ROUNDS)
            ours, their = times["ours"].least, times["theirs"].least
            paths = read_all(file)
            rows.append((file.name, file.stat().st_size / 1e3, len(paths), 1e3 * ours, 1e3 * their, ours / their))
    caption = "Reading CAD files, libraries loaded; ours with checks, curves, chaining, and the way between processes."
    columns = (
        Column("file"),
        Column("kB", ",.0f"),
        Column("paths", ",d"),
        Column("splinefeed, ms", ",.1f"),
        Column("library alone, ms", ",.1f"),
        Column("ratio", ".2f"),
    )
    return Report((Table(caption, columns, tuple(rows)),), ())


def splines() -> list[sf.Path]:
    """Cubics of many points, apart from each other."""
    random = np.random.default_rng(1)
    knots = np.concatenate([np.zeros(4), np.arange(1.0, POINTS - 3), np.full(4, POINTS - 3.0)])
    return [
        sf.Path([sf.NurbsCurve(3, knots, random.normal(size=(POINTS, 3)) + 100.0 * i)], name=f"spline {i}")
        for i in range(SPLINES)
    ]


def theirs(file: Path) -> Callable[[], Any]:
    """What the library itself needs to have the shapes of `file` in memory."""
    if file.suffix == ".3dm":
        import rhino3dm

        return partial(rhino3dm.File3dm.Read, str(file))
    from OCP.IGESControl import IGESControl_Reader
    from OCP.Message import Message
    from OCP.STEPControl import STEPControl_Reader

    Message.DefaultMessenger_s().ChangePrinters().Clear()

    def read() -> Any:
        reader = IGESControl_Reader() if file.suffix == ".igs" else STEPControl_Reader()
        reader.ReadFile(str(file))
        reader.TransferRoots()
        return reader.OneShape()

    return read
