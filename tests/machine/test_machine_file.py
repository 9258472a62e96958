"""Machine files: the ones of the package, units, and everything that is refused, with its place and exact words."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

import splinefeed
from splinefeed.errors import FormatError, InputError, UnitError
from splinefeed.machine import Encoder, Machine, MachineError, limits_toml
from splinefeed.machine.quantities import KINDS, parse, show
from splinefeed.machine.under import under
from splinefeed.records import Limits

pytestmark = pytest.mark.nojit

GOOD = """
title = "one axis"

[axis.x.motor]
rated_force = "1.27N*m"
peak_force = "3.82N*m"
rated_speed = "3000rpm"
inertia = "1.73e-5kg*m^2"

[axis.x.drive]
mode = "velocity"
speed_per_volt = "25mm/s/V"
lag = "10ms"
bandwidth = "60Hz"

[axis.x.transmission]
kind = "screw"
lead = "5mm/rev"

[axis.x.load]
inertia = "25kg"

[axis.x.encoder]
pulses = 5000

[axis.x.controller]
kp = "20V/mm"
feedback = "encoder"
error_limit = "5mm"
"""


def problems(*changes: tuple[str, str]) -> tuple[str, ...]:
    """What is wrong with GOOD after these replacements."""
    text = GOOD
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    with pytest.raises(MachineError) as caught:
        Machine.parse(text, "test", "test.toml")
    return caught.value.problems


def test_the_package_has_its_machines() -> None:
    shipped = Path(splinefeed.__file__).parent / "machines"
    assert Machine.names() == tuple(sorted(file.stem for file in shipped.glob("*.toml")))
    assert {"plain-mill", "router", "xytheta"} <= set(Machine.names())
    for name in Machine.names():
        machine = Machine.load(name)
        assert machine.name == name
        assert machine.title
        assert machine.notes


def test_xytheta_is_the_paper_s_table() -> None:
    """Table 2, 5000 pulses, 1 um, +-10 V with 16 bit, and the digest's reading of 25 mm/s a volt."""
    axes = Machine.load("xytheta").axes
    assert list(axes) == ["x", "y", "theta"]
    gains = {name: (axis.controller.kp, axis.controller.ki, axis.controller.kd) for name, axis in axes.items()}
    assert gains["x"] == (22.3833, 266.8899, 0.1862)
    assert gains["y"] == (38.3322, 266.8, 0.2975)
    assert gains["theta"] == (3.3322, 26.8, 0.5083)
    for name, axis in axes.items():
        assert axis.encoder is not None
        assert axis.encoder.pulses == 5000
        assert (axis.controller.output_limit, axis.controller.output_bits) == (10.0, 16)
        assert axis.rotary is (name == "theta")
    for name in ("x", "y"):
        assert axes[name].drive.speed_per_volt == 25.0
        assert axes[name].travel_per_motor == pytest.approx(5.0 / (2.0 * math.pi), rel=1e-15)
        assert axes[name].scale is not None
        assert axes[name].scale.resolution == 1e-3  # type: ignore[union-attr]
        assert pytest.approx(axes[name].motor.rated_speed * axes[name].travel_per_motor, rel=1e-12) == 10.0 * 25.0


def test_every_assumption_of_xytheta_has_its_reason() -> None:
    for axis in Machine.load("xytheta").axes.values():
        for section in ("motor", "drive", "transmission", "load", "friction", "encoder", "controller"):
            assert re.search(r"assumed|paper|as on X|class", getattr(axis, section).source), (axis.name, section)


def test_values_come_in_base_units() -> None:
    axis = Machine.parse(GOOD).axes["x"]
    assert axis.motor.rated_speed == pytest.approx(100.0 * math.pi, rel=1e-15)
    assert axis.drive.lag == pytest.approx(0.01, rel=1e-15)
    assert axis.drive.bandwidth == pytest.approx(120.0 * math.pi, rel=1e-15)
    assert axis.load.inertia == 25.0
    assert axis.controller.output_limit == 10.0


