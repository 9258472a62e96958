"""`splinefeed run`: its files, its numbers, and its words."""

from __future__ import annotations

import json
import re
import shlex
import sys

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.reports import files, record
from splinefeed.reports.figure import Figure
from splinefeed.runs.comparison import BESIDE_A_RUN

LIMITS = ["--feed", "3600mm/min", "--accel", "0.5m/s^2", "--jerk", "20000"]


@pytest.fixture
def api_run(folder):
    path = sf.read("smooth.json")
    return sf.run(path, sf.Limits(feed=60, acceleration=500, jerk=20000))


def test_json_is_the_api(splinefeed, folder, api_run):
    result = splinefeed("run", "smooth.json", *LIMITS, "--json", "--no-figures")
    assert result.exit_code == 0
    assert result.stderr == ""
    page = json.loads(result.stdout)
    expected = json.loads(json.dumps(api_run.numbers()))
    assert {key: page[key] for key in expected} == expected
    assert "methods" not in page
    assert page["files"] == [f"splinefeed-smooth/{name}" for name in ("setpoints.h5", "law.h5", "run.json")]
    assert all((folder / name).is_file() for name in page["files"])
    written = json.loads((folder / "splinefeed-smooth/run.json").read_text())
    assert set(written.pop("sha256")) == {"setpoints.h5", "law.h5"}
    assert {**written, "files": page["files"]} == page


def test_methods_are_compared_where_that_is_asked_for(splinefeed):
    page = json.loads(splinefeed("run", "smooth.json", *LIMITS, "--compare", "--json").stdout)
    assert [each["method"] for each in page["methods"]] == list(BESIDE_A_RUN)
    assert "splinefeed-smooth/ripple.svg" in page["files"]
    experiment = json.loads(splinefeed("run", "--json", "--no-figures").stdout)  # the paper's compares by itself
    assert [each["method"] for each in experiment["methods"]] == list(BESIDE_A_RUN)


def test_setpoints_load_back_with_all_that_repeats_the_run(splinefeed, folder, api_run):
    words = ["run", "smooth.json", *LIMITS, "-o", "out", "--no-figures"]
    assert splinefeed(*words, "--format", "hdf5", "--format", "csv", "--format", "mat").exit_code == 0
    page = json.loads((folder / "out/run.json").read_text())
    assert page["files"] == ["setpoints.h5", "setpoints.csv", "setpoints.mat", "law.h5", "run.json"]
    for name in page["files"][:-2]:
        points = sf.load(folder / "out" / name)
        assert np.array_equal(points.position, api_run.points.position)
        assert points.settings["limits"] == api_run.limits.as_dict()
        assert points.settings["command"] == page["command"]
        assert points.settings["source"]["sha256"] == page["source"]["sha256"]
    assert set(page["versions"]) == {"python", *record.PARTS}


def test_the_recorded_command_makes_the_same_setpoints(splinefeed, folder):
    words = ["run", "smooth.json", "--feed", "1in/s", "--decel", "33.3", "--period", "0.7ms", "--method", "hamming"]
    splinefeed(*words, "--corrections", "2", "-o", "first", "--no-figures")
    page = json.loads((folder / "first/run.json").read_text())
    again = shlex.split(page["command"])
    assert again[0] == "splinefeed"
    splinefeed(*again[1:], "-o", "second", "--no-figures")
    first, second = (sf.load(folder / name / "setpoints.h5") for name in ("first", "second"))
    assert np.array_equal(first.position, second.position)
    assert first.settings == second.settings


def test_what_people_read(splinefeed, folder):
    result = splinefeed("run", "smooth.json", "--compare", "-o", "out")
    text = result.stdout
    assert result.exit_code == 0
    assert "\x1b" not in text
    lines = text.splitlines()
    assert re.match(r"smooth: \d+\.\d+ mm in \d\.\d+ s, \d+ setpoints, one every 1 ms$", lines[0])
    assert "feed limit of 60 mm/s (3600 mm/min) reached" in lines[1]
    for name in ("feed", "acceleration", "deceleration", "jerk", "x", "y", *BESIDE_A_RUN):
        assert any(line.split()[:1] == [name] for line in lines)
    assert "wrote out/setpoints.h5 out/law.h5 out/path.svg out/motion.svg " in text
    drawn = {f"{name}.svg" for name in ("path", "motion", "ripple")}
    assert {each.name for each in (folder / "out").iterdir()} == {
        "run.json",
        "setpoints.h5",
        "law.h5",
        "report.html",
        *drawn,
    }


