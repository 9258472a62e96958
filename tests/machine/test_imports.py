"""Machines from configurations: short files with the keys and values of public ones, what is assumed, what is refused.

Values are facts from: LinuxCNC's sim configurations axis_9axis.ini, axis_mm_scurve.ini, gantry_mm.ini (2.9, master) and
axis.ini (2.7) of github.com/LinuxCNC/linuxcnc; grbl settings of gist.github.com/hdo/f1941bc97b, masha256/d8b4a87a55 and
pastebin.com/ZWNSj5ML; printer.cfg of pastebin.com/QEzDBiqz, gist.github.com/tildebyte/b8f638b951 and
nezuppo/0d06444bbf; M503 of github.com/MarlinFirmware/Marlin/issues/27908, luc-github/ESP3D/issues/225 and a Marlin 2.0
with classic jerk. The files themselves are written for these tests.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from splinefeed.errors import FormatError, InputError
from splinefeed.machine import Machine
from splinefeed.machine.imports import imported
from splinefeed.machine.imports.page import Page

NINE_AXES = """
[EMC]
MACHINE = LinuxCNC-sim-9axis
[EMCMOT]
SERVO_PERIOD = 1000000
[EMCIO]
TOOL_TABLE = sim.tbl
TOOL_CHANGE_POSITION = 0 0 2
[TRAJ]
   COORDINATES = X Y Z A B C U V W
  LINEAR_UNITS = inch
 ANGULAR_UNITS = degree