def test_inertia_and_force_at_the_axis_are_those_of_energy() -> None:
    """One N*m over one rad is one J; J w^2 / 2 of the motor is m v^2 / 2 of the mass that stands for it."""
    axis = Machine.parse(GOOD).axes["x"]
    mm_per_rad = 5.0 / (2.0 * math.pi)
    assert axis.force_per_motor_force == pytest.approx(1000.0 / mm_per_rad, rel=1e-14)
    kilograms = 1.73e-5 / (mm_per_rad / 1000.0) ** 2
    assert axis.motor_inertia == pytest.approx(kilograms / 1000.0, rel=1e-14)
    assert axis.load_inertia == 0.025
    theta = Machine.load("xytheta").axes["theta"]
    assert theta.force_per_motor_force == pytest.approx(5.0)
    assert theta.motor_inertia == pytest.approx(25.0 * 6.72e-5)


def test_limits_of_axes_are_those_of_the_file_in_base_units() -> None:
    machine = Machine.load("xytheta")
    given = machine.limits(("x", "theta", "z"))
    assert given["axis_velocity"] == {"x": 200.0, "theta": pytest.approx(math.radians(3000.0), rel=1e-15)}
    assert given["axis_minimum"] == {"x": -150.0}
    limits = Limits(feed=60.0, **machine.limits(("x", "y", "theta")))
    assert limits.of_axes("axis_acceleration", ("x", "y", "theta"))[:2].tolist() == [2000.0, 2000.0]
    assert limits.travel == {"x": (-150.0, 150.0), "y": (-150.0, 150.0)}
    assert Machine.parse(GOOD).limits(("x",)) == {}


def test_every_machine_of_the_package_limits_its_axes_and_says_where_that_comes_from() -> None:
    for name in Machine.names():
        for axis in Machine.load(name).axes.values():
            assert axis.limits.velocity
            assert axis.limits.acceleration
            assert axis.limits.jerk
            assert axis.limits.source.startswith(("assumed: ", "paper: "))


def test_numbers_for_programs_carry_their_units() -> None:
    numbers = Machine.load("xytheta").as_dict()
    assert (numbers["name"], list(numbers["axes"])) == ("xytheta", ["x", "y", "theta"])
    assert numbers["axes"]["x"]["load"]["inertia"] == {"value": 25.0, "unit": "kg"}
    assert numbers["axes"]["x"]["drive"]["bandwidth"] == {"value": pytest.approx(60.0), "unit": "Hz"}
    assert numbers["axes"]["theta"]["limits"]["velocity"] == {"value": pytest.approx(3000.0), "unit": "deg/s"}
    assert numbers["axes"]["theta"]["controller"]["kp"] == {"value": 3.3322, "unit": "V/rad"}
    assert numbers["axes"]["x"]["encoder"]["pulses"] == 5000
    assert "scale" not in numbers["axes"]["theta"]


