"""`--smooth` of run, plan and convert."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.cli import options, setpoints_file
from splinefeed.reports import record

RUN = ("--feed", "20", "--accel", "500", "--jerk", "20000", "--no-figures", "--json", "-o", "out")


@pytest.fixture
def program(folder):
    """A half circle of 2 mm radius in lines, a corner, and a line; G64 P0.02 before it."""
    phi = np.linspace(0.0, math.pi, 40)
    lines = [f"G1 X{10 + 2 * math.sin(p):.3f} Y{2 - 2 * math.cos(p):.3f}" for p in phi]
    text = ["G21 G90 G17", "G64 P0.02", "G0 X0 Y0 Z0", "G1 F600 X8 Y0", *lines, "G1 X10 Y12", "M2"]
    (folder / "half.ngc").write_text("\n".join(text) + "\n")
    return "half.ngc"


def page_of(result, code=0):
    assert result.exit_code == code, result.stderr
    return json.loads(result.stdout)


def test_run_smooths_tells_the_proof_and_check_finds_the_same_path(splinefeed, program):
    page = page_of(splinefeed("run", program, "--smooth", "0.02mm", *RUN))
    (proof,) = (note for note in page["notes"] if "from the original, both ways" in note)
    assert float(proof.split()[2]) <= 0.02
    assert "--smooth 0.02" in page["command"]
    assert page_of(splinefeed("check", "out/setpoints.h5", "--json"))["ok"]


def test_smoothing_is_off_unless_asked_for_and_g64_p_is_told(splinefeed, program):
    exact = page_of(splinefeed("plan", program, "--json"))
    assert any("G64 P0.02" in note and "--smooth program" in note for note in exact["notes"])
    kept = page_of(splinefeed("plan", program, "--smooth", "0.02", "--json"))
    rounded = page_of(splinefeed("plan", program, "--smooth", "program", "--json"))
    assert len(exact["stops_mm"]) > 30
    assert len(kept["stops_mm"]) == 1
    assert len(rounded["stops_mm"]) == 0
    assert rounded["duration_s"] < kept["duration_s"] < 0.5 * exact["duration_s"]
    assert not any("which is off" in note for note in kept["notes"])
    sharp = page_of(splinefeed("plan", program, "--smooth", "0.02", "--corner-angle", "95", "--json"))
    assert sharp["stops_mm"] == []


def test_convert_smooths(splinefeed, program, folder):
    page = page_of(splinefeed("convert", program, "half.json", "--smooth", "20um", "--json"))
    assert any("smoothed" in finding for finding in page["findings"])
    assert len(sf.read(folder / "half.json").curves) < 10


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--smooth", "0"), "tolerance is 0"),
        (("--smooth", "soft"), "soft"),
        (("--corners", "round"), "give --smooth LENGTH too"),
        (("--smooth", "1", "--corner-angle", "200"), "--corner-angle"),
    ],
)
def test_what_cannot_be(splinefeed, program, words, said):
    result = splinefeed("plan", program, *words)
    assert result.exit_code == 2
    assert said in result.stderr


def test_a_program_without_g64_has_no_tolerance_of_its_own(splinefeed, folder):
    (folder / "plain.ngc").write_text("G21 G90\nG0 X0 Y0 Z0\nG1 F600 X10\nG1 X20 Y1\nM2\n")
    result = splinefeed("plan", "plain.ngc", "--smooth", "program")
    assert result.exit_code == 2
    assert "has no tolerance" in result.stderr


def test_the_command_of_a_record_says_all_of_how_a_path_was_read():
    reading = {
        "which": "2", "layer": "a,b", "units": "in", "chord": 150.0, "edges": True, "dialect": "fanuc",
        "start": "1,2,3", "offsets": "G54=1,2", "tools": "t.tbl", "repair": True, "from_line": "12", "tolerance": 0.0,
        "tangential": True, "smooth": 0.01, "corners": "round", "corner_angle": 30.0, "angle_tolerance": 0.001,
    }  # fmt: skip
    said = record.command("part.nc", {"limits": {}}, reading, ("hdf5",))
    assert options.reading_from(setpoints_file.options_of({"command": said})) == reading


SQUARE = '<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="30mm" viewBox="0 0 40 30">{}</svg>'


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "the tool stops exactly at 3 corners"),
        (("--smooth", "0.05mm"), "the tool still stops exactly at 3 corners, which smoothing keeps; --corners round"),
        (("--smooth", "0.05mm", "--corners", "round"), ""),
        (("--axis-velocity-step", "5"), ""),
    ],
)
def test_run_says_at_how_many_corners_of_a_drawing_it_stops(splinefeed, folder, options, said):
    (folder / "sheet.svg").write_text(SQUARE.format('<path fill="none" stroke="black" d="M5 5h20v10h-20z"/>'))
    page = page_of(splinefeed("run", "sheet.svg", *RUN, *options))
    notes = [note for note in page["notes"] if "stops exactly" in note]
    assert [note[: len(said)] for note in notes] == [said] * bool(said)
