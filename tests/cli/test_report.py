"""`splinefeed report`: the page of a run made again, and what cannot be reported on."""

from __future__ import annotations

import json


def test_the_report_is_made_again_from_the_folder(splinefeed, folder):
    words = ["run", "smooth.json", "--no-compare", "-o", "out", "--axis-jerk", "20000", "--axis-accel", "500", "--json"]
    page = json.loads(splinefeed(*words).stdout)
    assert "out/report.html" in page["files"]
    assert "out/law.h5" in page["files"]
    first = (folder / "out/report.html").read_text(encoding="utf-8")
    again = splinefeed("report", "out", "-o", "again.html", "--json")
    assert again.exit_code == 0
    said = json.loads(again.stdout)
    assert said["files"] == ["again.html"]
    assert said["limits"] == page["limits"]
    assert (folder / "again.html").read_text(encoding="utf-8") == first


def test_what_cannot_be_reported_on(splinefeed, folder):
    result = splinefeed("report", "nowhere")
    assert result.exit_code == 2
    assert "nowhere/run.json: no such file; check the name and the folder" in result.stderr
    (folder / "odd").mkdir()
    (folder / "odd/run.json").write_text("[]")
    assert "is not the record of a run" in splinefeed("report", "odd").stderr
    (folder / "odd/run.json").write_text("{}")
    assert "is not the record of a run; give a folder of splinefeed run" in splinefeed("report", "odd").stderr
    for page, reason in (
        ('"methods": [{"method": 1}]', "run.json: methods[0]: title is missing"),
        ('"methods": [{"odd": 1}]', 'run.json: methods[0]: key "odd" is not known'),
        ('"settings": 1e999', "run.json: settings: is not an object"),
        ('"name": ' + "[" * 5000, "run.json: is nested too deeply"),
        ('"name": "a", "name": "b"', 'key "name" appears twice'),
    ):
        (folder / "odd/run.json").write_text(f'{{"program": "splinefeed 1", {page}}}')
        result = splinefeed("report", "odd")
        assert result.exit_code == 2 and reason in result.stderr and result.stderr.count("\n") == 1
    (folder / "odd/run.json").write_text('{"program": "splinefeed 1"}')
    assert "has no setpoints that can be read again" in splinefeed("report", "odd").stderr
