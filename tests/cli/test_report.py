"""`splinefeed report`: the page of a run made again, and what cannot be reported on."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest

import fuzzing


def test_the_report_is_made_again_from_the_folder(splinefeed, folder):
    words = ["run", "smooth.json", "-o", "out", "--axis-jerk", "20000", "--axis-accel", "500", "--json"]
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


@pytest.mark.parametrize(
    ("column", "text", "reason"),
    [(0, "59.5", "t[6] is 0.03 s, behind 59.5 s; times must grow"), (1, "6", "is on curve 6; the path has 1 curve(s)")],
)
def test_setpoints_of_no_run_are_refused_in_one_line(splinefeed, folder, column, text, reason):
    words = ("circle?radius=2", "--feed", "60", "--accel", "500", "--jerk", "20000", "--period", "5ms")
    assert splinefeed("run", *words, "--format", "csv", "--no-figures", "-o", "out").exit_code == 0
    page = json.loads((folder / "out/run.json").read_text())
    (folder / "out/run.json").write_text(json.dumps({**page, "sha256": {}}))
    lines = (folder / "out/setpoints.csv").read_text().splitlines()
    numbers = lines[8].split(",")
    lines[8] = ",".join([*numbers[:column], text, *numbers[column + 1 :]])
    (folder / "out/setpoints.csv").write_text("\n".join([*lines, ""]))
    result = splinefeed("report", "out")
    assert result.exit_code == 2 and result.stderr.count("\n") == 1
    assert "out/setpoints.csv: " in result.stderr and reason in result.stderr


@pytest.mark.slow
def test_changed_folders_of_a_run_are_reported_or_refused_in_one_line(splinefeed, folder):
    words = ("circle?radius=2", "--feed", "60", "--accel", "500", "--jerk", "20000", "--period", "5ms")
    assert splinefeed("run", *words, "--format", "csv", "--no-figures", "-o", "whole").exit_code == 0
    rng = np.random.default_rng(40)
    for k in range(400):
        place = folder / f"changed{k}"
        shutil.copytree(folder / "whole", place)
        name = ("run.json", "setpoints.csv", "law.h5")[rng.choice(3, p=[0.5, 0.4, 0.1])]
        content = (place / name).read_bytes()
        change = fuzzing.changed if name == "law.h5" or k % 2 else fuzzing.retold
        (place / name).write_bytes(change(rng, content))
        asked = ("report", str(place)) if k % 3 else ("check", str(place / "setpoints.csv"))
        result = splinefeed(*asked)
        assert result.exit_code in (0, 1, 2), (k, name, result.stderr)
        assert result.exit_code != 2 or result.stderr.count("\n") <= 3, (k, name, result.stderr)
