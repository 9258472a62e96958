"""`splinefeed machine`: names, words, JSON, and every error of a bad file."""

from __future__ import annotations

import json
from importlib.resources import files

from splinefeed.machine.machine import Machine


def test_machines_are_listed(splinefeed):
    result = splinefeed("machine", "list")
    assert result.exit_code == 0
    assert [line.split()[0] for line in result.stdout.splitlines()] == ["machine", *Machine.names()]
    page = json.loads(splinefeed("machine", "list", "--json").stdout)
    assert page["machines"][-1]["axes"] == ["x", "y", "theta"]


def test_a_machine_is_shown_in_words_and_as_json(splinefeed):
    text = splinefeed("machine", "show", "xytheta").stdout
    assert text.rstrip("\n") == Machine.load("xytheta").describe()
    page = json.loads(splinefeed("machine", "show", "xytheta", "--json").stdout)
    assert page["axes"]["x"]["scale"]["resolution"] == {"value": 0.001, "unit": "mm"}


def test_every_error_of_a_bad_file_is_told_with_its_place(splinefeed, folder):
    text = files("splinefeed").joinpath("machines/xytheta.toml").read_text()
    bad = text.replace('kp = "22.3833V/mm"', 'kp = "-3V/mm"', 1).replace("pulses = 5000", "pulses = 0", 1)
    (folder / "bad.toml").write_text(bad.replace("[axis.y.load]", "[axis.y.laod]"))
    result = splinefeed("machine", "show", "bad.toml")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.splitlines() == [
        "splinefeed: bad.toml: 4 errors",
        "  axis.x.encoder.pulses: 0; must be a whole number from 1 to 100000000",
        "  axis.x.controller.kp: -3V/mm; must not be negative",
        "  axis.y.laod: unknown key; did you mean 'load'?",
        "  axis.y.load: missing",
    ]


def test_bad_names_are_one_line(refused, folder):
    assert refused("machine", "show", "xyteta").endswith("did you mean 'xytheta'?")
    assert refused("machine", "show", "no.toml") == ("no.toml: no such file; check the name and the folder")
    (folder / "empty.toml").write_text("")
    assert refused("machine", "show", "empty.toml").startswith("empty.toml: is empty")
    (folder / "empty.toml").write_text("# nothing")
    assert refused("machine", "show", "empty.toml") == (
        "empty.toml: axis: missing; a machine needs at least one [axis.NAME]"
    )
    assert refused("machine", "shwo") == "No such command 'shwo'. Did you mean 'show'?"


INI = """[TRAJ]
COORDINATES = X Y
LINEAR_UNITS = mm
[AXIS_X]
MAX_VELOCITY = 30
MAX_ACCELERATION = 200
[AXIS_Y]
MAX_VELOCITY = 30
MAX_ACCELERATION = 200
"""


def test_a_configuration_becomes_a_machine_file_that_says_what_it_assumes(splinefeed, refused, folder):
    (folder / "mill.ini").write_text(INI)
    said = splinefeed("machine", "from-ini", "mill.ini").stdout
    assert "assumed   programs start in G64 without P" in said and "wrote mill.toml" in said
    assert Machine.load("mill.toml").axes["x"].limits.velocity == 30.0
    assert "# [AXIS_X]MAX_VELOCITY" in (folder / "mill.toml").read_text()
    assert refused("machine", "from-ini", "mill.ini") == (
        "mill.toml: is there already; name the file to write: -o mill.toml"
    )
    page = json.loads(splinefeed("machine", "from-ini", "mill.ini", "-o", "mill.toml", "--json").stdout)
    assert page["axes"]["y"]["limits"]["acceleration"] == {"value": 200.0, "unit": "mm/s^2"}
    assert page["files"] == ["mill.toml"] and len(page["assumed"]) == 3
    assert refused("machine", "from-ini", "mill.ini", "-o", "mill.txt").endswith("a machine file is named .toml")
    assert refused("machine", "from-grbl", "mill.ini", "-o", "m.toml").startswith("mill.ini: no $110; send $$")
    (folder / "part.nc").write_text("G21 G90 G64\nG1 X10 F600\nY10\nM30\n")
    assert json.loads(splinefeed("time", "part.nc", "--machine", "mill.toml", "--json").stdout)["total_s"] < 2.5