def test_a_second_run_replaces_the_first(splinefeed, folder):
    splinefeed("run", "smooth.json", "-o", "out", "--no-figures", "--format", "csv")
    result = splinefeed("run", "smooth.json", "-o", "out", "--no-figures", "--feed", "10")
    assert result.exit_code == 0
    assert sorted(each.name for each in (folder / "out").iterdir()) == ["law.h5", "run.json", "setpoints.h5"]
    assert sf.load(folder / "out/setpoints.h5").feed.max() <= 10


def test_a_missed_end_is_said_and_is_exit_code_1(splinefeed, folder):
    result = splinefeed("run", "smooth.json", "--method", "taylor-1", "--no-figures")
    assert result.exit_code == 1
    assert re.search(r"^NOT KEPT: .*the end of the path is missed by \d\S+ mm$", result.stdout, re.MULTILINE)
    assert (folder / "splinefeed-smooth/setpoints.h5").is_file()
    page = json.loads((folder / "splinefeed-smooth/run.json").read_text())
    assert not page["ok"]


def test_a_folder_that_is_not_ours_is_refused(refused, folder):
    (folder / "out").mkdir()
    (folder / "out/run.json").write_text("{}")
    line = refused("run", "smooth.json", "-o", "out")
    assert line == "out/run.json: was not written by a run of splinefeed; choose another folder with -o"
    assert refused("run", "smooth.json", "-o", "smooth.json") == "smooth.json: is a file; give the name of a folder"
    assert refused("run", "smooth.json", "-o", "no/where").startswith("no/where: the folder no does not exist")


def test_without_the_extra_the_rest_is_done_and_the_mend_is_said(splinefeed, folder, monkeypatch):
    for name in ("matplotlib", "plotly"):
        monkeypatch.setitem(sys.modules, name, None)
    result = splinefeed("run", "smooth.json", "--figures", "svg", "--figures", "pdf", "-o", "out")
    assert result.exit_code == 0
    assert result.stdout.rstrip().endswith("out/path.svg out/motion.svg out/run.json")
    for lacking in ("no report.html: it needs Plotly", "no figures as pdf: they need Matplotlib"):
        assert f'{lacking}, pip install "splinefeed[plots]"' in " ".join(result.stdout.split())
    quiet = splinefeed("run", "smooth.json", "--no-figures", "-o", "out")
    assert "plots" not in quiet.stdout


def test_formats_of_figures(splinefeed, folder):
    words = ("run", "smooth.json", "-o", "out")
    splinefeed(*words, "--figures", "png", "--figures", "pdf")
    drawn = {f"{name}.{form}" for name in ("path", "motion") for form in ("png", "pdf")}
    assert {each.name for each in (folder / "out").iterdir()} >= drawn
    splinefeed(*words)
    assert not drawn & {each.name for each in (folder / "out").iterdir()}