MAX_LINEAR_VELOCITY = 1.2
MAX_LINEAR_ACCELERATION = 20.0
[KINS]
KINEMATICS = trivkins
[AXIS_X]
MAX_VELOCITY = 1.2
MAX_ACCELERATION = 20.0
MIN_LIMIT = -10.0
MAX_LIMIT = 10.0
[AXIS_Z]
MAX_VELOCITY = 1.2
MAX_ACCELERATION = 20.0
MIN_LIMIT = -2.0
MAX_LIMIT = 4.0
""" + "".join(f"[AXIS_{each}]\nMAX_VELOCITY = 1.2\nMAX_ACCELERATION = 20.0\n" for each in "YUVW")  # fmt: skip
NINE_AXES += "".join(f"[AXIS_{each}]\nMAX_VELOCITY = 90.0\nMAX_ACCELERATION = 1200.0\n" for each in "ABC")

S_CURVE = """
[EMC]
MACHINE = scurve_example
[TRAJ]
# 1 = S-curve
PLANNER_TYPE = 1
MAX_LINEAR_JERK = 10000.0
COORDINATES = X Y Z
LINEAR_UNITS = 1.0
ANGULAR_UNITS = 1.0
MAX_LINEAR_VELOCITY = 300.0
MAX_LINEAR_ACCELERATION = 1000.0
[KINS]
KINEMATICS = trivkins
JOINTS = 3
[JOINT_0]
MAX_VELOCITY = 300.0
MAX_ACCELERATION = 1000.0
MAX_JERK = 10000.0
#MIN_LIMIT = -200.0 #disabled
[JOINT_1]
MAX_VELOCITY = 300.0
MAX_ACCELERATION = 1000.0
MAX_JERK = 10000.0
[JOINT_2]
MAX_VELOCITY = 200.0
MAX_ACCELERATION = 800.0
MAX_JERK = 10000.0
[AXIS_X]
MAX_VELOCITY = 300.0
MAX_ACCELERATION = 1000.0
MAX_JERK = 10000.0
"""

GANTRY = """
[KINS]
KINEMATICS = trivkins coordinates=xyyz kinstype=BOTH
JOINTS = 4
[TRAJ]
COORDINATES = X Y Y Z
LINEAR_UNITS = mm
MAX_LINEAR_VELOCITY = 100
MAX_LINEAR_ACCELERATION = 800
[RS274NGC]
RS274NGC_STARTUP_CODE = G21 G40 G49 G64 P0.025 G80 G90
[AXIS_X]
MAX_VELOCITY = 30
MAX_ACCELERATION = 200
MIN_LIMIT = 0
MAX_LIMIT = 400
[AXIS_Y]
MAX_VELOCITY = 30
MAX_ACCELERATION = 200
MIN_LIMIT = 0
MAX_LIMIT = 2000
[JOINT_0]
MAX_VELOCITY = 100
MAX_ACCELERATION = 900
[JOINT_1]
MAX_VELOCITY = 200
MAX_ACCELERATION = 1000
[JOINT_2]
MAX_VELOCITY = 20
MAX_ACCELERATION = 1000
[JOINT_3]
MAX_VELOCITY = 50
MAX_ACCELERATION = 500
MIN_LIMIT = 0
MAX_LIMIT = 100
"""

OLD = """
[EMC]
MACHINE =               LinuxCNC-HAL-SIM-AXIS
[TRAJ]
AXES =                  3
LINEAR_UNITS =          inch
MAX_VELOCITY =          1.2
[AXIS_0]
MAX_VELOCITY =                  4
MAX_ACCELERATION =              100.0
MIN_LIMIT =                     -40.0
MAX_LIMIT =                     40.0
[AXIS_1]
MAX_VELOCITY =                  4
MAX_ACCELERATION =              100.0
[AXIS_2]
MAX_VELOCITY =                  4
MAX_ACCELERATION =              100.0
MIN_LIMIT =                     -8.0
MAX_LIMIT =                     0.0001
"""


@pytest.fixture
def made(tmp_path: Path):  # type: ignore[no-untyped-def]
    """The machine from the text of a configuration, and its page."""

    def make(kind: str, text: str, name: str = "mine.cfg") -> tuple[Machine, Page]:
        file = tmp_path / name
        file.write_text(text, encoding="utf-8")
        machine, page = imported(kind, file)
        assert Machine.parse(page.text(), machine.name) == machine
        assert all(f"Assumed: {each}." in machine.notes for each in page.assumed)
        return machine, page

    return make


def test_a_linuxcnc_of_nine_axes_in_inches(made) -> None:  # type: ignore[no-untyped-def]
    machine, page = made("ini", NINE_AXES)
    assert list(machine.axes) == list("xyzabcuvw")
    assert machine.title == "LinuxCNC-sim-9axis, LinuxCNC"
    x, a = machine.axes["x"].limits, machine.axes["a"].limits
    assert (x.velocity, x.acceleration) == (pytest.approx(30.48), pytest.approx(508.0))
    assert (x.minimum, x.maximum, x.jerk) == (pytest.approx(-254.0), pytest.approx(254.0), None)
    assert (a.velocity, a.acceleration) == (pytest.approx(math.pi / 2), pytest.approx(math.radians(1200.0)))
    assert machine.control is not None
    assert machine.control.velocity == pytest.approx(30.48)
    assert (machine.control.model, machine.control.tolerance) == ("linuxcnc", 1000.0)
    assert 'velocity = "1.2in/s"  # [AXIS_X]MAX_VELOCITY' in page.text()
    assert {"Servo period: --period 1ms.", "Tool table: --tools sim.tbl."} <= {*machine.notes}
    assert any(words.startswith("programs start in G64 without P") for words in page.assumed)


def test_a_linuxcnc_with_jerk_and_units_as_a_number(made) -> None:  # type: ignore[no-untyped-def]
    machine, _ = made("ini", S_CURVE)
    assert [machine.axes[each].limits.velocity for each in "xyz"] == [300.0, 300.0, 200.0]
    assert [machine.axes[each].limits.jerk for each in "xyz"] == [10000.0] * 3
    assert machine.control is not None and (machine.control.model, machine.control.jerk) == ("general", 10000.0)
    assert machine.axes["x"].limits.minimum is None
    flat, page = made("ini", S_CURVE.replace("PLANNER_TYPE = 1", "PLANNER_TYPE = 0"))
    assert flat.axes["x"].limits.jerk is None and flat.control is not None and flat.control.jerk is None
    assert "# MAX_JERK is not used: [TRAJ]PLANNER_TYPE is not 1" in page.text()


def test_the_joints_of_a_gantry_are_one_axis_and_the_slowest_holds(made) -> None:  # type: ignore[no-untyped-def]
    machine, page = made("ini", GANTRY)
    assert list(machine.axes) == ["x", "y", "z"]
    assert [machine.axes[each].limits.velocity for each in "xyz"] == [30.0, 20.0, 50.0]
    assert 'velocity = "20mm/s"  # [JOINT_2]MAX_VELOCITY' in page.text()
    assert (machine.axes["z"].limits.minimum, machine.axes["z"].limits.maximum) == (0.0, 100.0)
    assert machine.control is not None and machine.control.tolerance == 0.025


def test_a_linuxcnc_of_before_joints_and_axes_were_two_things(made) -> None:  # type: ignore[no-untyped-def]
    machine, _ = made("ini", OLD)
    assert list(machine.axes) == ["x", "y", "z"]
    assert machine.axes["z"].limits.velocity == pytest.approx(101.6)
    assert machine.axes["z"].limits.maximum == pytest.approx(0.00254)
    assert machine.control is not None and machine.control.velocity == pytest.approx(30.48)


@pytest.mark.parametrize(
    ("code", "mode", "tolerance"),
    [("G61.1", "exact stop", None), ("G61", "blending", None), ("G20 G64 P0.001", "blending", 0.0254),
     ("G64", "blending", 1000.0)],
)  # fmt: skip
def test_the_startup_code_says_how_corners_are_passed(made, code, mode, tolerance) -> None:  # type: ignore[no-untyped-def]
    control = made("ini", GANTRY.replace("G21 G40 G49 G64 P0.025", code))[0].control
    assert control.mode == mode
    assert control.tolerance == (tolerance if tolerance is None else pytest.approx(tolerance))


def test_files_that_are_included_are_read(made, tmp_path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "x.inc").write_text("[AXIS_X]\nMAX_VELOCITY = 7\n")
    assert made("ini", "#INCLUDE x.inc\n" + GANTRY)[0].axes["x"].limits.velocity == 7.0
    (tmp_path / "loop.cfg").write_text("#INCLUDE loop.cfg\n")
    with pytest.raises(FormatError, match="included in each other more than 8 deep"):
        imported("ini", tmp_path / "loop.cfg")


def test_kinematics_are_taken_where_they_are_known(made) -> None:  # type: ignore[no-untyped-def]
    five = NINE_AXES.replace("trivkins", "xyzac-trt-kins")
    machine, _ = made("ini", five)
    assert machine.kinematics is not None and machine.kinematics.kind == "xyzac-trt"
    machine, page = made("ini", five.replace("xyzac-trt-kins", "genserkins"))
    assert machine.kinematics is None
    assert any("genserkins is not modelled" in words for words in page.assumed)


GRBL = """Grbl 1.1g ['$' for help]
ok
$0=40
$11=0.010
$12=0.002
$13=0
$20=0
$100=80.000
$110=6000.000
$111=6000.000
$112=900.000
$120=200.000
$121=200.000
$122=50.000
$130=2200.000
$131=2300.000
$132=1200.000
ok
"""
NAMED = """
$11=0.020 (junction deviation, mm)
$110=8000.000 (x max rate, mm/min)
$111=8000.000 (y max rate, mm/min)
$112=500.000 (z max rate, mm/min)
$120=500.000 (x accel, mm/sec^2)
$121=500.000 (y accel, mm/sec^2)
$122=50.000 (z accel, mm/sec^2)
"""
FIVE = ">>> $$\n" + "".join(
    f"${110 + k} = {rate}    (axis maximum rate, mm/min)\n${120 + k} = {acceleration}\n"
    for k, (rate, acceleration) in enumerate([(7200, 400), (7200, 400), (400, 200), (7200, 400), (7200, 400)])
)


@pytest.mark.parametrize(
    ("text", "axes", "velocity", "acceleration", "tolerance"),
    [
        (GRBL, "xyz", (100.0, 100.0, 15.0), (200.0, 200.0, 50.0), 0.01),
        (NAMED, "xyz", (8000 / 60, 8000 / 60, 500 / 60), (500.0, 500.0, 50.0), 0.02),
        (
            FIVE,
            "xyzab",
            (120.0, 120.0, 400 / 60, math.radians(120.0), math.radians(120.0)),
            (400.0, 400.0, 200.0),
            None,
        ),
    ],
)
def test_grbl(made, text, axes, velocity, acceleration, tolerance) -> None:  # type: ignore[no-untyped-def]
    machine, _ = made("grbl", text)
    assert list(machine.axes) == list(axes)
    assert [axis.limits.velocity for axis in machine.axes.values()] == pytest.approx(list(velocity))
    assert [machine.axes[each].limits.acceleration for each in "xyz"] == list(acceleration)
    assert machine.control is not None
    assert (machine.control.model, machine.control.look_ahead) == ("grbl", 15)
    assert machine.control.junction_deviation == tolerance
    assert machine.control.arc_tolerance == (0.002 if text == GRBL else None)


def test_an_axis_of_grbl_without_rate_is_not_used(made) -> None:  # type: ignore[no-untyped-def]
    """As in a machine of two axes, gnea/grbl issue 751."""
    flat = GRBL.replace("$112=900.000", "$112=0.000").replace("$122=50.000", "$122=0.000")
    machine, page = made("grbl", flat)
    assert list(machine.axes) == ["x", "y"]
    assert "axis Z is not used: $112 and $122 are 0" in page.assumed
    with pytest.raises(FormatError, match=r"mine\.cfg: \$112: 0\.000; must be greater than 0"):
        made("grbl", GRBL.replace("$112=900.000", "$112=0.000"))


COREXY = """[exclude_object]
[printer]
kinematics: corexy
max_velocity: 500
max_accel: 7000
max_accel_to_decel:3500
max_z_velocity: 60
max_z_accel: 550
square_corner_velocity: 5.0
###################
[stepper_x]
position_max: 500
position_min: -15
[stepper_y]
position_min: -10
position_max: 510
[stepper_z]
position_min = -5
position_max: 430
[stepper_z1]
position_max: 1
"""
CARTESIAN = """[printer]
kinematics: cartesian
max_velocity: 250
max_accel: 1800
max_z_velocity: 25
max_z_accel: 100
[stepper_x]
rotation_distance: 40
"""
COMMENTED = """# reference: nothing
[printer]
kinematics: cartesian
# max_velocity: 220
max_velocity: 300
# max_accel: 900
max_accel: 7000 # klipper ringing test
max_z_velocity: 25
max_z_accel: 100
square_corner_velocity: 8.0
[gcode_macro X]
gcode:
    max_velocity: 1
