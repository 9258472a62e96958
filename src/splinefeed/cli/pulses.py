"""`splinefeed pulses`: setpoints as the pulse words of a motion card, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from splinefeed import units
from splinefeed.cli import options
from splinefeed.cli.answers import Page, answers
from splinefeed.cli.output import number, print_table, print_text
from splinefeed.cli.progress import Say
from splinefeed.cli.setpoints_file import read_setpoints_chunks
from splinefeed.cli.summary import print_notes
from splinefeed.errors import FormatError, InputError

if TYPE_CHECKING:
    from splinefeed.formats.bit_pattern import BitPattern

EXAMPLES = """\b
Examples:
  splinefeed pulses splinefeed-butterfly/setpoints.h5 --machine xytheta
  splinefeed pulses wing.h5 --pulses x=1000,y=1000 --clock 256kHz -o wing.bits
  splinefeed pulses wing.bits --decode -o wing-positions.csv

"""

#: Setpoints that are worked on at once.
_ROWS = 65_536


class Scales(click.ParamType):  # type: ignore[type-arg]
    """Pulses per mm, or per degree of a rotary axis, `x=1000,theta=100`."""

    name = "axis=number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Pulses by axis."""
        found = {}
        for each in value.split(","):
            axis, _, text = each.partition("=")
            try:
                found[axis.strip()] = float(text)
            except ValueError:
                raise click.BadParameter(f"{each!r} cannot be read; write for example x=1000", ctx, param) from None
        return found


def _print(page: Mapping[str, Any]) -> None:
    print_text(
        f"{page['file']}: {page['periods']} periods of {units.format_quantity(page['period_s'], 'time')}, "
        f"{page['slots_per_period']} slots in each, a pulse clock of "
        f"{units.format_quantity(page['pulse_clock_hz'], 'frequency')}"
    )
    print_notes(page["notes"])
    for i, card in enumerate(page["cards"], start=1):
        if len(page["cards"]) > 1:
            print_text(f"card {i}    axes {', '.join(card)}")
    print_text()
    if "fastest" not in page:
        rows = [[a, f"{number(page['pulses_per_unit'][a], 8)} /{page['units'][a]}"] for a in page["axes"]]
        print_table(["axis", "pulses"], rows)
    else:
        rows = [
            [
                axis,
                f"{number(page['pulses_per_unit'][axis], 8)} /{page['units'][axis]}",
                str(page["pulses_plus"][axis]),
                str(page["pulses_minus"][axis]),
            ]
            for axis in page["axes"]
        ]
        print_table(["axis", "pulses", "sent plus", "sent minus"], rows)
        print_text()
        fastest = page["fastest"]
        if fastest["pulses"]:
            print_text(
                f"fastest: {fastest['pulses']} pulses of {fastest['axis']} after tick {fastest['tick']}, "
                f"{units.format_quantity(fastest['rate_hz'], 'frequency')}"
            )
        print_text(f"decoded again: at most {number(page['off_max_pulses'], 3)} pulses off a setpoint")


@click.command(epilog=EXAMPLES)
@click.argument("file", metavar="FILE")
@click.option("--machine", metavar="NAME|FILE", help="One pulse is a count of this machine's encoders.")
@click.option("--pulses", "scales", type=Scales(), metavar="AXIS=N", help="Pulses per mm, of rotary axes per degree.")
@click.option(
    "--clock",
    type=options.Quantity("frequency"),
    metavar="FREQUENCY",
    help="Slots a second; a period takes a multiple of 16.  [default: the lowest that is enough]",
)
@click.option("--columns", type=options.Names(), metavar="NAMES", help="CSV without names: its columns, as t,x,y.")
@click.option("--period", type=options.Quantity("time"), metavar="TIME", help="CSV: the period.  [default: from t]")
@click.option("--decode", is_flag=True, help="FILE holds pulse words; decode them into positions.")
@click.option("-o", "--output", metavar="FILE", help="Words: .h5 or .bits (with .bits.json); positions: .csv.")
@answers(_print)
def command(say: Say, file: str, **given: Any) -> Page:
    """Turn setpoints into the 16-bit words of a motion card's bit-pattern mode, one pulse a bit, and back.

    FILE holds setpoints (.h5, .csv, ... of splinefeed, or a CSV of another program), or with --decode pulse words. No
    pulse is lost or added: after every period each axis is within half a pulse of its setpoint, and the words are
    decoded again before they are written. Too many pulses in a period are an error that names tick and axis.
    """
    return _decoded(file, given, say) if given["decode"] else _encoded(file, given, say)


