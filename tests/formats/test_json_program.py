"""Feeds, tolerances and markers of a path go to JSON and come back."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

import splinefeed as sf
from splinefeed.errors import FormatError

LINES = [sf.NurbsCurve.bezier([(0, 0), (1, 0)]), sf.NurbsCurve.bezier([(1, 0), (1, 2)])]


def test_what_a_program_said_comes_back(tmp_path: Path) -> None:
    markers = [
        sf.paths.Marker(0, "M3 S12000"),
        sf.paths.Marker(1, "", 0.25),
        sf.paths.Marker(1, "M62 P1", stop=False),
        sf.paths.Marker(2, "M2"),
    ]
    path = sf.Path(LINES, feeds=[10 / 3, math.inf], tolerances=[0, math.inf], markers=markers)
    sf.write(path, tmp_path / "a.json")
    back = sf.read(tmp_path / "a.json")
    assert back.feeds is not None and back.feeds.tolist() == [10 / 3, math.inf]
    assert back.tolerances is not None and back.tolerances.tolist() == [0, math.inf]
    assert back.markers == path.markers


def test_a_path_without_them_says_nothing(tmp_path: Path) -> None:
    sf.write(sf.Path(LINES), tmp_path / "a.json")
    assert "feed" not in (tmp_path / "a.json").read_text()
    back = sf.read(tmp_path / "a.json")
    assert back.feeds is None and back.tolerances is None and back.markers == ()


def document(**more: Any) -> dict[str, Any]:
    curves = [
        {"degree": 1, "knots": [0, 0, 1, 1], "control_points": [[k, 0], [k + 1, 0]], "feed": 1, "tolerance": 0.5}
        for k in range(2)
    ]
    curves[1] |= more
    return {"units": "in", "curves": curves}


def test_feeds_have_the_units_of_the_file_and_null_is_rapid(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(json.dumps(document(feed=None)))
    back = sf.read(tmp_path / "a.json")
    assert back.feeds is not None and back.feeds.tolist() == [25.4, math.inf]
    assert back.tolerances is not None and back.tolerances.tolist() == [12.7, 12.7]


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        ({"feed": 0}, 'curves[1]: feed: expected a number, greater than 0, or "rapid"'),
        ({"feed": "fast"}, 'curves[1]: feed: "fast" is not a number'),
        ({"tolerance": -1}, 'curves[1]: tolerance: expected a number, 0 or more, or "free"'),
        ({"before": {}}, "curves[1]: before: is not a list of at most 1000 markers"),
        ({"after": [{"txt": "M2"}]}, 'curves[1]: after[0]: key "txt" is not known; known are dwell, stop, text'),
        ({"before": [{"text": 3}]}, "curves[1]: before[0]: text: 3 is not text"),
        ({"before": [{"dwell": "1"}]}, 'curves[1]: before[0]: dwell: "1" is not a number'),
        ({"before": [{"dwell": -1}]}, "curves[1]: before[0]: a dwell of -1.0 s; it must be 0 or more and finite"),
    ],
)
def test_what_cannot_be_is_named(tmp_path: Path, more: dict[str, Any], reason: str) -> None:
    file = tmp_path / "a.json"
    file.write_text(json.dumps(document(**more)))
    with pytest.raises(FormatError) as caught:
        sf.read(file)
    assert str(caught.value) == f"{file}: {reason}"


def test_a_feed_for_some_curves_only_is_refused(tmp_path: Path) -> None:
    given = document()
    del given["curves"][1]["feed"]
    (tmp_path / "a.json").write_text(json.dumps(given))
    with pytest.raises(FormatError, match="curve 1 of a path has no feed, but others have; give all of them one"):
        sf.read(tmp_path / "a.json")
