"""STEP, IGES and 3DM files of others: what must come out of them, and their lengths by OCCT itself."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.formats.registry import read_all

TRUTH = json.loads((Path(__file__).parents[1] / "data" / "truth_cad.json").read_text())
MILLIMETRES = {"mm": 1.0, "in": 25.4}


@pytest.mark.parametrize("truth", TRUTH, ids=lambda truth: truth["file"])
def test_every_curve_comes_out_as_it_stands_in_the_file(data_dir: Path, truth: dict[str, Any]) -> None:
    file = data_dir / truth["file"]
    assert hashlib.sha256(file.read_bytes()).hexdigest() == truth["sha256"]
    contents = read_all(file)
    # the numbers of the JSON files, which say no unit, are mm
    scale = MILLIMETRES[contents.units]
    curves = [curve for path in contents for curve in path.curves]
    free = list(curves)
    for wanted in truth["curves"]:
        alike = [
            curve
            for curve in free
            if curve.degree == wanted["degree"]
            and len(curve.control_points) == wanted["n_ctrl"]
            and curve.rational == wanted["rational"]
            and curve.length == pytest.approx(scale * wanted["length"], rel=1e-12)
            and np.allclose(padded(curve.ends[0]), scale * np.array(wanted["start"]), rtol=0.0, atol=1e-9 * curve.size)
            and np.allclose(padded(curve.ends[1]), scale * np.array(wanted["end"]), rtol=0.0, atol=1e-9 * curve.size)
        ]
        assert alike, wanted
        free.remove(alike[0])
        low, high = alike[0].bounding_box()
        assert np.allclose(padded(low), scale * np.array(wanted["bbox_min"]), rtol=0.0, atol=1e-8 * curves[0].size)
        assert np.allclose(padded(high), scale * np.array(wanted["bbox_max"]), rtol=0.0, atol=1e-8 * curves[0].size)
        assert alike[0].closed == wanted["closed"]
    if "occt" in truth:
        assert sum(curve.length for curve in curves) == pytest.approx(truth["occt"]["sum_edge_length_mm"], rel=1e-12)
    elif not truth["file"].startswith("step"):
        assert len(curves) == len(truth["curves"])


def padded(point: Any) -> Any:
    return np.pad(point, (0, 3 - len(point)))


@pytest.mark.parametrize("name", ["step/trimesh_featuretype.STEP", "step/tigl_nacelle.stp", "iges/tigl_D150_wing.igs"])
def test_lengths_are_those_of_occt(data_dir: Path, name: str) -> None:
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GCPnts import GCPnts_AbscissaPoint
    from OCP.IGESControl import IGESControl_Reader
    from OCP.Message import Message
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    Message.DefaultMessenger_s().ChangePrinters().Clear()
    reader = IGESControl_Reader() if name.startswith("iges") else STEPControl_Reader()
    reader.ReadFile(str(data_dir / name))
    reader.TransferRoots()
    explorer = TopExp_Explorer(reader.OneShape(), TopAbs_EDGE)
    seen: list[Any] = []
    while explorer.More():
        if not any(explorer.Current().IsSame(each) for each in seen):
            seen.append(explorer.Current())
        explorer.Next()
    lengths = [GCPnts_AbscissaPoint.Length_s(BRepAdaptor_Curve(TopoDS.Edge(edge)), 1e-9) for edge in seen]
    assert [path.length for path in read_all(data_dir / name)] == pytest.approx(lengths, rel=1e-9)


def test_inches_come_as_millimetres_and_say_so(data_dir: Path) -> None:
    contents = read_all(data_dir / "step/trimesh_featuretype.STEP")
    assert contents.units == "in"
    low = np.min([path.bounding_box()[0] for path in contents], axis=0)
    high = np.max([path.bounding_box()[1] for path in contents], axis=0)
    assert np.ptp([low, high], axis=0)[0] == pytest.approx(5.0 * 25.4, rel=1e-9)


def test_circles_have_the_fewest_spans_and_are_round(data_dir: Path) -> None:
    curves = [path.curves[0] for path in read_all(data_dir / "step/trimesh_featuretype.STEP")]
    round_ones = [curve for curve in curves if curve.rational]
    assert len(round_ones) == 92
    assert {len(curve.breaks) - 1 for curve in round_ones} <= {1, 2, 3, 4}
    for curve in round_ones:
        u = np.linspace(*curve.domain, 50)
        kappa = curve.curvature(u)
        assert np.ptp(kappa) <= 1e-11 * kappa[0]


def test_an_iges_composite_is_one_path_and_copious_data_one_curve(data_dir: Path) -> None:
    contents = read_all(data_dir / "iges/igesio_sample_curves.igs")
    # arc, line and arc of the composite, and the line that ends where it begins
    assert [len(path.curves) for path in contents] == [1, 1, 4, 1, 1, 1, 1, 1, 1]
    assert max(contents[2].gaps) < 1e-12
    assert [(path.curves[0].degree, len(path.curves[0].control_points)) for path in contents[-2:]] == [(1, 5), (1, 5)]


def test_what_is_read_can_be_planned(data_dir: Path) -> None:
    path = sf.read(data_dir / "step/tigl_nacelle.stp", path=2)
    law = sf.plan(path, sf.Limits(feed=200, acceleration=2000, jerk=50000), period=1e-3)
    assert law.length == pytest.approx(1366.5927548278, rel=1e-9)
