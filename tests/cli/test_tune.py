"""`splinefeed tune`: tables, JSON, figures, written machines, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from splinefeed.machine import Machine

SLOW = 'lag = "10ms"'


@pytest.fixture
def machine(folder: Path) -> Path:
    """The paper's table with faster drives, on which table 2 is unstable, as a file of the user's."""
    (folder / "fast.toml").write_text(_text("xytheta").replace(SLOW, 'lag = "1ms"'))
    return folder / "fast.toml"


def _text(name: str) -> str:
    from importlib.resources import files

    return files("splinefeed").joinpath("machines", f"{name}.toml").read_text(encoding="utf-8")


def test_a_rule_says_gains_margins_and_verdict(splinefeed):
    result = splinefeed("tune", "xytheta", "--rule", "ziegler-nichols")
    assert result.exit_code == 0, result.output
    assert "axis x: ultimate gain 82.07 V/mm, ultimate period 14.11 ms" in result.stdout
    assert "kp 22.38 V/mm, ki 266.9 V/mm/s, kd 0.1862 V*s/mm" in result.stdout
    assert "gain may rise by 14.7 dB, fall by 12.6 dB, phase margin 17.5 deg" in result.stdout
    assert "swing at rest 6.11 um" in result.stdout
    assert "drive.bandwidth of axis x (60 Hz, loop 110 Hz)" in result.stdout
    assert "x, old gains: stable: gain margin 4.1, phase margin 60.9 deg" in result.stdout
    assert "x, new gains: stable, but close to unstable: gain margin 5.46, phase margin 17.5 deg" in result.stdout
    assert "axis x, y, theta: gains of rule ziegler-nichols do not keep gain margin at least 6.02 dB" in result.stdout


def test_the_usual_rule_keeps_the_margins_that_are_asked_for(splinefeed):
    words = ("tune", "xytheta", "--axis", "x", "--json")
    page = json.loads(splinefeed(*words).stdout)
    x = page["axes"]["x"]
    assert page["rule"] == "margins" and len(page["notes"]) == 1 and "ultimate_gain" not in x
    assert x["margins"]["phase_margin"] >= 45.0 and x["margins"]["gain_margin_db"] >= 6.0
    assert x["following_error"] < 0.5 * x["following_error_before"]
    calm = json.loads(splinefeed(*words, "--phase-margin", "65", "--gain-margin", "10").stdout)["axes"]["x"]
    assert calm["margins"]["phase_margin"] >= 65.0 and calm["margins"]["gain_margin_db"] >= 10.0
    assert calm["overshoot"] < x["overshoot"]
    said = splinefeed("tune", "xytheta", "--axis", "theta").stdout
    assert (
        "theta, old gains: stable" in said
        and said.count("following error ") == 2
        and " deg on a standard move, which does not turn back; step overshoot" in said
    )


def test_less_integral_than_before_is_said(splinefeed):
    """The move from rest to rest follows better with less integral; friction at reversals does not."""
    (note,) = json.loads(splinefeed("tune", "lintable", "--axis", "x", "--json").stdout)["notes"]
    assert note.startswith("the integral of axis x (27%) is less than that of the old gains")


def test_table_2_on_a_fast_drive_is_told_unstable_with_what_would_help(splinefeed, machine):
    result = splinefeed("tune", "fast.toml", "--axis", "x,y", "--rule", "tyreus-luyben")
    assert result.exit_code == 0
    assert "x, old gains: unstable: a closed-loop pole has modulus 1.1644; " in result.stdout
    assert "; stable only below 0.741 of these gains (-2.6 dB)" in result.stdout
    assert "theta" not in result.stdout


def test_the_json_object_has_gains_and_margins(splinefeed):
    result = splinefeed("tune", "xytheta", "--axis", "x", "--rule", "ziegler-nichols", "--json")
    page = json.loads(result.stdout)
    assert (page["ok"], page["machine"], page["rule"]) == (True, "xytheta", "ziegler-nichols")
    x = page["axes"]["x"]
    assert x["gains_before"]["kp"] == 22.3833
    assert x["gains"]["kp"] == pytest.approx(0.6 * x["ultimate_gain"])
    assert x["ultimate_gain"] == pytest.approx(82.07, rel=0.01)
    assert x["unit"] == "V/mm"
    assert x["margins"]["stable"] is True
    assert x["margins"]["phase_margin"] == pytest.approx(17.5, abs=0.3)
    for key in ("gain_margin", "gain_margin_db", "gain_frequency", "phase_frequency", "delay_margin", "bandwidth"):
        assert x["margins"][key] > 0.0


def test_a_path_with_figures_and_a_machine_file(splinefeed, folder):
    words = ("tune", "xytheta", "--rule", "path", "--path", "circle?radius=5", "--feed", "40", "--accel", "500")
    words += ("--jerk", "20000", "--runs", "40", "-o", "out", "--write", "tuned.toml", "--json")
    page = json.loads(splinefeed(*words).stdout)
    assert page["contour_error_max_mm"] < 0.8 * page["contour_error_max_before_mm"]
    assert page["runs"] <= 40
    assert set(page["axes"]) == {"x", "y"}
    assert sorted(page["files"]) == sorted(
        ["tuned.toml", *(f"out/{n}.svg" for n in ("bode-x", "bode-y", "step")), "out/tune.json"]
    )
    assert all((folder / name).stat().st_size > 500 for name in page["files"])
    tuned = Machine.load(folder / "tuned.toml")
    assert tuned.axes["x"].controller.kp == page["axes"]["x"]["gains"]["kp"]
    assert tuned.axes["theta"] == Machine.load("xytheta").axes["theta"]
    again = splinefeed("tune", "tuned.toml", "--axis", "x", "--json")
    assert json.loads(again.stdout)["axes"]["x"]["gains_before"] == page["axes"]["x"]["gains"]


def test_figures_of_axes_that_are_left_out_go_away(splinefeed, folder):
    splinefeed("tune", "xytheta", "--axis", "x,y", "-o", "out")
    assert (folder / "out" / "bode-y.svg").exists()
    splinefeed("tune", "xytheta", "--axis", "x", "-o", "out")
    assert sorted(path.name for path in (folder / "out").iterdir()) == sorted(["bode-x.svg", "step.svg", "tune.json"])


def test_what_is_refused(refused, machine):
    assert refused("tune", "xytheta", "--axis", "w") == ("--axis: xytheta has no axis 'w'; its axes are x, y, theta")
    assert refused("tune", "xyteta").endswith("did you mean 'xytheta'?")
    assert refused("tune", "xytheta", "--rule", "zn").startswith("no tuning rule is called 'zn'; there are ")
    assert refused("tune", "xytheta", "--feed", "40") == "--feed: has no effect with --rule margins; leave it out"
    assert refused("tune", "xytheta", "--rule", "tyreus-luyben", "--phase-margin", "50") == (
        "--phase-margin: has no effect with --rule tyreus-luyben; leave it out"
    )
    assert refused("tune", "xytheta", "--gain-margin", "0").startswith("gain_margin is 1.0; it must lie between 1 and")
    assert refused("tune", "xytheta", "--path", "circle") == "--path: has no effect with --rule margins; leave it out"
    assert refused("tune", "xytheta", "--rule", "path", "--kind", "pi") == (
        "--kind: has no effect with --rule path; leave it out"
    )
    assert refused("tune", "xytheta", "--rule", "path", "--runs", "0") == (
        "evaluations is 0; it must be a whole number from 1 to 100000"
    )
    assert refused("tune", "xytheta", "--period", "0") == "period is 0.0 s; it must be greater than 0 and finite"
    assert refused("tune", "xytheta", "--write", "new.txt") == "new.txt: a machine file is named .toml"
    assert refused("tune", "xytheta", "--rule", "path", "--path", "circle", "--axis", "theta") == (
        "axis 'theta' does not move on this path; its axes are x, y"
    )


BROKEN = {
    'kp = "22.3833V/mm"': ('kp = "-22V/mm"', "axis.x.controller.kp: -22V/mm; must not be negative"),
    'ki = "266.8899V/mm/s"': ('ki = "nanV/mm/s"', "axis.x.controller.ki: 'nanV/mm/s' cannot be read"),
    'kd = "0.1862V*s/mm"': ('kd = "0.1862V/mm"', "axis.x.controller.kd: '0.1862V/mm' is of another kind"),
    'inertia = "1.73e-5kg*m^2"': ('inertia = "0kg*m^2"', "axis.x.motor.inertia: 0kg*m^2; must be greater than 0"),
    'inertia = "25kg"': ('inertia = "0kg"', "axis.x.load.inertia: 0kg; must be greater than 0"),
    "pulses = 5000": ("pulses = 0", "axis.x.encoder.pulses: 0; must be a whole number from 1"),
    'resolution = "1um"': ('resolution = "0um"', "axis.x.scale.resolution: 0um; must be greater than 0"),
    'stribeck_speed = "2mm/s"': ('stribek_speed = "2mm/s"', "axis.x.friction.stribek_speed: unknown key; did you mean"),
    "output_bits = 16": ("output_bits = nan", "axis.x.controller.output_bits: nan; must be a whole number"),
}


@pytest.mark.parametrize("good", BROKEN)
def test_a_machine_file_with_nonsense_is_refused_with_its_place(refused, folder, good):
    bad, message = BROKEN[good]
    text = _text("xytheta")
    assert good in text
    (folder / "bad.toml").write_text(text.replace(good, bad, 1))
    said = refused("tune", "bad.toml")
    assert said.startswith("bad.toml: ")
    assert message in said


def test_gains_that_are_still_unstable_are_exit_1(splinefeed, folder, monkeypatch):
    """A servo far too slow for the drive: Ziegler and Nichols' own gains do not hold it."""
    text = _text("xytheta").replace(SLOW, 'lag = "0.1ms"')
    (folder / "hasty.toml").write_text(text)
    result = splinefeed("tune", "hasty.toml", "--axis", "x", "--rule", "ziegler-nichols")
    assert ("x, new gains: unstable: " in result.stdout) == (result.exit_code == 1)
    assert result.exit_code in (0, 1)
