"""A machine from the INI file of LinuxCNC: axes, joints, limits of travel, path limits, G64, kinematics, periods.

Sections and keys are those of LinuxCNC's documentation, "INI Configuration" (linuxcnc.org/docs/html/config), of 2.9,
and of 2.7 and before, where [AXIS_0] is the first axis and joint at once.
"""

from __future__ import annotations

import re
from pathlib import Path

from splinefeed.errors import FormatError
from splinefeed.kinematics import KINDS
from splinefeed.machine.control import WIDE
from splinefeed.machine.imports.included import IncludedFiles
from splinefeed.machine.imports.page import AXES, TURNS, Page, no_times, number, positive, short

#: Values of LINEAR_UNITS and ANGULAR_UNITS: the unit, and how many of it the file's unit is.
LINEAR = {"mm": ("mm", 1.0), "metric": ("mm", 1.0), "in": ("in", 1.0), "inch": ("in", 1.0), "imperial": ("in", 1.0)}
ANGULAR = {
    "deg": ("deg", 1.0), "degree": ("deg", 1.0), "rad": ("rad", 1.0), "radian": ("rad", 1.0), "grad": ("deg", 0.9),
    "gon": ("deg", 0.9),
}  # fmt: skip
#: Limits of axes and joints, which of several is the tightest, and how each is read.
_OF_AXIS = (
    ("MAX_VELOCITY", min, positive),
    ("MAX_ACCELERATION", min, positive),
    ("MAX_JERK", min, number),
    ("MIN_LIMIT", max, number),
    ("MAX_LIMIT", min, number),
)
#: Kinematics whose joints are the axes themselves.
TRIVIAL = "trivkins"

Sections = dict[str, dict[str, str]]


def read(text: str, source: str) -> Page:
    """Make the page of a machine file from the text of an INI file; FormatError for what is missing or wrong."""
    ini = sections(text, source)
    page = Page(source, "LinuxCNC")
    traj = ini.get("TRAJ", {})
    if "TRAJ" not in ini:
        raise FormatError(f"{source}: no section [TRAJ]; is it the INI file of a LinuxCNC machine?")
    page.title = f"{ini.get('EMC', {}).get('MACHINE', Path(source).stem)}, LinuxCNC"
    linear = _unit(traj.get("LINEAR_UNITS", ""), LINEAR, "mm", source, page)
    angular = _unit(traj.get("ANGULAR_UNITS", "degree"), ANGULAR, "deg", source, page)
    module, *arguments = (ini.get("KINS", {}).get("KINEMATICS") or TRIVIAL).split()
    letters, joints = axes_of(ini, arguments, source)
    trivial = module == TRIVIAL
    jerks = number(traj.get("PLANNER_TYPE", "0"), source, "[TRAJ]PLANNER_TYPE")[1] == 1.0
    _control(ini, linear, jerks, source, page)
    _kinematics(module, letters, page)
    for axis in letters:
        unit = angular if axis in TURNS else linear
        own = [(f"AXIS_{axis.upper()}", ini.get(f"AXIS_{axis.upper()}", {}))]
        if trivial:
            own += [(name, ini.get(name, {})) for k in joints[axis] for name in (f"JOINT_{k}", f"AXIS_{k}")]
        _limits(axis, unit, own, jerks, source, page)
    return page


def sections(text: str, source: str) -> Sections:
    """Return sections of an INI file.

    Parameters
    ----------
    text : str
        Of the file.
    source : str
        The file; those that `#INCLUDE` names are read in its place.

    Returns
    -------
    Sections
        Values by key and section, the first of equal keys.

    Raises
    ------
    FormatError
        For what is no INI file, and a file that cannot be included.
    """
    found: Sections = {}
    section = ""
    for line in _lines(text, source, IncludedFiles()):
        if line[:1] in ("", "#", ";"):
            continue
        if match := re.match(r"\[([^\]]*+)\]", line):
            section = match[1].strip().upper()
            found.setdefault(section, {})
        elif "=" in line and section:
            key, _, value = line.partition("=")
            found[section].setdefault(key.strip().upper(), value.strip())
    return found


def _lines(text: str, source: str, included: IncludedFiles, depth: int = 0) -> list[str]:
    """The lines of a file, those that end in a backslash joined, with those of included files in their place."""
    out: list[str] = []
    for line in re.sub(r"\\\r?\n", " ", text).splitlines():
        line = line.strip()
        if match := re.match(r"#INCLUDE\s+(\S.*)", line):
            for more, file in included.read(match[1].strip().strip('"'), source, depth):
                out += _lines(more, file, included, depth + 1)
        else:
            out.append(line)
    return out


