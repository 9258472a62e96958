"""What `run` says of a program before its numbers: stops, feeds, limits that are missing, and the place of its zero."""

from __future__ import annotations

import json

import pytest

#: Feed moves with 5 corners, two of 30 degrees and three of 90, beside rapid moves, whose corners always stop.
PROGRAM = """G21 G90
G0 X0 Y0 Z5
G1 Z0 F600
X20
X37.320508 Y10
X57.320508
Y30
X37.320508
G0 Z5
G0 X0
M2
"""
MILL = """[control]
model = "linuxcnc"
velocity = "80mm/s"
tolerance = "1000mm"
""" + "".join(
    f'[axis.{axis}.limits]\nvelocity = "80mm/s"\nacceleration = "400mm/s^2"\n'
    f'minimum = "{low}mm"\nmaximum = "{high}mm"\n'
    for axis, low, high in (("x", -100, 100), ("y", -100, 100), ("z", -100, 20))
)


@pytest.fixture
def noted(splinefeed, folder):
    """`noted(*words)`: the notes of a run of the program with these options, and its whole page."""
    (folder / "part.ngc").write_text(PROGRAM)
    (folder / "mill.toml").write_text(MILL)

    def invoke(*words):
        done = splinefeed("run", "part.ngc", *words, "--no-figures", "--json", "-o", "out")
        assert done.exit_code == 0, done.stderr
        page = json.loads(done.stdout)
        return page["notes"], page

    return invoke


def test_corners_that_stop_are_counted_and_what_passes_them_is_named(noted, splinefeed, folder):
    notes, _ = noted("--machine", "mill.toml")
    stops = next(note for note in notes if "stops exactly" in note)
    # Z down and X: 90 degrees; then 30, 30, 90, 90
    assert stops == "the tool stops exactly at 5 corners; at the feeds alone its feed moves take 10.5 s"
    how = next(note for note in notes if "--smooth LENGTH" in note)
    assert "the control of mill passes corners (G64), as splinefeed time counts" in how
    assert "passes 2 of them, which turn by 45 deg at most" in how
    assert "--corners round" in how
    notes, _ = noted("--machine", "mill.toml", "--smooth", "0.01mm")
    assert any("still stops exactly at 3 corners" in note and "--corners round" in note for note in notes)
    notes, _ = noted("--machine", "mill.toml", "--smooth", "0.01mm", "--corners", "round")
    assert not any("stops exactly" in note for note in notes)
    (folder / "part.ngc").write_text(PROGRAM.replace("G90", "G90 G61"))
    page = json.loads(splinefeed("plan", "part.ngc", "--machine", "mill.toml", "--json").stdout)
    assert any(note.startswith("the program asks for exact stops (G61); --smooth") for note in page["notes"])
    (folder / "part.ngc").write_text(PROGRAM)
    notes, _ = noted("--machine", "mill.toml", "--axis-velocity-step", "5")
    assert not any("stops exactly" in note for note in notes)
    assert "splinefeed run stops at corners" in splinefeed("time", "part.ngc", "--machine", "mill.toml").stdout


def test_a_feed_that_is_given_is_that_of_feed_moves(noted, splinefeed):
    notes, page = noted("--machine", "mill.toml", "--feed", "5")
    assert page["feed_max_mm_s"] > 75  # rapid moves
    assert any("at most at the one that is given, 5 mm/s (300 mm/min); rapid moves as fast" in note for note in notes)
    assert page["duration_s"] > 21
    assert splinefeed("check", "out/setpoints.h5").exit_code == 0
    assert splinefeed("report", "out").exit_code == 0  # the path is read again
    notes, page = noted("--machine", "mill.toml", "--feed", "1500")
    assert any("1500 mm/s (90000 mm/min), slows nothing down" in note for note in notes)
    notes, page = noted("--feed", "5")  # nothing says how fast rapid moves may be
    assert page["feed_max_mm_s"] == pytest.approx(5)
    assert any("rapid moves keep this feed, too" in note for note in notes)
    notes, page = noted("--machine", "mill.toml", "--feed", "30", "--cut-feed", "5")
    assert 29 < page["feed_max_mm_s"] < 30.001


