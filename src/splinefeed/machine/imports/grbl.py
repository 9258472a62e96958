"""A machine from what grbl answers to $$: rates, accelerations, travel, junction deviation.

Settings are numbered as in grbl 0.9 and 1.1, and grblHAL: $110.. mm/min, $120.. mm/s^2, $130.. mm; $11 and $12 mm, in
mm whatever $13 reports. Source: github.com/gnea/grbl/wiki/Grbl-v1.1-Configuration.
"""

from __future__ import annotations

import re
from pathlib import Path

from splinefeed.errors import FormatError
from splinefeed.machine.imports.page import AXES, TURNS, Page, no_times, number, positive

_SETTING = re.compile(r"\$(\d{1,3})\s*=\s*([^\s(;,|]+)")
#: Blocks that the look-ahead sees.
_BLOCKS = 15
#: Most axes that settings have places for.
_MOST = 6


def read(text: str, source: str) -> Page:
    """Make the page of a machine file from the text of settings; FormatError for what is missing or wrong."""
    settings: dict[int, str] = {}
    for line in text.splitlines():
        for key, value in _SETTING.findall(line):
            settings[int(key)] = value
    if 110 not in settings:
        raise FormatError(f"{source}: no $110; send $$ to grbl (0.9 or later) and save its answer")
    page = Page(source, "grbl")
    page.title = f"{Path(source).stem}, grbl"
    _control(settings, source, page)
    for k, axis in enumerate(AXES[:_MOST]):
        rate, acceleration = settings.get(110 + k), settings.get(120 + k)
        if rate is None:
            break
        if acceleration is None:
            raise FormatError(f"{source}: ${120 + k}, the acceleration of axis {axis.upper()}: missing")
        values = [number(each, source, f"${key}")[1] for each, key in ((rate, 110 + k), (acceleration, 120 + k))]
        if values == [0.0, 0.0]:
            page.assume(f"axis {axis.upper()} is not used: ${110 + k} and ${120 + k} are 0")
            continue
        section, unit = f"axis.{axis}.limits", "deg" if axis in TURNS else "mm"
        for key, name, ending in ((110 + k, "velocity", "/min"), (120 + k, "acceleration", "/s^2")):
            page.set(section, name, f"{positive(settings[key], source, f'${key}')[0]}{unit}{ending}", f"${key}")
        if (key := 130 + k) in settings:
            travel, length = number(settings[key], source, f"${key}")
            if length > 0.0:
                page.comment(section, f"${key}: {travel} {unit} of travel; where a program lies in it, G54 says: give")
                page.comment(section, "minimum and maximum in the coordinates of your programs")
    return page


def _control(settings: dict[int, str], source: str, page: Page) -> None:
    """The section of the control: grbl's own rules, junction deviation and how arcs are cut."""
    page.set("control", "model", "grbl")
    page.set("control", "look_ahead", _BLOCKS, "of grbl's buffer of 16, the one that runs left out")
    if 11 in settings:
        page.set("control", "junction_deviation", f"{positive(settings[11], source, '$11', or_zero=True)[0]}mm", "$11")
    no_times(page)
    if settings.get(20) == "0":
        page.tell("Soft limits are off ($20=0).")
    if 12 in settings:
        page.set("control", "arc_tolerance", f"{positive(settings[12], source, '$12')[0]}mm", "$12")