def _unit(text: str, known: dict[str, tuple[str, float]], base: str, source: str, page: Page) -> tuple[str, float]:
    """The unit of lengths or angles, and how many of it one of the file's units is."""
    name = (text.split() or [""])[0].lower()
    if name in known:
        return known[name]
    which = "LINEAR_UNITS" if base == "mm" else "ANGULAR_UNITS"
    if not name:
        page.assume(f"[TRAJ]{which} is missing; {base}")
        return base, 1.0
    _, per = positive(name, source, f"[TRAJ]{which}")  # units of the file in 1 mm, or in 1 deg
    if base == "mm" and abs(per * 25.4 - 1.0) < 1e-3:
        return "in", 1.0
    return base, 1.0 / per


def axes_of(ini: Sections, arguments: list[str], source: str) -> tuple[list[str], dict[str, list[int]]]:
    """Return the axes of a machine and their joints.

    Parameters
    ----------
    ini : Sections
        Of the INI file.
    arguments : list of str
        Of the module of kinematics.
    source : str
        The file, for messages.

    Returns
    -------
    letters : list of str
        Of the axes, in order.
    joints : dict of str to list of int
        Joints of each axis, those of a gantry two.

    Raises
    ------
    FormatError
        Where the file names no axes.
    """
    said = next((each.partition("=")[2] for each in arguments if each.lower().startswith("coordinates=")), "")
    order = re.sub(r"[\s,]", "", said or ini["TRAJ"].get("COORDINATES", "")).lower()
    if not order:
        count = int(number(ini["TRAJ"].get("AXES", "0"), source, "[TRAJ]AXES")[1])
        order = AXES[:count]
    if not order or set(order) - set(AXES):
        raise FormatError(f"{source}: [TRAJ]COORDINATES: {order.upper() or 'missing'}; give the axes, such as X Y Z")
    joints: dict[str, list[int]] = {}
    for joint, axis in enumerate(order):
        joints.setdefault(axis, []).append(joint)
    old = "AXIS_0" in ini  # there each number is that of the letter, and a missing one has no section
    if old:
        joints = {axis: [AXES.index(axis)] for axis in joints}
    return [axis for axis in AXES if axis in joints], joints


def _limits(
    axis: str, unit: tuple[str, float], own: list[tuple[str, dict[str, str]]], jerks: bool, source: str, page: Page
) -> None:
    """The section of an axis: the tightest of what its sections of the INI file say."""
    section = f"axis.{axis}.limits"
    found = {}
    for key, pick, read in _OF_AXIS:
        said = [(*read(each[key], source, f"[{name}]{key}"), f"[{name}]{key}") for name, each in own if key in each]
        if key in ("MIN_LIMIT", "MAX_LIMIT"):
            said = [each for each in said if abs(each[1]) < 1e9]  # LinuxCNC's own word for no limit is 1e99
        if said:
            found[key] = pick(said, key=lambda each: each[1])

    def written(key: str, name: str, ending: str = "") -> None:
        text, value, place = found[key]
        page.set(section, name, (text if unit[1] == 1.0 else short(value * unit[1])) + unit[0] + ending, place)

    for key, name, ending in (("MAX_VELOCITY", "velocity", "/s"), ("MAX_ACCELERATION", "acceleration", "/s^2")):
        if key not in found:
            places = " or ".join(f"[{name}]" for name, _ in own[:2])
            raise FormatError(f"{source}: {key} of axis {axis.upper()}: missing; add it to {places}")
        written(key, name, ending)
    if "MAX_JERK" in found:
        if jerks and found["MAX_JERK"][1] > 0.0:
            written("MAX_JERK", "jerk", "/s^3")
        else:
            page.comment(section, "MAX_JERK is not used: [TRAJ]PLANNER_TYPE is not 1")
    if {"MIN_LIMIT", "MAX_LIMIT"} <= found.keys():
        if not found["MIN_LIMIT"][1] < found["MAX_LIMIT"][1]:
            raise FormatError(f"{source}: {found['MIN_LIMIT'][2]} is not below {found['MAX_LIMIT'][2]}")
        written("MIN_LIMIT", "minimum")
        written("MAX_LIMIT", "maximum")
        page.assume(
            "travel is in machine coordinates; programs run in them unless --offsets says where G54 lies, such as "
            "--offsets G54=10,20,-5"
        )