def test_a_machine_is_told_in_words() -> None:
    text = Machine.load("xytheta").describe()
    for words in ('[axis.x.load]\ninertia = "25kg"', 'lead = "5mm/rev"', 'lag = "10ms"', 'velocity = "3000deg/s"'):
        assert words in text, words
    assert "kg of motor and transmission beside 25 kg of load, peak " in text and "one encoder count 0.25 um" in text


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("pulses = 5000", "pulses = 0", "axis.x.encoder.pulses: 0; must be a whole number from 1 to 100000000"),
        ("pulses = 5000", "pulses = 1.5", "axis.x.encoder.pulses: 1.5; must be a whole number from 1 to 100000000"),
        ("pulses = 5000", "pulse = 5000", "axis.x.encoder.pulse: unknown key; did you mean 'pulses'?"),
        ('"25kg"', '"0kg"', "axis.x.load.inertia: 0kg; must be greater than 0"),
        ('"25kg"', "25", "axis.x.load.inertia: 25 has no unit; expected a mass or inertia such as 20kg"),
        ('"25kg"', '"25"', "axis.x.load.inertia: '25' has no unit; expected a mass or inertia such as 20kg"),
        ('"25kg"', '"25N"', "axis.x.load.inertia: '25N' is of another kind; expected a mass or inertia such as 20kg"),
        (
            '"25kg"',
            '"25stone"',
            "axis.x.load.inertia: '25stone' has an unknown unit: stone; expected a mass or inertia such as 20kg",
        ),
        ('"25kg"', "true", "axis.x.load.inertia: True is not a number; expected a mass or inertia such as 20kg"),
        ('"20V/mm"', '"-20V/mm"', "axis.x.controller.kp: -20V/mm; must not be negative"),
        ('"20V/mm"', '"0V/mm"', "axis.x.controller.kp: missing; needed by controller.kind 'pid'"),
        ('"velocity"', '"speed"', "axis.x.drive.mode: 'speed'; must be one of velocity, torque"),
        ('lag = "10ms"', "", "axis.x.drive.lag: missing; such as 1ms"),
        ('lead = "5mm/rev"', "", "axis.x.transmission.lead: missing; needed by transmission.kind 'screw'"),
        (
            'lead = "5mm/rev"',
            'lead = "5mm/rev"\nratio = 3',
            "axis.x.transmission.ratio: not used by transmission.kind 'screw'",
        ),
        ('"encoder"', '"scale"', "axis.x.controller.feedback: 'scale'; the axis has no scale"),
        ('"3.82N*m"', '"1N*m"', "axis.x.motor.peak_force: 1; must not be below rated_force"),
        (
            "[axis.x.encoder]",
            '[axis.x.limits]\nvelocity = "251mm/s"\n[axis.x.encoder]',
            "axis.x.limits.velocity: 251 mm/s; the motor's rated speed gives 250 mm/s at most",
        ),
        (
            "[axis.x.encoder]",
            '[axis.x.limits]\nminimum = "-1mm"\n[axis.x.encoder]',
            "axis.x.limits.minimum: give both ends of the travel, limits.minimum less than limits.maximum",
        ),
        (
            "[axis.x.encoder]",
            '[axis.x.limits]\nminimum = "0mm"\nmaximum = "0mm"\n[axis.x.encoder]',
            "axis.x.limits.minimum: give both ends of the travel, limits.minimum less than limits.maximum",
        ),
        (
            "[axis.x.encoder]",
            '[axis.x.limits]\njerk = "0mm/s^3"\n[axis.x.encoder]',
            "axis.x.limits.jerk: 0mm/s^3; must be greater than 0",
        ),
        (
            "[axis.x.encoder]",
            '[axis.x.limits]\nacceleration = "5mm/s"\n[axis.x.encoder]',
            "axis.x.limits.acceleration: '5mm/s' is a feed; expected an acceleration such as 2000mm/s^2",
        ),
        (
            "[axis.x.encoder]",
            '[axis.x.friction]\ncoulomb = "5N"\nstatic = "3N"\n[axis.x.encoder]',
            "axis.x.friction.static: 3; must not be below friction.coulomb",
        ),
        (
            "[axis.x.encoder]",
            '[axis.x.friction]\ncoulomb = "5N"\nstatic = "8N"\n[axis.x.encoder]',
            "axis.x.friction.stribeck_speed: missing; needed when static differs from coulomb",
        ),
        (
            'kp = "20V/mm"',
            'kind = "p-pi"\nposition_gain = "30/s"\nvelocity_kp = "1V*s/mm"\nkp = "20V/mm"',
            "axis.x.controller.kp: not used by controller.kind 'p-pi'",
        ),
        ("title = ", "titel = ", "titel: unknown key; did you mean 'title'?"),
        ('title = "one axis"', "title = 3", "title: 3; must be text"),
        ('title = "one axis"', "notes = 3", "notes: 3; must be a list of texts"),
        (
            'title = "one axis"',
            '[axis.x]\nmotion = "rotary"',
            "axis.x.motion: 'rotary'; must be linear: rotary are a, b, c, theta",
        ),
    ],
)
def test_what_is_wrong_is_said_with_its_place(old: str, new: str, message: str) -> None:
    assert message in problems((old, new))


def test_every_error_is_said_at_once() -> None:
    found = problems(
        ("pulses = 5000", "pulses = 0"), ('"25kg"', '"-1kg"'), ("bandwidth", "bandwith"), ('"10ms"', '"10mm"')
    )
    assert found == (
        "axis.x.drive.bandwith: unknown key; did you mean 'bandwidth'?",
        "axis.x.drive.lag: '10mm' is a length; expected a time such as 1ms",
        "axis.x.load.inertia: -1kg; must be greater than 0",
        "axis.x.encoder.pulses: 0; must be a whole number from 1 to 100000000",
    )
    with pytest.raises(MachineError) as caught:
        Machine.parse(GOOD.replace("5000", "0").replace("25kg", "0kg"), "test", "test.toml")
    assert str(caught.value) == (
        "test.toml: 2 errors\n  axis.x.load.inertia: 0kg; must be greater than 0\n"
        "  axis.x.encoder.pulses: 0; must be a whole number from 1 to 100000000"
    )


