"""Long curves: what a page carries and draws of them against the curves themselves, whole and zoomed."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.reports import html
from splinefeed.reports.detail import DetailStore
from splinefeed.reports.figure import Figure, Line, Panel, PlotAxis
from splinefeed.reports.files import of_run
from splinefeed.reports.html import page
from splinefeed.reports.layout import Stroke, layout
from splinefeed.reports.record import about, record
from splinefeed.runs import run as runs
from studio_tools import PATIENCE, taken


@pytest.mark.parametrize("count", [1, 255, 257, 100_003])
def test_a_store_gives_back_what_it_was_given(count):
    rng = np.random.default_rng(count)
    x = np.cumsum(rng.choice([0.0, 1e-3, 0.25], count))
    y = np.where(rng.random(count) < 0.01, np.nan, np.cumsum(rng.normal(size=count)) * 1e4)
    store = DetailStore()
    found = store.curve(x, y)
    assert store.curve(x, y) == found  # once
    np.testing.assert_allclose(taken(store.text(), store.series, found["x"]), x, atol=1e-9 * max(1, count / 2))
    given = taken(store.text(), store.series, found["y"])
    np.testing.assert_array_equal(np.isnan(given), np.isnan(y))
    scale = max(float(np.nanmax(y) - np.nanmin(y)), 1e-300) if np.isfinite(y).any() else 1.0
    np.testing.assert_allclose(given, y, atol=scale / 65000, equal_nan=True)


def test_of_more_points_than_it_may_keep_a_store_has_the_least_and_the_greatest():
    t = np.arange(100_000) * 1e-3
    y = np.sin(40.0 * t)
    y[77_777] = 9.0
    store = DetailStore(most=500)
    found = store.curve(t, y)
    low, high = (taken(store.text(), store.series, found[name]) for name in ("low", "high"))
    edges = taken(store.text(), store.series, found["x"])
    assert len(low) == len(high) == len(edges) - 1 <= 500
    stretch = np.searchsorted(edges[1:-1], t, "right")
    assert np.all(y >= low[stretch] - 1e-3)
    assert np.all(y <= high[stretch] + 1e-3)
    assert high.max() == pytest.approx(9.0)


def test_paper_has_the_area_between_the_least_and_the_greatest(run):
    figure = sf.plot.motion(run)
    sheet = layout(figure)
    areas = [item for item in sheet.items if isinstance(item, Stroke) and item.fill]
    assert len(areas) >= 10
    points = max(len(line.x) for panel in figure.panels for line in panel.of(Line))
    said = f"{points:,} points: the area is from the least"
    assert points >= run.ticks and any(said in getattr(item, "text", "") for item in sheet.items)
    jerks = [each for each in areas if each.clip == areas[3].clip]
    assert max(np.ptp(each.points[:, 1]) for each in jerks) > 0.7 * figure.panels[3].height  # no peak is lost


@pytest.fixture(scope="module")
def run() -> sf.Run:
    """Some 191,000 setpoints, most of which are alike; the corners take milliseconds."""
    return sf.run(sf.shapes.butterfly(), sf.Limits(feed=2, axis_acceleration=500, axis_jerk=20000))


#: Points of a curve as they are drawn, pixels in its panel, and the size of that.
DRAWN = """(name) => { const p = document.getElementById("motion"), d = p._fullData.find((each) => each.name === name);
  const l = p._fullLayout, x = l[d.xaxis.replace("x", "xaxis")], y = l[d.yaxis.replace("y", "yaxis")];
  const num = (v) => (v === null || v === undefined ? NaN : v);
  return { x: Array.from(d.x, (v) => x.l2p(num(v))), y: Array.from(d.y, (v) => y.l2p(num(v))), wide: x._length,
    seen: x.range, tall: y._length, at: [y.range[0], y.range[1]], area: d.fill === "toself" }; }"""


def columns(x: np.ndarray, y: np.ndarray, wide: float) -> tuple[np.ndarray, np.ndarray]:
    """The least and the greatest of a line through points, in each column of pixels."""
    ends = np.arange(np.ceil(wide) + 1.0)
    pieces = np.flatnonzero(np.isfinite(x[:-1] + x[1:] + y[:-1] + y[1:]))
    low, high = np.full(len(ends) - 1, np.inf), np.full(len(ends) - 1, -np.inf)
    for k in pieces.tolist():
        one, two = sorted([(x[k], y[k]), (x[k + 1], y[k + 1])])
        for column in range(max(int(one[0]), 0), min(int(two[0]), len(low) - 1) + 1):
            at = np.clip([column, column + 1.0], one[0], two[0])
            there = np.interp(at, [one[0], two[0]], [one[1], two[1]]) if two[0] > one[0] else [one[1], two[1]]
            low[column], high[column] = min(low[column], *there), max(high[column], *there)
    return low, high


#: Motions by name: a path, limits, and the time at which it is looked at closely, s.
MOTIONS = {
    "short": (sf.shapes.butterfly, sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000), 3.0),
    "slow": (sf.shapes.butterfly, sf.Limits(feed=2, axis_acceleration=500, axis_jerk=20000), 48.7),
    "long": (sf.shapes.butterfly, sf.Limits(feed=1.2, axis_acceleration=500, axis_jerk=20000), 81.2),
    "in space": (sf.shapes.helix, sf.Limits(feed=1.5, acceleration=400, jerk=20000), 100.0),
}


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", MOTIONS)
def test_what_is_drawn_is_what_is_real_at_three_zooms(name, chromium, tmp_path, monkeypatch):
    make, limits, close = MOTIONS[name]
    run = sf.run(make(), limits)
    assert run.whole == (name != "long")
    end = run.duration
    file = tmp_path / "report.html"
    said = record(run, about(run.settings, name, {}, ["hdf5"]))
    file.write_text(page(run, said, of_run(run)), encoding="utf-8")
    monkeypatch.setattr(runs, "LONG", 10**9)
    every = run if run.whole else sf.run(make(), limits)
    block = 0.0 if run.whole else float(np.diff(run.bands["feed"].edges[:2])[0])
    assert block < end / 30_000
    shown = chromium.new_page(viewport={"width": 1280, "height": 900})
    shown.set_default_timeout(PATIENCE)
    shown.goto(file.as_uri())
    shown.wait_for_selector("html[data-ready=yes]")
    inner = run.law.breaks[1:-1]
    at = np.unique(np.concatenate([every.points.t, inner, np.nextafter(inner, 0.0)]))
    real = {
        "feed": (at, run.law.feed(at)),
        "jerk": (at, run.law.jerk(at)),
        "x jerk": (every.motion.late(every.kept.period), every.motion.jerk[:, 0]),
        "y velocity": (every.motion.late(every.kept.period), every.motion.velocity[:, 1]),
    }

    for zoom in (None, (close - 0.03 * end, close + 0.03 * end), (close, close + 0.08)):
        if zoom:
            shown.evaluate("([a, b]) => Plotly.relayout('motion', {'xaxis.range[0]': a, 'xaxis.range[1]': b})", zoom)
            shown.wait_for_function(
                "(a) => document.getElementById('limits')._fullLayout.xaxis.range[0] === a", arg=zoom[0]
            )
        for curve, (t, values) in real.items():
            drawn = shown.evaluate(DRAWN, curve)
            (start, stop), (bottom, top) = drawn["seen"], drawn["at"]
            x = (t - start) / (stop - start) * drawn["wide"]
            y = (top - values) / (top - bottom) * drawn["tall"]
            near = (x > -drawn["wide"]) & (x < 2.0 * drawn["wide"])
            truth = columns(x[near], y[near], drawn["wide"])
            seen = columns(*(np.array(drawn[each], dtype=np.float64) for each in ("x", "y")), drawn["wide"])
            whole = block + every.kept.period if block else 0.0  # an area has a block and the tick at its right edge
            beside = 1 + int(np.ceil(whole / (stop - start) * drawn["wide"]))
            inside = slice(beside + 1, len(truth[0]) - beside - 1)  # the picture's edge has no neighbour
            for own, other, far in ((truth, seen, 1), (seen, truth, beside)):
                shifts = range(-far, far + 1)
                low = np.minimum.reduce([np.roll(other[0], k) for k in shifts])
                high = np.maximum.reduce([np.roll(other[1], k) for k in shifts])
                assert np.all(own[0][inside] >= low[inside] - 1.0), (curve, zoom)
                assert np.all(own[1][inside] <= high[inside] + 1.0), (curve, zoom)
    told = shown.locator("#motion + .told").inner_text()
    assert ("this page has nothing finer" if block else "every one is drawn") in told
    shown.close()


@pytest.mark.slow
def test_the_page_of_an_hour_is_within_its_size_and_says_from_where_on_it_is_an_area(tmp_path):
    run = sf.run(sf.shapes.butterfly(), sf.Limits(feed=0.0915, axis_acceleration=500, axis_jerk=20000))
    assert run.ticks > 3_600_000
    sf.report(run, tmp_path / "hour")
    assert (tmp_path / "hour/report.html").stat().st_size < 8e6
    assert np.diff(run.bands["feed"].edges[:2])[0] == pytest.approx(0.064)
    assert "blocks of ticks: the area is from the least" in (tmp_path / "hour/motion.svg").read_text()


def test_a_page_of_more_than_its_size_keeps_fewer_stretches(monkeypatch):
    rng = np.random.default_rng(0)
    t = np.arange(20_000) * 1e-3
    lines = tuple(Line(t, rng.normal(size=len(t)), f"{k}") for k in range(8))
    figure = Figure("noise", (Panel(PlotAxis("time (s)"), PlotAxis("y"), lines),))
    whole = html._within({"noise": figure})[1]
    monkeypatch.setattr(html, "MOST_BYTES", 100_000)
    plain, store = html._within({"noise": figure})
    assert len(whole.text()) > 300_000 > 100_000 > len(store.text()) > 50_000
    detail = plain["noise"]["data"][0]["detail"]
    low, high = (taken(store.text(), store.series, detail[name]) for name in ("low", "high"))
    assert low.min() == pytest.approx(lines[0].y.min(), abs=1e-3)
    assert high.max() == pytest.approx(lines[0].y.max(), abs=1e-3)