def _encoded(file: str, given: Mapping[str, Any], say: Say) -> dict[str, Any]:
    from splinefeed.machine.machine import Machine
    from splinefeed.pipeline import pulses

    if (given["machine"] is None) == (given["scales"] is None):
        raise InputError("the size of a pulse is missing; give either --machine NAME or --pulses x=1000,y=1000")
    say(f"reading {file}")
    chunks, notes = read_setpoints_chunks(file, given, _ROWS)
    scales, rotary = given["scales"], "deg"
    if given["machine"] is not None:
        first = next(chunks, None)
        axes = () if first is None else first.axes
        scales, rotary = pulses.pulses_of(Machine.load(given["machine"]), axes), "rad"
        chunks, _ = read_setpoints_chunks(file, given, _ROWS)
    found = pulses.survey(chunks, scales, rotary=rotary)
    slots = found.slots if given["clock"] is None else _slots(given["clock"], found.period)
    tally = pulses.Tally()
    say("making pulse words")
    again, _ = read_setpoints_chunks(file, given, _ROWS)
    patterns = pulses.encoded(again, scales, slots, tally, rotary=rotary)
    cards: tuple[tuple[str, ...], ...] = ()
    if given["output"] is None:
        for pattern in patterns:
            cards = pattern.cards
    else:
        _write(patterns, given["output"])
        cards = tuple(found.axes[i : i + 3] for i in range(0, len(found.axes), 3))
    files = [] if given["output"] is None else _files(given["output"])
    return {
        "ok": True,
        "file": file,
        "axes": list(found.axes),
        "cards": [list(card) for card in cards],
        "period_s": found.period,
        "periods": tally.periods,
        "pulses_per_unit": pulses.per_degree(scales) if rotary == "rad" else dict(scales),
        "units": {axis: _unit(axis) for axis in found.axes},
        "slots_per_period": slots,
        "pulse_clock_hz": slots / found.period,
        "fastest": {"axis": found.axis, "pulses": found.fastest, "rate_hz": found.rate, "tick": found.at},
        "pulses_plus": tally.plus,
        "pulses_minus": tally.minus,
        "off_max_pulses": tally.off,
        "notes": notes,
        "files": files,
    }


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


def _write(patterns: Any, file: str) -> None:
    from splinefeed.formats import bit_pattern, bit_pattern_raw

    (bit_pattern_raw if file.lower().endswith(".bits") else bit_pattern).write(patterns, file)


def _files(file: str) -> list[str]:
    return [file, f"{file}.json"] if file.lower().endswith(".bits") else [file]


def _unit(axis: str) -> str:
    from splinefeed.records import ROTARY_AXES

    return "deg" if axis in ROTARY_AXES else "mm"


def _decoded(file: str, given: Mapping[str, Any], say: Say) -> dict[str, Any]:
    from splinefeed.formats import bit_pattern, bit_pattern_raw
    from splinefeed.pipeline import pulses

    for name in ("machine", "scales", "clock", "columns", "period"):
        if given[name] is not None:
            raise InputError(
                f"--{'pulses' if name == 'scales' else name}: a file of pulse words has its own; leave it out"
            )
    say(f"reading {file}")
    pattern = (bit_pattern_raw if file.lower().endswith(".bits") else bit_pattern).read(file)
    if given["output"] is not None:
        _write_positions(pattern, given["output"])
    scales = dict(zip(pattern.axes, pattern.pulses_per_unit.tolist(), strict=True))
    return {
        "ok": True,
        "file": file,
        "axes": list(pattern.axes),
        "cards": [list(card) for card in pattern.cards],
        "period_s": pattern.period,
        "periods": len(pattern),
        "pulses_per_unit": pulses.per_degree(scales),
        "units": {axis: _unit(axis) for axis in pattern.axes},
        "slots_per_period": pattern.slots_per_period,
        "pulse_clock_hz": pattern.pulse_clock,
        "notes": [],
        "files": [] if given["output"] is None else [given["output"]],
    }


def _write_positions(pattern: BitPattern, file: str) -> None:
    """Time and positions as a plain CSV: s, mm, rotary axes degrees."""
    import math

    from splinefeed.formats.atomic import atomic_write
    from splinefeed.formats.bit_pattern import decode
    from splinefeed.records import ROTARY_AXES

    if not file.lower().endswith(".csv"):
        raise FormatError(f"{file}: positions are written as .csv")
    factors = [180.0 / math.pi if axis in ROTARY_AXES else 1.0 for axis in pattern.axes]
    with atomic_write(file) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as stream:
        names = [f"{axis} [{_unit(axis)}]" for axis in pattern.axes]
        stream.write(",".join(["t [s]", *names]) + "\n")
        for k, row in enumerate(decode(pattern).tolist()):
            time = (pattern.first + k) * pattern.period
            values = (repr(value * factor) for value, factor in zip(row, factors, strict=True))
            stream.write(",".join([f"{time:.9g}", *values]) + "\n")
