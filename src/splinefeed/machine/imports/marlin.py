"""A machine from what Marlin answers to M503: feed rates, accelerations, jerk or junction deviation.

Words are those of Marlin's documentation: M203 mm/s, M201 mm/s^2, M204 P T (or S) mm/s^2, M205 X Y Z mm/s or J mm.
"""

from __future__ import annotations

import re
from pathlib import Path

from splinefeed.errors import FormatError
from splinefeed.machine.imports.page import Page, number, positive

_COMMAND = re.compile(r"(?<![A-Z0-9])(G2[01]|M20[1345])\b([^;]*)")
_WORD = re.compile(r"([A-Z])\s*([-+]?[\d.]+)")


def read(text: str, source: str) -> Page:
    """Make the page of a machine file from the text that holds the answer; FormatError for what is missing or wrong."""
    said: dict[str, dict[str, str]] = {}
    for line in text.splitlines():
        if match := _COMMAND.search(re.sub(r"^.*?(?:echo|Config):\s*;.*", "", line)):
            words = dict(_WORD.findall(match[2]))
            if "T" in words and len(words) == 2 and match[1] in ("M201", "M203", "M205"):
                continue  # of one extruder
            said.setdefault(match[1], {}).update(words)
    for code, what in (("M203", "greatest feed rates"), ("M201", "greatest accelerations")):
        if code not in said:
            raise FormatError(f"{source}: no {code}, the {what}; send M503 to Marlin and save its answer")
    page = Page(source, "Marlin")
    page.title = f"{Path(source).stem}, Marlin"
    unit = "in" if "G20" in said and "G21" not in said else "mm"
    _control(said.get("M204", {}), said.get("M205", {}), unit, source, page)
    for axis in "xyz":
        letter, section = axis.upper(), f"axis.{axis}.limits"
        for code, key, ending in (("M203", "velocity", "/s"), ("M201", "acceleration", "/s^2")):
            if letter not in said[code]:
                raise FormatError(f"{source}: {code} {letter}: missing")
            written, _ = positive(said[code][letter], source, f"{code} {letter}")
            page.set(section, key, f"{written}{unit}{ending}", f"{code} {letter}")
    page.assume("the travel is not limited: M503 does not say it")
    page.assume("the extruder limits nothing; times are of the moves alone, without heating")
    return page


def _control(accelerations: dict[str, str], corners: dict[str, str], unit: str, source: str, page: Page) -> None:
    """The section of the control: accelerations along the path, and how corners are passed."""
    page.set("control", "model", "marlin")
    page.set("control", "look_ahead", 15, "assumed: of Marlin's usual buffer of 16 blocks")
    page.set("control", "arc_segment", "1mm", "assumed: Marlin's usual length of the chords of arcs")
    page.assume("the buffer has 16 blocks and arcs are cut as chords of 1 mm, as in Marlin's usual configuration")
    printing = next((key for key in "PS" if key in accelerations), None)
    travel = next((key for key in "VT" if key in accelerations and (key == "V" or printing == "P")), None)
    for letter, key in ((printing, "acceleration"), (travel, "rapid_acceleration")):
        if letter is not None and number(accelerations[letter], source, f"M204 {letter}")[1] > 0.0:
            page.set("control", key, f"{number(accelerations[letter], source, '')[0]}{unit}/s^2", f"M204 {letter}")
    if "J" in corners:
        written, _ = positive(corners["J"], source, "M205 J", or_zero=True)
        page.set("control", "junction_deviation", f"{written}{unit}", "M205 J")
    elif "X" in corners:
        for axis in "XYZ":
            key = axis if axis in corners else "X"  # older ones have one jerk of X and Y
            written = positive(corners[key], source, f"M205 {key}")[0]
            page.set(f"control.axis.{axis.lower()}", "velocity_step", f"{written}{unit}/s", f"M205 {key}, jerk")
    else:
        page.assume("M205 says neither J nor X: corners are exact stops")
