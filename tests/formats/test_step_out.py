"""STEP out: what is written comes back the same, to the last bit; OCCT itself reads it; what has no place is said."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_EDGE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

import splinefeed as sf
from cad_makers import length
from splinefeed.errors import InputError
from splinefeed.formats import step
from splinefeed.formats.registry import read_all


def some_path(seed: int) -> sf.Path:
    """A curve of any degree, weights and knots, off the origin, closed or not, with numbers of all sizes."""
    random = np.random.default_rng(seed)
    degree = int(random.integers(1, 8))
    count = int(random.integers(degree + 1, 30))
    inner = np.sort(random.choice(np.linspace(0.0, 1.0, 40)[1:-1], count - degree - 1, replace=False))
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)]) * 10.0 ** random.integers(-3, 3)
    points = random.normal(size=(count, 3)) * 10.0 ** random.integers(-3, 4) + 100.0 * random.normal(size=3)
    points[0, 0] = random.choice([0.0, 1e-300, 1 / 3, 1e8])
    if seed % 3 == 0:
        points[-1] = points[0]
    weights = None if seed % 2 else random.uniform(0.1, 10.0, count)
    return sf.Path([sf.NurbsCurve(degree, knots, points, weights)], name=f"path {seed}")


def test_any_curve_comes_back_to_the_last_bit_or_a_rounding_where_it_is_closed(tmp_path: Path) -> None:
    paths = [some_path(seed) for seed in range(60)]
    assert sf.write(paths, tmp_path / "part.step") == ()
    back = read_all(tmp_path / "part.step")
    assert back.units == "mm"
    assert len(back) == len(paths)
    for ours, theirs in zip(paths, back, strict=True):
        (one,), (other,) = ours.curves, theirs.curves
        assert (one.degree, one.knots.tolist(), one.weights is None) == (
            other.degree,
            other.knots.tolist(),
            other.weights is None,
        )
        if one.closed:  # OCCT makes it periodic and opens it again
            assert np.max(np.abs(one.control_points - other.control_points)) <= 1e-15 * np.abs(one.control_points).max()
        else:
            assert np.array_equal(one.control_points, other.control_points)
        assert one.weights is None or np.allclose(one.weights, other.weights, rtol=4e-16, atol=0.0)


@pytest.mark.parametrize("shape", ["circle?radius=7", "butterfly", "naca:0025?chord=15.5", "ellipse"])
def test_shapes_come_back_flat_and_whole(tmp_path: Path, shape: str) -> None:
    path = sf.shapes.from_text(shape)
    sf.write(path, tmp_path / "part.stp")
    (back,) = read_all(tmp_path / "part.stp")
    assert back.axes == ("x", "y")
    assert back.closed == path.closed
    assert [curve == other for curve, other in zip(path.curves, back.curves, strict=True)] == [True] * len(path.curves)


def test_occt_itself_finds_the_edges_with_their_lengths(tmp_path: Path) -> None:
    path = sf.shapes.butterfly()
    sf.write(path, tmp_path / "part.stp")
    reader = STEPControl_Reader()
    assert reader.ReadFile(str(tmp_path / "part.stp")) == IFSelect_RetDone
    assert reader.WS().ModelCheckList(True).IsEmpty(False)
    reader.TransferRoots()
    explorer = TopExp_Explorer(reader.OneShape(), TopAbs_EDGE)
    assert length(TopoDS.Edge(explorer.Current())) == pytest.approx(path.length, rel=1e-9)


def test_an_unclamped_curve_is_clamped(tmp_path: Path) -> None:
    curve = sf.NurbsCurve(2, np.arange(8.0), [[0, 0], [5, 9], [10, 0], [15, 3], [20, 1]])
    sf.write(sf.Path([curve]), tmp_path / "part.stp")
    (back,) = read_all(tmp_path / "part.stp")
    assert back.curves[0].clamped
    u = np.linspace(*curve.domain, 30)
    assert np.allclose(back.curves[0](u), curve(u), rtol=0.0, atol=1e-14)


def test_what_has_no_place_is_said(tmp_path: Path) -> None:
    curve = sf.NurbsCurve(1, [0, 0, 1, 1], [[0, 0, 0], [3, 4, 1]])
    path = sf.Path([curve], ("x", "y", "theta"), feeds=[50.0], name="it's 1/2\" µm\n\\")
    lost = sf.write(path, tmp_path / "part.stp")
    assert lost == ("STEP has no place for these, which are left out: rotary axes (theta), feeds",)
    assert read_all(tmp_path / "part.stp")[0].length == pytest.approx(5.0, rel=1e-15)
    text = (tmp_path / "part.stp").read_text(encoding="ascii")
    assert "'it''s 1/2\" \\X2\\00B5\\X0\\m\\X2\\000A\\X0\\\\\\'" in text
    five = sf.Path([sf.NurbsCurve(1, [0, 0, 1, 1], [[0, 0, 0, 0], [3, 4, 1, 1]])], ("u", "v", "w", "x"))
    with pytest.raises(InputError, match="has 4 linear axes"):
        sf.write(five, tmp_path / "five.stp")
    assert not (tmp_path / "five.stp").exists()


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0.0"), (-1.0, "-1.0"), (1e-7, "1.E-07"), (1.5e300, "1.5E+300"), (1 / 3, repr(1 / 3))]
)
def test_reals_have_a_point_and_all_their_digits(value: float, text: str) -> None:
    said: Any = step._real(value)
    assert said == text
    assert float(said) == value
