"""What a run leaves in its folder."""

from __future__ import annotations

import dataclasses
import json
import xml.etree.ElementTree as ElementTree

import matplotlib.image
import pytest

import motions
import splinefeed as sf
from splinefeed.errors import FormatError
from splinefeed.report import files
from splinefeed.report.path_figure import path_figure

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000)


@pytest.fixture(scope="module")
def finished():
    path = motions.smooth()
    limits = dataclasses.replace(LIMITS, axis_acceleration=450, axis_jerk=18000)
    run = sf.run(path, limits, strategy="time-optimal")
    return run, list(sf.compare(path, run.law, methods=["taylor-2", "arc-length"]))


@pytest.fixture(scope="module")
def folder(finished, tmp_path_factory):
    place = tmp_path_factory.mktemp("run")
    run, traces = finished
    names = files.write(run, place, formats=tuple(files.SETPOINTS), traces=traces, record=run.numbers())
    assert sorted(each.name for each in place.iterdir()) == sorted(names)
    assert set(names) <= set(files.NAMES)
    return place


def test_the_page_of_numbers(finished, folder):
    page = json.loads((folder / "run.json").read_text())
    assert page["duration_s"] == finished[0].law.duration
    assert page["files"] == [each for each in page["files"] if (folder / each).is_file()]


@pytest.mark.parametrize(
    ("name", "units"),
    [
        ("path", ["x (mm)", "y (mm)", "feed (mm/s)"]),
        ("feed", ["travelled (mm)", "feed (mm/s)", "acceleration (mm/s²)", "jerk (mm/s³)", "time (s)"]),
        ("axes", ["x velocity (mm/s)", "y jerk (mm/s³)", "time (s)"]),
        ("limits", ["feed (mm/s)", "s (mm)", "time (s)", "axis jerk x", "share of the limit"]),
        ("binding", ["x (mm)", "y (mm)"]),
        ("ripple", ["feed ripple (relative)", "time (s)"]),
    ],
)
def test_svg_has_units_as_text(folder, name, units):
    root = ElementTree.parse(folder / f"{name}.svg").getroot()
    texts = {"".join(each.itertext()).strip() for each in root.iter("{http://www.w3.org/2000/svg}text")}
    assert set(units) <= texts


@pytest.mark.parametrize("name", files.FIGURES)
def test_png_is_a_picture_of_a_sensible_size(folder, name):
    height, width, _ = matplotlib.image.imread(folder / f"{name}.png").shape
    assert 600 <= width <= 2000
    assert 250 <= height <= 1500


def test_the_same_run_gives_the_same_figures(finished, folder, tmp_path):
    run, _ = finished
    for suffix in files.FIGURE_FORMATS:
        files.save_figure(path_figure(run.path, run.points), tmp_path / f"path.{suffix}")
        assert (tmp_path / f"path.{suffix}").read_bytes() == (folder / f"path.{suffix}").read_bytes()


def test_no_figures_and_no_other_methods(finished, tmp_path):
    run, _ = finished
    assert files.write(run, tmp_path, with_figures=False) == ["setpoints.h5", "law.h5", "run.json"]
    names = [name for name, _ in files.figures(run, [])]
    assert names == ["path", "feed", "axes", "limits", "binding"]
    along = sf.run(run.path, LIMITS)
    assert [name for name, _ in files.figures(along, [])] == ["path", "feed", "axes"]


def test_a_figure_is_whole_or_not_there(finished, tmp_path):
    run, _ = finished
    figure = path_figure(run.path, run.points)
    with pytest.raises(FormatError, match="does not exist; make it first"):
        files.save_figure(figure, tmp_path / "no" / "path.svg")

    def fail(*_args, **_kwargs):
        raise KeyboardInterrupt

    figure.savefig = fail
    with pytest.raises(KeyboardInterrupt):
        files.save_figure(figure, tmp_path / "path.svg")
    assert list(tmp_path.iterdir()) == []


def test_names_that_no_font_and_no_xml_can_show(finished, tmp_path):
    run, _ = finished
    path = sf.Path(run.path.curves, name="\x00\x1b]$x^$ & </svg> 飛 " + "long " * 40)
    for suffix in files.FIGURE_FORMATS:
        files.save_figure(path_figure(path, run.points), tmp_path / f"odd.{suffix}")
    text = (tmp_path / "odd.svg").read_text(encoding="utf-8")
    ElementTree.fromstring(text)
    assert "$x^$ &amp; &lt;/svg&gt; 飛" in text
    assert "..." in text
