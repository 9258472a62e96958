"""`splinefeed time` and `calibrate`: the table, the JSON, the figure, and one line for what is wrong."""

from __future__ import annotations

import json
import pathlib

import pytest

import splinefeed as sf

DATA = pathlib.Path(__file__).parents[1] / "data" / "cycle-time"
BOX = str(DATA / "box-op2.nc")


def test_time_in_words(splinefeed):
    result = splinefeed("time", BOX, "--machine", "hurco-02")
    assert result.exit_code == 0, result.stderr
    total = sf.cycle_time(BOX, "hurco-02").total
    lines = result.stdout.splitlines()
    found = sf.cycle_time(BOX, "hurco-02")
    low, high = found.interval
    assert low < total < high
    assert lines[0] == (
        f"box-op2 on hurco-02: 1 min {total - 60:.0f} s ({total:.2f} s, 95 % interval {low:.1f} to {high:.1f}), 1175 "
        f"blocks; dialect fanuc; control: {found.control}"
    )
    assert [line.split()[0] for line in lines if line[:1] == "T"] == ["T3", "T21"]
    assert sum(line.startswith("line ") for line in lines) == 10
    assert any(line.startswith("tool_change ") for line in lines)


CORNERS = "G21 G90 G17\nG1 X10 F600\nY10\nX20\nG0 Z5\nM30\n"


