"""A measure of runs is one class and one line: numbers, summary, report, studio and sweeps tell it by themselves."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.cli import summary
from splinefeed.reports import record
from splinefeed.runs import measures
from splinefeed.runs import run as runs
from splinefeed.runs.measure import Measure, MeasureLabel


class LongestStep(Measure):
    """The longest way between two setpoints, mm."""

    label = MeasureLabel("longest step", "longest_step_mm", "mm")
    columns = ("longest_step_mm",)

    def __init__(self, given):
        super().__init__(given)
        self.longest = 0.0

    def feed(self, chunk):
        position = chunk.around.position
        self.longest = max(self.longest, float(np.linalg.norm(np.diff(position, axis=0), axis=1).max()))

    def numbers(self, verdict):
        return {"longest_step_mm": self.longest}


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> sf.Run:
    more = (*measures.MEASURES, LongestStep)
    monkeypatch.setattr(runs, "MEASURES", more)
    monkeypatch.setattr(measures, "MEASURES", more)
    return sf.run(sf.shapes.butterfly(), sf.Limits(feed=60, acceleration=500, jerk=20000))


def test_its_number_is_told_everywhere(run: sf.Run, tmp_path: Path) -> None:
    page = record.record(run, {})
    assert page["longest_step_mm"] == pytest.approx(60e-3, rel=1e-3)
    label = [dataclasses.asdict(each.label) for each in run.measures]
    assert label[-1] == {"name": "longest step", "key": "longest_step_mm", "unit": "mm", "beside": None}
    said = "\n".join(str(line) for block in summary.run({**page, "name": "butterfly"}) for line in block)
    assert "longest step at most 0.06 mm" in said
    sf.report(run, tmp_path / "out")
    assert "<dt>longest step</dt><dd>60 µm" in (tmp_path / "out/report.html").read_text(encoding="utf-8")


def test_the_measures_that_are_there_keep_their_names(run: sf.Run) -> None:
    numbers = run.numbers()
    assert numbers["ripple_max"] == run.ripple.max < 1e-9
    assert 0.0 < numbers["chord_error_max_mm"] == run.chord_error_mm < 1e-2
