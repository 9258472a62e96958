"""Tool paths as JSON: what is read, what is written, and what is refused with its place."""

from __future__ import annotations

import json
import math
from pathlib import Path as File
from typing import Any

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import FormatError
from tool_paths import flank, random_tool_path

LINE = {"degree": 1, "knots": [0, 0, 1, 1], "tool_tip": [[0, 0, 0], [10, 0, 0]]}
LEAN = {**LINE, "tool_axis_vectors": [[0, 0, 1], [0.3, 0, 1]]}


def read(folder: File, document: Any) -> sf.ToolPath:
    (folder / "part.json").write_text(json.dumps(document))
    path = sf.read(folder / "part.json")
    assert isinstance(path, sf.ToolPath)
    return path


def axis_at(path: sf.ToolPath, s: float) -> list[float]:
    curve, u = path.locate(np.array([s]))
    found: list[float] = path.orientation(curve, u)[0, 0].tolist()
    return found


def test_the_paper_s_path_is_read(data_dir: File) -> None:
    path = sf.read(data_dir / "five-axis" / "flank_milling_2022.json")
    assert isinstance(path, sf.ToolPath)
    assert path.name == "flank milling, dual cubic B-spline"
    assert path.findings == ("limits in the file are not read; give those of the machine",)
    assert path.length == flank(data_dir).length
    assert axis_at(path, 0.0) == [-5.0, 0.0, 15.0]


def test_every_kind_of_tool_axis_is_read(tmp_path: File) -> None:
    assert axis_at(read(tmp_path, LEAN), 10.0) == [0.3, 0.0, 1.0]
    point = {**LINE, "units": "in", "second_point_on_tool_axis": [[0, 0, 1], [10, 1, 1]]}
    path = read(tmp_path, point)
    assert path.length == 254.0
    assert axis_at(path, 254.0) == pytest.approx([0.0, 25.4, 25.4])
    turned = read(tmp_path, {**LINE, "rotary_angles": [[30, 0], [30, 90]]})
    assert axis_at(turned, 10.0) == pytest.approx([math.pi / 6.0, math.pi / 2.0])
    upright = read(tmp_path, LINE)
    assert upright.tool_axis is None
    bend = {"axis_degree": 2, "axis_knots": [0, 0, 0, 1, 1, 1], "tool_axis_vectors": [[0, 0, 1], [1, 0, 1], [0, 0, 1]]}
    assert axis_at(read(tmp_path, {**LEAN, **bend}), 5.0) == [0.5, 0.0, 1.0]


def test_tool_paths_are_written_and_read_again(tmp_path: File) -> None:
    shared = random_tool_path(5)
    two = [{**LEAN}, {**LEAN, "tool_tip": [[10, 0, 0], [10, 5, 0]], "tool_axis_vectors": [[0.3, 0, 1], [0, 0, 2]]}]
    for path in (shared, read(tmp_path, {"curves": two, "units": "mm"}), read(tmp_path, LINE)):
        assert sf.write(path, tmp_path / "again.json") == ()
        again = sf.read(tmp_path / "again.json")
        assert isinstance(again, sf.ToolPath)
        s = np.linspace(0.0, path.length, 20)
        assert np.array_equal(again(s), path(s))
        if path.tool_axis is not None:
            where = path.locate(s)
            assert np.array_equal(again.orientation(*where), path.orientation(*where))


def test_what_a_five_axis_program_says_is_kept(tmp_path: File, data_dir: File) -> None:
    path = sf.read(data_dir / "five-axis" / "fanuc_g434.nc")
    assert isinstance(path, sf.ToolPath) and path.feeds is not None
    assert np.all(path.tool_axis[-1].control_points == path.tool_axis[-1].control_points[0])  # type: ignore[index]
    assert sf.write(path, tmp_path / "again.json") == ()
    again = sf.read(tmp_path / "again.json")
    assert isinstance(again, sf.ToolPath) and again.rotary == ("a", "c") and np.array_equal(again.feeds, path.feeds)
    s = np.linspace(0.0, path.length, 20)
    where = path.locate(s)
    assert np.allclose(again.orientation(*where), path.orientation(*where), rtol=0.0, atol=1e-15)
    longer = sf.ToolPath(path.curves, path.tool_axis, kind="angles", rotary=("b", "c"), tool_length=80.5)
    sf.write(longer, tmp_path / "again.json")
    again = sf.read(tmp_path / "again.json")
    assert isinstance(again, sf.ToolPath) and (again.rotary, again.tool_length) == (("b", "c"), 80.5)


def test_a_format_without_tool_axes_says_so(tmp_path: File) -> None:
    said = sf.write(read(tmp_path, LEAN), tmp_path / "part.dxf")
    assert "the tool axis of part is left out: a DXF drawing cannot hold it" in said


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"tool_tip": [[0, 0], [1, 0]]}, "2 axes; a tool tip has 3"),
        ({"tool_axis_vectors": [[0, 0, 0], [0, 0, 0]]}, "no length"),
        ({"tool_axis_vectors": [[0, 0, 1]]}, "tool_axis_vectors: "),
        ({"tool_axis_vectors": [[0, 0, "up"], [0, 0, 1]]}, r'tool_axis_vectors\[0\]\[2\]: "up" is not a number'),
        ({"rotary_angles": [[0, 0], [0, 0]]}, "tool_axis_vectors and rotary_angles are both given"),
        ({"degree": True}, "degree: true is not a whole number"),
        ({"axis_knots": [0, 0, 2, 2]}, "runs over u = 0 to 2, its tip over 0 to 1"),
        ({"colour": "red"}, 'key "colour" is not known'),
        ({"units": "furlong"}, 'units: "furlong" is not known'),
        ({"name": 7}, "name: 7 is not text"),
        ({"rotary_axes": ["q"]}, "rotary_axes: expected a list of a, b, c, theta"),
        ({"rotary_axes": ["a"]}, "rotary is a; name the columns of a tool axis of angles"),
        ({"tool_length": "long"}, 'tool_length: "long" is not a number'),
    ],
)
def test_bad_tool_paths_are_refused_with_their_place(tmp_path: File, change: dict[str, Any], said: str) -> None:
    with pytest.raises(FormatError, match=said) as caught:
        read(tmp_path, {**LEAN, **change})
    assert str(caught.value).startswith(str(tmp_path / "part.json"))


def test_bad_lists_are_refused(tmp_path: File) -> None:
    with pytest.raises(FormatError, match="knots is missing; needed are degree, knots, tool_tip"):
        read(tmp_path, {"degree": 1, "tool_tip": [[0, 0, 0], [1, 0, 0]]})
    with pytest.raises(FormatError, match=r"curves\[1\]: is not an object"):
        read(tmp_path, {"curves": [LEAN, 3]})
    with pytest.raises(FormatError, match="curves: not all give their tool axis alike"):
        read(tmp_path, {"curves": [LEAN, LINE]})
