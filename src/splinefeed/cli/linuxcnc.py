"""`splinefeed linuxcnc`: the HAL file of a machine that follows a stream, and how to start it."""

from __future__ import annotations

from typing import Any

import splinefeed as sf
from splinefeed.cli import options
from splinefeed.cli.answers import answers, group
from splinefeed.cli.output import Block, Page, Say
from splinefeed.errors import InputError

INI = """\
; A fragment for an INI file of your own; HAL reads it with halcmd -i {name}.ini -f {name}.hal
[EMCMOT]
SERVO_PERIOD = {nanoseconds}
"""
JOINT = """
[JOINT_{k}]  ; {axis.name}
P = {axis.gain:.17g}
FF1 = 1
MAX_VELOCITY = {axis.velocity:.17g}
FERROR = {axis.following:.17g}
"""


@group
def linuxcnc() -> None:
    """Prepare LinuxCNC's HAL for streams.

    Examples:
      splinefeed linuxcnc init --machine router
      splinefeed linuxcnc init --machine my-table.toml -o mill --axes x,y,z
      splinefeed linuxcnc init --machine xytheta --json
    """


def _show(page: Page) -> list[Block]:
    steps = (("start", page["start"]), ("stream", [page["stream"]]), ("end", page["stop"]))
    return [
        [f"the drives of {', '.join(page['axes'])} are simulated, see the comments in the file"],
        *([f"{title}:", *(f"  {line}" for line in lines)] for title, lines in steps),
    ]


@answers(_show)
@options.table("""
--machine       NAME|FILE!       The machine; see splinefeed machine list.
--axes          NAMES            Which of its axes, in order.  [default: all]
--period        TIME =1 ms       Servo period.
--following     LENGTH           Following error that stops the stream.  [default: 1 mm or deg]
--motion        -                Together with LinuxCNC's motion controller, which then shows the tool tip.
-o --output     NAME =splinefeed  NAME.hal, NAME.ini
""")
def init(say: Say, machine: str, output: str, motion: bool, **given: Any) -> Page:
    """Write a HAL file with streamer, one controller an axis, and simulated drives to replace with your own.

    Examples:
      splinefeed linuxcnc init --machine router
      splinefeed linuxcnc init --machine my-table.toml -o mill --axes x,y,z
    """
    import math

    from splinefeed.formats.atomic import write_text
    from splinefeed.live.hal_files import GAIN, VELOCITY, HalAxis, hal_text
    from splinefeed.records import ROTARY_AXES

    model = sf.Machine.load(machine)
    names = given["axes"] or tuple(model.axes)
    made = []
    for name in names:
        if name not in model.axes:
            raise InputError(f"--axes: {model.name} has no axis {name!r}; it has {', '.join(model.axes)}")
        unit = 180.0 / math.pi if name in ROTARY_AXES else 1.0
        limit, gain = model.axes[name].limits.velocity, model.axes[name].controller.position_gain
        velocity = VELOCITY if limit is None else unit * limit
        made.append(HalAxis(name, gain or GAIN, velocity, given["following"] or 1.0))
    joints = "".join(JOINT.format(k=k, axis=axis) for k, axis in enumerate(made))
    texts = {
        f"{output}.hal": hal_text(tuple(made), given["period"], motion=motion),
        f"{output}.ini": INI.format(name=output, nanoseconds=round(given["period"] * 1e9)) + joints,
    }
    for file, text in texts.items():
        write_text(file, text)
    start = ["/usr/lib/linuxcnc/realtime start", f"halcmd -i {output}.ini -f {output}.hal", "halcmd start"]
    stop = ["halcmd stop", "halcmd unload all", "/usr/lib/linuxcnc/realtime stop"]
    if motion:
        start = [f"linuxcnc YOUR.ini, with HALFILE = {output}.hal in its [HAL]", "home all joints, machine off"]
        stop = ["quit LinuxCNC"]
    play = f"splinefeed stream SOURCE --machine {machine} --to linuxcnc"
    return {"files": list(texts), "axes": list(names), "start": start, "stream": play, "stop": stop}


linuxcnc.add_command(init, "init")