def test_a_single_error_is_one_line() -> None:
    with pytest.raises(FormatError) as caught:
        Machine.parse(GOOD.replace("5000", "0"), "test", "test.toml")
    assert str(caught.value) == "test.toml: axis.x.encoder.pulses: 0; must be a whole number from 1 to 100000000"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "m.toml: axis"),
        ("axis = 3", "m.toml: axis"),
        ("[axis]\nx = 3", "m.toml: axis.x: must be a table"),
    ],
)
def test_files_without_axes_are_refused(text: str, message: str) -> None:
    with pytest.raises(FormatError) as caught:
        Machine.parse(text, "m", "m.toml")
    assert str(caught.value).startswith(message)


def test_files_that_are_no_machines_are_refused(tmp_path: Path) -> None:
    broken = tmp_path / "broken.toml"
    broken.write_text("[axis.x\n", encoding="utf-8")
    with pytest.raises(FormatError, match=r"broken\.toml: is not TOML: "):
        Machine.load(broken)
    broken.write_bytes(b"\xff\xfe")
    with pytest.raises(FormatError, match=r"broken\.toml: is not TOML"):
        Machine.load(str(broken))
    broken.write_text("#" * (2**20 + 1), encoding="utf-8")
    with pytest.raises(FormatError, match=r"broken\.toml: is larger than 1 MB"):
        Machine.load(broken)
    with pytest.raises(FormatError, match=r"absent\.toml: no such file"):
        Machine.load(tmp_path / "absent.toml")
    with pytest.raises(FormatError) as caught:
        Machine.load("xyteta")
    assert str(caught.value) == (
        f"xyteta: no machine of this name; there are {', '.join(Machine.names())}; did you mean 'xytheta'?"
    )


def test_a_file_of_one_s_own_is_read(tmp_path: Path) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text(GOOD, encoding="utf-8")
    assert Machine.load(mine).name == "mine"
    assert Machine.load(str(mine)).axes == Machine.parse(GOOD).axes


def test_parts_made_in_python_are_checked_too() -> None:
    with pytest.raises(InputError) as caught:
        Encoder(pulses=0)
    assert str(caught.value) == "encoder.pulses: 0; must be a whole number from 1 to 100000000"