@pytest.fixture
def settings(monkeypatch, tmp_path_factory):
    """An empty folder of the user's settings."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path_factory.mktemp("settings")))


def test_without_a_machine_a_plain_one_is_taken_and_said(splinefeed, folder, settings):
    (folder / "part.nc").write_text(CORNERS)
    lines = splinefeed("time", "part.nc").stdout.splitlines()
    assert lines[0].startswith("part on plain-mill: ") and "; dialect linuxcnc; " in lines[0]
    assert lines[0].endswith("control: stops at corners, no [control] says otherwise")
    page = json.loads(splinefeed("time", "part.nc", "--json").stdout)
    assert page["corner_stops"] == 2 and page["dialect"] == "linuxcnc"
    assert lines[1].startswith(f"2 corners are stops: {page['corner_stops_s']:.2f} s more than passing them, ")
    assert 0.0 < page["corner_stops_s"] < 0.2 * page["total_s"]
    assert page["notes"][-1].startswith("no machine is named: plain-mill, ")
    named = json.loads(splinefeed("time", "part.nc", "--machine", "plain-mill", "--json").stdout)
    assert named["total_s"] == page["total_s"] and not named["notes"]


def test_where_corners_are_passed_none_is_a_stop(splinefeed, folder):
    (folder / "part.nc").write_text(CORNERS.replace("G17", "G17 G64 P1"))
    page = json.loads(splinefeed("time", "part.nc", "--machine", "plain-mill", "--json").stdout)
    assert (page["corner_stops"], page["corner_stops_s"]) == (0, pytest.approx(0.0, abs=0.05))
    page = json.loads(splinefeed("time", "part.nc", "--machine", "hurco-02", "--json").stdout)
    assert (page["corner_stops"], page["corner_stops_s"]) == (0, 0.0)


def test_the_usual_machine_is_the_one_that_the_user_chose(splinefeed, refused, folder, settings):
    (folder / "part.nc").write_text(CORNERS)
    (folder / "mill.toml").write_text(
        "".join(f'[axis.{each}.limits]\nvelocity = "2m/min"\nacceleration = "100mm/s^2"\n' for each in "xyz")
    )

    def machine(*words):
        return json.loads(splinefeed("time", "part.nc", "--json", *words).stdout)["machine"]

    assert json.loads(splinefeed("machine", "use", "--json").stdout) == {"usual": None, "plain": "plain-mill"}
    assert refused("machine", "use", "none.toml").startswith("none.toml: no such file")
    assert "mill.toml" in splinefeed("machine", "use", "mill.toml").stdout
    page = json.loads(splinefeed("time", "part.nc", "--json").stdout)
    assert page["machine"] == "mill" and "mill.toml, as splinefeed machine use says" in page["notes"][-1]
    assert machine("--machine", "plain-mill") == "plain-mill"
    (folder / "mill.toml").unlink()
    assert refused("time", "part.nc").endswith("it is the usual machine, splinefeed machine use FILE chooses another")
    assert refused("machine", "use", "router", "--forget").startswith("--forget: is for no machine")
    splinefeed("machine", "use", "--forget")
    assert machine() == "plain-mill"


def test_time_as_json_with_a_figure(splinefeed, folder):
    result = splinefeed("time", BOX, "--machine", "hurco-02", "--json", "--figure", "time.svg")
    page = json.loads(result.stdout)
    kinds = ("cutting_s", "rapid_s", "tool_change_s", "spindle_s", "dwell_s", "start_s")
    assert page["total_s"] == pytest.approx(sum(page[kind] for kind in kinds))
    assert sum(tool["total_s"] for tool in page["tools"]) == pytest.approx(page["total_s"])
    assert page["places"][0].keys() == {"line", "seconds", "beyond_feed_s", "limit"}
    assert page["saves"][0]["what"] == "programmed feeds"
    assert page["files"] == ["time.svg"]
    assert "cutting" in (folder / "time.svg").read_text()


def test_the_time_from_a_line_on(splinefeed):
    whole = json.loads(splinefeed("time", BOX, "--machine", "hurco-02", "--json", "--no-saves").stdout)
    change = next(each["line"] for each in whole["operations"] if each["tool"] == "T21")
    words = ("time", BOX, "--machine", "hurco-02", "--json", "--no-saves", "--from-line")
    rest = json.loads(splinefeed(*words, change).stdout)
    last, again = whole["tools"][-1], rest["tools"][-1]
    assert again["tool"] == "T21"
    assert again["cutting_s"] == pytest.approx(last["cutting_s"], rel=1e-9)
    assert rest["total_s"] < whole["total_s"]
    refused = splinefeed(*words, 10**6)
    assert refused.exit_code == 2
    assert "line 1000000: is never executed" in refused.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("time", "none.nc", "--machine", "hurco-02"), "none.nc: no such file"),
        (("time", BOX, "--machine", "mill"), "mill: no machine of this name"),
        (("time", BOX, "--machine", "hurco-02", "--figure", "time.doc"), "time.doc: figures are written as"),
        (("time", BOX, "--machine", "bad.toml"), "control.spindle.start: -1s; must not be negative"),
        (("calibrate", "none.csv", "--machine", "hurco-02"), "none.csv: its program is missing; write PROGRAM="),
        (("calibrate", f"{BOX}=none.csv", "--machine", "hurco-02"), "none.csv: no such file"),
        (("calibrate", "x.csv", "--machine", "hurco-02", "--keep", "colour"), "--keep: 'colour' is not fitted"),
    ],
)
def test_bad_input_is_one_line(splinefeed, folder, words, said):
    (folder / "bad.toml").write_text('[control]\n[control.spindle]\ntop_speed = "9000rpm"\nstart = "-1s"\n')
    result = splinefeed(*words)
    assert result.exit_code == 2
    assert said in result.stderr
    assert result.stderr.count("\n") == 1
    assert not list(folder.glob("*.svg"))


def test_calibrate_writes_a_machine_file(splinefeed, folder):
    """From the mill itself with all but three numbers kept: the run moves them little."""
    from splinefeed.programs.calibration import PRIORS

    fitted = ("tool_change", "spindle.start", "velocity_step")
    keep = [word for name in PRIORS if name not in fitted for word in ("--keep", name)]
    log = f"{BOX}={DATA / 'box-op2-hurco02-part11.csv'}"
    result = splinefeed("calibrate", log, "--machine", "hurco-02", *keep, "-o", "new.toml", "--json")
    assert result.exit_code == 0, result.stderr
    page = json.loads(result.stdout)
    assert {each["name"] for each in page["numbers"]} == set(fitted)
    assert page["files"] == ["new.toml"]
    assert abs(page["runs"][0]["error"]) < 0.02
    new = sf.Machine.load(folder / "new.toml")
    assert new.control.tool_change == pytest.approx(sf.Machine.load("hurco-02").control.tool_change, rel=0.1)
    assert "box-op2-hurco02-part11.csv" in new.control.source


def test_a_fit_that_misses_its_runs_says_so_first(splinefeed, folder):
    """The run under an override that its log does not name, with what could make up for it kept."""
    run = f"{BOX}={DATA / 'box-op2-hurco02-part9.csv'}"
    names = "velocity_step acceleration stop_time start_time tool_change home.z jerk change_place.x change_place.y"
    keep = [word for name in [*names.split(), "spindle.start", "spindle.stop"] for word in ("--keep", name)]
    words = ("calibrate", run, "--machine", "hurco-02", *keep, "-o", "fitted.toml")
    said = splinefeed(*words)
    assert said.exit_code == 0
    lines = said.stdout.splitlines()
    assert lines[0].startswith("MISSES its own runs; the file is written")
    assert lines[1].startswith("box-op2-hurco02-part9.csv, T3: +") and "likely a feedrate override" in lines[1]
    assert any(line.startswith("note      not shown by these runs, left at the prior: ") for line in lines)
    strict = splinefeed(*words, "--strict", "--json")
    assert strict.exit_code == 1
    page = json.loads(strict.stdout)
    assert not page["ok"] and not page["meets_runs"] and len(page["misses"]) == 1
    time = splinefeed("time", BOX, "--machine", "fitted.toml", "--no-saves")
    assert " s, 95 % interval " in time.stdout.splitlines()[0]
