"""`splinefeed tune-feed`: files, JSON, words, exit codes."""

from __future__ import annotations

import json

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.machine import limits_toml

LIMITS = ("--strategy", "look-ahead", "--accel", "500", "--jerk", "20000")
WORDS = ("smooth.json", "--machine", "xytheta", *LIMITS)


def test_what_is_found_can_be_run(splinefeed, folder):
    result = splinefeed("tune-feed", *WORDS, "--contour-tolerance", "20um", "--json", "-o", "out")
    assert result.exit_code == 0, result.output
    page = json.loads(result.stdout)
    assert page["ok"] is True
    assert page["best"]["contour_error_max_mm"] <= 0.02 == page["contour_tolerance_mm"]
    assert sorted(each.name for each in (folder / "out").iterdir()) == [
        "feed-curve.svg", "limits.toml", "response.h5", "setpoints.h5", "tune-feed.json",
    ]  # fmt: skip
    assert limits_toml.read("out/limits.toml").as_dict() == page["limits"]
    assert np.max(sf.load("out/response.h5").contour_error) == page["best"]["contour_error_max_mm"]
    again = splinefeed("follow", "out/setpoints.h5", "--machine", "xytheta", "--json", "--no-figures")
    assert json.loads(again.stdout)["contour_error_max_mm"] == page["best"]["contour_error_max_mm"]
    assert splinefeed("check", "out/setpoints.h5").exit_code == 0
    words = ("--machine", "xytheta", "--strategy", "look-ahead", "--limits", "out/limits.toml")
    run = splinefeed("run", "smooth.json", *words, "--json", "--no-figures")
    assert json.loads(run.stdout)["contour_error_max_mm"] == page["best"]["contour_error_max_mm"]


def test_what_people_read(splinefeed, folder):
    result = splinefeed("tune-feed", *WORDS, "--contour-tolerance", "20um", "--vary", "feed", "--no-figures")
    text = result.stdout
    assert text.startswith("smooth on xytheta, contour error within 20 um, look-ahead\n")
    assert result.exit_code in (0, 1)
    assert ("\nbest " in text) == (result.exit_code == 0)
    nothing = splinefeed("tune-feed", *WORDS, "--contour-tolerance", "1nm", "--no-figures", "-o", "none")
    assert nothing.exit_code == 1
    assert "NOT KEPT: no feed tried keeps 0.001 um; the least contour error is " in nothing.stdout
    assert [each.name for each in (folder / "none").iterdir()] == ["tune-feed.json"]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (WORDS, "Missing option '--contour-tolerance'; see splinefeed tune-feed --help"),
        (["smooth.json", "--contour-tolerance", "1um"], "Missing option '--machine'; see splinefeed tune-feed --help"),
        ([*WORDS, "--contour-tolerance", "0"], "contour tolerance is 0; it must be greater than 0"),
        (
            [*WORDS, "--contour-tolerance", "5s"],
            "--contour-tolerance: '5s' is a time; expected a length such as 12.5mm or 0.5in",
        ),
    ],
)  # fmt: skip
def test_bad_input(refused, words, line):
    assert refused("tune-feed", *words) == line