@pytest.mark.parametrize(
    ("text", "kind", "rotary", "value"),
    [
        ("1.27 N*m", "force", True, 1.27),
        ("1.27Nm", "force", True, 1.27),
        ("0.5kN", "force", False, 500.0),
        ("5mm/rev", "lead", False, 5.0 / (2.0 * math.pi)),
        ("3000rpm", "speed", True, 100.0 * math.pi),
        ("3.6m/min", "speed", False, 60.0),
        ("30/s", "position loop gain", False, 30.0),
        ("60Hz", "frequency", False, 120.0 * math.pi),
        ("0.173kg*cm^2", "inertia", True, 1.73e-5),
        ("173g*cm^2", "inertia", True, 1.73e-5),
        ("500g", "inertia", False, 0.5),
        ("0.5g", "acceleration", False, 4903.325),
        ("2 V·s²/mm", "acceleration gain", False, 2.0),
        ("30Hz", "position loop gain", False, 60.0 * math.pi),
        ("377/s", "frequency", False, 377.0),
        ("377 1/s", "frequency", False, 377.0),
        ("1V/deg", "gain", True, 180.0 / math.pi),
        ("100nm", "position", False, 1e-4),
        ("2e2 N/um", "stiffness", False, 2e5),
        ("0.36arcsec", "position", True, 0.36 * math.pi / 648000.0),
        ("250 V/mm/s", "integral gain", False, 250.0),
        ("10v", "voltage", False, 10.0),
    ],
)
def test_quantities_are_read(text: str, kind: str, rotary: bool, value: float) -> None:
    assert parse(text, kind, rotary) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("5mm/", "'5mm/' cannot be read"),
        ("mm", "'mm' cannot be read"),
        ("1e999mm", "'1e999mm' is not finite"),
        ("5mm^^2", "'5mm^^2' cannot be read"),
        ("nan mm", "'nan mm' cannot be read"),
        (None, "None is not a number"),
    ],
)
def test_what_is_no_quantity_is_refused(text: object, what: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse(text, "position", False)
    assert str(caught.value) == f"{what}; expected a position such as 0.01mm"


def test_every_example_is_a_quantity_of_its_kind() -> None:
    for name, kinds in KINDS.items():
        for rotary in (False, True):
            value = parse(kinds[rotary].example, name, rotary)
            assert value > 0.0
            assert show(value, name, rotary)


def test_kinematics_are_read_written_and_shown() -> None:
    machine = Machine.load("trunnion")
    assert machine.kinematics is not None
    assert machine.kinematics.kind == "xyzac-trt"
    assert Machine.load("router").kinematics is None
    text = machine.to_text().replace('type = "xyzac-trt"', 'type = "xyzac-trt"\ny-offset = "1in"\ntool-offset = "60mm"')
    other = Machine.parse(text, "other")
    assert other.kinematics is not None
    assert other.kinematics.parameters == {"y-offset": 25.4, "tool-offset": 60.0}
    assert Machine.parse(other.to_text(), "other") == other
    assert 'type = "xyzac-trt"\ny-offset = "25.4mm"' in other.describe()
    assert other.as_dict()["kinematics"]["y-offset"] == {"value": 25.4, "unit": "mm"}


@pytest.mark.parametrize(
    ("section", "said"),
    [
        ('type = "hexapod"', "kinematics.type: 'hexapod'; must be one of xyzac-trt, xyzbc-trt, 5axiskins, "),
        ("", "kinematics.type: None; must be one of "),
        ('type = "5axiskins"', 'kinematics.pivot-length: missing; 5axiskins needs it, such as pivot-length = "150mm"'),
        ('type = "xyzac-trt"\nx-offset = "3mm"', "kinematics.x-offset: unknown parameter; xyzac-trt has "),
        ('type = "xyzac-trt"\ny-offset = "3kg"', "kinematics.y-offset: "),
        ('type = "xyzac-trt"\ny-offset = 3', "kinematics.y-offset: 3 has no unit"),
        ('type = "gantry"', "kinematics.type: gantry moves the joint y; give an [axis.y]"),
    ],
)
def test_kinematics_that_cannot_be_are_refused(section: str, said: str) -> None:
    with pytest.raises(MachineError) as caught:
        Machine.parse(f"[kinematics]\n{section}\n{GOOD[GOOD.index('[axis') :]}", "test")
    assert caught.value.problems[0].startswith(said)


CONTROL = """[control]
mode = "exact stop"
acceleration = "200mm/s^2"
look_ahead = 50
[control.spindle]
top_speed = "12000rpm"
start = "7s"
[control.home]
z = "330mm"
[control.axis.x]
rapid = "30m/min"
[control.axis.c]
rapid = "90deg/s"
"""


def test_a_control_needs_no_axes_and_is_read_written_and_shown() -> None:
    machine = Machine.parse(CONTROL, "mill")
    assert machine.control is not None
    assert machine.control.spindle is not None
    assert machine.axes == {}
    assert (machine.control.mode, machine.control.look_ahead, machine.control.home.z) == ("exact stop", 50, 330.0)
    assert machine.control.axes["x"].rapid == pytest.approx(500.0)
    assert machine.control.axes["c"].rapid == pytest.approx(math.pi / 2)
    assert machine.control.spindle.wait(7.0, 0.0, machine.control.spindle.top_speed / 2) == pytest.approx(7.0 / 4)
    assert Machine.parse(machine.to_text(), "mill") == machine
    assert Machine.parse(f"{GOOD}{CONTROL}", "mill").control == machine.control
    assert 'start = "7s"' in machine.describe()
    assert machine.as_dict()["control"]["axis.c.rapid"] == {"value": pytest.approx(90.0), "unit": "deg/s"}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"200mm/s^2"', '"-1mm/s^2"', "control.acceleration: -1mm/s^2; must be greater than 0"),
        ('"200mm/s^2"', "200", "control.acceleration: 200 has no unit"),
        ("look_ahead = 50", "look_ahead = -1", "control.look_ahead: -1; must be a whole number from 0 to 1000000"),
        ("look_ahead", "lookahead", "control.lookahead: unknown key; did you mean 'look_ahead'?"),
        ('top_speed = "12000rpm"', "", "control.spindle.top_speed: missing"),
        ('"330mm"', '"nanmm"', "control.home.z: 'nanmm' cannot be read"),
        ('"30m/min"', '"0mm/s"', "control.axis.x.rapid: 0mm/s; must be greater than 0"),
        ("[control.spindle]", "[control.spindles]", "control.spindles: unknown key; did you mean 'spindle'?"),
        (CONTROL, "control = 3", "control: must be a table"),
        ("[control.axis.x]\nrapid", "[control.axis]\nx", "control.axis.x: must be a table"),
    ],
)
def test_a_control_that_cannot_be_is_refused(old: str, new: str, said: str) -> None:
    assert old in CONTROL
    with pytest.raises(MachineError) as caught:
        Machine.parse(CONTROL.replace(old, new), "mill")
    assert any(problem.startswith(said) for problem in caught.value.problems), caught.value.problems


