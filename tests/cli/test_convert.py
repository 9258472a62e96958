"""`splinefeed convert` and what `info` says of drawings."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest

import splinefeed as sf


@pytest.fixture
def spline(folder, data_dir):
    shutil.copy(data_dir / "dxf" / "trimesh_spline.DXF", folder / "part.dxf")
    return "part.dxf"


def answer(result):
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


@pytest.mark.parametrize("suffix", ["dxf", "svg", "json"])
def test_every_curve_is_kept_and_measured(splinefeed, folder, spline, suffix):
    page = answer(splinefeed("convert", spline, f"out.{suffix}", "--json"))
    assert (page["ok"], page["paths"], page["curves"], page["from"]) == (True, 4, 10, "DXF drawing")
    assert page["largest_distance_mm"] < 1e-12
    assert page["notes"] == []
    assert (folder / f"out.{suffix}").exists()


def test_what_is_approximated_is_said_with_its_distance(splinefeed, folder):
    page = answer(splinefeed("convert", "butterfly", "out.svg", "--tolerance", "1um", "--json"))
    (note,) = page["notes"]
    assert note.startswith("1 curve(s) approximated by cubics, at most 0.000")
    assert 0.0 < page["largest_distance_mm"] <= 1e-3
    finer = answer(splinefeed("convert", "butterfly", "out.svg", "--tolerance", "10nm", "--json"))
    assert finer["largest_distance_mm"] <= 1e-5
    text = splinefeed("convert", "butterfly", "out.dxf").stdout
    assert text.startswith("butterfly (shape): 1 path, 1 curve -> out.dxf (DXF drawing)\nread back: 1 curve, ")


@pytest.mark.parametrize("suffix", ["txt", "xyz"])
def test_points_are_fitted_as_closely_as_they_are_written_whatever_their_file_is_called(splinefeed, folder, suffix):
    turns = np.linspace(0.0, 3.0, 150)
    np.savetxt(folder / f"points.{suffix}", 10.0 * np.column_stack([np.cos(turns), np.sin(turns)]))
    page = answer(splinefeed("convert", f"points.{suffix}", "out.json", "--tolerance", "0.1mm", "--json"))
    assert page["notes"] == [] and "(tolerance 0.1 mm)" in page["findings"][-1]


def test_one_path_can_be_chosen_and_gaps_joined(splinefeed, folder):
    lines = [[[0, 0], [10, 0]], [[10, 5e-5], [10, 10]]]
    (folder / "gap.dxf").write_text(
        "0\nSECTION\n2\nENTITIES\n"
        + "".join(f"0\nLINE\n8\ncut\n10\n{a}\n20\n{b}\n11\n{c}\n21\n{d}\n" for (a, b), (c, d) in lines)
        + "0\nENDSEC\n0\nEOF\n"
    )
    page = answer(splinefeed("convert", "gap.dxf", "out.json", "--json"))
    assert page["paths"] == 2
    assert page["findings"][1] == (
        "open ends lie close together but not within 1e-06 mm: 5e-05 mm at (10, 0); "
        "a tolerance of 5.3e-05 mm would join them"
    )
    page = answer(splinefeed("convert", "gap.dxf", "out.json", "--join", "1um", "--json"))
    assert page["paths"] == 1
    assert page["findings"][1].startswith("1 gap(s) of up to 5e-05 mm closed: ends were moved")
    assert sf.read("out.json").gaps == (0.0,)
    page = answer(splinefeed("convert", "gap.dxf", "out.json", "--path", "cut#2", "--units", "in", "--json"))
    assert (page["paths"], page["units"]) == (1, "in")
    assert sf.read("out.json").length == pytest.approx((10 - 5e-5) * 25.4)


def test_refusals_are_one_line(refused, folder, spline):
    assert refused("convert", spline, "out.docx").startswith(
        "out.docx: this name is not that of a path file; name it as one"
    )
    assert refused("convert", "none.dxf", "out.svg").startswith("none.dxf: no such file")
    assert "the folder" in refused("convert", spline, "no/where.svg")
    assert refused("convert", spline, "out.svg", "--layer", "x").startswith("part.dxf: has no layer 'x'; there are '0'")
    (folder / "bad.dxf").write_bytes((folder / spline).read_bytes()[:5000])
    assert refused("convert", "bad.dxf", "out.svg").startswith("bad.dxf: ")
    assert not (folder / "out.svg").exists()


def test_info_says_units_and_layers_of_a_drawing(splinefeed, folder, data_dir):
    shutil.copy(data_dir / "dxf" / "trimesh_ae_r2000a.dxf", folder / "inch.dxf")
    page = answer(splinefeed("info", "inch.dxf", "--json"))
    assert (page["format"], page["units"], len(page["paths"])) == ("DXF drawing", "in", 9)
    assert sum(path["length_mm"] for path in page["paths"]) > 31.568329751313367 * 25.4
    assert {path["name"].partition("#")[0] for path in page["paths"]} == {"0"}
    assert splinefeed("info", "inch.dxf").stdout.startswith("DXF drawing, 9 paths, units of the file: in\n0#1: ")
