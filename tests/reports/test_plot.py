"""`sf.plot` and `sf.report`: the report's figures in one line, as files and in notebooks."""

from __future__ import annotations

import dataclasses
import json
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner

import splinefeed as sf
from splinefeed.cli.main import command_line
from splinefeed.records import view


@pytest.fixture(scope="module")
def run():
    return sf.run(sf.shapes.butterfly(), sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000))


def test_a_run_draws_itself_with_feed_and_axis_jerk_below(run, tmp_path):
    figure = sf.plot.overview(run)
    assert [panel.y.label for panel in figure.panels] == ["y (mm)", "feed (mm/s)", "axis jerk (mm/s³)"]
    figure.save(tmp_path / "run.svg")
    assert "axis jerk (mm/s³)" in (tmp_path / "run.svg").read_text()


def test_jerk_along_the_path_where_axes_have_no_limit_of_it():
    run = sf.run(sf.shapes.naca("0025", perimeter=33))
    assert sf.plot.overview(run).panels[-1].y.label == "jerk (mm/s³)"


@pytest.mark.parametrize("name", ["overview", "path", "motion", "limits", "binding"])
def test_every_figure_of_a_run_is_svg(run, name):
    assert getattr(sf.plot, name)(run)._repr_svg_().startswith("<svg ")


def test_a_law_is_drawn_with_its_limits(run):
    figure = sf.plot.law(run.law, run.limits)
    assert [panel.y.label for panel in figure.panels][:2] == ["s (mm)", "feed (mm/s)"]


def test_a_notebook_shows_numbers_and_picture(run):
    page = run._repr_html_()
    assert "every limit holds" in page
    assert "<svg " in page


def test_a_bare_path_is_drawn_coloured_by_curvature(tmp_path):
    figure = sf.plot.path(sf.shapes.butterfly())
    (coloured, *_) = figure.panels[0].marks
    assert list(coloured.shades) == ["curvature"]
    assert coloured.shades["curvature"].label == "curvature (1/mm)"
    circle = sf.NurbsCurve.bezier([[10, 0], [10, 10], [0, 10]], weights=[1, np.sqrt(0.5), 1])
    (quarter, *_) = sf.plot.path(sf.Path([circle])).panels[0].marks
    np.testing.assert_allclose(quarter.shades["curvature"].values, 0.1, rtol=1e-12)
    space = sf.plot.path(sf.Path([sf.NurbsCurve.bezier([[0, 0, 0], [1, 0, 2], [3, 4, 5]])]))
    assert space.panels[0].z == "z (mm)"
    space.save(tmp_path / "space.svg")
    assert "z (mm)" in (tmp_path / "space.svg").read_text()


@pytest.fixture(scope="module")
def served():
    return sf.run(sf.shapes.butterfly(), sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000), machine="xytheta")


def test_what_the_report_draws_is_a_line_of_python(run, served, tmp_path):
    joints = sf.plot.joints(run)
    assert [panel.y.label.split(" (")[0] for panel in joints.panels] == [
        "axis position", "axis velocity", "axis acceleration", "axis jerk",
    ]  # fmt: skip
    assert sf.plot.ripple(run).panels[0].note == f"at most {run.ripple.max:.2g}"
    traces = list(sf.runs.compare(run.path, run.law, methods=["taylor-2", "arc-length"]))
    assert [panel.y.label for panel in sf.plot.compare(traces).panels] == ["taylor-2", "arc-length"]
    most = 1e3 * served.served.response.contour_error.max()
    assert f"at most {most:.3g} µm" in sf.plot.errors(served).panels[0].note
    assert sf.plot.errors(served.served.response).panels[0].note == sf.plot.errors(served).panels[0].note
    assert f"contour error at most {most:.3g} µm" in sf.plot.contour(served).title
    tuned = sf.runs.tune(sf.Machine.load("xytheta").servo_axis("x"), "margins", period=1e-3)
    assert "phase margin" in sf.plot.bode(tuned, "xytheta").title
    assert sf.plot.bode(tuned).title.startswith("axis x: margins\n")
    assert sf.plot.errors(served).title == "butterfly on xytheta: errors over time"
    file = tmp_path / "part.nc"
    file.write_text("G21 G90 G0 X0 Y0 Z1\nG1 X30 F600\nG0 Y20\nG1 X0 F300\nM30\n")
    time, planned = sf.cycle_time(file, "hurco-04"), sf.run(sf.read(file), sf.Limits(feed=60, axis_acceleration=500))
    for figure, label in ((sf.plot.program(time), "operation"), (sf.plot.program(planned), "programmed feed (mm/min)")):
        (coloured, *_) = figure.panels[0].marks
        assert next(iter(coloured.shades.values())).label == label
    for call, message in [
        (lambda: sf.plot.errors(run), "plot.errors: the run has no machine that followed"),
        (lambda: sf.plot.contour(run), "plot.contour: the run has no machine that followed"),
        (lambda: sf.plot.compare([]), "plot.compare: expected what sf.runs.compare gives"),
        (lambda: sf.plot.program(run), "plot.program: butterfly is no path of a program"),
        (lambda: sf.plot.bode(run), "plot.bode: expected TunedAxis first"),
    ]:
        with pytest.raises(sf.errors.InputError, match=message):
            call()


