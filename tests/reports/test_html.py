"""report.html: what it says, that it stands alone, and that no peak is lost on its way to the screen."""

from __future__ import annotations

import base64
import dataclasses
import gzip
import html.parser
import json
import re
import sys

import numpy as np
import pytest

import motions
import splinefeed as sf
from splinefeed.reports import interactive, library
from splinefeed.reports.files import of_run
from splinefeed.reports.html import page
from splinefeed.reports.path_figures import path_figure
from splinefeed.reports.record import about, record
from studio_tools import taken

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000, axis_acceleration=450, axis_jerk=18000)


@pytest.fixture(scope="module")
def made():
    path = motions.smooth()
    run = sf.run(path, LIMITS, strategy="time-optimal")
    response = sf.runs.follow(run.points, sf.Machine.load("xytheta"), path=path)
    traces = list(sf.runs.compare(path, run.law, methods=["taylor-2", "arc-length"]))
    said = record(run, about(run.settings, "smooth.json", {}, ["hdf5"]), traces)
    return (
        run,
        response,
        traces,
        said,
        page(run, said, of_run(run, {"arc-length": response, "taylor-2": response}), [t.result for t in traces]),
    )


def data_of(text: str) -> dict:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    assert found
    return json.loads(found[1])


class Tags(html.parser.HTMLParser):
    """Start tags with their attributes, and ids."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict]] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))


def test_it_stands_alone_and_is_small(made):
    text = made[-1]
    assert len(text.encode()) < 5_000_000
    tags = Tags(re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL)).found
    for _, attributes in tags:
        assert not {"src", "href"} & set(attributes)
    ids = [attributes["id"] for _, attributes in tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert set(data_of(text)["figures"]) == {"path", "motion", "errors", "spectra", "limits"} <= set(ids)


def test_the_first_screen_says_what_came_out(made):
    run, _, _, said, text = made
    assert "Checked: every limit holds" in text
    assert f"{run.law.duration:.6g} s" in text
    assert "no motion within these limits is faster" in text
    for name in run.verdict.limits:
        assert name.replace("_", " ").replace(".", " ") in text
    assert said["command"].replace("'", "&#x27;") in text
    broken = dataclasses.replace(run, verdict=sf.check(run.points, run.path, dataclasses.replace(LIMITS, feed=30.0)))
    over = page(broken, {**said, "ok": False, "problems": list(broken.verdict.problems)}, of_run(run))
    assert re.search(r"Not kept: feed \S+ % over at \S+ s\.", over)
    assert "% over the limit of 30 mm/s" in over


def test_peaks_survive_thinning(made):
    run = made[0]
    data = data_of(made[-1])
    lines = {line["name"]: line for line in data["figures"]["motion"]["data"]}
    (points,) = re.findall(r'id="points">([^<]*)<', made[-1])
    law, inner = run.law, run.law.breaks[1:-1]
    at = np.concatenate([run.points.t, inner, np.nextafter(inner, 0.0)])  # both sides of where the jerk jumps
    for name, values in (("feed", law.feed(at)), ("jerk", law.jerk(at)), ("x jerk", run.motion.jerk[:, 0])):
        drawn = taken(points, data["series"], lines[name]["detail"]["y"])
        assert len(drawn) == len(np.unique(at)) if name != "x jerk" else len(values)
        assert drawn.max() == pytest.approx(values.max(), rel=1e-4)
        assert drawn.min() == pytest.approx(values.min(), rel=1e-4, abs=1e-6)
    colours = data["figures"]["path"]["colours"]
    assert max(colours["feed"]["values"]) == pytest.approx(run.points.feed.max(), rel=1e-4)
    assert {"feed", "curvature", "contour error", "nearest limit", "share of axis jerk x"} <= set(colours)


def test_hostile_names_stay_text(made):
    run, _, _, said, _ = made
    name = '</script><script>alert(1)</script> & "x" ${title} \x00'
    text = page(run, {**said, "name": name, "notes": [name], "settings": {"source": name}}, of_run(run))
    assert "<script>alert(1)" not in text
    assert "&lt;/script&gt;&lt;script&gt;alert(1)" in text


def test_in_space_on_one_axis_and_with_a_rotary_one():
    paths = [
        sf.shapes.helix(),
        sf.Path([sf.NurbsCurve(1, [0, 0, 1, 1], [[0.0], [20.0]])]),
        sf.paths.tangential(motions.smooth()),
    ]
    for path in paths:
        run = sf.run(path)
        figure = interactive.to_plain(path_figure(run))
        colours, space = figure["colours"], figure["space"]
        assert space == (path.linear == 3)
        assert len(figure["said"]) == len(colours["feed"]["values"])
        json.dumps(interactive.to_plain(sf.plot.motion(run)), allow_nan=False)


def test_without_plotly_the_mend_is_said(made, monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly", None)
    library.compressed.cache_clear()
    with pytest.raises(sf.SplinefeedError, match=r'pip install "splinefeed\[plots\]"'):
        page(made[0], made[3], of_run(made[0]))


def test_the_library_is_packed_whole_with_its_licence(monkeypatch, tmp_path):
    monkeypatch.setattr(library.platformdirs, "user_cache_path", lambda *_, **__: tmp_path / "cache")
    library.compressed.cache_clear()
    script, packed = library.script(), library.compressed()
    (kept,) = (tmp_path / "cache").iterdir()
    library.compressed.cache_clear()
    assert library.compressed() == kept.read_text() == packed
    assert gzip.decompress(base64.b64decode(library.compressed())).decode() == script
    assert "MIT license" in script[:300]
    assert script.rstrip().endswith("window.Plotly = Plotly;})();")


def test_a_library_of_another_make_is_taken_as_it_is(monkeypatch, tmp_path):
    (tmp_path / "plotly.min.js").write_text("/* of its own kind */ window.Plotly = {};")
    monkeypatch.setattr(library, "file", lambda: tmp_path / "plotly.min.js")
    assert library.script() == "/* of its own kind */ window.Plotly = {};"
