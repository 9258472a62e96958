"""What a run leaves in its folder."""

from __future__ import annotations

import dataclasses
import json
import re
import sys
import xml.etree.ElementTree as ElementTree

import matplotlib.image
import pytest

import motions
import splinefeed as sf
from splinefeed.errors import FormatError, InputError
from splinefeed.reports import files, raster
from splinefeed.reports.figure import Figure
from splinefeed.reports.path_figures import path_figure

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000)


@pytest.fixture(scope="module")
def finished():
    path = motions.smooth()
    limits = dataclasses.replace(LIMITS, axis_acceleration=450, axis_jerk=18000)
    run = sf.run(path, limits, strategy="time-optimal")
    return run, list(sf.runs.compare(path, run.law, methods=["taylor-2", "arc-length"]))


@pytest.fixture(scope="module")
def folder(finished, tmp_path_factory):
    place = tmp_path_factory.mktemp("run")
    run, traces = finished
    names = files.write(
        run,
        place,
        formats=tuple(files.SETPOINTS),
        traces=traces,
        figure_formats=files.FIGURE_FORMATS,
        record=run.numbers(),
    )
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
        ("motion", ["s (mm)", "feed (mm/s)", "acceleration (mm/s²)", "jerk (mm/s³)", "axis jerk (mm/s³)", "time (s)"]),
        ("limits", ["feed (mm/s)", "time (s)", "axis jerk x", "share of limit"]),
        ("binding", ["x (mm)", "y (mm)"]),
        ("ripple", ["taylor-2", "arc-length", "time (s)"]),
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
    assert 250 <= height <= 2000


@pytest.mark.parametrize("name", files.FIGURES)
def test_pdf_is_one_page_with_its_words(folder, name):
    data = (folder / f"{name}.pdf").read_bytes()
    assert data.startswith(b"%PDF-1.")
    assert len(re.findall(rb"/Type /Page\b", data)) == 1
    assert b"/FontDescriptor" in data


def test_the_same_run_gives_the_same_figures(finished, folder, tmp_path):
    run, _ = finished
    for suffix in files.FIGURE_FORMATS:
        path_figure(run).save(tmp_path / f"path.{suffix}")
        assert (tmp_path / f"path.{suffix}").read_bytes() == (folder / f"path.{suffix}").read_bytes()
    assert path_figure(run)._repr_svg_() == (folder / "path.svg").read_text(encoding="utf-8")


def test_no_figures_and_no_other_methods(finished, tmp_path):
    run, _ = finished
    assert files.write(run, tmp_path, figure_formats=()) == ["setpoints.h5", "law.h5", "run.json"]
    names = [name for name, _ in files.to_files(files.of_run(run))]
    assert names == ["path", "motion", "limits", "binding"]
    along = sf.run(run.path, LIMITS)
    assert [name for name, _ in files.to_files(files.of_run(along))] == ["path", "motion"]


def test_by_default_a_figure_is_one_file_and_none_is_drawn_twice(finished, tmp_path, monkeypatch):
    run, traces = finished
    drawn = []
    real = Figure.save
    monkeypatch.setattr(Figure, "save", lambda figure, file: (drawn.append(file.name), real(figure, file)))
    names = files.write(run, tmp_path, traces=traces)
    assert drawn == [f"{name}.svg" for name in ("path", "motion", "limits", "binding", "ripple")]
    assert names == ["setpoints.h5", "law.h5", *drawn, "report.html", "run.json"]


def test_without_the_extra_the_rest_is_written_and_the_mend_is_said(finished, tmp_path, monkeypatch):
    run, _ = finished
    for name in ("matplotlib", "plotly"):
        monkeypatch.setitem(sys.modules, name, None)
    assert files.missing(("svg", "png")) == [
        'no report.html: it needs Plotly, pip install "splinefeed[plots]"',
        'no figures as png: they need Matplotlib, pip install "splinefeed[plots]"',
    ]
    assert files.missing(()) == []
    names = files.write(run, tmp_path, figure_formats=("svg", "png"))
    assert names == [
        "setpoints.h5", "law.h5", "path.svg", "motion.svg", "limits.svg", "binding.svg", "run.json",
    ]  # fmt: skip
    with pytest.raises(InputError, match=r'path.png: png needs Matplotlib: pip install "splinefeed\[plots\]"'):
        path_figure(run).save(tmp_path / "path.png")
    with pytest.raises(InputError, match=r"path.gif: figures are written as svg, png, pdf"):
        path_figure(run).save(tmp_path / "path.gif")


def test_a_figure_is_whole_or_not_there(finished, tmp_path, monkeypatch):
    run, _ = finished
    figure = path_figure(run)
    with pytest.raises(FormatError, match="does not exist; make it first"):
        figure.save(tmp_path / "no" / "path.svg")

    def fail(*_args, **_kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(raster, "write", fail)
    with pytest.raises(KeyboardInterrupt):
        figure.save(tmp_path / "path.png")
    assert list(tmp_path.iterdir()) == []


def test_names_that_no_font_and_no_xml_can_show(finished, tmp_path):
    run, _ = finished
    path = sf.Path(run.path.curves, name="\x00\x1b]$x^$ & </svg> 飛 " + "long " * 40)
    for suffix in files.FIGURE_FORMATS:
        path_figure(dataclasses.replace(run, path=path)).save(tmp_path / f"odd.{suffix}")
    text = (tmp_path / "odd.svg").read_text(encoding="utf-8")
    ElementTree.fromstring(text)
    assert "$x^$ &amp; &lt;/svg&gt; 飛" in text
    assert "..." in text
