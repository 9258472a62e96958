"""`splinefeed linuxcnc`: the HAL file of a machine that follows a stream, and how to start it."""

from __future__ import annotations

import click

from splinefeed.cli import options
from splinefeed.cli.output import print_json, print_text
from splinefeed.errors import InputError

EXAMPLES = """\b
Examples:
  splinefeed linuxcnc init --machine router
  splinefeed linuxcnc init --machine my-table.toml -o mill --axes x,y,z
  splinefeed linuxcnc init --machine xytheta --json

"""

INI = """\
; A fragment for an INI file of your own; HAL reads it with halcmd -i {name}.ini -f {name}.hal
[EMCMOT]
SERVO_PERIOD = {nanoseconds}
{joints}"""


@click.group(epilog=EXAMPLES)
def command() -> None:
    """Prepare LinuxCNC's HAL for streams."""


@command.command("init", short_help="Write the .hal file and INI fragment of a machine.", epilog=EXAMPLES)
@options.machine
@click.option("--axes", metavar="X,Y,...", help="Which of its axes, in order.  [default: all]")
@options.quantity("--period", kind="time", text="Servo period.  [default: 1 ms]")
@options.quantity("--following", kind="length", text="Following error that stops the stream.  [default: 1 mm or deg]")
@click.option(
    "--motion", is_flag=True, help="Together with LinuxCNC's motion controller, which then shows the tool tip."
)
@click.option("-o", "--output", metavar="NAME", default="splinefeed", show_default=True, help="NAME.hal, NAME.ini")
@options.as_json
def init(
    machine: str | None,
    axes: str | None,
    period: float | None,
    following: float | None,
    motion: bool,
    output: str,
    as_json: bool,
) -> None:
    """Write a HAL file with streamer, one controller an axis, and simulated drives to replace with your own."""
    import math

    from splinefeed.formats.atomic import atomic_write
    from splinefeed.live.hal_files import GAIN, VELOCITY, HalAxis, hal_text
    from splinefeed.machine.machine import Machine
    from splinefeed.records import ROTARY_AXES

    if machine is None:
        raise InputError("--machine is missing: name a machine or its file; see splinefeed machine list")
    model = Machine.load(machine)
    names = [name.strip() for name in axes.split(",")] if axes else list(model.axes)
    for name in names:
        if name not in model.axes:
            raise InputError(f"--axes: {model.name} has no axis {name!r}; it has {', '.join(model.axes)}")
    tick = 1e-3 if period is None else period
    made = []
    for name in names:
        unit = 180.0 / math.pi if name in ROTARY_AXES else 1.0
        limit = model.axes[name].limits.velocity
        gain = model.axes[name].controller.position_gain or GAIN
        made.append(HalAxis(name, gain, VELOCITY if limit is None else unit * limit, following or 1.0))
    joints = "".join(
        f"\n[JOINT_{k}]  ; {axis.name}\nP = {axis.gain:.17g}\nFF1 = 1\nMAX_VELOCITY = {axis.velocity:.17g}\n"
        f"FERROR = {axis.following:.17g}\n"
        for k, axis in enumerate(made)
    )
    texts = {
        f"{output}.hal": hal_text(tuple(made), tick, motion=motion),
        f"{output}.ini": INI.format(name=output, nanoseconds=round(tick * 1e9), joints=joints),
    }
    for file, text in texts.items():
        with atomic_write(file) as temporary:
            temporary.write_text(text, encoding="ascii")
    start = ["/usr/lib/linuxcnc/realtime start", f"halcmd -i {output}.ini -f {output}.hal", "halcmd start"]
    if motion:
        start = [f"linuxcnc YOUR.ini, with HALFILE = {output}.hal in its [HAL]", "home all joints, machine off"]
    play = f"splinefeed stream SOURCE --machine {machine} --to linuxcnc"
    stop = ["halcmd stop", "halcmd unload all", "/usr/lib/linuxcnc/realtime stop"] if not motion else ["quit LinuxCNC"]
    if as_json:
        print_json({"files": list(texts), "axes": names, "start": start, "stream": play, "stop": stop})
        return
    print_text(f"wrote {' and '.join(texts)}: the drives of {', '.join(names)} are simulated in it, see the comments")
    for title, lines in (("start", start), ("stream", [play]), ("end", stop)):
        print_text()
        print_text(f"{title}:")
        for line in lines:
            print_text(f"  {line}")
