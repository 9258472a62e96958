"""A machine from Klipper's printer.cfg: velocities, accelerations, travel, square corner velocity.

Keys and defaults are those of Klipper's documentation, "Configuration reference", [printer] and [stepper_x].
"""

from __future__ import annotations

import re
from pathlib import Path

from splinefeed.errors import FormatError
from splinefeed.machine.imports.included import IncludedFiles
from splinefeed.machine.imports.page import Page, Plain, number, positive, short

#: What holds where a section does not say: square corner velocity mm/s, minimum cruise ratio, resolution of arcs mm.
_CORNER, _CRUISE, _ARC = 5.0, 0.5, 1.0

Sections = dict[str, dict[str, str]]


def read(text: str, source: str) -> Page:
    """Make the page of a machine file from the text of printer.cfg; FormatError for what is missing or wrong."""
    cfg = _sections(text, source, IncludedFiles())
    printer = cfg.get("printer")
    if printer is None:
        raise FormatError(f"{source}: no section [printer]; is it Klipper's printer.cfg?")
    page = Page(source, "Klipper")
    kind = printer.get("kinematics", "")
    page.title = f"{Path(source).stem}, Klipper, {kind or 'kinematics not given'}"
    if kind == "none":
        raise FormatError(f"{source}: [printer] kinematics: none; it has no axes")

    def limit(key: str, otherwise: str = "") -> tuple[str, float, str]:
        name = key if key in printer else otherwise
        if name not in printer:
            raise FormatError(f"{source}: [printer] {key}: missing")
        return (*positive(printer[name], source, f"[printer] {name}"), f"[printer] {name}")

    velocity, acceleration = limit("max_velocity"), limit("max_accel")
    page.set("control", "model", "klipper")
    page.set("control", "velocity", f"{velocity[0]}mm/s", velocity[2])
    page.set("control", "acceleration", f"{acceleration[0]}mm/s^2", acceleration[2])
    _corners(printer, acceleration[1], source, page)
    if (arcs := cfg.get("gcode_arcs")) is not None:
        chord = positive(arcs.get("resolution", short(_ARC)), source, "[gcode_arcs] resolution")[0]
        page.set("control", "arc_segment", f"{chord}mm", "[gcode_arcs] resolution")
    for axis in "xyz":
        top, fast = velocity, acceleration
        if axis == "z" and "delta" not in kind:
            top, fast = limit("max_z_velocity", "max_velocity"), limit("max_z_accel", "max_accel")
        section = f"axis.{axis}.limits"
        page.set(section, "velocity", f"{top[0]}mm/s", top[2])
        page.set(section, "acceleration", f"{fast[0]}mm/s^2", fast[2])
        _travel(axis, cfg.get(f"stepper_{axis}"), source, page)
    page.tell(f"[printer] kinematics: {kind}; the limits are those of the tool head.")
    page.assume("the extruder limits nothing; times are of the moves alone, without heating")
    return page


def _corners(printer: dict[str, str], acceleration: float, source: str, page: Page) -> None:
    """How corners are passed, and how short moves are kept from racing up and down."""
    text = printer.get("square_corner_velocity", short(_CORNER))
    written, _ = positive(text, source, "[printer] square_corner_velocity", or_zero=True)
    if "square_corner_velocity" not in printer:
        page.assume(f"square_corner_velocity is {written} mm/s, Klipper's default")
    page.set("control", "corner_velocity", f"{written}mm/s", "[printer] square_corner_velocity")
    if "minimum_cruise_ratio" in printer:
        text, ratio = number(printer["minimum_cruise_ratio"], source, "[printer] minimum_cruise_ratio")
        words = "[printer] minimum_cruise_ratio"
    elif "max_accel_to_decel" in printer:
        decel = positive(printer["max_accel_to_decel"], source, "[printer] max_accel_to_decel")[1]
        ratio = max(1.0 - decel / acceleration, 0.0)
        text, words = short(ratio), "1 - max_accel_to_decel / max_accel of [printer]"
    else:
        text, ratio, words = short(_CRUISE), _CRUISE, "Klipper's default"
    if not 0.0 <= ratio < 1.0:
        raise FormatError(f"{source}: [printer] minimum_cruise_ratio: {text}; must be from 0 to below 1")
    page.set("control", "cruise_ratio", Plain(text), words)


def _travel(axis: str, stepper: dict[str, str] | None, source: str, page: Page) -> None:
    """The travel of an axis, where its stepper says both ends."""
    if stepper is None or "position_max" not in stepper:
        return
    section, place = f"axis.{axis}.limits", f"[stepper_{axis}]"
    low = number(stepper.get("position_min", "0"), source, f"{place} position_min")
    high = number(stepper["position_max"], source, f"{place} position_max")
    if not low[1] < high[1]:
        raise FormatError(f"{source}: {place} position_min is not below position_max")
    words = f"{place} position_min" if "position_min" in stepper else "Klipper's default"
    page.set(section, "minimum", f"{low[0]}mm", words)
    page.set(section, "maximum", f"{high[0]}mm", f"{place} position_max")


def _sections(text: str, source: str, included: IncludedFiles, depth: int = 0) -> Sections:
    """Sections of a configuration, the last of equal keys; files of [include] are read in their place."""
    found: Sections = {}
    section = ""
    for line in text.splitlines():
        line = re.sub(r"(?<!\s)(?:\s*+#|\s++;).*|^;.*", "", line)
        if not line.strip() or line[0].isspace():  # the latter goes on with the value of the line before
            continue
        if match := re.match(r"\[([^\]]*+)\]", line):
            section = " ".join(match[1].split()).lower()
            if section.startswith("include "):
                for more, file in included.read(match[1].split(None, 1)[1].strip(), source, depth):
                    for name, values in _sections(more, file, included, depth + 1).items():
                        found.setdefault(name, {}).update(values)
            else:
                found.setdefault(section, {})
        elif (match := re.match(r"([^:=]+)[:=]\s*(.*)", line)) and section in found:
            found[section][match[1].strip().lower()] = match[2].strip()
    return found
