"""Whatever is wrong, the user reads one line that says what, where and how to mend it."""

from __future__ import annotations

import json
import os

import pytest

from splinefeed.cli.main import COMMANDS
from splinefeed.formats.setpoint_table import FORMATS

FEED_EXAMPLES = "expected a feed such as 60mm/s or 3600mm/min"


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["rnu"], "no such command 'rnu'; did you mean 'run'?"),
        (["wings"], f"no such command 'wings'; there are {', '.join(COMMANDS)}"),
        (["run", "--feed", "60s"], f"--feed: '60s' is a time; {FEED_EXAMPLES}"),
        (["run", "--feed", "60mm/sec2"], f"--feed: '60mm/sec2' is an acceleration; {FEED_EXAMPLES}"),
        (["run", "--feed", "60furlong/s"], f"--feed: '60furlong/s' has an unknown unit: furlong; {FEED_EXAMPLES}"),
        (["run", "--feed", "nan"], f"--feed: 'nan' cannot be read; {FEED_EXAMPLES}"),
        (["run", "--feed", "1e999"], f"--feed: '1e999' is not finite; {FEED_EXAMPLES}"),
        (
            ["plan", "--period", "1kHz"],
            "--period: '1kHz' is a frequency; expected a time such as 1ms or 0.001s",
        ),
        (["run", "--corrections", "many"], "--corrections: 'many' is not a valid integer."),
        (["compare", "--methods", ","], "--methods: no name is given; write for example taylor-2,milne-simpson"),
        (["info"], "Missing argument 'SOURCE'; see splinefeed info --help"),
        (["run", "--format", "xls"], f"--format: 'xls' is not one of {', '.join(map(repr, FORMATS))}."),
    ],
)
def test_usage(refused, words, line):
    assert refused(*words) == line


def test_an_option_that_is_nearly_right_is_told(refused):
    line = refused("run", "--perod", "1ms")
    assert "--perod" in line
    assert "--period" in line.split("--perod", 1)[1]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--feed", "0"], "feed is 0; it must be greater than 0"),
        (["--accel", "-5"], "acceleration is -5; it must be greater than 0"),
        (["--decel", "0mm/s^2"], "deceleration is 0; it must be greater than 0"),
        (["--jerk=-1"], "jerk is -1; it must be greater than 0"),
        (["--feed", "1e-308"], "feed is 1e-308; it must be at least 1e-30"),
        (["--axis-velocity", "1e-308"], "axis_velocity is 1e-308; it must be at least 1e-30"),
        (["--period", "1e-308"], "period is 1e-308; it must be at least 1e-30"),
        (["--smooth", "1e-308"], "tolerance is 1e-308; it must be at least 1e-06"),
        (["--decel-jerk", "0"], "deceleration_jerk is 0; it must be greater than 0"),
        (["--start-feed", "61"], "start_feed is 61 mm/s; it must lie between 0 and the feed limit of 60 mm/s"),
        (
            ["--axis-accel", "500,800,900"],
            "axis_acceleration has 3 values for 2 axes; give one each, in the order x, y",
        ),
        (["--period", "0"], "period is 0; it must be greater than 0"),
        (["--method", "milne-simpsn"], "unknown interpolation method 'milne-simpsn'; did you mean 'milne-simpson'?"),
        (["--corrections", "101"], "corrections is 101; expected a whole number from 0 to 100"),
    ],
)
def test_limits_and_methods(refused, words, line):
    assert refused("run", "smooth.json", *words) == line


def test_an_unknown_strategy_names_the_known_ones(refused):
    line = refused("plan", "smooth.json", "--strategy", "seven-fase")
    assert line.startswith("strategy 'seven-fase' is not known; did you mean 'seven-phase'?")


def test_a_period_longer_than_the_motion_says_which_would_do(refused):
    line = refused("run", "smooth.json", "--period", "1min")
    assert line.startswith("period is 60 s, longer than the whole motion of 2.47")
    assert "; choose a period of at most" in line


def test_a_period_that_would_fill_the_disk(refused):
    line = refused("run", "smooth.json", "--period", "1e-12")
    assert line.startswith("the motion takes 2.47")
    assert line.endswith("at most 1000000000 are possible: raise the period or the feed")


def test_no_room_for_the_change_of_feed(refused):
    line = refused("plan", "smooth.json", "--end-feed", "60", "--accel", "1")
    assert "is too short to speed up from 0 to 60 mm/s" in line
    assert "; choose a" in line