def _control(ini: Sections, linear: tuple[str, float], jerks: bool, source: str, page: Page) -> None:
    """The section of the control, and what the INI file says that has no place in a machine file."""
    traj = ini["TRAJ"]
    if not jerks:
        page.assume(
            "no limit of jerk, as LinuxCNC has none here: acceleration changes in steps; write jerk into "
            "[axis.x.limits] and its like, usually 20 to 50 times the acceleration, per second"
        )
        page.set("control", "model", "linuxcnc", "trapezoids, and corners blended by arcs")
    unit, size = linear
    for key, name, ending in (
        ("MAX_LINEAR_VELOCITY", "velocity", "/s"),
        ("MAX_LINEAR_ACCELERATION", "acceleration", "/s^2"),
        *((("MAX_LINEAR_JERK", "jerk", "/s^3"),) if jerks else ()),
    ):
        old = key.replace("LINEAR_", "")  # before 2.8
        found = next((each for each in (key, old) if each in traj), None)
        if found is not None:
            text, value = positive(traj[found], source, f"[TRAJ]{found}")
            page.set("control", name, (text if size == 1.0 else short(value * size)) + unit + ending, f"[TRAJ]{found}")
    startup = next((ini[each]["RS274NGC_STARTUP_CODE"] for each in ("RS274NGC", "EMC")
                    if "RS274NGC_STARTUP_CODE" in ini.get(each, {})), "")  # fmt: skip
    _blending(startup.upper(), unit, size, source, page)
    no_times(page)
    if "SERVO_PERIOD" in ini.get("EMCMOT", {}):
        period = positive(ini["EMCMOT"]["SERVO_PERIOD"], source, "[EMCMOT]SERVO_PERIOD")[1]
        page.tell(f"Servo period: --period {short(period * 1e-6)}ms.")
    if table := ini.get("EMCIO", {}).get("TOOL_TABLE"):
        page.tell(f"Tool table: --tools {table}.")
    if place := ini.get("EMCIO", {}).get("TOOL_CHANGE_POSITION"):
        page.tell(f"Tools are changed at {place} ({unit}, machine coordinates); [control.change_place] is for that.")


def _blending(startup: str, unit: str, size: float, source: str, page: Page) -> None:
    """How corners are passed where a program does not say: G61, G61.1 or G64 of the startup code."""
    words = re.findall(r"G61\.1|G61|G64|P\s*[-+.\d]+|G2[01](?!\d)", startup)
    mode = next((each for each in words if each[:2] == "G6"), "")
    if mode == "G61.1":
        page.set("control", "mode", "exact stop", "G61.1 of RS274NGC_STARTUP_CODE")
        return
    if mode == "G61":
        page.comment("control", "G61 of RS274NGC_STARTUP_CODE: exact path, corners are stops")
        return
    inch = unit if not ({"G20", "G21"} & {*words}) else ("in" if "G20" in words else "mm")
    given = next((each for each in words if each[0] == "P"), None) if mode == "G64" else None
    if given is not None:
        text, value = number(given[1:], source, "RS274NGC_STARTUP_CODE: P of G64")
        text = text if inch != unit or size == 1.0 else short(value * size)
        page.set("control", "tolerance", f"{text}{inch}", "G64 P of RS274NGC_STARTUP_CODE; a program's own G64 P holds")
        return
    page.set(
        "control",
        "tolerance",
        f"{WIDE:g}mm",
        "stands for no tolerance: G64 without P blends corners as far as blocks allow",
    )
    page.assume("programs start in G64 without P, LinuxCNC's own default; a program's G64 P or G61 holds from there on")


def _kinematics(module: str, letters: list[str], page: Page) -> None:
    """The section of kinematics where splinefeed knows the module and the machine has its axes."""
    if module == TRIVIAL:
        return
    kind = module.removesuffix("-kins")
    if kind in KINDS and {*KINDS[kind].joints.split()} <= {*letters}:
        page.comment("kinematics", f"[KINS]KINEMATICS = {module}: its lengths are HAL pins, which no INI file has")
        page.set("kinematics", "type", kind)
        for length in KINDS[kind].lengths.split():
            if length == "pivot-length":
                page.set("kinematics", length, "100mm", "assumed: set the pin's value")
                page.assume("pivot-length is 100 mm: write the value of the HAL pin into [kinematics]")
            else:
                page.comment("kinematics", f'{length} = "0mm"')
        page.assume("lengths of the kinematics that the INI file does not have are 0; see [kinematics]")
    else:
        page.assume(f"[KINS]KINEMATICS = {module} is not modelled: limits are those of [AXIS_L], not of the joints")
