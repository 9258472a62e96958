"""`splinefeed sweep` and `sweep show`."""

from __future__ import annotations

import json
import re

SPEC = """
sources = ["circle?radius=1", "nothing.json"]
[set]
machine = "xytheta"
[grid]
"limits.feed" = [10, 20]
[output]
setpoints = true
reports = true
"""


def test_a_sweep_and_what_it_came_to(splinefeed, folder):
    (folder / "nothing.json").write_text("{}")
    (folder / "night.toml").write_text(SPEC)
    result = splinefeed("sweep", "night.toml", "--workers", "0", "--json")
    assert result.exit_code == 1  # a source that is none
    page = json.loads(result.stdout)
    assert (page["runs"], page["there"], page["ok"], page["failed"]) == (4, 4, 2, 2)
    assert "nothing.json" in page["failures"][0]["error"]
    out = folder / "splinefeed-sweep-night"
    assert (out / "rows/part-000000.parquet").is_file()
    assert (out / "runs/0000001/setpoints.h5").is_file()
    assert "Checked: every limit holds" in (out / "runs/0000001/report.html").read_text(encoding="utf-8")
    text = (out / "sweep.html").read_text(encoding="utf-8")
    assert "4 of 4 runs: 2 ok, 0 not kept, 2 failed" in text
    drawn = json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])["figures"]["parallel"]["data"][0]
    times = next(each["values"] for each in drawn["dimensions"] if each["label"] == "time (s)")
    assert len(times) == 2  # runs that failed have no time, and are not drawn as if they had
    assert min(times) == page["numbers"]["duration_s"]["least"]
    again = splinefeed("sweep", "show", "splinefeed-sweep-night")
    assert "night: 4 of 4 runs" in again.stdout
    assert "duration_s" in again.stdout


def test_what_cannot_be(splinefeed, folder):
    (folder / "bad.toml").write_text("sources = []\n[grid]\nmetod = [1]\n")
    result = splinefeed("sweep", "bad.toml")
    assert result.exit_code == 2
    assert "bad.toml: 2 errors" in result.stderr
    assert splinefeed("sweep", "show").exit_code == 2
    assert "is not a folder of a sweep" in splinefeed("sweep", "show", "bad.toml").stderr
    assert "give one spec" in splinefeed("sweep", "a.toml", "b").stderr


def test_limits_are_completed_as_run_completes_them(splinefeed, folder):
    """The axis that is not given keeps its machine's limits, and a program's feeds hold."""
    (folder / "part.nc").write_text("G21 G90\nG0 X0 Y0\nG1 X8 Y2 F1200\nX3 Y9 F900\nM2\n")
    (folder / "one.toml").write_text(
        'sources = ["part.nc"]\n[set]\nmachine = "xytheta"\n[grid]\n"limits.axis_jerk.x" = [9000]\n'
    )
    swept = json.loads(splinefeed("sweep", "one.toml", "--workers", "0", "--json").stdout)
    words = ("--machine", "xytheta", "--axis-jerk", "x=9000", "--no-figures", "--json")
    run = json.loads(splinefeed("run", "part.nc", *words).stdout)
    assert swept["numbers"]["duration_s"]["least"] == run["duration_s"]
    assert run["limits"]["axis_jerk.y"]["limit"] != 9000
    assert run["limits"]["feed"]["limit"] in (15.0, 20.0)