def test_what_cannot_be_drawn_is_said(run):
    line = sf.Path([sf.NurbsCurve.bezier([[0.0], [1.0]])], name="slide")
    for call, message in [
        (lambda: sf.plot.path(run.path, colour="speed"), "plot.path: colour is 'speed'; choose 'feed', 'curvature', '"),
        (lambda: sf.plot.path(run.law), "plot.path: expected Run first, got TimeLaw; the order is plot.path(run)"),
        (lambda: sf.plot.limits(run.path), "plot.limits: expected Run first, got Path; the order is plot.limits(run)"),
        (lambda: sf.plot.law(run.limits, run.law), "plot.law: expected TimeLaw first, got Limits; the order is plot.l"),
        (lambda: sf.plot.path(run, colour="heat"), "plot.path: colour is 'heat'; choose 'feed', 'curvature', 'neares"),
        (lambda: sf.plot.path(line), "plot.path: slide has fewer than two linear axes; plot a run of it, over time"),
    ]:
        with pytest.raises(sf.errors.InputError) as error:
            call()
        assert str(error.value).startswith(message)


def test_records_show_themselves(run):
    response = sf.runs.follow(run.points, sf.Machine.load("xytheta"), path=run.path)
    trace = next(sf.runs.compare(run.path, run.law, methods=["taylor-2"], timed=False))
    pages = {
        "382.86 mm": run.path,
        "degree 3, 51 control points, rational": run.path.curves[0],
        "500 mm/s²": sf.Limits(feed=60, axis_acceleration={"x": 500, "y": 800}),
        "171.887 deg/s²": sf.Limits(feed=60, axis_acceleration={"x": 500, "b": 3}),
        "combinations.left.jerk": sf.Limits(
            feed=60, combinations={"left": sf.records.Combination(weights={"y": 1.0, "c": 400.0}, jerk=3e4)}
        ),
        "0.2 N m": sf.Limits(feed=60, torque=sf.records.Torque(lambda q, v, a: 0.05 * a, {"c": 0.2})),
        "time-optimal": run.law,
        f"{len(run.points)}, one every 0.001 s": run.points,
        "every limit holds": run.verdict,
        f"at most {response.contour_error.max():.4g} mm": response,
        "taylor-2: Taylor, second order": trace,
    }
    for words, record in pages.items():
        page = record._repr_html_()
        ElementTree.fromstring(f"<div>{page}</div>")
        assert words in page
        assert ("<polyline" in page) == (not isinstance(record, sf.Limits | sf.Verdict))
        assert len(page) < 12_000


def test_a_sparkline_keeps_every_peak():
    values = np.zeros(100_000)
    values[[777, 50_001]] = 5.0, -3.0
    (line,) = ElementTree.fromstring(view.sparkline(values, "peaks")).findall("{*}polyline")
    y = np.array([[float(each) for each in pair.split(",")] for pair in line.get("points").split()])[:, 1]
    assert y.min() == 2.0
    assert y.max() == view.HEIGHT - 2.0
    assert view.sparkline([], "none") == view.sparkline([np.nan, np.inf], "none") == ""
    assert "2.0" in view.sparkline([7.0], "one")


def test_a_hostile_name_stays_text(run):
    path = sf.Path(run.path.curves, name='<script>alert("1")</script>&')
    assert "<script" not in path._repr_html_()
    ElementTree.fromstring(f"<div>{path._repr_html_()}</div>")
    empty = dataclasses.replace(run.points.part(0, 0), method="<b>")
    assert "&lt;b&gt;" in empty._repr_html_()
    assert "<polyline" not in empty._repr_html_()


def test_a_run_writes_what_the_command_writes(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = sf.report(run, "part", formats=["csv", "hdf5"])
    assert {"setpoints.csv", "setpoints.h5", "law.h5", "run.json", "path.svg", "limits.svg"} <= set(names)
    assert sorted(names) == sorted(each.name for each in (tmp_path / "part").iterdir())
    page = json.loads((tmp_path / "part/run.json").read_text())
    assert page["ok"] is True
    assert page["settings"]["limits"] == run.limits.as_dict()
    np.testing.assert_array_equal(sf.load("part/setpoints.h5").position, run.points.position)
    made = CliRunner().invoke(command_line, ["report", "part"], catch_exceptions=False)
    assert (made.exit_code, made.output) == (
        0,
        "checked: every limit holds, to within a millionth of it and the rounding of a position\n\n"
        "wrote part/report.html\n",
    )
    assert CliRunner().invoke(command_line, ["check", "part/setpoints.h5"]).exit_code == 0
    assert "setpoints.csv" not in sf.report(run, "part")  # a run replaces the files of the one before
    assert not (tmp_path / "part/setpoints.csv").exists()
    with pytest.raises(sf.errors.InputError, match="report: format 'dwg' is not known; choose from hdf5, csv"):
        sf.report(run, "part", formats=["dwg"])
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/run.json").write_text("{}")
    with pytest.raises(sf.errors.FormatError, match=r"mine/run\.json: was not written by a run of splinefeed"):
        sf.report(run, "mine")
