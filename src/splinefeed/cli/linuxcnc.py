"""`splinefeed linuxcnc`: the HAL file of a machine that follows a stream, and how to start it."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import Any

import click

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
    """Prepare LinuxCNC's HAL for streams, or plan its motion.

    Examples:
      splinefeed linuxcnc planner --ini mill.ini
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
--machine       NAME|FILE        The machine; see splinefeed machine list.
--limits limits_file  FILE       Limits in a TOML file, as run takes them: they make a machine, or hold in
                                 place of its own.
--axes          NAMES            Which of its axes, in order.  [default: all]
--period        TIME =1 ms       Servo period.
--following     LENGTH           Following error that stops the stream.  [default: 1 mm or deg]
--motion        -                Together with LinuxCNC's motion controller, which then shows the tool tip.
-o --output     NAME =splinefeed  NAME.hal, NAME.ini
""")
def init(say: Say, output: str, motion: bool, **given: Any) -> Page:
    """Write a HAL file with streamer, one controller an axis, and simulated drives to replace with your own.

    Examples:
      splinefeed linuxcnc init --machine router
      splinefeed linuxcnc init --machine my-table.toml -o mill --axes x,y,z
      splinefeed linuxcnc init --limits limits.toml
    """
    import math

    from splinefeed.files.atomic import write_text
    from splinefeed.live.hal_files import GAIN, VELOCITY, HalAxis, hal_text
    from splinefeed.machine import ServoAxis
    from splinefeed.machine.limits_toml import letter
    from splinefeed.records import ROTARY_AXES

    model, _ = options.machine_under(given)
    names = tuple(map(letter, given["axes"] or model.axes))
    if not names:
        raise InputError(f"{model.name}: has a control but no axes; choose another machine")
    made = []
    for name in names:
        if name not in model.axes:
            raise InputError(f"--axes: {model.name} has no axis {name!r}; it has {', '.join(model.axes)}")
        unit = 180.0 / math.pi if name in ROTARY_AXES else 1.0
        axis = model.axes[name]
        limit, gain = axis.limits.velocity, axis.controller.position_gain if isinstance(axis, ServoAxis) else 0.0
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
    files = {"--machine": given["machine"], "--limits": given["limits_file"]}
    words = [f"{option} {file}" for option, file in files.items() if file]
    play = f"splinefeed stream SOURCE {' '.join(words)} --to linuxcnc"
    return {"files": list(texts), "axes": list(names), "start": start, "stream": play, "stop": stop}


@answers(lambda page: [])
@options.table("""
--ini           FILE             INI file of the machine, with TPMOD = splinefeed_tp in its [TRAJ].
--reserve       NUMBER =0.05     Share of the acceleration, and twice that of the jerk, kept for pause and override.
--window        COUNT =60        Cells that are looked ahead over.
""")
def planner(say: Say, ini: str, reserve: float, window: int) -> Page:
    """Plan the motion of a LinuxCNC whose [TRAJ] has TPMOD = splinefeed_tp. Ends with Ctrl-C.

    Examples:
      splinefeed linuxcnc planner --ini mill.ini
      splinefeed linuxcnc planner --ini mill.ini --reserve 0.1
    """
    from splinefeed.live.linuxcnc_limits import mill_of
    from splinefeed.live.linuxcnc_serve import serve, warm_up

    if not ini:
        raise InputError("--ini is missing: give the INI file of the machine")
    if not 0.0 < reserve < 0.4:
        raise InputError(f"--reserve is {reserve:g}; it must lie between 0 and 0.4")
    mill = mill_of(ini)
    tell = partial(click.echo, err=True)
    for note in mill.notes:
        tell(note)
    say("getting ready")
    warm_up(mill)
    say("")
    with suppress(KeyboardInterrupt):
        serve(mill, reserve, window, tell)
    return {}


linuxcnc.add_command(init, "init")
linuxcnc.add_command(planner, "planner")
