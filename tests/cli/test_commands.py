"""The other commands: their JSON is the API's, and their text is plain."""

from __future__ import annotations

import itertools
import json
import re
import subprocess
import sys

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.cli.main import COMMANDS

SQUARE = [[0, 0], [10, 0], [10, 10], [0, 10], [0, 0]]


@pytest.fixture
def square(folder):
    """A square of four lines: one path with three corners to stop at."""
    lines = [
        {"degree": 1, "knots": [0, 0, 1, 1], "control_points": [start, end]}
        for start, end in itertools.pairwise(SQUARE)
    ]
    (folder / "square.json").write_text(json.dumps({"name": "square", "units": "mm", "curves": lines}))
    return "square.json"


@pytest.fixture
def apart(folder):
    """Two lines that do not meet: two paths."""
    lines = [
        {"name": name, "degree": 1, "knots": [0, 0, 1, 1], "control_points": points}
        for name, points in (("low", [[0, 0], [10, 0]]), ("high", [[0, 5], [20, 5]]))
    ]
    (folder / "apart.json").write_text(json.dumps({"units": "mm", "curves": lines}))
    return "apart.json"


def answer(result):
    assert result.exit_code == 0, result.stderr
    assert result.stderr == ""
    return json.loads(result.stdout)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_examples(splinefeed, command):
    result = splinefeed(command, "--help")
    assert result.exit_code == 0
    assert result.stdout.count(f"\n    splinefeed {command}") >= 2
    assert "--json" in result.stdout
    if command in ("run", "plan", "compare", "info"):
        assert "bare numbers are mm" in result.stdout


def test_help_lists_every_command(splinefeed):
    text = splinefeed("--help").stdout
    for name, words in COMMANDS.items():
        assert f"  {name} " in text
        assert words.split(";")[0][:40] in text


def test_no_command_is_a_call_for_help(splinefeed):
    result = splinefeed()
    assert result.exit_code == 0
    assert result.stdout == splinefeed("--help").stdout == splinefeed("-h").stdout


def test_plan(splinefeed, folder):
    page = answer(splinefeed("plan", "smooth.json", "--feed", "20", "--json", "-o", "law.h5"))
    path = sf.read("smooth.json")
    law = sf.plan(path, sf.Limits(feed=20, acceleration=50, jerk=2000), period=1e-3)
    assert page["ok"]
    assert page["duration_s"] == law.duration
    assert page["length_mm"] == path.length
    assert page["period_s"] == 1e-3
    assert page["strategy"] == "seven-phase"
    assert [piece["start_s"] for piece in page["pieces"]] == law.breaks[:-1].tolist()
    assert [piece["jerk_mm_s3"] for piece in page["pieces"]] == law.jerk(law.breaks[:-1]).tolist()
    assert page["files"] == ["law.h5"]
    loaded = sf.load(folder / "law.h5")
    assert np.array_equal(loaded.coefficients, law.coefficients)


def test_plan_in_words(splinefeed, square):
    result = splinefeed("plan", square)
    assert result.exit_code == 0
    assert "square: 40 mm in " in result.stdout
    assert "the tool stops exactly at 3 corners; at the feeds alone the path takes" in result.stdout
    assert "... and " not in result.stdout
    assert [line.split()[0] for line in result.stdout.splitlines() if line[:5].strip().isdigit()] == [
        str(i) for i in range(24)
    ]


def test_compare(splinefeed):
    page = answer(splinefeed("compare", "smooth.json", "--methods", "taylor-2, arc-length", "--json"))
    path = sf.read("smooth.json")
    law = sf.plan(path, sf.Limits(feed=60, acceleration=50, jerk=2000), period=1e-3)
    assert [each["method"] for each in page["methods"]] == ["taylor-2", "arc-length"]
    for each in page["methods"]:
        points = sf.interpolate(path, law, method=each["method"])
        ripple = sf.analysis.feed_ripple(points, path, law)
        assert (each["ripple_max"], each["ripple_rms"]) == (ripple.max, ripple.rms)
        assert each["ns_per_tick"] > 0
        assert {"drift_mm", "chord_error_mm"} <= set(each)
    assert page["ticks"] == len(points)
    assert page["limits"]["acceleration"] == 50


def test_compare_in_words(splinefeed):
    result = splinefeed("compare", "smooth.json")
    lines = result.stdout.splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("method"))
    for title in ("ripple max", "rms", "drift (mm)", "chord (mm)", "ns"):
        assert title in lines[head]
    assert max(len(line) for line in lines if not line.startswith("note")) <= 80
    assert [line.split()[0] for line in lines[head + 1 :]] == list(sf.interpolation.methods())


def test_a_minus_reads_standard_input():
    program = "G21 G90 G17\nG0 X0 Y0 Z0\nG1 X40 F600\nY30\nX0\nY0\nM30\n"
    words = [sys.executable, "-m", "splinefeed", "info", "-", "--json"]
    found = subprocess.run(words, input=program, capture_output=True, text=True, check=True)
    assert json.loads(found.stdout)["paths"][0]["length_mm"] == pytest.approx(140.0)


def test_standard_input_without_an_end_is_refused():
    code = (
        "from splinefeed.cli import main, options\n"
        "options.MAX_STANDARD_INPUT_BYTES = 2**20\n"
        "main.command_line.main(['info', '-'])\n"
    )
    found = subprocess.run([sys.executable, "-c", code], input="G1 X1\n" * 2**18, capture_output=True, text=True)
    assert found.returncode == 2
    assert "standard input is longer than 1 MB; give the name of a file" in found.stderr


