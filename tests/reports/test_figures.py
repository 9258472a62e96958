"""The figures say what the records say: units, limits and peaks, for every kind of path."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial import cKDTree

import motions
import splinefeed as sf
from splinefeed.reports import interactive, svg, theme
from splinefeed.reports.figure import Coloured, Dots, Figure, Heat, Level, Line, Panel, PlotAxis
from splinefeed.reports.layout import Dot, Stroke, Text, layout
from splinefeed.reports.motion_figures import law_panels, ripple_figure
from splinefeed.reports.path_figures import path_figure

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000)


def line(*points, **options):
    pieces = [sf.NurbsCurve(1, [0, 0, 1, 1], ends) for ends in itertools.pairwise(points)]
    return sf.Path(pieces, **options)


PATHS = {
    "smooth": motions.smooth(),
    "with theta": sf.Path(
        [sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[0, 0, 0], [20, 0, 1], [20, 20, 3]])], ("x", "y", "theta")
    ),
    "in space": sf.Path([sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[0, 0, 0], [20, 0, 8], [20, 20, 3]])]),
    "flat in space": sf.Path([sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[0, 0, 5], [20, 0, 5], [20, 20, 5]])]),
    "one axis": line([0.0], [10.0]),
    "upright": line([0, 0], [0, 10]),
    "corners": line([0, 0], [10, 0], [10, 10], [3, 10]),
    "five axes": line([0, 0, 0, 0, 0], [5, 6, 7, 0.5, 1], axes=("x", "y", "z", "a", "c")),
}


def words(figure: Figure) -> list[str]:
    """Everything that is written on the paper."""
    return [item.text for item in layout(figure).items if isinstance(item, Text)]


def marks(panel: Panel, kind: type) -> list:
    return [mark for mark in panel.marks if isinstance(mark, kind)]


@pytest.fixture(scope="module", params=PATHS)
def run(request):
    return sf.run(PATHS[request.param], LIMITS, period=1e-3)


def test_the_path_is_coloured_by_its_feed(run):
    figure = path_figure(run)
    (panel,) = figure.panels
    (path,) = marks(panel, Coloured)
    assert path.shades["feed"].high == run.points.feed.max()
    assert len(path.shades["feed"].values) == len(path.place) <= len(run.points)
    found = words(figure)
    assert "feed (mm/s)" in found
    space = run.path.linear >= 3 and np.ptp(run.points.position[:, 2]) > 0
    assert bool(panel.z) == space
    assert any(text.startswith(f"{run.path.axes[0]} (mm)") for text in found)
    if space:
        assert any(text.startswith("z (mm): ") for text in found)
    elif run.path.linear > 1:
        assert any(text.startswith("start") for text in found)


@pytest.mark.parametrize("name", ["smooth", "flat in space", "upright", "corners"])
def test_equal_scales_are_equal_on_paper(name):
    run = sf.run(PATHS[name], LIMITS)
    figure = path_figure(run)
    (path,) = marks(figure.panels[0], Coloured)
    drawn = [item.points for item in layout(figure).items if isinstance(item, Stroke) and item.width == 3.2]
    on_paper = np.ptp(np.vstack(drawn), axis=0)
    assert on_paper * np.ptp(path.place, axis=0)[::-1] == pytest.approx(
        on_paper[::-1] * np.ptp(path.place, axis=0), rel=1e-9, abs=1e-9
    )


def test_the_motion_over_time(run):
    figure = sf.plot.motion(run)
    labels = [panel.y.label for panel in figure.panels]
    assert labels[:4] == ["s (mm)", "feed (mm/s)", "acceleration (mm/s²)", "jerk (mm/s³)"]
    (jerk,) = marks(figure.panels[3], Line)
    at = run.law.breaks[:-1]
    *_, of_tip = run.path.of_tip(run.law(at), run.law.feed(at), run.law.acceleration(at), run.law.jerk(at))
    assert jerk.y.max() == pytest.approx(of_tip.max(), rel=1e-2)
    assert jerk.y.min() == pytest.approx(of_tip.min(), rel=1e-2)
    assert {"A = 500 mm/s²", "-D = -500 mm/s²", "J = 20000 mm/s³", "time (s)"} <= set(words(figure))
    lines = {each.name: each for panel in figure.panels for each in marks(panel, Line)}
    for k, axis in enumerate(run.path.axes):
        rotary = k >= run.path.linear
        assert f"axis acceleration ({'°' if rotary else 'mm'}/s²)" in labels
        factor = 180 / np.pi if rotary else 1.0
        largest = factor * np.abs(run.motion.acceleration[:, k]).max()
        assert np.abs(lines[f"{axis} acceleration"].y).max() == pytest.approx(largest)


def test_the_ripple_of_methods():
    path = PATHS["smooth"]
    law = sf.plan(path, LIMITS, period=1e-3)
    traces = list(sf.runs.compare(path, law, methods=["taylor-1", "milne-simpson", "arc-length"]))
    figure = ripple_figure(traces, "a path")
    assert [panel.y.label for panel in figure.panels] == [trace.result.method for trace in traces]
    for panel, trace in zip(figure.panels, traces, strict=True):
        assert panel.y.log
        (ripple,), (floor,) = marks(panel, Line), marks(panel, Level)
        assert ripple.y.max() == pytest.approx(np.abs(trace.relative).max())
        assert trace.result.ripple_floor == pytest.approx(floor.value, rel=1.0)
        assert panel.y.low < trace.result.ripple_floor < panel.y.high
        assert trace.result.ripple_max < panel.y.high


def test_motions_too_short_for_a_ripple():
    path = line([0, 0], [1e-3, 0])
    law = sf.plan(path, LIMITS, period=0.01)
    short = sf.run(path, LIMITS, period=0.01)
    figures = [ripple_figure(list(sf.runs.compare(path, law, methods=["arc-length"])), "short"), path_figure(short)]
    for figure in (*figures, sf.plot.motion(short), sf.plot.limits(short)):
        assert len(words(figure)) > 3


def test_limits_that_are_not_there_are_not_drawn():
    limits = sf.Limits(feed=1e6)
    law = sf.plan(PATHS["smooth"], LIMITS, period=1e-3)
    figure = Figure("free", tuple(law_panels(law, limits)))
    assert [text for text in words(figure) if "=" in text] == ["limit = 1e6 mm/s: beyond this scale"]
    assert not any(panel.levels() for panel in figure.panels)


def test_different_limits_of_speeding_up_and_down():
    limits = sf.Limits(feed=60, acceleration=500, deceleration=300, jerk=20000, deceleration_jerk=9000)
    law = sf.plan(PATHS["smooth"], limits, period=1e-3)
    found = words(Figure("two", tuple(law_panels(law, limits))))
    assert {"A = 500 mm/s²", "-D = -300 mm/s²", "slowing J = 9000 mm/s³", "slowing -J = -9000 mm/s³"} <= set(found)


def test_joints_have_their_own_unit_colours_and_limits():
    points = np.random.default_rng(1).normal(size=(9, 7)).cumsum(axis=0)
    path = sf.Path([sf.NurbsCurve(3, [0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 6, 6, 6], points)])
    limits = sf.Limits(axis_velocity=[3, 3, 3, 2, 2, 2, 1], axis_acceleration=[5] * 7, axis_jerk=[50] * 7)
    run = sf.run(path, limits)
    position, velocity, acceleration, jerk = sf.plot.motion(run).panels[-4:]
    assert position.y.label == "axis position (mm or rad)"
    np.testing.assert_array_equal(marks(position, Line)[6].y, run.points.position[:, 6])
    assert len({line.colour for line in marks(jerk, Line)}) == 7
    texts = [level.text for level in velocity.levels() if level.text]
    assert texts == ["q1 q2 q3 3 (mm or rad)/s", "q4 q5 q6 2 (mm or rad)/s", "q7 1 (mm or rad)/s"]
    assert [level.text for level in acceleration.levels()] == ["limit 5 (mm or rad)/s²", ""]
    shared, alone = velocity.levels()[0], velocity.levels()[-1]
    assert shared.colour not in theme.COLOURS
    assert alone.colour == marks(velocity, Line)[6].colour


def test_each_part_of_the_path_has_the_colour_of_its_limit():
    run = sf.run(motions.smooth(), sf.Limits(feed=60, axis_acceleration=450, axis_jerk=18000), strategy="time-optimal")
    (panel,) = sf.plot.binding(run).panels
    drawn = np.sum([np.isfinite(each.x) for each in marks(panel, Line)], axis=0)
    assert drawn.min() == 1  # no gap,
    assert np.mean(drawn == 1) > 0.5  # and two colours where they meet alone
    parts = [float(each.name.split()[-1].rstrip("%")) for each in marks(panel, Line)]
    assert sum(parts) == pytest.approx(100.0, abs=len(parts))
    (heat,) = marks(sf.plot.limits(run).panels[1], Heat)
    assert heat.share.max() == run.use.share.max()


def test_values_that_are_not_finite_leave_a_gap():
    t = np.linspace(0.0, 1.0, 9)
    y = np.where(np.arange(9) == 4, np.nan, np.where(np.arange(9) == 7, np.inf, t))
    dots = Dots(t, y, words=("a",))
    figure = Figure(
        "gaps", (Panel(PlotAxis("t (s)"), PlotAxis("y (mm)"), (Line(t, y, "y"), dots, Level(np.inf, "none"))),)
    )
    sheet = layout(figure)
    assert np.isfinite([(item.x, item.y) for item in sheet.items if isinstance(item, Dot | Text)]).all()
    assert sum(isinstance(item, Dot) for item in sheet.items) == 7
    from splinefeed.reports.svg import to_text

    assert "nan" not in to_text(figure).lower()
    assert "inf" not in to_text(figure).lower()


def test_paper_and_page_draw_the_same_curves(run):
    figure = sf.plot.motion(run)
    plain = interactive.to_plain(figure)
    assert [each["name"] for each in plain["data"]] == [
        mark.name for panel in figure.panels for mark in marks(panel, Line)
    ]
    told = " ".join(each["text"] for each in plain["layout"]["annotations"])
    for panel in figure.panels:
        assert panel.y.label in told
        assert panel.y.label in words(figure)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (12000.0, "12000"),
        (-50000.0, "-50000"),
        (1.25e6, "1.25e6"),
        (1e-7, "1e-7"),
        (0.5, "0.5"),
    ],
)
def test_ticks(value, text):
    assert theme.tick_text(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(1539.6, "1540"), (999.96, "1000"), (1.43e5, "1.43e5"), (0.129, "0.129"), (60.0, "60"), (1e-9, "1e-9")],
)
def test_short_numbers(value, text):
    assert theme.short(value) == text


def test_ticks_lie_on_the_axis_and_apart():
    for low, high, log in ((0.0, 1.65, False), (-3.3e-7, 9e-7, False), (1e-14, 0.6, True), (3.0, 40.0, True)):
        t = np.array([0.0, 1.0])
        panel = Panel(PlotAxis("t (s)"), PlotAxis("y (mm)", low, high, log=log), (Line(t, np.array([low, high])),))
        sheet = layout(Figure("", (panel,)))
        labels = [item for item in sheet.items if isinstance(item, Text) and item.anchor == "end"]
        heights = np.sort([item.y for item in labels])
        assert 2 <= len(labels) <= 8
        assert np.diff(heights).min() >= 12.0


def test_names_of_joints_are_short_where_all_share_parts():
    assert theme.axis_words(["waist_joint", "elbow_joint"]) == ["waist", "elbow"]
    assert theme.axis_words([f"panda_joint{k}" for k in (1, 2)]) == ["joint1", "joint2"]
    assert theme.axis_words(["left_arm_a", "left_arm_b"]) == ["a", "b"]
    assert theme.axis_words(["x", "y", "z"]) == ["x", "y", "z"]
    assert theme.axis_words(["only_joint"]) == ["only_joint"]


def test_no_dot_of_a_program_is_nowhere(tmp_path):
    file = tmp_path / "two.nc"
    file.write_text("G21 G90\nG0 X0 Y0 Z5\nF6\nG1 Z0\nG1 X30 Y4\nG0 Z5\nG0 X0\nM2\n", encoding="ascii")
    run = sf.run(sf.read(file), sf.Limits(feed=0.1, axis_velocity=50, axis_acceleration=500, axis_jerk=20000))
    assert not run.whole
    text = svg.to_text(path_figure(run))
    assert "nan" not in text


def test_a_long_program_is_a_line_that_stays_on_its_path_in_the_colours_of_its_feed(tmp_path):
    file = tmp_path / "pocket.nc"
    turns = np.linspace(0.0, 12.0 * np.pi, 600)
    lines = [f"G1 X{(1 + t) * np.cos(t):.3f} Y{(1 + t) * np.sin(t):.3f}" for t in turns]
    file.write_text("\n".join(["G21 G90", "G0 X1 Y0", "F150", *lines, "M2"]), encoding="ascii")
    path = sf.read(file)
    run = sf.run(path, sf.Limits(feed=2.5, axis_velocity=50, axis_acceleration=500, axis_jerk=20000))
    assert not run.whole
    (mark,) = path_figure(run).panels[0].of(Coloured)
    assert mark.joined
    true = path(np.linspace(0.0, path.length, 200_000))
    share = np.linspace(0.0, 1.0, 9)[:, None, None]
    drawn = (mark.place[:-1] * (1.0 - share) + mark.place[1:] * share).reshape(-1, 2)
    off = cKDTree(true).query(drawn)[0]
    assert off.max() < np.ptp(true, axis=0).max() / 600.0  # a pixel of a picture of 600
    t, s = mark.hover[:, 0], mark.hover[:, 1]
    assert np.allclose(mark.shades["feed"].values, 60.0 * run.law.feed(t), atol=1e-6)
    assert np.allclose(run.law(t), s)


def test_a_limit_that_axes_share_has_the_colour_of_none_of_them():
    run = sf.run(motions.smooth(), sf.Limits(feed=60, axis_acceleration=500, axis_jerk=[20000, 15000]))
    panels = {panel.y.label.split(" (")[0]: panel for panel in sf.plot.motion(run).panels}
    (shared, _), own = panels["axis acceleration"].of(Level), panels["axis jerk"].of(Level)
    assert shared.colour not in theme.COLOURS
    assert {level.colour for level in own} == {theme.colour(0), theme.colour(1)}
