"""The figures show what the records say: units, limits and peaks, for every kind of path."""

from __future__ import annotations

import itertools
import re

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D

import motions
import splinefeed as sf
from splinefeed.analysis.motion import axis_motion
from splinefeed.report import drawing, theme
from splinefeed.report.figures import axes_figure, feed_figure, ripple_figure
from splinefeed.report.path_figure import path_figure

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


def motion_of(path):
    law = sf.plan(path, LIMITS, period=1e-3)
    points = sf.interpolate(path, law)
    return law, points, axis_motion(points, path, law)


def words(figure: Figure) -> list[str]:
    found = [text.get_text() for text in figure.texts] + ([figure.get_suptitle()] if figure.get_suptitle() else [])
    for ax in figure.axes:
        found += [ax.get_xlabel(), ax.get_ylabel(), ax.get_title(loc="left"), *(text.get_text() for text in ax.texts)]
    return [text for text in found if text]


@pytest.fixture(scope="module", params=PATHS)
def case(request):
    path = PATHS[request.param]
    return path, *motion_of(path)


def test_path_figure(case):
    path, _, points, _ = case
    figure = path_figure(path, points)
    labels = words(figure)
    assert any("mm/s" in text for text in labels)
    assert f"{path.axes[0]} (mm)" in labels
    ax = figure.axes[0]
    if path.linear >= 3 and np.ptp(points.position[:, 2]) > 0:
        assert isinstance(ax, Axes3D)
        assert ax.get_zlabel() == "z (mm)"
    elif path.linear > 1:
        assert ax.get_aspect() == 1.0
        assert any(text.startswith("start") for text in labels)
    (lines,) = (each for each in ax.collections if each.get_array() is not None)
    assert lines.norm.vmax == points.feed.max()
    assert len(lines.get_array()) <= len(points)


def test_feed_figure(case):
    path, law, _, _ = case
    figure = feed_figure(law, LIMITS, path.name)
    assert [ax.get_ylabel() for ax in figure.axes] == [
        "travelled (mm)",
        "feed (mm/s)",
        "acceleration (mm/s²)",
        "jerk (mm/s³)",
    ]
    assert figure.axes[-1].get_xlabel() == "time (s)"
    jerk = figure.axes[3].lines[0].get_ydata()
    assert jerk.max() == pytest.approx(law.jerk(law.breaks[:-1]).max())
    assert jerk.min() == pytest.approx(law.jerk(law.breaks[:-1]).min())
    assert {"A = 500 mm/s²", "-D = -500 mm/s²", "J = 20000 mm/s³"} <= set(words(figure))


def test_axes_figure(case):
    path, _, _, motion = case
    figure = axes_figure(motion, path, LIMITS)
    panels = dict(zip([ax.get_ylabel() for ax in figure.axes], figure.axes, strict=True))
    assert len(panels) == 3 * len(path.axes)
    for i, axis in enumerate(path.axes):
        length = "mm" if i < path.linear else "°"
        factor = 1.0 if i < path.linear else 180 / np.pi
        ax = panels[f"{axis} acceleration ({length}/s²)"]
        drawn = ax.lines[0].get_ydata()
        assert np.abs(drawn).max() == pytest.approx(factor * np.abs(motion.acceleration[:, i]).max())
        peak = np.abs(motion.acceleration[:, i]).max()
        if i < path.linear and peak > 0:
            assert f"{drawing.short(peak / 500)} times A" in ax.get_title(loc="left")
        else:
            assert "times" not in ax.get_title(loc="left")
    assert "A = 500 mm/s² and J = 20000 mm/s³" in figure.get_suptitle()


def test_peaks_beyond_the_path_are_coloured_and_very_high_ones_get_a_logarithm():
    path = motions.butterfly()
    _, _, motion = motion_of(path)
    figure = axes_figure(motion, path, LIMITS)
    velocity, jerk = figure.axes[0], figure.axes[4]
    assert velocity.get_yscale() == "linear"
    assert jerk.get_yscale() == "symlog"
    title = jerk.title if jerk.title.get_text() else jerk._left_title
    assert to_hex(title.get_color()) == theme.VERMILION.lower()
    assert re.search(r"peak \S+ = \d+ times J at ", title.get_text())


def test_ripple_figure():
    path = PATHS["smooth"]
    law = sf.plan(path, LIMITS, period=1e-3)
    traces = list(sf.compare(path, law, methods=["taylor-1", "milne-simpson", "arc-length"]))
    figure = ripple_figure(traces, "a path")
    assert [ax.get_title(loc="left").split("\n")[0] for ax in figure.axes] == [t.result.method for t in traces]
    for ax, trace in zip(figure.axes, traces, strict=True):
        assert ax.get_yscale() == "log"
        drawn = ax.lines[0].get_ydata()
        assert drawn.max() == pytest.approx(np.abs(trace.relative).max())
        assert trace.result.ripple_floor == pytest.approx(ax.lines[1].get_ydata()[0], rel=1.0)
        low, high = ax.get_ylim()
        assert low < trace.result.ripple_floor < high
        assert trace.result.ripple_max < high


def test_motions_too_short_for_a_ripple():
    path = line([0, 0], [1e-3, 0])
    law = sf.plan(path, LIMITS, period=0.01)
    ripple_figure(list(sf.compare(path, law, methods=["arc-length"])), "short")
    points = sf.interpolate(path, law)
    path_figure(path, points)
    feed_figure(law, LIMITS, "short")
    axes_figure(axis_motion(points, path, law), path, LIMITS)


def test_limits_that_are_not_there_are_not_drawn():
    path = PATHS["smooth"]
    law, _, motion = motion_of(path)
    limits = sf.Limits(feed=1e6)
    figure = feed_figure(law, limits, "free")
    limit_words = [text for text in words(figure) if "=" in text]
    assert limit_words == ["limit = 1e6 mm/s: beyond this scale"]
    assert "\n" not in axes_figure(motion, path, limits).get_suptitle()


def test_different_limits_of_speeding_up_and_down():
    path = PATHS["smooth"]
    limits = sf.Limits(feed=60, acceleration=500, deceleration=300, jerk=20000, deceleration_jerk=9000)
    law = sf.plan(path, limits, period=1e-3)
    found = words(feed_figure(law, limits, "two"))
    assert {"A = 500 mm/s²", "-D = -300 mm/s²", "slowing J = 9000 mm/s³", "slowing -J = -9000 mm/s³"} <= set(found)


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
    ("value", "text"), [(1539.6, "1540"), (1.43e5, "1.43e5"), (0.129, "0.129"), (60.0, "60"), (1e-9, "1e-9")]
)
def test_short_numbers(value, text):
    assert drawing.short(value) == text
