"""`splinefeed pulses`: setpoints as the pulse words of a motion card, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import splinefeed as sf
from splinefeed import units
from splinefeed.cli import options
from splinefeed.cli.answers import answers
from splinefeed.cli.output import Block, Page, Say, notes, number, table
from splinefeed.cli.setpoints_file import read_setpoints
from splinefeed.errors import FormatError, InputError


def _show(page: Page) -> list[Block]:
    period = units.format_quantity(page["period_s"], "time")
    clock = units.format_quantity(page["pulse_clock_hz"], "frequency")
    slots = f"{page['slots_per_period']} slots in each, a pulse clock of {clock}"
    cards = [f"card {i}    axes {', '.join(card)}" for i, card in enumerate(page["cards"], start=1)]
    sent = [key for key in ("pulses_plus", "pulses_minus") if key in page]
    rows = [
        [a, f"{number(page['pulses_per_unit'][a], 8)} /{page['units'][a]}", *(str(page[key][a]) for key in sent)]
        for a in page["axes"]
    ]
    ends = []
    if sent and (fastest := page["fastest"])["pulses"]:
        rate = units.format_quantity(fastest["rate_hz"], "frequency")
        ends = [f"fastest: {fastest['pulses']} pulses of {fastest['axis']} after tick {fastest['tick']}, {rate}"]
    if sent:
        ends.append(f"decoded again: at most {number(page['off_max_pulses'], 3)} pulses off a setpoint")
    return [
        [
            f"{page['file']}: {page['periods']} periods of {period}, {slots}",
            *notes(page["notes"]),
            *(cards if len(cards) > 1 else []),
        ],
        table(["axis", "pulses", "sent plus", "sent minus"][: 2 + len(sent)], rows),
        ends,
    ]


@answers(_show, "")
@options.table("""
file              FILE
--machine         NAME|FILE  One pulse is a count of this machine's encoders.
--pulses scales   AXIS=N     Pulses per mm, of rotary axes per degree: x=1000.
--clock           FREQUENCY  Slots a second; a period takes a multiple of 16.  [default: the lowest that is enough]
--decode          -          FILE holds pulse words; decode them into positions.
-o --output       FILE       Words: .bits (with .bits.json); positions: .csv.
""")
@options.setpoints_csv
def pulses(say: Say, file: str, **given: Any) -> Page:
    """Turn setpoints into the 16-bit words of a motion card's bit-pattern mode, one pulse a bit, and back.

    FILE holds setpoints (.h5, .csv, ... of splinefeed, or a CSV of another program), or with --decode pulse words. No
    pulse is lost or added: after every period each axis is within half a pulse of its setpoint, and the words are
    decoded again before they are written. Too many pulses in a period are an error that names tick and axis.

    Examples:
      splinefeed pulses splinefeed-butterfly/setpoints.h5 --machine xytheta
      splinefeed pulses wing.h5 --pulses x=1000,y=1000 --clock 256kHz -o wing.bits
      splinefeed pulses wing.bits --decode -o wing-positions.csv
    """
    from splinefeed.files.metadata import axis_units
    from splinefeed.runs.pulses import per_degree

    say(f"reading {file}")
    pattern, more = _decoded(file, given) if given["decode"] else _encoded(file, given, say)
    return {
        "ok": True,
        "file": file,
        "axes": list(pattern.axes),
        "cards": [list(card) for card in pattern.cards],
        "period_s": pattern.period,
        "periods": len(pattern),
        "pulses_per_unit": per_degree(dict(zip(pattern.axes, pattern.pulses_per_unit.tolist(), strict=True))),
        "units": dict(zip(pattern.axes, axis_units(pattern.axes, "deg"), strict=True)),
        "slots_per_period": pattern.slots_per_period,
        "pulse_clock_hz": pattern.pulse_clock,
        "notes": [],
        **more,
    }


def _encoded(file: str, given: Mapping[str, Any], say: Say) -> tuple[sf.formats.BitPattern, Page]:
    """The pulse words of setpoints, written if there is a name for them, and what the page says of that."""
    from splinefeed.formats import bit_pattern
    from splinefeed.runs.pulses import pulse_words, pulses_of

    if (given["machine"] is None) == (given["scales"] is None):
        raise InputError("the size of a pulse is missing; give either --machine NAME or --pulses x=1000,y=1000")
    points, guessed = read_setpoints(file, given)
    if given["machine"] is None:
        scales, rotary = _scales(given["scales"]), "deg"
    else:
        scales, rotary = pulses_of(sf.Machine.load(given["machine"]), points.axes), "rad"
    slots = None if given["clock"] is None else _slots(given["clock"], points.period)
    say("making pulse words")
    pattern, numbers = pulse_words(points, scales, slots, rotary=rotary)
    files = []
    if (output := given["output"]) is not None:
        bit_pattern.write(pattern, output)
        files = [output, str(bit_pattern.page_of(output))]
    return pattern, {"notes": guessed, "files": files, **numbers}


def _scales(text: str) -> dict[str, float]:
    """Pulses by axis of `x=1000,theta=100`."""
    from splinefeed.machine.limits_toml import by_axis

    try:
        return {axis: float(count) for axis, count in by_axis(text)}
    except ValueError:
        raise InputError(f"--pulses: {text!r} cannot be read; write for example x=1000,y=1000") from None


def _slots(clock: float, period: float) -> int:
    """Slots of a period at this clock; InputError where that is no multiple of 16, with the clocks beside it."""
    slots = clock * period
    words = round(slots / 16.0)
    if words >= 1 and abs(slots - 16.0 * words) <= 1e-9 * slots:
        return 16 * words
    lower = max(int(slots // 16.0), 1)
    near = " or ".join(units.format_quantity(16.0 * each / period, "frequency") for each in (lower, lower + 1))
    raise InputError(
        f"--clock: {slots:.6g} slots in a period of {period:g} s; it must be a multiple of 16: take {near}"
    )


def _decoded(file: str, given: Mapping[str, Any]) -> tuple[sf.formats.BitPattern, Page]:
    """Pulse words from a file; positions as a plain CSV, s, mm, rotary axes degrees, if there is a name for them."""
    import numpy as np

    from splinefeed.files import metadata
    from splinefeed.files.atomic import atomic_write
    from splinefeed.formats import bit_pattern

    for name in ("machine", "scales", "clock", "columns", "period"):
        if given[name] is not None:
            option = "pulses" if name == "scales" else name
            raise InputError(f"--{option}: a file of pulse words has its own; leave it out")
    pattern, output = bit_pattern.read(file), given["output"]
    if output is None:
        return pattern, {"files": []}
    if not output.lower().endswith(".csv"):
        raise FormatError(f"{output}: positions are written as .csv")
    position = metadata.to_degrees(bit_pattern.decode(pattern), pattern.axes)
    units_of = metadata.axis_units(pattern.axes, "deg")
    names = [f"{axis} [{unit}]" for axis, unit in zip(pattern.axes, units_of, strict=True)]
    time = pattern.period * np.arange(len(position), dtype=np.float64)
    with atomic_write(output) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write(",".join(["t [s]", *names]) + "\n")
        metadata.write_rows(stream, [time, *position.T], ",")
    return pattern, {"files": [output]}
