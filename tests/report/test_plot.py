"""`sf.plot` and `run.plot()`: the report's figures in one line, as files and in notebooks."""

from __future__ import annotations

import pytest

import splinefeed as sf


@pytest.fixture(scope="module")
def run():
    return sf.run(sf.shapes.butterfly(), sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000))


def test_a_run_draws_itself_with_feed_and_axis_jerk_below(run, tmp_path):
    figure = run.plot()
    assert [panel.y.label for panel in figure.panels] == ["y (mm)", "feed (mm/s)", "axis jerk (mm/s³)"]
    figure.save(tmp_path / "run.svg")
    assert "axis jerk (mm/s³)" in (tmp_path / "run.svg").read_text()


def test_jerk_along_the_path_where_axes_have_no_limit_of_it():
    run = sf.run(sf.shapes.naca("0025", perimeter=33))
    assert run.plot().panels[-1].y.label == "jerk (mm/s³)"


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