def test_corners_that_are_alike_are_counted(splinefeed, square):
    assert "    at 10 mm: turns by 90 deg, and " in splinefeed("info", square).stdout


def test_info(splinefeed, square):
    page = answer(splinefeed("info", square, "--json"))
    (path,) = page["paths"]
    assert path["curves"] == 4
    assert path["degrees"] == [1]
    assert path["length_mm"] == 40.0
    assert path["bbox_min"] == [0.0, 0.0]
    assert path["bbox_max"] == [10.0, 10.0]
    assert path["closed"] is True
    assert path["min_radius_mm"] is None
    assert path["corners"] == 3
    assert path["gaps"] == 0
    assert [corner["angle_deg"] for corner in path["corner_places"]] == pytest.approx([90.0] * 3)
    assert page["curves"][3] == {
        "path": 1,
        "degree": 1,
        "control_points": 2,
        "spans": 1,
        "rational": False,
        "closed": False,
        "length_mm": 10.0,
    }
    assert page["units"] == "mm"
    assert page["findings"] == []
    text = splinefeed("info", square).stdout
    assert "square: closed, 40 mm, axes x y" in text
    assert "    at 10 mm: turns by 90 deg" in text
    assert "least radius of curvature none (straight lines)" in text
    assert "  3 corners to stop at, 0 jumps of curvature\n" in text


def test_info_counts_stops_of_the_program_where_no_corner_is(splinefeed, folder):
    (folder / "waits.ngc").write_text("G21 G1 X0 Y0 F60\nX10\nG4 P1\nX20\nM0\nX30\nY10\nM2\n")
    text = splinefeed("info", folder / "waits.ngc").stdout
    assert "  1 corner to stop at, 0 jumps of curvature, 2 other stops of the program\n" in text


def test_info_says_places_in_mm_where_the_last_axis_turns(splinefeed, folder):
    (folder / "joints.ngc").write_text("G1 X0 Y0 Z0 A0 F60\nX10 A1\nX10 Y10 A2\nM2\n")
    assert re.search(r"    at [\d.]+ mm: turns by", splinefeed("info", "joints.ngc").stdout)


def test_info_of_a_long_program_lists_the_first_curves_or_all(splinefeed, folder):
    (folder / "long.ngc").write_text("G1 X0 Y1 F60\n" + "".join(f"X{i}\n" for i in range(1, 5101)))
    page = answer(splinefeed("info", "long.ngc", "--json"))
    assert (page["paths"][0]["curves"], len(page["curves"]), page["curves_left_out"]) == (5101, 5000, 101)
    assert page["curves"][1] == {
        "path": 1, "degree": 1, "control_points": 2, "spans": 1, "rational": False, "closed": False, "length_mm": 1.0,
    }  # fmt: skip
    assert len(answer(splinefeed("info", "long.ngc", "--json", "--all"))["curves"]) == 5101
    assert answer(splinefeed("info", "long.ngc", "--json", "--path", "1"))["curves_left_out"] == 0


def test_info_of_several_paths(splinefeed, refused, apart):
    page = answer(splinefeed("info", apart, "--json"))
    assert [path["name"] for path in page["paths"]] == ["low", "high"]
    assert [curve["path"] for curve in page["curves"]] == [1, 2]
    assert answer(splinefeed("info", apart, "--path", "high", "--json"))["paths"][0]["length_mm"] == 20.0
    assert answer(splinefeed("plan", apart, "--path", "2", "--json"))["length_mm"] == 20.0
    whole = answer(splinefeed("plan", apart, "--json"))  # one motion: 10 mm, 5 mm across and 20 mm back from (10, 5)
    assert whole["length_mm"] == 10.0 + 11.180339887498949 + 20.0
    text = splinefeed("info", apart).stdout
    assert "low: open, 10 mm" in text
    assert "1 (path 2)" in text


def test_info_tells_what_the_reader_found(splinefeed, folder):
    curve = json.loads((folder / "smooth.json").read_text())
    del curve["units"]
    (folder / "bare.json").write_text(json.dumps(curve))
    assert answer(splinefeed("info", "bare.json", "--json"))["findings"] == ["no units are given; read as mm"]
    assert "note      no units are given; read as mm" in splinefeed("info", "bare.json").stdout


def test_methods(splinefeed):
    page = answer(splinefeed("methods", "--json"))
    assert [each["name"] for each in page["methods"]] == list(sf.interpolation.methods())
    orders = {each["name"]: each["order"] for each in page["methods"]}
    assert (orders["taylor-1"], orders["taylor-2"], orders["milne-simpson"], orders["arc-length"]) == (1, 2, 4, None)
    for each in page["methods"]:
        assert each["title"]
        assert each["source"]
        assert "stepping." not in each["source"]
    assert page["default"] in sf.interpolation.methods()
    text = splinefeed("methods").stdout
    for name in sf.interpolation.methods():
        assert f"\n{name} " in text
        assert f"\n  {name}: " in text


def test_version(splinefeed):
    assert splinefeed("version").stdout == f"splinefeed {sf.__version__}\n"
    assert splinefeed("--version").stdout == f"splinefeed, version {sf.__version__}\n"
    assert answer(splinefeed("version", "--json")) == {"splinefeed": sf.__version__}
    page = answer(splinefeed("version", "--verbose", "--json"))
    assert page["numpy"] == np.__version__
    assert page["compiled_kernels"]
    assert all(page.values())
    assert f"numpy            {np.__version__}\n" in splinefeed("version", "--verbose").stdout