def test_ctrl_c_leaves_nothing(splinefeed, folder, monkeypatch):
    def interrupt(*_args, **_kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(Figure, "save", interrupt)
    result = splinefeed("run", "smooth.json")
    assert result.exit_code == 130
    assert result.stdout == ""
    assert result.stderr == "splinefeed: interrupted; no half-written file is left\n"
    assert [each.name for each in folder.iterdir()] == ["smooth.json"]


def test_a_fault_of_ours_is_one_line_unless_asked_for(splinefeed, folder, monkeypatch):
    def fail(*_args, **_kwargs):
        raise ZeroDivisionError("oh\nno")

    monkeypatch.setattr(files, "write", fail)
    result = splinefeed("run", "smooth.json")
    assert result.exit_code == 70
    line = "splinefeed: internal fault: ZeroDivisionError: oh no; SPLINEFEED_DEBUG=1 shows where, please report it\n"
    assert result.stderr == line
    monkeypatch.setenv("SPLINEFEED_DEBUG", "1")
    assert isinstance(splinefeed("run", "smooth.json").exception, ZeroDivisionError)


def test_a_full_disk_and_a_full_memory_are_one_line(splinefeed, folder, monkeypatch):
    def raiser(error):
        def fail(*_args, **_kwargs):
            raise error

        return fail

    monkeypatch.setattr(files, "write", raiser(OSError(28, "No space left on device")))
    result = splinefeed("run", "smooth.json")
    assert result.exit_code == 2
    assert result.stderr == (
        "splinefeed: splinefeed-smooth: cannot be written: no space is left on the disk; free some or write elsewhere\n"
    )
    monkeypatch.setattr(files, "write", raiser(MemoryError()))
    assert splinefeed("run", "smooth.json").stderr.startswith("splinefeed: not enough memory")
    assert [each.name for each in folder.iterdir()] == ["smooth.json"]


def test_a_name_from_a_file_cannot_write_to_the_terminal(splinefeed, folder):
    curve = json.loads((folder / "smooth.json").read_text())
    (folder / "odd.json").write_text(json.dumps({**curve, "name": "\x1b[31m$\\frac{[/bold]</svg>\n飛"}))
    result = splinefeed("run", "odd.json")
    assert result.exit_code == 0
    assert result.stdout.startswith("\\x1b[31m$\\frac{[/bold]</svg>\\n飛: ")
    svg = (folder / "splinefeed-31m-frac-bold-svg/path.svg").read_text()
    assert "&lt;/svg&gt;" in svg


def test_no_source_is_the_experiment_of_the_paper(splinefeed, folder):
    result = splinefeed("run", "--json", "--no-figures", "--no-compare")
    page = json.loads(result.stdout)
    assert page["source"] == {"text": "naca:0025?perimeter=33"}
    assert page["ticks"] == 1651
    assert page["duration_s"] == pytest.approx(1.65, abs=1e-9)
    assert page["length_mm"] == pytest.approx(33, abs=1e-9)
    assert page["limits"]["feed"]["worst"] == pytest.approx(40, abs=1e-6)
    assert page["axes"]["x"]["acceleration_share"] > 30
    text = splinefeed("run", "--no-figures", "--no-compare").stdout
    assert "top feed 40 mm/s, the limit of 60 mm/s (3600 mm/min) is never reached" in text


def test_rotary_axes_are_in_degrees(splinefeed, folder):
    source = "circle?radius=10&tangential=true"
    result = splinefeed("run", source, "--json", "--no-figures", "-o", "out")
    page = json.loads(result.stdout)
    theta = page["axes"]["theta"]
    assert theta["unit"] == "deg"
    assert theta["velocity"] == pytest.approx(np.degrees(page["feed_max_mm_s"] / 10), rel=1e-4)  # over a period
    assert "acceleration_share" not in theta
    (path,) = json.loads(splinefeed("info", source, "--json").stdout)["paths"]
    assert path["axis_units"] == ["mm", "mm", "deg"]
    assert path["bbox_max"][2] - path["bbox_min"][2] == pytest.approx(360)
    assert "deg/s" in splinefeed("run", source, "--no-figures", "-o", "out").stdout


def test_a_shape_is_not_taken_for_a_file_of_that_name(splinefeed, folder):
    (folder / "circle").write_text("nothing")
    page = json.loads(splinefeed("run", "circle", "--json", "--no-figures").stdout)
    assert page["source"] == {"text": "circle"}


LIMITS_FILE = """
feed = "3600mm/min"
axis_velocity = 60
axis_acceleration = 500
[axis_jerk]
x = 20000
y = "15m/s^3"
[travel]
x = [-100, 200]
"""


def test_limits_from_a_file_and_from_options(splinefeed, folder):
    (folder / "limits.toml").write_text(LIMITS_FILE)
    words = ["run", "smooth.json", "--limits", "limits.toml", "--no-figures", "--json"]
    result = splinefeed(*words, "-o", "out")
    assert result.exit_code == 0, result.stderr
    page = json.loads(result.stdout)
    assert page["strategy"] == "time-optimal"
    assert {name: each["limit"] for name, each in page["limits"].items()} == {
        "feed": 60.0, "axis_velocity.x": 60.0, "axis_velocity.y": 60.0, "axis_acceleration.x": 500.0,
        "axis_acceleration.y": 500.0, "axis_jerk.x": 20000.0, "axis_jerk.y": 15000.0, "travel.x": 150.0,
    }  # fmt: skip
    assert page["ok"]
    assert page["bound_by"]["none"] < 0.3
    checked = splinefeed("check", "out/setpoints.h5", "--json")
    assert checked.exit_code == 0
    again = json.loads(checked.stdout)["limits"]
    assert set(again) == set(page["limits"])
    for name, each in again.items():
        assert each["worst"] == pytest.approx(page["limits"][name]["worst"], rel=5e-3)
    command = shlex.split(page["command"])
    repeated = json.loads(splinefeed(*command[1:], "-o", "again", "--no-figures", "--json").stdout)
    assert repeated["settings"]["limits"] == page["settings"]["limits"]
    assert repeated["duration_s"] == page["duration_s"]
    replaced = json.loads(splinefeed(*words, "-o", "out", "--axis-jerk", "x=9000").stdout)
    assert replaced["ok"]
    assert replaced["limits"]["axis_jerk.x"]["limit"] == 9000.0
    assert "axis_jerk.y" not in replaced["limits"]
    refused = splinefeed(*words, "-o", "out", "--strategy", "seven-phase", "--accel", "500", "--jerk", "20000")
    assert refused.exit_code == 2
    assert "axis_velocity, axis_acceleration, axis_jerk: the seven-phase strategy cannot hold them" in refused.stderr


def test_a_run_folder_checks_as_the_run_said(splinefeed, folder):
    result = splinefeed("run", "smooth.json", "--no-figures", "-o", "out", "--json")
    assert result.exit_code == 0
    assert splinefeed("check", "out/setpoints.h5").exit_code == 0
    over = splinefeed("check", "out/setpoints.h5", "--feed", "40")
    assert over.exit_code == 1
    assert re.search(r"feed: \d+\S* mm/s is 50 % over the limit of 40 mm/s", over.stdout)


def test_a_path_of_one_rotary_axis_is_run_and_drawn(splinefeed, folder):
    (folder / "turn.ngc").write_text("G21 G90 G94\nG1 A20 F3600\nM2\n")
    result = splinefeed("run", "turn.ngc", *LIMITS)
    assert result.exit_code == 0, result.stderr
    assert "every limit holds" in result.stdout
    page = json.loads((folder / "splinefeed-turn/run.json").read_text())
    assert page["length_mm"] == pytest.approx(20.0, rel=1e-12)  # degrees
    assert "a (deg)" in (folder / "splinefeed-turn/path.svg").read_text()


def test_the_feed_of_a_program_is_said_as_its_top_and_whether_its_feeds_are_reached(splinefeed, folder):
    """The worst share of a feed limit is that of one line: its limit is not the program's."""
    (folder / "two.ngc").write_text("G21 G90 G64\nG1 X40 F600\nG1 X80 F60\nM2\n", encoding="utf-8")
    done = splinefeed("run", "two.ngc", "--axis-accel", "500", "--axis-jerk", "20000", "--output", "out")
    assert re.search(r"top feed (10|9\.99\d*) mm/s, feeds as programmed are reached", done.stdout)


def test_what_binds_adds_up_to_all_of_the_time(splinefeed, folder):
    text = splinefeed("run", "butterfly", "--axis-accel", "500", "--axis-jerk", "20000", "--no-figures").stdout
    line = next(each for each in text.splitlines() if each.startswith("bound by"))
    assert sum(int(each) for each in re.findall(r"(\d+)%", line)) == pytest.approx(100, abs=2)
    assert "none" in line