PLAIN = """
[axis.x.limits]
velocity = "120in/min"
acceleration = "20in/s^2"
minimum = "0in"
maximum = "12in"
[axis.a.limits]
velocity = "10rpm"
"""


def test_axes_with_limits_alone_are_a_machine() -> None:
    machine = Machine.parse(PLAIN, "mill")
    assert machine.axes["x"].limits.velocity == pytest.approx(50.8)
    assert machine.axes["a"].rotary
    assert machine.limits(("x", "a"))["axis_velocity"] == {"x": pytest.approx(50.8), "a": pytest.approx(math.pi / 3)}
    assert not machine.simulates(("x", "y"))
    assert machine.simulates(("y",)) and Machine.load("router").simulates(("x", "y", "z"))
    assert Machine.parse(machine.to_text(), "mill") == machine
    assert 'maximum = "12in"' in machine.to_text()
    with pytest.raises(InputError, match=r"^mill: axis x has limits alone, .*: add \[axis\.x\.motor\], "):
        machine.servo_axis("x")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[axis.x]\n", "axis.x.limits: missing; give at least velocity and acceleration"),
        ('[axis.x.limits]\nspeed = "3mm/s"', "axis.x.limits.speed: unknown key; known are velocity, acceleration"),
        ('[axis.x.limit]\nvelocity = "3mm/s"', "axis.x.limit: unknown key; did you mean 'limits'?"),
        ('[axis.x.limits]\nminimum = "3mm"', "axis.x.limits.minimum: give both ends of the travel"),
        ('[axis.x.limits]\nvelocity = "3mm/s"\n[axis.x.load]\ninertia = "2kg"', "axis.x.motor: missing"),
    ],
)
def test_what_is_wrong_with_limits_alone_is_said(text: str, message: str) -> None:
    with pytest.raises(MachineError) as caught:
        Machine.parse(text, "mill")
    assert caught.value.problems[0].startswith(message)


def test_files_of_limits_and_of_machines_are_told_apart() -> None:
    with pytest.raises(FormatError, match=r"^l\.toml: holds limits of a motion, not a machine; give it by --limits l"):
        Machine.parse("axis_velocity = 60\n", "l", "l.toml")
    with pytest.raises(FormatError, match=r"^m\.toml: holds a machine, not limits of a motion; give it by --machine m"):
        limits_toml.parse(PLAIN, "m.toml")


def test_limits_make_a_machine_or_hold_in_place_of_its_own() -> None:
    limits = Limits(axis_velocity=60.0, axis_acceleration={"x": 500.0, "a": 2.0}, jerk=9000.0, chord_error=0.1)
    made, unused = under(limits)
    assert list(made.axes) == ["x", "y", "z", "a"]
    assert (made.axes["y"].limits.velocity, made.axes["y"].limits.acceleration) == (60.0, None)
    assert (made.axes["a"].limits.velocity, made.axes["a"].limits.acceleration) == (None, 2.0)
    assert made.control is not None and (made.control.jerk, made.control.acceleration) == (9000.0, None)
    assert unused == ("chord_error",)
    made, _ = under(Limits(axis_velocity=60.0, axis_acceleration={"x": 500.0}), Machine.parse(CONTROL + PLAIN, "mill"))
    assert list(made.axes) == ["x", "a"]
    assert made.control is not None and made.control.axes["x"].rapid == 60.0
    assert made.control.axes["c"].rapid == pytest.approx(math.pi / 2)
    assert made.axes["x"].limits.maximum == pytest.approx(304.8)