[include steppers*.cfg]
"""


@pytest.mark.parametrize(
    ("text", "velocity", "acceleration", "corner", "travel"),
    [
        (COREXY, (500.0, 60.0), (7000.0, 550.0), 5.0, (-5.0, 430.0)),
        (CARTESIAN, (250.0, 25.0), (1800.0, 100.0), 5.0, (None, None)),
        (COMMENTED, (300.0, 25.0), (7000.0, 100.0), 8.0, (0.0, 180.0)),
    ],
)
def test_klipper(made, tmp_path, text, velocity, acceleration, corner, travel) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "steppers-1.cfg").write_text("[stepper_z]\nposition_max: 180\n")
    machine, page = made("klipper", text, "printer.cfg")
    assert (machine.axes["y"].limits.velocity, machine.axes["z"].limits.velocity) == velocity
    assert (machine.axes["y"].limits.acceleration, machine.axes["z"].limits.acceleration) == acceleration
    assert (machine.axes["z"].limits.minimum, machine.axes["z"].limits.maximum) == travel
    assert machine.control is not None
    assert (machine.control.velocity, machine.control.acceleration) == (velocity[0], acceleration[0])
    assert (machine.control.model, machine.control.corner_velocity) == ("klipper", corner)
    assert machine.control.cruise_ratio == 0.5  # as it is or by max_accel_to_decel 3500 of 7000
    assumed = "square_corner_velocity is 5 mm/s, Klipper's default" in page.assumed
    assert assumed == ("square_corner_velocity" not in text)


DEVIATION = """>>> m503
SENDING:M503
echo:; Linear Units:
echo:  G21 ; (mm)
echo:; Max feedrates (units/s):
echo:  M203 X1200.00 Y1200.00 Z180.00 E25.00
echo:; Max Acceleration (units/s2):
echo:  M201 X3000.00 Y3000.00 Z100.00 E10000.00
echo:; Acceleration (units/s2) (P<print-accel> R<retract-accel> T<travel-accel>):
echo:  M204 P3000.00 R3000.00 T3000.00
echo:; Advanced (B<min_segment_time_us> S<min_feedrate> T<min_travel_feedrate> J<junc_dev>):
echo:  M205 B20000.00 S0.00 T0.00 J0.01
"""
CLASSIC = """Recv: echo:  G21    ; Units in mm (mm)
Recv: echo:; Maximum feedrates (units/s):
Recv: echo:  M203 X500.00 Y500.00 Z10.00 E50.00
Recv: echo:; Maximum Acceleration (units/s2):
Recv: echo:  M201 X500.00 Y500.00 Z100.00 E5000.00
Recv: echo:  M204 P500.00 R1000.00 T600.00
Recv: echo:; Advanced: B<min_segment_time_us> S<min_feedrate> T<min_travel_feedrate> X<max_x_jerk> Y<max_y_jerk>
Recv: echo:  M205 B20000.00 S0.00 T0.00 X8.00 Y9.00 Z0.40 E5.00
"""
OLDER = """Config:Maximum feedrates (mm/s):
Config:  M203 X300.00 Y300.00 Z2.00 E100.00
Config:Maximum Acceleration (mm/s2):
Config:  M201 X3000 Y3000 Z50 E1000
Config:Accelerations: P=printing, V=travel and T* R=retract
Config:  M204 P3000.00 V2500.00
Config:  M204 T0 R10000.00
Config:Advanced variables: S=Min feedrate (mm/s), V=Min travel feedrate (mm/s)
Config:  M205 S0.00 V0.00 B20000 X10.00 Z0.40 E5.00
"""


@pytest.mark.parametrize(
    ("text", "velocity", "acceleration", "along", "corner"),
    [
        (DEVIATION, (1200.0, 180.0), (3000.0, 100.0), (3000.0, 3000.0), (0.01, None)),
        (CLASSIC, (500.0, 10.0), (500.0, 100.0), (500.0, 600.0), (None, 8.0)),
        (OLDER, (300.0, 2.0), (3000.0, 50.0), (3000.0, 2500.0), (None, 10.0)),
    ],
)
def test_marlin(made, text, velocity, acceleration, along, corner) -> None:  # type: ignore[no-untyped-def]
    machine, _ = made("marlin", text)
    assert list(machine.axes) == ["x", "y", "z"]
    assert (machine.axes["y"].limits.velocity, machine.axes["z"].limits.velocity) == velocity
    assert (machine.axes["y"].limits.acceleration, machine.axes["z"].limits.acceleration) == acceleration
    control = machine.control
    assert control is not None
    assert (control.acceleration, control.rapid_acceleration) == along
    step = control.axes["x"].velocity_step if control.axes else None
    assert (control.model, control.junction_deviation, step) == ("marlin", *corner)
    assert not control.axes or control.axes["z"].velocity_step == 0.4


@pytest.mark.parametrize(
    ("kind", "text", "words"),
    [
        ("ini", "[EMC]\nMACHINE = x\n", r"no section \[TRAJ\]; is it the INI file of a LinuxCNC machine\?"),
        ("ini", "[TRAJ]\nCOORDINATES = X Q\n", r"\[TRAJ\]COORDINATES: XQ; give the axes, such as X Y Z"),
        ("ini", "[TRAJ]\nCOORDINATES = X\n", r"MAX_VELOCITY of axis X: missing; add it to \[AXIS_X\] or \[JOINT_0\]"),
        ("ini", GANTRY.replace("= 30", "= fast"), r"\[AXIS_X\]MAX_VELOCITY: 'fast' is not a number"),
        ("ini", GANTRY.replace("= 200\n", "= -3\n"), r"\[AXIS_X\]MAX_ACCELERATION: -3; must be greater than 0"),
        ("ini", GANTRY.replace("MAX_LIMIT = 100", "MAX_LIMIT = -1"), r"\[JOINT_3\]MIN_LIMIT is not below"),
        ("grbl", "$0=10\n", r"no \$110; send \$\$ to grbl"),
        ("grbl", GRBL.replace("$121=200.000\n", ""), r"\$121, the acceleration of axis Y: missing"),
        ("klipper", "[mcu]\n", r"no section \[printer\]; is it Klipper's printer\.cfg\?"),
        ("klipper", "[printer]\nkinematics: none\n", "it has no axes"),
        ("klipper", "[printer]\nmax_velocity: 3\n", r"\[printer\] max_accel: missing"),
        ("klipper", CARTESIAN + "[include absent.cfg]\n", r"absent\.cfg: no such file"),
        ("marlin", "ok\n", "no M203, the greatest feed rates; send M503 to Marlin"),
        ("marlin", CLASSIC.replace("Z10.00", "Z0"), r"M203 Z: 0; must be greater than 0"),
        ("marlin", CLASSIC.replace("M201 X500.00", "M201"), r"M201 X: missing"),
    ],
)
def test_what_is_wrong_is_one_line_with_the_file(made, kind, text, words) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(FormatError, match=words) as caught:
        made(kind, text)
    assert "\n" not in str(caught.value) and "cfg: " in str(caught.value)


def test_an_unknown_kind_is_refused(tmp_path) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError, match="configuration 'mach3' is not known; "):
        imported("mach3", tmp_path / "a")


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../secret.inc", "~/x.inc", "/proc/**/*", "*/x.inc", "**", "a/../../b.inc", "."]
)
@pytest.mark.parametrize("kind", ["ini", "klipper"])
def test_only_files_beside_a_configuration_are_included(made, kind, name) -> None:  # type: ignore[no-untyped-def]
    line = f"#INCLUDE {name}\n" if kind == "ini" else f"[include {name}]\n"
    with pytest.raises(FormatError, match="only files beside it or in folders there are read"):
        made(kind, line + (GANTRY if kind == "ini" else CARTESIAN))


@pytest.mark.parametrize("kind", ["ini", "klipper"])
def test_few_files_are_included_however_they_name_each_other(made, tmp_path, kind) -> None:  # type: ignore[no-untyped-def]
    """Ten times ten times ten: a thousand files of a few lines each."""
    form = "#INCLUDE x{}.inc\n" if kind == "ini" else "[include x{}.inc]\n"
    for depth in range(3):
        (tmp_path / f"x{depth}.inc").write_text(10 * form.format(depth + 1))
    (tmp_path / "x3.inc").write_text("# nothing\n")
    with pytest.raises(FormatError, match="more than 100 files are included"):
        made(kind, form.format(0) + (GANTRY if kind == "ini" else CARTESIAN))