LINE = {"degree": 1, "knots": [0, 0, 1, 1], "control_points": [[0, 0], [1, 1]]}


@pytest.mark.parametrize(
    ("content", "line"),
    [
        ("", "x.json: is empty; was its writing interrupted?"),
        ("\0\1\2", "x.json: byte 0: is binary; expected the text of a JSON curve"),
        (
            '{"degree": 1, "knots": [0, 0,',
            "x.json: line 1, column 30: Expecting value; is the file complete, and is it JSON?",
        ),
        (json.dumps({**LINE, "knots": [0, 1]}), "x.json: 2 knots for 2 control points of degree 1; exactly 4"),
        (json.dumps({**LINE, "knots": [0, 1, 0, 1]}), "x.json: knots decrease from knots[1] = 1 to knots[2] = 0"),
        (json.dumps({**LINE, "weights": [1, 0]}), "x.json: weights[1] is 0; weights must be greater than 0"),
        (json.dumps({**LINE, "weights": [1, -2]}), "x.json: weights[1] is -2; weights must be greater than 0"),
        (
            json.dumps({**LINE, "control_points": [[0, 0]]}),
            "x.json: 1 control point(s) for degree 1; expected at least 2",
        ),
        (json.dumps({**LINE, "control_points": [[1, 1]] * 2}), "x.json: all 2 control points are the same"),
        (json.dumps({**LINE, "control_points": [[0, 0], [float("nan"), 1]]}), "x.json: NaN is not a number"),
        (json.dumps({**LINE, "control_points": [[0, 0], [float("inf"), 1]]}), "x.json: Infinity is not a number"),
    ],
)
@pytest.mark.parametrize("command", ["run", "plan", "compare", "info"])
def test_files(refused, folder, command, content, line):
    (folder / "x.json").write_text(content)
    assert refused(command, "x.json").startswith(line)


def test_a_file_of_a_million_points(refused, folder):
    (folder / "wing.dat").write_text("1.0 0.0\n" * 1_000_000)
    assert refused("info", "wing.dat") == "wing.dat: has 1000000 lines; a section has 5 to 20000 points"


def test_a_truncated_airfoil(refused, folder):
    (folder / "wing.dat").write_text("half a wing\n1.0 0.0\n0.7 0.05\n0.4 0.08\n0.1 0.06\n0.0 0.0\n")
    line = refused("run", "wing.dat")
    assert line == "wing.dat: begins at x = 1 but ends at x = 0; points are missing, is the file complete?"


def test_no_such_file(refused):
    assert refused("run", "nothing.json") == "nothing.json: no such file; check the name and the folder"
    assert refused("run", "").startswith(": no such file or shape; shapes are ")
    line = refused("run", "buterfly")
    assert line == "buterfly: no such file or shape; did you mean 'butterfly'?"


def test_a_folder_as_source(refused, folder):
    (folder / "curves").mkdir()
    assert refused("info", "curves") == "curves: is a folder; name a file in it"


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_an_unreadable_file(refused, folder):
    (folder / "smooth.json").chmod(0)
    assert refused("info", "smooth.json").startswith("smooth.json: cannot be")


def test_options_of_files_are_not_for_shapes(refused):
    line = refused("info", "butterfly", "--chord", "3")
    assert line == "--chord: is for files; 'butterfly' is a shape, whose options follow its '?'"
    assert (
        refused("info", "smooth.json", "--path", "2") == "smooth.json: has no path '2'; there are 1 to 1, named smooth"
    )


def test_no_message_can_write_to_the_terminal(refused, folder):
    name = "bad\x1b[31m.json"
    (folder / name).write_text("")
    assert refused("info", name) == "bad\\x1b[31m.json: is empty; was its writing interrupted?"


def test_a_law_goes_to_a_file_that_can_be_written(refused, folder):
    assert refused("plan", "smooth.json", "-o", "no/law.h5").startswith("no/law.h5: the folder ")
    assert refused("plan", "smooth.json", "-o", "law.txt").startswith("law.txt: ")
    (folder / "laws.h5").mkdir()
    assert refused("plan", "smooth.json", "-o", "laws.h5") == "laws.h5: is a folder; give the name of a file"


def test_of_thousands_of_problems_the_first_are_printed(splinefeed, folder):
    (folder / "limits.toml").write_text("\n".join(f"[a{k}]" for k in range(3000)))
    said = splinefeed("plan", "smooth.json", "--limits", "limits.toml").stderr.splitlines()
    assert len(said) == 32 and said[0].endswith("3000 errors") and said[-1] == "  and 2970 more"