def test_limits_that_nobody_gave_are_named(noted):
    notes, _ = noted("--machine", "mill.toml")
    assert any(
        note.startswith("no jerk limit is given, of path or axes: acceleration changes in steps") for note in notes
    )
    notes, _ = noted("--axis-jerk", "20000")
    assert any(note.startswith("no acceleration limit is given") for note in notes)
    notes, _ = noted("--feed", "20")
    assert "assumed, as nothing else is given: acceleration 50 mm/s^2, jerk 2000 mm/s^3" in notes
    notes, _ = noted("--feed", "20", "--axis-accel", "500", "--axis-jerk", "20000")
    assert not any("assumed, as" in note or "no jerk" in note or "no acceleration" in note for note in notes)


def test_a_program_outside_of_the_travel_names_line_and_offsets(noted, splinefeed, folder):
    (folder / "low.toml").write_text(MILL.replace('"20mm"', '"0.5mm"'))
    refused = splinefeed("run", "part.ngc", "--machine", "low.toml")
    assert refused.exit_code == 2
    assert "z = 5 mm in line 3; its travel allows at most 0.5 mm" in refused.stderr
    assert "--offsets G54=" in refused.stderr
    place = "travel is checked with the zero of the program at that of the machine, which is assumed"
    assert any(note.startswith(place) for note in noted("--machine", "mill.toml")[0])
    assert not any(note.startswith(place) for note in noted("--machine", "mill.toml", "--offsets", "G54=0,0,0")[0])
    timed = splinefeed("time", "part.ngc", "--machine", "low.toml").stdout
    assert "goes to z = 5 mm in line 2; its travel ends at 0.5 mm" in timed
    for command in ("run", "time"):
        done = splinefeed(command, "part.ngc", "--machine", "low.toml", "--offsets", "G54=0,0,-50")
        assert done.exit_code == 0
        assert "travel ends" not in done.stdout


def test_feeds_of_a_program_with_rapid_moves_are_checked(noted, splinefeed, folder):
    """A rapid move has no feed; those of the other moves were not compared with their setpoints."""
    _, page = noted("--machine", "mill.toml")
    assert page["limits"]["feed"]["limit"] == 10
    assert 0.99 < page["limits"]["feed"]["share"] < 1.000001
    (folder / "slow.ngc").write_text(PROGRAM.replace("F600", "F300"))
    over = splinefeed("check", "out/setpoints.h5", "--path", "slow.ngc")
    assert over.exit_code == 1
    assert "feed: 10 mm/s is 100 % over the limit of 5 mm/s" in over.stdout


def test_times_name_the_programmed_feed_where_it_binds(splinefeed, folder):
    (folder / "mill.toml").write_text(MILL)
    (folder / "line.ngc").write_text("G21 G90\nG1 X90 F300\nX0\nG0 X90\nM2\n")
    page = json.loads(splinefeed("time", "line.ngc", "--machine", "mill.toml", "--json").stdout)
    limits = {each["line"]: each["limit"] for each in page["places"]}
    assert limits[2] == limits[3] == "programmed feed"
    (folder / "zigzag.ngc").write_text("G21 G90 G61\nG1 F4800\n" + "X0.5\nX0\n" * 9 + "M2\n")
    page = json.loads(splinefeed("time", "zigzag.ngc", "--machine", "mill.toml", "--json").stdout)
    assert {each["limit"] for each in page["places"]} == {"axis acceleration x"}
    text = splinefeed("time", "line.ngc", "--machine", "mill.toml").stdout
    assert "against F alone, s" in text
    (folder / "tool.ngc").write_text("G21 G90 T1 M6\nG1 X90 F300\nM2\n")
    assert "\n-  " not in splinefeed("time", "tool.ngc", "--machine", "mill.toml").stdout  # no time without a tool


def test_words_are_those_of_a_shell(noted, splinefeed, folder):
    notes, _ = noted("--machine", "mill.toml", "--axis-accel", "X=300,Y=200,Z=100")
    assert any(note.endswith("are left out (--start)") for note in notes)
    assert not any("(option " in note for note in notes)
    assert splinefeed("run", "part.ngc", "--fed", "3").stderr.startswith(
        "splinefeed: no such option --fed; did you mean '--feed'?"
    )
    done = splinefeed(
        "plan", "butterfly", "--axis-accel", "X=300,y=200", "--axis-jerk", "20000", "--travel", "X=-200:200"
    )
    assert done.exit_code == 0, done.stderr
